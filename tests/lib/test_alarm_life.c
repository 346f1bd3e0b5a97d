/* SPDX-License-Identifier: MIT */
/* The life of the alarms: nothing is sent too early, too often or twice, nothing is lost, and what
 * was raised is held, acknowledged and cleared as the policy says, for each detector on its own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "monitor/alarm_life.h"

enum { REGIONS = RIM_DETECTOR_RIM, MOTION = RIM_DETECTOR_INTERFERENCE, MODEL = 0x56789 };

static const rim_alarm_life_config CONFIG = {
    .slot = {{.raise_steps = 3, .clear_steps = 5, .inhibit_s = 1.0, .update_ratio = 0.2},
             {.raise_steps = 1, .clear_steps = 1, .inhibit_s = 1.0, .update_ratio = 0.2}},
    .policy = {.stale_s = 20.0},
    .model_id = MODEL};

static rim_alarm_life life;
static rim_alarm out;

static void start(const rim_alarm_life_config *config, bool latch) {
  rim_alarm_life_config c = *config;
  c.policy.latch = latch;
  assert_int_equal(rimi_alarm_life_init(&life, &c), RIM_OK);
}

static rim_alarm finding(double ln_anom, rim_level level) {
  rim_alarm a = sample_alarm(6);
  a.ln_anom = ln_anom;
  a.level = (uint8_t)level;
  a.flags = 0xff; /* not looked at, as state, seq, detector and model */
  return a;
}

/* One row in which `detector` says this; returns whether a record leaves, into `out`. */
static bool row(int detector, double t_s, const rim_alarm *candidate) {
  rimi_alarm_life_row(&life, t_s);
  rimi_alarm_life_step(&life, (rim_detector)detector, t_s, candidate);
  return rimi_alarm_life_next_record(&life, &out);
}

static bool is_empty(void) {
  rim_alarm record;
  return !rimi_alarm_life_next_record(&life, &record);
}

static void is(int detector, rim_alarm_state state, rim_level level, unsigned flags, uint32_t seq) {
  assert_int_equal(out.detector, detector);
  assert_int_equal(out.state, state);
  assert_int_equal(out.level, level);
  assert_int_equal(out.flags, flags);
  assert_int_equal(out.seq, seq);
  assert_int_equal(out.model_id, MODEL);
}

static void raise(int detector, double t_s) {
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  const uint32_t steps = life.config.slot[detector].raise_steps;
  for (uint32_t i = 0; i + 1 < steps; ++i)
    assert_false(row(detector, t_s - 0.1 * (steps - 1 - i), &a));
  assert_true(row(detector, t_s, &a));
  assert_int_equal(out.state, RIM_ALARM_RAISED);
}

/* The cause goes away: so many steps without a finding. */
static bool end(int detector, double t_s) {
  const uint32_t steps = life.config.slot[detector].clear_steps;
  for (uint32_t i = 0; i + 1 < steps; ++i)
    assert_false(row(detector, t_s - 0.1 * (steps - 1 - i), NULL));
  return row(detector, t_s, NULL);
}

static rim_level level(void) { return rimi_alarm_life_level(&life); }

/* ---- one alarm ---- */

static void is_raised_after_so_many_steps_in_a_row(void **state) {
  (void)state;
  const rim_alarm want = finding(20.0, RIM_LEVEL_ERROR);
  start(&CONFIG, false);
  assert_false(row(REGIONS, 0.0, &want));
  assert_false(row(REGIONS, 0.1, &want));
  assert_int_equal(level(), RIM_LEVEL_WARN); /* found, but not for long enough */
  assert_true(row(REGIONS, 0.2, &want));
  is(REGIONS, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 1);
  assert_int_equal(level(), RIM_LEVEL_ERROR);
  assert_true(out.t_s == 0.2 && out.since_s == want.since_s);
  assert_memory_equal(&out.region, &want.region, sizeof want.region);
  assert_true(is_empty());
  /* Interrupted, by a warning too, the count begins again. */
  const rim_alarm warning = finding(9.0, RIM_LEVEL_WARN);
  for (int what = 0; what < 2; ++what) {
    start(&CONFIG, false);
    for (int i = 0; i < 50; ++i)
      assert_false(row(REGIONS, 0.1 * i, i % 3 != 2 ? &want : what ? &warning : NULL));
    assert_int_equal(life.raised, 0);
  }
}

static void zero_steps_raise_at_once(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR), warning = finding(9.0, RIM_LEVEL_WARN);
  const rim_alarm_life_config zero = {.model_id = MODEL};
  start(&zero, false);
  assert_false(row(REGIONS, 0.0, NULL));
  assert_false(row(REGIONS, 0.0, &warning));
  assert_true(row(REGIONS, 0.0, &a));
  is(REGIONS, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 1);
  /* And without a count for clearing it stands for ever, which is no latching. */
  for (int i = 1; i < 1000; ++i)
    assert_false(row(REGIONS, i, NULL));
  assert_int_equal(level(), RIM_LEVEL_ERROR);
}

