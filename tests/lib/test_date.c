/* SPDX-License-Identifier: MIT */
/* search/date.c: a step, a ramp and a gain since an onset are judged as generalised least squares
 * with whole matrices says; a deviation of two shapes is dated where it begins, one of a single
 * shape where that shape begins; and so is what deviates in a region only. */
#include "search_bench.h"

#include <stdlib.h>

enum { VARIANTS = 8, ONSET = 60, BLOCKS = 150 };

/* Every combination of run effects, autocorrelation, and scale that depends on the prediction. */
static world variant(uint32_t i, uint32_t seed) {
  world w = make_world((i & 1) != 0, (i & 2) != 0 ? 0.6 : 0.0, (i & 4) != 0 ? 0.31 : 0.0);
  draw(&w, BLOCKS, seed);
  return w;
}

static void the_statistic_is_that_of_whole_matrices(void **state) {
  (void)state;
  for (uint32_t v = 0; v < VARIANTS; ++v) {
    world w = variant(v, v);
    w.unknown[70] = w.unknown[71] = true;
    static bench b;
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    rimi_search_refresh(b.search, 0);
    for (uint32_t onset = 5; onset < BLOCKS - 5; onset += 33) {
      for (uint8_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family) {
        search_hypothesis h = {.family = family, .onset = onset};
        double shape[MOST_BLOCKS];
        for (uint32_t i = 0; i < BLOCKS; ++i)
          shape[i] = i < onset                ? 0.0
                     : family == SEARCH_SINCE ? w.s
                     : family == SEARCH_RAMP  ? w.s * (double)(i - onset) / 256.0
                                              : predicted(&w, i);
        const gls expected = dense(&w, shape);
        rimi_search_judge_in_time(b.search, &h);
        assert_true(fabs((double)h.shift - expected.shift) <
                    5e-3 * expected.sd + 2e-3 * fabs(expected.shift));
        assert_true(fabs((double)h.sd - expected.sd) < 2e-3 * expected.sd);
        assert_true(fabs((double)h.ln_ratio - expected.ln_ratio) < 5e-3 + 4e-3 * expected.ln_ratio);
      }
    }
  }
}

/* What is added at an age of 0..1 of the rest of the run, in the channel's s. */
typedef double (*deviation)(double age, double p);
static double step_and_ramp(double age, double p) {
  (void)p;
  return 3.0 + 9.0 * age;
}
static double bend(double age, double p) {
  (void)p;
  return 2.0 * age + 14.0 * age * age;
}
static double growing_gain(double age, double p) { return 12.0 * age * p / 3.0; }
static double step(double age, double p) {
  (void)age;
  (void)p;
  return 4.0;
}
static double ramp(double age, double p) {
  (void)p;
  return 12.0 * age;
}
static double gain(double age, double p) {
  (void)age;
  return 4.0 * p / 3.0;
}

typedef struct dated {
  double onset, error; /* mean, and root mean square error, blocks */
  uint32_t covered, cases;
} dated;

static dated date_all(deviation of) {
  dated all = {0};
  static bench b;
  for (uint32_t v = 0; v < VARIANTS; ++v) {
    for (uint32_t draws = 0; draws < 4; ++draws) {
      world w = variant(v, 100 + 4 * v + draws);
      for (uint32_t i = ONSET; i < BLOCKS; ++i)
        w.r[i] += w.s * of((double)(i - ONSET) / (BLOCKS - ONSET), predicted(&w, i));
      start(&b, &w, BLOCKS);
      feed(&b, 0, BLOCKS, TURN);
      search_hypothesis h;
      double sd;
      rimi_search_explain(b.search, 0, &h, &sd);
      if (h.family > SEARCH_GAIN)
        continue; /* a region by chance */
      assert_true(sd > 0.0 && h.onset < BLOCKS);
      const double error = (double)h.onset - ONSET;
      all.onset += (double)h.onset;
      all.error += error * error;
      all.covered += fabs(error) < 3.0 * sd + 1.0;
      ++all.cases;
    }
  }
  all.onset /= (double)all.cases;
  all.error = sqrt(all.error / (double)all.cases);
  printf("onset %.1f of %d, error %.2f blocks, within 3 sd %u of %u\n", all.onset, ONSET, all.error,
         all.covered, all.cases);
  return all;
}

