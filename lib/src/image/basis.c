/* SPDX-License-Identifier: MIT */
#include "image/basis.h"

#include <stdbool.h>

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "image/noise.h"
#include "rim/image.h"

#define HUGE_ERROR 1e30

enum { HEADER_WORDS = 8, SHORT_HEADER_WORDS = 4 };

static bool movement_fits(const rim_basis *b, size_t i, uint16_t second) {
  const uint32_t p = rimi_basis_moves(second);
  return p < i && rimi_le_u16(b->input, 2 * p) == rimi_le_u16(b->input, 2 * i) &&
         rimi_le_u16(b->input, 2 * p + 1) == BASIS_PLAIN;
}

static bool inputs_fit(const rim_basis *b, uint32_t features) {
  for (size_t i = 0; i < b->inputs; ++i) {
    const uint16_t second = rimi_le_u16(b->input, 2 * i + 1);
    const bool fits = rimi_basis_is_product(second)    ? (second & ~BASIS_OF_PRODUCT) < features
                      : rimi_basis_is_movement(second) ? movement_fits(b, i, second)
                                                       : second >= BASIS_LEAST_HARMONIC;
    if (!fits || rimi_le_u16(b->input, 2 * i) >= features)
      return false;
  }
  for (size_t t = 0; t < b->times; ++t) {
    const double share = (double)rimi_le_f32(b->share, t);
    if (!(share > 0.0 && share <= 1.0))
      return false;
  }
  return true;
}

static bool terms_fit(const rim_basis *b, uint32_t outcomes) {
  const uint32_t filters = b->inputs * b->times;
  for (size_t i = 0; i < b->terms; ++i) {
    const uint16_t op = rimi_le_u16(b->term, 4 * i);
    const uint16_t first = rimi_le_u16(b->term, 4 * i + 1);
    const uint16_t second = rimi_le_u16(b->term, 4 * i + 2);
    const uint16_t third = rimi_le_u16(b->term, 4 * i + 3);
    bool fits = false;
    switch ((basis_op)op) {
    case BASIS_MEAN:
    case BASIS_ABS:
      fits = first < filters;
      break;
    case BASIS_PRODUCT:
      fits = first < filters && second < filters;
      break;
    case BASIS_TRIPLE:
      fits = first < filters && second < filters && third < filters;
      break;
    case BASIS_SIDE:
      fits = first < filters && numbers_are_positive(b->term + 8 * i + 4, 1);
      break;
    case BASIS_DECAY:
      fits = second < b->times;
      break;
    case BASIS_INTEGRAL:
      fits = first < b->inputs;
      break;
    case BASIS_INITIAL:
      fits = first < outcomes && second < b->times;
      break;
    case BASIS_TIME:
      fits = true;
      break;
    case BASIS_ROLLED:
      fits = first < b->states && (second < filters || second == BASIS_PLAIN) &&
             (third < b->states || third == BASIS_PLAIN ||
              (third >= BASIS_HINGE && third < BASIS_HINGE + BASIS_HINGES));
      break;
    }
    if (!fits)
      return false;
  }
  for (size_t m = 0; m < b->means; ++m) {
    if (rimi_le_u16(b->mean, 2 * m) >= filters)
      return false;
  }
  return true;
}

static bool factor_fits(const rim_basis *b, uint16_t code) {
  const uint32_t state = code & (BASIS_STATE - 1u);
  const uint32_t of_magnitude = BASIS_STATE_MAGNITUDE - BASIS_STATE;
  return code < BASIS_STATE ? code < b->inputs * b->times
                            : code == BASIS_PLAIN || state < b->states ||
                                  (state >= of_magnitude && state - of_magnitude < b->states);
}

