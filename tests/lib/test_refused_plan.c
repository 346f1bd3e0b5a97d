/* SPDX-License-Identifier: MIT */
/* Planning: every NULL, every number and count of a configuration that is refused, one at a time,
 * and the defaults that stand for 0. */
#include "refuses.h"

#include <math.h>

#include "rim/plan/bandit.h"
#include "rim/plan/extent.h"
#include "rim/plan/gp.h"
#include "rim/plan/lookahead.h"

enum { POINTS = 12 };

static _Alignas(8) uint8_t memory[1 << 18];
static const double nan_value = (double)NAN, infinite = (double)INFINITY;

static rim_gp_config gp_good(void) {
  const rim_gp_config c = {.kernel = RIM_GP_MATERN_3_2,
                           .dims = 2,
                           .points = POINTS,
                           .signal_var = 1.0,
                           .noise_var = 0.01,
                           .length = {1.0, 2.0}};
  return c;
}

#define GP_IS(expected)                                                                            \
  do {                                                                                             \
    rim_gp *made_gp = NULL;                                                                        \
    assert_int_equal(rim_gp_init(&made_gp, memory, sizeof memory, &c), expected);                  \
    assert_true((made_gp != NULL) == ((expected) == RIM_OK));                                      \
  } while (0)
#define GP_WITH(field, value, expected)                                                            \
  do {                                                                                             \
    rim_gp_config c = gp_good();                                                                   \
    c.field = (value);                                                                             \
    GP_IS(expected);                                                                               \
  } while (0)

static void a_process_refuses(void **state) {
  (void)state;
  GP_WITH(kernel, RIM_GP_MATERN_5_2 + 1, RIM_E_CONFIG);
  GP_WITH(kernel, RIM_GP_MATERN_5_2, RIM_OK);
  GP_WITH(dims, 0, RIM_E_CONFIG);
  GP_WITH(dims, RIM_GP_MAX_DIMS + 1, RIM_E_CONFIG);
  GP_WITH(points, 0, RIM_E_CONFIG);
  GP_WITH(points, RIM_GP_MAX_POINTS + 1, RIM_E_CONFIG);
  GP_WITH(mean, nan_value, RIM_E_RANGE);
  GP_WITH(mean, infinite, RIM_E_RANGE);
  GP_WITH(signal_var, -1.0, RIM_E_RANGE);
  GP_WITH(signal_var, nan_value, RIM_E_RANGE);
  GP_WITH(signal_var, 1e101, RIM_E_RANGE);
  GP_WITH(noise_var, -1e-9, RIM_E_RANGE);
  GP_WITH(noise_var, nan_value, RIM_E_RANGE);
  GP_WITH(noise_var, 1e101, RIM_E_RANGE);
  GP_WITH(length[1], -1.0, RIM_E_RANGE);
  GP_WITH(length[1], nan_value, RIM_E_RANGE);
  GP_WITH(length[1], 1e-101, RIM_E_RANGE);
  GP_WITH(length[2], nan_value, RIM_OK); /* not of its dimensions */
  rim_gp_config c = gp_good();
  c.signal_var = c.length[0] = 0.0;
  rim_gp *gp = NULL;
  assert_int_equal(rim_gp_init(&gp, memory, sizeof memory, &c), RIM_OK);
  assert_true(rim_gp_get_config(gp).signal_var == 1.0 && rim_gp_get_config(gp).length[0] == 1.0);
  assert_int_equal(rim_gp_capacity(gp), POINTS);
  const double x[4] = {0.0, 0.0, 1.0, 1.0};
  double mean = 7.0;
  rim_gp_point point;
  IS_ARGUMENT(rim_gp_init(NULL, memory, sizeof memory, &c));
  IS_ARGUMENT(rim_gp_init(&gp, NULL, sizeof memory, &c));
  IS_ARGUMENT(rim_gp_init(&gp, memory, sizeof memory, NULL));
  IS_ARGUMENT(rim_gp_add(NULL, x, 1.0, 0.0, 0.0));
  IS_ARGUMENT(rim_gp_add(gp, NULL, 1.0, 0.0, 0.0));
  IS_ARGUMENT(rim_gp_remove(NULL, 0));
  assert_int_equal(rim_gp_remove(gp, 0), RIM_E_RANGE);
  IS_ARGUMENT(rim_gp_get_point(NULL, 0, &point));
  IS_ARGUMENT(rim_gp_get_point(gp, 0, NULL));
  IS_ARGUMENT(rim_gp_set_offset(NULL, 0, 0.0));
  IS_ARGUMENT(rim_gp_predict(NULL, x, &mean, NULL));
  IS_ARGUMENT(rim_gp_predict(gp, NULL, &mean, NULL));
  IS_ARGUMENT(rim_gp_predict_many(NULL, x, 2, &mean, NULL));
  IS_ARGUMENT(rim_gp_predict_many(gp, NULL, 2, &mean, NULL));
  IS_ARGUMENT(rim_gp_set_config(NULL, &c));
  IS_ARGUMENT(rim_gp_set_config(gp, NULL));
  assert_true(mean == 7.0);
}