/* One shape alone dates the first farther off than this bound, and is too sure of it. The onset of
 * a bend, which begins at nearly nothing, is known only roughly. */
static void two_shapes_are_dated_where_they_begin(void **state) {
  (void)state;
  const deviation each[] = {step_and_ramp, bend, growing_gain};
  const double most[] = {8.0, 30.0, 9.0};
  for (size_t k = 0; k < sizeof each / sizeof each[0]; ++k) {
    const dated all = date_all(each[k]);
    assert_true(all.cases >= 23 && all.error < most[k]);
    assert_true(10 * all.covered >= 8 * all.cases);
  }
}

static void one_shape_is_dated_as_before(void **state) {
  (void)state;
  const deviation each[] = {step, ramp, gain};
  for (size_t k = 0; k < sizeof each / sizeof each[0]; ++k) {
    const dated all = date_all(each[k]);
    assert_true(all.cases >= 28 && all.error < (k == 1 ? 7.0 : 3.0));
    assert_true(10 * all.covered >= 8 * all.cases);
  }
}

/* Deviates only where feature 0 is inside an interval, and is found there in this shape; *plain:
 * how far off the best step inside the same place begins. */
static dated date_region(deviation of, search_shape shape, dated *plain) {
  dated all = {0};
  static bench b;
  *plain = all;
  for (uint32_t v = 0; v < VARIANTS; ++v) {
    for (uint32_t draws = 0; draws < 4; ++draws) {
      world w = variant(v, 500 + 4 * v + draws);
      uint32_t begin = BLOCKS; /* the first block that deviates */
      for (uint32_t i = BLOCKS; i-- > ONSET;) {
        const bool inside = w.feature[i][0] >= 64 && w.feature[i][0] < 160;
        begin = inside ? i : begin;
        const double age = (double)(i - ONSET) / (BLOCKS - ONSET);
        w.r[i] += inside ? w.s * of(age, predicted(&w, i)) : 0.0;
      }
      start(&b, &w, BLOCKS);
      feed(&b, 0, BLOCKS, TURN);
      search_hypothesis h;
      double sd;
      rimi_search_explain(b.search, 0, &h, &sd);
      if (h.family != SEARCH_INTERVAL_SINCE || h.feature[0] != 0 || h.shape != shape)
        continue;
      const search_mask mask = rimi_search_mask_of(b.search, &h, -1);
      search_hypothesis stepped = h;
      rimi_search_take_shape(b.search, shape);
      rimi_search_scan_onset(b.search, &mask, &stepped, NULL);
      const double error = (double)h.onset - begin, before = (double)stepped.onset - begin;
      all.onset += (double)h.onset;
      all.error += error * error;
      plain->error += before * before;
      all.covered += fabs(error) < 3.0 * sd + 1.0;
      ++all.cases;
    }
  }
  all.onset /= (double)all.cases;
  all.error = sqrt(all.error / (double)all.cases);
  plain->error = sqrt(plain->error / (double)all.cases);
  printf("in a region: onset %.1f of %d, error %.2f blocks, of a step %.2f, within 3 sd %u of %u\n",
         all.onset, ONSET, all.error, plain->error, all.covered, all.cases);
  return all;
}

static void what_grows_in_a_region_is_dated_where_it_begins(void **state) {
  (void)state;
  const deviation each[] = {ramp, step_and_ramp, growing_gain};
  const uint32_t least[] = {28, 28, 9}; /* a gain is often taken for a shift */
  for (size_t k = 0; k < sizeof each / sizeof each[0]; ++k) {
    dated plain;
    const dated all = date_region(each[k], k == 2 ? SEARCH_PROPORTIONAL : SEARCH_CONSTANT, &plain);
    assert_true(all.cases >= least[k] && 4.0 * all.error < 3.0 * plain.error);
    assert_true(10 * all.covered >= 8 * all.cases);
  }
}

static void what_is_constant_in_a_region_is_dated_as_a_step(void **state) {
  (void)state;
  dated plain;
  const dated all = date_region(step, SEARCH_CONSTANT, &plain);
  assert_true(all.cases >= 28 && all.error < plain.error + 1.0);
  assert_true(10 * all.covered >= 8 * all.cases);
}