static bool rates_fit(const rim_basis *b, uint32_t outcomes) {
  for (size_t s = 0; s < b->states; ++s) {
    if (rimi_le_u16(b->state, s) >= outcomes ||
        !(rimi_le_f32(b->limit, 2 * s) <= rimi_le_f32(b->limit, 2 * s + 1)))
      return false;
  }
  for (size_t q = 0; q < b->rates; ++q) {
    bool fits = rimi_le_u16(b->rate, 4 * q) < b->states;
    for (size_t k = 1; k < 4 && fits; ++k)
      fits = factor_fits(b, rimi_le_u16(b->rate, 4 * q + k));
    if (!fits)
      return false;
  }
  return true;
}

static bool rates_are_finite(const rim_basis *b) {
  return numbers_are_finite(b->limit, 2u * (size_t)b->states) &&
         numbers_are_finite(b->weight, b->rates);
}

static bool terms_are_finite(const rim_basis *b) {
  return numbers_are_finite(b->center, b->terms) && numbers_are_positive(b->inverse_sd, b->terms) &&
         numbers_are_finite(b->mean_center, b->means) &&
         numbers_are_positive(b->mean_inverse_sd, b->means);
}

static size_t triangle(size_t features) { return features * (features + 1u) / 2u; }

/* An element of a symmetric matrix of which the lower triangle is stored. */
static double element(const uint8_t *matrix, uint32_t i, uint32_t j) {
  return (double)rimi_le_f32(matrix, i > j ? triangle(i) + j : triangle(j) + i);
}

static bool laters_are_finite(const uint8_t *later, uint32_t features) {
  const uint8_t *const sd = later + 4u * (1u + (size_t)features);
  const uint8_t *const inverse = sd + 4u * (size_t)features;
  if (!numbers_are_finite(later, 1u + (size_t)features) || !numbers_are_positive(sd, features) ||
      !numbers_are_finite(inverse, 2u * triangle(features)))
    return false;
  for (uint32_t f = 0; f < features; ++f) {
    if (!(element(inverse, f, f) > 0.0 && element(inverse + 4u * triangle(features), f, f) > 0.0))
      return false;
  }
  return true;
}

static bool begins_are_finite(const rim_basis *b, uint32_t features, uint32_t outcomes) {
  return numbers_are_finite(b->first, outcomes) &&
         (b->first_sd == NULL || numbers_are_positive(b->first_sd, outcomes)) &&
         (b->start == NULL || (numbers_are_finite(b->start, features) &&
                               numbers_are_positive(b->start_sd, features))) &&
         (b->later == NULL || laters_are_finite(b->later, features)) &&
         (b->begin == NULL || (b->learnt_s > 0.0 && rimi_is_finite(b->learnt_s) &&
                               numbers_are_finite(b->begin, 2u * (size_t)b->inputs * b->times)));
}

