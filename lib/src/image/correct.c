/* SPDX-License-Identifier: MIT */
#include "image/correct.h"

#include <string.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "base/ellipsoid.h"
#include "base/real.h"

#define MAX_REGIONS RIM_CORRECT_MAX_REGIONS
#define MAX_DIMS RIM_REGION_MAX_DIMS
#define CRC_AT 28u
#define KINDS 5u /* of rim_kind */

/* Offsets in a packed region. */
enum {
  AT_DIMS = 0,
  AT_BOX = 1,
  AT_FEATURE = 2,
  AT_CONFIDENCE = 8,
  AT_CENTER = 16,
  AT_SHAPE = AT_CENTER + 8 * MAX_DIMS,
  AT_LOWER = AT_SHAPE + 8 * MAX_DIMS * MAX_DIMS,
  AT_UPPER = AT_LOWER + 8 * MAX_DIMS,
  AT_SHIFT = AT_UPPER + 8 * MAX_DIMS
};
_Static_assert(RIM_CORRECT_BYTES(1, 1) == RIM_CORRECT_HEADER_BYTES + AT_SHIFT + 8, "layout");

static void put_f64s(uint8_t *p, const double *v, size_t n) {
  for (size_t i = 0; i < n; ++i)
    (void)rimi_le_put_f64(p + 8 * i, v[i]);
}

static const uint8_t *region_at(const rim_correct *c, uint32_t k) {
  return c->section + RIM_CORRECT_HEADER_BYTES + (size_t)k * (AT_SHIFT + 8u * (size_t)c->outcomes);
}

static double shift_of(const rim_correct *c, uint32_t k, uint32_t o) {
  return rimi_le_f64(region_at(c, k) + AT_SHIFT, o);
}

static double confidence_of(const rim_correct *c, uint32_t k) {
  return rimi_le_f64(region_at(c, k) + AT_CONFIDENCE, 0);
}

static void unpack_region(const rim_correct *c, uint32_t k, rim_correct_region *to) {
  const uint8_t *p = region_at(c, k);
  memset(to, 0, sizeof *to);
  to->region.dims = p[AT_DIMS];
  to->is_box = p[AT_BOX] != 0;
  to->confidence = confidence_of(c, k);
  for (size_t i = 0; i < MAX_DIMS; ++i) {
    to->region.feature[i] = rimi_le_u16(p + AT_FEATURE, i);
    to->region.center[i] = rimi_le_f64(p + AT_CENTER, i);
    to->region.lower[i] = rimi_le_f64(p + AT_LOWER, i);
    to->region.upper[i] = rimi_le_f64(p + AT_UPPER, i);
  }
  for (size_t i = 0; i < (size_t)MAX_DIMS * MAX_DIMS; ++i)
    to->region.inverse_shape[i] = rimi_le_f64(p + AT_SHAPE, i);
}

static uint32_t crc_of(const uint8_t *section, size_t bytes) {
  const uint32_t crc = rimi_crc32(0, section, CRC_AT);
  return rimi_crc32(crc, section + CRC_AT + 4u, bytes - CRC_AT - 4u);
}

/* ---- validation, the same for what is packed and what is opened ---- */

static bool counts_ok(uint32_t features, uint32_t outcomes, uint32_t regions, uint32_t overlap,
                      uint32_t kinds) {
  return features >= 1 && features <= RIM_CORRECT_MAX_FEATURES && outcomes >= 1 &&
         outcomes <= RIM_CORRECT_MAX_OUTCOMES && regions <= MAX_REGIONS &&
         overlap <= (uint32_t)RIM_OVERLAP_SUM && kinds >> KINDS == 0;
}

static bool is_nan(double x) { return x != x; } /* cppcheck-suppress duplicateExpression */

