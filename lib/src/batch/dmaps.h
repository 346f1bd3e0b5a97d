/* SPDX-License-Identifier: MIT */
/* rim/dmaps.h - detection of several RIMs: each observation explained once, simple explanations
 * preferred (thesis 3.3, p. 31-34, Alg. 3, p. 33).
 *
 * A set of regions is worth F = sum ln anom(R) - lambda(R) (eq. 3.12, p. 32), where an observation
 * counts in one region only (assumption 1, p. 31). lambda(R) is the price of a region:
 *   lambda                    a constant, eq. 3.15;
 *   + lambda_dim a feature    so that more dimensions must pay for themselves;
 *   + border * ln anom(N)     where R touches a more anomalous region N and shifts the same way:
 *                             what an ellipsoid leaves over of one effect at its rim is no further
 *                             region.
 *
 * Two forms:
 *   - rimi_dmaps_find(), over a finished set: candidates by FS-RIM (rim/select_batch.h) on what is
 *     not yet explained, then sequential optimisation of the set, in descending order of ln anom,
 *     each region on what the others leave; pairs that touch are replaced by one region where that
 *     is worth more. For the ground.
 *   - rimi_dmaps_step(), Alg. 3 as printed, one observation at a time over a caller's value
 *     function (as rim/faro.h for one region): bounded work a step, for use on board. */
#ifndef RIM_DMAPS_H
#define RIM_DMAPS_H

#include <stddef.h>
#include <stdint.h>

#include "batch/select_batch.h"
#include "rim/region.h"
#include "rim/status.h"
#include "search/cem.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_DMAPS_MAX_REGIONS 8

/* ---- a finished set of observations ---- */

/* Zero-initialise; 0 takes the default. */
typedef struct rim_dmaps_config {
  uint8_t regions;         /* at most, 1..8; 0: 8 */
  uint8_t sweeps;          /* of sequential optimisation, 1..8; 0: 2 */
  uint32_t least;          /* observations a region must hold; 0: 8 */
  double lambda;           /* nats; 0: 14. To be calibrated on nominal data (eq. 3.9, p. 30) */
  double lambda_dim;       /* nats a feature; 0: 2 */
  double border;           /* share, 0..1; 0: 0.1 */
  rim_batch_config search; /* candidates; its threshold has no meaning, NONE is refused. A zero cem
                              takes 16 samples, 4 elites, 5 iterations */
  rim_cem_config cem;      /* optimisation of a region */
} rim_dmaps_config;

typedef struct rim_dmaps_region {
  rim_region region; /* in unit features, bounds included */
  double ln_anom;    /* of the observations that it explains */
  double price;      /* lambda(R); at most ln_anom */
  uint32_t count;    /* observations that it explains */
} rim_dmaps_region;

typedef struct rim_dmaps_result {
  uint8_t count;                                  /* of regions */
  rim_dmaps_region region[RIM_DMAPS_MAX_REGIONS]; /* see below for their order */
  double value;                                   /* F */
  uint32_t searches;                              /* of FS-RIM, one a number of dimensions */
  uint32_t evaluations;                           /* of ellipsoids, each O(n); also FS-RIM's */
} rim_dmaps_result;

/* Bytes of work space: a constant expression, with `nodes` those of config.search (20 where that
 * is 0). Aligned to 8. */
#define RIM_DMAPS_SIZE(n, features, outcomes, nodes)                                               \
  (RIM_BATCH_SIZE(n, features, nodes) +                                                            \
   8u * (size_t)(n) * ((size_t)(features) + (size_t)(outcomes) + RIM_REGION_MAX_DIMS) +            \
   (((size_t)(n) + 7u) / 8u) * 8u + 8u * (size_t)(outcomes) * (RIM_DMAPS_MAX_REGIONS + 2u) +       \
   8192u)

/* Finds up to config.regions regions. skip[n]: observations that are not looked at (not 0); NULL:
 * none. An observation belongs to the first region of the result that contains it. The most
 * anomalous comes first, but where two overlap and the other order is worth more.
 *
 * RIM_E_ARGUMENT: NULL; RIM_E_ALIGN, RIM_E_SIZE: the work space; RIM_E_DATA: no observations;
 * RIM_E_CONFIG: a number out of range. *result is unchanged on error. Deterministic.
 * At most 5 * regions * max_dims searches and, besides, (3 + sweeps) * regions * 3 + 2 * regions^2
 * optimisations of samples * iterations + 1 evaluations. Stack below 7 kB in all. */