rim_status rimi_basis_open(rim_basis *view, const uint8_t *section, size_t bytes, uint32_t features,
                           uint32_t outcomes) {
  if (bytes < 4u * HEADER_WORDS)
    return RIM_E_TRUNCATED;
  rim_basis b;
  if (rimi_le_u32(section, 0) != BASIS_LAYOUT)
    return RIM_E_VERSION;
  b.inputs = rimi_le_u32(section, 1);
  b.times = rimi_le_u32(section, 2);
  b.terms = rimi_le_u32(section, 3);
  b.means = rimi_le_u32(section, 4);
  const uint32_t states = rimi_le_u32(section, 6), rates = rimi_le_u32(section, 7);
  if (b.inputs > BASIS_MAX_INPUTS || b.times > BASIS_MAX_TIMES || b.terms > BASIS_MAX_TERMS ||
      b.means > BASIS_MAX_MEANS || states > BASIS_MAX_STATES || rates > BASIS_MAX_RATES)
    return RIM_E_RANGE;
  b.states = (uint16_t)states;
  b.rates = (uint16_t)rates;
  const uint32_t spread = rimi_le_u32(section, 5);
  if (spread > 4u || (spread > 3u && features > BASIS_MAX_FEATURES))
    return RIM_E_RANGE;
  const size_t firsts = spread > 0u ? 2u : 1u; /* numbers per outcome */
  const size_t starts = spread > 1u ? 2u : 0u; /* per feature */
  const size_t begins = spread > 2u ? 1u + 2u * (size_t)b.inputs * b.times : 0u;
  const size_t laters = spread > 3u ? 1u + 2u * (size_t)features + 2u * triangle(features) : 0u;
  const size_t need =
      4u * (HEADER_WORDS + (size_t)b.inputs + b.times + 4u * (size_t)b.terms +
            3u * (size_t)b.means + firsts * (size_t)outcomes + starts * (size_t)features + begins +
            laters + ((size_t)b.states + 1u) / 2u + 2u * (size_t)b.states + 3u * (size_t)b.rates);
  if (bytes != need)
    return bytes < need ? RIM_E_TRUNCATED : RIM_E_SIZE;
  b.input = section + 4u * HEADER_WORDS;
  b.share = b.input + 4u * b.inputs;
  b.term = b.share + 4u * b.times;
  b.center = b.term + 8u * b.terms;
  b.inverse_sd = b.center + 4u * b.terms;
  b.mean = b.inverse_sd + 4u * b.terms;
  b.mean_center = b.mean + 4u * b.means;
  b.mean_inverse_sd = b.mean_center + 4u * b.means;
  b.first = b.mean_inverse_sd + 4u * b.means;
  b.first_sd = spread > 0u ? b.first + 4u * outcomes : NULL;
  b.start = spread > 1u ? b.first_sd + 4u * outcomes : NULL;
  b.start_sd = spread > 1u ? b.start + 4u * features : NULL;
  const uint8_t *const after_starts =
      b.first + 4u * (firsts * (size_t)outcomes + starts * (size_t)features);
  b.begin = spread > 2u ? after_starts + 4u : NULL;
  b.learnt_s = spread > 2u ? (double)rimi_le_f32(after_starts, 0) : 0.0;
  const uint8_t *const after_begins = after_starts + 4u * begins;
  b.later = spread > 3u ? after_begins : NULL;
  b.state = after_begins + 4u * laters;
  b.limit = b.state + 4u * (((size_t)b.states + 1u) / 2u);
  b.rate = b.limit + 8u * (size_t)b.states;
  b.weight = b.rate + 8u * (size_t)b.rates;
  if (!rates_are_finite(&b))
    return RIM_E_DATA;
  if (!inputs_fit(&b, features) || !terms_fit(&b, outcomes) || !rates_fit(&b, outcomes))
    return RIM_E_RANGE;
  if (!terms_are_finite(&b) || !begins_are_finite(&b, features, outcomes))
    return RIM_E_DATA;
  *view = b;
  return RIM_OK;
}

static float in_sd(double x, const uint8_t *mean, const uint8_t *sd, uint32_t f) {
  return (float)rimi_clamp((x - (double)rimi_le_f32(mean, f)) / (double)rimi_le_f32(sd, f),
                           -BASIS_LATER_LIMIT, BASIS_LATER_LIMIT);
}

void rimi_basis_place(const rim_basis *view, uint32_t features, const double *x,
                      basis_place *place) {
  const uint8_t *const mean = view->later + 4u, *const sd = mean + 4u * (size_t)features;
  for (uint32_t f = 0; f < features; ++f) {
    place->start[f] = in_sd(x[f], view->start, view->start_sd, f);
    place->later[f] = in_sd(x[f], mean, sd, f);
  }
}

