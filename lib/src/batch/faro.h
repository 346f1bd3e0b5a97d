/* SPDX-License-Identifier: MIT */
/* rim/faro.h - detection of a single RIM by focused optimisation (thesis Alg. 2, p. 30).
 *
 * Keeps a bounded set of candidate ellipsoids. Every step a ball around the latest observation
 * joins it, every candidate is optimised (rim/cem.h), the best is compared with the threshold, and
 * the set is cut to its best. Where the data are is the caller's business: only a value function is
 * asked. */
#ifndef RIM_FARO_H
#define RIM_FARO_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/status.h"
#include "search/cem.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_FARO_MAX_CANDIDATES 16

/* Zero-initialise, then fill. */
typedef struct rim_faro_config {
  uint8_t dims;       /* 1..RIM_CEM_MAX_DIMS */
  uint8_t candidates; /* |R|max, 1..16; 0: 5 */
  double radius;      /* of the ball about a new observation; 0: 0.1 */
  uint64_t seed;
  rim_cem_config cem; /* of each candidate, each step; 0: its defaults */
} rim_faro_config;

/* All state; may be copied. */
typedef struct rim_faro {
  rim_faro_config config;
  uint32_t steps;
  uint32_t count;
  rim_ellipsoid candidate[RIM_FARO_MAX_CANDIDATES + 1]; /* descending by value */
  double value[RIM_FARO_MAX_CANDIDATES + 1];
} rim_faro;

/* RIM_E_ARGUMENT: NULL; RIM_E_CONFIG: a number out of range; *faro is unchanged then. */
rim_status rimi_faro_init(rim_faro *faro, const rim_faro_config *config);

/* One step. x: the latest observation, `dims` finite numbers. *found: the best candidate's value is
 * at least the threshold (line 6); it is faro->candidate[0] either way. RIM_E_ARGUMENT: NULL;
 * RIM_E_DATA: x not finite; RIM_E_CONFIG: the configuration of the search. Nothing changed on
 * error. (candidates + 1) optimisations; stack below 4 kB with that of value_of. */
rim_status rimi_faro_step(rim_faro *faro, const double *x, rim_cem_value value_of, void *context,
                          double threshold, bool *found);

#ifdef __cplusplus
}
#endif
#endif
