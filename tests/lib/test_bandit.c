/* SPDX-License-Identifier: MIT */
/* bandit: the choice against its definition, learning in a world with a RIM, safety, and attacks.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "base/real.h"
#include "base/rng.h"
#include "rim/plan/bandit.h"

#define SEED 57u
enum { DIMS = 2, POINTS = 60, ACTIONS = 37, PLANS = 4, LAMBDAS = 5 };
#define BYTES_RIM RIM_BANDIT_SIZE_RIM(DIMS, POINTS, POINTS, LAMBDAS, 1)
#define BYTES_BANK RIM_BANDIT_SIZE_BANK(DIMS, POINTS, PLANS)
#define BYTES (BYTES_RIM > BYTES_BANK ? BYTES_RIM : BYTES_BANK)

typedef struct block {
  _Alignas(8) uint8_t bytes[BYTES + 8];
} block;

static rim_rng rng;
static block memory, other;
static double x[ACTIONS][DIMS], nominal[ACTIONS];
static uint8_t allowed[ACTIONS];

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance * (1.0 + fabs(b)))) {
    print_error("%.17g is not %.17g\n", a, b);
    fail();
  }
}

static rim_bandit_config config_of(int policy) {
  const rim_bandit_config c = {
      .policy = (uint8_t)policy,
      .plans = policy == RIM_BANDIT_BANK ? PLANS : 0,
      .beta = 2.0,
      .seed = SEED,
      .gp = {.dims = DIMS,
             .points = POINTS,
             .noise_var = 0.01,
             .signal_var = 0.3,
             .length = {0.2, 0.2}},
      .extent = {.dims = DIMS, .points = POINTS, .lambdas = LAMBDAS, .seed = SEED}};
  return c;
}

static rim_bandit *make(block *b, const rim_bandit_config *c) {
  rim_bandit *bandit = NULL;
  assert_int_equal(rim_bandit_init(&bandit, b->bytes, BYTES, c), RIM_OK);
  return bandit;
}

static void draw(void) {
  for (int i = 0; i < ACTIONS; ++i) {
    for (int d = 0; d < DIMS; ++d)
      x[i][d] = rimi_rng_uniform(&rng);
    nominal[i] = 0.2 * rimi_rng_normal(&rng);
    allowed[i] = rimi_rng_uniform(&rng) < 0.6;
  }
}

static double reward_of(const double *p) { /* better than expected in a corner */
  return (p[0] > 0.6 && p[1] > 0.6 ? 1.0 : 0.0) + 0.1 * rimi_rng_normal(&rng);
}

static void learn(rim_bandit *b, int n) {
  for (int i = 0; i < n; ++i) {
    const double p[DIMS] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    assert_int_equal(rim_bandit_observe(b, p, (uint32_t)i % PLANS, 0.0, 0.01, reward_of(p)),
                     RIM_OK);
  }
}

/* Each policy's choice is the best by (5.1) of what rim_bandit_expect says, among the allowed. */
static void choice_is_the_best_allowed(void **state) {
  (void)state;
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    const rim_bandit_config c = config_of(policy);
    rim_bandit *b = make(&memory, &c);
    const bool bank = policy == RIM_BANDIT_BANK;
    for (int round = 0; round < 40; ++round) {
      draw();
      const uint32_t count = bank ? PLANS : 1 + rimi_rng_below(&rng, ACTIONS);
      const rim_bandit_actions actions = {count, x[0], nominal, NULL, allowed};
      rim_bandit_choice choice = {.action = 99};
      double best = -INFINITY;
      for (uint32_t i = 0; i < count; ++i) {
        double mean, var;
        (void)rim_bandit_expect(b, bank ? x[0] : x[i], i, nominal[i], &mean, &var);
        if (allowed[i])
          best = fmax(best, mean + sqrt(2.0) * sqrt(var));
      }
      const rim_status status = rim_bandit_choose(b, &actions, &choice);
      if (!isfinite(best)) {
        assert_int_equal(status, RIM_E_DATA);
        assert_int_equal(choice.action, 99);
      } else {
        assert_int_equal(status, RIM_OK);
        assert_true(choice.action < count && allowed[choice.action]);
        assert_near(choice.value, best, 1e-12);
        assert_near(choice.mean + sqrt(choice.beta) * choice.sd, best, 1e-12);
      }
      learn(b, 2);
    }
    const rim_bandit_counters n = rim_bandit_get_counters(b);
    assert_int_equal(n.choices + n.none_allowed, 40);
    assert_int_equal(n.observations, 80);
  }
}

