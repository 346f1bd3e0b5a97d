/* SPDX-License-Identifier: MIT */
/* The monitor at its ends: images that lack or have what few have, memory that was changed between
 * two calls, commands and policies that meet an alarm under way. */
#include <math.h>

#include "monitor/alarm_life.h"
#include "monitor/guard.h"
#include "monitor/inspect.h"
#include "monitor/monitor_private.h"
#include "monitor/work.h"
#include "search/search_private.h"

#include "alarm_sample.h"
#include "image/nominal.h"
#include "monitor_bench.h"
#include "rim/plan/lookahead.h"

static bench b;

/* ---- the life of an alarm ---- */

static rim_alarm_life life;
static const rim_alarm_life_config CONFIG = {
    .slot = {{.raise_steps = 1, .clear_steps = 2}, {.raise_steps = 1, .clear_steps = 1}},
    .policy = {.stale_s = 20.0},
    .model_id = 7};

static rim_alarm error_of(uint8_t channels) {
  rim_alarm a = sample_alarm(6);
  a.level = RIM_LEVEL_ERROR;
  a.channels = channels;
  return a;
}

/* A command that ends an alarm of which nobody has heard yet: its end is heard, once. */
static void an_end_before_its_begin_was_heard(void **state) {
  (void)state;
  rim_alarm out;
  uint32_t forget;
  const rim_alarm a = error_of(1);
  assert_int_equal(rimi_alarm_life_init(&life, &CONFIG), RIM_OK);
  rimi_alarm_life_row(&life, 1.0);
  assert_true(rimi_alarm_life_would_raise(&life, RIM_DETECTOR_RIM, &a));
  assert_false(rimi_alarm_life_would_raise(&life, (rim_detector)RIM_DETECTORS, &a));
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 1.0, &a);
  assert_true(rimi_alarm_life_waits(&life));
  assert_false(rimi_alarm_life_would_raise(&life, RIM_DETECTOR_RIM, &a)); /* it stands */
  assert_false(rimi_alarm_life_over(&life, RIM_DETECTOR_RIM, 1.5));       /* first its begin */
  const rim_command clear = {life.seq + 1, 7, RIM_COMMAND_CLEAR};
  assert_int_equal(rimi_alarm_life_command(&life, &clear, 32, &forget), RIM_E_DATA);
  assert_true(rimi_alarm_life_next_record(&life, &out) && out.state == RIM_ALARM_RAISED);
  assert_true(rimi_alarm_life_over(&life, RIM_DETECTOR_RIM, 2.0));
  assert_false(rimi_alarm_life_over(&life, RIM_DETECTOR_RIM, 2.0)); /* once */
  assert_true(rimi_alarm_life_next_record(&life, &out) && out.state == RIM_ALARM_CLEARED);
  assert_int_not_equal(rimi_alarm_life_level(&life), RIM_LEVEL_ERROR);
  assert_false(rimi_alarm_life_waits(&life));
  assert_false(rimi_alarm_life_over(&life, RIM_DETECTOR_RIM, NAN));
}

/* What is over is held by the latch; only a policy without it lets it go. */
static void a_policy_lets_go_what_is_over(void **state) {
  (void)state;
  rim_alarm out;
  const rim_alarm a = error_of(1);
  rim_alarm_life_config c = CONFIG;
  c.policy.latch = true;
  assert_int_equal(rimi_alarm_life_init(&life, &c), RIM_OK);
  rimi_alarm_life_row(&life, 1.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 1.0, &a);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  for (int i = 2; i < 6; ++i) {
    rimi_alarm_life_row(&life, i);
    rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, i, NULL);
    (void)rimi_alarm_life_next_record(&life, &out);
  }
  assert_true(life.slot[0].is_over);
  rim_alarm_policy policy = {.stale_s = 5.0, .latch = true};
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_OK);
  assert_true(life.slot[0].is_over && !rimi_alarm_life_next_record(&life, &out));
  policy.latch = false;
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_OK);
  assert_true(rimi_alarm_life_next_record(&life, &out) && out.state == RIM_ALARM_CLEARED);
  assert_false(life.slot[0].stands);
  policy.stale_s = NAN;
  assert_int_equal(rimi_alarm_life_set_policy(&life, &policy), RIM_E_CONFIG);
  rimi_alarm_life_go_on(&life, &policy, 9, 3); /* from memory that was hit: the bound is kept */
  assert_true(life.config.policy.stale_s == 5.0 && life.seq == 9 && life.raised == 3);
}

