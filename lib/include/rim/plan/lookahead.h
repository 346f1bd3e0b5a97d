/* SPDX-License-Identifier: MIT */
/* rim/plan/lookahead.h - does the plan lead the vehicle into the region that an alarm names?
 * (thesis 1.2.1: learn to avoid entering these contexts)
 *
 * The vehicle is a convex footprint that is carried along planned poses. Between two poses it is
 * the convex hull of both: exact for a translation; for a turn of less than half a circle the hull
 * differs from what is swept by at most the sagitta of the arc. The region is the alarm's ellipsoid
 * over those of its features that are axes of physical space, without a limit along the others. */
#ifndef RIM_LOOKAHEAD_H
#define RIM_LOOKAHEAD_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/lcm.h"
#include "rim/monitor.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_LOOKAHEAD_VERTICES 16u
#define RIM_LOOKAHEAD_NO_AXIS 0xffffu

typedef struct rim_lookahead_config {
  uint16_t axis[3];  /* features that are x, y, z of a pose; RIM_LOOKAHEAD_NO_AXIS: none is */
  uint32_t vertices; /* of the footprint, in the vehicle's frame; 0: it is a point */
  double vertex[RIM_LOOKAHEAD_VERTICES][3]; /* m */
  double margin_m;                          /* kept around the footprint, >= 0 */
} rim_lookahead_config;

typedef struct rim_lookahead_result {
  bool enters;
  double after_s; /* of the plan, when the footprint begins to overlap the region; resolution:
                     1/256 of the time between two poses, never late */
  uint32_t pose;  /* the one before */
} rim_lookahead_result;

/* Returns whether a region lies in physical space: it names at least one axis, and nothing else. */
bool rim_lookahead_is_physical(const rim_lookahead_config *config, const rim_region *region);

/* Looks along the plan from after_s = from_s on. Returns false where the region does not lie in
 * physical space, or is none (its matrix is not positive definite). At most 72 tests for overlap of
 * at most 128 steps, O(vertices) each; a test that does not end in that many counts as an overlap.
 * Stack below 2 kB. */
bool rim_lookahead_check(const rim_lookahead_config *config, const rim_region *region,
                         const rim_plan *plan, double from_s, rim_lookahead_result *result);

/* What is kept between two calls of rim_lookahead_update. Plain data; all zero: nothing yet. */
typedef struct rim_lookahead {
  rim_plan plan;     /* the newest; count 0: none */
  rim_entry told;    /* the newest record that was due; sequence 0: none */
  uint32_t sequence; /* of the newest record */
} rim_lookahead;

/* Decides whether a record about the entry is due at row_s, the time of the newest row. One is due
 * when the plan begins or ceases to lead into the region of the standing alarm of the regions
 * (RIM_DETECTOR_RIM), and with `again` also while it does. Returns whether *entry must be sent;
 * false for NULL. Cost as rim_lookahead_check. */
bool rim_lookahead_update(rim_lookahead *state, const rim_lookahead_config *config,
                          const rim_monitor *monitor, uint32_t model_id, double row_s, bool replay,
                          bool again, rim_entry *entry);

#ifdef __cplusplus
}
#endif
#endif
