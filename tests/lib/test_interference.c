/* SPDX-License-Identifier: MIT */
/* The interference detector on motions worked out by hand; its model's bytes against damage. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/rng.h"
#include "interference/detector.h"
#include "interference_sample.h"

#define SEED 89u
#define DT 0.05

static uint64_t words[RIM_INTERFERENCE_BYTES / 8 + 2];
static uint8_t *const bytes = (uint8_t *)words;
static rim_interference s;
static rim_interference_verdict v;

static void near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

static void begin(void) {
  const rim_interference_model m = sample_interference();
  assert_int_equal(rimi_interference_init(&s, &m), RIM_OK);
}

/* The nominal vehicle: latency 0.1 s, limits 1 and 2 m/s^2; noise 0.028 m/s. */
typedef struct vehicle {
  double t_s, speed, command[3];
  rim_rng rng;
} vehicle;

static vehicle at_rest(uint64_t stream) {
  vehicle c;
  memset(&c, 0, sizeof c);
  rimi_rng_seed(&c.rng, SEED, stream);
  return c;
}

/* What of the commanded speed is reached: 1 nominal. */
static void drive(vehicle *c, double command, double share) {
  const double target = c->command[0] * share;
  const double most = (fabs(target) > fabs(c->speed) ? 1.0 : share < 1.0 ? 6.0 : 2.0) * DT;
  c->speed += fmax(-most, fmin(most, target - c->speed));
  c->command[0] = c->command[1];
  c->command[1] = command;
  c->t_s += DT;
  assert_int_equal(
      rimi_interference_step(&s, c->t_s, command, c->speed + 0.028 * rimi_rng_normal(&c->rng), &v),
      RIM_OK);
}

static double course(int k) { return k % 400 < 60 ? 0.0 : k % 400 < 250 ? 0.7 : 0.3; }

static void test_nominal_driving_is_quiet(void **state) {
  (void)state;
  begin();
  vehicle c = at_rest(1);
  for (int k = 0; k < 20000; ++k)
    drive(&c, course(k), 1.0);
  assert_int_equal(s.health.alarms, 0);
  assert_int_equal(s.health.rows, 20000);
}

/* What the vehicle does is mostly told as it is: it stands, speeds up, goes on and slows down. */
static void test_motions_are_told(void **state) {
  (void)state;
  static const struct {
    int from, to; /* rows of course() */
    uint8_t motion;
  } of[] = {{30, 60, RIM_MOTION_STOP},
            {66, 76, RIM_MOTION_ACCEL},
            {100, 250, RIM_MOTION_CONSTANT},
            {254, 258, RIM_MOTION_DECEL}};
  int told[4] = {0};
  begin();
  vehicle c = at_rest(4);
  for (int k = 0; k < 300; ++k) {
    drive(&c, course(k), 1.0);
    for (size_t i = 0; i < 4; ++i)
      told[i] += k >= of[i].from && k < of[i].to && v.motion == of[i].motion;
  }
  for (size_t i = 0; i < 4; ++i)
    assert_true(2 * told[i] > of[i].to - of[i].from);
}

static void test_blocked_and_pushed(void **state) {
  (void)state;
  for (int side = 0; side < 2; ++side) {
    begin();
    vehicle c = at_rest(2);
    double onset_s = 0.0, raised_s = 0.0;
    for (int k = 0; k < 200; ++k) {
      const bool interfered = k >= 150 && k < 180;
      if (k == 150)
        onset_s = c.t_s;
      drive(&c, course(k), interfered ? (side ? 1.6 : 0.1) : 1.0);
      if (v.raised) {
        assert_true(interfered);
        raised_s = v.t_s;
        assert_int_equal(v.kind, side ? RIM_INTERFERENCE_PUSHED : RIM_INTERFERENCE_BLOCKED);
        near(v.since_onset_s, v.t_s - onset_s, 0.15);
        near(v.onset_s, onset_s, 0.15);
      }
    }
    assert_int_equal(s.health.alarms, 1);
    assert_true(raised_s >= onset_s && raised_s - onset_s < 0.4);
  }
}

