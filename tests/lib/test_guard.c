/* SPDX-License-Identifier: MIT */
/* monitor/guard.c, search/search_guard.c, search/select_guard.c: one bit turned over anywhere it
 * matters is found before it is used, and nothing is found in memory that holds. */
#include "monitor/guard.h"

#include "monitor/monitor_private.h"
#include "search/search_private.h"

#include "monitor_bench.h"

enum { FLIPS = 400 };

static void turn(void *at, uint64_t bit) {
  ((uint8_t *)at)[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
}

/* Rows from..to-1; the row in which damage was found, or `to`. */
static uint32_t fly_until_found(const bench *b, uint32_t from, uint32_t to) {
  for (uint32_t t = from; t < to; ++t) {
    const rim_verdict v = step(b, 900, t, 0.0);
    if (v.level != RIM_LEVEL_INTEGRITY)
      continue;
    assert_int_equal(v.reason, RIM_REASON_INTEGRITY);
    assert_false(v.valid);
    assert_int_equal(v.alarm.seq, 0);
    assert_true(v.t_s > 0.0 && v.p_value == 1.0);
    return t;
  }
  return to;
}

/* The same monitor again and again, from a copy of its bytes. */
static bench before;

static const bench *fresh(bench *b, bool external) {
  if (before.monitor == NULL || before.external != external) {
    make_bench(&before, external);
    assert_int_equal(fly_until_found(&before, 0, 300), 300);
  }
  *b = before;
  assert_int_equal(
      rim_monitor_attach(&b->monitor, b->memory, sizeof b->memory, b->blob.byte, b->blob.size),
      RIM_OK);
  return b;
}

static void nothing_is_found_in_memory_that_holds(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    assert_int_equal(fly_until_found(&b, 0, ROWS), ROWS);
    assert_int_equal(rim_monitor_get_health(b.monitor).damage, 0);
    rim_monitor_restart(b.monitor, 1000.0);
    rim_monitor_reset(b.monitor);
    assert_true(rimi_guard_all(b.monitor));
    assert_int_equal(step(&b, 901, ROWS, 0.0).level == RIM_LEVEL_INTEGRITY, false);
  }
}

/* Every bit that a pointer, size, index or standing alarm may lie in. */
static void control_is_checked_before_it_is_used(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    rim_rng rng;
    rimi_rng_seed(&rng, 31u, (uint32_t)external);
    for (uint32_t i = 0; i < FLIPS; ++i) {
      bench b;
      fresh(&b, external);
      rim_monitor *m = b.monitor;
      size_t size;
      void *part = m;
      const uint32_t which = i % 3u;
      if (which == 0)
        size = offsetof(struct rim_monitor, life.slot);
      else if (which == 1)
        part = (void *)(uintptr_t)rimi_blocks_control(m->rows, &size);
      else
        part = (void *)(uintptr_t)(external ? rimi_select_control(m->select, &size)
                                            : rimi_search_control(m->search, &size));
      turn(part, rimi_rng_below(&rng, (uint32_t)(8u * size)));
      assert_int_equal(fly_until_found(&b, 300, 302), 300);
      assert_int_equal(rim_monitor_get_health(m).damage, RIM_DAMAGE_CONTROL);
      assert_int_equal(rim_monitor_alarms(m).level, RIM_LEVEL_STALE);
      assert_null(rim_monitor_standing(m, RIM_DETECTOR_RIM));
      assert_true(rim_monitor_membership(m, NULL) == 0.0);
    }
  }
}

/* What is kept of an alarm is summed whatever its state; its record while it stands or waits, or
 * was the last that was sent. */
