/* SPDX-License-Identifier: MIT */
/* interference/detector.c at its ends: every number of a model at its limits, counters that are
 * full, rows and commands that fill their rings, times that are just long enough. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "interference/detector.h"
#include "interference_sample.h"

#define DT 0.0625 /* a double exactly, as all times below */

static rim_interference s;
static rim_interference_verdict v;

static void begin(void) {
  const rim_interference_model m = sample_interference();
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
}

static void step(double t_s, double command, double speed) {
  assert_int_equal(rimi_interference_step(&s, t_s, command, speed, &v), RIM_OK);
}

/* What a number of the model may be at least, and at most. */
typedef struct limit {
  size_t at;
  double least, most;
  bool least_is_out;
} limit;

static bool is_accepted(size_t at, double value) {
  rim_interference_model m = sample_interference();
  memcpy((uint8_t *)&m + at, &value, sizeof value);
  rim_interference state;
  const rim_status status = rimi_interference_init(&state, &m);
  assert_true(status == RIM_OK || status == RIM_E_DATA);
  return status == RIM_OK;
}

static void every_number_has_its_limits(void **unused) {
  (void)unused;
#define AT(field) offsetof(rim_interference_model, field)
  static const limit limits[] = {{AT(mean[3][1]), -1e300, 1e300, false},
                                 {AT(sd[0][0]), 0.0, 1e300, true},
                                 {AT(sd[4][2]), 0.0, 1e300, true},
                                 {AT(ln_odds), -1e300, 1e300, false},
                                 {AT(latency_s), 0.0, 1e300, false},
                                 {AT(accel_mps2), 0.0, 1e300, true},
                                 {AT(decel_mps2), 0.0, 1e300, true},
                                 {AT(limit_spread), 0.0, 0.9, false},
                                 {AT(settle_s), 0.0, 1e300, false},
                                 {AT(gap_s), 0.0, 1e300, true},
                                 {AT(one_step.sd_steady), 0.0, 1e300, true},
                                 {AT(one_step.sd_ramp), 0.0, 1e300, true},
                                 {AT(one_step.slack), 0.0, 1e300, false},
                                 {AT(one_step.threshold), 0.0, 1e300, true},
                                 {AT(open_loop.sd_steady), 0.0, 1e300, true},
                                 {AT(open_loop.threshold), 0.0, 1e300, true}};
#undef AT
  for (size_t i = 0; i < sizeof limits / sizeof *limits; ++i) {
    const limit *l = &limits[i];
    assert_int_equal(is_accepted(l->at, l->least), !l->least_is_out);
    assert_true(is_accepted(l->at, l->most));
    if (l->least >= 0.0)
      assert_false(is_accepted(l->at, -0.001));
    if (l->most < 1.0)
      assert_false(is_accepted(l->at, l->most + 0.001));
    assert_false(is_accepted(l->at, (double)NAN) || is_accepted(l->at, (double)INFINITY));
  }
}

/* Transitions of 0 and 1 are allowed where a row sums to 1. */
static void a_state_may_be_left_for_certain(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  for (size_t j = 0; j < 5; ++j)
    m.transition[2][j] = j == 0 ? 1.0 : 0.0;
  rim_interference state;
  assert_int_equal(rimi_interference_init(&state, &m), RIM_OK);
  for (size_t i = 0; i < 5; ++i) { /* whichever row does not sum to 1 */
    rim_interference_model wrong = sample_interference();
    wrong.transition[i][1] += 1e-5;
    assert_int_equal(rimi_interference_init(&state, &wrong), RIM_E_DATA);
  }
  m.transition[2][0] = 1.0 + 1e-7; /* its sum would pass */
  assert_int_equal(rimi_interference_init(&state, &m), RIM_E_DATA);
  m.transition[2][0] = 1.0 + 1e-7;
  m.transition[2][1] = -1e-7;
  assert_int_equal(rimi_interference_init(&state, &m), RIM_E_DATA);
}

