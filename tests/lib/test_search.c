/* SPDX-License-Identifier: MIT */
/* search: the statistic of every shape is that of generalised least squares computed with whole
 * matrices (search_bench.h); what is planted is found; memory and copies. */
#include "search_bench.h"

#include <stdlib.h>

#include "base/crc.h"

static void assert_close(double value, double expected, double least) {
  const double error = fabs(value - expected);
  if (!(error <= 2e-3 * fabs(expected) + least))
    fail_msg("%.9g instead of %.9g", value, expected);
}

static void assert_same(const search_hypothesis *h, const gls *expected) {
  assert_close((double)h->shift, expected->shift, 1e-3 * expected->sd);
  assert_close((double)h->sd, expected->sd, 0.0);
  assert_close((double)h->ln_ratio, expected->ln_ratio, 2e-3);
}

static search_hypothesis hypothesis(search_family family, uint32_t onset) {
  return (search_hypothesis){.family = (uint8_t)family,
                             .feature = {0, 2},
                             .first = {5, 10},
                             .last = {14, SEARCH_BINS - 1},
                             .onset = onset};
}

static bool in_bins(const world *w, uint32_t i, const search_hypothesis *h, uint32_t which) {
  const uint32_t byte = w->feature[i][h->feature[which]];
  return byte >= h->first[which] * 256u / SEARCH_BINS &&
         byte < (h->last[which] + 1u) * 256u / SEARCH_BINS;
}

static void shape_of(const world *w, const search_hypothesis *h, double *shape) {
  for (uint32_t i = 0; i < w->blocks; ++i) {
    const uint32_t age = h->onset == SEARCH_FROM_START ? 0 : i - h->onset;
    bool inside = h->onset == SEARCH_FROM_START || i >= h->onset;
    inside = inside && (h->end == 0 || i < h->end);
    if (h->family >= SEARCH_INTERVAL && h->family != SEARCH_DURING)
      inside = inside && in_bins(w, i, h, 0);
    if (h->family == SEARCH_BOX || h->family == SEARCH_BOX_SINCE)
      inside = inside && in_bins(w, i, h, 1);
    shape[i] = !inside                    ? 0.0
               : h->family == SEARCH_RAMP ? w->s * age / 256.0
               : h->family == SEARCH_GAIN ? predicted(w, i)
                                          : w->s;
  }
}

static gls expected_of(const world *w, const search_hypothesis *h) {
  double shape[MOST_BLOCKS];
  shape_of(w, h, shape);
  return dense(w, shape);
}

static uint32_t blocks_inside(const world *w, const search_hypothesis *h) {
  double shape[MOST_BLOCKS];
  uint32_t n = 0;
  shape_of(w, h, shape);
  for (uint32_t i = 0; i < w->blocks; ++i)
    n += shape[i] > 0.0;
  return n;
}

/* A ring full of the world's blocks, whose first channel is ready to be judged. */
static void start_full(bench *b, const world *w) {
  start(b, w, RING);
  feed(b, 0, RING, 0);
  rimi_search_refresh(b->search, 0);
}

static void regions_are_judged_by_least_squares(void **state) {
  (void)state;
  static const search_family family[] = {SEARCH_SINCE, SEARCH_INTERVAL, SEARCH_BOX,
                                         SEARCH_INTERVAL_SINCE, SEARCH_BOX_SINCE};
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    const world w = world_variant(v, RING);
    bench b;
    start_full(&b, &w);
    for (size_t f = 0; f < sizeof family / sizeof *family; ++f) {
      const bool since = family[f] != SEARCH_INTERVAL && family[f] != SEARCH_BOX;
      for (uint32_t onset = since ? 0 : SEARCH_FROM_START; onset + 20 < RING || !since;
           onset += 7) {
        search_hypothesis h = hypothesis(family[f], onset);
        rimi_search_evaluate(b.search, &h);
        const uint32_t blocks = blocks_inside(&w, &h);
        assert_int_equal(h.blocks, blocks);
        if (blocks < SEARCH_LEAST) {
          assert_true(h.score < -1e9f && since);
          continue;
        }
        const gls g = expected_of(&w, &h);
        assert_same(&h, &g);
        const double score = (double)h.ln_ratio - rimi_search_description(family[f]);
        assert_close((double)h.score, score, 1e-5);
        if (!since)
          break;
      }
    }
  }
}

/* What lasts of the noise is still there after a gap, and more is new in it than in another block;
 * beside an unknown block there is nothing to go on from. */
