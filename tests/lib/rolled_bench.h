/* SPDX-License-Identifier: MIT */
/* A trained monitor of outcomes that are rolled forward: a tank (outcome 3) keeps what two flows
 * (outcomes 1 and 2) bring and take. BENCH_OUTCOMES is 4. */
#ifndef ROLLED_BENCH_H
#define ROLLED_BENCH_H

#include "describe_bench.h"

enum { OTHER = 0, IN = 1, OUT = 2, TANK = 3, STATES = 3, RATES = 6, ROLLED_TERMS = 1 + STATES };
enum { NONE = 0xffff };

/* States, and the outcome of each. Both flows follow the command, by themselves. */
enum { Z_IN, Z_OUT, Z_TANK };
static const uint16_t outcome_of[STATES] = {IN, OUT, TANK};
static const uint16_t rate[RATES][4] = {
    {Z_TANK, BASIS_PLAIN, BASIS_STATE + Z_IN, BASIS_PLAIN},
    {Z_TANK, BASIS_PLAIN, BASIS_PLAIN, BASIS_STATE_MAGNITUDE + Z_OUT},
    {Z_IN, 0, BASIS_PLAIN, BASIS_PLAIN},
    {Z_IN, BASIS_STATE + Z_IN, BASIS_PLAIN, BASIS_PLAIN},
    {Z_OUT, 0, BASIS_PLAIN, BASIS_PLAIN},
    {Z_OUT, BASIS_STATE + Z_OUT, BASIS_PLAIN, BASIS_PLAIN}};

static void put_rolled_basis(bytes *to) {
  to->size = 0;
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, ROLLED_TERMS, MEANS, 0, STATES, RATES};
  for (size_t i = 0; i < 8; ++i)
    u32(to, header[i]);
  u16(to, 0);
  u16(to, BASIS_PLAIN);
  f32(to, 1.0);
  f32(to, 0.1);
  const uint16_t term[ROLLED_TERMS][4] = {{BASIS_MEAN, 0, 0, 0},
                                          {BASIS_ROLLED, 0, BASIS_PLAIN, BASIS_PLAIN},
                                          {BASIS_ROLLED, 1, BASIS_PLAIN, BASIS_PLAIN},
                                          {BASIS_ROLLED, 2, BASIS_PLAIN, BASIS_PLAIN}};
  for (size_t i = 0; i < 4 * ROLLED_TERMS; ++i)
    u16(to, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * ROLLED_TERMS; ++i)
    f32(to, i < ROLLED_TERMS ? 0.0 : 1.0);
  u16(to, 0); /* the mean */
  u16(to, 0);
  f32(to, 0.0);
  f32(to, 1.0);
  for (size_t o = 0; o < O; ++o)
    f32(to, 0.0);
  for (size_t s = 0; s < STATES + STATES % 2; ++s)
    u16(to, s < STATES ? outcome_of[s] : 0);
  for (size_t i = 0; i < 2 * STATES; ++i)
    f32(to, i % 2 == 0 ? -50.0 : 50.0);
  for (size_t i = 0; i < 4 * RATES; ++i)
    u16(to, rate[i / 4][i % 4]);
  for (size_t q = 0; q < RATES; ++q)
    f32(to, q == 1 || q == 3 || q == 5 ? -0.5 : 0.5);
}

/* by: of each outcome, the state that predicts it, or NONE: the command does. */
static void put_predicted_by(recipe *r, const uint16_t by[O]) {
  bytes *to = &r->section[RIM_SECTION_BEHAVIOUR];
  to->size = 0;
  const uint32_t header[4] = {1, ROLLED_TERMS, 2 * O, 0};
  for (size_t i = 0; i < 4; ++i)
    u32(to, header[i]);
  for (size_t i = 0; i < 2 * O; ++i)
    u32(to, 0);
  for (size_t i = 0; i < 2 * O; ++i)
    f32(to, 0.0);
  for (size_t t = 0; t < 2 * O; ++t) {
    for (unsigned i = 0; i < ROLLED_TERMS; ++i)
      f32(to, t < O && i == (by[t] == NONE ? 0u : 1u + by[t]) ? 1.0 : 0.0);
  }
}

static recipe rolled(const uint16_t by[O]) {
  recipe r = without_integrals();
  put_rolled_basis(&r.section[RIM_SECTION_BASIS]);
  put_predicted_by(&r, by);
  return r;
}

/* Each outcome by its own state, but for the one that has none. */
static const uint16_t own[O] = {NONE, Z_IN, Z_OUT, Z_TANK};

#endif
