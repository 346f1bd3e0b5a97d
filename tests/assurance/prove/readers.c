/* SPDX-License-Identifier: MIT */
/* A section (SECTION: its number here) or table of any bytes, opened: every number is read inside,
 * and so is what was accepted. Function by function: the readers of base/bytes.h are replaced by
 * ones that check where they read and return any number, so that the proof is of sizes, counts and
 * indices, for every content. Counts of a header are up to MOST, or far beyond every limit. The
 * functions that prove.sh names are replaced by what they promise, which stands here under their
 * name; numbers.c, can_signal.c prove that promise. */
#include "any.h"
#include "base/bytes.h"
#include "base/real.h"

#include <string.h>

uint32_t nondet_uint32(void);
uint16_t nondet_uint16(void);
float nondet_float(void);
double nondet_double(void);
_Bool nondet_bool(void);

static const uint8_t *section; /* of any bytes, too: some are read as they are */
static size_t section_bytes;

static void is_inside(const uint8_t *at, size_t bytes) {
  is_inside_of(at, bytes, section, section_bytes);
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
  const uint32_t n = any_count();
  return n <= UINT16_MAX ? (uint16_t)n : UINT16_MAX;
#else
  return nondet_uint16();
#endif
}
static uint32_t read_u32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
#if SECTION == 2 /* its counts are limited by its length */
  return nondet_uint32();
#elif SECTION == 4
  return array == section && i >= 2 && i <= 4 ? any_count() : nondet_uint32();
#else
  return array + 4 * i == section ? nondet_uint32() : any_count(); /* first, the version */
#endif
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
static int compare(const void *packed, const void *at, size_t bytes) {
  (void)packed;
  is_inside(at, bytes);
  return (int)nondet_uint32();
}
static uint32_t crc_of_any(const void *data, size_t bytes) {
  is_inside(data, bytes);
  return nondet_uint32();
}

#define rimi_le_u16 read_u16
#define rimi_le_u32 read_u32
#define rimi_le_f32 read_f32
#define rimi_le_f64 read_f64
#define rimi_le_index read_index
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#define rimi_exp(x) ((void)(x), nondet_double())
#define rimi_log(x) ((void)(x), nondet_double())
#define rimi_sqrt(x) ((void)(x), nondet_double())

#include "base/usable.h"

/* numbers.c proves of both that they read these numbers and no other. */
static bool numbers_are_inside(const uint8_t *at, size_t count) {
  is_inside(at, 4u * count);
  return nondet_bool();
}
#define numbers_are_finite numbers_are_inside
#define numbers_are_positive numbers_are_inside