/* What is far apart does not know of each other; a configuration that cannot be changes nothing. */
static void a_process_keeps_its_configuration(void **state) {
  (void)state;
  rim_gp_config c = gp_good();
  rim_gp *gp = NULL;
  assert_int_equal(rim_gp_init(&gp, memory, sizeof memory, &c), RIM_OK);
  const double here[2] = {0.0, 0.0}, far[2] = {1e60, -1e60};
  double mean, var, gradient[4];
  assert_int_equal(rim_gp_add(gp, here, 3.0, 0.0, 0.0), RIM_OK);
  assert_int_equal(rim_gp_add(gp, far, -5.0, 0.0, 0.0), RIM_OK);
  assert_int_equal(rim_gp_add(gp, here, 3.0, nan_value, 0.0), RIM_E_DATA);
  assert_int_equal(rim_gp_add(gp, here, 3.0, 0.0, infinite), RIM_E_DATA);
  assert_int_equal(rim_gp_predict(gp, far, &mean, &var), RIM_OK);
  assert_true(fabs(mean - -5.0 / 1.01) < 1e-12 && fabs(var - 0.01 / 1.01) < 1e-12);
  rim_gp_log_likelihood_gradient(gp, gradient);
  assert_true(gradient[2] == 0.0 && gradient[3] == 0.0); /* no length matters between these two */
  c.points = POINTS - 1;
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_E_CONFIG);
  c = gp_good();
  c.dims = 1;
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_E_CONFIG);
  c = gp_good();
  c.length[0] = -1.0;
  assert_int_equal(rim_gp_set_config(gp, &c), RIM_E_RANGE);
  double mean_after, var_after;
  assert_int_equal(rim_gp_predict(gp, far, &mean_after, &var_after), RIM_OK);
  assert_true(mean_after == mean && var_after == var);
}

static rim_extent_config extent_good(void) {
  const rim_extent_config c = {.dims = 2,
                               .points = 16,
                               .lambdas = 3,
                               .rims = 2,
                               .knots = 2,
                               .ln_anom = {1.0, 2.0},
                               .confidence = {0.25, 0.75},
                               .seed = 5};
  return c;
}

#define EXTENT_WITH(field, value, expected)                                                        \
  do {                                                                                             \
    rim_extent_config c = extent_good();                                                           \
    c.field = (value);                                                                             \
    rim_extent *made_extent = NULL;                                                                \
    assert_int_equal(rim_extent_init(&made_extent, memory, sizeof memory, &c), expected);          \
    assert_true((made_extent != NULL) == ((expected) == RIM_OK));                                  \
  } while (0)