static void updates_are_inhibited(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 0.2);
  rim_alarm a = finding(30.0, RIM_LEVEL_ERROR);
  assert_false(row(REGIONS, out.t_s, &a)); /* nor in the same moment */
  assert_false(row(REGIONS, 0.3, &a));
  assert_false(row(REGIONS, 1.19, &a));
  assert_true(row(REGIONS, 1.21, &a));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 2);
  assert_true(out.ln_anom == 30.0);
  /* Little has moved: no update, however long. */
  a.ln_anom = 33.0;
  assert_false(row(REGIONS, 10.0, &a));
  a.channel[0]++;
  assert_true(row(REGIONS, 10.1, &a));
  a.kind = (uint8_t)(a.kind == 0);
  assert_false(row(REGIONS, 10.9, &a));
  assert_true(row(REGIONS, 11.2, &a));
  a.region.dims = (uint8_t)(a.region.dims == 2 ? 3 : 2);
  assert_true(row(REGIONS, 12.3, &a));
  a.region.feature[1]++;
  assert_true(row(REGIONS, 13.4, &a));
  assert_int_equal(out.seq, 6);
}

/* Another region is news, however little its score has moved; what lies beyond its features is not
 * of it. */
static void another_region_is_news(void **state) {
  (void)state;
  start(&CONFIG, false);
  rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  a.region.dims = 2;
  for (double t_s = 0.0; t_s < 0.25; t_s += 0.1)
    (void)row(REGIONS, t_s, &a);
  is(REGIONS, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 1);
  a.region.feature[2]++;
  assert_false(row(REGIONS, 10.0, &a));
  for (uint32_t d = 0; d < 2; ++d) {
    a.region.feature[d]++;
    assert_true(row(REGIONS, 20.0 + 10.0 * d, &a));
    is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 2 + d);
    assert_int_equal(out.region.feature[d], a.region.feature[d]);
  }
}

static void a_clock_that_goes_back_inhibits_nothing(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 100.0);
  const rim_alarm a = finding(30.0, RIM_LEVEL_ERROR);
  assert_true(row(REGIONS, 1.0, &a));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 2);
}

static void is_cleared_once_with_the_region_it_had(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 0.2);
  const rim_alarm ok = finding(1.0, RIM_LEVEL_OK);
  const rim_region region = out.region;
  for (int i = 0; i < 4; ++i)
    assert_false(row(REGIONS, 1.0 + i, i % 2 ? NULL : &ok));
  assert_int_equal(level(), RIM_LEVEL_ERROR); /* as long as it stands */
  assert_true(row(REGIONS, 5.0, NULL));
  is(REGIONS, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 2);
  assert_true(out.t_s == 5.0);
  assert_memory_equal(&out.region, &region, sizeof region);
  assert_int_equal(level(), RIM_LEVEL_OK);
  for (int i = 0; i < 10; ++i)
    assert_false(row(REGIONS, 6.0 + i, NULL));
  raise(REGIONS, 30.2); /* it can come again */
  assert_int_equal(out.seq, 3);
  assert_int_equal(life.raised, 2);
}

/* Raised at the alarm's score, it stands until the score is below the warning's. */
static void a_warning_holds_what_was_raised(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 0.2);
  const rim_alarm warning = finding(21.0, RIM_LEVEL_WARN);
  for (int i = 0; i < 4; ++i)
    assert_false(row(REGIONS, 1.0 + 0.1 * i, NULL));
  for (int i = 0; i < 12; ++i)
    assert_false(row(REGIONS, 2.0 + i, &warning));
  assert_int_equal(level(), RIM_LEVEL_ERROR);
  for (int i = 0; i < 4; ++i) /* the count of steps without a finding has begun anew */
    assert_false(row(REGIONS, 15.0 + 0.1 * i, NULL));
  assert_true(row(REGIONS, 15.4, NULL));
  is(REGIONS, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 2);
  assert_false(row(REGIONS, 16.0, &warning));
  assert_int_equal(level(), RIM_LEVEL_WARN);
}

/* ---- silence ---- */