static void gaps_are_judged_by_least_squares(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    world w = world_variant(v, RING);
    w.apart[9] = w.apart[22] = w.apart[23] = w.apart[31] = w.apart[RING - 1] = true;
    w.unknown[30] = true;
    bench b;
    start_full(&b, &w);
    for (uint32_t onset = 0; onset + 20 < RING; ++onset) {
      search_hypothesis h = hypothesis(SEARCH_SINCE, onset);
      rimi_search_evaluate(b.search, &h);
      const gls g = expected_of(&w, &h);
      assert_same(&h, &g);
    }
    search_hypothesis box = hypothesis(SEARCH_BOX, SEARCH_FROM_START);
    rimi_search_evaluate(b.search, &box);
    const gls g = expected_of(&w, &box);
    assert_same(&box, &g);
  }
}

/* Blocks of which nothing is known are as if they had not been: the statistic is that of the
 * others, and what an unknown residual would have been changes no bit. */
static void unknown_blocks_say_nothing(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    world w = world_variant(v, RING);
    for (uint32_t i = 0; i < RING; ++i)
      w.unknown[i] = i == 0 || i == 9 || (i >= 20 && i < 27) || i + 1 == RING;
    bench b, other;
    start(&b, &w, RING);
    feed(&b, 0, RING, TURN);
    for (uint32_t i = 0; i < RING; ++i)
      w.r[i] = w.unknown[i] ? 1e3 : w.r[i];
    start(&other, &w, RING);
    feed(&other, 0, RING, TURN);
    const search_hypothesis *found = rimi_search_best(b.search, 0);
    assert_memory_equal(found, rimi_search_best(other.search, 0), sizeof *found);
    rimi_search_refresh(b.search, 0);
    for (uint32_t family = SEARCH_SINCE; family <= SEARCH_BOX_SINCE; ++family) {
      if (family >= SEARCH_RAMP && family <= SEARCH_FIELD)
        continue;
      search_hypothesis h = hypothesis((search_family)family, SEARCH_FROM_START);
      if (family != SEARCH_INTERVAL && family != SEARCH_BOX)
        h.onset = 5;
      rimi_search_evaluate(b.search, &h);
      double shape[MOST_BLOCKS];
      uint32_t blocks = 0;
      shape_of(&w, &h, shape);
      for (uint32_t i = 0; i < RING; ++i)
        blocks += shape[i] > 0.0 && !w.unknown[i];
      assert_int_equal(h.blocks, blocks);
      const gls g = expected_of(&w, &h);
      if (blocks >= SEARCH_LEAST)
        assert_same(&h, &g);
    }
    for (uint32_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family) {
      const search_hypothesis h = b.search->in_time[family];
      const gls g = expected_of(&w, &h);
      assert_same(&h, &g);
    }
  }
}

/* What came and went: its ratio, and that no end of the same onset has a larger one. */
static void what_ended_is_judged_by_least_squares(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    const world w = world_variant(v, RING);
    bench b;
    start_full(&b, &w);
    for (uint32_t onset = 0; onset + 20 < RING; onset += 9) {
      search_hypothesis h = hypothesis(SEARCH_DURING, onset), best = h;
      double most = 0.0;
      for (h.end = onset + SEARCH_LEAST; h.end < RING; ++h.end) {
        rimi_search_evaluate(b.search, &h);
        const gls g = expected_of(&w, &h);
        assert_same(&h, &g);
        assert_int_equal(h.blocks, h.end - onset);
        most = fmax(most, g.ln_ratio);
      }
      rimi_search_scan_end(b.search, &best);
      assert_close((double)best.ln_ratio, most, 2e-3);
      assert_true(best.end > onset && best.end < RING);
    }
  }
}

/* The scan in bins finds the best of all intervals, each judged exactly. */
static void the_best_interval_is_the_best_of_all(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    const world w = world_variant(v, RING);
    bench b;
    start_full(&b, &w);
    for (uint32_t onset = 0; onset < 30; onset += 13) {
      search_hypothesis h = hypothesis(onset > 0 ? SEARCH_INTERVAL_SINCE : SEARCH_INTERVAL,
                                       onset > 0 ? onset : SEARCH_FROM_START);
      double most = 0.0;
      for (uint32_t first = 0; first < SEARCH_BINS; ++first) {
        for (uint32_t last = first; last < SEARCH_BINS; ++last) {
          h.first[0] = (uint8_t)first;
          h.last[0] = (uint8_t)last;
          rimi_search_evaluate(b.search, &h);
          most = fmax(most, (double)h.ln_ratio);
        }
      }
      const search_mask mask = rimi_search_mask_of(b.search, &h, 0);
      rimi_search_scan_interval(b.search, &mask, 0, &h, 0);
      assert_close((double)h.ln_ratio, most, 1e-6);
    }
  }
}

