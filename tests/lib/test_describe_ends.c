/* SPDX-License-Identifier: MIT */
/* monitor/describe.c: a record names what deviates and nothing behind it; when a row came that
 * followed a gap. */
#include <math.h>

#include "describe_bench.h"

enum { B0 = 0, B1 = 1, A0 = AGREEMENT, A1 = AGREEMENT + 1 };

static double both_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel < 2 * O && i >= 40 ? 4.0 : 0.0;
}

/* A monitor in which this channel leads, and the other outcome's scores this. By its behaviour the
 * first deviates a little too, so that the other is not looked at again. */
static void lead(uint16_t channel, double other) {
  const recipe r = without_integrals();
  from(&r, false);
  feed(both_since_40, 0.2);
  plant_nothing();
  plant(channel, SEARCH_SINCE, 3.0 * alarm_at, as_shift(channel, 4.0), 40);
  plant(channel ^ 1u, SEARCH_SINCE, other, as_shift(channel ^ 1u, 4.0), 40);
  if (channel >= AGREEMENT)
    plant((uint16_t)(channel - AGREEMENT), SEARCH_SINCE, 3.5, as_shift(B1, 4.0), 40);
}

/* The first outcome is named beside the second; where its score does not pass nothing is said of
 * it, neither a size nor a sign. Just the alarm's score passes. */
static void what_is_named_and_what_is_not(void **state) {
  (void)state;
  for (uint16_t channel = B1; channel <= A1; channel = (uint16_t)(channel + O)) {
    for (int passes = 0; passes < 2; ++passes) {
      rim_alarm a;
      lead(channel, passes ? (double)(float)alarm_at : 0.999 * alarm_at);
      alarm_at = m->models.threshold.alarm_score = (double)(float)alarm_at;
      assert_int_equal(named(channel, &a), channel);
      assert_true(a.channel[0] == 1 && a.channels == 1 + passes);
      assert_true(a.channel[1] == 0 && (a.shift[1] > 0.0) == (passes == 1));
      assert_true((a.shift_sd[1] > 0.0) == (passes == 1) && a.shift[2] == 0.0);
      assert_int_equal(m->said_high[0], passes ? 3 : 2); /* bits of both, or of one */
    }
  }
}

/* A drift and a shift are in one unit, so the size of one is said beside the other. Of an outcome's
 * behaviour and agreement, what explains more says it. Of a share nothing is said. */
static void sizes_of_what_is_named_beside(void **state) {
  (void)state;
  static const struct {
    uint8_t leading, beside;
    uint16_t of;
  } of[] = {{SEARCH_SINCE, SEARCH_RAMP, B0},
            {SEARCH_RAMP, SEARCH_SINCE, B0},
            {SEARCH_SINCE, SEARCH_SINCE, A0},
            {SEARCH_SINCE, SEARCH_GAIN, B0}};
  const recipe r = without_integrals();
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    rim_alarm a;
    from(&r, false);
    feed(nothing, 0.2);
    plant_nothing();
    plant(B1, of[i].leading, 3.0 * alarm_at, 4.0, 40);
    plant(B0, SEARCH_SINCE, 1.5 * alarm_at, 4.0, 40);
    plant(A0, SEARCH_SINCE, -2e9, 4.0, 40);
    plant(of[i].of, of[i].beside, 2.0 * alarm_at, -4.0, 40);
    assert_int_equal(named(B1, &a), B1);
    assert_true(a.channels == 2 && a.channel[1] == 0);
    const bool is_share = of[i].beside == SEARCH_GAIN;
    assert_true((a.shift[1] < 0.0) == !is_share && (a.shift_sd[1] > 0.0) == !is_share);
  }
}

/* What stands is of the first outcome, and what deviates now is the second alone: another. */
static void another_outcome_has_its_own_time(void **state) {
  (void)state;
  rim_alarm a;
  lead(B1, 0.5 * alarm_at);
  stand(0);
  rim_alarm *standing = &m->life.slot[RIM_DETECTOR_RIM].record;
  standing->since_s = -7.0;
  m->raised_at = 20;
  assert_int_equal(named(B1, &a), B1);
  assert_true(a.channels == 1 && a.since_s != -7.0);
}