double rimi_basis_later(const rim_basis *view, uint32_t features, const basis_place *place,
                        uint32_t f, double *alone) {
  const uint8_t *const sd = view->later + 4u * (1u + (size_t)features);
  const uint8_t *const of_start = sd + 4u * (size_t)features;
  const uint8_t *const of_later = of_start + 4u * triangle(features);
  double start = 0.0, later = 0.0; /* rows of the inverse matrices times the features */
  for (uint32_t g = 0; g < features; ++g) {
    start += element(of_start, f, g) * (double)place->start[g];
    later += element(of_later, f, g) * (double)place->later[g];
  }
  const double p = element(of_start, f, f), q = element(of_later, f, f);
  const double widths =
      rimi_log((double)rimi_le_f32(view->start_sd, f) / (double)rimi_le_f32(sd, f));
  *alone = 0.5 * (start * start / p - later * later / q - rimi_log(p / q)) + widths;
  return 0.5 * (start * (double)place->start[f] - later * (double)place->later[f]) + widths;
}

rim_status rimi_behaviour_open(rim_behaviour *view, const uint8_t *section, size_t bytes,
                               uint32_t terms, uint32_t outcomes) {
  if (bytes < 4u * SHORT_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rimi_le_u32(section, 0) != 1u)
    return RIM_E_VERSION;
  if (rimi_le_u32(section, 1) != terms || rimi_le_u32(section, 2) != 2u * outcomes)
    return RIM_E_RANGE;
  const size_t targets = 2u * (size_t)outcomes;
  if (bytes != 4u * (SHORT_HEADER_WORDS + targets * (2u + (size_t)terms)))
    return RIM_E_TRUNCATED;
  rim_behaviour b;
  b.terms = terms;
  b.targets = (uint32_t)targets;
  b.from_start = section + 4u * SHORT_HEADER_WORDS;
  b.intercept = b.from_start + 4u * targets;
  b.weight = b.intercept + 4u * targets;
  for (size_t i = 0; i < targets; ++i) {
    if (rimi_le_u32(b.from_start, i) > 1u)
      return RIM_E_RANGE;
  }
  if (!numbers_are_finite(b.intercept, targets * (1u + (size_t)terms)))
    return RIM_E_DATA;
  *view = b;
  return RIM_OK;
}

void rimi_behaviour_predict(const rim_behaviour *view, const double *term, const double *first,
                            double *predicted) {
  const uint32_t outcomes = view->targets / 2u;
  for (size_t o = 0; o < view->targets; ++o) {
    double sum = (double)rimi_le_f32(view->intercept, o);
    const uint8_t *row = view->weight + 4u * o * view->terms;
    for (size_t i = 0; i < view->terms; ++i)
      sum += (double)rimi_le_f32(row, i) * term[i];
    if (o < outcomes && rimi_le_u32(view->from_start, o) != 0u)
      sum += first[o];
    predicted[o] = sum;
  }
}

void rimi_behaviour_error(const rim_behaviour *view, const uint16_t *unknown, bool knows_start,
                          double *error) {
  const uint32_t outcomes = view->targets / 2u;
  for (size_t o = 0; o < view->targets; ++o) {
    const uint8_t *row = view->weight + 4u * o * view->terms;
    double sum = 0.0;
    for (size_t i = 0; i < view->terms; ++i) {
      const double part = (double)rimi_le_f32(row, i) * (double)unknown[i];
      sum += part * part;
    }
    error[o] = rimi_sqrt(sum) / BASIS_UNKNOWN_SD;
    if (!knows_start && o < outcomes && rimi_le_u32(view->from_start, o) != 0u)
      error[o] = HUGE_ERROR;
  }
}

static size_t agreement_stride(size_t outcomes, size_t means) {
  return AGREEMENT_FIRST + outcomes * (2u + means);
}