static void a_kept_alarm_is_checked(void **state) {
  (void)state;
  for (uint32_t i = 0; i < 4 * RIM_DETECTORS; ++i) {
    bench b;
    fresh(&b, false);
    const uint32_t detector = i % RIM_DETECTORS;
    rim_alarm_slot *slot = &b.monitor->life.slot[detector];
    const bool stands = i / 2 == 1, waits = i / 2 == 2, told = i / 2 == 3;
    assert_true(rimi_guard_enter(b.monitor));
    slot->stands = stands;
    slot->due = waits;
    b.monitor->life.told = (uint8_t)(told ? detector : 1u - detector);
    rimi_guard_leave(b.monitor);
    turn(&slot->record.seq, 3);
    assert_int_equal(rimi_guard_header_holds(b.monitor), !stands && !waits && !told);
    turn(&slot->record.seq, 3);
    assert_true(rimi_guard_header_holds(b.monitor));
    turn(&slot->ticket, 2);
    assert_false(rimi_guard_header_holds(b.monitor));
  }
}

/* The record sent last is given to whoever repeats it, also after its alarm was cleared. */
static void the_record_of_a_cleared_alarm_is_checked(void **state) {
  (void)state;
  static bench b;
  make_bench(&b, false);
  uint32_t t = 0;
  rim_verdict v = {0};
  while (t < ROWS && v.alarm.state != RIM_ALARM_RAISED)
    v = step(&b, 904, t++, 1.0);
  assert_int_equal(v.alarm.state, RIM_ALARM_RAISED);
  const rim_command clear = {v.alarm.seq, v.alarm.model_id, RIM_COMMAND_CLEAR};
  assert_int_equal(rim_monitor_command(b.monitor, &clear, 32), RIM_OK);
  assert_int_equal(step(&b, 904, t++, 0.0).alarm.state, RIM_ALARM_CLEARED);
  assert_int_equal(fly_until_found(&b, t, t + 3), t + 3);
  const rim_alarm_status status = rim_monitor_alarms(b.monitor);
  assert_false(status.stands);
  assert_int_equal(status.newest.state, RIM_ALARM_CLEARED);
  turn(&b.monitor->life.slot[RIM_DETECTOR_RIM].record.shift[0], 62);
  assert_int_equal(rim_monitor_alarms(b.monitor).newest.seq, 0);
  assert_int_equal(fly_until_found(&b, t + 3, t + 5), t + 3);
}

/* Nobody acts on damaged memory: neither rows nor commands, and no record leaves. */
static void what_is_damaged_says_nothing(void **state) {
  (void)state;
  bench b;
  fresh(&b, false);
  turn(&b.monitor->life.seq, 3);
  rim_alarm record;
  const rim_alarm_policy policy = {.latch = true};
  const rim_command command = {1, 1, RIM_COMMAND_CLEAR};
  b.monitor->life.slot[0].due = true;
  assert_false(rim_monitor_next_record(b.monitor, &record));
  assert_int_equal(rim_monitor_set_policy(b.monitor, &policy), RIM_E_CRC);
  assert_int_equal(rim_monitor_command(b.monitor, &command, 32), RIM_E_CRC);
  assert_false(rim_monitor_idle(b.monitor, 1e6));
  rim_monitor_repeat(b.monitor);
  rim_monitor_restart(b.monitor, 5.0);
  rim_monitor_reset(b.monitor);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_CONTROL);
  assert_int_equal(rim_interference_get_health(b.monitor).rows, 0);
  assert_int_equal(fly_until_found(&b, 300, 301), 300);
  bench copy = b;
  assert_int_equal(rim_monitor_attach(&copy.monitor, copy.memory, sizeof copy.memory,
                                      copy.blob.byte, copy.blob.size),
                   RIM_E_DATA);
}

