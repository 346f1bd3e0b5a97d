/* SPDX-License-Identifier: MIT */
/* extent: a hidden region is found and bracketed, eq. 5.6 to 5.12 hold term by term, and attacks.
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
#include "base/rng.h"
#include "rim/plan/extent.h"
#include "search/cem.h"

#define SEED 52u
enum { DIMS = 2, POINTS = 120, LAMBDAS = 9, RIMS = 2 };
#define BYTES RIM_EXTENT_SIZE(DIMS, POINTS, LAMBDAS, RIMS)

typedef struct block {
  _Alignas(8) uint8_t bytes[BYTES + 8];
} block;

static rim_rng rng;
static block memory, other;
static double x[POINTS][DIMS], dz[POINTS];
#define VAR 0.04

static void assert_near(double a, double b, double tolerance) {
  if (!(fabs(a - b) <= tolerance * (1.0 + fabs(b)))) {
    print_error("%.17g is not %.17g\n", a, b);
    fail();
  }
}

static rim_extent_config config_of(uint8_t rims) {
  const rim_extent_config c = {.dims = DIMS,
                               .points = POINTS,
                               .lambdas = LAMBDAS,
                               .rims = rims,
                               .lower = {-1.0, 10.0},
                               .upper = {1.0, 20.0},
                               .seed = SEED};
  return c;
}

static rim_extent *make(block *b, const rim_extent_config *c) {
  rim_extent *e = NULL;
  assert_int_equal(rim_extent_init(&e, b->bytes, BYTES, c), RIM_OK);
  return e;
}

static bool in_first(const double *p) {
  const double a = (p[0] + 0.4) / 0.35, b = (p[1] - 14.0) / 2.0;
  return a * a + b * b < 1.0;
}
static bool in_second(const double *p) {
  const double a = (p[0] - 0.6) / 0.3, b = (p[1] - 17.5) / 1.6;
  return a * a + b * b < 1.0;
}

static void draw(double first, double second) {
  for (int i = 0; i < POINTS; ++i) {
    x[i][0] = -1.0 + 2.0 * rimi_rng_uniform(&rng);
    x[i][1] = 10.0 + 10.0 * rimi_rng_uniform(&rng);
    dz[i] = sqrt(VAR) * rimi_rng_normal(&rng) + (in_first(x[i]) ? first : 0.0) +
            (in_second(x[i]) ? second : 0.0);
  }
}

static void fill(rim_extent *e, int from, int to) {
  for (int i = from; i < to; ++i) {
    assert_int_equal(rim_extent_add(e, x[i], dz[i], VAR), RIM_OK);
  }
}

static bool inside(const rim_extent_region *region, const double *p) {
  const double u[DIMS] = {(p[0] + 1.0) / 2.0, (p[1] - 10.0) / 10.0};
  rim_ellipsoid e = {.dims = region->dims};
  memcpy(e.center, region->center, sizeof region->center);
  memcpy(e.factor, region->factor, sizeof region->factor);
  return rimi_ellipsoid_contains(&e, u);
}

static void finds_a_hidden_region(void **state) {
  (void)state;
  double f1 = 0.0;
  for (int run = 0; run < 5; ++run) {
    const rim_extent_config c = config_of(1);
    rim_extent *e = make(&memory, &c);
    draw(0.8, 0.0);
    fill(e, 0, POINTS);
    rim_extent_search(e, 3 * LAMBDAS);
    double hit = 0.0, said = 0.0, truth = 0.0;
    for (int k = 0; k < 2000; ++k) {
      const double p[DIMS] = {-1.0 + 2.0 * rimi_rng_uniform(&rng),
                              10.0 + 10.0 * rimi_rng_uniform(&rng)};
      const rim_extent_local at = rim_extent_at(e, 0, p);
      const bool yes = at.existence * at.member > 0.5;
      hit += yes && in_first(p);
      said += yes;
      truth += in_first(p);
    }
    f1 += 2.0 * hit / (said + truth) / 5.0;
    const double middle[DIMS] = {-0.4, 14.0}, far[DIMS] = {0.9, 19.0};
    const rim_extent_local at = rim_extent_at(e, 0, middle);
    assert_true(at.existence > 0.99 && at.member > 0.9);
    assert_true(fabs(at.shift - 0.8) < 4.0 * sqrt(at.shift_var) + 0.1);
    assert_true(rim_extent_at(e, 0, far).member < 0.1);
  }
  print_message("F1 of the area %.3f\n", f1);
  assert_true(f1 > 0.75);
}

/* Larger lambda, larger region; each maximises its own anom+ among the set (eq. 5.3 to 5.5). */
static void set_runs_from_specific_to_general(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *e = make(&memory, &c);
  draw(0.8, 0.0);
  fill(e, 0, POINTS);
  rim_extent_search(e, 6 * LAMBDAS);
  rim_extent_search(e, LAMBDAS * 3); /* whole turns: every lambda has adopted what others found */
  rim_extent_region r[LAMBDAS];
  for (uint32_t i = 0; i < LAMBDAS; ++i) {
    assert_int_equal(rim_extent_get_region(e, 0, i, &r[i]), RIM_OK);
    assert_near(r[i].lambda, -16.0 + 4.0 * i, 1e-15);
  }
  assert_true(r[LAMBDAS - 1].volume > r[0].volume);
  assert_true(r[0].ln_anom > 30.0 && r[LAMBDAS - 1].ln_anom > 30.0);
  assert_int_equal(rim_extent_get_region(e, 0, LAMBDAS, &r[0]), RIM_E_RANGE);
  assert_int_equal(rim_extent_get_region(e, 1, 0, &r[0]), RIM_E_RANGE);
}