static void an_extent_refuses(void **state) {
  (void)state;
  EXTENT_WITH(seed, 6, RIM_OK);
  EXTENT_WITH(dims, 0, RIM_E_CONFIG);
  EXTENT_WITH(dims, RIM_EXTENT_MAX_DIMS + 1, RIM_E_CONFIG);
  EXTENT_WITH(points, 7, RIM_E_CONFIG);
  EXTENT_WITH(points, 8, RIM_OK);
  EXTENT_WITH(points, RIM_EXTENT_MAX_POINTS + 1, RIM_E_CONFIG);
  EXTENT_WITH(lambdas, RIM_EXTENT_MAX_LAMBDAS + 1, RIM_E_CONFIG);
  EXTENT_WITH(rims, RIM_EXTENT_MAX_RIMS + 1, RIM_E_CONFIG);
  EXTENT_WITH(set, RIM_EXTENT_SAMPLED + 1, RIM_E_CONFIG);
  EXTENT_WITH(shape, RIM_EXTENT_BOX + 1, RIM_E_CONFIG);
  EXTENT_WITH(knots, RIM_EXTENT_MAX_KNOTS + 1, RIM_E_CONFIG);
  EXTENT_WITH(knots, 1, RIM_E_CONFIG);
  EXTENT_WITH(knots, 0, RIM_OK);
  EXTENT_WITH(samples, 1, RIM_E_CONFIG);
  EXTENT_WITH(samples, 65, RIM_E_CONFIG);
  EXTENT_WITH(samples, 64, RIM_OK);
  EXTENT_WITH(iterations, 65, RIM_E_CONFIG);
  EXTENT_WITH(iterations, 64, RIM_OK);
  EXTENT_WITH(lambda_min, nan_value, RIM_E_RANGE);
  EXTENT_WITH(lambda_max, infinite, RIM_E_RANGE);
  EXTENT_WITH(temper, nan_value, RIM_E_RANGE);
  EXTENT_WITH(min_points, nan_value, RIM_E_RANGE);
  EXTENT_WITH(threshold, infinite, RIM_E_RANGE);
  EXTENT_WITH(lambda_min, 1.0, RIM_E_CONFIG); /* above lambda_max, 0 */
  EXTENT_WITH(lambda_max, 1.0, RIM_OK);       /* 0..1 */
  EXTENT_WITH(lambda_min, -500.5, RIM_E_CONFIG);
  EXTENT_WITH(lambda_max, 500.5, RIM_E_CONFIG);
  EXTENT_WITH(temper, -0.5, RIM_E_CONFIG);
  EXTENT_WITH(temper, 1.5, RIM_E_CONFIG);
  EXTENT_WITH(temper, 1.0, RIM_OK);
  EXTENT_WITH(min_points, 0.5, RIM_E_CONFIG);
  EXTENT_WITH(lower[1], nan_value, RIM_E_RANGE);
  EXTENT_WITH(upper[1], infinite, RIM_E_RANGE);
  EXTENT_WITH(least_axis[0], nan_value, RIM_E_RANGE);
  EXTENT_WITH(most_axis[0], nan_value, RIM_E_RANGE);
  EXTENT_WITH(lower[1], 1.0, RIM_E_CONFIG); /* above upper, 0 */
  EXTENT_WITH(upper[1], 2.0, RIM_OK);
  EXTENT_WITH(least_axis[1], -0.1, RIM_E_CONFIG);
  EXTENT_WITH(least_axis[1], 0.6, RIM_E_CONFIG); /* not below the largest, 0.6 */
  EXTENT_WITH(most_axis[1], 2.5, RIM_E_CONFIG);
  EXTENT_WITH(most_axis[3], 2.5, RIM_OK); /* not of its dimensions */
  EXTENT_WITH(ln_anom[1], nan_value, RIM_E_RANGE);
  EXTENT_WITH(confidence[0], nan_value, RIM_E_RANGE);
  EXTENT_WITH(ln_anom[1], 1.0, RIM_E_CONFIG); /* does not rise */
  EXTENT_WITH(confidence[1], 0.2, RIM_E_CONFIG);
  EXTENT_WITH(confidence[0], -0.1, RIM_E_CONFIG);
  EXTENT_WITH(confidence[1], 1.1, RIM_E_CONFIG);
  EXTENT_WITH(confidence[1], 0.25, RIM_OK);
}