/* GP-UCB is its GP; RIM+GP-UCB's GP sees what the corrected model leaves (Algorithm 6). */
static void residuals_are_of_the_corrected_model(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, POINTS);
  rim_gp *gp = rim_bandit_gp(b, 0);
  const rim_extent *extent = rim_bandit_extent(b);
  double most = 0.0;
  for (uint32_t i = 0; i < rim_gp_points(gp); ++i) {
    rim_gp_point point;
    (void)rim_gp_get_point(gp, i, &point);
    assert_near(point.offset, rim_extent_correction(extent, point.x), 0.0);
    most = fmax(most, point.offset);
  }
  assert_true(most > 0.7); /* the corner was found */
  const double corner[DIMS] = {0.8, 0.8};
  double mean, var, g, gv, expected, spread;
  (void)rim_bandit_expect(b, corner, 0, 0.25, &mean, &var);
  (void)rim_gp_predict(gp, corner, &g, &gv);
  const rim_extent_mixture m = rim_extent_reward(extent, corner, 0.25 + g, gv);
  rim_extent_moments(&m, &expected, &spread);
  assert_near(mean, expected, 0.0);
  assert_near(var, spread, 0.0);
  assert_true(mean > 0.9);
  assert_null(rim_bandit_gp(b, 1));
}

/* Eq. 5.12: without a RIM the variance is that of where nobody looked, inside one its shift's
 * standard error. */
static void rim_ucb_is_sure_inside(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_RIM_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, POINTS);
  uint32_t inside = 0;
  for (uint32_t i = 0; i < 21 * 21; ++i) {
    const double at[DIMS] = {(double)(i % 21) / 20.0, (double)(i / 21) / 20.0};
    double gv, mean, var;
    (void)rim_gp_predict(rim_bandit_gp(b, 0), at, NULL, &gv);
    (void)rim_bandit_expect(b, at, 0, 0.25, &mean, &var);
    const rim_extent_local l = rim_extent_at(rim_bandit_extent(b), 0, at);
    const double w = l.existence * l.member;
    assert_near(mean, 0.25 + w * l.shift, 1e-12);
    assert_near(var, (1.0 - w) * gv + w * l.shift_var + w * (1.0 - w) * l.shift * l.shift, 1e-9);
    inside += w > 0.99 && var < 0.1 * gv;
  }
  assert_true(inside > 0);
}

/* unseen_var widens the component without a RIM, in proportion to the GP's variance. */
static void unseen_rims_widen_what_was_not_visited(void **state) {
  (void)state;
  rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, POINTS);
  other = memory;
  ((rim_bandit_config *)(void *)other.bytes)->unseen_var = 0.6; /* the configuration comes first */
  rim_bandit *wide = (rim_bandit *)(void *)other.bytes;
  assert_near(rim_bandit_get_config(wide).unseen_var, 0.6, 0.0);
  for (uint32_t i = 0; i < 21 * 21; ++i) {
    const double at[DIMS] = {(double)(i % 21) / 20.0, (double)(i / 21) / 20.0};
    double gv, mean, var, wide_mean, wide_var;
    (void)rim_gp_predict(rim_bandit_gp(b, 0), at, NULL, &gv);
    (void)rim_bandit_expect(b, at, 0, 0.25, &mean, &var);
    (void)rim_bandit_expect(wide, at, 0, 0.25, &wide_mean, &wide_var);
    const rim_extent_local l = rim_extent_at(rim_bandit_extent(b), 0, at);
    assert_near(wide_mean, mean, 0.0);
    assert_near(wide_var - var, (1.0 - l.existence * l.member) * 0.6 * (gv / 0.3), 1e-9);
  }
}

typedef double (*deviation)(const double *p);
static double step_up(const double *p) { return p[0] > 0.6 && p[1] > 0.6 ? 1.0 : 0.0; }
static double slope(const double *p) { return 0.8 * p[0]; }