static void goes_stale_once_and_comes_back(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 0.2);
  assert_false(rimi_alarm_life_idle(&life, 20.1));
  assert_true(is_empty());
  assert_true(rimi_alarm_life_idle(&life, 29.0)); /* noticed late */
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_STALE, 0, 2);
  assert_true(out.t_s == 20.2); /* when it became so */
  assert_int_equal(level(), RIM_LEVEL_STALE);
  assert_false(rimi_alarm_life_idle(&life, 90.0));
  assert_true(is_empty());
  /* The input is back, the finding not yet gone: the alarm stands as it stood. */
  assert_true(row(REGIONS, 91.0, NULL));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 3);
  assert_true(out.t_s == 91.0);
  assert_int_equal(life.stale_times, 1);
}

static void silence_without_an_alarm_is_told_too(void **state) {
  (void)state;
  start(&CONFIG, false);
  assert_false(rimi_alarm_life_idle(&life, 100.0)); /* nothing has come yet: counts from here */
  assert_false(rimi_alarm_life_idle(&life, 119.0));
  assert_true(rimi_alarm_life_idle(&life, 121.0));
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_NONE, RIM_LEVEL_STALE, 0, 1);
  assert_true(out.t_s == 120.0 && out.since_s == 120.0 && out.region.dims == 0);
  assert_true(row(REGIONS, 3.0, NULL)); /* another clock: rows have their own */
  is(REGIONS, RIM_ALARM_NONE, RIM_LEVEL_OK, 0, 2);
  assert_true(is_empty());
  assert_false(rimi_alarm_life_idle(&life, (double)NAN));
  assert_false(rimi_alarm_life_idle(&life, (double)INFINITY));
  assert_false(rimi_alarm_life_idle(&life, -1e300));
  assert_int_equal(level(), RIM_LEVEL_OK);
  start(&CONFIG, false);
  life.config.policy.stale_s = 0.0;
  assert_false(row(REGIONS, 0.0, NULL));
  assert_false(rimi_alarm_life_idle(&life, 1e9)); /* never */
}

static void steps_across_a_silence_are_not_in_a_row(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  for (int asked = 0; asked < 2; ++asked) { /* whether or not somebody has asked meanwhile */
    start(&CONFIG, false);
    assert_false(row(REGIONS, 0.0, &a));
    assert_false(row(REGIONS, 0.1, &a));
    if (asked) {
      assert_true(rimi_alarm_life_idle(&life, 50.0));
      assert_true(rimi_alarm_life_next_record(&life, &out));
    }
    assert_int_equal(row(REGIONS, 50.1, &a), asked);
    assert_int_equal(life.stale_times, 1);
    assert_false(row(REGIONS, 50.2, &a));
    assert_true(row(REGIONS, 50.3, &a));
    assert_int_equal(out.state, RIM_ALARM_RAISED);
  }
}

/* ---- latch, acknowledge, clear ---- */

static rim_status command(rim_command_code code, uint32_t sequence, uint32_t *forget) {
  const rim_command c = {sequence, MODEL, (uint8_t)code};
  const rim_status status = rimi_alarm_life_command(&life, &c, 32, forget);
  if (status == RIM_OK)
    (void)rimi_alarm_life_next_record(&life, &out);
  return status;
}

static rim_status acknowledge(uint32_t sequence) {
  uint32_t forget = 1;
  const rim_status status = command(RIM_COMMAND_ACKNOWLEDGE, sequence, &forget);
  assert_int_equal(forget, 0);
  return status;
}

static void is_held_until_acknowledged(void **state) {
  (void)state;
  start(&CONFIG, true);
  raise(REGIONS, 0.2);
  assert_int_equal(out.flags, 0); /* its cause is there: not latched yet */
  assert_true(end(REGIONS, 2.0));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, RIM_ALARM_FLAG_LATCHED, 2);
  for (int i = 0; i < 50; ++i)
    assert_false(row(REGIONS, 3.0 + i, NULL));
  assert_int_equal(level(), RIM_LEVEL_ERROR);
  assert_int_equal(acknowledge(2), RIM_OK);
  is(REGIONS, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 3);
  assert_int_equal(acknowledge(0), RIM_E_DATA); /* nothing stands */
}

static void acknowledged_it_goes_with_its_cause(void **state) {
  (void)state;
  for (int latch = 0; latch < 2; ++latch) {
    start(&CONFIG, latch);
    raise(REGIONS, 0.2);
    assert_int_equal(acknowledge(1), RIM_OK);
    is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, RIM_ALARM_FLAG_ACKNOWLEDGED, 2);
    assert_int_equal(acknowledge(2), RIM_OK); /* twice is once */
    assert_true(is_empty());
    assert_int_equal(life.seq, 2);
    assert_true(end(REGIONS, 2.0));
    is(REGIONS, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 3);
    raise(REGIONS, 9.0); /* and the next one has to be acknowledged again */
    assert_int_equal(out.flags, 0);
  }
}

