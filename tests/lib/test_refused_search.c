/* SPDX-License-Identifier: MIT */
/* Searches, corrections and the interference detector: every NULL, count and number that is
 * refused, one at a time; and every index of the searches that a flipped bit may spoil. */
#include "refuses.h"

#include <math.h>

#include "batch/dmaps.h"
#include "batch/faro.h"
#include "batch/select_batch.h"
#include "batch/stats.h"
#include "image/correct.h"
#include "image/noise.h"
#include "interference/detector.h"
#include "interference_sample.h"
#include "search/select_private.h"

static _Alignas(8) uint8_t memory[1 << 20];
static const double nan_value = (double)NAN, infinite = (double)INFINITY;

enum { N = 12 };
static double u[N * 3], r[N * 2];

static rim_batch_data data_good(void) {
  for (int i = 0; i < N; ++i) {
    u[3 * i] = (i + 0.5) / N;
    u[3 * i + 1] = u[3 * i + 2] = 0.5;
    r[2 * i] = i < 6 ? 5.0 : 0.0;
    r[2 * i + 1] = 0.0;
  }
  const rim_batch_data d = {.n = N, .features = 3, .outcomes = 2, .u = u, .r = r};
  return d;
}

#define BATCH_WITH(object, field, value, expected)                                                 \
  do {                                                                                             \
    rim_batch_config c = {.seed = 3};                                                              \
    rim_batch_data d = data_good();                                                                \
    object.field = (value);                                                                        \
    rim_batch_result result;                                                                       \
    if ((expected) == RIM_OK)                                                                      \
      assert_int_equal(rimi_select_batch(&c, &d, memory, sizeof memory, &result), RIM_OK);         \
    else                                                                                           \
      REFUSES(result, expected, rimi_select_batch(&c, &d, memory, sizeof memory, &result));        \
  } while (0)

static void a_batch_search_refuses(void **state) {
  (void)state;
  BATCH_WITH(c, seed, 4, RIM_OK);
  BATCH_WITH(d, features, 0, RIM_E_CONFIG);
  BATCH_WITH(d, features, 129, RIM_E_CONFIG);
  BATCH_WITH(d, outcomes, 0, RIM_E_CONFIG);
  BATCH_WITH(d, outcomes, 129, RIM_E_CONFIG);
  BATCH_WITH(c, nodes, RIM_BATCH_MAX_NODES + 1, RIM_E_CONFIG);
  BATCH_WITH(c, max_dims, RIM_REGION_MAX_DIMS + 1, RIM_E_CONFIG);
  BATCH_WITH(c, bins, 3, RIM_E_CONFIG);
  BATCH_WITH(c, bins, 4, RIM_OK);
  BATCH_WITH(c, bins, RIM_BATCH_MAX_BINS + 1, RIM_E_CONFIG);
  BATCH_WITH(c, balls, 1, RIM_OK);
  BATCH_WITH(c, heuristic, (rim_heuristic)(RIM_HEURISTIC_NONE + 1), RIM_E_CONFIG);
  BATCH_WITH(d, n, 0, RIM_E_DATA);
  BATCH_WITH(d, n, UINT32_MAX, RIM_E_SIZE);
  BATCH_WITH(d, u, NULL, RIM_E_ARGUMENT);
  BATCH_WITH(d, r, NULL, RIM_E_ARGUMENT);
  const rim_batch_config c = {.seed = 3};
  const rim_batch_data d = data_good();
  rim_batch_result result;
  const size_t bytes = RIM_BATCH_SIZE(N, 3, 20);
  REFUSES(result, RIM_E_ARGUMENT, rimi_select_batch(NULL, &d, memory, bytes, &result));
  REFUSES(result, RIM_E_ARGUMENT, rimi_select_batch(&c, NULL, memory, bytes, &result));
  REFUSES(result, RIM_E_ARGUMENT, rimi_select_batch(&c, &d, NULL, bytes, &result));
  IS_ARGUMENT(rimi_select_batch(&c, &d, memory, bytes, NULL));
  REFUSES(result, RIM_E_ALIGN, rimi_select_batch(&c, &d, memory + 4, bytes, &result));
  REFUSES(result, RIM_E_SIZE, rimi_select_batch(&c, &d, memory, bytes - 1, &result));
  assert_int_equal(rimi_select_batch(&c, &d, memory, bytes, &result), RIM_OK);
  assert_true(result.found && result.feature[0] == 0 && result.inside == 6);
  assert_true(fabs(result.ln_anom - 0.5 * 6 * 25) < 1e-9); /* eq. 3.7: s^2 / 2w */
}

