/* SPDX-License-Identifier: MIT */
/* Products of readings: predicted from sections built here by hand, against sums written out in the
 * plainest way, and refused in every damaged form. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "image/quadratic.h"
#include "section_bytes.h"

enum { D = 3, MODELS = 2, OUTCOMES = 5, MOST_TERMS = 1 + 2 * D + D * (2 * D + 1) };
#define SEED 4127u

static const uint32_t outcome_of[MODELS] = {1, 4};

typedef struct plain {
  double centre[D], scale[D], constant[MODELS], linear[MODELS][2 * D];
  double product[MODELS][2 * D][2 * D];
} plain;

static double single(double v) { return (double)(float)v; }

static void make_plain(plain *p, uint64_t stream) {
  rim_rng r;
  rimi_rng_seed(&r, SEED, stream);
  for (int i = 0; i < D; ++i) {
    p->centre[i] = single(10.0 * rimi_rng_normal(&r));
    p->scale[i] = single(0.5 + rimi_rng_uniform(&r));
  }
  for (int k = 0; k < MODELS; ++k) {
    p->constant[k] = single(rimi_rng_normal(&r));
    for (int i = 0; i < 2 * D; ++i) {
      p->linear[k][i] = single(rimi_rng_normal(&r));
      for (int j = 0; j < 2 * D; ++j)
        p->product[k][i][j] = single(rimi_rng_normal(&r));
    }
  }
}

/* second: the use of the second model. */
static void make_section(bytes *s, const plain *p, uint32_t paired, rim_quadratic_use second) {
  const uint32_t header[4] = {RIM_QUADRATIC_LAYOUT, D, MODELS, paired};
  memset(s, 0, sizeof *s);
  for (size_t i = 0; i < 4; ++i)
    u32(s, header[i]);
  for (int i = 0; i < D; ++i)
    f32(s, p->centre[i]);
  for (int i = 0; i < D; ++i)
    f32(s, p->scale[i]);
  for (int k = 0; k < MODELS; ++k) {
    u16(s, outcome_of[k]);
    u16(s, k == 0 ? RIM_QUADRATIC_AGREES : second);
    f32(s, p->constant[k]);
    for (int i = 0; i < 2 * D; ++i)
      f32(s, p->linear[k][i]);
    for (uint32_t i = 0; i < paired; ++i) {
      for (uint32_t j = i; j < paired; ++j)
        f32(s, p->product[k][i][j]);
    }
  }
}

static rim_status opened(const bytes *s, rim_quadratic *view) {
  return rimi_quadratic_open(view, s->byte, s->size, D, OUTCOMES);
}

/* With products of this block alone, and with those of the block before. */
static void sums_written_out(void **state) {
  (void)state;
  for (uint64_t stream = 0; stream < 20; ++stream) {
    const uint32_t paired = stream % 2 == 0 ? D : 2 * D;
    const bool steps = stream % 4 >= 2;
    const rim_quadratic_use use[MODELS] = {RIM_QUADRATIC_AGREES,
                                           steps ? RIM_QUADRATIC_STEPS : RIM_QUADRATIC_AGREES};
    plain p;
    bytes s;
    rim_quadratic view;
    make_plain(&p, stream);
    make_section(&s, &p, paired, use[1]);
    assert_int_equal(opened(&s, &view), RIM_OK);
    assert_true(view.inputs == D && view.models == MODELS && view.paired == paired);
    rim_rng r;
    rimi_rng_seed(&r, SEED, 1000 + stream);
    double z[2 * D], predicted[OUTCOMES] = {7.0, 7.0, 7.0, 7.0, 7.0};
    for (int i = 0; i < 2 * D; ++i)
      z[i] = rimi_rng_normal(&r);
    rimi_quadratic_predict(&view, RIM_QUADRATIC_AGREES, z, predicted);
    assert_true((predicted[outcome_of[1]] == 7.0) == steps);
    rimi_quadratic_predict(&view, RIM_QUADRATIC_STEPS, z, predicted);
    assert_true(rimi_quadratic_has_steps(&view) == steps);
    for (int k = 0; k < MODELS; ++k) {
      double sum = p.constant[k];
      for (int i = 0; i < 2 * D; ++i)
        sum += p.linear[k][i] * z[i];
      for (uint32_t i = 0; i < paired; ++i) {
        for (uint32_t j = i; j < paired; ++j)
          sum += p.product[k][i][j] * z[i] * z[j];
      }
      assert_true(fabs(predicted[outcome_of[k]] - sum) < 1e-12 * (1.0 + fabs(sum)));
    }
    assert_true(predicted[0] == 7.0 && predicted[2] == 7.0 && predicted[3] == 7.0);
    for (uint32_t o = 0; o < OUTCOMES; ++o) {
      for (int of = RIM_QUADRATIC_AGREES; of <= RIM_QUADRATIC_STEPS; ++of)
        assert_int_equal(rimi_quadratic_has(&view, (rim_quadratic_use)of, o),
                         (o == outcome_of[0] && of == (int)use[0]) ||
                             (o == outcome_of[1] && of == (int)use[1]));
    }
  }
}