/* Over all onsets the largest ratio of each family, and the best hypothesis of all. */
static void onsets_are_judged_by_least_squares(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    world w = world_variant(v, RING);
    for (uint32_t i = 20; i < RING; ++i)
      w.r[i] += 0.1 * predicted(&w, i); /* so that there is a family that is best */
    bench b;
    float maxima[CHANNELS * NOISE_FAMILIES] = {0};
    start(&b, &w, RING);
    feed(&b, 0, RING, 0);
    rimi_search_keep_maxima(b.search, maxima);
    rimi_search_refresh(b.search, 0);
    double best_score = -1e30;
    search_hypothesis best = {0};
    for (uint32_t family = SEARCH_SINCE; family <= SEARCH_GAIN; ++family) {
      double most = 0.0;
      for (uint32_t onset = 0; onset + SEARCH_LEAST <= RING; ++onset) {
        const search_hypothesis h = hypothesis((search_family)family, onset);
        const gls g = expected_of(&w, &h);
        most = fmax(most, g.ln_ratio);
        if (g.ln_ratio - rimi_search_description((search_family)family) > best_score) {
          best_score = g.ln_ratio - rimi_search_description((search_family)family);
          best = h;
        }
      }
      assert_close((double)maxima[family], most, 5e-3);
    }
    const search_hypothesis *found = rimi_search_best(b.search, 0);
    assert_int_equal(found->family, best.family);
    assert_int_equal(found->onset, best.onset);
    const gls g = expected_of(&w, &best);
    assert_same(found, &g);
  }
}

/* Q = b' (prior - V)^-1 b, written out for one field. */
static void impossible_run_effects_are_told(void **state) {
  (void)state;
  const world w = far_off(RING);
  bench b;
  float maxima[CHANNELS * NOISE_FAMILIES] = {0};
  start(&b, &w, RING);
  feed(&b, 0, RING, 0);
  rimi_search_keep_maxima(b.search, maxima);
  rimi_search_refresh(b.search, 0);
  double u = 0.0;
  for (uint32_t i = 0; i < RING; ++i)
    u += residual_of(&w, i) / w.s;
  const double v = 1.0 / (RING + 1.0 / w.prior[0]), offset = u * v;
  const double q = offset * offset / (w.prior[0] - v);
  assert_true(q > 20.0);
  assert_close((double)maxima[SEARCH_FIELD], -log(erfc(sqrt(0.5 * q))) - 2.5, 1e-3);
  assert_true(rimi_search_best(b.search, 0)->score > 0.0f);
}

/* Healthy runs inflate ratios: phi divides them. */
static void phi_divides_the_ratio(void **state) {
  (void)state;
  world w = world_variant(3, RING);
  w.phi = 2.5f;
  bench b;
  start(&b, &w, RING);
  feed(&b, 0, RING, 0);
  rimi_search_refresh(b.search, 0);
  search_hypothesis h = hypothesis(SEARCH_BOX, SEARCH_FROM_START);
  rimi_search_evaluate(b.search, &h);
  const gls g = expected_of(&w, &h);
  assert_same(&h, &g);
  assert_close((double)h.score, g.ln_ratio / 2.5 - rimi_search_description(SEARCH_BOX), 1e-3);
}

/* Older blocks than the ring's still tell the run's effects. */
static void a_full_ring_goes_on(void **state) {
  (void)state;
  enum { ALL = 110 };
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    const world w = world_variant(v, ALL);
    bench b;
    start(&b, &w, RING);
    feed(&b, 0, ALL, 0);
    assert_int_equal(rimi_search_blocks(b.search), ALL);
    assert_int_equal(rimi_search_oldest(b.search), ALL - RING);
    assert_close(rimi_search_time_of(b.search, ALL - 3), BLOCK_S * (ALL - 3), 0.0);
    assert_close(rimi_search_time_of(b.search, 0), BLOCK_S * (ALL - RING), 0.0);
    assert_close(rimi_search_time_of(b.search, ALL + 7), BLOCK_S * (ALL - 1), 0.0);
    rimi_search_refresh(b.search, 0);
    for (uint32_t onset = ALL - RING + 1; onset + 20 < ALL; onset += 5) {
      search_hypothesis since = hypothesis(SEARCH_SINCE, onset);
      search_hypothesis box = hypothesis(SEARCH_INTERVAL_SINCE, onset);
      rimi_search_evaluate(b.search, &since);
      rimi_search_evaluate(b.search, &box);
      const gls of_since = expected_of(&w, &since), of_box = expected_of(&w, &box);
      assert_same(&since, &of_since);
      assert_same(&box, &of_box);
    }
  }
}

