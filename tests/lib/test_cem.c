/* SPDX-License-Identifier: MIT */
/* Climbs known functions; equal to the bit whatever ran before. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "search/cem.h"

#define SEED 29u

typedef struct target {
  double center[RIM_CEM_MAX_DIMS];
  double axis;
  uint32_t calls;
} target;

/* Best at one ball. */
static double closeness(const rim_ellipsoid *e, void *context) {
  target *t = (target *)context;
  ++t->calls;
  double cost = 0.0;
  for (size_t i = 0; i < e->dims; ++i) {
    const double *row = e->factor + i * (i + 1) / 2;
    cost += pow(e->center[i] - t->center[i], 2) + pow(row[i] - t->axis, 2);
    for (size_t j = 0; j < i; ++j)
      cost += row[j] * row[j];
  }
  return -cost;
}

static void climbs_in_every_dimension(void **state) {
  (void)state;
  for (uint8_t dims = 1; dims <= RIM_CEM_MAX_DIMS; ++dims) {
    target t = {{0.7, 0.2, 0.5, 0.6, 0.4, 0.3}, 0.2, 0};
    const double middle[RIM_CEM_MAX_DIMS] = {0.5, 0.5, 0.5, 0.5, 0.5, 0.5};
    rim_ellipsoid e = rimi_ellipsoid_ball(dims, middle, 0.4);
    const double before = closeness(&e, &t);
    t.calls = 0;
    const rim_cem_config c = {.samples = 200, .elites = 16, .iterations = 40, .smoothing = 0.3};
    double value = 0.0;
    assert_int_equal(rimi_cem_optimise(&c, closeness, &t, SEED, dims, &e, &value), RIM_OK);
    assert_int_equal(t.calls, 200 * 40 + 1);
    assert_true(value > before && value > -0.01);
    assert_true(value == closeness(&e, &t));
  }
}

static void never_worse_than_the_start(void **state) {
  (void)state;
  target t = {{0.5, 0.5}, 0.3, 0};
  const double x[2] = {0.5, 0.5};
  rim_ellipsoid e = rimi_ellipsoid_ball(2, x, 0.3);
  double value = -1.0;
  const rim_cem_config c = {0};
  assert_int_equal(rimi_cem_optimise(&c, closeness, &t, 1, 1, &e, &value), RIM_OK);
  assert_true(value == 0.0 && e.center[0] == 0.5);
}

static void key_decides(void **state) {
  (void)state;
  const double x[2] = {0.4, 0.6};
  double value[3];
  rim_ellipsoid e[3];
  const uint64_t stream[3] = {5, 6, 5};
  for (int i = 0; i < 3; ++i) {
    target t = {{0.9, 0.1}, 0.1, 0};
    e[i] = rimi_ellipsoid_ball(2, x, 0.2);
    const rim_cem_config c = {0};
    assert_int_equal(rimi_cem_optimise(&c, closeness, &t, SEED, stream[i], &e[i], &value[i]),
                     RIM_OK);
  }
  assert_memory_equal(&e[0], &e[2], sizeof e[0]);
  assert_true(value[0] == value[2] && value[0] != value[1]);
}

/* Every call is worth the same, or one of its first draws a little less than the one before. */
typedef struct plateau {
  target of;
  double step;
} plateau;

static double first_level_then_close(const rim_ellipsoid *e, void *context) {
  plateau *p = (plateau *)context;
  const double value = closeness(e, &p->of);
  return p->of.calls <= 25 ? -100.0 - p->step * p->of.calls : value;
}

/* Of equal draws the first are kept, as if each were worth less than the one before. */
static void of_equal_draws_the_first_are_kept(void **state) {
  (void)state;
  const double x[2] = {0.4, 0.6};
  rim_ellipsoid e[2];
  double value[2];
  for (int i = 0; i < 2; ++i) {
    plateau p = {{{0.9, 0.1}, 0.1, 0}, i == 0 ? 0.0 : 1e-6};
    const rim_cem_config c = {0}; /* 24 draws an iteration, after the start */
    e[i] = rimi_ellipsoid_ball(2, x, 0.2);
    assert_int_equal(rimi_cem_optimise(&c, first_level_then_close, &p, SEED, 1, &e[i], &value[i]),
                     RIM_OK);
  }
  assert_memory_equal(&e[0], &e[1], sizeof e[0]);
  assert_true(value[0] == value[1] && value[0] > -1.0);
}

static double level(const rim_ellipsoid *e, void *context) {
  (void)e;
  (void)context;
  return 2.0;
}

/* What is only as good does not replace the start. */
static void what_is_only_as_good_changes_nothing(void **state) {
  (void)state;
  const double x[2] = {0.4, 0.6};
  rim_ellipsoid e = rimi_ellipsoid_ball(2, x, 0.2);
  const rim_ellipsoid before = e;
  const rim_cem_config c = {0};
  double value = 0.0;
  assert_int_equal(rimi_cem_optimise(&c, level, NULL, SEED, 1, &e, &value), RIM_OK);
  assert_memory_equal(&e, &before, sizeof e);
  assert_true(value == 2.0);
}

static double farthest(const rim_ellipsoid *e, void *context) {
  double *most = (double *)context;
  *most = fmax(*most, fmax(fabs(e->center[0] - 0.5), fabs(e->center[1] - 0.5)));
  return 0.0;
}

