/* SPDX-License-Identifier: MIT */
/* A section of any bytes, opened, and what was accepted used: every number is read inside. Function
 * by function: the readers of base/bytes.h are replaced by ones that check where they read and
 * return any number, so that the proof is of sizes, counts and indices, for every content. A header
 * word that the code reads once is one number; counts are limited to what UNWIND can turn. */
#include "any.h"
#include "base/bytes.h"
#include "base/crc.h"
#include "base/real.h"

uint32_t nondet_uint32(void);
uint16_t nondet_uint16(void);
uint64_t nondet_uint64(void);
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
#if SECTION == 8
  return (uint16_t)(any_count() & 0xffffu);
#else
  return nondet_uint16();
#endif
}
static uint32_t read_u32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
  return any_count();
}
static float read_f32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
  return nondet_float();
}
static double read_f64(const uint8_t *array, size_t i) {
  is_inside(array + 8 * i, 8);
  return nondet_double();
}
static uint16_t read_index(const uint8_t *array, size_t i, size_t limit) {
  const uint16_t value = read_u16(array, i);
  return value < limit ? value : (uint16_t)0;
}

#define rimi_le_u16 read_u16
#define rimi_le_u32 read_u32
#define rimi_le_f32 read_f32
#define rimi_le_u64(array, i) (is_inside((array) + 8 * (i), 8), nondet_uint64())
#define rimi_le_f64 read_f64
#define rimi_le_index read_index
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#define rimi_exp(x) ((void)(x), nondet_double())
#define rimi_log(x) ((void)(x), nondet_double())
#define rimi_sqrt(x) ((void)(x), nondet_double())
#define rimi_crc32(crc, data, bytes) (is_inside((data), (bytes)), nondet_uint32())

enum { OUT = 2 };

/* -DREACHED: fails where the proof is of something, which prove.sh asks of each. */
static void reached(void) {
#ifdef REACHED
  __ESBMC_assert(0, "reached");
#endif
}

#if SECTION == 2
#include "../../../lib/src/image/noise.c"
static void use(void) {
  rim_noise view;
  const uint32_t channels = 1u + nondet_uint32() % 2u;
  if (rimi_noise_open(&view, section, section_bytes, channels, nondet_uint32() % 3u) == RIM_OK) {
    reached();
    const uint32_t c = nondet_uint32() % channels;
    const noise_channel n = rimi_noise_channel(&view, c);
    is_inside(n.inverse_prior, 4u * view.fields);
    is_inside(n.combination, 4u * (size_t)view.fields * view.raw);
    is_inside(n.phi, 4u * NOISE_FAMILIES);
    __ESBMC_assert(n.fields <= NOISE_MAX_FIELDS, "few fields");
  }
}
#elif SECTION == 3
#include "../../../lib/src/image/nominal.c"
static void use(void) {
  rim_nominal view;
  if (rimi_nominal_open(&view, section, section_bytes) == RIM_OK) {
    const size_t last = prototype_at(&view, nondet_uint32() % view.prototypes);
    is_inside(section + 4u * last, 4u * (size_t)view.stride);
    reached();
  }
}
#elif SECTION == 8
#include "../../../lib/src/wire/can_table.c"
static void use(void) {
  rim_can_table table;
  if (rim_can_table_open(&table, section, section_bytes) == RIM_OK) {
    is_inside(table.frame, RIM_CAN_TABLE_FRAME_BYTES * (size_t)table.frames);
    is_inside(table.signal, RIM_CAN_TABLE_SIGNAL_BYTES * (size_t)table.signals);
    reached();
  }
}
#elif SECTION == 5
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
#else
#include "../../../lib/src/image/basis.c"
static void use(void) {
  rim_agreement view;
  const uint32_t means = nondet_uint32() % 2u;
  double residual[OUT], mean[OUT], measured[OUT], level[OUT], remains[OUT];
  double early[AGREEMENT_INTEGRANDS * OUT], late[AGREEMENT_INTEGRANDS * OUT];
  double state[AGREEMENT_STATE * OUT];
  const uint32_t outcomes = 1u + nondet_uint32() % OUT, features = 2;
  if (rimi_agreement_open(&view, section, section_bytes, features, outcomes, means) != RIM_OK)
    return;
  const agreement_block block = {.residual = residual, .mean = mean, .measured = measured,
                                 .level = nondet_bool() ? level : NULL,
                                 .early = early, .late = late, .follows = nondet_bool()};
  rimi_agreement_evaluate(&view, &block, state, remains);
  (void)rimi_agreement_error(&view, nondet_uint32() % outcomes, mean, measured);
  (void)rimi_agreement_gain(&view, nondet_uint32() % outcomes, nondet_uint32() % outcomes,
                            nondet_uint16());
  reached();
}
#endif

int main(void) {
  _Alignas(8) uint8_t any[BYTES];
  section = any;
  section_bytes = any_size(BYTES);
  use();
  return 0;
}
