/* SPDX-License-Identifier: MIT */
/* rim/region.h - an ellipsoid over a few of the features: where something is wrong.
 * The set of contexts x with (x_f - u)^T A^-1 (x_f - u) < 1 (thesis eq. 3.8, p. 29), where x_f are
 * the features named; the other features do not matter. With dims 0 it is every context. */
#ifndef RIM_REGION_H
#define RIM_REGION_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_REGION_MAX_DIMS 3

/* All zero means everywhere. Entries beyond dims have no meaning; the library keeps them 0. */
typedef struct rim_region {
  uint8_t dims;                          /* 0..RIM_REGION_MAX_DIMS */
  uint16_t feature[RIM_REGION_MAX_DIMS]; /* indices into the context, all different */
  double center[RIM_REGION_MAX_DIMS];    /* u, in the features' units */
  double inverse_shape[RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS]; /* A^-1, dims x dims by rows */
  double lower[RIM_REGION_MAX_DIMS]; /* box around it; rim_region_bounds fills it in */
  double upper[RIM_REGION_MAX_DIMS];
} rim_region;

/* Returns whether x lies inside. x is the whole context: long enough for every feature that the
 * region names. NaN in a named feature lies outside. The region is not checked. O(dims^2). */
bool rim_region_contains(const rim_region *region, const double *x);

/* Fills lower and upper with the smallest box around the ellipsoid, u -+ sqrt diag A. Returns
 * RIM_E_ARGUMENT for NULL, RIM_E_RANGE for dims out of range, and RIM_E_SINGULAR where A^-1 is not
 * positive definite; on an error nothing is written. O(dims^3). */
rim_status rim_region_bounds(rim_region *region);

#ifdef __cplusplus
}
#endif
#endif
