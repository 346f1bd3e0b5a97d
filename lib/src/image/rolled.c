/* SPDX-License-Identifier: MIT */
#include "image/rolled.h"

#include "base/bytes.h"
#include "base/real.h"

enum { FACTORS = 3 };
#define ROLLED_MOST 1e100                           /* variance */
#define ROLLED_PART (ROLLED_LONGEST / ROLLED_PARTS) /* blocks */

static uint16_t factor(const rim_basis *b, size_t rate, size_t which) {
  return rimi_le_u16(b->rate, 4 * rate + 1 + which);
}

/* The product of a rate's factors that are filters. */
static double of_filters(const rim_basis *b, size_t rate, const double *filter) {
  const size_t filters = (size_t)b->inputs * b->times;
  double product = 1.0;
  for (size_t k = 0; k < FACTORS; ++k) {
    const uint16_t code = factor(b, rate, k);
    if (code < BASIS_STATE && filters > 0)
      product *= filter[code < filters ? code : 0];
  }
  return product;
}

/* The state that a factor is, or the number of states. */
static size_t state_of(const rim_basis *b, uint16_t code) {
  const size_t which = code & (BASIS_MAX_STATES - 1u);
  return code < BASIS_STATE || code == BASIS_PLAIN ? b->states : which < b->states ? which : 0;
}

static bool is_magnitude(uint16_t code) {
  return (code & BASIS_STATE_MAGNITUDE) == BASIS_STATE_MAGNITUDE;
}

/* The product of those that are states, without factor `left_out`, FACTORS: with all. */
static double of_states(const rim_basis *b, size_t rate, const double *state, size_t left_out) {
  double product = 1.0;
  for (size_t k = 0; k < FACTORS; ++k) {
    const uint16_t code = factor(b, rate, k);
    const size_t s = state_of(b, code);
    if (s == b->states || k == left_out)
      continue;
    product *= is_magnitude(code) ? rimi_abs(state[s]) : state[s];
  }
  return product;
}

/* to = from + dt_s times the rates at `at`, within what healthy runs reached and as much again. */
static void move(const rim_basis *b, const double *part, const double *at, const double *from,
                 double dt_s, double *to) {
  double change[BASIS_MAX_STATES] = {0.0};
  for (size_t q = 0; q < b->rates; ++q)
    change[rimi_le_index(b->rate, 4 * q, BASIS_MAX_STATES)] +=
        (double)rimi_le_f32(b->weight, q) * part[q] * of_states(b, q, at, FACTORS);
  for (size_t s = 0; s < b->states; ++s) {
    const double next = from[s] + dt_s * change[s];
    to[s] = rimi_clamp(rimi_is_finite(next) ? next : from[s], (double)rimi_le_f32(b->limit, 2 * s),
                       (double)rimi_le_f32(b->limit, 2 * s + 1));
  }
}

static void advance(const rim_basis *b, const double *part, double dt_s, double *state) {
  double middle[BASIS_MAX_STATES];
  move(b, part, state, state, 0.5 * dt_s, middle);
  move(b, part, middle, state, dt_s, state);
}

/* The same product where every filter is at its input. */
static double of_inputs(const rim_basis *b, size_t rate, const double *input) {
  double product = 1.0;
  for (size_t k = 0; k < FACTORS; ++k) {
    const uint16_t code = factor(b, rate, k);
    if (code < BASIS_STATE && b->times > 0)
      product *= input[code / b->times < b->inputs ? code / b->times : 0];
  }
  return product;
}

void rimi_rolled_lose(const rim_basis *basis, const double *from, const double *to, double lost_s,
                      const double *state, double *variance) {
  for (size_t q = 0; q < basis->rates && basis->states > 0; ++q) {
    const double moved = of_inputs(basis, q, to) - of_inputs(basis, q, from);
    const double error = (double)rimi_le_f32(basis->weight, q) *
                         of_states(basis, q, state, FACTORS) * moved * RIM_UNIFORM_SD * lost_s;
    variance[rimi_le_index(basis->rate, 4 * q, basis->states)] += error * error;
  }
}

void rimi_rolled_begin(const rim_basis *basis, const double *filter, double block_s, double *state,
                       double *part) {
  for (size_t q = 0; q < basis->rates; ++q)
    part[q] = of_filters(basis, q, filter);
  advance(basis, part, 0.5 * block_s, state);
}

void rimi_rolled_step(const rim_basis *basis, const double *filter, double share, double elapsed_s,
                      double block_s, double *state, double *part) {
  double mean[BASIS_MAX_RATES];
  for (size_t q = 0; q < basis->rates; ++q) {
    const double now = of_filters(basis, q, filter);
    mean[q] = (1.0 - share) * part[q] + share * now;
    part[q] = now;
  }
  double left_s = rimi_min(elapsed_s, ROLLED_LONGEST * block_s);
  for (uint32_t i = 0; i < ROLLED_PARTS && left_s > 0.0; ++i) {
    const double part_s = rimi_min(left_s, ROLLED_PART * block_s);
    advance(basis, mean, part_s, state);
    left_s -= part_s;
  }
}