/* A gain of what others' readings say is a share, in whatever unit the residual is. */
static void a_gain_of_agreement_is_a_share(void **state) {
  (void)state;
  for (int gain = 0; gain < 2; ++gain) {
    rim_alarm a;
    const recipe r = without_integrals();
    from(&r, false);
    rim_rng rng;
    rimi_rng_seed(&rng, SEED, 3);
    for (uint32_t t = 0; t < BLOCKS; ++t) {
      double residual[CHANNELS], predicted[CHANNELS] = {0.0};
      const uint8_t feature[REGION] = {(uint8_t)(t * 37u), (uint8_t)(t * 101u)};
      predicted[A0] = t % 2u == 0 ? 0.5 : 1.5;
      for (uint32_t c = 0; c < CHANNELS; ++c)
        residual[c] = 0.02 * rimi_rng_normal(&rng);
      residual[A0] += t < 40 ? 0.0 : gain ? 0.25 * predicted[A0] : 0.25;
      const search_block block = {.t_s = t,
                                  .feature = feature,
                                  .mean = predicted,
                                  .predicted = predicted,
                                  .residual = residual};
      assert_int_equal(rimi_search_observe(m->search, &block), RIM_OK);
    }
    rimi_search_work(m->search, 200);
    assert_int_equal(named(A0, &a), A0);
    assert_int_equal(a.kind, gain ? RIM_KIND_GAIN : RIM_KIND_SHIFT);
    assert_true(a.shift[0] > 0.2 && a.shift[0] < 0.3);
  }
}

/* Rows that all deviate, as many as the ring and `gone` more: the oldest is number `gone`. */
static double since_of(uint32_t gone, const monitor_gap *gap, uint32_t gaps) {
  rim_alarm a;
  from(&calibrated[1], true);
  (void)step(&b, 901, 0, 0.0); /* the caller's standard deviations */
  m->guard.busy = true;
  for (uint32_t i = 1; i < EXTERNAL_RING + gone; ++i) {
    const double unit[REGION] = {0.5, 0.5}, r[O] = {5.0, 0.0};
    assert_int_equal(rimi_select_observe(m->select, unit, r), RIM_OK);
  }
  m->first_block_s = 10.0;
  m->last_block_s = 1000.0;
  m->gaps = gaps;
  memcpy(m->gap, gap, sizeof m->gap);
  const rim_verdict v = {.channel = 0, .level = RIM_LEVEL_ERROR, .t_s = 1000.0};
  rimi_monitor_describe(m, &v, &a);
  assert_true(a.channels == 1 && a.shift[0] > 0.0 && a.shift[1] == 0.0 && a.shift_sd[1] == 0.0);
  return a.since_s;
}

/* A row has the time that it came at, also the last before a gap and the first after it, and of two
 * rows between gaps each. */
static void rows_beside_gaps_have_their_times(void **state) {
  (void)state;
  monitor_gap gap[MONITOR_GAPS];
  memset(gap, 0, sizeof gap);
  gap[0] = (monitor_gap){100.0, 150.0, 10};
  gap[1] = (monitor_gap){170.0, 500.0, 12};
  assert_true(rimi_abs(since_of(9, gap, 2) - 100.0) < 1e-9); /* 10 rows from 10 s to 100 s */
  assert_true(rimi_abs(since_of(8, gap, 2) - 90.0) < 1e-9);
  assert_true(rimi_abs(since_of(10, gap, 2) - 150.0) < 1e-9);
  assert_true(rimi_abs(since_of(11, gap, 2) - 170.0) < 1e-9);
  assert_true(rimi_abs(since_of(12, gap, 2) - 500.0) < 1e-9);
  for (uint32_t i = 0; i < MONITOR_GAPS; ++i) /* as many as are kept */
    gap[i] = (monitor_gap){100.0 * (i + 1), 100.0 * (i + 1) + 50.0, 2 * (i + 1)};
  assert_true(rimi_abs(since_of(0, gap, MONITOR_GAPS) - 10.0) < 1e-9);
  assert_true(rimi_abs(since_of(1, gap, MONITOR_GAPS) - 100.0) < 1e-9);
  assert_true(rimi_abs(since_of(2 * MONITOR_GAPS, gap, MONITOR_GAPS) - 850.0) < 1e-9);
  assert_true(rimi_abs(since_of(0, gap, 0) - 10.0) < 1e-9);
}