#define DMAPS_WITH(object, field, value, expected)                                                 \
  do {                                                                                             \
    rim_dmaps_config c = {.least = 2, .lambda = 1.0};                                              \
    rim_batch_data d = data_good();                                                                \
    object.field = (value);                                                                        \
    rim_dmaps_result result;                                                                       \
    if ((expected) == RIM_OK)                                                                      \
      assert_int_equal(rimi_dmaps_find(&c, &d, NULL, memory, sizeof memory, &result), RIM_OK);     \
    else                                                                                           \
      REFUSES(result, expected, rimi_dmaps_find(&c, &d, NULL, memory, sizeof memory, &result));    \
  } while (0)

static void dmaps_refuses(void **state) {
  (void)state;
  DMAPS_WITH(c, regions, 1, RIM_OK);
  DMAPS_WITH(c, regions, RIM_DMAPS_MAX_REGIONS, RIM_OK);
  DMAPS_WITH(c, sweeps, 8, RIM_OK);
  DMAPS_WITH(c, search.max_dims, RIM_REGION_MAX_DIMS, RIM_OK);
  DMAPS_WITH(c, search.nodes, RIM_BATCH_MAX_NODES, RIM_OK);
  DMAPS_WITH(c, border, 1.0, RIM_OK);
  DMAPS_WITH(d, features, 0, RIM_E_CONFIG);
  DMAPS_WITH(d, features, 129, RIM_E_CONFIG);
  DMAPS_WITH(d, outcomes, 0, RIM_E_CONFIG);
  DMAPS_WITH(d, outcomes, 129, RIM_E_CONFIG);
  DMAPS_WITH(c, regions, RIM_DMAPS_MAX_REGIONS + 1, RIM_E_CONFIG);
  DMAPS_WITH(c, sweeps, 9, RIM_E_CONFIG);
  DMAPS_WITH(c, search.max_dims, RIM_REGION_MAX_DIMS + 1, RIM_E_CONFIG);
  DMAPS_WITH(c, search.nodes, RIM_BATCH_MAX_NODES + 1, RIM_E_CONFIG);
  DMAPS_WITH(c, search.heuristic, RIM_HEURISTIC_NONE, RIM_E_CONFIG);
  DMAPS_WITH(c, lambda, -1.0, RIM_E_CONFIG);
  DMAPS_WITH(c, lambda, infinite, RIM_E_CONFIG);
  DMAPS_WITH(c, lambda_dim, nan_value, RIM_E_CONFIG);
  DMAPS_WITH(c, border, -0.1, RIM_E_CONFIG);
  DMAPS_WITH(c, border, 1.5, RIM_E_CONFIG);
  DMAPS_WITH(c, cem.elites, 200, RIM_E_CONFIG);
  DMAPS_WITH(c, search.cem.elites, 200, RIM_E_CONFIG);
  DMAPS_WITH(d, n, 0, RIM_E_DATA);
  DMAPS_WITH(d, n, UINT32_MAX, RIM_E_SIZE);
  DMAPS_WITH(d, u, NULL, RIM_E_ARGUMENT);
  DMAPS_WITH(d, r, NULL, RIM_E_ARGUMENT);
}

