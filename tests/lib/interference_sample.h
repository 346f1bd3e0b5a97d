/* SPDX-License-Identifier: MIT */
/* interference_sample.h - a model of motion interference for tests: a vehicle of latency 0.1 s and
 * limits of 1 and 2 m/s^2 that is let alone, pushed, blocked, turned or stopped. */
#ifndef INTERFERENCE_SAMPLE_H
#define INTERFERENCE_SAMPLE_H

#include <string.h>

#include "interference/detector.h"

static inline rim_interference_model sample_interference(void) {
  const double p = 5e-8;
  rim_interference_model m = {.ln_odds = 8.0,
                              .latency_s = 0.1,
                              .accel_mps2 = 1.0,
                              .decel_mps2 = 2.0,
                              .settle_s = 0.2,
                              .gap_s = 0.5,
                              .one_step = {0.03, 0.06, 1.0, 8.0},
                              .open_loop = {0.03, 0.06, 1.0, 12.0}};
  const double mean[5][3] = {
      {0.0, 0.0, 0.0}, {0.35, 0.9, 0.0}, {0.0, 0.0, 0.0}, {-0.3, -1.5, 0.0}, {0.5, -0.1, 0.0}};
  const double sd[5][3] = {
      {0.03, 0.3, 0.5}, {0.2, 0.4, 1.5}, {0.04, 0.3, 0.5}, {0.2, 0.5, 1.5}, {0.15, 0.8, 2.0}};
  memcpy(m.mean, mean, sizeof mean);
  memcpy(m.sd, sd, sizeof sd);
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 4; ++j)
      m.transition[i][j] = i == j ? 0.94 : 0.02;
    m.transition[i][4] = p;
    m.transition[i][i] -= p;
  }
  for (int j = 0; j < 5; ++j)
    m.transition[4][j] = j == 4 ? 0.96 : 0.01;
  return m;
}

#endif
