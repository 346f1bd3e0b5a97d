/* SPDX-License-Identifier: MIT */
/* The monitor with models of steps: what an outcome does next, from the block before. */
#include <math.h>

#include "monitor/guard.h"
#include "monitor/inspect.h"
#include "monitor/monitor_private.h"
#include "monitor/work.h"
#include "search/search_private.h"

#include "monitor_bench.h"

static bench b;

/* An image with a model of the step of outcome 1: a kind of channels more. */
static recipe with_steps(void) {
  recipe r = calibrated[0];
  put_quadratic(&r.section[RIM_SECTION_QUADRATIC], D, 1, RIM_QUADRATIC_STEPS);
  bytes *noise = &r.section[RIM_SECTION_NOISE];
  const size_t begin = 4 * NOISE_HEADER_WORDS, of_outcomes = (noise->size - begin) / CHANNELS * O;
  memcpy(noise->byte + noise->size, noise->byte + begin, of_outcomes); /* as those of behaviour */
  noise->size += of_outcomes;
  put_u32(noise->byte + 4, CHANNELS + O);
  put_f32(noise->byte + noise->size - of_outcomes, 0.0); /* outcome 0 has no model of its step */
  put_threshold(&r.section[RIM_SECTION_THRESHOLD], CHANNELS + O, NULL, 0);
  return r;
}

/* A row of a flight with a gap in its middle, too long to be filled. */
static void row_of_flight(uint32_t t) {
  row now;
  rim_verdict verdict;
  make_row(&now, false, 915, t, 0.0);
  now.view.t_s += t >= 20 * BLOCK ? 100.0 * PERIOD_S : 0.0;
  assert_int_equal(rim_monitor_step(b.monitor, &now.view, &verdict), RIM_OK);
}

static void steps_are_looked_at(void **state) {
  (void)state;
  recipe r = with_steps();
  make_bench_of(&b, &r, false);
  assert_int_equal(b.monitor->channel_count, CHANNELS + O);
  rim_work_counts counts;
  assert_int_equal(rimi_work_counts_of(b.blob.byte, b.blob.size, &counts), RIM_OK);
  assert_int_equal(counts.channels, CHANNELS + O);
  assert_int_equal(rimi_monitor_channels(b.monitor), CHANNELS + O);
  double before = 0.0;
  uint32_t seen = 0, gaps = 0;
  for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
    const uint32_t seen_before = rimi_search_blocks(b.monitor->search);
    row_of_flight(t);
    if (rimi_search_blocks(b.monitor->search) == seen_before)
      continue;
    const double x = fmin(fmax(rimi_blocks_context(b.monitor->rows)[0], -4.0), 4.0);
    const double left = rimi_blocks_outcomes(b.monitor->rows)[1] - 0.125 - 0.5 * x * before;
    const bool alone = seen_before == 0 || (gaps < 2 && t > 20 * BLOCK); /* or behind the gap */
    gaps += alone;
    seen += !alone;
    assert_true(search_is_known(b.monitor->search, CHANNELS + 1, seen_before) ==
                !alone); /* its slot */
    assert_true(alone || fabs(b.monitor->residual[CHANNELS + 1] - left) < 1e-9);
    before = x;
  }
  assert_true(seen > 30 && gaps == 2);
  put_threshold(&r.section[RIM_SECTION_THRESHOLD], CHANNELS, NULL, 0);
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG); /* of too few channels */
  r = with_steps();
  r.section[RIM_SECTION_QUADRATIC].size = 0;
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG); /* channels of steps without models */
  r = calibrated[0];
  put_quadratic(&r.section[RIM_SECTION_QUADRATIC], D, 1, RIM_QUADRATIC_STEPS);
  assert_int_equal(status_of_image(&r), RIM_E_CONFIG); /* models without channels */
}

/* What outcome 0 is held against is products of readings of the block before: behind a gap nothing
 * is known of that, but of outcome 1 it is. */
static void products_need_the_block_before(void **state) {
  (void)state;
  recipe r = calibrated[0];
  put_quadratic(&r.section[RIM_SECTION_QUADRATIC], D, 0, RIM_QUADRATIC_AGREES);
  bytes *agreement = &r.section[RIM_SECTION_AGREEMENT];
  put_f32(agreement->byte + 16 + 4 * O, AGREEMENT_QUADRATIC); /* without integrands */
  make_bench_of(&b, &r, false);
  uint32_t alone = 0;
  for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
    row_of_flight(t);
    const uint32_t seen = rimi_search_blocks(b.monitor->search);
    if (seen == 0 || t % BLOCK != BLOCK - 1)
      continue;
    alone += !search_is_known(b.monitor->search, O, seen - 1);
    assert_true(search_is_known(b.monitor->search, O + 1, seen - 1));
    assert_true(search_is_known(b.monitor->search, 0, seen - 1));
  }
  assert_int_equal(alone, 2); /* the first, and that behind the gap */
}

/* One wrong sensor disturbs the steps of several outcomes: they lead where nothing else does. */
static void steps_lead_last(void **state) {
  (void)state;
  recipe r = with_steps();
  make_bench_of(&b, &r, false);
  for (uint32_t t = 0; t < 40 * BLOCK; ++t)
    (void)step(&b, 916, t, 0.0);
  b.monitor->models.threshold.alarm_score = 1e4f; /* beyond what the search itself finds */
  channel_state *own = search_state(b.monitor->search, 1);
  channel_state *next = search_state(b.monitor->search, CHANNELS + 1);
  for (int other = 0; other < 2; ++other) {
    own->time.score = other ? 1.1e4f : 9e3f; /* of behaviour */
    next->time.score = 5e4f;
    rimi_guard_fix(b.monitor);
    rimi_guard_leave(b.monitor);
    rim_verdict v = {0};
    v = step(&b, 916, (40 + (uint32_t)other) * BLOCK, 0.0);
    assert_int_equal(v.channel, other ? 1 : CHANNELS + 1);
  }
  /* Nor do they take over an alarm that another channel raised. */
  uint32_t t = 42 * BLOCK;
  b.monitor->models.threshold.alarm_score = 10.0f; /* the model of the step is a wrong one */
  rimi_guard_fix(b.monitor);
  rimi_guard_leave(b.monitor);
  for (; t < 62 * BLOCK && rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM) == NULL; ++t)
    (void)step(&b, 916, t, 0.0);
  assert_non_null(rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM));
  b.monitor->models.threshold.alarm_score = 1e4f;
  for (int by_step = 0; by_step < 2; ++by_step, ++t) {
    b.monitor->explained_channel = by_step ? CHANNELS + 1 : 1;
    next->time.score = 5e4f;
    rimi_guard_fix(b.monitor);
    rimi_guard_leave(b.monitor);
    assert_int_equal(step(&b, 916, t, 0.0).channel == CHANNELS + 1, by_step);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(steps_are_looked_at),
                                     cmocka_unit_test(products_need_the_block_before),
                                     cmocka_unit_test(steps_lead_last)};
  return cmocka_run_group_tests(tests, set_up, NULL);
}