/* The last value of each that is taken, whether or not there is memory enough for it. */
static void the_ends_are_taken(void **state) {
  (void)state;
#define TAKES(good, made, init, field, value)                                                      \
  do {                                                                                             \
    good;                                                                                          \
    made = NULL;                                                                                   \
    c.field = (value);                                                                             \
    const rim_status status = init(&made, memory, sizeof memory, &c);                              \
    assert_true(status == RIM_OK || status == RIM_E_SIZE);                                         \
  } while (0)
#define GP_TAKES(field, value) TAKES(rim_gp_config c = gp_good(), gp, rim_gp_init, field, value)
#define EXTENT_TAKES(field, value)                                                                 \
  TAKES(rim_extent_config c = extent_good(), extent, rim_extent_init, field, value)
  rim_gp *gp;
  rim_extent *extent;
  GP_TAKES(dims, RIM_GP_MAX_DIMS);
  GP_TAKES(points, 1);
  GP_TAKES(points, RIM_GP_MAX_POINTS);
  GP_TAKES(signal_var, 1e-100);
  GP_TAKES(signal_var, 1e100);
  GP_TAKES(noise_var, 0.0);
  GP_TAKES(noise_var, 1e100);
  GP_TAKES(length[1], 1e-100);
  GP_TAKES(length[1], 1e100);
  EXTENT_TAKES(dims, 1);
  EXTENT_TAKES(dims, RIM_EXTENT_MAX_DIMS);
  EXTENT_TAKES(points, RIM_EXTENT_MAX_POINTS);
  EXTENT_TAKES(lambdas, 1);
  EXTENT_TAKES(lambdas, RIM_EXTENT_MAX_LAMBDAS);
  EXTENT_TAKES(rims, 1);
  EXTENT_TAKES(rims, RIM_EXTENT_MAX_RIMS);
  EXTENT_TAKES(set, RIM_EXTENT_SAMPLED);
  EXTENT_TAKES(shape, RIM_EXTENT_BOX);
  EXTENT_TAKES(samples, 2);
  EXTENT_TAKES(iterations, 1);
  EXTENT_TAKES(lambda_min, -500.0);
  EXTENT_TAKES(lambda_max, 500.0);
  EXTENT_TAKES(min_points, 1.0);
  EXTENT_TAKES(most_axis[1], 2.0);
  EXTENT_TAKES(confidence[0], 0.0);
  EXTENT_TAKES(confidence[1], 1.0);
  rim_extent_config c = extent_good();
  c.lambda_min = c.lambda_max = 3.0; /* one lambda alone */
  assert_int_equal(rim_extent_init(&extent, memory, sizeof memory, &c), RIM_OK);
  c.knots = RIM_EXTENT_MAX_KNOTS;
  for (size_t k = 0; k < RIM_EXTENT_MAX_KNOTS; ++k) {
    c.ln_anom[k] = (double)k;
    c.confidence[k] = (double)k / (RIM_EXTENT_MAX_KNOTS - 1);
  }
  assert_int_equal(rim_extent_init(&extent, memory, sizeof memory, &c), RIM_OK);
  assert_true(rim_extent_confidence(extent, 1e6) == 1.0); /* behind the last knot as at it */
  assert_true(rim_extent_confidence(extent, -1e6) == 0.0);
  c.lambdas = 1; /* it is the least */
  c.lambda_min = -2.0;
  rim_extent_region only;
  assert_int_equal(rim_extent_init(&extent, memory, sizeof memory, &c), RIM_OK);
  assert_int_equal(rim_extent_get_region(extent, 0, 0, &only), RIM_OK);
  assert_true(only.lambda == -2.0);
#undef TAKES
}

