/* SPDX-License-Identifier: MIT */
/* interference_watch: the monitor with the detector of motion interference beside the regions, on
 * a vehicle that is held or pushed at known rows (images: monitor_bench.h). */
#include "monitor/interference_watch.h"
#include "monitor/monitor_private.h"
#include "monitor_bench.h"

enum { HELD_AT = 300, FREE_AT = 340, COMMAND = 0 };

/* The outcome that is the speed. */
static uint16_t speed_of(bool external) { return external ? 1 : 0; }

static rim_interference_model model(void) {
  rim_interference_model m = {.ln_odds = 1e6, /* the CUSUMs decide */
                              .accel_mps2 = 1.0,
                              .decel_mps2 = 1.0,
                              .settle_s = 0.5,
                              .gap_s = 2.0,
                              .one_step = {0.03, 0.06, 1.0, 8.0},
                              .open_loop = {0.03, 0.06, 1.0, 12.0}};
  for (size_t i = 0; i < RIM_INTERFERENCE_STATES; ++i) {
    for (size_t j = 0; j < RIM_INTERFERENCE_STATES; ++j)
      m.transition[i][j] = 0.2;
    for (size_t k = 0; k < RIM_INTERFERENCE_GAUSSIANS; ++k)
      m.sd[i][k] = 1.0;
  }
  return m;
}

static recipe watched(bool external) {
  recipe r;
  if (external)
    external_recipe(&r);
  else
    trained_recipe(&r);
  const rim_interference_model m = model();
  bytes *b = &r.section[RIM_SECTION_INTERFERENCE];
  b->size = RIM_INTERFERENCE_BYTES;
  assert_int_equal(rimi_interference_pack(&m, b->byte, b->size), RIM_OK);
  u16(&r.section[RIM_SECTION_INTERFERENCE_INPUTS], COMMAND);
  u16(&r.section[RIM_SECTION_INTERFERENCE_INPUTS], speed_of(external));
  return r;
}

typedef struct drive {
  image blob;
  _Alignas(8) uint8_t memory[EXTERNAL_SIZE + TRAINED_SIZE + RIM_MONITOR_INTERFERENCE_BYTES];
  rim_monitor *monitor;
  bool external;
  double speed, command; /* true speed; command in force */
  size_t command_at;     /* feature */
} drive;

static size_t bytes_of(bool external) { return size_of(external) + RIM_MONITOR_INTERFERENCE_BYTES; }

static void start_drive(drive *d, const recipe *r, bool external) {
  memset(d, 0, sizeof *d);
  d->external = external;
  build(&d->blob, r);
  assert_int_equal(
      rim_monitor_init(&d->monitor, d->memory, sizeof d->memory, d->blob.byte, d->blob.size),
      RIM_OK);
}

static double commanded(uint32_t t) { return t % 100 < 20 ? 0.0 : t % 100 < 60 ? 0.7 : 0.3; }

/* share: of the commanded speed that is reached; 1 nominal. */
static rim_verdict ride(drive *d, uint32_t t, double share) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, t);
  const double most = (share < 1.0 ? 3.0 : 1.0) * PERIOD_S;
  d->speed += rimi_clamp(d->command * share - d->speed, -most, most);
  d->command = commanded(t);
  const double measured = d->speed + 0.02 * rimi_rng_normal(&rng);
  double context[D] = {0.0, d->external ? 0.0 : measured, d->external ? 150.0 : 0.0, 0.5};
  context[d->command_at] = d->command;
  const double outcome[O] = {0.0, measured}, mean[O] = {0.0, d->command}, sd[O] = {1.0, 1.0};
  const rim_observation now = {.t_s = 1.0 + PERIOD_S * (double)t,
                               .context = context,
                               .outcome = outcome,
                               .mean = mean,
                               .sd = sd};
  rim_verdict v;
  assert_int_equal(rim_monitor_step(d->monitor, &now, &v), RIM_OK);
  return v;
}

static bool is_held(uint32_t t) { return t > HELD_AT && t <= FREE_AT; }

static uint64_t ride_digest(drive *d, uint32_t from, uint32_t to) {
  uint64_t digest = RIM_DIGEST_START;
  for (uint32_t t = from; t < to; ++t) {
    const rim_verdict v = ride(d, t, is_held(t) ? 0.1 : 1.0);
    digest = rim_verdict_digest(digest, &v);
  }
  return digest;
}