/* A block in the ring, the run's effects, what rows leave for the next. */
static void observations_are_gone_through(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, 32u, 0);
  for (uint32_t i = 0; i < FLIPS / 4u; ++i) {
    bench b;
    fresh(&b, false);
    rim_search *s = b.monitor->search;
    const uint32_t slot = rimi_rng_below(&rng, s->held), bit = rimi_rng_below(&rng, 8);
    switch (i % 7u) {
    case 0:
      turn(search_fine_residuals(s, slot), bit);
      break;
    case 1:
      turn(search_coarse_residuals(s, slot), bit);
      break;
    case 2:
      turn(search_features(s, slot), bit);
      break;
    case 3:
      turn(search_means(s, slot), bit);
      break;
    case 4:
      turn(search_predictions(s, slot), bit);
      break;
    case 5:
      turn(&search_times(s)[slot], bit);
      break;
    default:
      turn(search_gram(s, rimi_rng_below(&rng, CHANNELS)), 16u + bit);
      break;
    }
    assert_true(fly_until_found(&b, 300, 300 + 2 * TRAINED_RING) < 300 + 2 * TRAINED_RING);
    assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_RUN);
  }
}

static void bins_agree_among_each_other(void **state) {
  (void)state;
  bench b;
  fresh(&b, true);
  const rim_select *e = b.monitor->select;
  for (uint32_t f = 0; f < REGION; ++f)
    assert_true(rimi_select_bins_hold(e, f));
  assert_true(rimi_select_indices_hold(e));
  /* The sums come first in the engine's memory, after its head: the exponent of each is turned. */
  for (uint32_t i = 0; i < REGION * BINS * O; ++i) {
    fresh(&b, true);
    float *sum = (float *)(void *)((uint8_t *)b.monitor->select + RIM_SELECT_HEADER_BYTES) + i;
    turn(sum, 30);
    assert_true(fly_until_found(&b, 300, 304) < 304);
  }
}

static void the_image_is_gone_through(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, 33u, 0);
  const uint32_t rows = (uint32_t)(5.0 / PERIOD_S); /* what firmware/ASSURANCE.md promises */
  for (int external = 0; external < 2; ++external) {
    for (uint32_t i = 0; i < FLIPS / 4u; ++i) {
      bench b;
      fresh(&b, external);
      turn(b.blob.byte, rimi_rng_below(&rng, (uint32_t)(8u * b.blob.size)));
      const uint32_t found = fly_until_found(&b, 300, 300 + 4u * rows + 200u);
      assert_true(found < 300 + rows);
      assert_true(rim_monitor_get_health(b.monitor).damage != 0);
    }
  }
}

/* Its last bytes are summed up to its end: what the memory behind holds may change. */
static void what_lies_behind_the_image_is_not_of_it(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    fresh(&b, external);
    memset(b.blob.byte + b.blob.size, 0xff, sizeof b.blob.byte - b.blob.size);
    assert_int_equal(fly_until_found(&b, 300, 400), 400); /* several passes */
  }
}

/* Calls that follow no pointer sum the header alone: what else is damaged shows in the next row. */
static void a_quiet_call_accepts_no_damage(void **state) {
  (void)state;
  for (uint32_t i = 0; i < 8; ++i) {
    bench b;
    fresh(&b, false);
    rim_monitor *m = b.monitor;
    size_t size;
    uint8_t *control = (uint8_t *)(uintptr_t)rimi_blocks_control(m->rows, &size);
    const bool is_history = i >= 4;
    turn(is_history ? control + size + 4 : control + 4, 5);
    const rim_alarm_policy policy = m->life.config.policy;
    if (i % 4u == 0)
      (void)rim_monitor_idle(m, m->last.t_s);
    else if (i % 4u == 1)
      rim_monitor_repeat(m);
    else if (i % 4u == 2)
      assert_int_equal(rim_monitor_set_policy(m, &policy), RIM_OK);
    else
      rim_monitor_restart(m, 1e4); /* writes all of it, so it looks first */
    assert_int_equal(fly_until_found(&b, 300, 302), 300);
    assert_int_equal(rim_monitor_get_health(m).damage,
                     is_history ? RIM_DAMAGE_RUN : RIM_DAMAGE_CONTROL);
  }
}

