/* SPDX-License-Identifier: MIT */
/* image/basis.c: what the features are in later blocks, and which block is rather one of these. */
#include "base/bytes.h"
#include "image/basis.h"
#include "section_bytes.h"

#include <math.h>

enum { FEATURES = 5, OUTCOMES = 3 };

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
  for (size_t i = 0; i < 1 + 2 * FEATURES; ++i)
    f32(&b, 0.5 * (double)(i + 1));
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(v.later != NULL && rimi_le_f32(v.later, 0) == 0.5f);
  assert_true(rimi_le_f32(v.later, 1 + FEATURES) == 1.0f + 0.5f * (float)FEATURES);
  assert_true(v.begin != NULL && v.learnt_s == 1.0);
  const struct {
    size_t at;
    double number;
  } bad[] = {{at, -1.0},
             {at, NAN},
             {at, INFINITY},
             {at + 4, NAN},
             {at + 4 * FEATURES, INFINITY},
             {at + 4 * (1 + FEATURES), 0.0},
             {b.size - 4, -1.0},
             {b.size - 4, NAN}};
  for (size_t k = 0; k < sizeof bad / sizeof *bad; ++k) {
    bytes other = b;
    put_f32(other.byte + bad[k].at, bad[k].number);
    assert_int_equal(basis_status(&other), RIM_E_DATA);
  }
  bytes cut = b;
  cut.size -= 4;
  assert_int_equal(basis_status(&cut), RIM_E_TRUNCATED);
  bytes longer = b;
  u32(&longer, 0);
  assert_int_equal(basis_status(&longer), RIM_E_SIZE);
}

static void a_later_block_is_likelier_by_so_much(void **state) {
  (void)state;
  const double start[2] = {1.0, 0.5}, later[2] = {3.0, 2.0};
  for (int i = -8; i <= 8; ++i) {
    const double x = 1.0 + 0.3 * i; /* within six standard deviations of both */
    const double s = (x - 1.0) / 0.5, l = (x - 3.0) / 2.0;
    const double nats = log(exp(-0.5 * l * l) / 2.0) - log(exp(-0.5 * s * s) / 0.5);
    assert_true(fabs(rimi_basis_later(x, start, later) - nats) < 1e-9);
  }
  assert_true(rimi_basis_later(1e300, start, later) == rimi_basis_later(-1e300, start, later));
  assert_true(fabs(rimi_basis_later(15.0, start, later) - log(0.25)) < 1e-12); /* far from both */
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(how_later_blocks_are_is_read_back),
                                     cmocka_unit_test(a_later_block_is_likelier_by_so_much)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