/* What the RIMs add in the middle of the corner, after these rewards. */
static double correction_after(const rim_bandit_config *c, deviation of) {
  rim_bandit *b = make(&memory, c);
  for (int i = 0; i < POINTS; ++i) {
    const double p[DIMS] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    assert_int_equal(rim_bandit_observe(b, p, 0, 0.0, 0.01, of(p) + 0.1 * rimi_rng_normal(&rng)),
                     RIM_OK);
  }
  const double corner[DIMS] = {0.8, 0.8};
  double mean, gp_mean = 0.0;
  (void)rim_bandit_expect(b, corner, 0, 0.0, &mean, NULL);
  if (c->policy == RIM_BANDIT_RIM_GP_UCB)
    (void)rim_gp_predict(rim_bandit_gp(b, 0), corner, &gp_mean, NULL);
  return mean - gp_mean;
}

/* A reward teaches by how much it is above what was expected there, and is expected from then on,
 * whatever was expected. */
static void a_reward_is_learnt_against_what_was_expected(void **state) {
  (void)state;
  static const double expected[] = {0.0, 0.75, -0.5};
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    const rim_bandit_config c = config_of(policy);
    double correction[3];
    for (size_t i = 0; i < 3; ++i) {
      const double at[DIMS] = {0.5, 0.5};
      double mean, var;
      rim_bandit *b = make(&memory, &c);
      for (int k = 0; k < 5; ++k)
        assert_int_equal(rim_bandit_observe(b, at, 0, expected[i], 0.01, expected[i] + 0.25),
                         RIM_OK);
      (void)rim_bandit_expect(b, at, 0, expected[i], &mean, &var);
      correction[i] = mean - expected[i];
      assert_near(correction[i], correction[0], 1e-9);
    }
    assert_true(correction[0] > 0.1 && correction[0] < 0.3);
  }
}

/* A slope is no RIM to `gain`, since a GP has it as well; by ln anom alone it is one. */
static void what_is_smooth_is_left_to_the_gp(void **state) {
  (void)state;
  rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
  c.gp.length[0] = c.gp.length[1] = 1.0;
  assert_true(correction_after(&c, slope) > 0.4);
  assert_true(correction_after(&c, step_up) > 0.7);
  c.gain = 5.0;
  assert_true(fabs(correction_after(&c, slope)) < 0.05);
  assert_true(correction_after(&c, step_up) > 0.7);
}

/* Deviations below sqrt(smooth_var) make no RIM, larger ones still do. */
static void small_deviations_make_no_rim(void **state) {
  (void)state;
  rim_bandit_config c = config_of(RIM_BANDIT_RIM_UCB);
  assert_true(correction_after(&c, slope) > 0.4);
  c.smooth_var = 1.0; /* 60 of at most .8: ln anom some 8 */
  c.extent.threshold = 20.0;
  assert_true(fabs(correction_after(&c, slope)) < 0.01);
  c.smooth_var = 0.04;
  assert_true(correction_after(&c, step_up) > 0.7);
}

static void every_policy_learns(void **state) {
  (void)state;
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_RIM_GP_UCB; ++policy) {
    const rim_bandit_config c = config_of(policy);
    rim_bandit *b = make(&memory, &c);
    double late = 0.0;
    for (int t = 0; t < 100; ++t) {
      draw();
      const rim_bandit_actions actions = {ACTIONS, x[0], NULL, NULL, NULL};
      rim_bandit_choice choice;
      assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
      const double reward = reward_of(x[choice.action]);
      (void)rim_bandit_observe(b, x[choice.action], 0, 0.0, 0.01, reward);
      if (t >= 50)
        late += reward / 50.0;
    }
    print_message("policy %d: mean reward over turns 51-100 %.3f of 1, chance .16\n", policy, late);
    assert_true(late > 0.8);
  }
}

static void bank_learns_each_plan(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_BANK);
  rim_bandit *b = make(&memory, &c);
  int right = 0;
  for (int t = 0; t < 120; ++t) {
    const double s[DIMS] = {rimi_rng_uniform(&rng), rimi_rng_uniform(&rng)};
    const uint32_t good = s[0] > 0.5 ? 1u : 2u;
    const rim_bandit_actions actions = {PLANS, s, NULL, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    (void)rim_bandit_observe(b, s, choice.action, 0.0, 0.0, choice.action == good ? 1.0 : 0.0);
    right += t >= 60 && choice.action == good;
  }
  print_message("right plan in %d of the last 60\n", right);
  assert_true(right > 48);
  const double s[DIMS] = {0.5, 0.5};
  const rim_bandit_actions wrong = {PLANS - 1, s, NULL, NULL, NULL};
  rim_bandit_choice choice;
  assert_int_equal(rim_bandit_choose(b, &wrong, &choice), RIM_E_RANGE);
  assert_int_equal(rim_bandit_observe(b, s, PLANS, 0.0, 0.0, 0.0), RIM_E_RANGE);
  assert_non_null(rim_bandit_gp(b, PLANS - 1));
  assert_null(rim_bandit_extent(b));
}

