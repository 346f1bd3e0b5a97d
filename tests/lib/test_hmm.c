/* SPDX-License-Identifier: MIT */
/* The forward algorithm against the sum over all paths, and where probabilities leave `double`. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "interference/hmm.h"

#define SEED 83u
enum { S = 3, T = 6 };

static void near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

static rim_hmm_model model(void) {
  const rim_hmm_model m = {.states = S,
                           .initial = {0.7, 0.3, 0.0},
                           .transition = {{0.8, 0.15, 0.05}, {0.3, 0.6, 0.1}, {0.0, 0.5, 0.5}}};
  return m;
}

/* P(S_T = last, o) by walking every path. */
static void test_all_paths(void **state) {
  (void)state;
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 0);
  const rim_hmm_model m = model();
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  double b[T][S];
  for (int t = 0; t < T; ++t) {
    for (int i = 0; i < S; ++i)
      b[t][i] = rimi_rng_uniform(&rng);
    const double ln_b[S] = {log(b[t][0]), log(b[t][1]), log(b[t][2])};
    assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_OK);
  }
  double joint[S] = {0};
  for (int path = 0; path < 729; ++path) {
    int at = path % 3, rest = path / 3;
    double p = m.initial[at] * b[0][at];
    for (int t = 1; t < T; ++t) {
      const int next = rest % 3;
      rest /= 3;
      p *= m.transition[at][next] * b[t][next];
      at = next;
    }
    joint[at] += p;
  }
  const double sum = joint[0] + joint[1] + joint[2];
  near(h.ln_evidence, log(sum), 1e-13);
  for (uint32_t i = 0; i < S; ++i) {
    near(h.ln_alpha[i], log(joint[i] / sum), 1e-13);
    near(rimi_hmm_ln_odds(&h, i), log(joint[i] / (sum - joint[i])), 1e-12);
  }
}

/* A million unlikely observations: the posterior stays a distribution, the evidence a number. */
static void test_never_underflows(void **state) {
  (void)state;
  const rim_hmm_model m = model();
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  const double ln_b[2][S] = {{-5000.0, -4000.0, -9000.0}, {-4000.0, -7000.0, -300.0}};
  for (int t = 0; t < 1000000; ++t)
    assert_int_equal(rimi_hmm_step(&h, ln_b[t & 1]), RIM_OK);
  double sum = 0.0;
  for (uint32_t i = 0; i < S; ++i)
    sum += exp(h.ln_alpha[i]);
  near(sum, 1.0, 1e-12);
  assert_true(isfinite(h.ln_evidence));
  assert_true(h.ln_evidence < -1e9);
}

/* State 2 is left for 0 only through 1, and 1 was made e^-2000 unlikely: by logarithms alone. */
static void test_lost_terms_are_taken_again(void **state) {
  (void)state;
  const rim_hmm_model m = {.states = 3,
                           .initial = {0.0, 0.0, 1.0},
                           .transition = {{1.0, 0.0, 0.0}, {0.5, 0.5, 0.0}, {0.0, 0.5, 0.5}}};
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  const double even[3] = {0.0, 0.0, 0.0}, against_1[3] = {0.0, -2000.0, 0.0};
  assert_int_equal(rimi_hmm_step(&h, even), RIM_OK);
  near(h.ln_alpha[2], 0.0, 0.0);
  assert_true(rimi_hmm_ln_odds(&h, 2) > 1e11);
  assert_int_equal(rimi_hmm_step(&h, against_1), RIM_OK);
  near(h.ln_alpha[1], -2000.0, 1e-9); /* ln .5 less ln .5 */
  assert_int_equal(rimi_hmm_step(&h, against_1), RIM_OK);
  near(h.ln_alpha[0], -2000.0 + log(0.5) - log(0.5), 1e-9);
  near(rimi_hmm_ln_odds(&h, 0), -2000.0, 1e-9);
  /* Two of the others are left by logarithms alone: they are summed by them. */
  h.alpha[0] = h.alpha[1] = 0.0;
  h.ln_alpha[0] = -2000.0;
  h.ln_alpha[1] = -2000.0 - log(3.0);
  near(rimi_hmm_ln_odds(&h, 2), 2000.0 - log(4.0 / 3.0), 1e-9);
  /* And so is what both of them reach: state 0, from itself and half of the time from 1. */
  h.alpha[2] = 1.0;
  h.ln_alpha[2] = 0.0;
  assert_int_equal(rimi_hmm_step(&h, even), RIM_OK);
  near(h.ln_alpha[0], -2000.0 + log(7.0 / 6.0), 1e-9);
}

