/* SPDX-License-Identifier: MIT */
/* batch/select_batch.h - FS-RIM over a finished set of observations (thesis Alg. 4, p. 50).
 *
 * Best-first search over subsets of features: an edge (F, f) adds feature f to an explored set F,
 * and the edge with the largest heuristic value is explored next:
 *   - H1: anom(R_F) + anom(R_f), eq. 4.3, p. 51;
 *   - H2: anom of the intersection of R_F and R_f, eq. 4.4, p. 53;
 *   - H3: anom of the best interval along f among the points of R_F, eq. 4.5, p. 53;
 *   - BREADTH: fewest features first, in order of arrival (BFS of 4.2.1, p. 54);
 *   - NONE: no selection, one search over all features together (No FS of 4.2.1).
 *
 * One feature: the exact interval over bins (App. A, p. 115). More: cross-entropy (search/cem.h)
 * from the box of R_F and the conditional interval, and from balls around observations (Alg. 2, p.
 * 30).
 *
 * For use on the ground and for comparison; on board see search/select.h. Work and memory are
 * bounded by the configuration, the memory is the caller's. */
#ifndef RIM_SELECT_BATCH_H
#define RIM_SELECT_BATCH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/region.h"
#include "rim/status.h"
#include "search/cem.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_BATCH_MAX_NODES 1024
#define RIM_BATCH_MAX_BINS 64

typedef enum rim_heuristic {
  RIM_HEURISTIC_H3 = 0,
  RIM_HEURISTIC_H2 = 1,
  RIM_HEURISTIC_H1 = 2,
  RIM_HEURISTIC_BREADTH = 3,
  RIM_HEURISTIC_NONE = 4 /* at most RIM_CEM_MAX_DIMS features */
} rim_heuristic;

/* The observations, in the caller's memory. Finite numbers; not checked one by one. */
typedef struct rim_batch_data {
  uint32_t n;
  uint16_t features; /* 1..128 */
  uint16_t outcomes; /* 1..128; their ln anom add up: eq. 3.7 with diagonal covariance */
  const double *u;   /* [n][features], unit features */
  const double *r;   /* [n][outcomes], residuals of nominal variance 1 */
} rim_batch_data;

/* Zero-initialise; 0 takes the default. */
typedef struct rim_batch_config {
  rim_heuristic heuristic;
  uint16_t nodes;   /* i_max: feature sets explored, 1..1024; 0: 20 */
  uint8_t max_dims; /* features a set may have, 1..RIM_REGION_MAX_DIMS; 0: 2 */
  uint8_t bins;     /* per feature, 4..64; 0: 32 */
  uint8_t balls;    /* further starts of a search; 0: 2 */
  double threshold; /* a_thresh as ln anom (line 14); 0: anything is found */
  uint64_t seed;
  rim_cem_config cem;
} rim_batch_config;

typedef struct rim_batch_result {
  bool found;   /* ln_anom > threshold */
  uint8_t dims; /* of ellipsoid */
  uint16_t feature[RIM_CEM_MAX_DIMS];
  rim_ellipsoid ellipsoid;
  rim_unit_region region; /* the same; dims 0 where it has more than RIM_REGION_MAX_DIMS */
  double ln_anom;
  uint32_t inside;      /* observations */
  uint32_t nodes;       /* feature sets explored */
  uint32_t evaluations; /* of ellipsoids, each O(n) */
} rim_batch_result;

/* Bytes of work space: a constant expression; nodes explicit. Aligned to 8. */
#define RIM_BATCH_NODE_BYTES 400u
/* n (features + outcomes + nodes + 3) may be at most this, so that no size overflows 32 bits. */
#define RIM_BATCH_MOST UINT32_C(0x8000000)
#define RIM_BATCH_SIZE(n, features, nodes)                                                         \
  ((size_t)(nodes) *                                                                               \
       (RIM_BATCH_NODE_BYTES + 8u * (size_t)(features) + (((size_t)(n) + 63u) / 64u) * 8u) +       \
   24u * (size_t)(features) + 1024u)

/* Whether the sizes of so much data are within RIM_BATCH_MOST. */
bool rimi_batch_fits(const rim_batch_data *data, uint32_t nodes);

/* RIM_E_ARGUMENT: NULL; RIM_E_ALIGN, RIM_E_SIZE: the work space, or more observations than
 * RIM_BATCH_MOST allows; RIM_E_DATA: no observations; RIM_E_CONFIG: a count out of range, too many
 * features for NONE. *result is unchanged on error. O(nodes * (features * (n + bins^2) * outcomes +
 * starts * samples * iterations * n * dims^2)). Stack below 4 kB in all. */
rim_status rimi_select_batch(const rim_batch_config *config, const rim_batch_data *data, void *work,
                             size_t bytes, rim_batch_result *result);

#ifdef __cplusplus
}
#endif
#endif