static void beta_follows_its_schedule(void **state) {
  (void)state;
  rim_bandit_config c = config_of(0);
  rim_bandit *b = make(&memory, &c);
  assert_near(rim_bandit_beta(b, 1, 10), 2.0, 0.0);
  assert_near(rim_bandit_beta(b, 99, 10), 2.0, 0.0);
  c.schedule = RIM_BANDIT_BETA_DECAY;
  b = make(&memory, &c);
  assert_near(rim_bandit_beta(b, 8, 10), 0.25, 1e-15);
  assert_near(rim_bandit_beta(b, 0, 10), rim_bandit_beta(b, 1, 10),
              0.0); /* before the first turn */
  c.power = 2.0;
  b = make(&memory, &c);
  assert_near(rim_bandit_beta(b, 4, 10), 0.125, 1e-15);
  c.schedule = RIM_BANDIT_BETA_LOG;
  b = make(&memory, &c);
  const double pi = acos(-1.0);
  assert_near(rim_bandit_beta(b, 5, 200), 4.0 * log(200.0 * 25.0 * pi * pi / 0.6), 1e-13);
  c.beta = 0.0;
  b = make(&memory, &c);
  assert_near(rim_bandit_beta(b, 5, 200), 0.0, 0.0);
}

/* A sure 0.4 and a gamble of mean 0.5: who takes which (7.2.7). */
static void risk_changes_the_choice(void **state) {
  (void)state;
  const double two[2][DIMS] = {{0.1, 0.1}, {0.9, 0.9}};
  const double mean[2] = {0.4, 0.5}, var[2] = {1e-4, 1.0};
  const rim_bandit_actions actions = {2, two[0], mean, var, NULL};
  rim_bandit_choice choice;
  rim_bandit_config c = config_of(0);
  c.beta = 0.0;
  c.gp.signal_var = 1e-6;
  rim_bandit *b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(choice.action, 1);
  c.risk = RIM_BANDIT_MEAN_SD;
  c.aversion = 1.0;
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(choice.action, 0);
  assert_near(choice.value, 0.4 - sqrt(1e-4 + 1e-6), 1e-12);
  c.risk = RIM_BANDIT_PROBABILITY;
  c.level = 0.0;
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(choice.action, 0);
  c.level = 1.0; /* only the gamble can reach it */
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(choice.action, 1);
  assert_near(choice.probability, 0.5 * erfc(0.5 / sqrt(2.0 * (1.0 + 1e-6))), 1e-12);
  c.risk = RIM_BANDIT_BOUNDED;
  c.level = 0.0;
  c.bound = 0.95;
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_true(choice.action == 0 && choice.bound_met);
  c.bound = 0.5;
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_true(choice.action == 1 && choice.bound_met);
  c.level = 3.0;
  b = make(&memory, &c);
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_true(choice.action == 1 && !choice.bound_met);
}

static void equals_are_drawn_at_random(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(0);
  rim_bandit *b = make(&memory, &c);
  draw();
  const rim_bandit_actions actions = {5, x[0], NULL, NULL, NULL};
  int times[5] = {0};
  for (int i = 0; i < 5000; ++i) {
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    ++times[choice.action];
  }
  for (int i = 0; i < 5; ++i)
    assert_in_range(times[i], 850, 1150); /* 5 sd of a binomial */
}

static void forbidden_is_never_chosen(void **state) {
  (void)state;
  for (int risk = RIM_BANDIT_NEUTRAL; risk <= RIM_BANDIT_PROBABILITY; ++risk) {
    rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
    c.risk = (uint8_t)risk;
    c.bound = 0.9;
    rim_bandit *b = make(&memory, &c);
    learn(b, 20);
    for (int round = 0; round < 100; ++round) {
      draw();
      nominal[3] = 1e6; /* tempting */
      allowed[3] = 0;
      const rim_bandit_actions actions = {ACTIONS, x[0], nominal, NULL, allowed};
      rim_bandit_choice choice;
      if (rim_bandit_choose(b, &actions, &choice) == RIM_OK)
        assert_true(allowed[choice.action]);
    }
    memset(allowed, 0, sizeof allowed);
    const rim_bandit_actions none = {ACTIONS, x[0], nominal, NULL, allowed};
    rim_bandit_choice choice = {.action = 77};
    assert_int_equal(rim_bandit_choose(b, &none, &choice), RIM_E_DATA);
    assert_int_equal(choice.action, 77);
    assert_true(rim_bandit_get_counters(b).none_allowed >= 1);
  }
}