/* The same alarm without a named outcome is the same, however many features its bytes claim. */
static void alarms_without_an_outcome(void **state) {
  (void)state;
  rim_alarm out, a = error_of(0);
  assert_int_equal(rimi_alarm_life_init(&life, &CONFIG), RIM_OK);
  a.region.dims = 200;
  for (int i = 0; i < 10; ++i) {
    rimi_alarm_life_row(&life, i);
    rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, i, &a);
    assert_int_equal(rimi_alarm_life_next_record(&life, &out), i == 0);
  }
  a.channels = 1;
  rimi_alarm_life_row(&life, 10.0);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 10.0, &a);
  assert_true(rimi_alarm_life_next_record(&life, &out) && out.state == RIM_ALARM_UPDATED);
}

/* ---- the guard ---- */

/* Between two steps too: who asks is told of no alarm and of no health. */
static void a_query_looks_before_it_answers(void **state) {
  (void)state;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 60; ++t)
    (void)step(&b, 910, t, 0.0);
  assert_int_equal(rim_monitor_alarms(b.monitor).level, RIM_LEVEL_OK);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, 0);
  b.monitor->life.raised ^= 1u << 20;
  assert_int_equal(rim_monitor_alarms(b.monitor).level, RIM_LEVEL_STALE);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_CONTROL);
  b.monitor->life.raised ^= 1u << 20; /* a bit that turned back was never seen */
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, 0);
}

/* Each part of a policy alone outlives a repair. */
static void every_policy_outlives_a_repair(void **state) {
  (void)state;
  const rim_alarm_policy policy[] = {
      {.stale_s = 2.0},
      {.stale_s = 3.0},
      {.stale_s = 3.0, .latch = true},
      {.stale_s = 3.0, .latch = true, .replay = true},
      {.stale_s = 3.0, .latch = true, .replay = true, .command_any = true}};
  make_bench(&b, true);
  for (size_t i = 0; i < sizeof policy / sizeof *policy; ++i) {
    assert_int_equal(rim_monitor_set_policy(b.monitor, &policy[i]), RIM_OK);
    b.monitor->life.config.policy.stale_s = 1e9; /* the original is hit, the copy is not */
    assert_int_equal(
        rim_monitor_repair(&b.monitor, b.memory, sizeof b.memory, b.blob.byte, b.blob.size),
        RIM_OK);
    const rim_alarm_policy *p = &b.monitor->life.config.policy;
    assert_true(p->stale_s == policy[i].stale_s && p->latch == policy[i].latch &&
                p->replay == policy[i].replay && p->command_any == policy[i].command_any);
  }
}

/* Rows with predictions are numbered. A gap is what is longer than three times the mean spacing of
 * the rows since the last one: its begin, its end and the row after it are kept. */
static void a_gap_is_three_times_the_spacing(void **state) {
  (void)state;
  make_bench(&b, true);
  /* Four rows a second apart, a gap; four half a second apart, no gap, a gap. */
  static const double t_s[] = {1.0, 2.0, 3.0, 4.0, 7.2, 7.7, 8.2, 8.7, 10.1, 12.7};
  static const uint32_t gaps[] = {0, 0, 0, 0, 1, 1, 1, 1, 1, 2};
  for (uint32_t i = 0; i < sizeof t_s / sizeof *t_s; ++i) {
    row r;
    rim_verdict v;
    make_row(&r, true, 913, i, 0.0);
    r.view.t_s = t_s[i];
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    assert_int_equal(b.monitor->gaps, gaps[i]);
  }
  const monitor_gap *first = &b.monitor->gap[0], *second = &b.monitor->gap[1];
  assert_true(first->before_s == 4.0 && first->after_s == 7.2 && first->index == 4);
  assert_true(second->before_s == 10.1 && second->after_s == 12.7 && second->index == 9);
}

/* An image of rows without a rate is gone through all the same; so is one that is small. */
static void an_image_without_a_rate_is_gone_through(void **state) {
  (void)state;
  recipe r = calibrated[1];
  set_word(&r, RIM_CONFIG_PERIOD_US, 0);
  make_bench_of(&b, &r, true);
  const uint32_t rows = (uint32_t)(b.blob.size / 4u / GUARD_NO_RATE) + 2u;
  for (uint32_t t = 0; t < 2 * rows; ++t)
    assert_int_not_equal(step(&b, 911, t, 0.0).level, RIM_LEVEL_INTEGRITY);
  b.blob.byte[b.blob.size - 1] ^= 1;
  uint32_t t = 2 * rows;
  while (t < 4 * rows && step(&b, 911, t, 0.0).level != RIM_LEVEL_INTEGRITY)
    ++t;
  assert_true(t < 3 * rows + 2);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_IMAGE);
  /* A place behind the end or within a slice, which the sums do not cover, leads nowhere. */
  static const uint32_t nowhere[] = {UINT32_C(1) << 30, 1};
  for (size_t i = 0; i < sizeof nowhere / sizeof *nowhere; ++i) {
    make_bench(&b, true);
    b.monitor->guard.image_at = nowhere[i];
    assert_int_equal(step(&b, 911, 0, 0.0).level, RIM_LEVEL_INTEGRITY);
    assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_IMAGE);
  }
}