/* The number of rows goes on below its largest value, and nothing else is seen of it. */
static void rows_go_on_when_their_number_is_full(void **unused) {
  (void)unused;
  begin();
  for (int k = 0; k < 24; ++k)
    step(DT * k, 0.5, 0.01 * k);
  rim_interference few = s;
  s.rows = UINT32_MAX - 7u; /* 24 and this are multiples of 8, plus 0 */
  assert_int_equal(s.rows % RIM_INTERFERENCE_J_ROWS, few.rows % RIM_INTERFERENCE_J_ROWS);
  for (int k = 24; k < 48; ++k) {
    rim_interference_verdict of_few;
    double a[3], b[3];
    step(DT * k, 0.5, 0.01 * k * k);
    assert_int_equal(rimi_interference_step(&few, DT * k, 0.5, 0.01 * k * k, &of_few), RIM_OK);
    assert_memory_equal(&v, &of_few, sizeof v);
    assert_true(rimi_interference_observation(&s, a) && rimi_interference_observation(&few, b));
    assert_memory_equal(a, b, sizeof a);
  }
  assert_true(s.rows > 48 && s.rows < UINT32_MAX - 24u);
}

static void full_counters_stay_full(void **unused) {
  (void)unused;
  begin();
  step(0.0, 0.5, 0.5);
  memset(&s.health, 0xff, sizeof s.health);
  const rim_interference_health full = s.health;
  step(-1.0, 0.5, 0.5);             /* back */
  step(DT, 0.5, (double)NAN);       /* not finite */
  step(2.0 * DT, (double)NAN, 0.5); /* no command */
  step(9.0, 0.5, 0.5);              /* a gap */
  for (int k = 0; k < 50; ++k)      /* more commands than wait */
    step(9.0 + 0.001 * (k + 1), 0.5 + 0.001 * k, 0.5);
  for (int k = 0; k < 50; ++k) /* an alarm */
    step(10.0 - DT + DT * (k + 1), 0.5, 0.0);
  assert_true(v.alarmed);
  assert_memory_equal(&s.health, &full, sizeof full);
}

/* Of more commands than there is room for the oldest takes effect before its time. */
static void commands_that_find_no_room(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  m.latency_s = 64.0;
  m.gap_s = 100.0;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  for (uint32_t k = 0; k < RIM_INTERFERENCE_COMMANDS; ++k)
    step(DT * k, 0.25 + 0.125 * k, 0.25);
  assert_int_equal(s.commands, RIM_INTERFERENCE_COMMANDS);
  assert_int_equal(s.health.command_overflow, 0);
  for (uint32_t k = 0; k < 3; ++k) {
    step(10.0 + DT * k, 100.0 + k, 0.25);
    assert_int_equal(s.commands, RIM_INTERFERENCE_COMMANDS);
    assert_int_equal(s.health.command_overflow, k + 1u);
    assert_true(s.in_force == 0.25 + 0.125 * k);
    assert_true(s.command_v[s.command_first] == 0.25 + 0.125 * (k + 1));
  }
  step(10.0 + DT * 3, 102.0, 0.25); /* the same command again is none */
  assert_int_equal(s.health.command_overflow, 3);
}

/* A time between rows, or without a command, of just the gap's length is none. */
static void a_gap_is_longer_than_its_time(void **unused) {
  (void)unused;
  for (int longer = 0; longer < 2; ++longer) {
    begin(); /* gap_s is 0.5 */
    step(1.0, 0.5, 0.5);
    step(1.5 + DT * longer, 0.5, 0.5);
    assert_int_equal(s.health.gaps, longer);
    begin();
    step(1.0, 0.5, 0.5);
    for (int k = 1; k < 8; ++k)
      step(1.0 + DT * k, (double)NAN, 0.5);
    step(1.5, (double)NAN, 0.5);
    assert_true(v.valid);
    if (longer) {
      step(1.5 + DT, (double)NAN, 0.5);
      assert_false(v.valid);
      assert_int_equal(s.hmm.resets, 1);
    }
  }
  begin();
  step(1.0, 0.5, 0.5);
  step(1.0, 0.5, 0.5); /* no time has passed */
  assert_false(v.valid);
  assert_int_equal(s.health.time_back, 1);
}