static bool agreement_rows_fit(const rim_agreement *a, uint32_t features) {
  const size_t stride = agreement_stride(a->outcomes, a->means);
  for (size_t o = 0; o < a->outcomes; ++o) {
    const uint8_t *row = a->row + 4u * (size_t)o * stride;
    const float source = rimi_le_f32(row, 0), integrand = rimi_le_f32(row, 2);
    const double lag = (double)rimi_le_f32(row, 3);
    const float of = rimi_le_f32(row, 1);
    if (!(source >= 0.0f && source <= (float)AGREEMENT_QUADRATIC) ||
        (float)(uint32_t)source < source || /* between two of them */
        ((uint32_t)source == AGREEMENT_INTO &&
         (!(of >= 0.0f && of < (float)a->outcomes) || (size_t)of == o)) ||
        !(integrand >= -1.0f && integrand < (float)a->outcomes) ||
        !(lag >= -AGREEMENT_LAG && lag <= AGREEMENT_LAG))
      return false;
  }
  for (size_t g = 0; g < a->integrands; ++g) {
    if (rimi_le_u16(a->integrand, 4 * g) > AGREEMENT_SINE ||
        rimi_le_u16(a->integrand, 4 * g + 1) >= features ||
        rimi_le_u16(a->integrand, 4 * g + 2) >= features)
      return false;
  }
  return true;
}

rim_status rimi_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                               uint32_t features, uint32_t outcomes, uint32_t means) {
  if (bytes < 4u * SHORT_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rimi_le_u32(section, 0) != 3u)
    return RIM_E_VERSION;
  const uint32_t integrands = rimi_le_u32(section, 3);
  if (rimi_le_u32(section, 1) != outcomes || rimi_le_u32(section, 2) != means ||
      integrands > AGREEMENT_INTEGRANDS * outcomes || integrands > outcomes * (2u + means))
    return RIM_E_RANGE;
  const size_t g = integrands, rows = (size_t)outcomes * agreement_stride(outcomes, means);
  if (bytes != 4u * (SHORT_HEADER_WORDS + outcomes + 5u * g + rows))
    return RIM_E_TRUNCATED;
  rim_agreement a = {.outcomes = outcomes, .means = means, .integrands = integrands};
  a.inverse_sd = section + 4u * SHORT_HEADER_WORDS;
  a.integrand = a.inverse_sd + 4u * (size_t)outcomes;
  a.integrand_inverse_sd = a.integrand + 8u * g;
  a.partial = a.integrand_inverse_sd + 4u * g;
  a.row = a.partial + 8u * g;
  if (!numbers_are_positive(a.inverse_sd, outcomes) ||
      !numbers_are_positive(a.integrand_inverse_sd, g) || !numbers_are_finite(a.partial, 2u * g) ||
      !numbers_are_finite(a.row, rows))
    return RIM_E_DATA;
  if (!agreement_rows_fit(&a, features))
    return RIM_E_RANGE;
  *view = a;
  return RIM_OK;
}

/* The arrays of the state, each of [outcomes]. LATE: of an outcome's change in the next block, what
 * its integrands brought in this one. */
enum { BEFORE_RESIDUAL = 0, BEFORE_OUTCOME = 1, SUM = 2, LATE = 3, INTEGRATED = 4 };

static double clipped_residual(const rim_agreement *a, const agreement_block *block, size_t j) {
  return rimi_clamp(block->residual[j] * (double)rimi_le_f32(a->inverse_sd, j), -AGREEMENT_CLIP,
                    AGREEMENT_CLIP);
}

/* Of the residual of outcome j in the same block. */
static double weight_of(const rim_agreement *a, const uint8_t *row, const double *mean, size_t j) {
  double weight = (double)rimi_le_f32(row, AGREEMENT_FIRST + j);
  for (size_t m = 0; m < a->means; ++m)
    weight += (double)rimi_le_f32(row, AGREEMENT_FIRST + (2u + m) * a->outcomes + j) * mean[m];
  return weight;
}

double rimi_agreement_error(const rim_agreement *a, uint32_t outcome, const double *mean,
                            const double *error) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  const double unit = (double)rimi_le_f32(a->inverse_sd, outcome);
  if ((uint32_t)rimi_le_f32(row, 0) != AGREEMENT_RESIDUALS)
    return 0.0;
  double sum = error[outcome] * error[outcome] * unit * unit;
  for (size_t j = 0; j < a->outcomes; ++j) {
    if (j == outcome)
      continue;
    const double weight =
        weight_of(a, row, mean, j) + (double)rimi_le_f32(row, AGREEMENT_FIRST + a->outcomes + j);
    const double part =
        weight * rimi_min(error[j] * (double)rimi_le_f32(a->inverse_sd, j), AGREEMENT_CLIP);
    sum += part * part;
  }
  return rimi_sqrt(sum) / unit;
}

