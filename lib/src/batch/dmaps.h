/* SPDX-License-Identifier: MIT */
/* batch/dmaps.h - detection of several RIMs: each observation explained once, simple explanations
 * preferred (thesis 3.3, p. 31-34, Alg. 3, p. 33).
 *
 * A set of regions is worth F = sum ln anom(R) - lambda(R) (eq. 3.12, p. 32), where an observation
 * counts in one region only (assumption 1, p. 31). lambda(R) is the price of a region:
 *   lambda                    a constant, eq. 3.15;
 *   + lambda_dim a feature    so that more dimensions must pay for themselves;
 *   + border * ln anom(N)     where R touches a more anomalous region N and shifts the same way:
 *                             what an ellipsoid does not cover of an effect is no further region.
 *
 * Candidates come from FS-RIM (batch/select_batch.h) on what is not yet explained. The set is then
 * optimised in descending order of ln anom, each region on what the others leave; two regions that
 * touch are replaced by one where that is worth more. */
#ifndef RIM_DMAPS_H
#define RIM_DMAPS_H

#include <stddef.h>
#include <stdint.h>

#include "base/ellipsoid.h"
#include "batch/select_batch.h"
#include "rim/region.h"
#include "rim/status.h"
#include "search/cem.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_DMAPS_MAX_REGIONS 8

/* Zero-initialise; 0 takes the default. */
typedef struct rim_dmaps_config {
  uint8_t regions;         /* at most, 1..8; 0: 8 */
  uint8_t sweeps;          /* of sequential optimisation, 1..8; 0: 2 */
  uint32_t least;          /* observations a region must hold; 0: 8 */
  double lambda;           /* nats; 0: 14. To be calibrated on nominal data (eq. 3.9, p. 30) */
  double lambda_dim;       /* nats per feature; 0: 2 */
  double border;           /* share, 0..1; 0: 0.1 */
  rim_batch_config search; /* candidates; its threshold has no meaning, NONE is refused. A zero cem
                              takes 16 samples, 4 elites, 5 iterations */
  rim_cem_config cem;      /* optimisation of a region */
} rim_dmaps_config;

typedef struct rim_dmaps_region {
  rim_unit_region region; /* bounds included */
  double ln_anom;         /* of the observations that it explains */
  double price;           /* lambda(R); at most ln_anom */
  uint32_t count;         /* observations that it explains */
} rim_dmaps_region;

typedef struct rim_dmaps_result {
  uint8_t count;                                  /* of regions */
  rim_dmaps_region region[RIM_DMAPS_MAX_REGIONS]; /* see below for their order */
  double value;                                   /* F */
  uint32_t searches;                              /* of FS-RIM, one per number of dimensions */
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
 * none. An observation belongs to the first region of the result that contains it. Sorted by ln
 * anom, except that overlapping regions keep the order with the larger total.
 *
 * RIM_E_ARGUMENT: NULL; RIM_E_ALIGN, RIM_E_SIZE: the work space; RIM_E_DATA: no observations;
 * RIM_E_CONFIG: a number out of range. *result is unchanged on error. Deterministic.
 * At most 5 * regions * max_dims searches and, besides, (3 + sweeps) * regions * 3 + 2 * regions^2
 * optimisations of samples * iterations + 1 evaluations. Stack below 7 kB in all. */
rim_status rimi_dmaps_find(const rim_dmaps_config *config, const rim_batch_data *data,
                           const uint8_t *skip, void *work, size_t bytes, rim_dmaps_result *result);

/* Writes for every observation the number of its region, 1..count in the result's order, or 0; also
 * for other observations than the regions were found in. RIM_E_ARGUMENT: NULL (skip may be);
 * RIM_E_RANGE: a region over features that the data have not. O(n count dims^2). */
rim_status rimi_dmaps_assign(const rim_dmaps_result *result, const rim_batch_data *data,
                             const uint8_t *skip, uint8_t *assignment);

/* Most likely shift (eq. 3.6, p. 28) of every outcome over the observations of one region, in the
 * residuals' unit; 0 where it has none. RIM_E_ARGUMENT: NULL or number 0. O(n outcomes). */
rim_status rimi_dmaps_shift(const rim_batch_data *data, const uint8_t *assignment, uint8_t number,
                            double *shift);

#ifdef __cplusplus
}
#endif
#endif