/* An index of the search is looked at before it is followed. */
static void an_index_is_looked_at_each_row(void **state) {
  (void)state;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 200; ++t)
    (void)step(&b, 912, t, 0.0);
  search_state(b.monitor->search, b.monitor->search->channel)->time.feature[0] = REGION;
  assert_int_equal(step(&b, 912, 200, 0.0).level, RIM_LEVEL_INTEGRITY);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_RUN);
}

/* All of it at once, as before an alarm: each kind of memory. */
static void everything_is_looked_at_at_once(void **state) {
  (void)state;
  for (int what = 0; what < 4; ++what) {
    make_bench(&b, what == 3);
    for (uint32_t t = 0; t < 100; ++t)
      (void)step(&b, 913, t, 0.0);
    assert_true(rimi_guard_all(b.monitor));
    if (what == 0)
      search_gram(b.monitor->search, 0)[0] *= 2.0f;
    else if (what == 1)
      search_coarse_residuals(b.monitor->search, 1)[0] ^= 16;
    else if (what == 2)
      b.blob.byte[b.blob.size / 2] ^= 4;
    else
      ((float *)(void *)((uint8_t *)b.monitor->select + RIM_SELECT_HEADER_BYTES))[3] = 1e30f;
    assert_false(rimi_guard_all(b.monitor));
    assert_int_equal(b.monitor->guard.damaged, what == 2 ? RIM_DAMAGE_IMAGE : RIM_DAMAGE_RUN);
  }
}

/* A copy whose header holds and whose parts do not is none to go on from. */
static void copies_with_spoilt_parts(void **state) {
  (void)state;
  for (int what = 0; what < 4; ++what) {
    make_bench(&b, what == 3);
    for (uint32_t t = 0; t < 100; ++t)
      (void)step(&b, 914, t, 0.0);
    size_t length;
    rim_monitor *m = NULL;
    uint8_t *control = (uint8_t *)(uintptr_t)rimi_blocks_control(b.monitor->rows, &length);
    assert_int_equal(rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size),
                     RIM_OK);
    m = NULL;
    if (what == 0)
      control[length / 2] ^= 1;
    else if (what == 1)
      ((double *)(uintptr_t)rimi_blocks_first(b.monitor->rows))[0] += 1.0; /* how it began */
    else if (what == 2)
      search_fine_residuals(b.monitor->search, 0)[0] ^= 256;
    else
      ((float *)(void *)((uint8_t *)b.monitor->select + RIM_SELECT_HEADER_BYTES))[3] = 1e30f;
    const rim_status status =
        rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size);
    assert_true(status == RIM_E_DATA && m == NULL);
  }
}

/* ---- images that have what few have ---- */

/* What the image counts, and its bound; a block of it costs more than one of the plain image. */
static void blocks_cost_more(rim_work_counts *with, rim_work *more, rim_work_counts *without) {
  image plain;
  rim_work less;
  build(&plain, &calibrated[0]);
  assert_int_equal(rimi_work_counts_of(b.blob.byte, b.blob.size, with), RIM_OK);
  assert_int_equal(rimi_work_counts_of(plain.byte, plain.size, without), RIM_OK);
  rimi_work_bound(with, more);
  rimi_work_bound(without, &less);
  assert_true(more->block > less.block && more->step > less.step && more->row == less.row);
}

/* Agreement of outcome 1 with what the context says: section LEVEL is used, and must fit. */
static void a_level_is_used(void **state) {
  (void)state;
  recipe r = calibrated[0];
  bytes *level = &r.section[RIM_SECTION_LEVEL];
  put_level(level, D, O);
  put_f32(r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * (4 + O * (2 + MEANS)),
          AGREEMENT_LEVEL);
  make_bench_of(&b, &r, false);
  rim_work_counts with, without;
  rim_work more, less;
  blocks_cost_more(&with, &more, &without);
  assert_true(with.prototypes == 1 && with.top == 1 && without.prototypes == 0);
  for (uint32_t t = 0; t < 8 * BLOCK; ++t)
    (void)step(&b, 915, t, 0.0);
  const double *residual = b.monitor->residual + RIM_CHANNEL_AGREEMENT * O;
  const double *measured = rimi_blocks_outcomes(b.monitor->rows);
  assert_true(fabs(residual[1] - (measured[1] - 0.125)) < 1e-6);
  level->size = 0;
  put_level(level, D - 1, O);
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG);
  level->size = 0;
  put_level(level, D, O - 1);
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG);
  put_u32(level->byte, RIM_NOMINAL_LAYOUT + 1);
  assert_int_equal(status_of_image(&r), RIM_E_VERSION);
  /* An angle is two inputs, of which the sine is the last. */
  r.section[RIM_SECTION_COMMANDS].byte[0] |= BLOCKS_ANGLE_RAD;
  level->size = 0;
  put_level(level, D, O);
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG);
  level->size = 0;
  put_level(level, D + 1, O);
  make_bench_of(&b, &r, false);
  assert_int_equal(rimi_work_counts_of(b.blob.byte, b.blob.size, &with), RIM_OK);
  assert_int_equal(with.angles, 1);
  rimi_work_bound(&with, &less);
  assert_true(less.block > more.block);
}