static void test_pushed_while_standing_and_backwards(void **state) {
  (void)state;
  begin();
  for (int k = 0; k < 40; ++k)
    rimi_interference_step(&s, k * DT, 0.0, k < 30 ? 0.0 : -0.2, &v);
  assert_true(v.alarmed);
  assert_int_equal(v.kind, RIM_INTERFERENCE_PUSHED);
  begin();
  for (int k = 0; k < 80; ++k) /* driving backwards, stopped */
    rimi_interference_step(&s, k * DT, -0.5, k < 70 ? -0.5 : 0.0, &v);
  assert_true(v.alarmed);
  assert_int_equal(v.kind, RIM_INTERFERENCE_BLOCKED);
  rim_alarm alarm;
  assert_true(rimi_interference_alarm(&v, 7, 3, &alarm));
  assert_int_equal(alarm.detector, RIM_DETECTOR_INTERFERENCE);
  assert_int_equal(alarm.channel[0], 3);
  near(alarm.shift[0], 0.5, 1e-12);
  near(alarm.since_s, v.onset_s, 0.0);
  v.alarmed = false;
  assert_false(rimi_interference_alarm(&v, 7, 3, &alarm));
  assert_int_equal(alarm.level, RIM_LEVEL_OK);
}

/* u - v, slope of the last 4, difference of slopes of the last 8 over the time, uneven times. */
static void test_observations(void **state) {
  (void)state;
  begin();
  double t = 0.0, o[3];
  for (int k = 0; k < 9; ++k) {
    assert_false(rimi_interference_observation(&s, o));
    t += 0.04 + 0.01 * (k % 3);
    rimi_interference_step(&s, t, 1.0, 0.2 + 0.5 * t, &v); /* a line: slope .5, no jerk */
  }
  assert_true(rimi_interference_observation(&s, o));
  near(o[0], 0.8 - 0.5 * t, 1e-14);
  near(o[1], 0.5, 1e-12);
  near(o[2], 0.0, 1e-10);
  begin();
  for (int k = 1; k <= 9; ++k) /* v = t^2: slope of n even steps is 2 t less (n - 1) dt */
    rimi_interference_step(&s, k * DT, 1.0, k * DT * k * DT, &v);
  assert_true(rimi_interference_observation(&s, o));
  near(o[1], 2 * 9 * DT - 3 * DT, 1e-12);
  near(o[2], 2.0, 1e-10);
}

static void test_gaps_reset_and_bad_rows_count(void **state) {
  (void)state;
  begin();
  for (int k = 0; k < 40; ++k)
    rimi_interference_step(&s, k * DT, 0.5, k < 20 ? 0.5 : 0.0, &v);
  assert_true(v.alarmed);
  rimi_interference_step(&s, 10.0, 0.5, 0.5, &v);
  assert_false(v.alarmed);
  assert_int_equal(s.health.gaps, 1);
  assert_int_equal(s.hmm.resets, 1);
  const rim_interference before = s;
  const double bad[4][2] = {{NAN, 0.5}, {10.1, INFINITY}, {10.0, 0.5}, {9.0, 0.5}};
  for (int i = 0; i < 4; ++i) {
    assert_int_equal(rimi_interference_step(&s, bad[i][0], 0.5, bad[i][1], &v), RIM_OK);
    assert_false(v.valid);
  }
  assert_int_equal(s.health.not_finite, 2);
  assert_int_equal(s.health.time_back, 2);
  s.health = before.health;
  assert_memory_equal(&s, &before, sizeof s);
  assert_int_equal(rimi_interference_step(&s, 10.05, NAN, 0.5, &v), RIM_OK);
  assert_true(v.valid); /* the last command holds */
  assert_int_equal(s.health.no_command, 1);
  for (int k = 2; k < 20; ++k)
    rimi_interference_step(&s, 10.0 + k * DT, NAN, 0.5, &v);
  assert_false(v.valid); /* not for ever */
  begin();
  rimi_interference_step(&s, 0.0, NAN, 0.5, &v);
  assert_false(v.valid);
  assert_int_equal(rimi_interference_step(NULL, 0.0, 0.0, 0.0, &v), RIM_E_ARGUMENT);
}