/* The change of rate q's state per unit of its factor k, a state. */
static double derivative(const rim_basis *b, const double *part, size_t q, size_t k,
                         const double *state) {
  const uint16_t code = factor(b, q, k);
  const bool falls = is_magnitude(code) && state[state_of(b, code)] < 0.0;
  const double slope = (double)rimi_le_f32(b->weight, q) * part[q] * of_states(b, q, state, k);
  return falls ? -slope : slope;
}

void rimi_rolled_forget(const rim_basis *basis, const double *part, const double *state,
                        double elapsed_s, double *variance, double *kept) {
  double own[BASIS_MAX_STATES] = {0.0}, added[BASIS_MAX_STATES] = {0.0};
  for (size_t q = 0; q < basis->rates; ++q) {
    const size_t s = rimi_le_index(basis->rate, 4 * q, basis->states);
    for (size_t k = 0; k < FACTORS; ++k) {
      const size_t of = state_of(basis, factor(basis, q, k));
      if (of == s)
        own[s] += derivative(basis, part, q, k, state);
      else if (of < basis->states && variance[of] > 0.0)
        added[s] += rimi_abs(derivative(basis, part, q, k, state)) * rimi_sqrt(variance[of]);
    }
  }
  for (size_t s = 0; s < basis->states; ++s) {
    /* By the backward rule an error that decays never falls below 0. */
    const double left = own[s] < 0.0 ? 1.0 / (1.0 - elapsed_s * own[s]) : 1.0 + elapsed_s * own[s];
    const double error = rimi_sqrt(variance[s]) * left + added[s] * elapsed_s;
    variance[s] = rimi_min(error * error, ROLLED_MOST);
    kept[s] = rimi_min(kept[s] * left, 1.0);
  }
}

void rimi_rolled_resume(const rim_basis *basis, const double *filter, const double *moved,
                        double *state, double *part) {
  for (size_t q = 0; q < basis->rates; ++q)
    part[q] = of_filters(basis, q, filter);
  for (size_t s = 0; s < basis->states; ++s)
    state[s] = rimi_clamp(state[s] + moved[s], (double)rimi_le_f32(basis->limit, 2 * s),
                          (double)rimi_le_f32(basis->limit, 2 * s + 1));
}

double rimi_rolled_term(const rim_basis *basis, size_t term, const double *filter,
                        const double *state) {
  const uint8_t *spec = basis->term + 8u * term;
  const size_t filters = (size_t)basis->inputs * basis->times;
  const uint16_t second = rimi_le_u16(spec, 2), third = rimi_le_u16(spec, 3);
  if (basis->states == 0)
    return 0.0;
  const size_t s = rimi_le_index(spec, 1, basis->states);
  double value = state[s];
  if (third >= BASIS_HINGE && third < BASIS_HINGE + BASIS_HINGES) {
    const double low = (double)rimi_le_f32(basis->limit, 2 * s);
    const double high = (double)rimi_le_f32(basis->limit, 2 * s + 1);
    const double part = (double)(third - BASIS_HINGE) / (double)BASIS_HINGES;
    value = rimi_max(value - (low + part * (high - low)), 0.0);
  } else if (third < basis->states) {
    value *= state[third];
  }
  return second < filters ? value * filter[second] : value;
}

static uint32_t bit_of(const rim_basis *b, uint16_t state) {
  return state < b->states ? UINT32_C(1) << state : 0u;
}

uint32_t rimi_rolled_states(const rim_basis *basis, const rim_behaviour *behaviour,
                            uint32_t outcome) {
  uint32_t states = 0;
  if (basis->states == 0 || outcome >= behaviour->targets)
    return 0;
  for (size_t i = 0; i < basis->terms; ++i) {
    const float weight = rimi_le_f32(behaviour->weight, (size_t)outcome * basis->terms + i);
    if (rimi_le_u16(basis->term, 4 * i) != BASIS_ROLLED || !(weight < 0.0f || weight > 0.0f))
      continue;
    states |= bit_of(basis, rimi_le_u16(basis->term, 4 * i + 1)) |
              bit_of(basis, rimi_le_u16(basis->term, 4 * i + 3));
  }
  for (size_t turn = 1; turn < basis->states; ++turn) {
    for (size_t q = 0; q < basis->rates; ++q) {
      if ((states & bit_of(basis, rimi_le_u16(basis->rate, 4 * q))) == 0)
        continue;
      for (size_t k = 0; k < FACTORS; ++k) {
        const uint16_t code = factor(basis, q, k);
        if (code >= BASIS_STATE && code != BASIS_PLAIN)
          states |= bit_of(basis, code & (BASIS_MAX_STATES - 1u));
      }
    }
  }
  return states;
}
