/* SPDX-License-Identifier: MIT */
#include "batch/faro.h"

#include <stddef.h>
#include <string.h>

#include "base/real.h"

#define STREAMS_A_STEP 32u /* above RIM_FARO_MAX_CANDIDATES */

rim_status rimi_faro_init(rim_faro *faro, const rim_faro_config *config) {
  if (faro == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  rim_faro_config c = *config;
  if (c.candidates == 0)
    c.candidates = 5;
  if (c.radius == 0.0)
    c.radius = 0.1;
  if (c.dims < 1 || c.dims > RIM_CEM_MAX_DIMS || c.candidates > RIM_FARO_MAX_CANDIDATES) {
    return RIM_E_CONFIG;
  }
  if (!(c.radius > 0.0) || !rimi_is_finite(c.radius))
    return RIM_E_CONFIG;
  memset(faro, 0, sizeof *faro);
  faro->config = c;
  return RIM_OK;
}

/* Insertion by descending value; the earlier of equals stays first. */
static void sort(rim_faro *faro) {
  for (uint32_t i = 1; i < faro->count; ++i) {
    for (uint32_t j = i; j > 0 && faro->value[j] > faro->value[j - 1]; --j) {
      const rim_ellipsoid candidate = faro->candidate[j];
      const double value = faro->value[j];
      faro->candidate[j] = faro->candidate[j - 1];
      faro->value[j] = faro->value[j - 1];
      faro->candidate[j - 1] = candidate;
      faro->value[j - 1] = value;
    }
  }
}

rim_status rimi_faro_step(rim_faro *faro, const double *x, rim_cem_value value_of, void *context,
                          double threshold, bool *found) {
  if (faro == NULL || x == NULL || value_of == NULL || found == NULL)
    return RIM_E_ARGUMENT;
  for (size_t i = 0; i < faro->config.dims; ++i) {
    if (!rimi_is_finite(x[i]))
      return RIM_E_DATA;
  }
  /* The ball takes the spare place behind the set, so that an error leaves the set as it was. */
  faro->candidate[faro->count] = rimi_ellipsoid_ball(faro->config.dims, x, faro->config.radius);
  for (uint32_t step = 0; step <= faro->count; ++step) {
    const uint32_t i = step == 0 ? faro->count : step - 1; /* the ball first: it tests the config */
    const uint64_t stream = (uint64_t)faro->steps * STREAMS_A_STEP + i;
    const rim_status status =
        rimi_cem_optimise(&faro->config.cem, value_of, context, faro->config.seed, stream,
                          &faro->candidate[i], &faro->value[i]);
    if (status != RIM_OK)
      return status;
  }
  ++faro->count;
  ++faro->steps;
  sort(faro);
  if (faro->count > faro->config.candidates)
    faro->count = faro->config.candidates;
  *found = faro->value[0] >= threshold;
  return RIM_OK;
}