/* A vane goes round and round, and its model says 0: it is never off by more than half a turn. */
static void an_angle_is_off_by_the_shorter_way(void **state) {
  (void)state;
  recipe r = calibrated[0];
  r.section[RIM_SECTION_COMMANDS].byte[sensor(1)] |= BLOCKS_ANGLE_RAD;
  put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * sensor(1), -RIM_PI);
  put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * (D + sensor(1)), RIM_PI);
  make_bench_of(&b, &r, false);
  const double turn = 2.0 * RIM_PI, *measured = rimi_blocks_outcomes(b.monitor->rows);
  double most = 0.0;
  for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
    row now;
    rim_verdict v;
    make_row(&now, false, 915, t, 0.0);
    now.context[sensor(1)] = remainder(0.31 * t, turn);
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
    if (t % BLOCK != BLOCK - 1 || t < 3 * BLOCK) /* a run's first blocks begin it */
      continue;
    most = fmax(most, measured[1]);
    const double *of_kind[] = {b.monitor->residual,
                               b.monitor->residual + RIM_CHANNEL_AGREEMENT * O};
    for (size_t k = 0; k < 2; ++k) {
      assert_true(fabs(of_kind[k][1]) <= RIM_PI);
      assert_true(fabs(of_kind[k][1] - remainder(measured[1], turn)) < 1e-6);
      assert_true(fabs(of_kind[k][0]) < 1.0); /* no angle */
    }
  }
  assert_true(most > 7.0 * turn);
}

/* Agreement of outcome 1 with products of readings: section QUADRATIC is used, and must fit. */
static void products_are_used(void **state) {
  (void)state;
  recipe r = calibrated[0];
  bytes *quadratic = &r.section[RIM_SECTION_QUADRATIC];
  put_quadratic(quadratic, D, 1, RIM_QUADRATIC_AGREES);
  put_f32(r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * (4 + O * (2 + MEANS)),
          AGREEMENT_QUADRATIC);
  make_bench_of(&b, &r, false);
  rim_work_counts with, without;
  rim_work more;
  blocks_cost_more(&with, &more, &without);
  assert_true(with.quadratic_inputs == D && without.quadratic_inputs == 0);
  assert_int_equal(with.quadratic_terms, RIM_QUADRATIC_TERMS(D, 2 * D));
  assert_int_equal(with.memory_bytes, without.memory_bytes + 16 * D);
  double before = 0.0;
  for (uint32_t t = 0; t < 8 * BLOCK; ++t) {
    (void)step(&b, 915, t, 0.0);
    if (t % BLOCK != BLOCK - 1)
      continue;
    const double now = fmin(fmax(rimi_blocks_context(b.monitor->rows)[0], -4.0), 4.0);
    const double *measured = rimi_blocks_outcomes(b.monitor->rows);
    const double left = measured[1] - 0.125 - 0.5 * now * before;
    if (t > 3 * BLOCK) /* a run's first blocks begin it */
      assert_true(fabs(b.monitor->residual[RIM_CHANNEL_AGREEMENT * O + 1] - left) < 1e-9);
    before = now;
  }
  for (int what = 0; what < 4; ++what) {
    quadratic->size = 0;
    put_quadratic(quadratic, what == 0 ? D - 1 : D,
                  what == 1   ? 0
                  : what == 2 ? O
                              : 1,
                  RIM_QUADRATIC_AGREES);
    if (what == 3)
      put_u32(quadratic->byte, RIM_QUADRATIC_LAYOUT + 1);
    assert_int_equal(status_of_image(&r), what == 1   ? RIM_E_CONFIG /* outcome 1 has no model */
                                          : what == 3 ? RIM_E_VERSION
                                                      : RIM_E_RANGE);
  }
}

/* Of a block farther from the one prototype than three quarters of its reach of 1, the outcome's
 * own reading left out, its agreement with section LEVEL says nothing; that with others does. */