/* ---- what is planted is found ---- */

static search_hypothesis find_planted(const world *w, uint16_t ring, double *onset_sd) {
  static bench b;
  start(&b, w, ring);
  feed(&b, 0, w->blocks, TURN);
  search_hypothesis h;
  rimi_search_explain(b.search, 0, &h, onset_sd);
  for (uint32_t i = rimi_search_oldest(b.search); i < w->blocks; ++i) { /* as its own bounds say */
    bool inside = h.onset == SEARCH_FROM_START || i >= h.onset;
    inside = inside && (h.end == 0 || i < h.end);
    if (h.family >= SEARCH_INTERVAL && h.family != SEARCH_DURING)
      inside = inside && in_bins(w, i, &h, 0);
    if (h.family == SEARCH_BOX || h.family == SEARCH_BOX_SINCE)
      inside = inside && in_bins(w, i, &h, 1);
    assert_int_equal(rimi_search_inside(b.search, &h, w->feature[i], i), inside);
  }
  const uint32_t first = rimi_search_first_inside(b.search, &h);
  assert_true(rimi_search_inside(b.search, &h, w->feature[first], first));
  for (uint32_t i = rimi_search_oldest(b.search); i < first; ++i)
    assert_false(rimi_search_inside(b.search, &h, w->feature[i], i));
  return h;
}

static void a_shift_since_a_time_is_found(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    for (int sign = -1; sign <= 1; sign += 2) {
      world w = world_variant(v, 150);
      const double shift = sign * 4.0 * w.s;
      for (uint32_t i = 90; i < w.blocks; ++i)
        w.r[i] += shift;
      double onset_sd;
      const search_hypothesis h = find_planted(&w, 150, &onset_sd);
      assert_int_equal(h.family, SEARCH_SINCE);
      assert_true(h.onset >= 85 && h.onset <= 95 && onset_sd > 0.2 && onset_sd < 6.0);
      assert_true(fabs((double)h.shift * w.s - shift) < 3.0 * (double)h.sd * w.s);
      assert_true((double)h.sd < 1.0 && h.score > 8.0f);
    }
  }
}

static void a_shift_that_ended_is_found(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_STEADY; ++v) {
    for (int sign = -1; sign <= 1; sign += 2) {
      world w = world_variant(v, 150);
      for (uint32_t i = 60; i < 100; ++i)
        w.r[i] += sign * 4.0 * w.s;
      double onset_sd;
      const search_hypothesis h = find_planted(&w, 150, &onset_sd);
      assert_int_equal(h.family, SEARCH_DURING);
      assert_true(h.onset >= 55 && h.onset <= 65 && onset_sd > 0.2 && onset_sd < 6.0);
      assert_true(h.end >= 95 && h.end <= 105);
      assert_true(fabs((double)h.shift - sign * 4.0) < 3.0 * (double)h.sd);
    }
  }
}

/* What is excluded has no say, whatever it was; what comes after is found as if it were alone. */
static void excluded_blocks_are_no_evidence(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    search_hypothesis found[2];
    for (uint32_t k = 0; k < 2; ++k) {
      world w = world_variant(v, 150);
      for (uint32_t i = 30; i < 70; ++i)
        w.r[i] += (k == 0 ? 4.0 : -9.0) * w.s;
      for (uint32_t i = 110; i < 150; ++i)
        w.r[i] -= 4.0 * w.s;
      static bench b;
      start(&b, &w, 150);
      feed(&b, 0, 90, TURN);
      assert_int_equal(rimi_search_best(b.search, 0)->family, SEARCH_DURING);
      assert_false(rimi_search_exclude(b.search, 70, 70));
      assert_true(rimi_search_exclude(b.search, 28, 72));
      assert_true(rimi_search_best(b.search, 0)->score < -1e9f);
      assert_false(rimi_search_exclude(b.search, 75, 80)); /* the first one is not done yet */
      rimi_search_take_out(b.search, 0);
      assert_false(rimi_search_exclude(b.search, 75, 80)); /* nor where one channel did it */
      feed(&b, 90, 105, TURN);
      assert_true(rimi_search_best(b.search, 0)->score < 3.0f);
      feed(&b, 105, 150, TURN);
      double onset_sd;
      rimi_search_explain(b.search, 0, &found[k], &onset_sd);
      assert_int_equal(found[k].family, SEARCH_SINCE);
      assert_true(found[k].onset >= 105 && found[k].onset <= 115);
      assert_true(fabs((double)found[k].shift + 4.0) < 3.0 * (double)found[k].sd);
      assert_true(rimi_search_exclude(b.search, 0, 5));
      rimi_search_reset(b.search);
      assert_true(rimi_search_exclude(b.search, 0, 5) == false); /* none is held */
    }
    assert_int_equal(found[0].onset, found[1].onset);
    assert_close((double)found[0].shift, (double)found[1].shift, 1e-4);
    assert_close((double)found[0].ln_ratio, (double)found[1].ln_ratio, 1e-2);
  }
}

