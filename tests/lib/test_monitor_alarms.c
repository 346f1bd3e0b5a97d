/* SPDX-License-Identifier: MIT */
/* The monitor's alarms from outside: silence, commands, a clock that begins anew, calls without a
 * monitor (images: monitor_bench.h). What becomes of an alarm is asked in test_alarm_life.c. */
#include "image/correct.h"
#include "monitor/inspect.h"
#include "monitor/monitor_private.h"
#include "search/select_private.h"

#include "monitor_bench.h"

/* Row 0 .. of a run with a shift, until its alarm is raised; returns the next row. */
static uint32_t run_to_alarm(const bench *b) {
  for (uint32_t t = 0; t < ROWS; ++t)
    if (step(b, 3, t, b->external ? 0.8 : 0.15).alarm.state == RIM_ALARM_RAISED)
      return t + 1;
  fail();
  return 0;
}

static void silence_needs_no_row(void **state) {
  (void)state;
  bench b;
  rim_alarm record;
  make_bench(&b, true);
  assert_int_equal(step(&b, 3, 0, 0.0).level, RIM_LEVEL_OK);
  assert_false(rim_monitor_idle(b.monitor, 12.0)); /* row 0 came at 10 s, the image says 2 s */
  assert_true(rim_monitor_idle(b.monitor, 12.5));
  assert_true(rim_monitor_next_record(b.monitor, &record));
  assert_int_equal(record.state, RIM_ALARM_NONE);
  assert_int_equal(record.level, RIM_LEVEL_STALE);
  assert_true(record.seq == 1 && record.t_s == 12.0);
  assert_false(rim_monitor_next_record(b.monitor, &record));
  assert_int_equal(rim_monitor_get_health(b.monitor).stale, 1);
  assert_int_equal(rim_monitor_alarms(b.monitor).level, RIM_LEVEL_STALE);
  const rim_verdict back = step(&b, 3, 20, 0.0);
  assert_true(back.alarm.seq == 2 && back.alarm.level == RIM_LEVEL_OK);
  /* A silence in the log that nobody has asked about is counted, and not told. */
  assert_int_equal(step(&b, 3, 40, 0.0).alarm.seq, 0);
  assert_int_equal(rim_monitor_get_health(b.monitor).stale, 2);
  /* The application may want another limit. */
  const rim_alarm_policy policy = {.stale_s = 60.0, .replay = true};
  assert_int_equal(rim_monitor_set_policy(b.monitor, &policy), RIM_OK);
  assert_false(rim_monitor_idle(b.monitor, 79.0));
  assert_true(rim_monitor_idle(b.monitor, 81.0));
  assert_true(rim_monitor_next_record(b.monitor, &record));
  assert_int_equal(record.flags, RIM_ALARM_FLAG_REPLAY);
}

static void commands_are_obeyed(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    const double in[D] = {external ? 0.0 : 0.8, 0.0, external ? 175.0 : 0.0};
    rim_command command = {.command = RIM_COMMAND_ACKNOWLEDGE};
    rim_alarm record;
    assert_int_equal(rim_monitor_command(b.monitor, &command, 32), RIM_E_DATA);
    uint32_t t = run_to_alarm(&b);
    const rim_alarm raised = rim_monitor_alarms(b.monitor).newest;
    assert_int_equal(rim_monitor_command(b.monitor, &command, 32), RIM_E_DATA); /* names none */
    command.sequence = raised.seq;
    command.model_id = raised.model_id;
    assert_int_equal(rim_monitor_command(b.monitor, &command, 32), RIM_OK);
    assert_true(rim_monitor_next_record(b.monitor, &record));
    assert_int_equal(record.flags, RIM_ALARM_FLAG_ACKNOWLEDGED);
    assert_true(rim_monitor_alarms(b.monitor).acknowledged);
    command = (rim_command){record.seq, raised.model_id, RIM_COMMAND_CLEAR};
    assert_int_equal(rim_monitor_command(b.monitor, &command, 32), RIM_OK);
    assert_true(rim_monitor_next_record(b.monitor, &record));
    assert_int_equal(record.state, RIM_ALARM_CLEARED);
    assert_null(rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM));
    assert_true(rim_monitor_membership(b.monitor, in) == 0.0);
    const uint32_t rows = rim_monitor_get_health(b.monitor).rows.rows;
    assert_int_equal(step(&b, 3, t, 0.0).blocks, external); /* what was learnt is forgotten */
    assert_int_equal(rim_monitor_get_health(b.monitor).rows.rows, rows + 1); /* the run goes on */
    bool again = false;
    for (++t; t < 3 * ROWS && !again; ++t) /* and what is still there is found again */
      again = step(&b, 3, t, external ? 0.8 : 0.15).alarm.state == RIM_ALARM_RAISED;
    assert_true(again);
    assert_int_equal(rim_monitor_get_health(b.monitor).alarms, 2);
  }
}