static void bad_numbers_are_counted(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, 5);
  const double bad[] = {NAN, INFINITY, -INFINITY};
  draw();
  for (int i = 0; i < 3; ++i) {
    const double at[DIMS] = {0.5, bad[i]};
    assert_int_equal(rim_bandit_observe(b, at, 0, 0.0, 0.01, 0.0), RIM_E_DATA);
    assert_int_equal(rim_bandit_observe(b, x[0], 0, bad[i], 0.01, 0.0), RIM_E_DATA);
    assert_int_equal(rim_bandit_observe(b, x[0], 0, 0.0, bad[i], 0.0), RIM_E_DATA);
    assert_int_equal(rim_bandit_observe(b, x[0], 0, 0.0, 0.01, bad[i]), RIM_E_DATA);
    draw();
    x[2][1] = bad[i];
    nominal[4] = bad[i];
    const rim_bandit_actions actions = {ACTIONS, x[0], nominal, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    assert_true(choice.action != 2 && choice.action != 4);
    assert_int_equal(rim_bandit_expect(b, at, 0, 0.0, NULL, NULL), RIM_E_DATA);
  }
  const rim_bandit_counters n = rim_bandit_get_counters(b);
  assert_int_equal(n.refused, 12);
  assert_int_equal(n.unusable, 6);
  assert_int_equal(n.observations, 5);
}

static void refused_reward_teaches_nothing(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, 9);
  double before[2], after[2];
  draw();
  (void)rim_bandit_expect(b, x[1], 0, 0.0, before, before + 1);
  assert_int_equal(rim_bandit_observe(b, x[0], 0, 0.0, 0.01, NAN), RIM_E_DATA);
  (void)rim_bandit_expect(b, x[1], 0, 0.0, after, after + 1);
  assert_memory_equal(before, after, sizeof after);
}

/* A process that cannot take an observation (its factor was hit): counted, and nothing learnt. */
static void what_the_process_refuses_is_counted(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_RIM_UCB);
  rim_bandit *b = make(&memory, &c);
  learn(b, 3);
  const double nothing = 0.0, p[DIMS] = {0.5, 0.5};
  const size_t factor =
      RIM_BANDIT_HEADER_BYTES + RIM_GP_SIZE(DIMS, POINTS) - 4u * (size_t)POINTS * (POINTS + 1u);
  memcpy(memory.bytes + factor, &nothing, sizeof nothing);
  const rim_bandit_counters before = rim_bandit_get_counters(b);
  assert_int_equal(rim_bandit_observe(b, p, 0, 0.0, 0.01, 1.0), RIM_E_SINGULAR);
  const rim_bandit_counters after = rim_bandit_get_counters(b);
  assert_int_equal(after.refused, before.refused + 1);
  assert_int_equal(after.observations, before.observations);
}

/* A variance that is not known is the process's noise, or its whole variance where it has none. */
static void an_unknown_variance_is_the_noise(void **state) {
  (void)state;
  for (int noisy = 0; noisy < 2; ++noisy) {
    rim_bandit_config c = config_of(RIM_BANDIT_RIM_UCB);
    c.gp.noise_var = noisy ? 0.05 : 0.0;
    rim_bandit *given = make(&memory, &c), *left = make(&other, &c);
    rim_rng own;
    rimi_rng_seed(&own, SEED, 77);
    for (int i = 0; i < 30; ++i) {
      const double p[DIMS] = {rimi_rng_uniform(&own), rimi_rng_uniform(&own)};
      const double reward = reward_of(p);
      /* Of the RIM alone; the process takes the larger of the two, so it is told the same. */
      assert_int_equal(rim_bandit_observe(left, p, 0, 0.0, 0.0, reward), RIM_OK);
      assert_int_equal(rim_bandit_observe(given, p, 0, 0.0, noisy ? 0.05 : 0.0, reward), RIM_OK);
    }
    double mean[2], var[2];
    const double p[DIMS] = {0.8, 0.8};
    assert_int_equal(rim_bandit_expect(given, p, 0, 0.0, &mean[0], &var[0]), RIM_OK);
    assert_int_equal(rim_bandit_expect(left, p, 0, 0.0, &mean[1], &var[1]), RIM_OK);
    assert_true(isfinite(mean[1]) && isfinite(var[1]));
    assert_near(mean[0], mean[1], 1e-12);
    assert_near(var[0], var[1], 1e-12);
  }
}