rim_status rimi_dmaps_find(const rim_dmaps_config *config, const rim_batch_data *data,
                           const uint8_t *skip, void *work, size_t bytes, rim_dmaps_result *result);

/* Climbs from one given region (in unit features, 1..3 of them; a box by rimi_region_from_box), over
 * all observations but skip's. The result is at least as anomalous as the start; price is that of a
 * region on its own, and may exceed ln_anom. Same work space and statuses; RIM_E_SINGULAR: the
 * region's shape; RIM_E_RANGE: its features or number of dimensions. samples * iterations + 1
 * evaluations. */
rim_status rimi_dmaps_optimise(const rim_dmaps_config *config, const rim_batch_data *data,
                               const uint8_t *skip, const rim_region *start, void *work,
                               size_t bytes, rim_dmaps_region *result);

/* Writes for every observation the number of its region, 1..count in the result's order, or 0; also
 * for other observations than the regions were found in. RIM_E_ARGUMENT: NULL (skip may be);
 * RIM_E_RANGE: a region over features that the data have not. O(n count dims^2). */
rim_status rimi_dmaps_assign(const rim_dmaps_result *result, const rim_batch_data *data,
                             const uint8_t *skip, uint8_t *assignment);

/* Most likely shift (eq. 3.6, p. 28) of every outcome over the observations of one region, in the
 * residuals' unit; 0 where it has none. RIM_E_ARGUMENT: NULL or number 0. O(n outcomes). */
rim_status rimi_dmaps_shift(const rim_batch_data *data, const uint8_t *assignment, uint8_t number,
                            double *shift);

/* ---- one observation at a time ---- */

/* ln anom of an ellipsoid over what is not inside any of taken[0..count); not NaN. */
typedef double (*rim_dmaps_value)(const rim_ellipsoid *ellipsoid, const rim_ellipsoid *taken,
                                  uint32_t count, void *context);

/* Zero-initialise, then fill. */
typedef struct rim_dmaps_pool_config {
  uint8_t dims;       /* 1..RIM_CEM_MAX_DIMS */
  uint8_t candidates; /* that survive a step, 1..8; 0: 8 */
  uint8_t spare;      /* of these, at most so many below lambda, kept for the next step; 0: none, as
                         printed in Alg. 3 */
  double radius;      /* of the ball about a new observation; 0: 0.1 */
  double lambda;      /* >= 0 */
  uint64_t seed;
  rim_cem_config cem; /* of each candidate, each step; 0: its defaults */
} rim_dmaps_pool_config;

/* All state; may be copied. */
typedef struct rim_dmaps_pool {
  rim_dmaps_pool_config config;
  uint32_t steps;
  uint32_t found; /* candidates 0..found-1 are the regions, none explains what another does */
  uint32_t count; /* the rest are spare */
  double total;   /* F of the regions, eq. 3.15 */
  rim_ellipsoid candidate[RIM_DMAPS_MAX_REGIONS + 1];
  double value[RIM_DMAPS_MAX_REGIONS + 1]; /* ln anom over what the regions before leave */
} rim_dmaps_pool;

/* RIM_E_ARGUMENT: NULL; RIM_E_CONFIG: a number out of range, the search's included; *pool is
 * unchanged then. */
rim_status rimi_dmaps_pool_init(rim_dmaps_pool *pool, const rim_dmaps_pool_config *config);

/* One step of Alg. 3. x: the latest observation, `dims` finite numbers. RIM_E_ARGUMENT: NULL;
 * RIM_E_DATA: x not finite. Nothing changed on error. (candidates + 1) optimisations and as many
 * evaluations; stack below 2.5 kB with that of value_of. */
rim_status rimi_dmaps_step(rim_dmaps_pool *pool, const double *x, rim_dmaps_value value_of,
                           void *context);

#ifdef __cplusplus
}
#endif
#endif
