/* SPDX-License-Identifier: MIT */
/* base/ellipsoid.h - private: what the library itself asks of a rim_region (rim/region.h). */
#ifndef RIM_BASE_ELLIPSOID_H
#define RIM_BASE_ELLIPSOID_H

#include <stdbool.h>

#include "rim/region.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Returns whether the region is well formed: dims in range, features all different, centre and
 * shape finite, A^-1 symmetric (within 1e-9 of the geometric mean of the diagonal) and positive
 * definite. The bounds are not looked at. False for NULL. O(dims^3). */
bool rimi_region_is_valid(const rim_region *region);

/* Returns (x_f - u)^T A^-1 (x_f - u), and 0 when dims is 0. x is the whole context; NaN in a named
 * feature gives NaN. The region is not checked. O(dims^2). */
double rimi_region_distance2(const rim_region *region, const double *x);

/* Returns the volume in the product of the features' units: length 2 sqrt A, area pi sqrt det A, or
 * 4/3 pi sqrt det A. 1 when dims is 0; 0 when A^-1 is not positive definite. O(dims^3). */
double rimi_region_volume(const rim_region *region);

/* Makes the ellipsoid with its axes along the features that touches every face of a box: in one
 * dimension the open interval (lower, upper). Also sets the bounds. Returns RIM_E_ARGUMENT for
 * NULL; RIM_E_RANGE for dims above RIM_REGION_MAX_DIMS or a feature named twice; RIM_E_DATA for a
 * bound that is not finite, not lower < upper, or too narrow to be squared. Unchanged on error. */
rim_status rimi_region_from_box(rim_region *region, uint8_t dims, const uint16_t *feature,
                                const double *lower, const double *upper);

#ifdef __cplusplus
}
#endif
#endif