static void says_nothing_beyond(uint32_t own) {
  recipe r = calibrated[0];
  put_level(&r.section[RIM_SECTION_LEVEL], D, O);
  put_f32(r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * own * (4 + O * (2 + MEANS)),
          AGREEMENT_LEVEL);
  make_bench_of(&b, &r, false);
  const bool *unknown = b.monitor->unknown + RIM_CHANNEL_AGREEMENT * O;
  int seen[2] = {0};
  for (uint32_t t = 0; t < 120 * BLOCK; ++t) {
    row now;
    rim_verdict verdict;
    make_row(&now, false, 915, t, 0.0);
    now.context[sensor(own)] += t < 60 * BLOCK ? 0.0 : 1.0; /* its own reading is far off */
    memset(b.monitor->unknown, true, b.monitor->channel_count);
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &verdict), RIM_OK);
    if (t < BLOCK || t % BLOCK != BLOCK - 1 || !rimi_blocks_knows_all(b.monitor->rows))
      continue;
    const double *x = rimi_blocks_context(b.monitor->rows);
    double all = 0.0;
    for (uint32_t i = 0; i < D; ++i)
      all += x[i] * x[i];
    const double rest = all - x[sensor(own)] * x[sensor(own)], most = 0.75 * 0.75;
    if (all < most + 1e-3 || fabs(rest - most) < 1e-3)
      continue; /* near enough, or at the edge */
    ++seen[rest > most];
    for (uint32_t o = 0; o < O; ++o)
      assert_int_equal(unknown[o], o == own && rest > most);
  }
  assert_true(seen[0] > 3 && seen[1] > 3);
}

static void a_level_says_nothing_beyond_its_training(void **state) {
  (void)state;
  for (uint32_t own = 0; own < O; ++own)
    says_nothing_beyond(own);
}

/* A region over a predicted outcome lies where the model expects the vehicle. */
static void a_region_over_an_outcome(void **state) {
  (void)state;
  recipe r = calibrated[0];
  uint8_t *entry = r.section[RIM_SECTION_REGION].byte;
  put_u16(entry, 1); /* feature 1, which is outcome 0 */
  put_u16(entry + 2, 0);
  make_bench_of(&b, &r, false);
  for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
    (void)step(&b, 916, t, 5.0); /* far off where the command is high */
    const uint8_t *place = rimi_monitor_place(b.monitor);
    if (place == NULL || t % BLOCK != BLOCK - 1)
      continue;
    const double predicted = b.monitor->predicted[0];
    const double byte = floor(256.0 * (predicted + 3.0) / 6.0);
    assert_int_equal(place[0], (int)fmin(fmax(byte, 0.0), 255.0));
  }
  put_u16(entry + 2, O);
  assert_int_equal(status_of_image(&r), RIM_E_RANGE);
  put_u16(entry + 2, 0xffff);
  assert_int_equal(status_of_image(&r), RIM_OK);
  put_u16(entry, D);
  assert_int_equal(status_of_image(&r), RIM_E_RANGE);
}

/* Noise that watches no channel finds nothing, whatever comes. */
static void nothing_is_watched(void **state) {
  (void)state;
  recipe r = calibrated[0];
  double sd[CHANNELS];
  const bool is_active[CHANNELS] = {false};
  for (size_t c = 0; c < CHANNELS; ++c)
    sd[c] = 0.1;
  r.section[RIM_SECTION_NOISE].size = 0;
  put_noise_of(&r.section[RIM_SECTION_NOISE], sd, is_active);
  make_bench_of(&b, &r, false);
  for (uint32_t t = 0; t < 400; ++t) {
    const rim_verdict v = step(&b, 917, t, 4.0);
    assert_true(v.ln_anom == 0.0 && v.alarm.state == RIM_ALARM_NONE);
  }
  assert_true(rim_monitor_alarms(b.monitor).level <= RIM_LEVEL_WARN);
}

/* What was commanded in a gap is not known: for a while the slow mean of the command is not either,
 * and its blocks count as partly known. The fast one is known again at once. */
static void what_gaps_leave_unknown_is_counted(void **state) {
  (void)state;
  const size_t term_at = 32 + 4 * INPUTS + 4 * TIMES;
  for (unsigned slow = 0; slow < 2; ++slow) {
    recipe r = calibrated[0];
    put_u16(r.section[RIM_SECTION_BASIS].byte + term_at + 2, slow);
    make_bench_of(&b, &r, false);
    for (uint32_t t = 0; t < 50 * BLOCK; ++t)
      (void)step(&b, 918, t, 0.0);
    assert_int_equal(rim_monitor_get_health(b.monitor).partly, 0);
    for (uint32_t t = 50 * BLOCK + 6; t < 100 * BLOCK; ++t)
      (void)step(&b, 918, t, 0.0);
    const uint32_t partly = rim_monitor_get_health(b.monitor).partly;
    assert_true(slow ? partly > 0 && partly < 25 : partly == 0);
  }
}

