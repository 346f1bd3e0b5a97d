/* SPDX-License-Identifier: MIT */
#include "base/ellipsoid.h"

#include <stddef.h>
#include <string.h>

#include "base/real.h"

ellipsoid_test rimi_ellipsoid_test(const rim_ellipsoid *e, bool is_box) {
  ellipsoid_test test = {.ellipsoid = e, .is_box = is_box};
  for (size_t i = 0; i < e->dims; ++i)
    test.inverse[i] = 1.0 / e->factor[i * (i + 1) / 2 + i];
  return test;
}

bool rimi_ellipsoid_holds(const ellipsoid_test *test, const double *x) {
  const rim_ellipsoid *e = test->ellipsoid;
  double z[RIM_ELLIPSOID_MAX_DIMS];
  double norm2 = 0.0; /* the square of either norm; it only grows */
  const double *row = e->factor;
  for (size_t i = 0; i < e->dims; row += ++i) {
    double rest = x[i] - e->center[i];
    for (size_t j = 0; j < i; ++j)
      rest -= row[j] * z[j];
    z[i] = rest * test->inverse[i];
    norm2 = test->is_box ? z[i] * z[i] : norm2 + z[i] * z[i];
    if (!(norm2 < 1.0))
      return false;
  }
  return true;
}

bool rimi_ellipsoid_contains(const rim_ellipsoid *e, const double *x) {
  const ellipsoid_test test = rimi_ellipsoid_test(e, false);
  return rimi_ellipsoid_holds(&test, x);
}

double rimi_ellipsoid_half_side(const rim_ellipsoid *e, size_t k) {
  double square = 0.0;
  for (size_t j = 0; j <= k; ++j) {
    const double entry = e->factor[k * (k + 1) / 2 + j];
    square += entry * entry;
  }
  return rimi_sqrt(square);
}

rim_ellipsoid rimi_ellipsoid_ball(uint8_t dims, const double *center, double radius) {
  rim_ellipsoid e;
  memset(&e, 0, sizeof e);
  e.dims = dims;
  for (size_t i = 0; i < dims; ++i) {
    e.center[i] = center[i];
    e.factor[i * (i + 1) / 2 + i] = radius;
  }
  return e;
}

rim_status rimi_ellipsoid_region(const rim_ellipsoid *e, const uint16_t *feature,
                                 rim_unit_region *region) {
  if (e == NULL || feature == NULL || region == NULL)
    return RIM_E_ARGUMENT;
  if (e->dims < 1 || e->dims > RIM_REGION_MAX_DIMS)
    return RIM_E_RANGE;
  const size_t dims = e->dims;
  double inverse[RIM_REGION_MAX_DIMS][RIM_REGION_MAX_DIMS] = {{0.0}}; /* L^-1 */
  for (size_t j = 0; j < dims; ++j) {
    for (size_t i = j; i < dims; ++i) {
      const double *row = e->factor + i * (i + 1) / 2;
      if (!(row[i] > 0.0))
        return RIM_E_SINGULAR;
      double rest = i == j ? 1.0 : 0.0;
      for (size_t k = j; k < i; ++k)
        rest -= row[k] * inverse[k][j];
      inverse[i][j] = rest / row[i];
    }
  }
  rim_region out;
  memset(&out, 0, sizeof out);
  out.dims = e->dims;
  for (size_t i = 0; i < dims; ++i) {
    out.feature[i] = feature[i];
    out.center[i] = e->center[i];
    for (size_t j = 0; j < dims; ++j) {
      double sum = 0.0;
      for (size_t k = 0; k < dims; ++k)
        sum += inverse[k][i] * inverse[k][j];
      out.inverse_shape[i * dims + j] = sum;
    }
  }
  const rim_status status = rim_region_bounds(&out);
  if (status == RIM_OK)
    region->unit = out;
  return status;
}