static rim_status status_of(const recipe *r) {
  static drive d;
  build(&d.blob, r);
  size_t size = 0;
  const rim_status status =
      rim_monitor_init(&d.monitor, d.memory, sizeof d.memory, d.blob.byte, d.blob.size);
  assert_int_equal(rim_monitor_size(d.blob.byte, d.blob.size, &size), status);
  return status;
}

static void its_sections_are_checked(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    const recipe good = watched(external);
    assert_int_equal(status_of(&good), RIM_OK);
    recipe r = good;
    r.section[RIM_SECTION_INTERFERENCE].size = 0;
    assert_int_equal(status_of(&r), RIM_E_CONFIG);
    r = good;
    r.section[RIM_SECTION_INTERFERENCE_INPUTS].size = 0;
    assert_int_equal(status_of(&r), RIM_E_CONFIG);
    r = good;
    u16(&r.section[RIM_SECTION_INTERFERENCE_INPUTS], 0);
    assert_int_equal(status_of(&r), RIM_E_CONFIG);
    r = good;
    r.section[RIM_SECTION_INTERFERENCE_INPUTS].byte[0] = D;
    assert_int_equal(status_of(&r), RIM_E_RANGE);
    r = good;
    r.section[RIM_SECTION_INTERFERENCE_INPUTS].byte[2] = O;
    assert_int_equal(status_of(&r), RIM_E_RANGE);
    r = good;
    r.section[RIM_SECTION_INTERFERENCE].byte[40] ^= 1;
    assert_int_equal(status_of(&r), RIM_E_CRC);
    r = good;
    r.section[RIM_SECTION_INTERFERENCE].size -= 8;
    assert_int_equal(status_of(&r), RIM_E_TRUNCATED);
  }
}

static void its_memory_is_checked_and_not_left(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    drive d;
    const recipe r = watched(external);
    start_drive(&d, &r, external);
    size_t told = 0;
    assert_int_equal(rim_monitor_size(d.blob.byte, d.blob.size, &told), RIM_OK);
    const size_t need = bytes_of(external);
    assert_int_equal(told, need);
    assert_int_equal(rim_monitor_init(&d.monitor, d.memory, need - 1, d.blob.byte, d.blob.size),
                     RIM_E_SIZE);
    memset(d.memory, 0xa5, sizeof d.memory);
    assert_int_equal(rim_monitor_init(&d.monitor, d.memory, need, d.blob.byte, d.blob.size),
                     RIM_OK);
    (void)ride_digest(&d, 0, 400);
    for (size_t i = need; i < sizeof d.memory; ++i)
      assert_int_equal(d.memory[i], 0xa5);
  }
}

static void a_held_and_a_pushed_vehicle_are_told(void **state) {
  (void)state;
  for (int pushed = 0; pushed < 2; ++pushed) {
    for (int external = 0; external < 2; ++external) {
      drive d;
      const recipe r = watched(external);
      start_drive(&d, &r, external);
      uint32_t raised_at = 0, cleared_at = 0, seq = 0;
      for (uint32_t t = 0; t < 600; ++t) {
        const rim_verdict v = ride(&d, t, is_held(t) ? (pushed ? 2.0 : 0.1) : 1.0);
        assert_non_null(v.interference);
        if (v.interference->alarmed)
          assert_int_equal(v.level, RIM_LEVEL_ERROR);
        else
          assert_int_equal(v.level, RIM_LEVEL_OK);
        if (v.alarm.state == RIM_ALARM_NONE)
          continue;
        assert_int_equal(v.alarm.seq, ++seq);
        assert_int_equal(v.alarm.detector, RIM_DETECTOR_INTERFERENCE);
        assert_int_equal(v.alarm.kind, pushed ? RIM_KIND_PUSHED : RIM_KIND_BLOCKED);
        assert_int_equal(v.alarm.channels, 1);
        assert_int_equal(v.alarm.channel[0], speed_of(external));
        if (v.alarm.state == RIM_ALARM_RAISED) {
          assert_int_equal(raised_at, 0);
          raised_at = t;
          const double onset_s = 1.0 + PERIOD_S * HELD_AT;
          assert_true(rimi_abs(v.alarm.since_s - onset_s) <= 23.0 * PERIOD_S);
        } else if (v.alarm.state == RIM_ALARM_CLEARED) {
          cleared_at = t;
        }
      }
      /* Held at rest, rows 300 to 319 show nothing. */
      assert_true(raised_at > HELD_AT + 20 && raised_at < HELD_AT + 26);
      assert_true(cleared_at > FREE_AT && cleared_at < FREE_AT + 30);
      const rim_monitor_health health = rim_monitor_get_health(d.monitor);
      assert_int_equal(health.alarms, 1);
      assert_int_equal(rim_interference_get_health(d.monitor).alarms, 1);
      assert_int_equal(rim_interference_get_health(d.monitor).rows, 600);
    }
  }
}