/* More outcomes than the selection has channels for. */
static void too_many_outcomes(void **state) {
  (void)state;
  static recipe r;
  for (uint32_t outcomes = 128; outcomes <= 129; ++outcomes) {
    external_recipe(&r);
    set_word(&r, RIM_CONFIG_OUTCOMES, outcomes);
    put_threshold(&r.section[RIM_SECTION_THRESHOLD], outcomes, NULL, 0);
    static image blob;
    size_t size;
    build(&blob, &r);
    assert_int_equal(rim_monitor_size(blob.byte, blob.size, &size),
                     outcomes == 128 ? RIM_OK : RIM_E_CONFIG);
  }
}

/* Values near the end of all numbers are limited to what the range allows: nothing overflows, and
 * what follows is judged as ever. */
static void values_beyond_all_numbers(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    recipe r = calibrated[external];
    put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * 2, external ? 0.0 : -0.5);
    put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * (D + 2), external ? 0.25 : 0.5);
    make_bench_of(&b, &r, external != 0);
    for (uint32_t t = 0; t < 40; ++t)
      (void)step(&b, 921, t, 0.0);
    assert_int_equal(rim_monitor_get_health(b.monitor).rows.refused, 0);
    for (uint32_t t = 40; t < 40 + 2 * BLOCK; ++t) {
      row now;
      rim_verdict v;
      make_row(&now, external != 0, 921, t, 0.0);
      now.context[1] = now.context[2] = 1.7e308;
      assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
      assert_true(v.score == v.score && v.p_value >= 0.0 && v.p_value <= 1.0);
    }
    assert_true(rim_monitor_get_health(b.monitor).rows.out_of_range > 0);
    assert_int_equal(rim_monitor_get_health(b.monitor).rows.refused, 0);
    for (uint32_t t = 40 + 2 * BLOCK; t < 80; ++t) {
      const rim_verdict v = step(&b, 921, t, 0.0);
      assert_true(v.ln_anom == v.ln_anom && v.ln_anom < 1e6);
    }
  }
}

/* Where the only region feature is an outcome's own reading, no interval of it is that outcome's
 * region; the other outcomes have it. */
static void an_outcome_is_not_its_own_region(void **state) {
  (void)state;
  recipe r = calibrated[0];
  set_word(&r, RIM_CONFIG_REGION_FEATURES, 1);
  r.section[RIM_SECTION_REGION].size = 4;
  put_u16(r.section[RIM_SECTION_REGION].byte, 1); /* outcome 0 as measured */
  r.section[RIM_SECTION_CUTS].size = CUTS;
  make_bench_of(&b, &r, false);
  uint32_t of_others = 0;
  for (uint32_t t = 0; t < ROWS; ++t) {
    (void)step(&b, 922, t, 1.0);
    for (uint32_t c = 0; c < CHANNELS; ++c) {
      const search_hypothesis *h = rimi_search_best(b.monitor->search, c);
      const bool is_region =
          h->score > -1e9f && (h->family == SEARCH_INTERVAL || h->family == SEARCH_INTERVAL_SINCE);
      assert_false(is_region && c % O == 0);
      of_others += is_region;
    }
  }
  assert_true(of_others > 0);
}

/* Sums of the run's effects that are no numbers (they were hit, and no guard looked) leave a search
 * without effects, not one without numbers. */
static void effects_that_are_no_numbers(void **state) {
  (void)state;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 60 * BLOCK; ++t)
    (void)step(&b, 923, t, 0.0);
  rim_search *s = b.monitor->search;
  search_hypothesis h = {.family = SEARCH_SINCE, .onset = 40};
  assert_true(rimi_search_evaluate_channel(s, 1, &h));
  search_gram(s, 0)[0] = NAN;
  search_hypothesis again = {.family = SEARCH_SINCE, .onset = 40};
  (void)rimi_search_evaluate_channel(s, 0, &again);
  assert_true(isfinite(again.ln_ratio) && isfinite(again.shift) && isfinite(again.sd));
}

