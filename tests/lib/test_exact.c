/* SPDX-License-Identifier: MIT */
/* Numbers that are known in closed form, and bounds that must grow with what they bound: what a
 * wrong operator would change and no whole run shows. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "image/basis.h"
#include "image/noise.h"
#include "monitor/work.h"
#include "rim/plan/extent.h"

#define SEED 99u

static void is_near(double a, double b) {
  if (!(fabs(a - b) <= 1e-12 * (1.0 + fabs(b))))
    fail_msg("%.17g is not %.17g", a, b);
}

/* ln(calm + mean square of all but the largest). */
static void a_disturbance_leaves_the_largest_out(void **state) {
  (void)state;
  const double z[4] = {1.0, -3.0, 2.0, 0.5};
  is_near(rimi_noise_disturbance(z, 4), log(NOISE_CALM + (1.0 + 4.0 + 0.25) / 3.0));
  is_near(rimi_noise_disturbance(z, 2), log(NOISE_CALM + 1.0));
  assert_true(rimi_noise_disturbance(z, 1) == 0.0 && rimi_noise_disturbance(z, 0) == 0.0);
  /* The same in the outcomes' units. */
  uint8_t inverse_sd[12];
  const float inverse[3] = {2.0f, 0.5f, 4.0f};
  for (size_t i = 0; i < 3; ++i) {
    uint32_t bits;
    memcpy(&bits, &inverse[i], sizeof bits);
    for (size_t k = 0; k < 4; ++k)
      inverse_sd[4 * i + k] = (uint8_t)(bits >> 8 * k);
  }
  const rim_agreement view = {.outcomes = 3, .inverse_sd = inverse_sd};
  const double residual[3] = {0.5, 2.0, -0.125};
  double work[3];
  is_near(rimi_agreement_disturbance(&view, residual, work), log(NOISE_CALM + (1.0 + 0.25) / 2.0));
  assert_true(work[0] == 1.0 && work[1] == 1.0 && work[2] == -0.5);
}

/* A region's volume is that of the unit ball or cube times its half axes. */
static void volumes_of_regions(void **state) {
  (void)state;
  static _Alignas(8) uint8_t memory[1 << 16];
  const double pi = 3.14159265358979323846;
  const double ball[5] = {1.0, 2.0, pi, 4.0 / 3.0 * pi, 0.5 * pi * pi};
  print_message("seed %u\n", SEED);
  for (uint8_t dims = 1; dims <= RIM_EXTENT_MAX_DIMS; ++dims) {
    for (uint8_t shape = RIM_EXTENT_ELLIPSOID; shape <= RIM_EXTENT_BOX; ++shape) {
      const rim_extent_config c = {
          .dims = dims, .points = 200, .lambdas = 3, .shape = shape, .seed = SEED};
      rim_extent *e = NULL;
      rim_rng rng;
      rimi_rng_seed(&rng, SEED, dims);
      assert_int_equal(rim_extent_init(&e, memory, sizeof memory, &c), RIM_OK);
      for (int i = 0; i < 200; ++i) {
        double x[RIM_EXTENT_MAX_DIMS];
        for (uint8_t k = 0; k < dims; ++k)
          x[k] = rimi_rng_uniform(&rng);
        assert_int_equal(rim_extent_add(e, x, x[0] < 0.6 ? 3.0 : 0.0, 1.0), RIM_OK);
      }
      rim_extent_search(e, 60);
      uint32_t found = 0;
      for (uint32_t k = 0; k < 3; ++k) {
        rim_extent_region r;
        assert_int_equal(rim_extent_get_region(e, 0, k, &r), RIM_OK);
        if (r.dims == 0)
          continue;
        double volume = shape == RIM_EXTENT_BOX ? (double)(1 << dims) : ball[dims];
        for (size_t i = 0; i < dims; ++i)
          volume *= r.factor[i * (i + 3) / 2];
        is_near(r.volume, volume < 1.0 ? volume : 1.0);
        found += volume < 1.0;
      }
      assert_true(found > 0);
    }
  }
}

static rim_work bound_of(const rim_work_counts *n) {
  rim_work w;
  rimi_work_bound(n, &w);
  return w;
}

static const rim_work_counts all[2] = {{.features = 6,
                                        .outcomes = 3,
                                        .channels = 3,
                                        .region_features = 6,
                                        .ring = 256,
                                        .budget = 2,
                                        .block_rows = 4,
                                        .bins = 16,
                                        .grid = 32,
                                        .pairs = 4,
                                        .scans = 16,
                                        .edges = 48,
                                        .moves = 64,
                                        .memory_bytes = 50000,
                                        .image_bytes = 3000,
                                        .external = true},
                                       {.features = 29,
                                        .outcomes = 5,
                                        .channels = 20,
                                        .region_features = 12,
                                        .ring = 256,
                                        .budget = 2,
                                        .block_rows = 4,
                                        .inputs = 6,
                                        .times = 3,
                                        .terms = 40,
                                        .means = 2,
                                        .fields = 3,
                                        .integrands = 2,
                                        .angles = 2,
                                        .prototypes = 20,
                                        .top = 4,
                                        .memory_bytes = 50000,
                                        .image_bytes = 3000,
                                        .trained = true}};

/* Each count, raised: no part of the bound falls, and the step's rises. */
static void the_bound_grows_with_every_count(void **state) {
  (void)state;
  for (size_t kind = 0; kind < 2; ++kind) {
    const rim_work base = bound_of(&all[kind]);
    const rim_work_counts *b = &all[kind];
    const uint32_t *const count[] = {
        &b->features,   &b->outcomes, &b->channels, &b->region_features, &b->ring,   &b->budget,
        &b->bins,       &b->grid,     &b->pairs,    &b->scans,           &b->edges,  &b->moves,
        &b->inputs,     &b->times,    &b->terms,    &b->means,           &b->fields, &b->integrands,
        &b->prototypes, &b->top,      &b->angles};
    assert_true(base.step > 0 && base.step < UINT32_MAX);
    for (size_t i = 0; i < sizeof count / sizeof count[0]; ++i) {
      if (*count[i] == 0)
        continue;
      rim_work_counts more = *b;
      uint32_t *at =
          (uint32_t *)(void *)((uint8_t *)&more + ((const uint8_t *)count[i] - (const uint8_t *)b));
      *at *= 2;
      const rim_work w = bound_of(&more);
      if (w.row < base.row || w.search < base.search || w.block < base.block ||
          w.judge < base.judge || w.halving < base.halving || w.step < base.step)
        fail_msg("kind %zu: count %zu doubled, and a bound falls", kind, i);
      if (w.step == base.step && w.search == base.search && w.judge == base.judge)
        fail_msg("kind %zu: count %zu doubled, and nothing grows", kind, i);
    }
  }
}

/* The tables' halving is linear in the pairs: each more costs the same. */
static void halving_is_linear_in_the_pairs(void **state) {
  (void)state;
  rim_work_counts n = all[0];
  uint32_t halving[3];
  for (uint32_t k = 0; k < 3; ++k) {
    n.pairs = 2 + 2 * k;
    halving[k] = bound_of(&n).halving;
  }
  assert_true(halving[1] > halving[0]);
  const uint32_t one = halving[1] - halving[0], other = halving[2] - halving[1];
  assert_true(one <= other + 2 && other <= one + 2);
  rimi_work_bound(NULL, NULL);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_disturbance_leaves_the_largest_out),
      cmocka_unit_test(volumes_of_regions),
      cmocka_unit_test(the_bound_grows_with_every_count),
      cmocka_unit_test(halving_is_linear_in_the_pairs),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
