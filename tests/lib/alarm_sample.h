/* SPDX-License-Identifier: MIT */
/* alarm_sample.h - alarm records for the tests of their codecs: every field filled, from a seed. */
#ifndef ALARM_SAMPLE_H
#define ALARM_SAMPLE_H

#include <string.h>

#include "rim/alarm.h"

static inline uint32_t sample_next(uint32_t *state) {
  *state = *state * 1664525u + 1013904223u;
  return *state >> 8;
}

static inline double sample_between(uint32_t *state, double low, double high) {
  return low + (high - low) * (double)sample_next(state) / 16777216.0;
}

/* A valid record; its axis-aligned region has diagonal A^-1 and a box that fits. */
static inline rim_alarm sample_alarm(uint32_t seed) {
  uint32_t state = seed * 2654435761u + 1u;
  rim_alarm a;
  memset(&a, 0, sizeof a);
  a.t_s = sample_between(&state, 0.0, 4000.0);
  a.since_s = a.t_s * 0.5;
  a.seq = sample_next(&state) * 256u + sample_next(&state) % 256u;
  a.model_id = sample_next(&state) * 256u + 7u;
  a.observations = sample_next(&state) % 100000u;
  a.detector = (uint8_t)(sample_next(&state) % 2u);
  a.state = (uint8_t)(sample_next(&state) % 4u);
  a.level = (uint8_t)(sample_next(&state) % 4u);
  a.kind = (uint8_t)(sample_next(&state) % (RIM_KIND_PUSHED + 1u));
  a.flags = (uint8_t)(sample_next(&state) % 4u);
  a.channels = (uint8_t)(1u + sample_next(&state) % RIM_ALARM_MAX_CHANNELS);
  for (uint32_t i = 0; i < a.channels; ++i) {
    a.channel[i] = (uint16_t)(sample_next(&state) % 65536u);
    a.shift[i] = sample_between(&state, -50.0, 50.0);
    a.shift_sd[i] = sample_between(&state, 0.01, 5.0);
  }
  a.region.dims = (uint8_t)(sample_next(&state) % (RIM_REGION_MAX_DIMS + 1u));
  for (uint32_t d = 0; d < a.region.dims; ++d) {
    const double half = sample_between(&state, 0.5, 20.0);
    a.region.feature[d] = (uint16_t)(sample_next(&state) % 1000u * 3u + d);
    a.region.center[d] = sample_between(&state, -100.0, 100.0);
    a.region.inverse_shape[d * a.region.dims + d] = 1.0 / (half * half);
    a.region.lower[d] = a.region.center[d] - half;
    a.region.upper[d] = a.region.center[d] + half;
  }
  a.ln_anom = sample_between(&state, 0.0, 900.0);
  a.threshold = sample_between(&state, 1.0, 30.0);
  a.p_value = sample_between(&state, 0.001, 0.2);
  a.since_sd_s = sample_between(&state, 0.0, 3.0);
  return a;
}

#endif