static void dmaps_wants_its_pieces(void **state) {
  (void)state;
  const rim_dmaps_config c = {.least = 2, .lambda = 1.0};
  rim_batch_data d = data_good(), bare = d;
  rim_dmaps_result result;
  uint8_t skip[N] = {0}, owner[N];
  double shift[2];
  const size_t bytes = RIM_DMAPS_SIZE(N, 3, 2, 20);
  REFUSES(result, RIM_E_ARGUMENT, rimi_dmaps_find(NULL, &d, NULL, memory, bytes, &result));
  REFUSES(result, RIM_E_ARGUMENT, rimi_dmaps_find(&c, NULL, NULL, memory, bytes, &result));
  REFUSES(result, RIM_E_ARGUMENT, rimi_dmaps_find(&c, &d, NULL, NULL, bytes, &result));
  IS_ARGUMENT(rimi_dmaps_find(&c, &d, NULL, memory, bytes, NULL));
  REFUSES(result, RIM_E_ALIGN, rimi_dmaps_find(&c, &d, NULL, memory + 4, bytes, &result));
  REFUSES(result, RIM_E_SIZE, rimi_dmaps_find(&c, &d, NULL, memory, bytes - 1, &result));
  skip[1] = 1;
  assert_int_equal(rimi_dmaps_find(&c, &d, skip, memory, bytes, &result), RIM_OK);
  assert_int_equal(result.count, 1);
  assert_int_equal(result.region[0].count, 5);
  REFUSES(owner, RIM_E_ARGUMENT, rimi_dmaps_assign(NULL, &d, skip, owner));
  REFUSES(owner, RIM_E_ARGUMENT, rimi_dmaps_assign(&result, NULL, skip, owner));
  bare.u = NULL;
  REFUSES(owner, RIM_E_ARGUMENT, rimi_dmaps_assign(&result, &bare, skip, owner));
  IS_ARGUMENT(rimi_dmaps_assign(&result, &d, skip, NULL));
  assert_int_equal(rimi_dmaps_assign(&result, &d, skip, owner), RIM_OK);
  for (int i = 0; i < N; ++i)
    assert_int_equal(owner[i], i < 6 && i != 1);
  REFUSES(shift, RIM_E_ARGUMENT, rimi_dmaps_shift(NULL, owner, 1, shift));
  bare = d;
  bare.r = NULL;
  REFUSES(shift, RIM_E_ARGUMENT, rimi_dmaps_shift(&bare, owner, 1, shift));
  REFUSES(shift, RIM_E_ARGUMENT, rimi_dmaps_shift(&d, NULL, 1, shift));
  REFUSES(shift, RIM_E_ARGUMENT, rimi_dmaps_shift(&d, owner, 0, shift));
  IS_ARGUMENT(rimi_dmaps_shift(&d, owner, 1, NULL));
  assert_int_equal(rimi_dmaps_shift(&d, owner, 1, shift), RIM_OK);
  assert_true(shift[0] == 5.0 && shift[1] == 0.0);
  assert_int_equal(rimi_dmaps_shift(&d, owner, 2, shift), RIM_OK); /* a region without a row */
  assert_true(shift[0] == 0.0 && shift[1] == 0.0);
  d.features = 0;
  REFUSES(owner, RIM_E_RANGE, rimi_dmaps_assign(&result, &d, skip, owner));
}

static double value_of(const rim_ellipsoid *e, void *context) {
  (void)e, (void)context;
  return 1.0;
}

static void faro_and_statistics_refuse(void **state) {
  (void)state;
  rim_faro faro;
  rim_faro_config c = {.dims = 1};
  bool found = false;
  const double x = 0.5;
  REFUSES(faro, RIM_E_ARGUMENT, rimi_faro_init(&faro, NULL));
  IS_ARGUMENT(rimi_faro_init(NULL, &c));
  c.radius = infinite;
  REFUSES(faro, RIM_E_CONFIG, rimi_faro_init(&faro, &c));
  c.radius = -1.0;
  REFUSES(faro, RIM_E_CONFIG, rimi_faro_init(&faro, &c));
  c.radius = 0.25;
  assert_int_equal(rimi_faro_init(&faro, &c), RIM_OK);
  IS_ARGUMENT(rimi_faro_step(NULL, &x, value_of, NULL, 0.0, &found));
  IS_ARGUMENT(rimi_faro_step(&faro, NULL, value_of, NULL, 0.0, &found));
  IS_ARGUMENT(rimi_faro_step(&faro, &x, NULL, NULL, 0.0, &found));
  IS_ARGUMENT(rimi_faro_step(&faro, &x, value_of, NULL, 0.0, NULL));
  assert_int_equal(rimi_faro_step(&faro, &nan_value, value_of, NULL, 0.0, &found), RIM_E_DATA);
  assert_true(faro.steps == 0 && !found);
}

#define DETECTOR_WITH(field, value, expected)                                                      \
  do {                                                                                             \
    rim_interference_model m = sample_interference();                                              \
    m.field = (value);                                                                             \
    assert_int_equal(rimi_interference_pack(&m, memory, RIM_INTERFERENCE_BYTES), expected);        \
  } while (0)