/* A feature may describe regions once, whichever two places of the list it is in. */
static void a_region_feature_twice(void **state) {
  (void)state;
  const unsigned list[][3] = {{0, 3, 2}, {3, 3, 2}, {0, 3, 3}, {2, 3, 2}};
  for (size_t k = 0; k < sizeof list / sizeof *list; ++k) {
    recipe r = calibrated[0];
    bytes *region = &r.section[RIM_SECTION_REGION], *cuts = &r.section[RIM_SECTION_CUTS];
    set_word(&r, RIM_CONFIG_REGION_FEATURES, 3);
    region->size = cuts->size = 0;
    for (size_t i = 0; i < 3; ++i) {
      u16(region, list[k][i]);
      u16(region, 0xffff);
    }
    for (size_t i = 0; i < 3 * CUTS; ++i)
      u8(cuts, (unsigned)((i % CUTS + 1) * 256 / 24));
    assert_int_equal(status_of_image(&r), k == 0 ? RIM_OK : RIM_E_RANGE);
  }
}

/* What agreement remembers of the blocks before is forgotten with the regions, all of it. */
static void what_agreement_remembers_is_forgotten(void **state) {
  (void)state;
  make_bench(&b, false);
  for (size_t i = 0; i < AGREEMENT_STATE * O; ++i)
    b.monitor->agreement_state[i] = 1.0 + (double)i;
  rimi_monitor_forget_regions(b.monitor);
  for (size_t i = 0; i < AGREEMENT_STATE * O; ++i)
    assert_true(b.monitor->agreement_state[i] == 0.0);
}

/* Gaps are those of the observations that are held: what was forgotten had its own. */
static void what_is_forgotten_takes_its_gaps_along(void **state) {
  (void)state;
  make_bench(&b, true);
  for (uint32_t t = 0; t < 60; ++t) {
    if (t < 20 || t >= 40)
      (void)step(&b, 931, t, 0.0);
  }
  assert_int_equal(b.monitor->gaps, 1);
  rim_monitor_restart(b.monitor, b.monitor->last.t_s);
  for (uint32_t t = 60; t < 70; ++t)
    (void)step(&b, 931, t, 0.0);
  assert_int_equal(b.monitor->gaps, 0);
}

/* An alarm that stands, over -1..1 of features 0 and 1. */
static rim_alarm stand_in_a_square(void) {
  make_bench(&b, false);
  b.monitor->guard.busy = true;
  const uint16_t feature[2] = {0, 1};
  const double low[2] = {-1.0, -1.0}, high[2] = {1.0, 1.0};
  rim_alarm a = sample_alarm(6);
  a.level = RIM_LEVEL_ERROR;
  assert_int_equal(rimi_region_from_box(&a.region, 2, feature, low, high), RIM_OK);
  rimi_alarm_life_row(&b.monitor->life, 1.0);
  for (int i = 0; i < 4; ++i)
    rimi_alarm_life_step(&b.monitor->life, RIM_DETECTOR_RIM, 1.0 + i, &a);
  assert_non_null(rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM));
  return a;
}

/* A plan of a single pose is one, too; none is none. Poses count from the plan's own time. */
static void a_plan_of_one_pose(void **state) {
  (void)state;
  (void)stand_in_a_square();
  const rim_lookahead_config c = {.axis = {0, 1, RIM_LOOKAHEAD_NO_AXIS}, .vertices = 1};
  for (uint32_t count = 0; count < 3; ++count) {
    rim_lookahead ahead = {.plan = {.count = count, .t_us = 2000000}};
    for (uint32_t i = 0; i < count; ++i)
      ahead.plan.pose[i] = (rim_pose){.after_s = 1.0 + i, .orientation = {1.0, 0.0, 0.0, 0.0}};
    rim_entry entry = {.to_entry_s = -5.0};
    assert_int_equal(rim_lookahead_update(&ahead, &c, b.monitor, 7, 2.5, false, false, &entry),
                     count > 0);
    assert_true(entry.to_entry_s == (count > 0 ? 0.5 : -5.0));
  }
}

/* Of a path that begins outside: the pose after which it is inside. */
static void an_entry_says_at_which_pose(void **state) {
  (void)state;
  const rim_alarm a = stand_in_a_square();
  const rim_lookahead_config c = {.axis = {0, 1, RIM_LOOKAHEAD_NO_AXIS}, .vertices = 1};
  rim_lookahead ahead = {.plan = {.count = 4}};
  for (uint32_t i = 0; i < 4; ++i)
    ahead.plan.pose[i] = (rim_pose){
        .after_s = i, .position = {9.0 - 3.0 * i, 0.0, 0.0}, .orientation = {1.0, 0.0, 0.0, 0.0}};
  rim_lookahead_result found;
  assert_true(rim_lookahead_check(&c, &a.region, &ahead.plan, 0.0, &found) && found.enters);
  assert_int_equal(found.pose, 2);
  rim_entry entry = {0};
  assert_true(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.0, false, false, &entry));
  assert_int_equal(entry.pose, 2);
  assert_true(fabs(entry.to_entry_s - 8.0 / 3.0) < 0.01);
}

