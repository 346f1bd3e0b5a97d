/* SPDX-License-Identifier: MIT */
/* rim/region.h - an ellipsoid over a few of the features: where something is wrong.
 *
 * The set of contexts with (x_f - u)^T A^-1 (x_f - u) < 1 (eq. 3.8, p. 29), x_f the chosen features
 * of x; the features that are not named do not matter. With dims 0 it is every context. */
#ifndef RIM_REGION_H
#define RIM_REGION_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_REGION_MAX_DIMS 3

/* All zero: everywhere. Entries beyond dims have no meaning and are kept 0 by this module. */
typedef struct rim_region {
  uint8_t dims;                          /* 0..RIM_REGION_MAX_DIMS */
  uint16_t feature[RIM_REGION_MAX_DIMS]; /* indices into the context, all different */
  double center[RIM_REGION_MAX_DIMS];    /* u, in the features' units */
  double inverse_shape[RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS]; /* A^-1, dims x dims by rows */
  double lower[RIM_REGION_MAX_DIMS]; /* box around it; filled by rim_region_bounds */
  double upper[RIM_REGION_MAX_DIMS];
} rim_region;

/* Returns whether the region is well formed: dims in range, features all different, centre and
 * shape finite, A^-1 symmetric (1e-9 of the geometric mean of the diagonal) and positive definite.
 * The bounds are not looked at. False for NULL. O(dims^3). */
bool rimi_region_is_valid(const rim_region *region);

/* Returns (x_f - u)^T A^-1 (x_f - u); 0 when dims is 0. x is the whole context, long enough for
 * every feature named; NaN in a named feature gives NaN. Trusts a valid region. O(dims^2). */
double rimi_region_distance2(const rim_region *region, const double *x);

/* Returns whether x, the whole context, lies inside: distance2 < 1. NaN lies outside. */
bool rim_region_contains(const rim_region *region, const double *x);

/* Returns the volume in the product of the features' units: length 2 sqrt A, area pi sqrt det A, or
 * 4/3 pi sqrt det A. 1 when dims is 0; 0 when A^-1 is not positive definite. O(dims^3). */
double rimi_region_volume(const rim_region *region);

/* Fills lower and upper with the tight box u -+ sqrt diag A. RIM_E_ARGUMENT NULL; RIM_E_RANGE dims;
 * RIM_E_SINGULAR A^-1 not positive definite: nothing is written. O(dims^3). */
rim_status rim_region_bounds(rim_region *region);

/* Makes the ellipsoid with its axes along the features that touches every face of a box: in one
 * dimension the open interval (lower, upper). Also sets the bounds.
 * RIM_E_ARGUMENT NULL; RIM_E_RANGE dims above RIM_REGION_MAX_DIMS or a feature named twice;
 * RIM_E_DATA a bound not finite, not lower < upper, or too narrow to be squared. Unchanged on
 * error. */
rim_status rimi_region_from_box(rim_region *region, uint8_t dims, const uint16_t *feature,
                                const double *lower, const double *upper);

#ifdef __cplusplus
}
#endif
#endif
