/* SPDX-License-Identifier: MIT */
#include "rim/region.h"
#include "base/ellipsoid.h"

#include <stddef.h>

#include "base/cholesky.h"

#define SYMMETRY_TOLERANCE 1e-9
#define PACKED (RIM_REGION_MAX_DIMS * (RIM_REGION_MAX_DIMS + 1) / 2)

/* Factors A^-1; false where it is not positive definite. */
static bool factor(const rim_region *region, double l[PACKED]) {
  const uint32_t dims = region->dims;
  for (uint32_t i = 0; i < dims; ++i) {
    for (uint32_t j = 0; j <= i; ++j) {
      l[packed_row(i) + j] = region->inverse_shape[i * dims + j];
    }
  }
  return cholesky_factor(dims, l);
}

static bool features_differ(uint32_t dims, const uint16_t *feature) {
  for (uint32_t i = 1; i < dims; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      if (feature[i] == feature[j]) {
        return false;
      }
    }
  }
  return true;
}

bool rimi_region_names_features(const rim_region *region, uint32_t count) {
  for (uint32_t i = 0; i < region->dims; ++i) {
    if (region->feature[i] >= count) {
      return false;
    }
  }
  return features_differ(region->dims, region->feature);
}

static bool is_symmetric(const rim_region *region) {
  const uint32_t dims = region->dims;
  const double *m = region->inverse_shape;
  for (uint32_t i = 1; i < dims; ++i) {
    for (uint32_t j = 0; j < i; ++j) {
      const double scale = rimi_sqrt(m[i * dims + i]) * rimi_sqrt(m[j * dims + j]);
      if (!(rimi_abs(m[i * dims + j] - m[j * dims + i]) <= SYMMETRY_TOLERANCE * scale)) {
        return false;
      }
    }
  }
  return true;
}

bool rimi_region_is_valid(const rim_region *region) {
  if (region == NULL || region->dims > RIM_REGION_MAX_DIMS ||
      !features_differ(region->dims, region->feature)) {
    return false;
  }
  for (uint32_t i = 0; i < region->dims; ++i) {
    if (!rimi_is_finite(region->center[i])) {
      return false;
    }
  }
  double l[PACKED];
  return is_symmetric(region) && factor(region, l);
}

double rimi_region_distance2(const rim_region *region, const double *x) {
  const uint32_t dims = region->dims;
  double d[RIM_REGION_MAX_DIMS];
  double sum = 0.0;
  for (uint32_t i = 0; i < dims; ++i) {
    d[i] = x[region->feature[i]] - region->center[i];
  }
  for (uint32_t i = 0; i < dims; ++i) {
    double row = 0.0;
    for (uint32_t j = 0; j < dims; ++j) {
      row += region->inverse_shape[i * dims + j] * d[j];
    }
    sum += d[i] * row;
  }
  return sum;
}

bool rim_region_contains(const rim_region *region, const double *x) {
  return rimi_region_distance2(region, x) < 1.0;
}

bool rimi_region_box_contains(const rim_region *region, const double *x) {
  for (uint32_t i = 0; i < region->dims; ++i) {
    const double v = x[region->feature[i]];
    const bool above = v >= region->lower[i];
    const bool below = v <= region->upper[i];
    if (!(region->lower[i] > region->upper[i] ? above || below : above && below)) {
      return false;
    }
  }
  return true;
}

bool rimi_unit_region_contains(const rim_unit_region *region, const double *u) {
  return rim_region_contains(&region->unit, u);
}

rim_region rimi_region_from_unit(const rim_unit_region *from, const uint16_t *feature,
                                 const double *low, const double *width) {
  const rim_region *unit = &from->unit;
  const uint32_t dims = unit->dims;
  rim_region region = *unit;
  for (uint32_t i = 0; i < dims; ++i) {
    region.feature[i] = feature[i];
    region.center[i] = low[i] + unit->center[i] * width[i];
    region.lower[i] = low[i] + unit->lower[i] * width[i];
    region.upper[i] = low[i] + unit->upper[i] * width[i];
    for (uint32_t j = 0; j < dims; ++j) {
      region.inverse_shape[i * dims + j] =
          unit->inverse_shape[i * dims + j] / (width[i] * width[j]);
    }
  }
  return region;
}

double rimi_region_volume(const rim_region *region) {
  static const double unit_ball[RIM_REGION_MAX_DIMS + 1] = {1.0, 2.0, RIM_PI, RIM_PI * 4.0 / 3.0};
  double l[PACKED];
  if (region->dims > RIM_REGION_MAX_DIMS || !factor(region, l)) {
    return 0.0;
  }
  double volume = unit_ball[region->dims];
  for (uint32_t i = 0; i < region->dims; ++i) {
    volume /= l[packed_row(i) + i];
  }
  return volume;
}

/* A, packed by rows of its lower triangle. */
static bool packed_shape(const rim_region *region, double a[PACKED]) {
  if (!factor(region, a)) {
    return false;
  }
  cholesky_invert_factor(region->dims, a);
  cholesky_square_inverse(region->dims, a);
  return true;
}

bool rimi_region_shape(const rim_region *region, double *shape) {
  const uint32_t dims = region->dims;
  double a[PACKED];
  if (!packed_shape(region, a)) {
    return false;
  }
  for (uint32_t i = 0; i < dims; ++i) {
    for (uint32_t j = 0; j < dims; ++j) {
      shape[i * dims + j] = a[i >= j ? packed_row(i) + j : packed_row(j) + i];
    }
  }
  return true;
}

rim_status rim_region_bounds(rim_region *region) {
  if (region == NULL) {
    return RIM_E_ARGUMENT;
  }
  if (region->dims > RIM_REGION_MAX_DIMS) {
    return RIM_E_RANGE;
  }
  double l[PACKED];
  if (!packed_shape(region, l)) {
    return RIM_E_SINGULAR;
  }
  for (uint32_t i = 0; i < RIM_REGION_MAX_DIMS; ++i) {
    const bool is_used = i < region->dims;
    const double half = is_used ? rimi_sqrt(l[packed_row(i) + i]) : 0.0;
    region->lower[i] = is_used ? region->center[i] - half : 0.0;
    region->upper[i] = is_used ? region->center[i] + half : 0.0;
  }
  return RIM_OK;
}

rim_status rimi_region_from_box(rim_region *region, uint8_t dims, const uint16_t *feature,
                                const double *lower, const double *upper) {
  if (region == NULL || (dims > 0 && (feature == NULL || lower == NULL || upper == NULL))) {
    return RIM_E_ARGUMENT;
  }
  if (dims > RIM_REGION_MAX_DIMS || !features_differ(dims, feature)) {
    return RIM_E_RANGE;
  }
  rim_region made = {.dims = dims};
  for (uint32_t i = 0; i < dims; ++i) {
    const double half = 0.5 * upper[i] - 0.5 * lower[i];
    const double inverse = 1.0 / (half * half);
    if (!(half > 0.0) || !rimi_is_finite(half) || !rimi_is_finite(inverse) || !(inverse > 0.0)) {
      return RIM_E_DATA;
    }
    made.feature[i] = feature[i];
    made.center[i] = 0.5 * lower[i] + 0.5 * upper[i];
    made.inverse_shape[i * dims + i] = inverse;
    made.lower[i] = lower[i];
    made.upper[i] = upper[i];
  }
  *region = made;
  return RIM_OK;
}