/* Any feature may be the command. */
static void the_command_is_the_feature_that_is_named(void **state) {
  (void)state;
  for (size_t feature = 1; feature < D; ++feature) {
    drive as_ever, moved;
    recipe r = watched(true);
    start_drive(&as_ever, &r, true);
    put_u16(r.section[RIM_SECTION_INTERFERENCE_INPUTS].byte, (unsigned)feature);
    start_drive(&moved, &r, true);
    moved.command_at = feature;
    for (uint32_t t = 0; t < FREE_AT; ++t) {
      const double share = is_held(t) ? 0.1 : 1.0;
      const rim_verdict a = ride(&as_ever, t, share), b = ride(&moved, t, share);
      assert_true(a.interference->residual_mps == b.interference->residual_mps);
      assert_int_equal(a.interference->alarmed, b.interference->alarmed);
    }
    assert_int_equal(rim_interference_get_health(moved.monitor).alarms, 1);
  }
}

/* And nominal driving is silent. */
static void the_regions_do_not_notice_it(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    drive with, without;
    recipe r = watched(external);
    start_drive(&with, &r, external);
    r.section[RIM_SECTION_INTERFERENCE].size = r.section[RIM_SECTION_INTERFERENCE_INPUTS].size = 0;
    start_drive(&without, &r, external);
    for (uint32_t t = 0; t < 600; ++t) {
      rim_verdict a = ride(&with, t, 1.0);
      const rim_verdict b = ride(&without, t, 1.0);
      assert_int_equal(a.alarm.state, RIM_ALARM_NONE);
      assert_null(b.interference);
      assert_true(rim_verdict_digest(0, &a) != rim_verdict_digest(0, &b));
      a.interference = b.interference;
      assert_true(rim_verdict_digest(0, &a) == rim_verdict_digest(0, &b));
    }
    assert_int_equal(rim_interference_get_health(with.monitor).alarms, 0);
    assert_int_equal(rim_interference_get_health(without.monitor).rows, 0);
  }
}

/* A region alarm that says something in every row, and interference in the midst of it. */
static void records_of_both_leave_in_order(void **state) {
  (void)state;
  drive d;
  recipe r = watched(true);
  const double low[1] = {1e-9};
  put_threshold(&r.section[RIM_SECTION_THRESHOLD], O, low, 1);
  set_word(&r, RIM_CONFIG_PERSISTENCE, 1);
  set_word(&r, RIM_CONFIG_INHIBIT_MS, 0);
  start_drive(&d, &r, true);
  uint32_t seq = 0, raised[2] = {0}, regions_in_a_row = 0;
  for (uint32_t t = 0; t < 600; ++t) {
    const rim_verdict v = ride(&d, t, is_held(t) ? 0.1 : 1.0);
    if (v.alarm.state == RIM_ALARM_NONE)
      continue;
    assert_int_equal(v.alarm.seq, ++seq);
    raised[v.alarm.detector] += v.alarm.state == RIM_ALARM_RAISED;
    regions_in_a_row += v.alarm.detector == RIM_DETECTOR_RIM && v.interference->raised;
  }
  assert_true(raised[RIM_DETECTOR_RIM] >= 1);
  assert_int_equal(raised[RIM_DETECTOR_INTERFERENCE], 1);
  assert_int_equal(rim_monitor_get_health(d.monitor).alarms, raised[0] + raised[1]);
  print_message("raised while a region record went out: %u\n", regions_in_a_row);
}

/* A command that clears it makes the detector forget: what goes on is raised anew, by a number of
 * its own; and the regions are left alone. */