/* A reset forgets all that was summed. */
static void test_reset_forgets_all(void **state) {
  (void)state;
  begin();
  const rim_interference fresh = s;
  for (int k = 0; k < 40; ++k)
    rimi_interference_step(&s, k * DT, 0.5, k < 20 ? 0.5 : 0.0, &v);
  assert_memory_not_equal(s.sum, fresh.sum, sizeof s.sum);
  rimi_interference_reset(&s);
  assert_memory_equal(s.sum, fresh.sum, sizeof s.sum);
}

static void test_varying_steps_and_many_commands(void **state) {
  (void)state;
  begin();
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 3);
  double t = 0.0, speed = 0.0, until = 0.0;
  for (int k = 0; k < 4000; ++k) { /* commanded 0.6 at 1 s; exact motion at uneven times */
    t += 0.02 + 0.06 * rimi_rng_uniform(&rng);
    until = t - 1.1;
    speed = until < 0.0 ? 0.0 : fmin(0.6, until);
    rimi_interference_step(&s, t, t < 1.0 ? 0.0 : 0.6, speed, &v);
  }
  assert_int_equal(s.health.alarms, 0);
  near(v.residual_mps, 0.0, 1e-12);
  begin();
  for (int k = 0; k < 200; ++k)
    rimi_interference_step(&s, 0.001 * k, 0.3 + 0.0001 * k, 0.3, &v);
  assert_true(s.health.command_overflow > 0);
}

static void test_bytes(void **state) {
  (void)state;
  const rim_interference_model m = sample_interference();
  rim_interference_model read;
  memset(&read, 0, sizeof read);
  assert_int_equal(rimi_interference_pack(&m, bytes, RIM_INTERFERENCE_BYTES), RIM_OK);
  assert_int_equal(rimi_interference_open(&read, bytes, RIM_INTERFERENCE_BYTES), RIM_OK);
  assert_memory_equal(&read, &m, sizeof m);
  for (size_t i = 0; i < RIM_INTERFERENCE_BYTES; ++i) {
    bytes[i] ^= 0x10;
    assert_int_not_equal(rimi_interference_open(&read, bytes, RIM_INTERFERENCE_BYTES), RIM_OK);
    bytes[i] ^= 0x10;
  }
  assert_memory_equal(&read, &m, sizeof m);
  assert_int_equal(rimi_interference_open(&read, bytes, RIM_INTERFERENCE_BYTES - 1),
                   RIM_E_TRUNCATED);
  assert_int_equal(rimi_interference_open(&read, bytes, RIM_INTERFERENCE_BYTES + 1), RIM_E_SIZE);
  assert_int_equal(rimi_interference_pack(&m, bytes, 8), RIM_E_SIZE);
  rim_interference_model wrong = m;
  wrong.sd[2][1] = 0.0;
  assert_int_equal(rimi_interference_pack(&wrong, bytes, RIM_INTERFERENCE_BYTES), RIM_E_DATA);
  wrong = m;
  wrong.transition[4][4] = 0.5;
  assert_int_equal(rimi_interference_init(&s, &wrong), RIM_E_DATA);
  wrong = m;
  wrong.open_loop.threshold = NAN;
  assert_int_equal(rimi_interference_init(&s, &wrong), RIM_E_DATA);
}

static void test_an_image_carries_it(void **state) {
  (void)state;
  enum { AT = 64 + 16, ALL = AT + RIM_INTERFERENCE_BYTES };
  static uint64_t blob[ALL / 8 + 1];
  rim_image view = {
      .data = (const uint8_t *)blob, .bytes = ALL, .sections = 1, .major = RIM_IMAGE_MAJOR};
  uint8_t *image = (uint8_t *)blob;
  image[64] = RIM_SECTION_INTERFERENCE;
  image[68] = AT;
  image[72] = RIM_INTERFERENCE_BYTES & 255u;
  image[73] = RIM_INTERFERENCE_BYTES >> 8;
  const rim_interference_model m = sample_interference();
  rim_interference_model read;
  assert_int_equal(rimi_interference_pack(&m, image + AT, RIM_INTERFERENCE_BYTES), RIM_OK);
  assert_int_equal(rimi_interference_of_image(&read, &view), RIM_OK);
  assert_memory_equal(&read, &m, sizeof m);
  image[64] = 99;
  assert_int_equal(rimi_interference_of_image(&read, &view), RIM_E_RANGE);
  assert_int_equal(rimi_interference_of_image(NULL, &view), RIM_E_ARGUMENT);
}