/* A row that is refused leaves memory that is looked at again: nothing stays open. */
static void a_refused_row_accepts_no_damage(void **state) {
  (void)state;
  bench b;
  row r;
  rim_verdict v;
  fresh(&b, true);
  make_row(&r, true, 1, 300, 0.0);
  r.view.outcome = NULL;
  assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, 0);
  assert_true(rimi_guard_header_holds(b.monitor));
  turn(&b.monitor->last_valid_s, 5);
  assert_false(rimi_guard_header_holds(b.monitor));
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_CONTROL);
}

/* What follows an alarm is worked out in memory that was looked at whole. */
static void an_alarm_is_raised_from_memory_that_holds(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  uint32_t t = 0;
  for (; t < ROWS && b.monitor->life.raised == 0; ++t) {
    bench damaged = b;
    assert_int_equal(rim_monitor_attach(&damaged.monitor, damaged.memory, sizeof damaged.memory,
                                        damaged.blob.byte, damaged.blob.size),
                     RIM_OK);
    row r;
    rim_verdict v;
    make_row(&r, false, 902, t, 1.0);
    if (t % BLOCK == BLOCK - 1u) { /* just damaged, where no slice has come yet */
      const uint32_t words = (uint32_t)(damaged.blob.size / 4u);
      const uint32_t at = (damaged.monitor->guard.image_at + words / 2u) % words;
      turn(damaged.blob.byte + 4u * at, 7);
      assert_int_equal(rim_monitor_step(damaged.monitor, &r.view, &v), RIM_OK);
      assert_int_not_equal(v.alarm.state, RIM_ALARM_RAISED);
    }
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
  }
  assert_int_equal(b.monitor->life.raised, 1);
}

/* Sequence numbers and the policy go on, the observations do not, and the end of it is told. */
static void a_repair_goes_on(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  const rim_alarm_policy policy = {.stale_s = 3.0, .latch = true};
  assert_int_equal(rim_monitor_set_policy(b.monitor, &policy), RIM_OK);
  for (uint32_t t = 0; t < ROWS && b.monitor->life.seq == 0; ++t)
    step(&b, 903, t, 1.0);
  const uint32_t seq = b.monitor->life.seq;
  assert_true(seq > 0);
  for (int in_copy = 0; in_copy < 2; ++in_copy) {
    bench hit = b;
    assert_int_equal(rim_monitor_attach(&hit.monitor, hit.memory, sizeof hit.memory, hit.blob.byte,
                                        hit.blob.size),
                     RIM_OK);
    turn(in_copy ? (void *)&hit.monitor->guard.kept.seq : (void *)&hit.monitor->life.seq, 30);
    rim_monitor *m = NULL;
    assert_int_equal(
        rim_monitor_repair(&m, hit.memory, sizeof hit.memory, hit.blob.byte, hit.blob.size),
        RIM_OK);
    assert_int_equal(rim_monitor_get_health(m).damage, 0);
    assert_int_equal(rim_monitor_alarms(m).level, RIM_LEVEL_STALE);
    hit.monitor = m;
    const rim_verdict v = step(&hit, 903, ROWS, 0.0);
    assert_int_equal(v.alarm.state, RIM_ALARM_NONE);
    assert_int_equal(v.alarm.seq, seq + 1u);
    assert_true(m->life.config.policy.latch && m->life.config.policy.stale_s == 3.0);
    assert_int_equal(m->life.raised, b.monitor->life.raised);
  }
}

static void a_repair_refuses(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  rim_monitor *m = NULL;
  void *const memory = b.memory;
  assert_int_equal(rim_monitor_repair(&m, NULL, sizeof b.memory, b.blob.byte, b.blob.size),
                   RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_repair(&m, b.memory + 4, 4096, b.blob.byte, b.blob.size),
                   RIM_E_ALIGN);
  assert_int_equal(rim_monitor_repair(&m, memory, 64, b.blob.byte, b.blob.size), RIM_E_SIZE);
  turn(b.blob.byte, 8u * 200u);
  assert_int_equal(rim_monitor_repair(&m, memory, sizeof b.memory, b.blob.byte, b.blob.size),
                   RIM_E_CRC);
}