static void a_detector_refuses(void **state) {
  (void)state;
  DETECTOR_WITH(latency_s, 0.0, RIM_OK);
  DETECTOR_WITH(mean[4][2], nan_value, RIM_E_DATA);
  DETECTOR_WITH(sd[4][2], 0.0, RIM_E_DATA);
  DETECTOR_WITH(sd[0][0], infinite, RIM_E_DATA);
  DETECTOR_WITH(ln_odds, nan_value, RIM_E_DATA);
  DETECTOR_WITH(latency_s, -0.1, RIM_E_DATA);
  DETECTOR_WITH(latency_s, infinite, RIM_E_DATA);
  DETECTOR_WITH(accel_mps2, 0.0, RIM_E_DATA);
  DETECTOR_WITH(decel_mps2, -1.0, RIM_E_DATA);
  DETECTOR_WITH(limit_spread, -0.1, RIM_E_DATA);
  DETECTOR_WITH(limit_spread, 0.95, RIM_E_DATA);
  DETECTOR_WITH(limit_spread, 0.9, RIM_OK);
  DETECTOR_WITH(settle_s, nan_value, RIM_E_DATA);
  DETECTOR_WITH(gap_s, 0.0, RIM_E_DATA);
  DETECTOR_WITH(one_step.sd_steady, 0.0, RIM_E_DATA);
  DETECTOR_WITH(one_step.sd_ramp, 0.0, RIM_E_DATA);
  DETECTOR_WITH(one_step.slack, -1.0, RIM_E_DATA);
  DETECTOR_WITH(open_loop.threshold, 0.0, RIM_E_DATA);
  DETECTOR_WITH(transition[2][3], -0.2, RIM_E_DATA);
  DETECTOR_WITH(transition[2][3], 1.2, RIM_E_DATA);
  DETECTOR_WITH(transition[2][3], 0.3, RIM_E_DATA); /* the row's sum is not 1 */
}

static void a_detector_wants_its_pieces(void **state) {
  (void)state;
  rim_interference_model m = sample_interference(), back;
  rim_interference state_of_it;
  rim_interference_verdict v;
  rim_alarm a;
  double seen[RIM_INTERFERENCE_GAUSSIANS];
  IS_ARGUMENT(rimi_interference_pack(NULL, memory, RIM_INTERFERENCE_BYTES));
  IS_ARGUMENT(rimi_interference_pack(&m, NULL, RIM_INTERFERENCE_BYTES));
  assert_int_equal(rimi_interference_pack(&m, memory, RIM_INTERFERENCE_BYTES), RIM_OK);
  REFUSES(back, RIM_E_ARGUMENT, rimi_interference_open(&back, NULL, RIM_INTERFERENCE_BYTES));
  IS_ARGUMENT(rimi_interference_open(NULL, memory, RIM_INTERFERENCE_BYTES));
  IS_ARGUMENT(rimi_interference_of_image(NULL, NULL));
  REFUSES(back, RIM_E_ARGUMENT, rimi_interference_of_image(&back, NULL));
  REFUSES(state_of_it, RIM_E_ARGUMENT, rimi_interference_init(&state_of_it, NULL));
  IS_ARGUMENT(rimi_interference_init(NULL, &m));
  rimi_interference_reset(NULL);
  assert_int_equal(rimi_interference_init(&state_of_it, &m), RIM_OK);
  REFUSES(v, RIM_E_ARGUMENT, rimi_interference_step(NULL, 0.0, 0.0, 0.0, &v));
  IS_ARGUMENT(rimi_interference_step(&state_of_it, 0.0, 0.0, 0.0, NULL));
  rim_interference never = state_of_it;
  never.hmm.model.states = 0;
  REFUSES(v, RIM_E_ARGUMENT, rimi_interference_step(&never, 0.0, 0.0, 0.0, &v));
  assert_false(rimi_interference_observation(NULL, seen));
  assert_false(rimi_interference_observation(&state_of_it, NULL));
  assert_false(rimi_interference_alarm(NULL, 1, 0, &a));
  memset(&v, 0, sizeof v);
  assert_false(rimi_interference_alarm(&v, 1, 0, NULL));
}

#define WHEELS_WITH(field, value, expected)                                                        \
  do {                                                                                             \
    rim_wheels w = {.sine = {0, 1, 0, -1},                                                         \
                    .cosine = {1, 0, -1, 0},                                                       \
                    .radius_m = 0.1,                                                               \
                    .tick_m = 0.01,                                                                \
                    .bits = 16};                                                                   \
    w.field = (value);                                                                             \
    if ((expected) == RIM_OK)                                                                      \
      assert_int_equal(rimi_wheels_velocity(&w, before, now, 0.1, velocity), RIM_OK);              \
    else                                                                                           \
      REFUSES(velocity, expected, rimi_wheels_velocity(&w, before, now, 0.1, velocity));           \
  } while (0)