/* Statistics of a region and of a place, from the observations in the plainest way. */
static void equations_hold_term_by_term(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *e = make(&memory, &c);
  draw(0.5, 0.0);
  fill(e, 0, POINTS);
  rim_extent_search(e, 2 * LAMBDAS);
  rim_extent_region r[LAMBDAS];
  for (uint32_t i = 0; i < LAMBDAS; ++i) {
    (void)rim_extent_get_region(e, 0, i, &r[i]);
    double n = 0.0, s = 0.0, square = 0.0;
    for (int k = 0; k < POINTS; ++k) {
      n += inside(&r[i], x[k]);
      s += inside(&r[i], x[k]) ? dz[k] : 0.0;
    }
    for (int k = 0; k < POINTS; ++k) {
      if (inside(&r[i], x[k]))
        square += pow(dz[k] - s / n, 2.0);
    }
    assert_near(r[i].n, n, 0.0);
    assert_near(r[i].ln_anom, s * s / (2.0 * n * VAR), 1e-12);
    assert_near(r[i].shift, s / n, 1e-12);
    assert_near(r[i].shift_var, (square + VAR) / (n * n), 1e-12);
    assert_near(r[i].confidence, 1.0 / (1.0 + exp(7.0 - r[i].ln_anom)), 1e-12);
  }
  for (int k = 0; k < 300; ++k) {
    const double p[DIMS] = {-1.0 + 2.0 * rimi_rng_uniform(&rng),
                            10.0 + 10.0 * rimi_rng_uniform(&rng)};
    double all = 0.0, in = 0.0, shift = 0.0, var = 0.0, most = 0.0;
    for (uint32_t i = 0; i < LAMBDAS; ++i) {
      all += r[i].confidence;
      most = fmax(most, r[i].confidence);
      if (!inside(&r[i], p))
        continue;
      in += r[i].confidence;
      shift += r[i].confidence * r[i].shift;
      var += r[i].confidence * r[i].shift_var;
    }
    const double w = most * in / all, mu0 = 0.3, var0 = 0.01;
    const double mu1 = mu0 + (in > 0.0 ? shift / in : 0.0);
    const double var1 = var0 + (in > 0.0 ? var / in : 0.0);
    const double mu = (1.0 - w) * mu0 + w * mu1;
    const double spread = (1.0 - w) * (pow(mu0 - mu, 2.0) + var0) + w * (pow(mu1 - mu, 2.0) + var1);
    const rim_extent_mixture m = rim_extent_reward(e, p, mu0, var0);
    double mean, variance;
    rim_extent_moments(&m, &mean, &variance);
    assert_int_equal(m.components, 2);
    assert_near(m.weight[0] + m.weight[1], 1.0, 1e-15);
    assert_near(mean, mu, 1e-12);
    assert_near(variance, spread, 1e-12);
    assert_near(rim_extent_correction(e, p), mu - mu0, 1e-12);
  }
}