static void a_latched_cause_that_comes_back_goes_on(void **state) {
  (void)state;
  start(&CONFIG, true);
  raise(REGIONS, 0.2);
  assert_true(end(REGIONS, 2.0));
  const rim_alarm a = finding(50.0, RIM_LEVEL_ERROR), warning = finding(9.0, RIM_LEVEL_WARN);
  for (int i = 0; i < 9; ++i)
    assert_false(row(REGIONS, 3.0 + i, &warning)); /* a warning does not bring it back */
  assert_false(row(REGIONS, 12.1, &a));
  assert_false(row(REGIONS, 12.2, &a));
  assert_true(row(REGIONS, 12.3, &a));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 3);
  assert_int_equal(life.raised, 1);
}

/* The safety reviewer's case: of two alarms each is held for its own acknowledgement. */
static void each_alarm_is_latched_on_its_own(void **state) {
  (void)state;
  for (int first = 0; first < 2; ++first) {
    const int a = first ? MOTION : REGIONS, b = first ? REGIONS : MOTION;
    start(&CONFIG, true);
    raise(a, 1.0);
    raise(b, 2.0);
    assert_true(end(b, 4.0));
    is(b, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, RIM_ALARM_FLAG_LATCHED, 3);
    assert_int_equal(acknowledge(1), RIM_OK); /* the one that goes on */
    is(a, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, RIM_ALARM_FLAG_ACKNOWLEDGED, 4);
    assert_int_equal(acknowledge(3), RIM_OK); /* the latched one */
    is(b, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 5);
    assert_int_equal(level(), RIM_LEVEL_ERROR);
    assert_true(end(a, 6.0));
    is(a, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 6);
  }
}

static void a_command_means_one_record(void **state) {
  (void)state;
  uint32_t forget = 9;
  start(&CONFIG, false);
  raise(REGIONS, 1.0);
  life.seq = 0x1233; /* as after as many records */
  raise(MOTION, 2.0);
  const rim_command wrong[] = {{0, 0, RIM_COMMAND_CLEAR}, /* names nothing */
                               {0, MODEL, RIM_COMMAND_CLEAR},
                               {0x1234, 0, RIM_COMMAND_CLEAR},
                               {0x1235, MODEL, RIM_COMMAND_CLEAR},
                               {0x34, MODEL, RIM_COMMAND_CLEAR},
                               {0x1234, MODEL ^ 0x100, RIM_COMMAND_CLEAR},
                               {0, MODEL ^ 0x100, RIM_COMMAND_ACKNOWLEDGE}};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    assert_int_equal(rimi_alarm_life_command(&life, &wrong[i], 32, &forget), RIM_E_DATA);
    assert_int_equal(forget, 0);
  }
  const rim_command unknown = {0, 0, 3};
  assert_int_equal(rimi_alarm_life_command(&life, &unknown, 32, &forget), RIM_E_RANGE);
  assert_int_equal(rimi_alarm_life_command(&life, NULL, 32, &forget), RIM_E_ARGUMENT);
  assert_int_equal(rimi_alarm_life_command(NULL, &unknown, 32, &forget), RIM_E_ARGUMENT);
  assert_int_equal(rimi_alarm_life_command(&life, &unknown, 32, NULL), RIM_E_ARGUMENT);
  assert_true(is_empty());
  /* On CAN the low bits say enough. */
  const rim_command low = {0x34, MODEL & 0xffu, RIM_COMMAND_CLEAR};
  assert_int_equal(rimi_alarm_life_command(&life, &low, 8, &forget), RIM_OK);
  assert_int_equal(forget, 1u << MOTION);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(MOTION, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 0x1235);
  assert_true(is_empty());
  /* But not when they fit both: nobody shall acknowledge what he has not seen. */
  life.seq = 0x100;
  raise(MOTION, 3.0);
  assert_int_equal(life.slot[REGIONS].record.seq, 1);
  const rim_command both = {0x01, MODEL, RIM_COMMAND_ACKNOWLEDGE};
  const rim_command both8 = {0x01, MODEL & 0xffu, RIM_COMMAND_ACKNOWLEDGE};
  assert_int_equal(rimi_alarm_life_command(&life, &both8, 8, &forget), RIM_E_DATA);
  assert_int_equal(rimi_alarm_life_command(&life, &both, 32, &forget), RIM_OK);
  assert_true(life.slot[REGIONS].acknowledged && !life.slot[MOTION].acknowledged);
}