/* The only state there is has all the odds there are, and no infinite ones. */
static void test_one_state_has_nothing_against_it(void **state) {
  (void)state;
  const rim_hmm_model m = {.states = 1, .initial = {1.0}, .transition = {{1.0}}};
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  const double even[1] = {0.0};
  assert_int_equal(rimi_hmm_step(&h, even), RIM_OK);
  assert_true(rimi_hmm_ln_odds(&h, 0) == -RIM_HMM_LN_ZERO);
}

/* As many states as there may be, all alike: what is seen says which, and no more. */
static void test_most_states(void **state) {
  (void)state;
  enum { MOST = RIM_HMM_MAX_STATES };
  rim_hmm_model m = {.states = MOST};
  double ln_b[MOST], sum = 0.0;
  for (int i = 0; i < MOST; ++i) {
    m.initial[i] = 1.0 / MOST;
    for (int j = 0; j < MOST; ++j)
      m.transition[i][j] = 1.0 / MOST;
    ln_b[i] = log(1.0 + i);
    sum += 1.0 + i;
  }
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  for (int t = 1; t <= 3; ++t) {
    assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_OK);
    near(h.ln_evidence, t * log(sum / MOST), 1e-13);
    for (int i = 0; i < MOST; ++i)
      near(exp(h.ln_alpha[i]), (1.0 + i) / sum, 1e-14);
  }
}

/* 1e9 in size is taken, the next number is not; nor is what lies between that and impossible. */
static void test_the_largest_that_is_taken(void **state) {
  (void)state;
  const rim_hmm_model m = model();
  const double taken[4] = {1e9, -1e9, RIM_HMM_LN_ZERO, -INFINITY};
  const double refused[3] = {nextafter(1e9, INFINITY), nextafter(-1e9, -INFINITY),
                             nextafter(RIM_HMM_LN_ZERO, 0.0)};
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  for (int i = 0; i < 4; ++i) {
    const double ln_b[S] = {0.0, taken[i], 0.0};
    assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_OK);
  }
  for (int i = 0; i < 3; ++i) {
    const double ln_b[S] = {0.0, refused[i], 0.0};
    assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_E_DATA);
  }
  assert_int_equal(h.refused, 3);
}

static void test_bad_observations_are_counted(void **state) {
  (void)state;
  const rim_hmm_model m = model();
  rim_hmm h, before;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  const double good[S] = {-1.0, -2.0, -3.0};
  assert_int_equal(rimi_hmm_step(&h, good), RIM_OK);
  before = h;
  const double bad[4][S] = {{NAN, 0.0, 0.0},
                            {0.0, INFINITY, 0.0},
                            {0.0, -2e9, 0.0},
                            {RIM_HMM_LN_ZERO, RIM_HMM_LN_ZERO, RIM_HMM_LN_ZERO}};
  for (int i = 0; i < 4; ++i)
    assert_int_equal(rimi_hmm_step(&h, bad[i]), RIM_E_DATA);
  assert_int_equal(h.refused, 4);
  before.refused = 4;
  assert_memory_equal(&h, &before, sizeof h);
  const double none[S] = {-INFINITY, -1.0, RIM_HMM_LN_ZERO};
  assert_int_equal(rimi_hmm_step(&h, none), RIM_OK);
  near(h.ln_alpha[1], 0.0, 1e-15);
  rimi_hmm_reset(&h);
  assert_int_equal(h.resets, 1);
  near(h.ln_alpha[0], log(0.7), 1e-15);
  assert_true(h.ln_evidence == 0.0 && h.steps == 0); /* of no observation since */
}