/* P(x in R) of the chains, untempered, against the posterior summed over all intervals. */
static void sample_follows_the_posterior(void **state) {
  (void)state;
  enum { GRID = 400, AT = 9, ROUNDS = 1500 };
  rim_extent_config c = {.dims = 1,
                         .points = POINTS,
                         .lambdas = LAMBDAS,
                         .set = RIM_EXTENT_SAMPLED,
                         .temper = 1.0,
                         .lambda_min = 3.0,
                         .lambda_max = 3.0,
                         .min_points = 1.0,
                         .threshold = -50.0, /* each region weighs the same */
                         .seed = SEED};
  rim_extent *e = make(&memory, &c);
  enum { SHOTS = 14 };
  double at[SHOTS], off[SHOTS];
  for (int i = 0; i < SHOTS; ++i) {
    at[i] = (i + 0.5) / SHOTS;
    off[i] = 0.1 * rimi_rng_normal(&rng) + (at[i] > 0.3 && at[i] < 0.7 ? 0.35 : 0.0);
    assert_int_equal(rim_extent_add(e, &at[i], off[i], VAR), RIM_OK);
  }
  double inside_of[AT] = {0}, all = 0.0;
  for (int i = 0; i < GRID; ++i) {
    for (int j = 0; j < GRID; ++j) {
      const double centre = (i + 0.5) / GRID, half = 0.04 + 0.56 * (j + 0.5) / GRID;
      double n = 0.0, sum = 0.0;
      for (int k = 0; k < SHOTS; ++k) {
        n += fabs(at[k] - centre) < half;
        sum += fabs(at[k] - centre) < half ? off[k] : 0.0;
      }
      if (n < 1.0)
        continue;
      const double p = exp(sum * sum / (2.0 * n * VAR) + 3.0 * fmin(2.0 * half, 1.0));
      all += p;
      for (int k = 0; k < AT; ++k)
        inside_of[k] += fabs(0.1 * (k + 1) - centre) < half ? p : 0.0;
    }
  }
  rim_extent_search(e, 30 * LAMBDAS);
  double said[AT] = {0};
  for (int round = 0; round < ROUNDS; ++round) {
    rim_extent_search(e, LAMBDAS);
    for (int k = 0; k < AT; ++k)
      said[k] += rim_extent_at(e, 0, (double[]){0.1 * (k + 1)}).member / ROUNDS;
  }
  for (int k = 0; k < AT; ++k) {
    print_message("P(%.1f in R) %.3f, of the chains %.3f\n", 0.1 * (k + 1), inside_of[k] / all,
                  said[k]);
    assert_true(fabs(said[k] - inside_of[k] / all) < 0.03);
  }
}