/* It reads low at first and then ever higher: what is said to read high does not begin where it
 * reads low in the mean. */
static void an_onset_of_the_other_sign_is_not_taken(void **state) {
  (void)state;
  static bench b;
  uint32_t kept = 0;
  for (uint32_t draws = 0; draws < 8; ++draws) {
    world w = make_world(false, 0.4, 0.0);
    draw(&w, BLOCKS, 700 + draws);
    for (uint32_t i = ONSET; i < BLOCKS; ++i)
      w.r[i] += w.feature[i][0] >= 128 ? w.s * (0.16 * (double)(i - ONSET) - 9.0) : 0.0;
    start(&b, &w, BLOCKS);
    feed(&b, 0, BLOCKS, 0);
    search_hypothesis h = {.family = SEARCH_INTERVAL_SINCE,
                           .first = {SEARCH_BINS / 2},
                           .last = {SEARCH_BINS - 1},
                           .onset = BLOCKS - 25};
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h) && h.shift > 0.0f);
    double sd;
    rimi_search_date(b.search, &h, &sd);
    assert_true(h.shift > 0.0f && sd > 0.0);
    kept += h.onset == BLOCKS - 25;
  }
  assert_int_equal(kept, 8);
}

/* An outcome upside down is dated as before: what read high reads low, a gain is the same. */
static void upside_down_it_begins_at_the_same_time(void **state) {
  (void)state;
  const deviation each[] = {step_and_ramp, bend, growing_gain};
  static bench b;
  unsigned gains = 0;
  for (uint32_t k = 0; k < 12; ++k) {
    world w = make_world(false, 0.4, 0.0);
    draw(&w, BLOCKS, 300 + k);
    for (uint32_t i = ONSET; i < BLOCKS; ++i)
      w.r[i] += w.s * each[k % 3]((double)(i - ONSET) / (BLOCKS - ONSET), predicted(&w, i));
    search_hypothesis h[2];
    double sd[2];
    for (size_t turned = 0; turned < 2; ++turned) {
      start(&b, &w, BLOCKS);
      feed(&b, 0, BLOCKS, TURN);
      rimi_search_explain(b.search, 0, &h[turned], &sd[turned]);
      w.p_center = -w.p_center;
      for (uint32_t i = 0; i < BLOCKS; ++i) {
        w.p[i] = -w.p[i];
        w.r[i] = -w.r[i];
      }
    }
    assert_int_equal(h[0].family, h[1].family);
    assert_int_equal(h[0].onset, h[1].onset);
    assert_true(fabs(sd[0] - sd[1]) < 0.01 * sd[0]);
    const double sign = h[0].family == SEARCH_GAIN ? 1.0 : -1.0;
    assert_true(fabs((double)h[0].shift - sign * (double)h[1].shift) <
                0.01 * fabs((double)h[0].shift));
    gains += h[0].family == SEARCH_GAIN;
  }
  assert_true(gains > 0);
}

/* -ln of the tail of a chi-square distribution, against its density summed numerically. */
static void the_surprise_is_that_of_a_chi_square(void **state) {
  (void)state;
  for (uint32_t k = 1; k <= NOISE_MAX_FIELDS; ++k) {
    double before = 0.0;
    for (double q = k + 0.25; q < 60.0; q += 1.0) {
      const double step = 1e-3, scale = exp(-lgamma(0.5 * k) - 0.5 * k * log(2.0));
      double tail = 0.0; /* times exp(q / 2) */
      for (double t = q + 0.5 * step; t < q + 80.0; t += step)
        tail += step * scale * pow(t, 0.5 * k - 1.0) * exp(0.5 * (q - t));
      const double nats = rimi_search_surprise(k, 0, q);
      assert_true(fabs(nats - (0.5 * q - log(tail))) < 0.06);
      assert_true(nats > before);
      before = nats;
    }
  }
}