/* Centres are drawn as far from the first as its shortest axis says, whichever it is. */
static void the_shortest_axis_says_how_far(void **state) {
  (void)state;
  const double x[2] = {0.5, 0.5};
  for (int which = 0; which < 3; ++which) {
    rim_ellipsoid e = rimi_ellipsoid_ball(2, x, 0.4);
    if (which < 2)
      e.factor[2 * which] = 0.04;
    const rim_cem_config c = {.samples = 200, .iterations = 1};
    double most = 0.0, value = 0.0;
    assert_int_equal(rimi_cem_optimise(&c, farthest, &most, SEED, 1, &e, &value), RIM_OK);
    assert_true(which < 2 ? most < 6.0 * 0.5 * 0.04 : most > 0.4);
  }
}

typedef struct follower {
  target of;
  double best, center, farthest;
} follower;

/* Of the first 24 draws the best, and how far from it the next are. */
static double follows(const rim_ellipsoid *e, void *context) {
  follower *f = (follower *)context;
  const double value = closeness(e, &f->of);
  if (f->of.calls > 1 && f->of.calls <= 25 && value > f->best) {
    f->best = value;
    f->center = e->center[0];
  }
  if (f->of.calls > 25)
    f->farthest = fmax(f->farthest, fabs(e->center[0] - f->center));
  return value;
}

/* A single elite is the best draw, whenever it came: the next are drawn around it. */
static void a_single_elite_is_the_best(void **state) {
  (void)state;
  for (uint64_t stream = 0; stream < 8; ++stream) {
    const double x[1] = {0.4};
    rim_ellipsoid e = rimi_ellipsoid_ball(1, x, 0.3);
    follower f = {{{0.6}, 0.3, 0}, -1e300, 0.0, 0.0};
    const rim_cem_config c = {.samples = 24, .elites = 1, .iterations = 2};
    double value = 0.0;
    assert_int_equal(rimi_cem_optimise(&c, follows, &f, SEED, stream, &e, &value), RIM_OK);
    assert_int_equal(f.of.calls, 49);
    assert_true(f.farthest > 0.0 && f.farthest < 0.02);
  }
}

static void the_ends_are_allowed(void **state) {
  (void)state;
  const rim_cem_config ends[] = {{.samples = 2, .elites = 2},
                                 {.samples = RIM_CEM_MAX_SAMPLES, .elites = RIM_CEM_MAX_ELITES},
                                 {.least_axis = 0.25, .most_axis = 0.25}};
  for (size_t i = 0; i < sizeof ends / sizeof *ends; ++i)
    assert_true(rimi_cem_is_valid(&ends[i], 2));
}

static void bad_input_is_refused(void **state) {
  (void)state;
  target t = {{0}, 0, 0};
  const double x[2] = {0.5, 0.5};
  const rim_cem_config good = {0};
  rim_ellipsoid e = rimi_ellipsoid_ball(2, x, 0.2);
  const rim_ellipsoid before = e;
  double value = 7.0;
  rim_cem_config bad[] = {
      {.samples = 1},       {.samples = 1025},   {.elites = 17},       {.samples = 4, .elites = 5},
      {.smoothing = 1.0},   {.smoothing = -0.1}, {.smoothing = NAN},   {.spread = -1.0},
      {.spread = INFINITY}, {.least_axis = 2.0}, {.least_axis = -1.0}, {.most_axis = NAN},
  };
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    assert_int_equal(rimi_cem_optimise(&bad[i], closeness, &t, 1, 1, &e, &value), RIM_E_CONFIG);
    assert_false(rimi_cem_is_valid(&bad[i], 2));
  }
  const rim_cem_config all = {.samples = 8, .elites = 8};
  assert_true(rimi_cem_is_valid(&all, 1));
  assert_true(rimi_cem_is_valid(&good, 1));
  assert_true(rimi_cem_is_valid(&good, RIM_CEM_MAX_DIMS));
  assert_false(rimi_cem_is_valid(&good, 0));
  assert_false(rimi_cem_is_valid(&good, RIM_CEM_MAX_DIMS + 1));
  assert_false(rimi_cem_is_valid(NULL, 1));
  assert_int_equal(rimi_cem_optimise(NULL, closeness, &t, 1, 1, &e, &value), RIM_E_ARGUMENT);
  assert_int_equal(rimi_cem_optimise(&good, NULL, &t, 1, 1, &e, &value), RIM_E_ARGUMENT);
  rim_ellipsoid odd = e;
  odd.dims = 7;
  assert_int_equal(rimi_cem_optimise(&good, closeness, &t, 1, 1, &odd, &value), RIM_E_CONFIG);
  odd = e;
  for (int i = 0; i < 4;
       ++i) { /* an axis of 0, or a centre that is no number, of either dimension */
    odd = e;
    odd.factor[i < 2 ? 2 * i : 0] = i < 2 ? 0.0 : 0.2;
    odd.center[i % 2] = i < 2 ? 0.5 : (double)NAN;
    assert_int_equal(rimi_cem_optimise(&good, closeness, &t, 1, 1, &odd, &value), RIM_E_CONFIG);
  }
  assert_memory_equal(&e, &before, sizeof e);
  assert_true(value == 7.0 && t.calls == 0);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(climbs_in_every_dimension),
      cmocka_unit_test(never_worse_than_the_start),
      cmocka_unit_test(key_decides),
      cmocka_unit_test(of_equal_draws_the_first_are_kept),
      cmocka_unit_test(what_is_only_as_good_changes_nothing),
      cmocka_unit_test(the_shortest_axis_says_how_far),
      cmocka_unit_test(a_single_elite_is_the_best),
      cmocka_unit_test(the_ends_are_allowed),
      cmocka_unit_test(bad_input_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