static void a_shift_within_an_interval_is_found(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    for (int sign = -1; sign <= 1; sign += 2) {
      world w = world_variant(v, 150);
      for (uint32_t i = 0; i < w.blocks; ++i)
        w.r[i] += w.feature[i][1] >= 160 ? sign * 4.0 * w.s : 0.0;
      double onset_sd;
      const search_hypothesis h = find_planted(&w, 150, &onset_sd);
      assert_true(h.family == SEARCH_INTERVAL && h.feature[0] == 1);
      assert_true(h.first[0] >= 14 && h.first[0] <= 16 && h.last[0] == SEARCH_BINS - 1);
      assert_true(h.onset == SEARCH_FROM_START && onset_sd == 0.0);
      assert_true(fabs((double)h.shift - sign * 4.0) < 3.0 * (double)h.sd);
    }
  }
}

static void the_rest_beside_a_region_is_found(void **state) {
  (void)state;
  world w = world_variant(1, 150);
  for (uint32_t i = 0; i < w.blocks; ++i)
    w.r[i] += w.feature[i][1] >= 160 ? 4.0 * w.s : 0.0;
  static bench b;
  start(&b, &w, 150);
  feed(&b, 0, w.blocks, TURN);
  search_hypothesis h, box = {.family = SEARCH_BOX, .feature = {1}, .last = {14, SEARCH_BINS - 1}};
  assert_true(rimi_search_beside(b.search, 0, &box, &h) && h.family == SEARCH_INTERVAL);
  assert_true(h.feature[0] == 1 && h.first[0] >= 14 && h.last[0] == SEARCH_BINS - 1);
  assert_true(h.first[0] <= 16 && fabs((double)h.shift - 4.0) < 1.0);
  box.family = SEARCH_SINCE;
  assert_false(rimi_search_beside(b.search, 0, &box, &h));
}

/* A region over the reading itself would select on its own noise. */
static void an_outcomes_own_reading_describes_no_region_of_it(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    for (uint32_t own = 0; own < 2; ++own) {
      world w = world_variant(v, 150);
      for (uint32_t i = 0; i < w.blocks; ++i)
        w.r[i] += w.feature[i][1] >= 160 ? 4.0 * w.s : 0.0;
      static bench b;
      bytes region = {.size = 0}, outcome = {.size = 0};
      for (uint32_t f = 0; f < FEATURES; ++f) { /* of the image: the region's features and 7 more */
        u16(&region, f + 7);
        u16(&region, SEARCH_AS_MEASURED);
      }
      for (uint32_t o = 0; o < OUTCOMES; ++o)
        u16(&outcome, own != 0 && o == 0 ? 8 : 0);
      start(&b, &w, 150);
      b.config.region = region.byte;
      b.config.outcome_feature = outcome.byte;
      rimi_search_attach(b.search, &b.config);
      feed(&b, 0, 150, TURN);
      const search_hypothesis *best = rimi_search_best(b.search, 0);
      const bool names = best->family >= SEARCH_INTERVAL && best->family != SEARCH_DURING &&
                         (best->feature[0] == 1 || best->feature[1] == 1);
      assert_int_equal(names, own == 0);
      put_u16(region.byte + 6, 0); /* a prediction stands for it: then it may */
      rimi_search_work(b.search, 400);
      assert_true(rimi_search_best(b.search, 0)->feature[0] == 1);
    }
  }
}