/* And of Hotelling's T^2, where runs taught the variances. */
static void few_runs_are_surprised_less(void **state) {
  (void)state;
  const uint32_t sizes[] = {9, 30, 100};
  for (uint32_t i = 0; i < 3; ++i) {
    const double n = sizes[i];
    for (uint32_t k = 1; k <= NOISE_MAX_FIELDS; ++k) {
      const double scale = lgamma(0.5 * n) - lgamma(0.5 * k) - lgamma(0.5 * (n - k));
      for (double q = k + 0.25; q < 200.0; q *= 1.4) {
        double tail = 0.0; /* over t = (n - 1) exp(u) */
        for (double u = log(q / (n - 1.0)) + 5e-4; u < 40.0; u += 1e-3)
          tail += 1e-3 * exp(scale + 0.5 * k * u - 0.5 * n * log1p(exp(u)));
        const double nats = rimi_search_surprise(k, sizes[i], q);
        assert_true(fabs(nats + log(tail)) < (k == 2 ? 1e-3 : 2.0));
        assert_true(nats < rimi_search_surprise(k, 0, q));
      }
    }
  }
  /* Fewer runs than effects can hardly be surprised, two are the fewest that teach a variance. */
  assert_true(rimi_search_surprise(2, 2, 100.0) < 0.2 * rimi_search_surprise(2, 1, 100.0));
  assert_true(rimi_search_surprise(2, 1, 100.0) == rimi_search_surprise(2, 0, 100.0));
  assert_true(rimi_search_surprise(4, 3, 1e4) < 4.0);
}

/* The run's own effects are judged from half of a run on, RUN_S / 2. */
static void effects_are_judged_from_half_a_run_on(void **state) {
  (void)state;
  enum { HALF = 40 }; /* blocks of BLOCK_S before that */
  const world w = far_off(BLOCKS);
  for (uint32_t held = HALF; held <= HALF + 1; ++held) {
    static bench b;
    float maxima[CHANNELS * NOISE_FAMILIES] = {0};
    start(&b, &w, BLOCKS);
    feed(&b, 0, held, 0);
    rimi_search_keep_maxima(b.search, maxima);
    rimi_search_refresh(b.search, 0);
    assert_int_equal(maxima[SEARCH_FIELD] > 10.0f, held > HALF);
  }
}

/* The ratio of the run's own effects after all blocks of w, where `runs` taught how they differ. */
static double ratio_of_effects(const world *w, uint32_t runs) {
  static bench b;
  float maxima[CHANNELS * NOISE_FAMILIES] = {0};
  start(&b, w, BLOCKS);
  b.noise.runs = runs;
  feed(&b, 0, BLOCKS, 0);
  rimi_search_keep_maxima(b.search, maxima);
  rimi_search_refresh(b.search, 0);
  return (double)maxima[SEARCH_FIELD];
}

/* Where a run has one effect, an offset, its square follows from the definition; what nobody taught
 * pays 2.5 nats, and what runs taught the two tests that are made of it. */
static void an_offset_surprises_by_its_square(void **state) {
  (void)state;
  const world w = far_off(BLOCKS);
  double sum = 0.0;
  for (uint32_t i = 0; i < BLOCKS; ++i)
    sum += residual_of(&w, i) / w.s;
  const double information = (double)BLOCKS + 1.0 / w.prior[0], b = sum / information;
  const double q = b * b / (w.prior[0] - 1.0 / information);
  assert_true(fabs(ratio_of_effects(&w, 0) - (rimi_search_surprise(1, 0, q) - 2.5)) < 0.05);
  for (uint32_t runs = 10; runs <= 50; runs += 20)
    assert_true(fabs(ratio_of_effects(&w, runs) - (rimi_search_surprise(1, runs, q) - log(2.0))) <
                0.05);
}

enum { RUNS = 50 }; /* that taught what runs differ by */

/* What all effects of w's run together surprise by. */
static double surprise_together(const world *w) {
  const double of_known = ratio_of_effects(w, 0) + 2.5;
  double low = FIELDS, high = 1e3; /* the square that surprises by as much */
  for (int i = 0; i < 60; ++i) {
    const double q = 0.5 * (low + high);
    *(rimi_search_surprise(FIELDS, 0, q) < of_known ? &low : &high) = q;
  }
  return rimi_search_surprise(FIELDS, RUNS, low) - log(2.0);
}