static void wheels_refuse(void **state) {
  (void)state;
  uint32_t before[4] = {0, 0, 0, 0}, now[4] = {1, 1, 1, 1};
  double velocity[3];
  WHEELS_WITH(bits, 2, RIM_OK);
  assert_true(fabs(velocity[0]) < 1e-12 && fabs(velocity[1]) < 1e-12);
  assert_true(fabs(velocity[2] - 1.0) < 1e-12); /* all wheels a tick: .01 m in .1 s at .1 m */
  WHEELS_WITH(bits, 1, RIM_E_DATA);
  WHEELS_WITH(bits, 33, RIM_E_DATA);
  WHEELS_WITH(radius_m, 0.0, RIM_E_DATA);
  WHEELS_WITH(tick_m, nan_value, RIM_E_DATA);
  const rim_wheels w = {
      .sine = {0, 1, 0, -1}, .cosine = {1, 0, -1, 0}, .radius_m = 0.1, .tick_m = 0.01, .bits = 2};
  REFUSES(velocity, RIM_E_DATA, rimi_wheels_velocity(&w, before, now, 0.0, velocity));
  now[2] = 4; /* of 2 bits */
  REFUSES(velocity, RIM_E_DATA, rimi_wheels_velocity(&w, before, now, 0.1, velocity));
  now[2] = 1;
  before[3] = 4;
  REFUSES(velocity, RIM_E_DATA, rimi_wheels_velocity(&w, before, now, 0.1, velocity));
  REFUSES(velocity, RIM_E_ARGUMENT, rimi_wheels_velocity(NULL, before, now, 0.1, velocity));
  REFUSES(velocity, RIM_E_ARGUMENT, rimi_wheels_velocity(&w, NULL, now, 0.1, velocity));
  REFUSES(velocity, RIM_E_ARGUMENT, rimi_wheels_velocity(&w, before, NULL, 0.1, velocity));
  IS_ARGUMENT(rimi_wheels_velocity(&w, before, now, 0.1, NULL));
}

static void a_hidden_chain_refuses(void **state) {
  (void)state;
  rim_hmm_model good = {
      .states = 2, .initial = {1.0, 0.0}, .transition = {{0.5, 0.5}, {0.25, 0.75}}};
  rim_hmm h;
  rim_hmm_model made;
  double counts[4] = {1.0, 3.0, 0.0, 0.0};
  uint32_t unseen = 0;
  IS_ARGUMENT(rimi_hmm_init(NULL, &good));
  REFUSES(h, RIM_E_ARGUMENT, rimi_hmm_init(&h, NULL));
  for (uint32_t states = 0; states <= RIM_HMM_MAX_STATES + 1; states += RIM_HMM_MAX_STATES + 1) {
    rim_hmm_model m = good;
    m.states = states;
    REFUSES(h, RIM_E_RANGE, rimi_hmm_init(&h, &m));
    REFUSES(made, RIM_E_RANGE, rimi_hmm_from_counts(&made, states, counts, 1.0, NULL));
  }
  rim_hmm_model m = good;
  m.initial[0] = 1.25;
  m.initial[1] = -0.25;
  REFUSES(h, RIM_E_DATA, rimi_hmm_init(&h, &m));
  m = good;
  m.transition[0][0] = 1.5;
  m.transition[0][1] = -0.5;
  REFUSES(h, RIM_E_DATA, rimi_hmm_init(&h, &m));
  assert_int_equal(rimi_hmm_init(&h, &good), RIM_OK);
  const double none[2] = {0.0, 0.0};
  IS_ARGUMENT(rimi_hmm_step(NULL, none));
  IS_ARGUMENT(rimi_hmm_step(&h, NULL));
  rim_hmm empty = h;
  empty.model.states = 0;
  IS_ARGUMENT(rimi_hmm_step(&empty, none));
  rimi_hmm_reset(NULL);
  assert_true(rimi_hmm_ln_odds(NULL, 0) <= RIM_HMM_LN_ZERO);
  assert_true(rimi_hmm_ln_odds(&h, 2) <= RIM_HMM_LN_ZERO);
  REFUSES(made, RIM_E_ARGUMENT, rimi_hmm_from_counts(&made, 2, NULL, 1.0, &unseen));
  IS_ARGUMENT(rimi_hmm_from_counts(NULL, 2, counts, 1.0, &unseen));
  REFUSES(made, RIM_E_DATA, rimi_hmm_from_counts(&made, 2, counts, 0.0, &unseen));
  REFUSES(made, RIM_E_DATA, rimi_hmm_from_counts(&made, 2, counts, infinite, &unseen));
  counts[0] = infinite;
  REFUSES(made, RIM_E_DATA, rimi_hmm_from_counts(&made, 2, counts, 1.0, &unseen));
  counts[0] = -1.0;
  REFUSES(made, RIM_E_DATA, rimi_hmm_from_counts(&made, 2, counts, 1.0, &unseen));
  counts[0] = 1.0;
  assert_int_equal(rimi_hmm_from_counts(&made, 2, counts, 1.0, NULL), RIM_OK);
  assert_true(made.transition[0][0] == 2.0 / 6.0 && made.transition[1][0] == 0.5);
  assert_int_equal(rimi_hmm_from_counts(&made, 2, counts, 1.0, &unseen), RIM_OK);
  assert_int_equal(unseen, 2);
  h.steps = h.resets = h.refused = UINT32_MAX; /* counters stay at their end */
  assert_int_equal(rimi_hmm_step(&h, none), RIM_OK);
  const double not_numbers[RIM_HMM_MAX_STATES] = {nan_value, nan_value};
  assert_int_equal(rimi_hmm_step(&h, not_numbers), RIM_E_DATA);
  assert_true(h.steps == UINT32_MAX && h.refused == UINT32_MAX);
  rimi_hmm_reset(&h);
  assert_true(h.resets == UINT32_MAX && h.steps == 0);
}

