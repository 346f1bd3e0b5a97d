/* SPDX-License-Identifier: MIT */
/* The header of section BASIS: what is shorter is cut off, whatever it begins with; a whole one of
 * a layout that this library does not know is told as such, so that a ground knows what to load. */
#include "image/basis.h"
#include "section_bytes.h"

enum { HEADER = 32 };

static rim_status status_of(const bytes *b) {
  rim_basis view;
  return rimi_basis_open(&view, b->byte, b->size, 1, 1);
}

static void a_header_is_whole_or_truncated(void **state) {
  (void)state;
  bytes b = {.size = 0};
  memset(b.byte, 0, sizeof b.byte);
  put_u32(b.byte, BASIS_LAYOUT + 1u);
  for (b.size = 0; b.size < HEADER; ++b.size)
    assert_int_equal(status_of(&b), RIM_E_TRUNCATED);
  assert_int_equal(status_of(&b), RIM_E_VERSION);
  put_u32(b.byte, BASIS_LAYOUT);
  assert_int_equal(status_of(&b), RIM_E_TRUNCATED); /* the outcome's first reading is missing */
  f32(&b, 0.0);
  assert_int_equal(status_of(&b), RIM_OK);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_header_is_whole_or_truncated)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