/* On 8 bits 0 is the number of every 256th record: it has to fit like any other. */
static void zero_on_can_is_a_number(void **state) {
  (void)state;
  uint32_t forget;
  const rim_command zero = {0, MODEL & 0xffu, RIM_COMMAND_CLEAR};
  start(&CONFIG, false);
  life.seq = 0xfe;
  raise(REGIONS, 1.0); /* record 255 */
  assert_int_equal(rimi_alarm_life_command(&life, &zero, 8, &forget), RIM_E_DATA);
  start(&CONFIG, false);
  life.seq = 0xff;
  raise(REGIONS, 1.0); /* record 256 */
  assert_int_equal(rimi_alarm_life_command(&life, &zero, 8, &forget), RIM_OK);
  assert_int_equal(forget, 1u << REGIONS);
}

static void zero_means_any_where_the_policy_says_so(void **state) {
  (void)state;
  uint32_t forget;
  const rim_command all = {0, 0, RIM_COMMAND_CLEAR};
  const rim_command other = {0, MODEL ^ 0x100, RIM_COMMAND_CLEAR};
  start(&CONFIG, false);
  raise(REGIONS, 1.0);
  raise(MOTION, 2.0);
  assert_int_equal(rimi_alarm_life_command(&life, &all, 8, &forget), RIM_E_DATA);
  assert_int_equal(forget, 0);
  assert_int_equal(level(), RIM_LEVEL_ERROR);
  life.config.policy.command_any = true;
  assert_int_equal(rimi_alarm_life_command(&life, &other, 32, &forget), RIM_E_DATA);
  assert_int_equal(rimi_alarm_life_command(&life, &all, 8, &forget), RIM_OK);
  assert_int_equal(forget, 1u << REGIONS | 1u << MOTION);
  assert_int_equal(level(), RIM_LEVEL_OK);
}

static void a_latch_that_ends_lets_go(void **state) {
  (void)state;
  start(&CONFIG, true);
  rim_alarm_policy policy = life.config.policy;
  policy.latch = false;
  raise(MOTION, 0.2);
  assert_true(end(MOTION, 2.0));
  raise(REGIONS, 3.0);
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_OK);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(MOTION, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 4);
  start(&CONFIG, true);
  raise(REGIONS, 0.2);
  assert_true(end(REGIONS, 2.0));
  raise(MOTION, 3.0);
  policy.replay = true;
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_OK);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_CLEARED, RIM_LEVEL_OK, RIM_ALARM_FLAG_REPLAY, 4);
  assert_true(is_empty()); /* the other one's cause is there */
  policy.stale_s = -1.0;
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_E_CONFIG);
  policy.stale_s = (double)NAN;
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_E_CONFIG);
  assert_int_equal(rimi_alarm_life_set_policy(&life, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rimi_alarm_life_set_policy(NULL, &policy), RIM_E_ARGUMENT);
  assert_true(life.config.policy.stale_s == 20.0);
}

/* ---- two alarms, one sequence ---- */

static void records_wait_their_turn(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  start(&CONFIG, false);
  life.config.slot[REGIONS].raise_steps = 1;
  life.config.slot[REGIONS].inhibit_s = 0.0;
  life.config.slot[REGIONS].update_ratio = 0.0;
  rimi_alarm_life_row(&life, 1.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 1.0, &a);
  rimi_alarm_life_step(&life, RIM_DETECTOR_INTERFERENCE, 1.0, &a);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 1);
  /* The regions have something to say in every row: what waits goes first all the same, and an
   * interference that is over already is told whole. */
  rim_alarm b = finding(21.0, RIM_LEVEL_ERROR);
  rimi_alarm_life_row(&life, 2.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 2.0, &b);
  rimi_alarm_life_step(&life, RIM_DETECTOR_INTERFERENCE, 2.0, NULL);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(MOTION, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 2);
  assert_true(out.t_s == 1.0);
  b.ln_anom = 22.0;
  rimi_alarm_life_row(&life, 3.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 3.0, &b);
  rimi_alarm_life_step(&life, RIM_DETECTOR_INTERFERENCE, 3.0, NULL);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 3);
  assert_true(out.t_s == 3.0 && out.ln_anom == 22.0); /* two updates in one record */
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(MOTION, RIM_ALARM_CLEARED, RIM_LEVEL_OK, 0, 4);
  assert_true(is_empty());
}

