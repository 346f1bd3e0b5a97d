/* SPDX-License-Identifier: MIT */
/* A position that integrates a speed: when the two part, whose fault it is. The bias of the speed's
 * reading and the drift of the position's look the same in the position; the speed's own channels
 * tell them apart. */
#include "monitor_bench.h"

#include "monitor/monitor_private.h"

enum { FAULT_ROW = 240, LAST_ROW = 600, RUNS = 9 };

static recipe made;

/* Blocks are of 4 rows, a second: the position's change is the mean speed, by both ends. */
static void put_integral(bytes *b, uint32_t op, uint32_t second) {
  b->size = 0;
  const uint32_t header[4] = {3, O, MEANS, 1};
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < O; ++i)
    f32(b, 2.0);
  u16(b, op);
  u16(b, 1);
  u16(b, second);
  u16(b, 0);
  f32(b, 1.0);
  f32(b, 1.0);
  f32(b, 0.0);
  const double head[O][4] = {{AGREEMENT_RESIDUALS, 0, -1, 0}, {AGREEMENT_INTEGRAL, 0, 0, 0}};
  for (size_t o = 0; o < O; ++o) {
    for (size_t i = 0; i < 4; ++i)
      f32(b, head[o][i]);
    for (size_t i = 0; i < O * (2 + MEANS); ++i)
      f32(b, o == 1 && i == 0 ? 0.5 * BLOCK * PERIOD_S : 0.0);
  }
}

/* The behaviour of the speed is known to half a unit alone, that of the position not at all. */
static void put_weak_noise(bytes *b) {
  double sd[CHANNELS];
  bool is_active[CHANNELS];
  for (size_t c = 0; c < CHANNELS; ++c) {
    sd[c] = c == 0 ? 0.5 : 0.05;
    is_active[c] = c == 0 || c == O + 1;
  }
  b->size = 0;
  put_noise_of(b, sd, is_active);
}

/* Speed twice the command, position its integral; the fault begins in row FAULT_ROW. factor: what
 * the position integrates is the speed times this. */
static void fly_row(row *r, uint32_t run, uint32_t t, double bias, double drift, double *position,
                    double factor) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED + run, t);
  const double speed = 2.0 * (2.0 * triangle((double)t / (241.0 + (double)run)) - 1.0);
  const double since_s = t > FAULT_ROW ? PERIOD_S * (double)(t - FAULT_ROW) : 0.0;
  memset(r, 0, sizeof *r);
  *position += PERIOD_S * speed * factor;
  r->t_s = 10.0 + PERIOD_S * (double)t;
  r->context[0] = 0.5 * speed;
  r->context[1] = speed + 0.002 * rimi_rng_normal(&rng) + (since_s > 0.0 ? bias : 0.0);
  r->context[2] =
      *position - 0.5 * PERIOD_S * speed * factor + 0.01 * rimi_rng_normal(&rng) + drift * since_s;
  r->context[3] = triangle((double)t / 97.0);
  const rim_observation view = {r->t_s, r->context, r->outcome, r->mean, r->sd};
  r->view = view;
}

static double largest_score(bench *b, uint32_t run) {
  double most = 0.0, position = 0.0;
  start(b);
  for (uint32_t t = 0; t < LAST_ROW; ++t) {
    row r;
    rim_verdict v;
    fly_row(&r, run, t, 0.0, 0.0, &position, 1.0);
    assert_int_equal(rim_monitor_step(b->monitor, &r.view, &v), RIM_OK);
    if (v.blocks > 0)
      most = rimi_max(most, v.score);
  }
  return most;
}

static int make_image(void **state) {
  (void)state;
  static bench b;
  double maxima[RUNS];
  print_message("seed %u\n", SEED);
  trained_recipe(&made);
  const double range[2 * D] = {-1, -3, -400, 0, 1, 3, 400, 100};
  made.section[RIM_SECTION_FEATURES].size = 0;
  for (size_t i = 0; i < 2 * D; ++i)
    f32(&made.section[RIM_SECTION_FEATURES], range[i]);
  put_integral(&made.section[RIM_SECTION_AGREEMENT], AGREEMENT_PLAIN, 0);
  put_weak_noise(&made.section[RIM_SECTION_NOISE]);
  build(&b.blob, &made);
  for (uint32_t run = 0; run < RUNS; ++run)
    maxima[run] = rimi_max(largest_score(&b, 100 + run), 8.0); /* or they say nothing at all */
  put_threshold(&made.section[RIM_SECTION_THRESHOLD], CHANNELS, maxima, RUNS);
  return 0;
}

/* The last record of a run with this fault before row `rows`. */
static rim_alarm fly(double bias, double drift, uint32_t rows) {
  static bench b;
  rim_alarm last = {0};
  double position = 0.0;
  memset(&b, 0, sizeof b);
  build(&b.blob, &made);
  start(&b);
  for (uint32_t t = 0; t < rows; ++t) {
    row r;
    rim_verdict v;
    fly_row(&r, 7, t, bias, drift, &position, 1.0);
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    assert_true(v.alarm.seq == 0 || t > FAULT_ROW); /* no word before */
    if (v.alarm.seq != 0)
      last = v.alarm;
  }
  return last;
}