/* A box is found as one: its corners too, which no ellipsoid in it reaches. */
static void boxes_reach_into_corners(void **state) {
  (void)state;
  rim_extent_config c = config_of(1);
  c.shape = RIM_EXTENT_BOX;
  c.set = RIM_EXTENT_SAMPLED;
  rim_extent *e = make(&memory, &c);
  draw(0.0, 0.0);
  for (int i = 0; i < POINTS; ++i) /* a parallelogram */
    dz[i] += fabs(x[i][0]) < 0.6 && fabs(x[i][1] - 15.0 - 2.0 * x[i][0]) < 2.0 ? 1.0 : 0.0;
  fill(e, 0, POINTS);
  rim_extent_search(e, 30 * LAMBDAS);
  for (uint32_t i = 0; i < LAMBDAS; ++i) {
    rim_extent_region r;
    (void)rim_extent_get_region(e, 0, i, &r);
    const double *l = r.factor;
    double n = 0.0, of_ball = 0.0;
    for (int k = 0; k < POINTS; ++k) {
      const double u = ((x[k][0] + 1.0) / 2.0 - r.center[0]) / l[0];
      const double v = ((x[k][1] - 10.0) / 10.0 - r.center[1] - l[1] * u) / l[2];
      n += fmax(fabs(u), fabs(v)) < 1.0;
      of_ball += u * u + v * v < 1.0;
    }
    assert_near(r.n, n, 0.0);
    assert_true(n > of_ball);
    assert_near(r.volume, 4.0 * l[0] * l[2], 1e-15);
  }
  const double corner[DIMS] = {0.5, 17.6}, beyond[DIMS] = {0.5, 13.0};
  assert_true(rim_extent_at(e, 0, corner).member > 0.5);
  assert_true(rim_extent_at(e, 0, beyond).member < 0.5);
}

/* What is known of a region's size holds for all that is found, in each dimension. */
static void sizes_stay_within_bounds(void **state) {
  (void)state;
  for (uint8_t set = RIM_EXTENT_BY_VOLUME; set <= RIM_EXTENT_SAMPLED; ++set) {
    rim_extent_config c = config_of(1);
    c.set = set;
    c.least_axis[0] = 0.25;
    c.most_axis[1] = 0.1;
    rim_extent *e = make(&memory, &c);
    draw(0.8, 0.0); /* half as wide, twice as high */
    fill(e, 0, POINTS);
    for (int round = 0; round < 20; ++round) {
      rim_extent_search(e, LAMBDAS);
      for (uint32_t i = 0; i < LAMBDAS; ++i) {
        rim_extent_region r;
        (void)rim_extent_get_region(e, 0, i, &r);
        const double *l = r.factor;
        assert_true(r.ln_anom > 0.0);
        assert_true(l[0] >= 0.25 && l[0] <= 0.6 && l[2] >= 0.04 && l[2] <= 0.1);
        assert_true(set == RIM_EXTENT_BY_VOLUME || fabs(l[1]) <= 0.1);
      }
    }
  }
}

static void noise_makes_no_rim(void **state) {
  (void)state;
  int sure = 0;
  for (int run = 0; run < 20; ++run) {
    const rim_extent_config c = config_of(1);
    rim_extent *e = make(&memory, &c);
    draw(0.0, 0.0);
    fill(e, 0, POINTS);
    rim_extent_search(e, LAMBDAS);
    sure += rim_extent_at(e, 0, x[0]).existence > 0.9;
  }
  print_message("noise alone: %d of 20 runs sure of a RIM\n", sure);
  assert_true(sure <= 4);
}

static void two_rims_share(void **state) {
  (void)state;
  const rim_extent_config c = config_of(2);
  rim_extent *e = make(&memory, &c);
  draw(0.9, -0.9);
  fill(e, 0, POINTS);
  rim_extent_search(e, 2 * 3 * LAMBDAS);
  const double first[DIMS] = {-0.4, 14.0}, second[DIMS] = {0.6, 17.5};
  assert_near(rim_extent_correction(e, first), 0.9, 0.12);
  assert_near(rim_extent_correction(e, second), -0.9, 0.12);
  const rim_extent_mixture m = rim_extent_reward(e, first, 0.0, 0.0);
  assert_int_equal(m.components, 3);
  assert_near(m.weight[0] + m.weight[1] + m.weight[2], 1.0, 1e-15);
}

