/* SPDX-License-Identifier: MIT */
/* The section named by SECTION, of any bytes up to BYTES: opening it reads inside, and what was
 * accepted stays inside when a number at either end of it is read. */
#include "any.h"
#include "image/basis.h"
#include "image/correct.h"
#include "image/noise.h"
#include "image/nominal.h"
#include "image/threshold.h"

/* Any outcome: as if somebody had made it fit. */
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes);
uint32_t nondet_uint32(void);
uint32_t rimi_crc32(uint32_t crc, const void *data, size_t bytes) {
  (void)crc, (void)data, (void)bytes;
  return nondet_uint32();
}

static rim_status open_it(const uint8_t *section, size_t n) {
#if SECTION == 1
  rim_threshold view;
  return rimi_threshold_open(&view, section, n);
#elif SECTION == 2
  rim_noise view;
  return rimi_noise_open(&view, section, n, 1u + nondet_uint32() % 2u, nondet_uint32() % 3u);
#elif SECTION == 3
  rim_nominal view;
  return rimi_nominal_open(&view, section, n);
#elif SECTION == 4
  rim_correct view;
  return rimi_correct_open(&view, section, n);
#elif SECTION == 5
  rim_basis view;
  return rimi_basis_open(&view, section, n, 1u + nondet_uint32() % 2u, 1u + nondet_uint32() % 2u);
#elif SECTION == 6
  rim_behaviour view;
  return rimi_behaviour_open(&view, section, n, nondet_uint32() % 3u, 1u + nondet_uint32() % 2u);
#else
  rim_agreement view;
  return rimi_agreement_open(&view, section, n, 1u + nondet_uint32() % 2u,
                             1u + nondet_uint32() % 2u, nondet_uint32() % 3u);
#endif
}

int main(void) {
  _Alignas(8) uint8_t bytes[BYTES];
  (void)open_it(bytes, any_size(sizeof bytes));
  return 0;
}
