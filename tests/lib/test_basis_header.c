/* SPDX-License-Identifier: MIT */
/* Headers of the sections BASIS, BEHAVIOUR, AGREEMENT and NOISE: what is shorter is cut off,
 * whatever it begins with; a whole header of a layout that this library does not know is told as
 * such, so that a ground knows what to load. */
#include "image/basis.h"
#include "image/noise.h"
#include "section_bytes.h"

static rim_status open_basis(const bytes *b) {
  rim_basis view;
  return rimi_basis_open(&view, b->byte, b->size, 1, 1);
}

static rim_status open_behaviour(const bytes *b) {
  rim_behaviour view;
  return rimi_behaviour_open(&view, b->byte, b->size, 1, 1);
}

static rim_status open_agreement(const bytes *b) {
  rim_agreement view;
  return rimi_agreement_open(&view, b->byte, b->size, 1, 1, 1);
}

static rim_status open_noise(const bytes *b) {
  rim_noise view;
  return rimi_noise_open(&view, b->byte, b->size, 1, 1);
}

static void a_header_is_whole_or_truncated(void **state) {
  (void)state;
  static const struct {
    rim_status (*open)(const bytes *section);
    size_t header;
  } of[] = {{open_basis, 32},
            {open_behaviour, 16},
            {open_agreement, 16},
            {open_noise, 4 * NOISE_HEADER_WORDS}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    bytes b = {.size = 0};
    memset(b.byte, 0, sizeof b.byte);
    put_u32(b.byte, 99); /* a layout that is none */
    for (b.size = 0; b.size < of[i].header; ++b.size)
      assert_int_equal(of[i].open(&b), RIM_E_TRUNCATED);
    assert_int_equal(of[i].open(&b), RIM_E_VERSION);
  }
}

/* A basis of nothing but its header and the outcome's first reading. */
static void a_header_alone_lacks_the_first_readings(void **state) {
  (void)state;
  bytes b = {.size = 0};
  for (uint32_t i = 0; i < 8; ++i)
    u32(&b, i == 0 ? BASIS_LAYOUT : 0);
  assert_int_equal(open_basis(&b), RIM_E_TRUNCATED);
  f32(&b, 0.0);
  assert_int_equal(open_basis(&b), RIM_OK);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_header_is_whole_or_truncated),
                                     cmocka_unit_test(a_header_alone_lacks_the_first_readings)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