static void search_never_loses(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *e = make(&memory, &c);
  draw(0.4, 0.2);
  fill(e, 0, POINTS);
  double before[LAMBDAS] = {0};
  for (int round = 0; round < 40; ++round) {
    rim_extent_search(e, 1);
    for (uint32_t i = 0; i < LAMBDAS; ++i) {
      rim_extent_region r;
      (void)rim_extent_get_region(e, 0, i, &r);
      const double value = r.ln_anom > 0.0 ? r.ln_anom + r.lambda * r.volume : -1e9;
      assert_true(round == 0 || value >= before[i]);
      before[i] = value;
    }
  }
}

static void oldest_makes_room(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *e = make(&memory, &c);
  draw(0.9, 0.0);
  fill(e, 0, POINTS);
  rim_extent_search(e, 2 * LAMBDAS);
  assert_true(rim_extent_at(e, 0, (double[]){-0.4, 14.0}).existence > 0.9);
  draw(0.0, 0.0);
  fill(e, 0, POINTS);
  assert_int_equal(rim_extent_points(e), POINTS);
  assert_int_equal(rim_extent_get_counters(e).replaced, POINTS);
  assert_int_equal(rim_extent_get_counters(e).added, 2 * POINTS);
  assert_true(rim_extent_at(e, 0, (double[]){-0.4, 14.0}).existence < 0.5);
}

static void confidence_by_knots(void **state) {
  (void)state;
  rim_extent_config c = config_of(1);
  c.knots = 3;
  const double at[] = {2.0, 4.0, 10.0}, p[] = {0.0, 0.5, 0.98};
  memcpy(c.ln_anom, at, sizeof at);
  memcpy(c.confidence, p, sizeof p);
  const rim_extent *e = make(&memory, &c);
  assert_near(rim_extent_confidence(e, -1.0), 0.0, 0.0);
  assert_near(rim_extent_confidence(e, 3.0), 0.25, 1e-15);
  assert_near(rim_extent_confidence(e, 7.0), 0.74, 1e-15);
  assert_near(rim_extent_confidence(e, 99.0), 0.98, 0.0);
  rim_extent *bad = NULL;
  c.ln_anom[2] = 4.0;
  assert_int_equal(rim_extent_init(&bad, memory.bytes, BYTES, &c), RIM_E_CONFIG);
  c.ln_anom[2] = NAN;
  assert_int_equal(rim_extent_init(&bad, memory.bytes, BYTES, &c), RIM_E_RANGE);
  c.knots = 1;
  assert_int_equal(rim_extent_init(&bad, memory.bytes, BYTES, &c), RIM_E_CONFIG);
}

static void bad_numbers_are_counted(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *e = make(&memory, &c);
  rim_extent_search(e, 5); /* nothing to search in */
  fill(e, 0, 10);
  other = memory;
  const double bad[] = {NAN, INFINITY, -INFINITY};
  for (int i = 0; i < 3; ++i) {
    const double at[DIMS] = {bad[i], 15.0};
    assert_int_equal(rim_extent_add(e, at, 0.0, VAR), RIM_E_DATA);
    assert_int_equal(rim_extent_add(e, x[0], bad[i], VAR), RIM_E_DATA);
    assert_int_equal(rim_extent_add(e, x[0], 0.0, bad[i]), RIM_E_DATA);
    assert_true(rim_extent_at(e, 0, at).member == 0.0);
    assert_int_equal(rim_extent_reward(e, at, 1.0, 2.0).components, 1);
  }
  assert_int_equal(rim_extent_add(e, x[0], 0.0, 0.0), RIM_E_DATA);
  assert_int_equal(rim_extent_get_counters(e).refused, 10);
  assert_int_equal(rim_extent_points(e), 10);
  static const double ends[2] = {1e-100, 1e100}; /* variances that can be divided by */
  for (int i = 0; i < 2; ++i) {
    assert_int_equal(rim_extent_add(e, x[0], 0.0, ends[i]), RIM_OK);
    assert_int_equal(rim_extent_add(e, x[0], 0.0, i == 0 ? 0.5e-100 : 2e100), RIM_E_DATA);
  }
  assert_int_equal(rim_extent_get_counters(e).refused, 12);
  assert_int_equal(rim_extent_points(e), 12);
}