static void what_stands_is_told_of(void **state) {
  (void)state;
  rim_alarm_status s;
  start(&CONFIG, false);
  rimi_alarm_life_status(&life, &s);
  assert_true(!s.stands && !s.acknowledged && s.records == 0 && s.newest.seq == 0);
  assert_int_equal(s.newest.model_id, MODEL);
  assert_null(rimi_alarm_life_standing(&life, RIM_DETECTOR_RIM));
  raise(REGIONS, 1.0);
  raise(MOTION, 2.0);
  rimi_alarm_life_status(&life, &s);
  assert_int_equal(s.newest.detector, MOTION);
  assert_int_equal(s.newest.seq, 2);
  assert_int_equal(acknowledge(2), RIM_OK);
  rimi_alarm_life_status(&life, &s);
  assert_true(s.stands && !s.acknowledged); /* not all */
  assert_true(end(MOTION, 3.0));
  rimi_alarm_life_status(&life, &s);
  assert_int_equal(s.newest.detector, REGIONS); /* comes to the front */
  assert_int_equal(s.newest.state, RIM_ALARM_RAISED);
  assert_int_equal(s.newest.seq, 1);
  assert_int_equal(s.records, 4);
  assert_int_equal(s.level, RIM_LEVEL_ERROR);
  assert_non_null(rimi_alarm_life_standing(&life, RIM_DETECTOR_RIM));
  assert_null(rimi_alarm_life_standing(&life, RIM_DETECTOR_INTERFERENCE));
  assert_null(rimi_alarm_life_standing(&life, (rim_detector)2));
  assert_int_equal(acknowledge(1), RIM_OK);
  rimi_alarm_life_status(&life, &s);
  assert_true(s.acknowledged);
  assert_true(end(REGIONS, 5.0));
  rimi_alarm_life_status(&life, &s);
  assert_true(!s.stands && !s.acknowledged);
  assert_int_equal(s.newest.state, RIM_ALARM_CLEARED);
  assert_int_equal(s.newest.seq, s.records);
}

static void both_are_stale_and_both_come_back(void **state) {
  (void)state;
  start(&CONFIG, false);
  raise(REGIONS, 1.0);
  raise(MOTION, 2.0);
  assert_true(rimi_alarm_life_idle(&life, 30.0));
  for (int i = 0; i < 2; ++i) {
    assert_true(rimi_alarm_life_next_record(&life, &out));
    is(i, RIM_ALARM_UPDATED, RIM_LEVEL_STALE, 0, 3u + (uint32_t)i);
  }
  assert_true(is_empty());
  rimi_alarm_life_row(&life, 31.0);
  for (int i = 0; i < 2; ++i) {
    assert_true(rimi_alarm_life_next_record(&life, &out));
    is(i, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, 0, 5u + (uint32_t)i);
  }
  assert_true(is_empty());
}

/* ---- begun anew ---- */

static void a_restart_of_the_clock_is_told(void **state) {
  (void)state;
  for (int latch = 0; latch < 2; ++latch) {
    start(&CONFIG, latch);
    raise(REGIONS, 100.0);
    raise(MOTION, 101.0);
    rimi_alarm_life_restart(&life, 5.0);
    for (int i = 0; i < 2; ++i) {
      assert_true(rimi_alarm_life_next_record(&life, &out));
      is(i, latch ? RIM_ALARM_UPDATED : RIM_ALARM_CLEARED, latch ? RIM_LEVEL_ERROR : RIM_LEVEL_OK,
         latch ? RIM_ALARM_FLAG_LATCHED : 0, 3u + (uint32_t)i);
      assert_true(out.t_s == 5.0);
    }
    assert_true(is_empty());
    rimi_alarm_life_restart(&life, 3.0); /* told already */
    assert_true(is_empty());
    assert_false(rimi_alarm_life_idle(&life, 20.0)); /* and silence is counted from there */
    assert_true(rimi_alarm_life_idle(&life, 24.0));
  }
}

static void a_reset_forgets_silently(void **state) {
  (void)state;
  start(&CONFIG, true);
  raise(REGIONS, 1.0);
  assert_true(rimi_alarm_life_idle(&life, 30.0));
  rimi_alarm_life_reset(&life);
  assert_true(is_empty());
  assert_int_equal(level(), RIM_LEVEL_OK);
  assert_int_equal(life.stale_times, 1);
  assert_true(life.config.policy.latch);
  raise(REGIONS, 0.5);
  assert_int_equal(out.seq, 2); /* numbers count on */
  assert_int_equal(life.raised, 2);
}

static void what_stands_can_be_told_again(void **state) {
  (void)state;
  start(&CONFIG, true);
  rimi_alarm_life_repeat(&life);
  assert_true(is_empty());
  raise(REGIONS, 1.0);
  assert_true(end(REGIONS, 2.0));
  const double ln_anom = out.ln_anom;
  rim_alarm_life copy = life; /* as from a file */
  memset(&life, 0xee, sizeof life);
  life = copy;
  rimi_alarm_life_repeat(&life);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_UPDATED, RIM_LEVEL_ERROR, RIM_ALARM_FLAG_LATCHED, 3);
  assert_true(out.ln_anom == ln_anom);
  assert_true(is_empty());
}

