/* SPDX-License-Identifier: MIT */
/* search/cem.h - bounded cross-entropy search over ellipsoids (thesis 3.2, p. 29: "we have used the
 * Cross-Entropy Method").
 *
 * An ellipsoid is a centre and a Cholesky factor L, A = L L^T of eq. 3.8: positive definite
 * whatever is drawn, since the diagonal is drawn as its logarithm. Each iteration draws `samples`
 * ellipsoids from independent normal distributions over these (dims^2 + 3 dims) / 2 parameters, and
 * moves mean and spread towards those of the `elites` best. Sample i of iteration t is a pure
 * function of (seed, stream, t, i): results do not depend on timing, and elites are drawn again
 * instead of stored. */
#ifndef RIM_CEM_H
#define RIM_CEM_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ellipsoid.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_CEM_MAX_DIMS RIM_ELLIPSOID_MAX_DIMS
#define RIM_CEM_MAX_SAMPLES 1024
#define RIM_CEM_MAX_ELITES 16
#define RIM_CEM_PARAMETERS(dims) ((dims) + (dims) * ((dims) + 1u) / 2u)

/* Zero-initialise; 0 takes the default. */
typedef struct rim_cem_config {
  uint16_t samples;    /* per iteration, 2..1024; 0: 24 */
  uint16_t elites;     /* 1..16 and at most samples; 0: 5 */
  uint16_t iterations; /* 0: 10 */
  double smoothing;    /* weight of the old mean and spread, [0, 1); 0: none */
  double spread;       /* first standard deviation of centre and factor, in units of the start's
                          smallest diagonal entry; 0: 0.5 */
  double least_axis;   /* diagonal of L is kept within [least, most]; 0: 0.02 */
  double most_axis;    /* 0: 1 */
} rim_cem_config;

/* Value of an ellipsoid; larger is better; not NaN. */
typedef double (*rim_cem_value)(const rim_ellipsoid *ellipsoid, void *context);

/* Whether rimi_cem_optimise accepts the configuration in `dims` dimensions; false for NULL. */
bool rimi_cem_is_valid(const rim_cem_config *config, uint8_t dims);

/* Climb from *best. On success *best and *value are the best ellipsoid seen, the start included.
 * RIM_E_ARGUMENT: NULL; RIM_E_CONFIG: configuration or dims out of range: nothing changed.
 * samples * iterations + 1 evaluations; stack below 2 kB. */
rim_status rimi_cem_optimise(const rim_cem_config *config, rim_cem_value value_of, void *context,
                             uint64_t seed, uint64_t stream, rim_ellipsoid *best, double *value);

#ifdef __cplusplus
}
#endif
#endif