static void a_shift_within_a_box_is_found(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_STEADY; ++v) {
    for (int since = 0; since < 2; ++since) {
      world w = world_variant(v, 150);
      for (uint32_t i = since ? 50 : 0; i < w.blocks; ++i)
        w.r[i] -= w.feature[i][0] < 128 && w.feature[i][2] >= 107 ? 4.0 * w.s : 0.0;
      double onset_sd;
      const search_hypothesis h = find_planted(&w, 150, &onset_sd);
      assert_int_equal(h.family, since ? SEARCH_BOX_SINCE : SEARCH_BOX);
      assert_true(h.feature[0] == 0 && h.feature[1] == 2);
      assert_true(h.first[0] <= 1 && h.last[0] >= 10 && h.last[0] <= 12);
      assert_true(h.first[1] >= 9 && h.first[1] <= 11 && h.last[1] >= 22);
      if (since) { /* at most two visits too early or too late */
        search_hypothesis other = h;
        other.onset = 50;
        assert_true(abs((int)blocks_inside(&w, &other) - (int)blocks_inside(&w, &h)) <= 2);
        assert_true(onset_sd > 0.2);
      }
      assert_true(fabs((double)h.shift + 4.0) < 3.0 * (double)h.sd);
    }
  }
}

static void a_shift_within_an_interval_since_is_found(void **state) {
  (void)state;
  for (uint32_t v = 0; v < WORLD_VARIANTS; ++v) {
    world w = world_variant(v, 150);
    for (uint32_t i = 70; i < w.blocks; ++i)
      w.r[i] += w.feature[i][2] < 107 ? 4.0 * w.s : 0.0;
    double onset_sd;
    const search_hypothesis h = find_planted(&w, 150, &onset_sd);
    assert_int_equal(h.family, SEARCH_INTERVAL_SINCE);
    assert_true(h.feature[0] == 2 && h.first[0] == 0 && h.last[0] >= 8 && h.last[0] <= 10);
    assert_true(h.onset >= 64 && h.onset <= 76);
    assert_true(fabs((double)h.shift - 4.0) < 3.0 * (double)h.sd);
  }
}

/* ---- features of no use, and too few blocks ---- */

static void a_constant_feature_restricts_nothing(void **state) {
  (void)state;
  world w = world_variant(1, 150);
  for (uint32_t i = 0; i < w.blocks; ++i) {
    w.feature[i][0] = 255;
    w.feature[i][1] = 0;
    w.r[i] += i >= 90 ? 3.0 * w.s : 0.0;
  }
  bench b;
  start(&b, &w, 150);
  feed(&b, 0, w.blocks, TURN);
  search_hypothesis h;
  memset(&h, 0, sizeof h);
  search_mask everything;
  memset(&everything, 0, sizeof everything);
  for (uint32_t f = 0; f < 2; ++f) {
    rimi_search_refresh(b.search, 0);
    h.family = SEARCH_INTERVAL;
    h.onset = SEARCH_FROM_START;
    rimi_search_scan_interval(b.search, &everything, f, &h, 0);
    assert_true(h.first[0] == 0 && h.last[0] == SEARCH_BINS - 1);
    assert_int_equal(h.blocks, w.blocks);
  }
  double onset_sd;
  const search_hypothesis found = find_planted(&w, 150, &onset_sd);
  assert_int_equal(found.family, SEARCH_SINCE);
}

static void start_far_off(bench *b) {
  world w = world_variant(0, RING);
  for (uint32_t i = 0; i < RING; ++i)
    w.r[i] = 50.0 * w.s;
  start(b, &w, RING);
}

static void nothing_is_said_of_too_few_blocks(void **state) {
  (void)state;
  bench b;
  start_far_off(&b);
  rimi_search_work(b.search, 100);
  assert_true(rimi_search_time_of(b.search, 0) == 0.0);
  feed(&b, 0, 2 * SEARCH_LEAST - 1, TURN);
  for (uint32_t c = 0; c < CHANNELS; ++c)
    assert_true(rimi_search_best(b.search, c)->score < -1e9f);
  feed(&b, 2 * SEARCH_LEAST - 1, 2 * SEARCH_LEAST, TURN);
  assert_true(rimi_search_best(b.search, 0)->score > 100.0f);
  search_hypothesis h = hypothesis(SEARCH_INTERVAL, SEARCH_FROM_START);
  h.feature[0] = 0; /* an interval that holds no block */
  h.first[0] = h.last[0] = 0;
  for (uint32_t i = 0; i < 2 * SEARCH_LEAST; ++i)
    while (b.w.feature[i][0] < 256u / SEARCH_BINS * 1u + 1u && h.first[0] == 0)
      h.first[0] = h.last[0] = SEARCH_BINS - 1;
  rimi_search_refresh(b.search, 0);
  rimi_search_evaluate(b.search, &h);
  assert_true(h.blocks < SEARCH_LEAST && h.score < -1e9f && h.shift == 0.0f);
}

