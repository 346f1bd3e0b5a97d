/* SPDX-License-Identifier: MIT */
/* image/basis.c: what the features are in later blocks, and which block is rather one of these. */
#include "base/bytes.h"
#include "image/basis.h"
#include "section_bytes.h"

#include <math.h>

enum { FEATURES = 5, OUTCOMES = 3, TRIANGLE = FEATURES * (FEATURES + 1) / 2 };

static rim_status basis_status(const bytes *b) {
  rim_basis v;
  return rimi_basis_open(&v, b->byte, b->size, FEATURES, OUTCOMES);
}

static void how_later_blocks_are_is_read_back(void **state) {
  (void)state;
  bytes b = {0};
  rim_basis v;
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, 0, 0, 4, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    u32(&b, header[i]);
  u16(&b, 0);
  u16(&b, BASIS_PLAIN);
  const size_t begins = 1 + 2;
  for (size_t i = 0; i < 1 + 2 * OUTCOMES + 2 * FEATURES + begins; ++i) /* the share, and on */
    f32(&b, 1.0);
  const size_t at = b.size;
  for (size_t i = 0; i < 1 + 2 * FEATURES + 2 * TRIANGLE; ++i)
    f32(&b, 0.5 * (double)(i + 1));
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(v.later != NULL && rimi_le_f32(v.later, 0) == 0.5f);
  assert_true(rimi_le_f32(v.later, 1 + FEATURES) == 1.0f + 0.5f * (float)FEATURES);
  assert_true(v.begin != NULL && v.learnt_s == 1.0);
  const struct {
    size_t at;
    double number;
  } bad[] = {{at, NAN},
             {at, INFINITY},
             {at + 4, NAN},
             {at + 4 * FEATURES, INFINITY},
             {at + 4 * (1 + FEATURES), 0.0},
             {at + 4 * (1 + 2 * FEATURES), 0.0}, /* of a diagonal */
             {at + 4 * (1 + 2 * FEATURES + 1), NAN},
             {at + 4 * (1 + 2 * FEATURES + TRIANGLE), -1.0},
             {b.size - 4, -1.0},
             {b.size - 4, NAN}};
  for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
    bytes other = b;
    put_f32(other.byte + bad[k].at, bad[k].number);
    assert_int_equal(basis_status(&other), RIM_E_DATA);
  }
  const size_t of_any_sign[] = {at, at + 4,
                                at + 4 * (1 + 2 * FEATURES + 1)}; /* beside a diagonal */
  for (size_t k = 0; k < sizeof of_any_sign / sizeof *of_any_sign; ++k) {
    bytes other = b;
    put_f32(other.byte + of_any_sign[k], -1.0);
    assert_int_equal(basis_status(&other), RIM_OK);
  }
  bytes cut = b;
  cut.size -= 4;
  assert_int_equal(basis_status(&cut), RIM_E_TRUNCATED);
  bytes longer = b;
  u32(&longer, 0);
  assert_int_equal(basis_status(&longer), RIM_E_SIZE);
}

/* Two features, as they are at first (k 0) and later (k 1). */
static const double mean[2][2] = {{1.0, -2.0}, {3.0, 1.0}}, sd[2][2] = {{0.5, 2.0}, {2.0, 1.0}};
static const double goes_along[2] = {0.6, -0.3}; /* correlations */

static rim_basis of_two(bytes at[3]) {
  rim_basis view = {0};
  memset(at, 0, 3 * sizeof *at);
  f32(&at[2], 0.0);
  for (size_t f = 0; f < 2; ++f) {
    f32(&at[0], mean[0][f]);
    f32(&at[1], sd[0][f]);
    f32(&at[2], mean[1][f]);
  }
  for (size_t f = 0; f < 2; ++f)
    f32(&at[2], sd[1][f]);
  for (size_t k = 0; k < 2; ++k) {
    const double r = goes_along[k], det = 1.0 - r * r;
    f32(&at[2], 1.0 / det);
    f32(&at[2], -r / det);
    f32(&at[2], 1.0 / det);
  }
  view.start = at[0].byte;
  view.start_sd = at[1].byte;
  view.later = at[2].byte;
  return view;
}

/* ln of the normal density of x[f] alone, and of both. */
static double ln_one(double x, size_t f, size_t k) {
  const double z = (x - mean[k][f]) / sd[k][f];
  return -0.5 * z * z - log(sd[k][f]);
}
static double ln_both(const double x[2], size_t k) {
  const double r = goes_along[k], det = 1.0 - r * r;
  const double a = (x[0] - mean[k][0]) / sd[k][0], b = (x[1] - mean[k][1]) / sd[k][1];
  return -0.5 * (a * a - 2.0 * r * a * b + b * b) / det - log(sd[k][0] * sd[k][1]) - 0.5 * log(det);
}

static void a_later_block_is_likelier_by_so_much(void **state) {
  (void)state;
  static bytes at[3];
  const rim_basis view = of_two(at);
  const double dets[2] = {1.0 - 0.6 * 0.6, 1.0 - 0.3 * 0.3};
  const double same = 0.5 * log(dets[0] / dets[1]); /* what every block has, and is not added up */
  for (int i = 0; i < 49; ++i) {
    const double x[2] = {0.5 + 0.5 * (i % 7), -4.0 + 1.0 * (i / 7)}; /* within six of all */
    basis_place place;
    rimi_basis_place(&view, 2, x, &place);
    double alone[2];
    const double nats = rimi_basis_later(&view, 2, &place, 0, &alone[0]) +
                        rimi_basis_later(&view, 2, &place, 1, &alone[1]) + same;
    assert_true(fabs(nats - (ln_both(x, 1) - ln_both(x, 0))) < 1e-5);
    for (size_t f = 0; f < 2; ++f) {
      const double other = ln_one(x[1 - f], 1 - f, 1) - ln_one(x[1 - f], 1 - f, 0);
      assert_true(fabs(nats - alone[f] - other) < 1e-5);
    }
  }
  const double far[2] = {1e300, -1e300};
  basis_place place;
  rimi_basis_place(&view, 2, far, &place);
  assert_true(place.start[0] == 6.0f && place.later[0] == 6.0f && place.start[1] == -6.0f &&
              place.later[1] == -6.0f);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(how_later_blocks_are_is_read_back),
                                     cmocka_unit_test(a_later_block_is_likelier_by_so_much)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