/* Gaps are counted among rows with predictions; where there were none, nobody reads them. */
static void gaps_are_checked_where_there_are_any(void **state) {
  (void)state;
  bench b;
  fresh(&b, true);
  rim_monitor *const m = b.monitor;
  assert_int_equal(m->gaps, 0);
  turn(&m->gap[0].after_s, 3);
  assert_true(rimi_guard_header_holds(m));
  turn(&m->last, 3); /* what lies behind them is read */
  assert_false(rimi_guard_header_holds(m));
  turn(&m->last, 3);
  turn(&m->gaps, 0);
  assert_false(rimi_guard_header_holds(m));
  assert_true((turn(&m->gaps, 0), rimi_guard_header_holds(m)));
  for (uint32_t some = 1; some <= MONITOR_GAPS; ++some) {
    assert_true(rimi_guard_enter(m));
    m->gaps = some;
    rimi_guard_leave(m);
    turn(&m->gap[some - 1].after_s, 3);
    assert_false(rimi_guard_header_holds(m));
    turn(&m->gap[some - 1].after_s, 3);
    assert_true(rimi_guard_header_holds(m));
  }
}

/* Memory that another library left holds by its own sums. */
static void memory_of_another_library_is_not_attached(void **state) {
  (void)state;
  static bench b;
  make_bench(&b, false);
  for (uint32_t i = 0; i < 3; ++i) {
    uint32_t *word[3] = {&b.monitor->magic, &b.monitor->library, &b.monitor->header_bytes};
    *word[i] ^= 1u;
    rimi_guard_fix(b.monitor);
    assert_true(rimi_guard_header_holds(b.monitor));
    rim_monitor *m = NULL;
    assert_int_equal(rim_monitor_attach(&m, b.memory, TRAINED_SIZE, b.blob.byte, b.blob.size),
                     RIM_E_DATA);
    *word[i] ^= 1u;
    rimi_guard_fix(b.monitor);
    assert_int_equal(rim_monitor_attach(&m, b.memory, TRAINED_SIZE, b.blob.byte, b.blob.size),
                     RIM_OK);
  }
}

/* A copy that was taken while a call ran, as is RAM that outlived a watchdog's reset: its sums are
 * those of before the call. */
static void what_was_copied_within_a_call_is_not_attached(void **state) {
  (void)state;
  for (int is_changed = 0; is_changed < 2; ++is_changed) {
    bench b;
    fresh(&b, false);
    b.monitor->guard.busy = 1;
    if (is_changed)
      b.monitor->life.seq = 12345;
    assert_true(rimi_guard_header_holds(b.monitor)); /* for who asks within the call */
    rim_monitor *m = NULL;
    assert_int_equal(rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size),
                     RIM_E_DATA);
    assert_null(m);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(memory_of_another_library_is_not_attached),
      cmocka_unit_test(what_was_copied_within_a_call_is_not_attached),
      cmocka_unit_test(gaps_are_checked_where_there_are_any),
      cmocka_unit_test(nothing_is_found_in_memory_that_holds),
      cmocka_unit_test(control_is_checked_before_it_is_used),
      cmocka_unit_test(a_kept_alarm_is_checked),
      cmocka_unit_test(the_record_of_a_cleared_alarm_is_checked),
      cmocka_unit_test(what_is_damaged_says_nothing),
      cmocka_unit_test(observations_are_gone_through),
      cmocka_unit_test(bins_agree_among_each_other),
      cmocka_unit_test(the_image_is_gone_through),
      cmocka_unit_test(what_lies_behind_the_image_is_not_of_it),
      cmocka_unit_test(a_quiet_call_accepts_no_damage),
      cmocka_unit_test(a_refused_row_accepts_no_damage),
      cmocka_unit_test(an_alarm_is_raised_from_memory_that_holds),
      cmocka_unit_test(a_repair_goes_on),
      cmocka_unit_test(a_repair_refuses),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