/* A channel that is not active is never looked at. */
static void inactive_channels_are_left_out(void **state) {
  (void)state;
  bench b;
  start_far_off(&b);
  put_f32(b.section.byte + 4 * NOISE_HEADER_WORDS, 0.0);
  feed(&b, 0, RING, TURN);
  for (uint32_t c = 0; c < CHANNELS; ++c)
    assert_true(rimi_search_best(b.search, c)->score < 10.0f);
}

/* ---- what is kept ---- */

/* To half a step; of a block that does not adjoin, NOISE_APART. */
static void the_activity_is_kept(void **state) {
  (void)state;
  const world w = world_variant(3, RING);
  static bench b;
  start(&b, &w, RING);
  for (uint32_t i = 0; i < 20; ++i) {
    double outcome[CHANNELS], residual[CHANNELS];
    search_block block = block_of(&w, i, outcome, residual);
    block.apart = i == 9;
    assert_int_equal(rimi_search_observe(b.search, &block), RIM_OK);
    assert_true((double)search_activities(b.search)[i] * SEARCH_ACTIVITY_STEP ==
                (block.apart ? NOISE_APART : activity(&w, i)));
  }
  rimi_search_reset(b.search);
  feed(&b, 0, 1, 0);
  assert_true((double)search_activities(b.search)[0] * SEARCH_ACTIVITY_STEP == NOISE_APART);
}

static void numbers_that_are_not_finite_change_nothing(void **state) {
  (void)state;
  const double bad[2] = {rimi_from_bits(UINT64_C(0x7ff8000000000000)),
                         rimi_from_bits(UINT64_C(0xfff0000000000000))};
  const world w = world_variant(3, RING);
  static bench b, before;
  start(&b, &w, RING);
  feed(&b, 0, 20, TURN);
  before = b;
  for (size_t k = 0; k < 2; ++k) {
    for (uint32_t which = 0; which < 5; ++which) {
      double outcome[CHANNELS], residual[CHANNELS];
      double mean[MEANS] = {which == 0 ? bad[k] : 0.0};
      search_block block = block_of(&w, 20, outcome, residual);
      block.mean = mean;
      outcome[2 * OUTCOMES - 1] = which == 1 ? bad[k] : outcome[0];
      residual[CHANNELS - 1] = which == 2 ? bad[k] : 0.0;
      block.t_s = which == 3 ? bad[k] : block.t_s;
      block.disturbance = which == 4 ? bad[k] : 0.0;
      assert_int_equal(rimi_search_observe(b.search, &block), RIM_E_DATA);
    }
  }
  assert_memory_equal(b.memory, before.memory, sizeof b.memory);
}

/* Absurd, but finite: clipped, and nothing but finite numbers come out. */
static void huge_residuals_do_no_harm(void **state) {
  (void)state;
  world w = world_variant(7, 150);
  for (uint32_t i = 50; i < w.blocks; ++i)
    w.r[i] = i % 3 == 0 ? -1e300 : 1e300;
  bench b;
  start(&b, &w, RING);
  feed(&b, 0, w.blocks, TURN);
  search_hypothesis h;
  double onset_sd;
  rimi_search_explain(b.search, 0, &h, &onset_sd);
  assert_true(isfinite((double)h.score) && isfinite((double)h.shift) && h.sd > 0.0f);
  assert_true(isfinite(onset_sd));
}

/* ---- the same again ---- */

static uint64_t digest_of(const rim_search *s) {
  uint64_t digest = RIM_DIGEST_START;
  for (uint32_t c = 0; c < CHANNELS; ++c) {
    const search_hypothesis *h = rimi_search_best(s, c);
    const float numbers[4] = {h->ln_ratio, h->score, h->shift, h->sd};
    for (size_t i = 0; i < 4; ++i)
      digest = rimi_digest_f64(digest, (double)numbers[i]);
    digest = rimi_digest_u32(digest, h->onset);
    digest = rimi_digest_u32(digest, h->family | (uint32_t)h->feature[0] << 8 |
                                         (uint32_t)h->first[0] << 16 | (uint32_t)h->last[0] << 24);
  }
  return digest;
}