static void a_clock_that_begins_anew_is_told(void **state) {
  (void)state;
  bench b, fresh;
  rim_alarm record;
  make_bench(&b, true);
  make_bench(&fresh, true);
  const rim_alarm_policy policy = {.latch = true};
  assert_int_equal(rim_monitor_set_policy(b.monitor, &policy), RIM_OK);
  (void)run_to_alarm(&b);
  rim_monitor_restart(b.monitor, 9.5);
  assert_true(rim_monitor_next_record(b.monitor, &record));
  assert_int_equal(record.state, RIM_ALARM_UPDATED);
  assert_int_equal(record.flags, RIM_ALARM_FLAG_LATCHED);
  assert_true(record.t_s == 9.5);
  const rim_verdict v = step(&b, 8, 0, 0.0), w = step(&fresh, 8, 0, 0.0);
  assert_true(v.valid && v.blocks == 1 && v.score == w.score);
  assert_true(v.level == RIM_LEVEL_ERROR && w.level == RIM_LEVEL_OK);
  rim_monitor_repeat(b.monitor);
  assert_true(rim_monitor_next_record(b.monitor, &record));
  assert_true(record.seq == 3 && record.flags == RIM_ALARM_FLAG_LATCHED);
}

static void nothing_is_read_where_there_is_none(void **state) {
  (void)state;
  bench b;
  rim_alarm record;
  const rim_alarm_policy policy = {.stale_s = 1.0};
  const rim_command command = {.command = RIM_COMMAND_CLEAR};
  make_bench(&b, true);
  assert_int_equal(rim_monitor_config(b.monitor, RIM_CONFIG_FEATURES), D);
  assert_int_equal(rim_monitor_config(b.monitor, RIM_CONFIG_WORDS), 0);
  assert_int_equal(rim_monitor_config(b.monitor, (rim_config_word)(RIM_CONFIG_WORDS + 1000)), 0);
  assert_int_equal(rim_monitor_config(NULL, RIM_CONFIG_FEATURES), 0);
  rim_monitor_reset(NULL);
  rim_monitor_restart(NULL, 0.0);
  rim_monitor_repeat(NULL);
  assert_false(rim_monitor_idle(NULL, 1e9));
  assert_false(rim_monitor_next_record(NULL, &record));
  assert_false(rim_monitor_next_record(b.monitor, NULL));
  assert_int_equal(rim_monitor_command(NULL, &command, 32), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_command(b.monitor, NULL, 32), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_set_policy(NULL, &policy), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_set_policy(b.monitor, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_alarms(NULL).level, RIM_LEVEL_STALE);
  assert_null(rim_monitor_standing(NULL, RIM_DETECTOR_RIM));
  assert_true(rim_monitor_membership(NULL, (const double[D]){0.0}) == 0.0);
  assert_true(rim_monitor_membership(b.monitor, NULL) == 0.0);
  assert_int_equal(rim_monitor_get_health(NULL).rows.rows, 0);
  assert_null(rimi_monitor_search(NULL));
  assert_null(rimi_monitor_place(NULL));
  assert_false(rimi_monitor_inside(NULL, (const uint8_t[REGION]){0}, 0));
  assert_null(rimi_monitor_threshold(NULL));
}

/* Scores relate a channel's evidence to the number of observations and to its own offset; the
 * membership is that of the channel which the alarm names, not of the one with the most evidence.
 * Here outcome 0 is shifted everywhere and outcome 1 only in a region, with a lower offset. */
static void membership_is_of_the_outcome_named(void **state) {
  (void)state;
  recipe r;
  external_recipe(&r);
  bytes *threshold = &r.section[RIM_SECTION_THRESHOLD];
  threshold->size = 0;
  const uint32_t counts[4] = {O, 1, 1, 1}; /* channels, runs, knots, rank */
  for (size_t i = 0; i < 4; ++i)
    u32(threshold, counts[i]);
  const double values[] = {4.0,  3.0,  0.5, 0.0, /* alarm, warning, promise, reserved */
                           4.0,  10.0,           /* maximum, e(n) */
                           20.0, 0.0,  1.0, 1.0 /* offsets, scales */};
  for (size_t i = 0; i < sizeof values / sizeof *values; ++i)
    f32(threshold, values[i]);
  bench b;
  b.external = true;
  build(&b.blob, &r);
  start(&b);
  rim_verdict v;
  for (uint32_t t = 0; t < ROWS; ++t) {
    row x;
    make_row(&x, true, 3, t, 0.8);
    x.outcome[0] += 0.5;
    assert_int_equal(rim_monitor_step(b.monitor, &x.view, &v), RIM_OK);
  }
  const float *evidence = rimi_select_channel_scores(rimi_monitor_search(b.monitor));
  assert_true((double)evidence[0] > (double)evidence[1] + 40.0);
  const rim_alarm *alarm = rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM);
  assert_non_null(alarm);
  assert_int_equal(alarm->channel[0], 1);
  assert_true(alarm->region.dims > 0);
  assert_true(rim_monitor_membership(b.monitor, (const double[D]){0.0, 0.0, 175.0, 0.0}) > 0.9);
  assert_true(rim_monitor_membership(b.monitor, (const double[D]){0.0, 0.0, 275.0, 0.0}) < 0.1);
}