static rim_status check_region(const rim_correct_region *c, uint32_t features) {
  const rim_region *r = &c->region;
  if (r->dims > MAX_DIMS || !rimi_region_names_features(r, features))
    return RIM_E_RANGE;
  if (!(c->confidence >= 0.0 && c->confidence <= 1.0))
    return RIM_E_DATA;
  for (size_t i = 0; i < r->dims; ++i) {
    if (!rimi_is_finite(r->center[i]) || is_nan(r->lower[i]) || is_nan(r->upper[i]))
      return RIM_E_DATA;
  }
  for (size_t i = 0; i < (size_t)r->dims * r->dims; ++i) {
    if (!rimi_is_finite(r->inverse_shape[i]))
      return RIM_E_DATA;
  }
  return c->is_box || rimi_region_is_valid(r) ? RIM_OK : RIM_E_SINGULAR;
}

/* What dims leaves unused is 0, so that equal models have equal bytes. */
static void tidy(const rim_correct_region *from, rim_correct_region *to) {
  memset(to, 0, sizeof *to);
  const size_t dims = from->region.dims;
  to->is_box = from->is_box;
  to->confidence = from->confidence;
  to->region.dims = from->region.dims;
  for (size_t i = 0; i < dims; ++i) {
    to->region.feature[i] = from->region.feature[i];
    to->region.center[i] = from->region.center[i];
    to->region.lower[i] = from->region.lower[i];
    to->region.upper[i] = from->region.upper[i];
  }
  for (size_t i = 0; i < dims * dims; ++i)
    to->region.inverse_shape[i] = from->region.inverse_shape[i];
}

static void pack_region(const rim_correct_region *c, uint8_t *p) {
  p[AT_DIMS] = c->region.dims;
  p[AT_BOX] = c->is_box ? 1 : 0;
  for (size_t i = 0; i < MAX_DIMS; ++i)
    (void)rimi_le_put_u16(p + AT_FEATURE + 2 * i, c->region.feature[i]);
  (void)rimi_le_put_f64(p + AT_CONFIDENCE, c->confidence);
  put_f64s(p + AT_CENTER, c->region.center, MAX_DIMS);
  put_f64s(p + AT_SHAPE, c->region.inverse_shape, (size_t)MAX_DIMS * MAX_DIMS);
  put_f64s(p + AT_LOWER, c->region.lower, MAX_DIMS);
  put_f64s(p + AT_UPPER, c->region.upper, MAX_DIMS);
}

static rim_status check_model(const rim_correct_model *m) {
  if (!counts_ok(m->features, m->outcomes, m->regions, (uint32_t)m->overlap, m->kinds))
    return RIM_E_RANGE;
  if (m->regions > 0 && (m->region == NULL || m->shift == NULL))
    return RIM_E_ARGUMENT;
  for (size_t k = 0; k < m->regions; ++k) {
    const rim_status status = check_region(&m->region[k], m->features);
    if (status != RIM_OK)
      return status;
  }
  for (size_t i = 0; i < (size_t)m->regions * m->outcomes; ++i) {
    if (!rimi_is_finite(m->shift[i]))
      return RIM_E_DATA;
  }
  return RIM_OK;
}

