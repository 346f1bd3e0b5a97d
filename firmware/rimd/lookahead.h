/* SPDX-License-Identifier: MIT */
/* lookahead.h - does the plan lead the vehicle into a region that an alarm names? (thesis 1.2.1:
 * learn to avoid entering these contexts)
 *
 * The vehicle is a convex footprint carried along planned poses; between two poses it is the convex
 * hull of both (exact for a translation, and beyond what a turn of less than half a circle sweeps
 * by no more than the turn's own bow). The region is the alarm's ellipsoid over those of its
 * features that are axes of physical space, without a limit along axes that it does not name.
 * Intersections by libccd's MPR, which takes no heap. */
#ifndef LOOKAHEAD_H
#define LOOKAHEAD_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/can.h"
#include "rim/region.h"

#define LOOKAHEAD_VERTICES 16u
#define LOOKAHEAD_NO_AXIS 0xffffu

typedef struct lookahead_config {
  uint16_t axis[3];  /* features that are x, y, z of a pose; LOOKAHEAD_NO_AXIS: none is */
  uint32_t vertices; /* of the footprint, in the vehicle's frame; 0: it is a point */
  double vertex[LOOKAHEAD_VERTICES][3];
  double margin_m; /* kept around the footprint, >= 0 */
} lookahead_config;

typedef struct lookahead_result {
  bool enters;
  double after_s; /* of the plan, when the footprint begins to overlap; resolution: 1/256 of the
                     time between two poses */
  uint32_t pose;  /* the one before */
} lookahead_result;

/* Whether a region lies in physical space: it names at least one axis, and nothing else. */
bool lookahead_is_physical(const lookahead_config *config, const rim_region *region);

/* Looks along the plan from after_s = from_s on. False: the region does not lie in physical space,
 * or is none (its matrix is not positive definite). At most 72 intersections of at most 64
 * iterations, O(vertices) each. */
bool lookahead_check(const lookahead_config *config, const rim_region *region, const rim_plan *plan,
                     double from_s, lookahead_result *result);

#endif