/* Of rows that are off by 5 and -4 of the caller's standard deviations each outcome that is named
 * has its own shift. */
static void each_outcome_of_rows_has_its_shift(void **state) {
  (void)state;
  for (uint16_t leading = 0; leading < O; ++leading) {
    rim_alarm a;
    from(&calibrated[1], true);
    (void)step(&b, 901, 0, 0.0); /* the caller's standard deviations: one half */
    m->guard.busy = true;
    for (uint32_t i = 0; i < EXTERNAL_RING; ++i) {
      const double unit[REGION] = {0.5, 0.5}, r[O] = {5.0, -4.0};
      assert_int_equal(rimi_select_observe(m->select, unit, r), RIM_OK);
    }
    const rim_verdict v = {.channel = leading, .level = RIM_LEVEL_ERROR, .t_s = 1000.0};
    rimi_monitor_describe(m, &v, &a);
    assert_true(a.channels == O && a.channel[0] == leading && a.channel[1] == 1 - leading);
    for (size_t i = 0; i < O; ++i) {
      assert_true(rimi_abs(a.shift[i] - (a.channel[i] == 0 ? 2.5 : -2.0)) < 0.1);
      assert_true(a.shift_sd[i] > 0.0 && a.shift_sd[i] < 0.2);
    }
  }
}

/* What a rate has left after each block, where feature 0 is in its upper half: units of 0.05. */
#define RATE 2.0
static double rate_above_half(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  double kept = 0.0;
  for (uint32_t k = 0; k <= i; ++k)
    kept = SEARCH_KEEPS * kept + ((uint8_t)(k * 37u) >= 128u ? RATE : 0.0);
  return channel == 0 ? kept : 0.0;
}

/* In each block other features are looked at for a rate. Once found it stays while it explains
 * most, and its size is what blocks inside deviate by in the mean. */
static void a_rate_stays_until_its_next_turn(void **state) {
  (void)state;
  const struct {
    wave *of;
    uint16_t channel; /* explained before */
    bool stays;
  } of[] = {{rate_above_half, 0, true}, {both_since_40, 0, false}, {rate_above_half, 1, false}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&calibrated[0], false);
    feed_blocks(of[i].of, 0.1, TRAINED_RING - TRAINED_RING % 8 + 5);
    plant_nothing();
    m->explained = (search_hypothesis){.family = SEARCH_INTERVAL,
                                       .shape = SEARCH_KEPT,
                                       .first = {SEARCH_BINS / 2},
                                       .last = {SEARCH_BINS - 1},
                                       .onset = SEARCH_FROM_START};
    m->explained_channel = of[i].channel;
    m->has_explained = true;
    rim_alarm a;
    assert_int_equal(named(0, &a), 0);
    assert_int_equal(m->explained.shape == SEARCH_KEPT, of[i].stays);
    if (!of[i].stays)
      continue;
    assert_true(a.kind == RIM_KIND_SHIFT && a.region.dims == 1 && a.region.feature[0] == 0);
    const double mean = rimi_search_kept_mean(m->search, &m->explained);
    /* The run may have an offset of its own, which takes some of it. */
    assert_true(fabs(a.shift[0] - 0.05 * RATE * mean) < 0.1 * a.shift[0]);
    assert_true(mean > 5.0 && a.shift_sd[0] < 0.1 * a.shift[0]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_is_named_and_what_is_not),
                                     cmocka_unit_test(sizes_of_what_is_named_beside),
      cmocka_unit_test(another_outcome_has_its_own_time),
      cmocka_unit_test(a_gain_of_agreement_is_a_share),
      cmocka_unit_test(rows_beside_gaps_have_their_times),
      cmocka_unit_test(each_outcome_of_rows_has_its_shift),
      cmocka_unit_test(a_rate_stays_until_its_next_turn),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