/* Of as many states as there may be, all reached by logarithms alone. */
static void test_most_states_by_logarithms(void **state) {
  (void)state;
  enum { MOST = RIM_HMM_MAX_STATES };
  double counts[MOST * MOST];
  for (size_t i = 0; i < (size_t)MOST * MOST; ++i)
    counts[i] = 1.0;
  rim_hmm_model m;
  rim_hmm h;
  assert_int_equal(rimi_hmm_from_counts(&m, MOST, counts, 1.0, NULL), RIM_OK);
  assert_int_equal(rimi_hmm_from_counts(&m, MOST + 1, counts, 1.0, NULL), RIM_E_RANGE);
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  double ln_b[MOST] = {0.0};
  assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_OK);
  for (size_t i = 0; i < MOST; ++i) {
    h.alpha[i] = 0.0;
    h.ln_alpha[i] = log(1.0 / MOST);
  }
  ln_b[MOST - 1] = RIM_HMM_LN_ZERO; /* and one is impossible */
  const double before = h.ln_evidence;
  assert_int_equal(rimi_hmm_step(&h, ln_b), RIM_OK);
  near(h.ln_evidence - before, log((MOST - 1.0) / MOST), 1e-12);
  for (size_t i = 0; i + 1 < MOST; ++i)
    near(h.ln_alpha[i], log(1.0 / (MOST - 1)), 1e-12);
  assert_true(h.ln_alpha[MOST - 1] == RIM_HMM_LN_ZERO);
}

static void test_init_refuses(void **state) {
  (void)state;
  rim_hmm h;
  memset(&h, 0, sizeof h);
  rim_hmm_model m = model();
  assert_int_equal(rimi_hmm_init(NULL, &m), RIM_E_ARGUMENT);
  m.transition[1][1] = 0.61;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_E_DATA);
  for (int i = 0; i < S; ++i) { /* whichever row it is */
    m = model();
    m.transition[i][1] += 0.01;
    assert_int_equal(rimi_hmm_init(&h, &m), RIM_E_DATA);
  }
  m = model();
  m.states = 0;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_E_RANGE);
  m = model();
  m.initial[0] = NAN;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_E_DATA);
  m = model();
  m.states = RIM_HMM_MAX_STATES + 1;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_E_RANGE);
  assert_int_equal(rimi_hmm_step(&h, m.initial), RIM_E_ARGUMENT);
}

static void test_counts(void **state) {
  (void)state;
  const double counts[9] = {6.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 8.0};
  rim_hmm_model m;
  uint32_t unseen = 0;
  assert_int_equal(rimi_hmm_from_counts(&m, 3, counts, 0.5, &unseen), RIM_OK);
  assert_int_equal(unseen, 2);
  near(m.transition[0][0], 6.5 / 9.5, 1e-15);
  near(m.transition[0][2], 0.5 / 9.5, 1e-15);
  near(m.transition[1][0], 1.0 / 3.0, 1e-15);
  assert_true(m.initial[0] == 1.0 && m.initial[1] == 0.0 && m.initial[2] == 0.0);
  rim_hmm h;
  assert_int_equal(rimi_hmm_init(&h, &m), RIM_OK);
  assert_int_equal(rimi_hmm_from_counts(&m, 3, counts, 0.0, NULL), RIM_E_DATA);
  const double negative[1] = {-1.0};
  for (int at = 0; at < 9; ++at) { /* whichever it is */
    double bad[9] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
    bad[at] = -1.0;
    assert_int_equal(rimi_hmm_from_counts(&m, 3, bad, 1.0, NULL), RIM_E_DATA);
  }
  assert_int_equal(rimi_hmm_from_counts(&m, 1, negative, 1.0, NULL), RIM_E_DATA);
  assert_int_equal(rimi_hmm_from_counts(&m, 0, counts, 1.0, NULL), RIM_E_RANGE);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_all_paths),
                                     cmocka_unit_test(test_never_underflows),
                                     cmocka_unit_test(test_lost_terms_are_taken_again),
                                     cmocka_unit_test(test_one_state_has_nothing_against_it),
                                     cmocka_unit_test(test_most_states),
                                     cmocka_unit_test(test_most_states_by_logarithms),
                                     cmocka_unit_test(test_bad_observations_are_counted),
                                     cmocka_unit_test(test_the_largest_that_is_taken),
                                     cmocka_unit_test(test_init_refuses),
                                     cmocka_unit_test(test_counts)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