static void an_extent_fills_in(void **state) {
  (void)state;
  const rim_extent_config c = {.dims = 1, .points = 8};
  rim_extent *e = NULL;
  rim_extent_region region;
  IS_ARGUMENT(rim_extent_init(NULL, memory, sizeof memory, &c));
  IS_ARGUMENT(rim_extent_init(&e, NULL, sizeof memory, &c));
  IS_ARGUMENT(rim_extent_init(&e, memory, sizeof memory, NULL));
  assert_int_equal(rim_extent_init(&e, memory + 4, sizeof memory - 4, &c), RIM_E_ALIGN);
  assert_int_equal(rim_extent_init(&e, memory, RIM_EXTENT_SIZE(1, 8, 9, 1) - 1, &c), RIM_E_SIZE);
  assert_null(e);
  assert_int_equal(rim_extent_init(&e, memory, RIM_EXTENT_SIZE(1, 8, 9, 1), &c), RIM_OK);
  assert_int_equal(rim_extent_lambdas(e), 9);
  assert_int_equal(rim_extent_rims(e), 1);
  const rim_extent_config filled = rim_extent_get_config(e);
  assert_true(filled.samples == 24 && filled.iterations == 8 && filled.temper == 0.2);
  assert_true(filled.min_points == 3.0 && filled.threshold == 7.0 && filled.upper[0] == 1.0);
  assert_true(filled.least_axis[0] == 0.04 && filled.most_axis[0] == 0.6);
  for (uint32_t i = 0; i < 9; ++i) { /* eq. 5.4: even steps */
    assert_int_equal(rim_extent_get_region(e, 0, i, &region), RIM_OK);
    assert_true(region.lambda == -16.0 + 4.0 * i && region.dims == 0);
  }
  assert_int_equal(rim_extent_get_region(e, 1, 0, &region), RIM_E_RANGE);
  assert_int_equal(rim_extent_get_region(e, 0, 9, &region), RIM_E_RANGE);
  IS_ARGUMENT(rim_extent_get_region(NULL, 0, 0, &region));
  IS_ARGUMENT(rim_extent_get_region(e, 0, 0, NULL));
  const double x = 0.5, none = nan_value;
  IS_ARGUMENT(rim_extent_add(NULL, &x, 1.0, 1.0));
  IS_ARGUMENT(rim_extent_add(e, NULL, 1.0, 1.0));
  assert_int_equal(rim_extent_add(e, &none, 1.0, 1.0), RIM_E_DATA);
  assert_int_equal(rim_extent_points(e), 0);
  const rim_extent_local nowhere = {0};
  rim_extent_local at = rim_extent_at(e, 1, &x); /* no such RIM */
  assert_memory_equal(&at, &nowhere, sizeof at);
  at = rim_extent_at(e, 0, &none);
  assert_memory_equal(&at, &nowhere, sizeof at);
  const rim_extent_mixture m = {
      .components = 2, .weight = {0.25, 0.75}, .mean = {1.0, 3.0}, .var = {0.5, 0.1}};
  double mean = 0.0, var = 0.0;
  rim_extent_moments(&m, &mean, &var);
  assert_true(fabs(mean - 2.5) < 1e-15 && fabs(var - (0.2 + 0.1875 * 4.0)) < 1e-15);
  double same = 0.0;
  rim_extent_moments(&m, NULL, &same);
  assert_true(same == var);
  rim_extent_moments(&m, &same, NULL);
  assert_true(same == mean);
}

static rim_bandit_config bandit_good(void) {
  rim_bandit_config c = {
      .policy = RIM_BANDIT_RIM_GP_UCB, .schedule = RIM_BANDIT_BETA_CONSTANT, .beta = 4.0};
  c.gp = gp_good();
  c.extent = (rim_extent_config){.dims = 2, .points = 8};
  return c;
}

#define BANDIT_WITH(field, value, expected)                                                        \
  do {                                                                                             \
    rim_bandit_config c = bandit_good();                                                           \
    size_t size_of_it = 7;                                                                         \
    rim_bandit *made_bandit = NULL;                                                                \
    c.field = (value);                                                                             \
    assert_int_equal(rim_bandit_size(&c, &size_of_it), expected);                                  \
    assert_true((size_of_it != 7) == ((expected) == RIM_OK));                                      \
    assert_int_equal(rim_bandit_init(&made_bandit, memory, sizeof memory, &c), expected);          \
    assert_true((made_bandit != NULL) == ((expected) == RIM_OK));                                  \
  } while (0)

