/* SPDX-License-Identifier: MIT */
/* base/ellipsoid.h - private: regions in every frame of coordinates, and what is asked of them.
 *
 *   rim_region       features' units, features numbered as in the image (rim/region.h)
 *   rim_unit_region  the same in unit coordinates, in which a search works: of each feature its low
 *                    end is 0 and its high end 1; features numbered as the search has them
 *   rim_ellipsoid    only the ellipsoid's own coordinates, by a factor of A: a search may draw and
 *                    move its numbers, and it stays an ellipsoid
 *
 * The search of the monitor describes its regions by bins, see search/search.h. */
#ifndef RIM_BASE_ELLIPSOID_H
#define RIM_BASE_ELLIPSOID_H

#include <stdbool.h>
#include <stddef.h>

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

/* Returns whether the features are below `count` and all different. */
bool rimi_region_names_features(const rim_region *region, uint32_t count);

/* Writes A = (A^-1)^-1, dims x dims by rows. False, and nothing is written, where A^-1 is not
 * positive definite. O(dims^3). */
bool rimi_region_shape(const rim_region *region, double *shape);

/* Returns whether x lies in the closed box lower..upper; where lower > upper (an angle) in one of
 * its two outer parts. x is the whole context; NaN in a named feature lies outside. O(dims). */
bool rimi_region_box_contains(const rim_region *region, const double *x);

/* ---- unit coordinates ---- */

/* A type of its own: where units are meant the compiler refuses it. */
typedef struct rim_unit_region {
  rim_region unit; /* center, inverse_shape and bounds in unit coordinates */
} rim_unit_region;

/* As rim_region_contains, of a context in unit coordinates. */
bool rimi_unit_region_contains(const rim_unit_region *region, const double *u);

/* The same region in the features' units. Of its dimension i: the feature's index in the image, low
 * end and width. Bounds are converted as they stand. O(dims^2). */
rim_region rimi_region_from_unit(const rim_unit_region *region, const uint16_t *feature,
                                 const double *low, const double *width);

/* ---- ellipsoids by their factor ---- */

#define RIM_ELLIPSOID_MAX_DIMS 6

/* Points x of `dims` coordinates with |L^-1 (x - center)| < 1; A = L L^T (eq. 3.8). */
typedef struct rim_ellipsoid {
  uint8_t dims; /* 1..RIM_ELLIPSOID_MAX_DIMS */
  double center[RIM_ELLIPSOID_MAX_DIMS];
  double
      factor[RIM_ELLIPSOID_MAX_DIMS * (RIM_ELLIPSOID_MAX_DIMS + 1) / 2]; /* L by rows of its lower
                                       triangle: (i, j) at i (i + 1) / 2 + j; diagonal > 0 */
} rim_ellipsoid;

/* Whether the point lies inside; false for NaN. O(dims^2). */
bool rimi_ellipsoid_contains(const rim_ellipsoid *ellipsoid, const double *x);

/* The same question for many points: the divisions are done once. */
typedef struct ellipsoid_test {
  const rim_ellipsoid *ellipsoid;
  double inverse[RIM_ELLIPSOID_MAX_DIMS]; /* of the diagonal of L */
  bool is_box; /* the largest of |L^-1 (x - center)| counts, not its length */
} ellipsoid_test;
ellipsoid_test rimi_ellipsoid_test(const rim_ellipsoid *ellipsoid, bool is_box);
bool rimi_ellipsoid_holds(const ellipsoid_test *test, const double *x);

/* The ball of this radius. dims and radius are not checked. */
rim_ellipsoid rimi_ellipsoid_ball(uint8_t dims, const double *center, double radius);

/* Half the side of its bounding box along coordinate k: the root of A's diagonal. */
double rimi_ellipsoid_half_side(const rim_ellipsoid *ellipsoid, size_t k);

/* The same set as a region over the named features, bounds included. RIM_E_ARGUMENT: NULL;
 * RIM_E_RANGE: dims above RIM_REGION_MAX_DIMS; RIM_E_SINGULAR: a diagonal entry of L not above
 * 0. */
rim_status rimi_ellipsoid_region(const rim_ellipsoid *ellipsoid, const uint16_t *feature,
                                 rim_unit_region *region);

#ifdef __cplusplus
}
#endif
#endif