#define REGION_WITH(field, value, expected)                                                        \
  do {                                                                                             \
    rim_correct_region region_of_it = region_good();                                               \
    region_of_it.field = (value);                                                                  \
    rim_correct_model m = {                                                                        \
        .features = 2, .outcomes = 1, .regions = 1, .region = &region_of_it, .shift = shift};      \
    assert_int_equal(rimi_correct_pack(&m, memory, RIM_CORRECT_BYTES(1, 1)), expected);            \
  } while (0)

static rim_correct_region region_good(void) {
  rim_correct_region c = {.confidence = 0.5};
  const uint16_t feature[1] = {1};
  const double low[1] = {0.0}, high[1] = {2.0};
  assert_int_equal(rimi_region_from_box(&c.region, 1, feature, low, high), RIM_OK);
  return c;
}

static void a_correction_refuses(void **state) {
  (void)state;
  double shift[1] = {2.0};
  REGION_WITH(confidence, 1.0, RIM_OK);
  REGION_WITH(confidence, 1.5, RIM_E_DATA);
  REGION_WITH(confidence, nan_value, RIM_E_DATA);
  REGION_WITH(region.dims, RIM_REGION_MAX_DIMS + 1, RIM_E_RANGE);
  REGION_WITH(region.feature[0], 2, RIM_E_RANGE);
  REGION_WITH(region.center[0], infinite, RIM_E_DATA);
  REGION_WITH(region.lower[0], nan_value, RIM_E_DATA);
  REGION_WITH(region.upper[0], nan_value, RIM_E_DATA);
  REGION_WITH(region.inverse_shape[0], infinite, RIM_E_DATA);
  REGION_WITH(region.inverse_shape[0], 0.0, RIM_E_SINGULAR);
}

static void a_correction_wants_its_pieces(void **state) {
  (void)state;
  double shift[1] = {2.0};
  const rim_correct_region region = region_good();
  rim_correct_model m = {
      .features = 2, .outcomes = 1, .regions = 1, .region = &region, .shift = shift};
  const size_t bytes = RIM_CORRECT_BYTES(1, 1);
  rim_correct c, closed = {0};
  IS_ARGUMENT(rimi_correct_pack(NULL, memory, bytes));
  IS_ARGUMENT(rimi_correct_pack(&m, NULL, bytes));
  shift[0] = nan_value;
  assert_int_equal(rimi_correct_pack(&m, memory, bytes), RIM_E_DATA);
  shift[0] = 2.0;
  m.region = NULL;
  IS_ARGUMENT(rimi_correct_pack(&m, memory, bytes));
  m.region = &region;
  m.shift = NULL;
  IS_ARGUMENT(rimi_correct_pack(&m, memory, bytes));
  m.shift = shift;
  assert_int_equal(rimi_correct_pack(&m, memory, bytes), RIM_OK);
  REFUSES(c, RIM_E_ARGUMENT, rimi_correct_open(&c, NULL, bytes));
  IS_ARGUMENT(rimi_correct_open(NULL, memory, bytes));
  assert_int_equal(rimi_correct_open(&c, memory, bytes), RIM_OK);
  const double x[2] = {0.0, 1.0}, nominal = 10.0;
  double out = 7.0;
  const rim_correct *const wrong[2] = {NULL, &closed};
  for (int i = 0; i < 2; ++i) {
    IS_ARGUMENT(rimi_correct_mean(wrong[i], x, &nominal, &out));
  }
  IS_ARGUMENT(rimi_correct_mean(&c, NULL, &nominal, &out));
  IS_ARGUMENT(rimi_correct_mean(&c, x, NULL, &out));
  IS_ARGUMENT(rimi_correct_mean(&c, x, &nominal, NULL));
  assert_true(out == 7.0);
  assert_int_equal(rimi_correct_mean(&c, x, &nominal, &out), RIM_OK);
  assert_true(out == 11.0); /* half of the shift: confidence .5 */
  /* A section whose number was spoilt is no model. */
  uint8_t *at = memory + bytes - 8;
  const uint8_t was = at[7];
  memset(at, 0xff, 8);
  assert_true(rimi_correct_open(&c, memory, bytes) != RIM_OK);
  at[7] = was;
}

