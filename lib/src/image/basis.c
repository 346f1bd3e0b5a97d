/* SPDX-License-Identifier: MIT */
#include "image/basis.h"

#include <stdbool.h>

#include "base/real.h"
#include "rim/image.h"

enum { HEADER_WORDS = 8, SHORT_HEADER_WORDS = 4 };

static bool finite_numbers(const uint8_t *p, size_t count, bool positive) {
  for (size_t i = 0; i < count; ++i) {
    const double v = (double)rimi_le_f32(p, i);
    if (!rimi_is_finite(v) || (positive && !(v > 0.0)))
      return false;
  }
  return true;
}

static bool inputs_fit(const rim_basis *b, uint32_t features) {
  for (size_t i = 0; i < b->inputs; ++i) {
    const uint16_t second = rimi_le_u16(b->input, 2 * i + 1);
    if (rimi_le_u16(b->input, 2 * i) >= features ||
        ((second & ~BASIS_OF_PRODUCT) >= features && second != BASIS_PLAIN &&
         second != BASIS_MAGNITUDE))
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
    bool fits = false;
    switch ((basis_op)op) {
    case BASIS_MEAN:
    case BASIS_ABS:
      fits = first < filters;
      break;
    case BASIS_PRODUCT:
      fits = first < filters && second < filters;
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
      fits = first < outcomes;
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
  if (b.inputs > BASIS_MAX_INPUTS || b.times > BASIS_MAX_TIMES || b.terms > BASIS_MAX_TERMS ||
      b.means > BASIS_MAX_MEANS)
    return RIM_E_RANGE;
  const uint32_t spread = rimi_le_u32(section, 5);
  if (spread > 1u)
    return RIM_E_RANGE;
  const size_t need = 4u * (HEADER_WORDS + (size_t)b.inputs + b.times + 4u * (size_t)b.terms +
                            3u * (size_t)b.means + (1u + spread) * outcomes);
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
  b.first_sd = spread != 0u ? b.first + 4u * outcomes : NULL;
  if (!inputs_fit(&b, features) || !terms_fit(&b, outcomes))
    return RIM_E_RANGE;
  if (!finite_numbers(b.center, b.terms, false) || !finite_numbers(b.inverse_sd, b.terms, true) ||
      !finite_numbers(b.mean_center, b.means, false) ||
      !finite_numbers(b.mean_inverse_sd, b.means, true) ||
      !finite_numbers(b.first, outcomes, false) ||
      (b.first_sd != NULL && !finite_numbers(b.first_sd, outcomes, true)))
    return RIM_E_DATA;
  *view = b;
  return RIM_OK;
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
  if (!finite_numbers(b.intercept, targets * (1u + (size_t)terms), false))
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

static size_t agreement_stride(size_t outcomes, size_t means) {
  return AGREEMENT_FIRST + outcomes * (2u + means);
}

static bool agreement_rows_fit(const rim_agreement *a) {
  const size_t stride = agreement_stride(a->outcomes, a->means);
  for (size_t o = 0; o < a->outcomes; ++o) {
    const uint8_t *row = a->row + 4u * o * stride;
    const float source = rimi_le_f32(row, 0), integrand = rimi_le_f32(row, 2);
    if (!(source >= 0.0f && source <= 2.0f) ||
        !(integrand >= -1.0f && integrand < (float)a->outcomes))
      return false;
  }
  return true;
}

rim_status rimi_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                               uint32_t outcomes, uint32_t means) {
  if (bytes < 4u * SHORT_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rimi_le_u32(section, 0) != 2u)
    return RIM_E_VERSION;
  if (rimi_le_u32(section, 1) != outcomes || rimi_le_u32(section, 2) != means)
    return RIM_E_RANGE;
  const size_t numbers = (size_t)outcomes * (2u + agreement_stride(outcomes, means));
  if (bytes != 4u * (SHORT_HEADER_WORDS + numbers))
    return RIM_E_TRUNCATED;
  const uint8_t *data = section + 4u * SHORT_HEADER_WORDS;
  const rim_agreement a = {outcomes, means, data, data + 4u * outcomes, data + 8u * outcomes};
  if (!finite_numbers(a.inverse_sd, outcomes, true) ||
      !finite_numbers(a.level_inverse_sd, outcomes, true) || !finite_numbers(data, numbers, false))
    return RIM_E_DATA;
  if (!agreement_rows_fit(&a))
    return RIM_E_RANGE;
  *view = a;
  return RIM_OK;
}

/* The arrays of the state. */
enum { BEFORE_RESIDUAL = 0, BEFORE_LEVEL = 1, BEFORE_OUTCOME = 2, SUM = 3 };

static double level_of(const rim_agreement *a, const agreement_block *block, size_t j) {
  return block->measured[j] * (double)rimi_le_f32(a->level_inverse_sd, j);
}

static double clipped_residual(const rim_agreement *a, const agreement_block *block, size_t j) {
  return rimi_clamp(block->residual[j] * (double)rimi_le_f32(a->inverse_sd, j), -AGREEMENT_CLIP,
                    AGREEMENT_CLIP);
}

static double from_residuals(const rim_agreement *a, const agreement_block *block,
                             const uint8_t *row, size_t o, const double *before) {
  const size_t count = a->outcomes;
  double sum = (double)rimi_le_f32(row, 1);
  for (size_t j = 0; j < count; ++j) {
    if (j == o)
      continue;
    double weight = (double)rimi_le_f32(row, AGREEMENT_FIRST + j);
    for (size_t m = 0; m < a->means; ++m)
      weight += (double)rimi_le_f32(row, AGREEMENT_FIRST + (2u + m) * count + j) * block->mean[m];
    sum += weight * clipped_residual(a, block, j) +
           (double)rimi_le_f32(row, AGREEMENT_FIRST + count + j) * before[j];
  }
  return block->residual[o] - sum / (double)rimi_le_f32(a->inverse_sd, o);
}

static double from_integral(const rim_agreement *a, const agreement_block *block,
                            const uint8_t *row, size_t o, const double *state) {
  const size_t count = a->outcomes;
  const double *level = state + BEFORE_LEVEL * count;
  const double sum = state[SUM * count + o];
  if (!block->follows)
    return sum;
  double change = (double)rimi_le_f32(row, 1);
  for (size_t j = 0; j < count; ++j) {
    if (j == o)
      continue;
    change += (double)rimi_le_f32(row, AGREEMENT_FIRST + j) * level_of(a, block, j) +
              (double)rimi_le_f32(row, AGREEMENT_FIRST + count + j) * level[j];
  }
  return AGREEMENT_KEEPS * sum + block->measured[o] - state[BEFORE_OUTCOME * count + o] - change;
}

void rimi_agreement_evaluate(const rim_agreement *a, const agreement_block *block, double *state,
                             double *remains) {
  const size_t count = a->outcomes, stride = agreement_stride(count, a->means);
  for (size_t o = 0; o < count; ++o) {
    const uint8_t *row = a->row + 4u * o * stride;
    const uint32_t source = (uint32_t)rimi_le_f32(row, 0);
    if (source == AGREEMENT_LEVEL && block->level != NULL)
      remains[o] = block->measured[o] - block->level[o];
    else if (source == AGREEMENT_INTEGRAL)
      remains[o] = from_integral(a, block, row, o, state);
    else
      remains[o] = from_residuals(a, block, row, o, state + BEFORE_RESIDUAL * count);
  }
  for (size_t j = 0; j < count; ++j) {
    const uint8_t *row = a->row + 4u * j * stride;
    state[BEFORE_RESIDUAL * count + j] = clipped_residual(a, block, j);
    state[BEFORE_LEVEL * count + j] = level_of(a, block, j);
    state[BEFORE_OUTCOME * count + j] = block->measured[j];
    if ((uint32_t)rimi_le_f32(row, 0) == AGREEMENT_INTEGRAL)
      state[SUM * count + j] = remains[j];
  }
}

double rimi_agreement_gain(const rim_agreement *a, uint32_t outcome, uint32_t j, bool *mostly) {
  const uint8_t *row = a->row + 4u * outcome * agreement_stride(a->outcomes, a->means);
  *mostly = rimi_le_f32(row, 2) >= 0.0f && (uint32_t)rimi_le_f32(row, 2) == j;
  if ((uint32_t)rimi_le_f32(row, 0) != AGREEMENT_INTEGRAL)
    return 0.0;
  const double both = (double)rimi_le_f32(row, AGREEMENT_FIRST + j) +
                      (double)rimi_le_f32(row, AGREEMENT_FIRST + a->outcomes + j);
  return both * (double)rimi_le_f32(a->level_inverse_sd, j);
}