static double from_residuals(const rim_agreement *a, const agreement_block *block,
                             const uint8_t *row, size_t o, const double *before) {
  const size_t count = a->outcomes;
  double sum = (double)rimi_le_f32(row, 1);
  for (size_t j = 0; j < count; ++j) {
    if (j == o)
      continue;
    sum += weight_of(a, row, block->mean, j) * clipped_residual(a, block, j) +
           (double)rimi_le_f32(row, AGREEMENT_FIRST + count + j) * before[j];
  }
  return block->residual[o] - sum / (double)rimi_le_f32(a->inverse_sd, o);
}

static double from_few(const rim_agreement *a, const agreement_block *block, const uint8_t *row,
                       size_t o) {
  double sum = (double)rimi_le_f32(row, 1);
  for (size_t j = 0; j < a->outcomes; ++j)
    sum += j != o ? (double)rimi_le_f32(row, AGREEMENT_FIRST + j) * block->measured[j] : 0.0;
  return block->measured[o] - sum;
}

/* Of the outcome `of` as the integral that row o says. */
static double from_integral(const rim_agreement *a, const agreement_block *block,
                            const uint8_t *row, size_t o, size_t of, double *state) {
  const size_t count = a->outcomes;
  const double lag = (double)rimi_le_f32(row, 3);
  double now = 0.0, late = 0.0;
  for (size_t g = 0; g < a->integrands; ++g) {
    const double weight = (double)rimi_le_f32(row, AGREEMENT_FIRST + g) *
                          (double)rimi_le_f32(a->integrand_inverse_sd, g);
    const double lagging = lag * (block->early[g] + block->late[g]);
    now += weight * (block->early[g] - lagging);
    late += weight * (block->late[g] + lagging);
  }
  const double intercept = of == o ? (double)rimi_le_f32(row, 1) : 0.0;
  const double change = intercept + now + state[LATE * count + o];
  state[LATE * count + o] = late;
  const double sum = state[SUM * count + o];
  if (!block->follows)
    return sum;
  state[INTEGRATED * count + o] = AGREEMENT_KEEPS * state[INTEGRATED * count + o] + change;
  return AGREEMENT_KEEPS * sum + block->measured[of] - state[BEFORE_OUTCOME * count + of] - change;
}

double rimi_agreement_disturbance(const rim_agreement *a, const double *residual, double *work) {
  for (size_t o = 0; o < a->outcomes; ++o)
    work[o] = residual[o] * (double)rimi_le_f32(a->inverse_sd, o);
  return rimi_noise_disturbance(work, a->outcomes);
}

uint32_t rimi_agreement_twin(const rim_agreement *a, uint32_t outcome, double *weight_of_twin) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  uint32_t twin = a->outcomes;
  if ((agreement_source)rimi_agreement_source(a, outcome) != AGREEMENT_FEW)
    return twin;
  for (uint32_t j = 0; j < a->outcomes; ++j) {
    const float weight = rimi_le_f32(row, AGREEMENT_FIRST + j);
    if (weight == 0.0f)
      continue;
    if (twin < a->outcomes || weight < 0.0f)
      return a->outcomes;
    twin = j;
    if (weight_of_twin != NULL)
      *weight_of_twin = (double)weight;
  }
  return twin;
}

uint32_t rimi_agreement_source(const rim_agreement *a, uint32_t outcome) {
  return (uint32_t)rimi_le_f32(a->row + 4u * outcome * agreement_stride(a->outcomes, a->means), 0);
}