static void misuse_is_refused(void **state) {
  (void)state;
  const rim_extent_config good = config_of(RIMS);
  rim_extent *e = NULL;
  memset(&memory, 0x5a, sizeof memory);
  assert_int_equal(rim_extent_init(&e, memory.bytes, BYTES - 1, &good), RIM_E_SIZE);
  const rim_extent_config most = config_of(RIM_EXTENT_MAX_RIMS),
                          more = config_of(RIM_EXTENT_MAX_RIMS + 1);
  assert_int_equal(rim_extent_init(&e, memory.bytes, 8, &most), RIM_E_SIZE);
  assert_int_not_equal(rim_extent_init(&e, memory.bytes, 8, &more), RIM_E_SIZE);
  assert_int_equal(rim_extent_init(&e, memory.bytes + 1, BYTES, &good), RIM_E_ALIGN);
  assert_int_equal(rim_extent_init(&e, NULL, BYTES, &good), RIM_E_ARGUMENT);
  rim_extent_config c[11];
  for (int i = 0; i < 11; ++i)
    c[i] = good;
  c[0].dims = 5;
  c[1].points = 7;
  c[2].lambdas = 17;
  c[3].rims = 4;
  c[4].upper[0] = -1.0;
  c[5].least_axis[1] = 0.7;
  c[6].lambda_min = 20.0;
  c[7].samples = 65;
  c[8].set = RIM_EXTENT_SAMPLED + 1;
  c[9].shape = RIM_EXTENT_BOX + 1;
  c[10].temper = 1.5;
  for (int i = 0; i < 11; ++i) {
    assert_int_equal(rim_extent_init(&e, memory.bytes, BYTES, &c[i]), RIM_E_CONFIG);
  }
  for (size_t i = 0; i < sizeof memory.bytes; ++i)
    assert_int_equal(memory.bytes[i], 0x5a);
  assert_null(e);
  e = make(&memory, &good);
  draw(0.5, -0.5);
  for (int round = 0; round < 2; ++round) {
    fill(e, 0, POINTS);
    rim_extent_search(e, 20);
  }
  for (size_t i = BYTES; i < BYTES + 8; ++i)
    assert_int_equal(memory.bytes[i], 0x5a);
}

static uint64_t run(rim_extent *e, int from, int to, uint64_t digest) {
  for (int i = from; i < to; ++i) {
    double mean, var;
    (void)rim_extent_add(e, x[i], dz[i], VAR);
    rim_extent_search(e, 2);
    const rim_extent_mixture m = rim_extent_reward(e, x[(i * 7) % POINTS], 0.1, 0.02);
    rim_extent_moments(&m, &mean, &var);
    digest = rimi_digest_f64(rimi_digest_f64(digest, mean), var);
  }
  return digest;
}

static void moved_memory_goes_on(void **state) {
  (void)state;
  rim_extent_config c = config_of(2);
  c.set = RIM_EXTENT_SAMPLED;
  rim_extent *e = make(&memory, &c);
  draw(0.6, -0.5);
  const uint64_t half = run(e, 0, 60, RIM_DIGEST_START);
  other = memory;
  const uint64_t there = run((rim_extent *)(void *)other.bytes, 60, POINTS, half);
  assert_true(run(e, 60, POINTS, half) == there);
}

