/* SPDX-License-Identifier: MIT */
/* search/statistic.c: how improbable so large effects of a run are, by the tails of a chi-square,
 * and how much less where few runs taught them; how surely an onset is known. */
#include "search_bench.h"

static void near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance))
    fail_msg("%.17g is not %.17g", a, b);
}

/* -ln P(chi-square of k degrees >= q): by parts, exact for any k. */
static double of_chi_square(uint32_t k, double q) {
  const double x = 0.5 * q;
  double tail = k % 2 == 0 ? exp(-x) : erfc(sqrt(x));
  double term = k % 2 == 0 ? exp(-x) : exp(-x) * sqrt(x) / (0.5 * sqrt(RIM_PI));
  for (uint32_t i = 1; 2 * i < k; ++i) {
    if (k % 2 == 0)
      term *= x / i;
    else if (i > 1)
      term *= x / (i - 0.5);
    tail += term;
  }
  return -log(tail);
}

static void known_effects_are_chi_square(void **state) {
  (void)state;
  for (uint32_t k = 1; k <= NOISE_MAX_FIELDS; ++k) {
    for (double q = k + 0.5; q < 300.0; q *= 1.7) {
      const double nats = rimi_search_surprise(k, 0, q), exact = of_chi_square(k, q);
      near(nats, exact, k % 2 == 0 ? 1e-9 * (1.0 + exact) : 0.07 * exact + 0.05);
    }
  }
  near(rimi_search_surprise(2, 0, 40.0), 20.0, 1e-9);
  near(rimi_search_surprise(4, 0, 40.0), 20.0 - log(21.0), 1e-9);
}

/* What few runs taught surprises less, and, as soon as there are more of them than effects, more
 * runs ever more, up to what is known; one run, which teaches no spread, counts as known. */
static void effects_that_runs_taught_surprise_less(void **state) {
  (void)state;
  for (uint32_t k = 1; k <= NOISE_MAX_FIELDS; ++k) {
    const double known = rimi_search_surprise(k, 0, 60.0);
    double before = 0.0;
    for (uint32_t runs = 2; runs < 3000; runs = runs < 10 ? runs + 1 : 2 * runs) {
      const double nats = rimi_search_surprise(k, runs, 60.0);
      assert_true(nats > 0.0 && nats <= known + 1e-9);
      assert_true(runs <= k || nats >= before - 1e-9);
      before = runs > k ? nats : 0.0;
    }
    near(before, known, 0.2 * known);
    near(rimi_search_surprise(k, 1, 60.0), known, 1e-12);
  }
}

/* Onsets that explain as much are as likely, and the one that was noted first is the best; one that
 * explains far less does not count, and one that explains far more counts alone. */
static void onsets_are_as_likely_as_what_they_explain(void **state) {
  (void)state;
  search_onsets onsets = {0};
  near(rimi_search_onset_sd(&onsets), sqrt(1.0 / 12.0), 1e-12);
  rimi_search_note_onset(&onsets, 5.0, 13);
  rimi_search_note_onset(&onsets, 5.0, 7);
  assert_true(onsets.at == 13 && onsets.nats == 5.0 && onsets.weight == 2.0);
  near(rimi_search_onset_sd(&onsets), 3.0, 1e-12);
  rimi_search_note_onset(&onsets, 5.0 - log(2.0), 10); /* half as likely */
  near(onsets.weight, 2.5, 1e-12);
  rimi_search_note_onset(&onsets, 5.0 + log(5.0), 10);
  assert_int_equal(onsets.at, 10);
  near(onsets.weight, 1.5, 1e-12);
  rimi_search_note_onset(&onsets, -500.0, 3);
  near(onsets.weight, 1.5, 1e-12);
  rimi_search_note_onset(&onsets, 500.0, 4);
  assert_true(onsets.at == 4 && onsets.weight == 1.0);
  near(rimi_search_onset_sd(&onsets), sqrt(1.0 / 12.0), 1e-12);
}

/* Beside the best, one that is less likely by 20 nats is the last that counts. */
static void an_onset_counts_down_to_20_nats(void **state) {
  (void)state;
  search_onsets onsets = {0};
  rimi_search_note_onset(&onsets, 20.0, 13);
  rimi_search_note_onset(&onsets, 0.0, 7);
  near(onsets.weight - 1.0, exp(-20.0), 1e-15);
  assert_true(onsets.at == 13 && onsets.nats == 20.0);
  const double counted = onsets.weight;
  rimi_search_note_onset(&onsets, -1e-6, 8);
  assert_true(onsets.weight == counted);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(known_effects_are_chi_square),
      cmocka_unit_test(onsets_are_as_likely_as_what_they_explain),
      cmocka_unit_test(an_onset_counts_down_to_20_nats),
      cmocka_unit_test(effects_that_runs_taught_surprise_less),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