static void a_copy_goes_on_bit_for_bit(void **state) {
  (void)state;
  const world w = world_variant(7, 150);
  static bench whole, first, second;
  start(&whole, &w, RING);
  start(&first, &w, RING);
  start(&second, &w, RING);
  feed(&whole, 0, 83, 5); /* in the midst of a channel's turn */
  feed(&first, 0, 83, 5);
  memcpy(second.memory, first.memory, sizeof second.memory);
  memset(&first, 0xee, sizeof first);
  second.search = (rim_search *)(void *)second.memory;
  rimi_search_attach(second.search, &second.config);
  feed(&whole, 83, 150, 5);
  feed(&second, 83, 150, 5);
  assert_true(digest_of(whole.search) == digest_of(second.search));
  search_hypothesis a, b;
  double sd_a, sd_b;
  rimi_search_explain(whole.search, 0, &a, &sd_a);
  rimi_search_explain(second.search, 0, &b, &sd_b);
  assert_true(a.score == b.score && a.onset == b.onset && sd_a == sd_b);
}

static void reset_is_a_fresh_start(void **state) {
  (void)state;
  const world w = world_variant(7, 150);
  static bench fresh, used;
  start(&fresh, &w, RING);
  start(&used, &w, RING);
  feed(&used, 20, 101, 7);
  rimi_search_reset(used.search);
  assert_int_equal(rimi_search_blocks(used.search), 0);
  feed(&fresh, 0, 150, 5);
  feed(&used, 0, 150, 5);
  assert_true(digest_of(fresh.search) == digest_of(used.search));
}

/* What integrates a sensor drifts by a thousand times its noise, and goes on doing so. */
static void a_drift_of_a_thousand_sd_goes_on(void **state) {
  (void)state;
  static bench b;
  for (uint32_t seed = 0; seed < 4; ++seed) {
    world w = make_world(true, 0.5, 0.0);
    draw(&w, 150, seed);
    const double slope = seed % 2 == 0 ? 10.0 : -10.0;
    for (uint32_t i = 40; i < w.blocks; ++i)
      w.r[i] += slope * w.s * (double)(i - 40);
    start(&b, &w, 150);
    feed(&b, 0, 150, 0);
    search_hypothesis h = {.family = SEARCH_RAMP, .onset = 40};
    assert_true(rimi_search_evaluate_channel(b.search, 0, &h));
    assert_true(fabs((double)h.shift / (256.0 * slope) - 1.0) < 0.05);
  }
}

/* Made by this very function. Whoever changes what is found changes this, and says so. */
static void findings_have_not_changed(void **state) {
  (void)state;
  world w = world_variant(7, 150);
  for (uint32_t i = 90; i < w.blocks; ++i)
    w.r[i] += w.feature[i][0] < 128 ? w.s : 0.0;
  static bench b;
  start(&b, &w, RING);
  uint64_t digest = RIM_DIGEST_START;
  for (uint32_t i = 0; i < w.blocks; ++i) {
    feed(&b, i, i + 1, 3);
    digest = rimi_digest_u32(digest, (uint32_t)digest_of(b.search));
  }
  print_message("digest %016llx\n", (unsigned long long)digest);
  assert_true(digest == UINT64_C(0x12401d10c1da3351));
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(regions_are_judged_by_least_squares),
      cmocka_unit_test(gaps_are_judged_by_least_squares),
      cmocka_unit_test(unknown_blocks_say_nothing),
      cmocka_unit_test(the_best_interval_is_the_best_of_all),
      cmocka_unit_test(onsets_are_judged_by_least_squares),
      cmocka_unit_test(impossible_run_effects_are_told),
      cmocka_unit_test(phi_divides_the_ratio),
      cmocka_unit_test(a_full_ring_goes_on),
      cmocka_unit_test(what_ended_is_judged_by_least_squares),
      cmocka_unit_test(a_shift_since_a_time_is_found),
      cmocka_unit_test(a_shift_that_ended_is_found),
      cmocka_unit_test(excluded_blocks_are_no_evidence),
      cmocka_unit_test(a_shift_within_an_interval_is_found),
      cmocka_unit_test(the_rest_beside_a_region_is_found),
      cmocka_unit_test(an_outcomes_own_reading_describes_no_region_of_it),
      cmocka_unit_test(a_shift_within_a_box_is_found),
      cmocka_unit_test(a_shift_within_an_interval_since_is_found),
      cmocka_unit_test(a_constant_feature_restricts_nothing),
      cmocka_unit_test(nothing_is_said_of_too_few_blocks),
      cmocka_unit_test(inactive_channels_are_left_out),
      cmocka_unit_test(numbers_that_are_not_finite_change_nothing),
      cmocka_unit_test(the_activity_is_kept),

      cmocka_unit_test(huge_residuals_do_no_harm),
      cmocka_unit_test(a_copy_goes_on_bit_for_bit),
      cmocka_unit_test(reset_is_a_fresh_start),
      cmocka_unit_test(a_drift_of_a_thousand_sd_goes_on),
      cmocka_unit_test(findings_have_not_changed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