static rim_select_config select_good(void) {
  const rim_select_config c = {
      .features = 3, .channels = 2, .ring = 16, .bins = 4, .grid = 8, .pairs = 2};
  return c;
}

#define SELECT_WITH(field, value, expected)                                                        \
  do {                                                                                             \
    rim_select_config c = select_good();                                                           \
    c.field = (value);                                                                             \
    rim_select *made_engine = NULL;                                                                \
    assert_int_equal(rimi_select_init(&made_engine, memory, sizeof memory, &c), expected);         \
    assert_true((made_engine != NULL) == ((expected) == RIM_OK));                                  \
  } while (0)

static void an_engine_refuses(void **state) {
  (void)state;
  SELECT_WITH(features, 1, RIM_OK);
  SELECT_WITH(features, 0, RIM_E_CONFIG);
  SELECT_WITH(features, RIM_SELECT_MAX_FEATURES + 1, RIM_E_CONFIG);
  SELECT_WITH(channels, RIM_SELECT_MAX_CHANNELS + 1, RIM_E_CONFIG);
  SELECT_WITH(ring, 15, RIM_E_CONFIG);
  SELECT_WITH(ring, RIM_SELECT_MAX_RING + 1, RIM_E_CONFIG);
  SELECT_WITH(bins, 3, RIM_E_CONFIG);
  SELECT_WITH(bins, RIM_SELECT_MAX_BINS + 1, RIM_E_CONFIG);
  SELECT_WITH(grid, 7, RIM_E_CONFIG);
  SELECT_WITH(grid, RIM_SELECT_MAX_GRID + 1, RIM_E_CONFIG);
  SELECT_WITH(pairs, RIM_SELECT_MAX_PAIRS + 1, RIM_E_CONFIG);
  float value[2] = {1.0f, 0.0f};
  SELECT_WITH(a, value, RIM_E_RANGE);
  SELECT_WITH(b, value, RIM_OK);
  value[1] = (float)INFINITY;
  SELECT_WITH(a, value, RIM_E_RANGE);
  SELECT_WITH(b, value, RIM_E_RANGE);
  value[1] = -1.0f;
  SELECT_WITH(b, value, RIM_E_RANGE);
}