static void is_near(double a, double b, double tolerance) {
  if (!(rimi_abs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

static void a_bias_of_the_speed_is_the_speeds(void **state) {
  (void)state;
  for (int sign = -1; sign <= 1; sign += 2) {
    const rim_alarm a = fly(0.1 * sign, 0.0, LAST_ROW);
    assert_int_equal(a.level, RIM_LEVEL_ERROR);
    assert_int_equal(a.kind, RIM_KIND_SHIFT);
    assert_int_equal(a.channel[0], 0);
    is_near(a.shift[0], 0.1 * sign, 0.004);
    assert_true(a.shift_sd[0] > 0.0 && a.shift_sd[0] < 0.001);
    is_near(a.since_s, 10.0 + PERIOD_S * FAULT_ROW, 3.0);
    assert_int_equal(a.region.dims, 0);
  }
}

/* Healthy runs that exceed what the noise model expects of a drift widen the error likewise. */
static void an_error_is_as_wide_as_healthy_runs_say(void **state) {
  (void)state;
  enum { PHI = NOISE_CHANNEL_WORDS + 1 + RAW, EACH = 4 * (PHI + FAMILIES) };
  enum { OF_RAMP = 4 * (NOISE_HEADER_WORDS + PHI + SEARCH_RAMP) };
  uint8_t *phi = made.section[RIM_SECTION_NOISE].byte + OF_RAMP + EACH * (O + 1);
  const rim_alarm before = fly(0.1, 0.0, LAST_ROW);
  const uint32_t one = rimi_le_u32(phi, 0), wider = UINT32_C(0x3fc80000); /* 1.5625 */
  assert_int_equal(one, 0x3f800000);
  for (size_t i = 0; i < 4; ++i)
    phi[i] = (uint8_t)(wider >> 8 * i);
  const rim_alarm a = fly(0.1, 0.0, LAST_ROW);
  for (size_t i = 0; i < 4; ++i)
    phi[i] = (uint8_t)(one >> 8 * i);
  assert_true(a.t_s == before.t_s && a.channel[0] == 0);
  is_near(a.shift_sd[0] / before.shift_sd[0], 1.25, 1e-3);
}

static void a_drift_of_the_position_is_its_own(void **state) {
  (void)state;
  for (int sign = -1; sign <= 1; sign += 2) {
    const rim_alarm a = fly(0.0, 0.3 * sign, LAST_ROW);
    assert_int_equal(a.level, RIM_LEVEL_ERROR);
    assert_int_equal(a.kind, RIM_KIND_DRIFT);
    assert_int_equal(a.channel[0], 1);
    is_near(a.shift[0], 0.3 * sign * (a.t_s - 10.0 - PERIOD_S * FAULT_ROW), 0.5); /* till now */
    is_near(a.since_s, 10.0 + PERIOD_S * FAULT_ROW, 3.0);
  }
}

/* Its own channel sees a large one, too. */
static void a_large_bias_of_the_speed_is_seen_by_itself(void **state) {
  (void)state;
  const rim_alarm a = fly(2.0, 0.0, 340);
  assert_int_equal(a.level, RIM_LEVEL_ERROR);
  assert_int_equal(a.channel[0], 0);
  assert_int_equal(a.kind, RIM_KIND_SHIFT);
  is_near(a.shift[0], 2.0, 2.0 * a.shift_sd[0]);
}

/* Integrands by another factor: what remains of the position is what the factor leaves. */
static void integrands_by_another_factor(void **state) {
  (void)state;
  const struct {
    uint32_t op;
    double reading, factor;
  } of[4] = {{AGREEMENT_PLAIN, 0.7, 1.0},
             {AGREEMENT_PRODUCT, 0.7, 0.7},
             {AGREEMENT_COSINE, 0.7, 0.76484218728448842},
             {AGREEMENT_SINE, 0.7, 0.64421768723769105}};
  for (size_t i = 0; i < 4; ++i) {
    for (int degrees = 0; degrees < 3; ++degrees) { /* 2: another reading than the factor's */
      static bench b;
      recipe r = made;
      bytes *roles = &r.section[RIM_SECTION_COMMANDS];
      put_integral(&r.section[RIM_SECTION_AGREEMENT], of[i].op, 3);
      roles->byte[3] |= degrees == 1 ? 4 : 0;
      memset(&b, 0, sizeof b);
      build(&b.blob, &r);
      start(&b);
      double position = 0.0, most = 0.0;
      for (uint32_t t = 0; t < 400; ++t) {
        row one;
        rim_verdict v;
        fly_row(&one, 7, t, 0.0, 0.0, &position, of[i].factor);
        one.context[3] = of[i].reading * (degrees == 1 ? 180.0 / RIM_PI : degrees == 2 ? 0.5 : 1.0);
        if (of[i].op == AGREEMENT_PRODUCT && degrees == 1)
          one.context[3] = of[i].reading;
        assert_int_equal(rim_monitor_step(b.monitor, &one.view, &v), RIM_OK);
        if (v.blocks > 4)
          most = rimi_max(most, rimi_abs(b.monitor->residual[O + 1]));
      }
      if (degrees == 2 && of[i].op != AGREEMENT_PLAIN)
        assert_true(most > 1.0);
      else
        assert_true(most > 0.001 && most < 0.1);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_bias_of_the_speed_is_the_speeds),
      cmocka_unit_test(an_error_is_as_wide_as_healthy_runs_say),
      cmocka_unit_test(a_drift_of_the_position_is_its_own),
      cmocka_unit_test(a_large_bias_of_the_speed_is_seen_by_itself),
      cmocka_unit_test(integrands_by_another_factor),
  };
  return cmocka_run_group_tests(tests, make_image, NULL);
}