static void a_command_makes_it_forget(void **state) {
  (void)state;
  static drive d;
  const recipe r = watched(false);
  start_drive(&d, &r, false);
  uint32_t t = 0;
  while (t < FREE_AT && rim_monitor_standing(d.monitor, RIM_DETECTOR_INTERFERENCE) == NULL)
    (void)ride(&d, t, is_held(t) ? 0.1 : 1.0), ++t;
  const rim_alarm *standing = rim_monitor_standing(d.monitor, RIM_DETECTOR_INTERFERENCE);
  assert_non_null(standing);
  const rim_command clear = {standing->seq, standing->model_id, RIM_COMMAND_CLEAR};
  const uint32_t count = rimi_search_blocks(d.monitor->search);
  assert_int_equal(rim_monitor_command(d.monitor, &clear, 32), RIM_OK);
  assert_null(rim_monitor_standing(d.monitor, RIM_DETECTOR_INTERFERENCE));
  assert_int_equal(d.monitor->watch->state.rows, 0);
  assert_int_equal(rimi_search_blocks(d.monitor->search), count);
  assert_int_equal(rim_monitor_command(d.monitor, &clear, 32), RIM_E_DATA); /* it is gone */
  uint32_t raised = 0;
  for (const uint32_t end = t + 40; t < end; ++t) {
    const rim_verdict v = ride(&d, t, t % 100 < 60 ? 0.05 : 1.0);
    rim_alarm record;
    raised += v.alarm.state == RIM_ALARM_RAISED && v.alarm.seq > clear.sequence;
    while (rim_monitor_next_record(d.monitor, &record))
      raised += record.state == RIM_ALARM_RAISED && record.seq > clear.sequence;
  }
  assert_int_equal(raised, 1);
}

static void a_row_that_is_refused_is_not_seen(void **state) {
  (void)state;
  drive a, b;
  const recipe r = watched(false);
  start_drive(&a, &r, false);
  start_drive(&b, &r, false);
  const double nan_row[D] = {0.0, 0.0, rimi_from_bits(UINT64_C(0x7ff8000000000000)), 0.0};
  for (uint32_t t = 0; t < 400; ++t) {
    const double share = is_held(t) ? 0.1 : 1.0;
    const rim_observation bad = {.t_s = 1.0 + PERIOD_S * ((double)t - 0.5), .context = nan_row};
    rim_verdict v;
    assert_int_equal(rim_monitor_step(b.monitor, &bad, &v), RIM_OK);
    assert_false(v.valid || v.interference != NULL);
    rim_verdict of_a = ride(&a, t, share), of_b = ride(&b, t, share);
    assert_true(rim_verdict_digest(0, &of_a) == rim_verdict_digest(0, &of_b));
  }
  assert_int_equal(rim_interference_get_health(b.monitor).rows, 400);
}

static void reset_and_copy_go_on(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    drive whole, first, second;
    const recipe r = watched(external);
    start_drive(&whole, &r, external);
    start_drive(&first, &r, external);
    const uint32_t at = HELD_AT + 28; /* while it is alarmed */
    (void)ride_digest(&whole, 0, at);
    (void)ride_digest(&first, 0, at);
    memset(&second, 0, sizeof second);
    second = first;
    memset(&first, 0xee, sizeof first);
    assert_int_equal(rim_monitor_attach(&second.monitor, second.memory, bytes_of(external),
                                        second.blob.byte, second.blob.size),
                     RIM_OK);
    assert_true(ride_digest(&whole, at, 600) == ride_digest(&second, at, 600));
    drive fresh;
    start_drive(&fresh, &r, external);
    rim_monitor_reset(second.monitor);
    second.speed = second.command = 0.0;
    assert_true(ride_digest(&fresh, 0, 600) == ride_digest(&second, 0, 600));
    assert_int_equal(rim_interference_get_health(second.monitor).alarms, 2);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(its_sections_are_checked),
      cmocka_unit_test(its_memory_is_checked_and_not_left),
      cmocka_unit_test(a_held_and_a_pushed_vehicle_are_told),
      cmocka_unit_test(the_command_is_the_feature_that_is_named),
      cmocka_unit_test(the_regions_do_not_notice_it),
      cmocka_unit_test(records_of_both_leave_in_order),
      cmocka_unit_test(a_row_that_is_refused_is_not_seen),
      cmocka_unit_test(a_command_makes_it_forget),
      cmocka_unit_test(reset_and_copy_go_on),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