static void a_bandit_refuses(void **state) {
  (void)state;
  BANDIT_WITH(seed, 7, RIM_OK);
  BANDIT_WITH(policy, RIM_BANDIT_BANK + 1, RIM_E_CONFIG);
  BANDIT_WITH(policy, RIM_BANDIT_BANK, RIM_E_CONFIG); /* of no plans */
  BANDIT_WITH(schedule, RIM_BANDIT_BETA_DECAY + 1, RIM_E_CONFIG);
  BANDIT_WITH(risk, RIM_BANDIT_PROBABILITY + 1, RIM_E_CONFIG);
  BANDIT_WITH(plans, RIM_BANDIT_MAX_PLANS + 1, RIM_OK); /* for the bank alone */
  BANDIT_WITH(extent.dims, 1, RIM_E_CONFIG);
  BANDIT_WITH(beta, -1.0, RIM_E_RANGE);
  BANDIT_WITH(beta, nan_value, RIM_E_RANGE);
  BANDIT_WITH(delta, nan_value, RIM_E_RANGE);
  BANDIT_WITH(power, infinite, RIM_E_RANGE);
  BANDIT_WITH(aversion, nan_value, RIM_E_RANGE);
  BANDIT_WITH(level, nan_value, RIM_E_RANGE);
  BANDIT_WITH(bound, nan_value, RIM_E_RANGE);
  BANDIT_WITH(smooth_var, -1.0, RIM_E_RANGE);
  BANDIT_WITH(smooth_var, 1e101, RIM_E_RANGE);
  BANDIT_WITH(unseen_var, nan_value, RIM_E_RANGE);
  BANDIT_WITH(gain, -1.0, RIM_E_RANGE);
  BANDIT_WITH(power, -1.0, RIM_E_CONFIG);
  BANDIT_WITH(power, 4.5, RIM_E_CONFIG);
  BANDIT_WITH(delta, -0.1, RIM_E_CONFIG);
  BANDIT_WITH(delta, 1.0, RIM_E_CONFIG);
  BANDIT_WITH(bound, -0.1, RIM_E_CONFIG);
  BANDIT_WITH(bound, 1.1, RIM_E_CONFIG);
  BANDIT_WITH(bound, 1.0, RIM_OK);
  rim_bandit_config c = bandit_good();
  c.policy = RIM_BANDIT_BANK;
  c.plans = RIM_BANDIT_MAX_PLANS + 1;
  rim_bandit *b = NULL;
  assert_int_equal(rim_bandit_init(&b, memory, sizeof memory, &c), RIM_E_CONFIG);
}

static rim_bandit *bank_of_two(void) {
  rim_bandit_config c = {.policy = RIM_BANDIT_BANK, .plans = 2, .beta = 1.0};
  c.gp = gp_good();
  rim_bandit *b = NULL;
  assert_int_equal(rim_bandit_init(&b, memory, sizeof memory, &c), RIM_OK);
  return b;
}

static void a_bandit_wants_its_pieces(void **state) {
  (void)state;
  const rim_bandit_config c = bandit_good();
  size_t bytes = 0;
  rim_bandit *b = NULL;
  IS_ARGUMENT(rim_bandit_size(NULL, &bytes));
  IS_ARGUMENT(rim_bandit_size(&c, NULL));
  IS_ARGUMENT(rim_bandit_init(NULL, memory, sizeof memory, &c));
  IS_ARGUMENT(rim_bandit_init(&b, NULL, sizeof memory, &c));
  IS_ARGUMENT(rim_bandit_init(&b, memory, sizeof memory, NULL));
  assert_int_equal(rim_bandit_size(&c, &bytes), RIM_OK);
  assert_int_equal(bytes, RIM_BANDIT_SIZE_RIM(2, POINTS, 8, RIM_EXTENT_DEFAULT_LAMBDAS, 1));
  assert_int_equal(rim_bandit_init(&b, memory, bytes - 1, &c), RIM_E_SIZE);
  assert_null(b);
  b = bank_of_two();
  const double x[2] = {0.5, 0.5}, none[2] = {0.5, nan_value};
  double mean = 0.0, var = 0.0;
  rim_bandit_actions actions = {.count = 2, .x = x};
  rim_bandit_choice choice;
  REFUSES(choice, RIM_E_ARGUMENT, rim_bandit_choose(NULL, &actions, &choice));
  REFUSES(choice, RIM_E_ARGUMENT, rim_bandit_choose(b, NULL, &choice));
  IS_ARGUMENT(rim_bandit_choose(b, &actions, NULL));
  actions.x = NULL;
  REFUSES(choice, RIM_E_ARGUMENT, rim_bandit_choose(b, &actions, &choice));
  IS_ARGUMENT(rim_bandit_observe(NULL, x, 0, 0.0, 0.0, 1.0));
  IS_ARGUMENT(rim_bandit_observe(b, NULL, 0, 0.0, 0.0, 1.0));
  IS_ARGUMENT(rim_bandit_expect(NULL, x, 0, 0.0, &mean, &var));
  IS_ARGUMENT(rim_bandit_expect(b, NULL, 0, 0.0, &mean, &var));
  assert_int_equal(rim_bandit_expect(b, x, 2, 0.0, &mean, &var), RIM_E_RANGE);
  assert_int_equal(rim_bandit_expect(b, x, 1, infinite, &mean, &var), RIM_E_DATA);
  assert_int_equal(rim_bandit_expect(b, none, 1, 0.0, &mean, &var), RIM_E_DATA);
  assert_true(mean == 0.0 && var == 0.0);
  assert_int_equal(rim_bandit_observe(b, x, 2, 0.0, 0.0, 1.0), RIM_E_RANGE);
  assert_int_equal(rim_bandit_observe(b, none, 1, 0.0, 0.0, 1.0), RIM_E_DATA);
  assert_int_equal(rim_bandit_observe(b, x, 1, 0.0, 0.0, nan_value), RIM_E_DATA);
  assert_int_equal(rim_bandit_get_counters(b).observations, 0);
  assert_int_equal(rim_bandit_observe(b, x, 1, 0.0, 0.0, 2.0), RIM_OK);
  assert_int_equal(rim_bandit_expect(b, x, 1, 0.0, &mean, &var), RIM_OK);
  assert_true(fabs(mean - 2.0 / 1.01) < 1e-12); /* that plan alone has learnt */
  assert_int_equal(rim_bandit_expect(b, x, 0, 0.0, &mean, &var), RIM_OK);
  assert_true(mean == 0.0);
}