static void an_engine_wants_its_pieces(void **state) {
  (void)state;
  const rim_select_config c = select_good();
  size_t bytes = 7;
  rim_select *e = NULL;
  rim_candidate best;
  const double where[3] = {0.5, 0.5, 0.5}, off[2] = {1.0, 1.0}, none[3] = {0.5, infinite, 0.5};
  IS_ARGUMENT(rimi_select_size(NULL, &bytes));
  IS_ARGUMENT(rimi_select_size(&c, NULL));
  IS_ARGUMENT(rimi_select_init(NULL, memory, sizeof memory, &c));
  IS_ARGUMENT(rimi_select_init(&e, NULL, sizeof memory, &c));
  IS_ARGUMENT(rimi_select_init(&e, memory, sizeof memory, NULL));
  assert_true(e == NULL && bytes == 7);
  assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &c), RIM_OK);
  IS_ARGUMENT(rimi_select_observe(NULL, where, off));
  IS_ARGUMENT(rimi_select_observe(e, NULL, off));
  IS_ARGUMENT(rimi_select_observe(e, where, NULL));
  assert_int_equal(rimi_select_observe(e, none, off), RIM_E_DATA);
  assert_int_equal(rimi_select_observe(e, where, none + 1), RIM_E_DATA);
  assert_int_equal(rimi_select_observations(e), 0);
  assert_false(rimi_select_best(e, &best));
  assert_false(rimi_select_best_of_channel(e, 0, &best));
  assert_false(rimi_select_shift_of_channel(e, 0, &best));
  assert_true(rimi_select_membership(e, 0, where) == 0.0);
  assert_int_equal(rimi_select_observe(e, where, off), RIM_OK);
  assert_false(rimi_select_best(NULL, &best) || rimi_select_best(e, NULL));
  assert_false(rimi_select_best_of_channel(NULL, 0, &best) ||
               rimi_select_best_of_channel(e, 0, NULL) || rimi_select_best_of_channel(e, 2, &best));
  assert_false(rimi_select_shift_of_channel(NULL, 0, &best) ||
               rimi_select_shift_of_channel(e, 0, NULL) ||
               rimi_select_shift_of_channel(e, 2, &best));
  assert_true(rimi_select_membership(NULL, 0, where) == 0.0);
  assert_true(rimi_select_membership(e, 0, NULL) == 0.0);
  assert_true(rimi_select_membership(e, 2, where) == 0.0);
  float scale[2] = {1.0f, (float)NAN}, offset[2] = {0.0f, (float)NAN};
  IS_ARGUMENT(rimi_select_set_channel_scale(NULL, NULL, NULL));
  assert_int_equal(rimi_select_set_channel_scale(e, scale, NULL), RIM_E_RANGE);
  scale[1] = 0.0f;
  assert_int_equal(rimi_select_set_channel_scale(e, scale, NULL), RIM_E_RANGE);
  assert_int_equal(rimi_select_set_channel_scale(e, NULL, offset), RIM_E_RANGE);
  assert_int_equal(rimi_select_set_channel_scale(e, NULL, NULL), RIM_OK);
}

/* An index spoilt, one at a time, is seen; in its place again, nothing is. */
static void spoilt_indices_are_seen(void **state) {
  (void)state;
  const rim_select_config c = select_good();
  rim_select *e = NULL;
  assert_int_equal(rimi_select_init(&e, memory, sizeof memory, &c), RIM_OK);
  const double where[3] = {0.1, 0.5, 0.9}, off[2] = {1.0, -1.0};
  for (int i = 0; i < 20; ++i)
    assert_int_equal(rimi_select_observe(e, where, off), RIM_OK);
  rimi_select_work(e, 4);
#define SPOILT(field, value)                                                                       \
  do {                                                                                             \
    assert_true(rimi_select_indices_hold(e));                                                      \
    pair_state was_pair = *p;                                                                      \
    channel_state was_state = *s;                                                                  \
    slice was_slice = *l;                                                                          \
    field = (value);                                                                               \
    assert_false(rimi_select_indices_hold(e));                                                     \
    *p = was_pair;                                                                                 \
    *s = was_state;                                                                                \
    *l = was_slice;                                                                                \
  } while (0)
  pair_state *p = select_pair(e, 1);
  channel_state *s = select_channel(e, 1);
  slice *l = select_slice(e, 1, s->best_feature);
  SPOILT(p->active, 2);
  SPOILT(p->exact, 2);
  SPOILT(p->x, 3);
  SPOILT(p->y, 3);
  SPOILT(p->channel, 2);
  SPOILT(p->cursor, e->chains);
  SPOILT(p->which, (uint8_t)e->chains);
  SPOILT(s->best_feature, 3);
  SPOILT(l->first, 4);
  SPOILT(l->last, 4);
  assert_true(rimi_select_indices_hold(e));
  assert_true(rimi_select_bins_hold(e, 1));
  select_bins(e).count[5]++;
  assert_false(rimi_select_bins_hold(e, 1));
  select_bins(e).count[5]--;
  s->sum += 1.0;
  assert_false(rimi_select_bins_hold(e, 1));
  s->sum = nan_value;
  assert_false(rimi_select_bins_hold(e, 1));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_batch_search_refuses),  cmocka_unit_test(dmaps_refuses),
      cmocka_unit_test(dmaps_wants_its_pieces),  cmocka_unit_test(faro_and_statistics_refuse),
      cmocka_unit_test(a_detector_refuses),      cmocka_unit_test(a_detector_wants_its_pieces),
      cmocka_unit_test(wheels_refuse),           cmocka_unit_test(a_hidden_chain_refuses),
      cmocka_unit_test(a_correction_refuses),    cmocka_unit_test(a_correction_wants_its_pieces),
      cmocka_unit_test(an_engine_refuses),       cmocka_unit_test(an_engine_wants_its_pieces),
      cmocka_unit_test(spoilt_indices_are_seen),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