/* A block's inputs in standard deviations, within the limit; the block before is that of the call
 * before, and the block itself where it follows none. */
static void a_block_and_the_one_before(void **state) {
  (void)state;
  plain p;
  bytes s;
  rim_quadratic view;
  make_plain(&p, 99);
  make_section(&s, &p, D, RIM_QUADRATIC_AGREES);
  assert_int_equal(opened(&s, &view), RIM_OK);
  double x[D], z[2 * D] = {9.0, 9.0, 9.0, 9.0, 9.0, 9.0};
  for (int i = 0; i < D; ++i)
    x[i] = p.centre[i] + (i - 1) * 1.5 / p.scale[i];
  rimi_quadratic_take(&view, x, false, z);
  for (int i = 0; i < D; ++i) {
    assert_true(fabs(z[i] - (i - 1) * 1.5) < 1e-9);
    assert_true(z[D + i] == z[i]);
  }
  x[0] = p.centre[0] - 1e6;
  x[2] = p.centre[2] + 1e6;
  rimi_quadratic_take(&view, x, true, z);
  assert_true(z[0] == -RIM_QUADRATIC_CLIP && fabs(z[1]) < 1e-9 && z[2] == RIM_QUADRATIC_CLIP);
  for (int i = 0; i < D; ++i)
    assert_true(fabs(z[D + i] - (i - 1) * 1.5) < 1e-9);
}

static void refused(bytes *s, rim_status why) {
  rim_quadratic view = {0};
  assert_int_equal(opened(s, &view), why);
  assert_true(view.section == NULL && view.models == 0);
}

static void damaged_sections(void **state) {
  (void)state;
  plain p;
  bytes good, s;
  rim_quadratic view;
  make_plain(&p, 5);
  make_section(&good, &p, 2 * D, RIM_QUADRATIC_AGREES);
  assert_int_equal(opened(&good, &view), RIM_OK);
  assert_int_equal(rimi_quadratic_open(&view, good.byte + 1, good.size, D, OUTCOMES), RIM_E_ALIGN);
  assert_int_equal(rimi_quadratic_open(&view, good.byte, good.size, D + 1, OUTCOMES), RIM_E_RANGE);
  assert_int_equal(rimi_quadratic_open(&view, good.byte, good.size, D, 4), RIM_E_RANGE);
  assert_int_equal(rimi_quadratic_open(&view, good.byte, good.size, D, 1), RIM_E_RANGE);
  const size_t first = 4 + 2 * D, terms = MOST_TERMS;
  const struct {
    size_t word;
    uint32_t value;
    rim_status why;
  } wrong[] = {{0, RIM_QUADRATIC_LAYOUT + 1, RIM_E_VERSION},
               {1, 2, RIM_E_RANGE},
               {2, 0, RIM_E_RANGE},
               {2, 3, RIM_E_TRUNCATED},
               {2, 1, RIM_E_SIZE},
               {3, D, RIM_E_SIZE},
               {3, D + 1, RIM_E_RANGE},
               {4, 0x7fc00000, RIM_E_DATA},                   /* a centre */
               {4 + D, 0, RIM_E_DATA},                        /* a scale of 0 */
               {4 + 2 * D - 1, 0xbf800000, RIM_E_DATA},       /* of -1 */
               {first, 5, RIM_E_RANGE},                       /* no such outcome */
               {first, 4, RIM_E_RANGE},                       /* that of the second model */
               {first, 1 | 1 << 16, RIM_E_RANGE},             /* a step before an agreement */
               {first + terms + 1, 4 | 2 << 16, RIM_E_RANGE}, /* no such use */
               {first + 1, 0x7f800000, RIM_E_DATA},
               {first + terms, 0x7f800000, RIM_E_DATA},
               {first + 2 * terms + 1, 0xff800000, RIM_E_DATA}};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    s = good;
    put_u32(s.byte + 4 * wrong[i].word, wrong[i].value);
    refused(&s, wrong[i].why);
  }
  s = good;
  s.size -= 4;
  refused(&s, RIM_E_TRUNCATED);
  s.size += 8;
  refused(&s, RIM_E_SIZE);
  s.size = 12;
  refused(&s, RIM_E_TRUNCATED);
}

int main(void) {
  printf("seed %u\n", SEED);
  const struct CMUnitTest tests[] = {cmocka_unit_test(sums_written_out),
                                     cmocka_unit_test(a_block_and_the_one_before),
                                     cmocka_unit_test(damaged_sections)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