/* The same bits on every target and at every optimisation. The inputs use no libm. */
static void digest_is_constant(void **state) {
  (void)state;
  rim_extent_config c = config_of(2);
  rim_rng own;
  rimi_rng_seed(&own, SEED, 7);
  for (int i = 0; i < POINTS; ++i) {
    x[i][0] = -1.0 + 2.0 * rimi_rng_uniform(&own);
    x[i][1] = 10.0 + 10.0 * rimi_rng_uniform(&own);
    dz[i] = 0.2 * rimi_rng_normal(&own) + (in_first(x[i]) ? 0.5 : 0.0);
  }
  static const uint64_t expected[] = {UINT64_C(0xc27b2e871cd71cfd), UINT64_C(0x17ca59273a51d224),
                                      UINT64_C(0x932b99d814d7636b)};
  for (uint8_t i = 0; i < 3; ++i) {
    c.set = i > 0 ? RIM_EXTENT_SAMPLED : RIM_EXTENT_BY_VOLUME;
    c.shape = i > 1 ? RIM_EXTENT_BOX : RIM_EXTENT_ELLIPSOID;
    for (unsigned d = 0; d < DIMS; ++d) { /* the smallest and largest axis, of one dimension each */
      c.least_axis[d] = d == i % DIMS ? 0.03 : 0.3;
      c.most_axis[d] = d == i % DIMS ? 0.6 : 0.7;
    }
    const uint64_t digest = run(make(&memory, &c), 0, POINTS, RIM_DIGEST_START);
    print_message("digest %016llx\n", (unsigned long long)digest);
    assert_true(digest == expected[i]);
  }
}

/* Each dimension has its own largest half axis, and none is held to the first one's. */
static void a_long_region_is_found(void **state) {
  (void)state;
  rim_extent_config c = config_of(1);
  c.least_axis[0] = 0.05;
  c.most_axis[0] = 0.3;
  c.least_axis[1] = 0.05;
  c.most_axis[1] = 0.9;
  rim_rng own;
  rimi_rng_seed(&own, SEED, 8);
  for (int i = 0; i < POINTS; ++i) {
    x[i][0] = -1.0 + 2.0 * rimi_rng_uniform(&own);
    x[i][1] = 10.0 + 10.0 * rimi_rng_uniform(&own);
    dz[i] = 0.1 * rimi_rng_normal(&own) + (fabs(x[i][0]) < 0.2 ? 1.0 : 0.0);
  }
  rim_extent *e = make(&memory, &c);
  fill(e, 0, POINTS);
  rim_extent_search(e, 40);
  const double ends[2][DIMS] = {{0.0, 10.4}, {0.0, 19.6}}, aside[DIMS] = {0.8, 15.0};
  for (int i = 0; i < 2; ++i)
    assert_true(rim_extent_at(e, 0, ends[i]).member > 0.5);
  assert_true(rim_extent_at(e, 0, aside).member < 0.1);
}

/* A place that is a number itself, and no number as a share of so narrow a box. */
static void places_without_a_share(void **state) {
  (void)state;
  rim_extent_config c = config_of(1);
  c.lower[0] = 0.0;
  c.upper[0] = 1e-60;
  rim_extent *e = make(&memory, &c);
  const double far[DIMS] = {1e99, 15.0}, near_by[DIMS] = {5e-61, 15.0};
  assert_int_equal(rim_extent_add(e, far, 1.0, VAR), RIM_E_DATA);
  assert_int_equal(rim_extent_add(e, near_by, 1.0, VAR), RIM_OK);
}

/* Its memory is a function of its configuration: a copy of it says the same everywhere. */
static void what_was_in_memory_before_is_gone(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  memset(memory.bytes, 0, BYTES);
  memset(other.bytes, 0xa5, BYTES);
  (void)make(&memory, &c);
  (void)make(&other, &c);
  assert_memory_equal(memory.bytes, other.bytes, RIM_EXTENT_SIZE(DIMS, POINTS, LAMBDAS, 1));
}

/* What is full forgets its oldest, one for each that comes: then it is as if only the newest had
 * come. */
