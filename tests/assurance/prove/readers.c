/* SPDX-License-Identifier: MIT */
/* Section BASIS of any bytes, opened: every number is read inside, and so is what was accepted.
 * Function by function: the readers of base/bytes.h are replaced by ones that check where they read
 * and return any number, so that the proof is of sizes, counts and indices, for every content.
 * Counts of a header are up to MOST, or far beyond every limit. */
#include "any.h"
#include "base/bytes.h"
#include "base/real.h"

uint32_t nondet_uint32(void);
uint16_t nondet_uint16(void);
float nondet_float(void);
double nondet_double(void);
_Bool nondet_bool(void);

static const uint8_t *section; /* of any bytes, too: some are read as they are */
static size_t section_bytes;

static void is_inside(const uint8_t *at, size_t bytes) {
  __ESBMC_assert(__ESBMC_same_object(at, section), "of the section");
  const size_t offset = (size_t)__ESBMC_POINTER_OFFSET(at);
  __ESBMC_assert(offset <= section_bytes && bytes <= section_bytes - offset, "read inside");
}

/* A count of a header: any number, but small or refused. */
static uint32_t any_count(void) {
  const uint32_t n = nondet_uint32();
  __ESBMC_assume(n <= MOST || n > 60000u);
  return n;
}

static uint16_t read_u16(const uint8_t *array, size_t i) {
  is_inside(array + 2 * i, 2);
  return nondet_uint16();
}
static uint32_t read_u32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
  return any_count();
}
static float read_f32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
  return nondet_float();
}
static uint16_t read_index(const uint8_t *array, size_t i, size_t limit) {
  const uint16_t value = read_u16(array, i);
  return value < limit ? value : (uint16_t)0;
}

#define rimi_le_u16 read_u16
#define rimi_le_u32 read_u32
#define rimi_le_f32 read_f32
#define rimi_le_index read_index
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#define rimi_exp(x) ((void)(x), nondet_double())
#define rimi_log(x) ((void)(x), nondet_double())
#define rimi_sqrt(x) ((void)(x), nondet_double())

/* -DREACHED: fails where the proof is of something. */
static void reached(void) {
#ifdef REACHED
  __ESBMC_assert(0, "reached");
#endif
}

#include "../../../lib/src/image/basis.c"
static void use(void) {
  rim_basis view;
  const uint32_t features = 1u + nondet_uint32() % 2u;
  if (rimi_basis_open(&view, section, section_bytes, features, 1u + nondet_uint32() % 2u) ==
      RIM_OK) {
    reached();
    is_inside(view.input, 4u * view.inputs);
    is_inside(view.share, 4u * view.times);
    is_inside(view.term, 8u * view.terms);
    is_inside(view.center, 4u * view.terms);
    is_inside(view.inverse_sd, 4u * view.terms);
    is_inside(view.mean, 4u * view.means);
    is_inside(view.mean_inverse_sd, 4u * view.means);
    if (view.start_sd != NULL)
      is_inside(view.start_sd, 4u * features);
  }
}

int main(void) {
  _Alignas(8) uint8_t any[BYTES];
  section = any;
  section_bytes = any_size(BYTES);
  use();
  return 0;
}