static void a_record_says_what_the_verdict_does(void **unused) {
  (void)unused;
  rim_alarm a;
  rim_interference_verdict of = {.t_s = 7.0,
                                 .alarmed = true,
                                 .kind = RIM_INTERFERENCE_PUSHED,
                                 .onset_s = 5.0,
                                 .residual_mps = -0.5,
                                 .ln_odds = 12.0};
  assert_true(rimi_interference_alarm(&of, 99, 3, &a));
  assert_int_equal(a.kind, RIM_KIND_PUSHED);
  assert_int_equal(a.detector, RIM_DETECTOR_INTERFERENCE);
  assert_int_equal(a.level, RIM_LEVEL_ERROR);
  assert_int_equal(a.model_id, 99);
  assert_int_equal(a.channels, 1);
  assert_int_equal(a.channel[0], 3);
  assert_true(a.t_s == 7.0 && a.since_s == 5.0 && a.shift[0] == -0.5 && a.ln_anom == 12.0 &&
              a.p_value == 1.0);
  of.kind = RIM_INTERFERENCE_BLOCKED;
  of.ln_odds = -3.0; /* found by a CUSUM, against the HMM */
  assert_true(rimi_interference_alarm(&of, 99, 3, &a));
  assert_int_equal(a.kind, RIM_KIND_BLOCKED);
  assert_true(a.ln_anom == 0.0);
  of.alarmed = false;
  assert_false(rimi_interference_alarm(&of, 99, 3, &a));
  assert_int_equal(a.level, RIM_LEVEL_OK);
  assert_int_equal(a.channels, 0);
  assert_true(a.t_s == 7.0 && a.p_value == 1.0);
  assert_false(rimi_interference_alarm(NULL, 99, 3, &a));
  assert_false(rimi_interference_alarm(&of, 99, 3, NULL));
}

/* Counters of 2 to 32 bits; half way round counts as forwards. */
static void wheels_of_few_bits(void **unused) {
  (void)unused;
  const double r = sqrt(0.5);
  rim_wheels w = {{r, r, -r, -r}, {r, -r, -r, r}, 0.25, 1.0, 2};
  const uint32_t zero[4] = {0, 0, 0, 0}, half[4] = {2, 2, 2, 2}, most[4] = {3, 3, 3, 3};
  double got[3];
  assert_int_equal(rimi_wheels_velocity(&w, zero, half, 1.0, got), RIM_OK);
  assert_true(fabs(got[2] - 2.0 / 0.25) < 1e-12); /* all wheels turn alike: it turns on the spot */
  assert_true(fabs(got[0]) < 1e-12 && fabs(got[1]) < 1e-12);
  assert_int_equal(rimi_wheels_velocity(&w, zero, most, 0.5, got), RIM_OK);
  assert_true(fabs(got[2] + 1.0 / 0.5 / 0.25) < 1e-12);
  assert_int_equal(rimi_wheels_velocity(&w, most, zero, 0.5, got), RIM_OK); /* and back round */
  assert_true(fabs(got[2] - 1.0 / 0.5 / 0.25) < 1e-12);
  const uint32_t beyond[4] = {0, 0, 0, 4};
  assert_int_equal(rimi_wheels_velocity(&w, zero, beyond, 1.0, got), RIM_E_DATA);
  assert_int_equal(rimi_wheels_velocity(&w, beyond, zero, 1.0, got), RIM_E_DATA);
  w.bits = 32;
  assert_int_equal(rimi_wheels_velocity(&w, zero, half, 1.0, got), RIM_OK);
  for (uint32_t bits = 1; bits <= 33; bits += 32) {
    w.bits = bits;
    assert_int_equal(rimi_wheels_velocity(&w, zero, zero, 1.0, got), RIM_E_DATA);
  }
  w.bits = 8;
  rim_wheels none = w;
  none.radius_m = 0.0;
  assert_int_equal(rimi_wheels_velocity(&none, zero, zero, 1.0, got), RIM_E_DATA);
  none = w;
  none.tick_m = 0.0;
  assert_int_equal(rimi_wheels_velocity(&none, zero, zero, 1.0, got), RIM_E_DATA);
  assert_int_equal(rimi_wheels_velocity(NULL, zero, zero, 1.0, got), RIM_E_ARGUMENT);
  assert_int_equal(rimi_wheels_velocity(&w, NULL, zero, 1.0, got), RIM_E_ARGUMENT);
  assert_int_equal(rimi_wheels_velocity(&w, zero, NULL, 1.0, got), RIM_E_ARGUMENT);
  assert_int_equal(rimi_wheels_velocity(&w, zero, zero, 1.0, NULL), RIM_E_ARGUMENT);
}