#if SECTION == 2
#include "noise.c"
static void use(void) {
  rim_noise view;
  if (rimi_noise_open(&view, section, section_bytes, 1, nondet_uint32() % 2u) != RIM_OK)
    return;
  const noise_channel c = rimi_noise_channel(&view, 0);
  __ESBMC_assert(c.fields <= NOISE_MAX_FIELDS, "few fields");
  is_inside(c.inverse_prior, 4u * view.fields);
  is_inside(c.combination, 4u * (size_t)view.fields * view.raw);
  is_inside(c.phi, 4u * NOISE_FAMILIES);
}
#elif SECTION == 3
#include "nominal.c"
static void use(void) {
  rim_nominal view;
  if (rimi_nominal_open(&view, section, section_bytes) != RIM_OK)
    return;
  const size_t last = prototype_at(&view, nondet_uint32() % view.prototypes);
  is_inside(section + 4u * last, 4u * (size_t)view.stride);
}
#elif SECTION == 4
#define rimi_crc32(crc, data, bytes) crc_of_any(data, bytes)
#define memcmp compare
#define memset(to, value, bytes) ((void)(to)) /* whatever was there */
#include "correct.c"
/* What the others rely on: no more dimensions than there is room for. */
static rim_status check_region(const rim_correct_region *c, uint32_t features) {
  (void)features;
  return c->region.dims <= MAX_DIMS && nondet_bool() ? RIM_OK : RIM_E_RANGE;
}
static void tidy(const rim_correct_region *from, rim_correct_region *to) {
  (void)to;
  __ESBMC_assert(from->region.dims <= MAX_DIMS, "copied within its room");
}
static void pack_region(const rim_correct_region *c, uint8_t *p) { (void)c, (void)p; }
static void use(void) {
  rim_correct view;
  if (rimi_correct_open(&view, section, section_bytes) != RIM_OK || view.regions == 0)
    return;
  const uint32_t k = nondet_uint32() % view.regions;
  is_inside(region_at(&view, k), AT_SHIFT + 8u * (size_t)view.outcomes);
}
#elif SECTION == 5
#include "basis.c"
static void use(void) {
  rim_basis view;
  const uint32_t features = 1u + nondet_uint32() % MOST;
  if (rimi_basis_open(&view, section, section_bytes, features, 1u + nondet_uint32() % MOST) !=
      RIM_OK)
    return;
  is_inside(view.input, 4u * view.inputs);
  is_inside(view.share, 4u * view.times);
  is_inside(view.term, 8u * view.terms);
  is_inside(view.center, 4u * view.terms);
  is_inside(view.inverse_sd, 4u * view.terms);
  is_inside(view.mean, 4u * view.means);
  is_inside(view.mean_inverse_sd, 4u * view.means);
  if (view.start_sd != NULL)
    is_inside(view.start_sd, 4u * features);
  if (view.later != NULL)
    is_inside(view.later, 4u * (1u + features * (3u + features)));
}
#elif SECTION == 7
#include "basis.c"
static void use(void) {
  rim_agreement view;
  const uint32_t outcomes = 1u + nondet_uint32() % MOST, means = nondet_uint32() % 2u;
  if (rimi_agreement_open(&view, section, section_bytes, 1u + nondet_uint32() % MOST, outcomes,
                          means) != RIM_OK)
    return;
  is_inside(view.inverse_sd, 4u * outcomes);
  is_inside(view.integrand, 8u * view.integrands);
  is_inside(view.integrand_inverse_sd, 4u * view.integrands);
  is_inside(view.partial, 8u * view.integrands);
  is_inside(view.row, 4u * outcomes * agreement_stride(outcomes, means));
  __ESBMC_assert(view.integrands <= outcomes * (2u + means), "an integrand has a weight");
}
#elif SECTION == 9
#include "quadratic.c"
static void use(void) {
  rim_quadratic view;
  if (rimi_quadratic_open(&view, section, section_bytes, nondet_uint32() % (MOST + 1u),
                          1u + nondet_uint32() % MOST) != RIM_OK)
    return;
  __ESBMC_assert(view.inputs <= RIM_QUADRATIC_MAX_INPUTS, "few inputs");
  __ESBMC_assert(view.paired <= 2u * (size_t)view.inputs, "pairs of what there is");
  is_inside(model_at(&view, nondet_uint32() % view.models), 4u * model_words(&view));
}
#else
#include "can_table.c"
/* can_signal.c proves of both that they read no more than the entry. */
static signal signal_at(const rim_can_table *table, size_t index) {
  signal any;
  is_inside(table->signal + RIM_CAN_TABLE_SIGNAL_BYTES * index, RIM_CAN_TABLE_SIGNAL_BYTES);
  return any;
}
static rim_status check_signal(const rim_can_table *table, const signal *s, uint32_t bytes) {
  (void)table, (void)s, (void)bytes;
  return nondet_bool() ? RIM_OK : RIM_E_RANGE;
}
static void use(void) {
  rim_can_table table;
  if (rim_can_table_open(&table, section, section_bytes) != RIM_OK)
    return;
  is_inside(table.frame, RIM_CAN_TABLE_FRAME_BYTES * (size_t)table.frames);
  is_inside(table.signal, RIM_CAN_TABLE_SIGNAL_BYTES * (size_t)table.signals);
}
#endif

int main(void) {
  _Alignas(8) uint8_t any[BYTES];
  section = any;
  section_bytes = any_size(BYTES);
  use();
#ifdef REACHED /* fails where something can be accepted */
  __ESBMC_assert(0, "reached");
#endif
  return 0;
}