/* An offset that is impossible by itself shows beside effects that are as usual: all of them
 * together surprise less. What runs differ by otherwise shows in all of them together. */
static void an_offset_shows_among_other_effects(void **state) {
  (void)state;
  world w = make_world(true, 0.0, 0.0);
  draw(&w, BLOCKS, 78);
  for (uint32_t i = 0; i < BLOCKS; ++i)
    w.r[i] += 4.0 * w.s;
  print_message("all effects %.2f nats, the offset %.2f\n", surprise_together(&w),
                ratio_of_effects(&w, RUNS));
  assert_true(ratio_of_effects(&w, RUNS) > surprise_together(&w) + 1.0);
  for (uint32_t i = 0; i < BLOCKS; ++i)
    w.r[i] += w.s * (-4.0 + 4.0 * w.p[i]);
  const double ratio = ratio_of_effects(&w, RUNS);
  print_message("without it, but another: %.2f nats\n", ratio);
  assert_true(ratio > 3.0 && fabs(ratio - surprise_together(&w)) < 0.05);
}

/* Onsets are noted from the newest block to the oldest. One that explains as much as the best so
 * far shares its weight, and the later of them stays; one that explains less by far is not counted.
 */
static void of_equal_onsets_the_later_stays(void **state) {
  (void)state;
  search_onsets onsets = {0};
  rimi_search_note_onset(&onsets, 2.0, 9);
  rimi_search_note_onset(&onsets, 2.0, 5);
  assert_int_equal(onsets.at, 9);
  assert_true(onsets.weight == 2.0 && onsets.first == 14.0 && onsets.second == 106.0);
  assert_true(rimi_search_onset_sd(&onsets) == 2.0);
  rimi_search_note_onset(&onsets, -1e3, 1);
  assert_true(onsets.weight == 2.0 && onsets.at == 9);
  rimi_search_note_onset(&onsets, 1e3, 1); /* beside which those before are nothing */
  assert_true(onsets.weight == 1.0 && onsets.first == 1.0 && onsets.at == 1);
  assert_true(fabs(rimi_search_onset_sd(&onsets) - sqrt(1.0 / 12.0)) < 1e-15);
}

/* Where the sums are no numbers the run's effects are taken to be none, with hardly any error. */
static void absurd_sums_have_no_effects(void **state) {
  (void)state;
  enum { PACKED = FIELDS * (FIELDS + 1) / 2 };
  world w = make_world(true, 0.3, 0.0);
  draw(&w, BLOCKS, 5);
  static bench b;
  start(&b, &w, BLOCKS);
  feed(&b, 0, BLOCKS, 0);
  rimi_search_refresh(b.search, 0);
  const noise_channel c = rimi_noise_channel(&b.noise, 0);
  double l[PACKED], effect[FIELDS];
  for (size_t i = 0; i < PACKED; ++i)
    search_gram(b.search, 0)[i] = -1e20f;
  rimi_search_effects(b.search, &c, l, effect);
  for (size_t i = 0, at = 0; i < FIELDS; ++i) {
    assert_true(effect[i] == 0.0);
    for (size_t j = 0; j <= i; ++j, ++at)
      assert_true(l[at] == (i == j ? 1e15 : 0.0));
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_surprise_is_that_of_a_chi_square),
      cmocka_unit_test(few_runs_are_surprised_less),
      cmocka_unit_test(the_statistic_is_that_of_whole_matrices),
      cmocka_unit_test(two_shapes_are_dated_where_they_begin),
      cmocka_unit_test(one_shape_is_dated_as_before),
      cmocka_unit_test(what_grows_in_a_region_is_dated_where_it_begins),
      cmocka_unit_test(an_onset_of_the_other_sign_is_not_taken),
      cmocka_unit_test(what_is_constant_in_a_region_is_dated_as_a_step),
      cmocka_unit_test(upside_down_it_begins_at_the_same_time),
      cmocka_unit_test(effects_are_judged_from_half_a_run_on),
      cmocka_unit_test(an_offset_surprises_by_its_square),
      cmocka_unit_test(an_offset_shows_among_other_effects),
      cmocka_unit_test(of_equal_onsets_the_later_stays),
      cmocka_unit_test(absurd_sums_have_no_effects),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