/* Wheels at no even angles: what one says of each direction depends on the others. */
static void test_wheels_stand_as_they_do(void **state) {
  (void)state;
  rim_wheels w = {.radius_m = 0.3, .tick_m = 1e-6, .bits = 32};
  const double angle[4] = {0.2, 1.1, 2.9, 4.4}, want[3] = {-0.4, 0.9, 0.25};
  uint32_t before[4], now[4];
  double got[3];
  for (int k = 0; k < 4; ++k) {
    w.sine[k] = sin(angle[k]);
    w.cosine[k] = cos(angle[k]);
    const double speed = -w.sine[k] * want[0] + w.cosine[k] * want[1] + w.radius_m * want[2];
    before[k] = 4000000000u;
    now[k] = before[k] + (uint32_t)(int32_t)lround(speed * DT / w.tick_m);
  }
  assert_int_equal(rimi_wheels_velocity(&w, before, now, DT, got), RIM_OK);
  for (int i = 0; i < 3; ++i)
    near(got[i], want[i], 1e-3);
}

static void test_wheels_wrap(void **state) {
  (void)state;
  const double r = sqrt(0.5);
  const rim_wheels w = {{r, r, -r, -r}, {r, -r, -r, r}, 0.2, 1e-4, 16};
  const double want[3] = {0.7, -0.2, 0.5};
  uint32_t before[4], now[4];
  double got[3];
  for (uint32_t start = 0; start < 65536; start += 511) {
    for (int k = 0; k < 4; ++k) {
      const double speed = -w.sine[k] * want[0] + w.cosine[k] * want[1] + w.radius_m * want[2];
      before[k] = start;
      now[k] = (start + (uint32_t)(int32_t)lround(speed * DT / w.tick_m)) & 65535u;
    }
    assert_int_equal(rimi_wheels_velocity(&w, before, now, DT, got), RIM_OK);
    for (int i = 0; i < 3; ++i)
      near(got[i], want[i], 0.01);
  }
  before[2] = 65536;
  assert_int_equal(rimi_wheels_velocity(&w, before, now, DT, got), RIM_E_DATA);
  before[2] = 0;
  assert_int_equal(rimi_wheels_velocity(&w, before, now, 0.0, got), RIM_E_DATA);
  const rim_wheels parallel = {{0, 0, 0, 0}, {1, 1, 1, 1}, 0.2, 1e-4, 32};
  assert_int_equal(rimi_wheels_velocity(&parallel, before, now, DT, got), RIM_E_SINGULAR);
}

/* `test_interference steps N`: N steps and nothing else, to count instructions (lib/README.md). */
static int run_steps(int n) {
  begin();
  vehicle c = at_rest(1);
  for (int k = 0; k < n; ++k)
    drive(&c, course(k), 1.0);
  return s.health.alarms == 0 ? 0 : 1;
}

int main(int argc, char **argv) {
  if (argc == 3 && strcmp(argv[1], "steps") == 0)
    return run_steps(atoi(argv[2]));
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_nominal_driving_is_quiet),
                                     cmocka_unit_test(test_motions_are_told),
                                     cmocka_unit_test(test_blocked_and_pushed),
                                     cmocka_unit_test(test_pushed_while_standing_and_backwards),
                                     cmocka_unit_test(test_observations),
                                     cmocka_unit_test(test_gaps_reset_and_bad_rows_count),
                                     cmocka_unit_test(test_reset_forgets_all),
                                     cmocka_unit_test(test_varying_steps_and_many_commands),
                                     cmocka_unit_test(test_bytes),
                                     cmocka_unit_test(test_an_image_carries_it),
                                     cmocka_unit_test(test_wheels_stand_as_they_do),
                                     cmocka_unit_test(test_wheels_wrap)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