static void misuse_is_refused(void **state) {
  (void)state;
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    const rim_bandit_config good = config_of(policy);
    size_t bytes = 0;
    rim_bandit *b = NULL;
    memset(&memory, 0x5a, sizeof memory);
    assert_int_equal(rim_bandit_size(&good, &bytes), RIM_OK);
    assert_true(bytes <= BYTES);
    assert_int_equal(rim_bandit_init(&b, memory.bytes, bytes - 1, &good), RIM_E_SIZE);
    assert_int_equal(rim_bandit_init(&b, memory.bytes + 4, bytes, &good), RIM_E_ALIGN);
    assert_int_equal(rim_bandit_init(&b, NULL, bytes, &good), RIM_E_ARGUMENT);
    rim_bandit_config c[6];
    for (int i = 0; i < 6; ++i)
      c[i] = good;
    c[0].policy = 4;
    c[1].schedule = 3;
    c[2].risk = 4;
    c[3].delta = 1.0;
    c[4].bound = 1.5;
    c[5].gp.dims = policy == RIM_BANDIT_BANK || policy == RIM_BANDIT_GP_UCB ? 0 : 1;
    for (int i = 0; i < 6; ++i) {
      assert_int_equal(rim_bandit_init(&b, memory.bytes, BYTES, &c[i]), RIM_E_CONFIG);
      if (i < 5)
        assert_int_equal(rim_bandit_size(&c[i], &bytes), RIM_E_CONFIG);
    }
    c[0] = good;
    c[0].beta = -1.0;
    assert_int_equal(rim_bandit_init(&b, memory.bytes, BYTES, &c[0]), RIM_E_RANGE);
    assert_null(b);
    (void)rim_bandit_size(&good, &bytes);
    memset(&memory, 0x5a, sizeof memory);
    assert_int_equal(rim_bandit_init(&b, memory.bytes, bytes, &good), RIM_OK);
    learn(b, POINTS + 5);
    for (size_t i = bytes; i < bytes + 8 && i < sizeof memory.bytes; ++i) {
      assert_int_equal(memory.bytes[i], 0x5a);
    }
    const rim_bandit_actions nothing = {0, x[0], NULL, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &nothing, &choice), RIM_E_RANGE);
    assert_int_equal(rim_bandit_choose(b, NULL, &choice), RIM_E_ARGUMENT);
  }
}

static uint64_t run(rim_bandit *b, rim_rng *own, int turns, uint64_t digest) {
  const rim_bandit_config c = rim_bandit_get_config(b);
  const bool bank = c.policy == RIM_BANDIT_BANK;
  for (int t = 0; t < turns; ++t) {
    for (int i = 0; i < ACTIONS; ++i) {
      for (int d = 0; d < DIMS; ++d)
        x[i][d] = rimi_rng_uniform(own);
    }
    const rim_bandit_actions actions = {bank ? PLANS : ACTIONS, x[0], NULL, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    const double *p = bank ? x[0] : x[choice.action];
    const double reward = (p[0] > 0.6 && p[1] > 0.6 ? 1.0 : 0.0) + 0.1 * rimi_rng_normal(own);
    assert_int_equal(rim_bandit_observe(b, p, choice.action, 0.0, 0.01, reward), RIM_OK);
    digest = rimi_digest_u32(digest, choice.action);
    digest = rimi_digest_f64(rimi_digest_f64(digest, choice.value), choice.sd);
  }
  return digest;
}

static void moved_memory_goes_on(void **state) {
  (void)state;
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    const rim_bandit_config c = config_of(policy);
    rim_bandit *b = make(&memory, &c);
    rim_rng own;
    rimi_rng_seed(&own, SEED, 3);
    const uint64_t half = run(b, &own, 30, RIM_DIGEST_START);
    other = memory;
    rim_rng again = own;
    const uint64_t there = run((rim_bandit *)(void *)other.bytes, &again, 50, half);
    assert_true(run(b, &own, 50, half) == there);
  }
}