uint32_t rimi_agreement_integral(const rim_agreement *a, uint32_t outcome) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  const uint32_t source = rimi_agreement_source(a, outcome);
  return source == AGREEMENT_INTEGRAL ? outcome
         : source == AGREEMENT_INTO   ? (uint32_t)rimi_le_f32(row, 1)
                                      : a->outcomes;
}

void rimi_agreement_evaluate(const rim_agreement *a, const agreement_block *block, double *state,
                             double *remains, double *expected) {
  const size_t count = a->outcomes, stride = agreement_stride(count, a->means);
  for (uint32_t o = 0; o < count; ++o) {
    const uint8_t *row = a->row + 4u * (size_t)o * stride;
    const uint32_t of = rimi_agreement_integral(a, o);
    uint32_t source = (uint32_t)rimi_le_f32(row, 0);
    if ((source == AGREEMENT_LEVEL && block->level == NULL) ||
        (source == AGREEMENT_QUADRATIC && block->quadratic == NULL))
      source = AGREEMENT_RESIDUALS;
    if (source == AGREEMENT_RESIDUALS)
      remains[o] = from_residuals(a, block, row, o, state + BEFORE_RESIDUAL * count);
    else if (source == AGREEMENT_LEVEL)
      remains[o] = block->measured[o] - block->level[o];
    else if (source == AGREEMENT_QUADRATIC)
      remains[o] = block->measured[o] - block->quadratic[o];
    else if (source == AGREEMENT_FEW)
      remains[o] = from_few(a, block, row, o);
    else {
      const double sum = from_integral(a, block, row, o, of, state);
      state[SUM * count + o] = sum;
      remains[o] = source == AGREEMENT_INTO ? -sum : sum;
    }
    expected[o] = source == AGREEMENT_RESIDUALS ? block->predicted[o]
                  : of < count                  ? state[INTEGRATED * count + o]
                                                : block->measured[o] - remains[o];
  }
  for (size_t j = 0; j < count; ++j) {
    state[BEFORE_RESIDUAL * count + j] = clipped_residual(a, block, j);
    state[BEFORE_OUTCOME * count + j] = block->measured[j];
  }
}

agreement_gain rimi_agreement_gain(const rim_agreement *a, uint32_t outcome, uint32_t j,
                                   uint16_t feature) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  agreement_gain gain = {.mostly =
                             rimi_le_f32(row, 2) >= 0.0f && (uint32_t)rimi_le_f32(row, 2) == j};
  if (rimi_agreement_integral(a, outcome) >= a->outcomes)
    return gain;
  const double sign = rimi_agreement_source(a, outcome) == AGREEMENT_INTO ? -2.0 : 2.0;
  for (size_t g = 0; g < a->integrands; ++g) {
    const double weight = sign * (double)rimi_le_f32(row, AGREEMENT_FIRST + g) *
                          (double)rimi_le_f32(a->integrand_inverse_sd, g);
    for (size_t k = 0; k < 2; ++k) {
      if (rimi_le_u16(a->integrand, 4 * g + 1 + k) != feature)
        continue;
      const double part = weight * (double)rimi_le_f32(a->partial, 2 * g + k);
      gain.sum += part;
      gain.factor = gain.factor || weight > 0.0 || weight < 0.0;
      if (rimi_le_u16(a->integrand, 4 * g) != AGREEMENT_PLAIN)
        gain.of_products += part;
    }
  }
  return gain;
}

bool rimi_agreement_takes(const rim_agreement *a, uint32_t outcome, uint32_t j, uint16_t feature) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  if (rimi_agreement_source(a, outcome) == AGREEMENT_FEW) {
    const float weight = j < a->outcomes ? rimi_le_f32(row, AGREEMENT_FIRST + j) : 0.0f;
    return weight > 0.0f || weight < 0.0f;
  }
  return rimi_agreement_gain(a, outcome, j, feature).factor ||
         (j < a->outcomes && rimi_agreement_integral(a, outcome) == j);
}