/* ---- what is told of rows with the caller's predictions ---- */

static rim_monitor *open_external(bench *b, const recipe *r) {
  memset(b, 0, sizeof *b);
  b->external = true;
  build(&b->blob, r);
  start(b);
  b->monitor->guard.busy = true; /* as within a step: the sums are made when it ends */
  return b->monitor;
}

static void channels_by_their_scores(void **state) {
  (void)state;
  enum { MANY = 6 };
  recipe r = calibrated[1];
  set_word(&r, RIM_CONFIG_OUTCOMES, MANY);
  r.section[RIM_SECTION_NAMES].size = 0;
  for (const char *c = "a\nb\nc\nd\n0\n1\n2\n3\n4\n5\n"; *c; ++c)
    u8(&r.section[RIM_SECTION_NAMES], (uint8_t)*c);
  put_threshold(&r.section[RIM_SECTION_THRESHOLD], MANY, (const double[]){10.0}, 1);
  bench b;
  rim_monitor *m = open_external(&b, &r);
  float *score = (float *)(uintptr_t)rimi_select_channel_scores(m->select);
  const float of[MANY] = {20.0f, 50.0f, 5.0f, 40.0f, 30.0f, 11.0f};
  memcpy(score, of, sizeof of);
  rim_alarm a;
  const rim_verdict v = {.channel = 1, .level = RIM_LEVEL_ERROR};
  rimi_monitor_describe(m, &v, &a); /* without a row: nothing is sized */
  assert_int_equal(a.channels, RIM_ALARM_MAX_CHANNELS);
  const uint16_t order[RIM_ALARM_MAX_CHANNELS] = {1, 3, 4, 0};
  assert_memory_equal(a.channel, order, sizeof order);
  assert_int_equal(a.region.dims, 0);
  assert_int_equal(a.observations, 0);
  for (size_t i = 0; i < RIM_ALARM_MAX_CHANNELS; ++i)
    assert_true(a.shift[i] == 0.0 && a.shift_sd[i] == 0.0);
  score[0] = score[4] = 9.0f;
  rimi_monitor_describe(m, &v, &a);
  assert_int_equal(a.channels, 3);
  assert_int_equal(a.channel[2], 5);
}

/* An interval over the whole range of its feature is no region. */
static void the_whole_range_is_everywhere(void **state) {
  (void)state;
  for (uint32_t last = BINS - 2; last < BINS; ++last) {
    for (uint32_t first = 0; first < 2; ++first) {
      bench b;
      rim_monitor *m = open_external(&b, &calibrated[1]);
      m->guard.busy = false;
      for (uint32_t t = 0; t < 40; ++t)
        (void)step(&b, 930, t, 0.0);
      for (uint16_t f = 0; f < REGION; ++f) {
        slice *s = select_slice(m->select, 1, f);
        s->first = (uint8_t)first;
        s->last = (uint8_t)last;
        s->ln_anom = 1e6f;
      }
      select_channel(m->select, 1)->best_interval = 1e6f;
      rim_alarm a;
      const rim_verdict v = {.channel = 1, .level = RIM_LEVEL_ERROR};
      rimi_monitor_describe(m, &v, &a);
      assert_int_equal(a.region.dims, first == 0 && last == BINS - 1 ? 0 : 1);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(silence_needs_no_row),
      cmocka_unit_test(commands_are_obeyed),
      cmocka_unit_test(a_clock_that_begins_anew_is_told),
      cmocka_unit_test(nothing_is_read_where_there_is_none),
      cmocka_unit_test(membership_is_of_the_outcome_named),
      cmocka_unit_test(channels_by_their_scores),
      cmocka_unit_test(the_whole_range_is_everywhere),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