/* The same bits on every target and at every optimisation. */
static void digest_is_constant(void **state) {
  (void)state;
  uint64_t digest = RIM_DIGEST_START;
  for (int policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    rim_bandit_config c = config_of(policy);
    c.schedule = RIM_BANDIT_BETA_LOG;
    c.beta = 0.2;
    c.gp.kernel = RIM_GP_MATERN_5_2;
    rim_rng own;
    rimi_rng_seed(&own, SEED, 4);
    digest = run(make(&memory, &c), &own, 80, digest);
  }
  print_message("digest %016llx\n", (unsigned long long)digest);
  assert_true(digest == UINT64_C(0x7ffdf6d1584f42e5));
}

/* The chance of a reward is that of all that may act there: where a region very likely does, and
 * lifts what is expected above the level, the chance is its. */
static void a_chance_is_of_all_components(void **state) {
  (void)state;
  rim_bandit_config c = config_of(RIM_BANDIT_RIM_UCB);
  c.risk = RIM_BANDIT_PROBABILITY;
  c.level = 0.5;
  rim_bandit *b = make(&memory, &c);
  rim_rng own;
  rimi_rng_seed(&own, SEED, 5);
  (void)run(b, &own, 80, RIM_DIGEST_START);
  int inside = 0;
  for (int i = 0; i < 50; ++i) {
    const double at[DIMS] = {0.7 + 0.3 * rimi_rng_uniform(&own),
                             0.7 + 0.3 * rimi_rng_uniform(&own)};
    const rim_bandit_actions one = {1, at, NULL, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &one, &choice), RIM_OK);
    if (choice.member < 0.7)
      continue;
    ++inside;
    assert_true(choice.probability > 0.6 && choice.probability <= 1.0);
    assert_true(choice.value == choice.probability);
  }
  assert_true(inside > 5);
}

/* The fewest and the most that is allowed, each alone. */
static void the_ends_are_allowed(void **state) {
  (void)state;
  rim_bandit *b = NULL;
  for (int which = 0; which < 8; ++which) {
    static _Alignas(8) uint8_t large[RIM_BANDIT_SIZE_BANK(DIMS, 1, RIM_BANDIT_MAX_PLANS)];
    rim_bandit_config c = config_of(RIM_BANDIT_BANK);
    c.gp.points = 1;
    c.plans = which == 0 ? 1 : RIM_BANDIT_MAX_PLANS;
    c.power = which == 2 ? 4.0 : which == 3 ? 4.001 : 1.0;
    c.delta = which == 4 ? 1e-300 : which == 5 ? 1.0 : 0.1;
    c.bound = which == 6 ? 1.0 : 0.0;
    if (which == 7)
      c.plans = RIM_BANDIT_MAX_PLANS + 1;
    const rim_status expected = which == 3 || which == 5 || which == 7 ? RIM_E_CONFIG : RIM_OK;
    assert_int_equal(rim_bandit_init(&b, large, sizeof large, &c), expected);
  }
}

/* A reward whose variance is the largest that is taken, and an action without noise, are used. */
static void the_largest_variance_and_no_noise(void **state) {
  (void)state;
  const rim_bandit_config c = config_of(RIM_BANDIT_GP_UCB);
  rim_bandit *b = make(&memory, &c);
  const double at[DIMS] = {0.5, 0.5}, none = 0.0;
  assert_int_equal(rim_bandit_observe(b, at, 0, 0.0, 1e100, 1.0), RIM_OK);
  assert_int_equal(rim_bandit_observe(b, at, 0, 0.0, 1.001e100, 1.0), RIM_E_DATA);
  const rim_bandit_actions actions = {1, at, NULL, &none, NULL};
  rim_bandit_choice choice;
  assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
  assert_int_equal(rim_bandit_get_counters(b).unusable, 0);
}

/* A reward far above a level, or far below, is so for certain: a chance that just meets its bound
 * meets it. */