rim_status rimi_correct_pack(const rim_correct_model *m, uint8_t *section, size_t bytes) {
  if (m == NULL || section == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = check_model(m);
  if (status != RIM_OK)
    return status;
  if (bytes != RIM_CORRECT_BYTES(m->outcomes, m->regions))
    return RIM_E_SIZE;
  const uint32_t header[7] = {RIM_CORRECT_LAYOUT, (uint32_t)bytes,      m->features, m->outcomes,
                              m->regions,         (uint32_t)m->overlap, m->kinds};
  for (size_t i = 0; i < 7; ++i)
    (void)rimi_le_put_u32(section + 4 * i, header[i]);
  uint8_t *p = section + RIM_CORRECT_HEADER_BYTES;
  for (size_t k = 0; k < m->regions; ++k) {
    rim_correct_region region;
    tidy(&m->region[k], &region);
    pack_region(&region, p);
    put_f64s(p + AT_SHIFT, m->shift + k * m->outcomes, m->outcomes);
    p += AT_SHIFT + 8u * (size_t)m->outcomes;
  }
  (void)rimi_le_put_u32(section + CRC_AT, crc_of(section, bytes));
  return RIM_OK;
}

static rim_status check_section(const rim_correct *c) {
  for (uint32_t k = 0; k < c->regions; ++k) {
    rim_correct_region region;
    rim_correct_region clean;
    uint8_t packed[AT_SHIFT];
    unpack_region(c, k, &region);
    const rim_status status = check_region(&region, c->features);
    if (status != RIM_OK)
      return status;
    tidy(&region, &clean);
    pack_region(&clean, packed);
    if (memcmp(packed, region_at(c, k), AT_SHIFT) != 0)
      return RIM_E_DATA;
    for (uint32_t o = 0; o < c->outcomes; ++o) {
      if (!rimi_is_finite(shift_of(c, k, o)))
        return RIM_E_DATA;
    }
  }
  return RIM_OK;
}

rim_status rimi_correct_open(rim_correct *view, const uint8_t *section, size_t bytes) {
  if (view == NULL || section == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)section & 3u) != 0)
    return RIM_E_ALIGN;
  if (bytes < RIM_CORRECT_HEADER_BYTES)
    return RIM_E_TRUNCATED;
  if (rimi_le_u32(section, 0) != RIM_CORRECT_LAYOUT)
    return RIM_E_VERSION;
  const uint32_t announced = rimi_le_u32(section, 1);
  if (announced < RIM_CORRECT_HEADER_BYTES || bytes < announced)
    return RIM_E_TRUNCATED;
  if (bytes > announced)
    return RIM_E_SIZE;
  if (crc_of(section, bytes) != rimi_le_u32(section, CRC_AT / 4u))
    return RIM_E_CRC;
  const uint32_t overlap = rimi_le_u32(section, 5);
  rim_correct c = {.section = section,
                   .features = rimi_le_u32(section, 2),
                   .outcomes = rimi_le_u32(section, 3),
                   .regions = rimi_le_u32(section, 4),
                   .kinds = rimi_le_u32(section, 6)};
  if (!counts_ok(c.features, c.outcomes, c.regions, overlap, c.kinds))
    return RIM_E_RANGE;
  c.overlap = (rim_overlap)overlap;
  const size_t need = RIM_CORRECT_BYTES(c.outcomes, c.regions);
  if (bytes != need)
    return bytes < need ? RIM_E_TRUNCATED : RIM_E_SIZE;
  const rim_status status = check_section(&c);
  if (status == RIM_OK)
    *view = c;
  return status;
}

/* ---- the mixture ---- */

/* What acts at x: regions as a mask, with the chance of each. */
typedef struct active {
  uint32_t mask;
  double p[MAX_REGIONS];
} active;

static active at(const rim_correct *c, const double *x) {
  active a = {0, {0.0}};
  double sum = 0.0;
  for (uint32_t k = 0; k < c->regions; ++k) {
    rim_correct_region r;
    unpack_region(c, k, &r);
    if (!(r.is_box ? rimi_region_box_contains(&r.region, x) : rim_region_contains(&r.region, x)))
      continue;
    a.mask |= 1u << k;
    a.p[k] = r.confidence;
    sum += r.confidence;
    if (c->overlap == RIM_OVERLAP_FIRST)
      break;
  }
  for (uint32_t k = 0; c->overlap == RIM_OVERLAP_MIXTURE && sum > 1.0 && k < c->regions; ++k)
    a.p[k] /= sum;
  return a;
}

static double mean_shift(const rim_correct *c, const active *a, uint32_t o) {
  double sum = 0.0;
  for (uint32_t k = 0; k < c->regions; ++k) {
    if ((a->mask >> k & 1u) != 0)
      sum += a->p[k] * shift_of(c, k, o);
  }
  return sum;
}

rim_status rimi_correct_mean(const rim_correct *c, const double *x, const double *nominal,
                             double *mean) {
  if (c == NULL || c->section == NULL || x == NULL || nominal == NULL || mean == NULL)
    return RIM_E_ARGUMENT;
  const active a = at(c, x);
  for (uint32_t o = 0; o < c->outcomes; ++o)
    mean[o] = nominal[o] + mean_shift(c, &a, o);
  return RIM_OK;
}