/* Actions that cannot be judged are passed over, each kind of them, and counted. */
static void unusable_actions_are_passed_over(void **state) {
  (void)state;
  rim_bandit_config c = {.policy = RIM_BANDIT_GP_UCB, .beta = 1.0};
  c.gp = gp_good();
  rim_bandit *b = NULL;
  assert_int_equal(rim_bandit_init(&b, memory, sizeof memory, &c), RIM_OK);
  const double x[10] = {0.0, 0.0, nan_value, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  double nominal[5] = {1.0, 9.0, infinite, 9.0, 9.0}, var[5] = {1.0, 1.0, 1.0, -1.0, infinite};
  const rim_bandit_actions actions = {.count = 5, .x = x, .nominal = nominal, .var = var};
  rim_bandit_choice choice;
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(choice.action, 0);
  assert_int_equal(rim_bandit_get_counters(b).unusable, 4);
  nominal[0] = nan_value;
  REFUSES(choice, RIM_E_DATA, rim_bandit_choose(b, &actions, &choice));
  assert_int_equal(rim_bandit_get_counters(b).none_allowed, 1);
  assert_true(rim_bandit_beta(b, 0, 1) == rim_bandit_beta(b, 1, 1));
}

/* With something to tell, an entry that was told and lies no more ahead: only what is missing keeps
 * it silent. */
static void the_look_ahead_wants_its_pieces(void **state) {
  (void)state;
  static rim_lookahead ahead;
  static _Alignas(16) uint8_t nothing[1 << 16]; /* in place of a monitor: it is never looked at */
  const rim_lookahead_config c = {.axis = {0, 1, 2}};
  rim_entry e;
  const rim_monitor *m = (const rim_monitor *)(const void *)nothing;
  ahead.plan.count = 1;
  ahead.told.sequence = 1;
  assert_false(rim_lookahead_update(NULL, &c, m, 1, 0.0, false, false, &e));
  assert_false(rim_lookahead_update(&ahead, NULL, m, 1, 0.0, false, false, &e));
  assert_false(rim_lookahead_update(&ahead, &c, NULL, 1, 0.0, false, false, &e));
  assert_false(rim_lookahead_update(&ahead, &c, m, 1, 0.0, false, false, NULL));
  ahead.plan.count = 0;
  assert_false(rim_lookahead_update(&ahead, &c, m, 1, 0.0, false, false, &e));
  assert_int_equal(ahead.told.sequence, 1);
  assert_int_equal(ahead.sequence, 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_process_refuses),
      cmocka_unit_test(a_process_keeps_its_configuration),
      cmocka_unit_test(an_extent_refuses),
      cmocka_unit_test(the_ends_are_taken),
      cmocka_unit_test(an_extent_fills_in),
      cmocka_unit_test(a_bandit_refuses),
      cmocka_unit_test(a_bandit_wants_its_pieces),
      cmocka_unit_test(unusable_actions_are_passed_over),
      cmocka_unit_test(the_look_ahead_wants_its_pieces),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