static void misuse_is_refused(void **state) {
  (void)state;
  start(&CONFIG, false);
  const rim_alarm_life before = life;
  rim_alarm_life_config bad = CONFIG;
  assert_int_equal(rimi_alarm_life_init(NULL, &CONFIG), RIM_E_ARGUMENT);
  assert_int_equal(rimi_alarm_life_init(&life, NULL), RIM_E_ARGUMENT);
  bad.slot[1].inhibit_s = -1.0;
  assert_int_equal(rimi_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  bad = CONFIG;
  bad.slot[0].update_ratio = (double)INFINITY;
  assert_int_equal(rimi_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  bad = CONFIG;
  bad.policy.stale_s = (double)NAN;
  assert_int_equal(rimi_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  rimi_alarm_life_step(&life, (rim_detector)2, 1.0, &a);
  rimi_alarm_life_step(&life, RIM_DETECTOR_INTERFERENCE, (double)NAN, &a);
  assert_memory_equal(&life, &before, sizeof life);
}

static void numbers_wrap_without_zero(void **state) {
  (void)state;
  start(&CONFIG, false);
  life.seq = UINT32_MAX;
  life.tickets = UINT32_MAX - 1;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  life.config.slot[REGIONS].raise_steps = 1;
  rimi_alarm_life_row(&life, 1.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_INTERFERENCE, 1.0, &a); /* ticket of 2^32 - 1 */
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 1.0, &a);          /* ticket of 0 */
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(MOTION, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 1);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  is(REGIONS, RIM_ALARM_RAISED, RIM_LEVEL_ERROR, 0, 2);
}

/* ---- any history ---- */

/* What a listener knows of one detector's alarm. */
typedef struct listener {
  bool stands, latched, acknowledged;
} listener;

static void hear(listener *l, const rim_alarm_life_config *config) {
  listener *of = &l[out.detector];
  const bool latched = (out.flags & RIM_ALARM_FLAG_LATCHED) != 0;
  const bool acknowledged = (out.flags & RIM_ALARM_FLAG_ACKNOWLEDGED) != 0;
  assert_true(out.state != RIM_ALARM_RAISED || !of->stands);
  assert_true((out.state != RIM_ALARM_UPDATED && out.state != RIM_ALARM_CLEARED) || of->stands);
  assert_true(out.state != RIM_ALARM_NONE || (!l[0].stands && !l[1].stands));
  assert_true(!latched || (config->policy.latch && out.state != RIM_ALARM_CLEARED));
  assert_false(latched && acknowledged);
  of->stands = out.state == RIM_ALARM_RAISED || out.state == RIM_ALARM_UPDATED;
  of->latched = latched;
  of->acknowledged = acknowledged;
}

static rim_alarm_life_config any_config(uint32_t *random) {
  rim_alarm_life_config config = {
      .policy = {.stale_s = 1.5, .latch = sample_next(random) % 2u, .command_any = true},
      .model_id = MODEL};
  for (size_t i = 0; i < RIM_DETECTORS; ++i) {
    config.slot[i].raise_steps = sample_next(random) % 4u;
    config.slot[i].clear_steps = sample_next(random) % 5u;
    config.slot[i].inhibit_s = sample_between(random, 0.0, 2.0);
    config.slot[i].update_ratio = 0.1;
  }
  return config;
}

/* Whatever is found, asked and commanded, with at most one record a turn: of each alarm RAISED and
 * CLEARED alternate, numbers have no gap, with a latch nothing is cleared without an
 * acknowledgement, and nobody waits for more than one turn. */
static void any_history_is_well_formed(void **state) {
  (void)state;
  uint32_t random = 20240229u, cleared = 0, latched = 0, stale = 0;
  print_message("seed %u\n", (unsigned)random);
  for (int run = 0; run < 400; ++run) {
    const rim_alarm_life_config config = any_config(&random);
    listener heard[RIM_DETECTORS] = {{false, false, false}, {false, false, false}};
    bool seen[RIM_DETECTORS] = {false, false}; /* acknowledged since it was raised */
    uint32_t seq = 0;
    double now_s = 0.0;
    assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
    for (int i = 0; i < 400; ++i) {
      const rim_alarm a = finding(sample_between(&random, 10.0, 40.0),
                                  sample_next(&random) % 4u ? RIM_LEVEL_ERROR : RIM_LEVEL_WARN);
      const uint32_t what = sample_next(&random) % 64u;
      const rim_command c = {sample_next(&random) % 2u ? 0 : seq, 0, RIM_COMMAND_ACKNOWLEDGE};
      uint32_t forget;
      now_s += sample_between(&random, 0.0, 1.0);
      if (what < 4) {
        stale += rimi_alarm_life_idle(&life, now_s + 1.0);
      } else if (what == 5) {
        for (size_t d = 0; d < RIM_DETECTORS; ++d)
          if (life.slot[d].stands && (c.sequence == 0 || c.sequence == life.slot[d].record.seq))
            seen[d] = true;
        (void)rimi_alarm_life_command(&life, &c, 32, &forget);
      } else {
        rimi_alarm_life_row(&life, now_s);
        for (uint32_t d = 0; d < RIM_DETECTORS; ++d)
          rimi_alarm_life_step(&life, (rim_detector)d, now_s, (what >> (3 + d) & 1u) ? &a : NULL);
      }
      if (!rimi_alarm_life_next_record(&life, &out))
        continue;
      assert_int_equal(out.seq, ++seq);
      hear(heard, &config);
      cleared += out.state == RIM_ALARM_CLEARED;
      latched += heard[out.detector].latched;
      assert_true(out.state != RIM_ALARM_CLEARED || !config.policy.latch || seen[out.detector]);
      assert_true(!heard[out.detector].acknowledged || seen[out.detector]);
      if (out.state == RIM_ALARM_CLEARED)
        seen[out.detector] = false;
      assert_false(life.slot[0].due && life.slot[1].due);
    }
    assert_true(seq > 0);
  }
  assert_true(cleared > 1000 && latched > 100 && stale > 1000);
}

static void is_over_at_once_when_the_end_is_known(void **state) {
  (void)state;
  rim_alarm_life alarms;
  rim_alarm record;
  const rim_alarm a = {.level = RIM_LEVEL_ERROR, .ln_anom = 9.0};
  assert_int_equal(rimi_alarm_life_init(&alarms, &CONFIG), RIM_OK);
  assert_false(rimi_alarm_life_over(&alarms, RIM_DETECTOR_RIM, 1.0)); /* nothing stands */
  while (!alarms.slot[RIM_DETECTOR_RIM].stands) {
    rimi_alarm_life_row(&alarms, 1.0);
    rimi_alarm_life_step(&alarms, RIM_DETECTOR_RIM, 1.0, &a);
  }
  assert_false(rimi_alarm_life_over(&alarms, RIM_DETECTOR_RIM, 1.0)); /* not told yet */
  assert_true(rimi_alarm_life_next_record(&alarms, &record) && record.state == RIM_ALARM_RAISED);
  assert_false(rimi_alarm_life_over(&alarms, (rim_detector)RIM_DETECTORS, 2.0));
  assert_false(rimi_alarm_life_over(&alarms, RIM_DETECTOR_RIM, NAN));
  assert_true(rimi_alarm_life_over(&alarms, RIM_DETECTOR_RIM, 2.0));
  assert_true(rimi_alarm_life_next_record(&alarms, &record) && record.state == RIM_ALARM_CLEARED);
  assert_true(record.t_s == 2.0 && record.ln_anom == 9.0);
  assert_false(rimi_alarm_life_over(&alarms, RIM_DETECTOR_RIM, 3.0));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(is_raised_after_so_many_steps_in_a_row),
      cmocka_unit_test(zero_steps_raise_at_once),
      cmocka_unit_test(updates_are_inhibited),
      cmocka_unit_test(another_region_is_news),
      cmocka_unit_test(a_clock_that_goes_back_inhibits_nothing),
      cmocka_unit_test(is_cleared_once_with_the_region_it_had),
      cmocka_unit_test(a_warning_holds_what_was_raised),
      cmocka_unit_test(is_over_at_once_when_the_end_is_known),
      cmocka_unit_test(goes_stale_once_and_comes_back),
      cmocka_unit_test(silence_without_an_alarm_is_told_too),
      cmocka_unit_test(steps_across_a_silence_are_not_in_a_row),
      cmocka_unit_test(is_held_until_acknowledged),
      cmocka_unit_test(acknowledged_it_goes_with_its_cause),
      cmocka_unit_test(a_latched_cause_that_comes_back_goes_on),
      cmocka_unit_test(each_alarm_is_latched_on_its_own),
      cmocka_unit_test(a_command_means_one_record),
      cmocka_unit_test(zero_on_can_is_a_number),
      cmocka_unit_test(zero_means_any_where_the_policy_says_so),
      cmocka_unit_test(a_latch_that_ends_lets_go),
      cmocka_unit_test(records_wait_their_turn),
      cmocka_unit_test(what_stands_is_told_of),
      cmocka_unit_test(both_are_stale_and_both_come_back),
      cmocka_unit_test(a_restart_of_the_clock_is_told),
      cmocka_unit_test(a_reset_forgets_silently),
      cmocka_unit_test(what_stands_can_be_told_again),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(numbers_wrap_without_zero),
      cmocka_unit_test(any_history_is_well_formed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