/* A command takes effect in the row of its time. From a standstill the vehicle accelerates. */
static void a_command_takes_effect_at_its_time(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  m.latency_s = 2.0 * DT;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  step(0.0, 0.0, 0.0);
  for (int k = 1; k < 4; ++k) {
    step(DT * k, 0.5, 0.0);
    assert_true(s.in_force == (k < 3 ? 0.0 : 0.5));
    assert_true(v.one_step_mps == 0.0);
  }
  step(DT * 4, 0.5, 0.0);
  assert_true(v.one_step_mps == -DT); /* 1 m/s^2 */
}

/* As many commands as can wait take effect in one row, and the last one until its end. */
static void all_that_waits_takes_effect_at_once(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  m.latency_s = 64.0;
  m.gap_s = 100.0;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  const uint32_t most = RIM_INTERFERENCE_COMMANDS;
  for (uint32_t k = 0; k < most; ++k)
    step(DT * k, k + 1 < most ? 0.001 * k : 2.0, 0.0);
  assert_int_equal(s.commands, most);
  step(64.0 + DT * most + 4.0, 2.0, 2.0);
  assert_true(s.commands == 0 && s.in_force == 2.0 && s.open_loop[0] == 2.0);
}

/* What moves as commanded is steady; a ramp counts as one until its very end. */
static void a_ramp_ends_after_its_last_row(void **unused) {
  (void)unused;
  begin();
  for (int k = 0; k < 4; ++k)
    step(DT * k, 0.5, 0.5);
  assert_true(s.ramp_until_s == 0.0);
  for (int after = 0; after < 2; ++after) {
    rim_interference copy = s;
    copy.ramp_until_s = DT * (after ? 3.5 : 4.0);
    assert_int_equal(rimi_interference_step(&copy, DT * 4, 0.5, 0.5 + 0.059, &v), RIM_OK);
    assert_int_equal(v.score[RIM_INTERFERENCE_ONE_STEP] > 0.0, after); /* 0.059 of 0.06 or 0.03 */
  }
}

/* Of two sums that are full the one-step residual's says when it began; a score of just 1 raises an
 * alarm, and one of just what clears does not clear it. */
static void scores_at_their_limits(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  m.one_step.sd_steady =
      0.0625; /* and a slack of 1: a residual of as much leaves the sum as it is */
  m.open_loop.sd_steady = 1e6;
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  for (int k = 0; k < 4; ++k)
    step(DT * k, 0.5, 0.5);
  const rim_interference steady = s;
  const double threshold = m.one_step.threshold;
  const double sum[4] = {threshold, 0.99 * threshold, 0.5 * threshold, 0.49 * threshold};
  for (int i = 0; i < 4; ++i) {
    s = steady;
    s.alarmed = i >= 2;
    s.sum[0][0] = sum[i];
    step(DT * 4, 0.5, 0.5 - 0.0625);
    assert_true(v.score[RIM_INTERFERENCE_ONE_STEP] == sum[i] / threshold);
    assert_int_equal(v.alarmed, i % 2 == 0);
  }
  s = steady;
  s.sum[0][0] = s.sum[1][0] = 1e6;
  s.sum_from_s[0][0] = 1.0;
  s.sum_from_s[1][0] = 2.0;
  step(DT * 4, 0.5, 0.25);
  assert_true(v.score[RIM_INTERFERENCE_ONE_STEP] == 2.0 &&
              v.score[RIM_INTERFERENCE_OPEN_LOOP] == 2.0);
  assert_true(v.raised && v.onset_s == 1.0);
}