static void a_chance_that_just_meets_its_bound(void **state) {
  (void)state;
  for (int which = 0; which < 3; ++which) {
    rim_bandit_config c = config_of(RIM_BANDIT_GP_UCB);
    c.risk = RIM_BANDIT_BOUNDED;
    c.bound = which == 2 ? 0.0 : 1.0;
    rim_bandit *b = make(&memory, &c);
    const double at[DIMS] = {0.5, 0.5}, mean = which == 0 ? 100.0 : -100.0;
    const rim_bandit_actions actions = {1, at, &mean, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    assert_true(choice.probability == (which == 0 ? 1.0 : 0.0));
    assert_int_equal(choice.bound_met, which != 1);
  }
}

/* With as many RIMs as there may be a choice is the best by what each action is said to be, and a
 * chance is that of all of them. */
static void the_most_rims(void **state) {
  (void)state;
  static _Alignas(8)
      uint8_t room[RIM_BANDIT_SIZE_RIM(DIMS, POINTS, POINTS, LAMBDAS, RIM_EXTENT_MAX_RIMS)];
  for (int risk = RIM_BANDIT_NEUTRAL; risk <= RIM_BANDIT_PROBABILITY; ++risk) {
    rim_bandit_config c = config_of(RIM_BANDIT_RIM_GP_UCB);
    c.extent.rims = RIM_EXTENT_MAX_RIMS;
    c.risk = (uint8_t)risk;
    c.gain = 1.0;
    c.bound = 0.2;
    c.level = 0.5;
    rim_bandit *b = NULL;
    assert_int_equal(rim_bandit_init(&b, room, sizeof room, &c), RIM_OK);
    learn(b, 30);
    draw();
    const rim_bandit_actions actions = {ACTIONS, x[0], nominal, NULL, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    double mean, var;
    const uint32_t i = choice.action;
    assert_int_equal(rim_bandit_expect(b, x[i], 0, nominal[i], &mean, &var), RIM_OK);
    assert_near(choice.mean, mean, 1e-9);
    assert_near(choice.sd * choice.sd, var, 1e-9);
    assert_true(choice.probability >= 0.0 && choice.probability <= 1.0);
  }
}

/* What was seen without noise is certain: its reward is above a level or it is not. */
static void what_is_certain_is_above_or_not(void **state) {
  (void)state;
  static const double level[] = {0.25, 0.5, 0.75}, above[] = {1.0, 0.0, 0.0};
  for (int i = 0; i < 3; ++i) {
    rim_bandit_config c = config_of(RIM_BANDIT_GP_UCB);
    c.risk = RIM_BANDIT_PROBABILITY;
    c.level = level[i];
    c.gp.signal_var = 1.0;
    c.gp.noise_var = 0.0;
    rim_bandit *b = make(&memory, &c);
    const double at[DIMS] = {0.5, 0.5}, none = 0.0;
    double mean = 0.0, var = 1.0;
    assert_int_equal(rim_bandit_observe(b, at, 0, 0.0, 0.0, 0.5), RIM_OK);
    assert_int_equal(rim_bandit_expect(b, at, 0, 0.0, &mean, &var), RIM_OK);
    assert_true(mean == 0.5 && var == 0.0);
    const rim_bandit_actions actions = {1, at, NULL, &none, NULL};
    rim_bandit_choice choice;
    assert_int_equal(rim_bandit_choose(b, &actions, &choice), RIM_OK);
    assert_true(choice.probability == above[i]);
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_ends_are_allowed),
      cmocka_unit_test(the_most_rims),
      cmocka_unit_test(what_is_certain_is_above_or_not),
      cmocka_unit_test(the_largest_variance_and_no_noise),
      cmocka_unit_test(a_chance_that_just_meets_its_bound),
      cmocka_unit_test(choice_is_the_best_allowed),
      cmocka_unit_test(residuals_are_of_the_corrected_model),
      cmocka_unit_test(every_policy_learns),
      cmocka_unit_test(bank_learns_each_plan),
      cmocka_unit_test(beta_follows_its_schedule),
      cmocka_unit_test(risk_changes_the_choice),
      cmocka_unit_test(equals_are_drawn_at_random),
      cmocka_unit_test(forbidden_is_never_chosen),
      cmocka_unit_test(bad_numbers_are_counted),
      cmocka_unit_test(refused_reward_teaches_nothing),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(what_the_process_refuses_is_counted),
      cmocka_unit_test(an_unknown_variance_is_the_noise),
      cmocka_unit_test(moved_memory_goes_on),
      cmocka_unit_test(digest_is_constant),
      cmocka_unit_test(a_chance_is_of_all_components),
      cmocka_unit_test(rim_ucb_is_sure_inside),
      cmocka_unit_test(unseen_rims_widen_what_was_not_visited),
      cmocka_unit_test(a_reward_is_learnt_against_what_was_expected),
      cmocka_unit_test(what_is_smooth_is_left_to_the_gp),
      cmocka_unit_test(small_deviations_make_no_rim),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