/* An entry that was told is taken back when the alarm is over, and names the record that says so;
 * one that is told names its own alarm, though another spoke since. */
static void an_entry_names_its_alarm(void **state) {
  (void)state;
  make_bench(&b, false);
  b.monitor->guard.busy = true;
  rim_alarm_life *of = &b.monitor->life;
  const rim_lookahead_config c = {.axis = {0, 1, RIM_LOOKAHEAD_NO_AXIS}, .vertices = 1};
  rim_lookahead ahead = {.plan = {.count = 1, .sequence = 3}, .sequence = 4};
  ahead.plan.pose[0].orientation[0] = 1.0;
  ahead.told.sequence = 4;
  of->slot[0].record.seq = 77;
  rim_entry entry;
  assert_true(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.5, true, false, &entry));
  assert_true(entry.to_entry_s == RIM_ENTRY_NEVER && entry.t_s == 0.5);
  assert_int_equal(entry.alarm_sequence, 77);
  assert_int_equal(entry.sequence, 5);
  assert_int_equal(entry.plan_sequence, 3);
  assert_int_equal(entry.flags, RIM_ALARM_FLAG_REPLAY);
  assert_false(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.5, true, false, &entry));
  const uint16_t feature[2] = {0, 1};
  const double low[2] = {-1.0, -1.0}, high[2] = {1.0, 1.0};
  for (size_t i = 0; i < 2; ++i) {
    of->slot[i].stands = true;
    of->slot[i].record.seq = 80 + (uint32_t)i;
    assert_int_equal(rimi_region_from_box(&of->slot[i].record.region, 2, feature, low, high),
                     RIM_OK);
  }
  of->told = 1;
  assert_true(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.5, false, false, &entry));
  assert_true(entry.to_entry_s == 0.0);
  assert_int_equal(entry.alarm_sequence, 80);
  assert_int_equal(entry.sequence, 6);
  assert_int_equal(entry.flags, 0);
  assert_false(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.5, false, false, &entry));
  assert_true(rim_lookahead_update(&ahead, &c, b.monitor, 7, 0.5, false, true, &entry)); /* again */
}

/* Who asks without a monitor, or of what it does not have. */
static void questions_without_an_answer(void **state) {
  (void)state;
  const uint8_t place[REGION] = {0};
  assert_int_equal(rim_interference_get_health(NULL).rows, 0);
  assert_false(rimi_monitor_inside(NULL, place, 0));
  assert_null(rimi_monitor_place(NULL));
  for (int external = 0; external < 2; ++external) {
    make_bench(&b, external != 0);
    (void)step(&b, 919, 0, 0.0);
    assert_int_equal(rim_interference_get_health(b.monitor).rows, 0);
    assert_false(rimi_monitor_inside(b.monitor, NULL, 0));
    assert_false(rimi_monitor_inside(b.monitor, place, 0)); /* nothing was found yet */
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_end_before_its_begin_was_heard),
      cmocka_unit_test(a_policy_lets_go_what_is_over),
      cmocka_unit_test(alarms_without_an_outcome),
      cmocka_unit_test(a_query_looks_before_it_answers),
      cmocka_unit_test(every_policy_outlives_a_repair),
      cmocka_unit_test(a_gap_is_three_times_the_spacing),
      cmocka_unit_test(an_image_without_a_rate_is_gone_through),
      cmocka_unit_test(an_index_is_looked_at_each_row),
      cmocka_unit_test(everything_is_looked_at_at_once),
      cmocka_unit_test(copies_with_spoilt_parts),
      cmocka_unit_test(a_level_is_used),
      cmocka_unit_test(an_angle_is_off_by_the_shorter_way),
      cmocka_unit_test(products_are_used),
      cmocka_unit_test(a_level_says_nothing_beyond_its_training),
      cmocka_unit_test(a_region_over_an_outcome),
      cmocka_unit_test(nothing_is_watched),
      cmocka_unit_test(what_gaps_leave_unknown_is_counted),
      cmocka_unit_test(a_region_feature_twice),
      cmocka_unit_test(what_agreement_remembers_is_forgotten),
      cmocka_unit_test(what_is_forgotten_takes_its_gaps_along),
      cmocka_unit_test(a_plan_of_one_pose),
      cmocka_unit_test(an_entry_says_at_which_pose),
      cmocka_unit_test(an_entry_names_its_alarm),
      cmocka_unit_test(questions_without_an_answer),
      cmocka_unit_test(too_many_outcomes),
      cmocka_unit_test(values_beyond_all_numbers),
      cmocka_unit_test(an_outcome_is_not_its_own_region),
      cmocka_unit_test(effects_that_are_no_numbers),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