/* The check sum is that of all bytes but its own, as any reader of the section works it out. */
static void a_section_has_the_usual_check_sum(void **unused) {
  (void)unused;
  const rim_interference_model m = sample_interference();
  uint8_t section[RIM_INTERFERENCE_BYTES];
  assert_int_equal(rimi_interference_pack(&m, section, sizeof section), RIM_OK);
  const uint32_t begun = rimi_crc32(0, section, 12);
  const uint32_t crc = rimi_crc32(begun, section + 16, sizeof section - 16);
  for (size_t i = 0; i < 4; ++i)
    assert_int_equal(section[12 + i], crc >> (8 * i) & 255u);
}

/* The model's odds say that it began after the last row in which they were below 1 %. */
static void an_onset_by_the_odds_is_the_last_quiet_row(void **unused) {
  (void)unused;
  rim_interference_model m = sample_interference();
  m.one_step.threshold = m.open_loop.threshold = 1e9; /* they say nothing */
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  double quiet_s = -1.0;
  for (int k = 0; k < 200 && !v.alarmed; ++k) {
    const double speed = k < 60 ? 0.5 : k < 64 ? 0.5 - 0.125 * (k - 59) : 0.0;
    step(DT * k, 0.5, speed);
    if (v.ln_odds < -4.6)
      quiet_s = DT * k;
  }
  assert_true(v.raised && v.alarmed && quiet_s > 55 * DT);
  assert_true(v.onset_s == quiet_s && v.since_onset_s == v.t_s - quiet_s && v.t_s > quiet_s);
}

/* The motion that is said is the likeliest: at rest, as commanded, and held. */
static void the_likeliest_motion_is_said(void **unused) {
  (void)unused;
  begin();
  static const struct {
    double command, speed;
    int rows;
    rim_motion motion;
  } of[] = {{0.0, 0.0, 40, RIM_MOTION_STOP},
            {0.5, 0.5, 60, RIM_MOTION_CONSTANT},
            {0.5, 0.0, 60, RIM_MOTION_MI},
            {0.0, 0.0, 60, RIM_MOTION_STOP}};
  int k = 0;
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    for (int row = 0; row < of[i].rows; ++row, ++k)
      step(DT * k, of[i].command, of[i].speed);
    assert_int_equal(v.motion, of[i].motion);
  }
}

/* A vehicle that moves at its first row did not begin by standing: any motion is as likely as any
 * other, and what holds it later is told by the odds. So it is after a reset under way. */
static void a_start_under_way_is_any_motion(void **state) {
  (void)state;
  rim_interference_model m = sample_interference();
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 3; ++k)
      m.sd[i][k] *= 3.0; /* no density above 1, which would make even standing possible */
  }
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
  for (uint32_t round = 0; round < 2; ++round) {
    double most = 0.0;
    for (uint32_t t = 0; t < 100; ++t) {
      rimi_interference_step(&s, 0.05 * (double)(100 * round + t + 1), 1.0, t < 60 ? 1.0 : 0.2, &v);
      most = v.score[RIM_INTERFERENCE_HMM] > most ? v.score[RIM_INTERFERENCE_HMM] : most;
      if (t == 59)
        assert_true(s.hmm.steps > 50 && v.motion == RIM_MOTION_CONSTANT && most < 1.0);
    }
    assert_true(most >= 1.0);
    rimi_interference_reset(&s);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_likeliest_motion_is_said),
                                     cmocka_unit_test(a_section_has_the_usual_check_sum),
                                     cmocka_unit_test(an_onset_by_the_odds_is_the_last_quiet_row),
                                     cmocka_unit_test(a_command_takes_effect_at_its_time),
                                     cmocka_unit_test(all_that_waits_takes_effect_at_once),
                                     cmocka_unit_test(a_ramp_ends_after_its_last_row),
                                     cmocka_unit_test(scores_at_their_limits),
                                     cmocka_unit_test(every_number_has_its_limits),
                                     cmocka_unit_test(a_state_may_be_left_for_certain),
                                     cmocka_unit_test(rows_go_on_when_their_number_is_full),
                                     cmocka_unit_test(full_counters_stay_full),
                                     cmocka_unit_test(commands_that_find_no_room),
                                     cmocka_unit_test(a_gap_is_longer_than_its_time),
                                     cmocka_unit_test(a_record_says_what_the_verdict_does),
                                     cmocka_unit_test(wheels_of_few_bits),
                                     cmocka_unit_test(a_start_under_way_is_any_motion)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