static void the_oldest_goes(void **state) {
  (void)state;
  const rim_extent_config c = config_of(1);
  rim_extent *all = make(&memory, &c), *newest = make(&other, &c);
  for (int i = 0; i < 3 * POINTS; ++i) {
    const double at[DIMS] = {-1.0 + 2.0 * rimi_rng_uniform(&rng),
                             10.0 + 10.0 * rimi_rng_uniform(&rng)};
    const double off = (i < POINTS ? 3.0 : in_first(at) ? 1.0 : 0.0) + 0.1 * rimi_rng_normal(&rng);
    assert_int_equal(rim_extent_add(all, at, off, VAR), RIM_OK);
    if (i >= 2 * POINTS)
      assert_int_equal(rim_extent_add(newest, at, off, VAR), RIM_OK);
  }
  assert_int_equal(rim_extent_points(all), POINTS);
  rim_extent_search(all, 40);
  rim_extent_search(newest, 40);
  for (uint32_t i = 0; i < LAMBDAS; ++i) {
    rim_extent_region a, b;
    assert_int_equal(rim_extent_get_region(all, 0, i, &a), RIM_OK);
    assert_int_equal(rim_extent_get_region(newest, 0, i, &b), RIM_OK);
    assert_true(a.dims == b.dims && a.n == b.n && a.ln_anom == b.ln_anom && a.shift == b.shift);
    assert_true(a.dims == DIMS && a.shift < 2.0);
  }
}

/* Of as many dimensions as there may be, by volume and sampled, round and with corners; a number
 * behind the last is not looked at. */
static void the_most_dimensions(void **state) {
  (void)state;
  enum { MOST = RIM_EXTENT_MAX_DIMS, FEW = 96, SETS = 3 };
  static _Alignas(8) uint8_t room[RIM_EXTENT_SIZE(MOST, FEW, SETS, 1)];
  for (int which = 0; which < 4; ++which) {
    const rim_extent_config c = {.dims = MOST,
                                 .points = FEW,
                                 .lambdas = SETS,
                                 .set = (uint8_t)(which % 2),
                                 .shape = (uint8_t)(which / 2),
                                 .seed = SEED};
    rim_extent *e = NULL;
    assert_int_equal(rim_extent_init(&e, room, sizeof room, &c), RIM_OK);
    for (int i = 0; i < FEW + 5; ++i) {
      double at[MOST + 1];
      for (int d = 0; d < MOST; ++d)
        at[d] = rimi_rng_uniform(&rng);
      at[MOST] = (double)NAN;
      const double off = (at[0] > 0.4 && at[3] > 0.3 ? 2.0 : 0.0) + 0.05 * rimi_rng_normal(&rng);
      assert_int_equal(rim_extent_add(e, at, off, 0.01), RIM_OK);
      rim_extent_search(e, 1);
    }
    rim_extent_search(e, 12);
    double most = 0.0;
    for (uint32_t i = 0; i < SETS; ++i) {
      rim_extent_region region;
      assert_int_equal(rim_extent_get_region(e, 0, i, &region), RIM_OK);
      assert_int_equal(region.dims, MOST);
      most = fmax(most, region.shift);
    }
    assert_true(most > 1.0);
    const double inside[MOST + 1] = {0.7, 0.5, 0.5, 0.65, (double)NAN};
    assert_true(rim_extent_correction(e, inside) > 0.5);
  }
}

int main(void) {
  printf("seed %u\n", SEED);
  rimi_rng_seed(&rng, SEED, 0);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_oldest_goes),
      cmocka_unit_test(the_most_dimensions),
      cmocka_unit_test(places_without_a_share),
      cmocka_unit_test(finds_a_hidden_region),
      cmocka_unit_test(set_runs_from_specific_to_general),
      cmocka_unit_test(equations_hold_term_by_term),
      cmocka_unit_test(sample_follows_the_posterior),
      cmocka_unit_test(boxes_reach_into_corners),
      cmocka_unit_test(sizes_stay_within_bounds),
      cmocka_unit_test(noise_makes_no_rim),
      cmocka_unit_test(two_rims_share),
      cmocka_unit_test(search_never_loses),
      cmocka_unit_test(what_was_in_memory_before_is_gone),
      cmocka_unit_test(oldest_makes_room),
      cmocka_unit_test(confidence_by_knots),
      cmocka_unit_test(bad_numbers_are_counted),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(moved_memory_goes_on),
      cmocka_unit_test(a_long_region_is_found),
      cmocka_unit_test(digest_is_constant),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
