#include "basis.h"

#include <stdbool.h>

#include "rim/image.h"
#include "rim/real.h"

enum { HEADER_WORDS = 8, SHORT_HEADER_WORDS = 4 };

static bool finite_numbers(const uint8_t *p, size_t count, bool positive) {
  for (size_t i = 0; i < count; ++i) {
    const double v = (double)rim_image_f32(p, i);
    if (!rim_is_finite(v) || (positive && !(v > 0.0)))
      return false;
  }
  return true;
}

static bool inputs_fit(const rim_basis *b, uint32_t features) {
  for (size_t i = 0; i < b->inputs; ++i) {
    const uint16_t second = rim_image_u16(b->input, 2 * i + 1);
    if (rim_image_u16(b->input, 2 * i) >= features ||
        ((second & ~BASIS_OF_PRODUCT) >= features && second != BASIS_PLAIN &&
         second != BASIS_MAGNITUDE))
      return false;
  }
  for (size_t t = 0; t < b->times; ++t) {
    const double share = (double)rim_image_f32(b->share, t);
    if (!(share > 0.0 && share <= 1.0))
      return false;
  }
  return true;
}

static bool terms_fit(const rim_basis *b, uint32_t outcomes) {
  const uint32_t filters = b->inputs * b->times;
  for (size_t i = 0; i < b->terms; ++i) {
    const uint16_t op = rim_image_u16(b->term, 4 * i);
    const uint16_t first = rim_image_u16(b->term, 4 * i + 1);
    const uint16_t second = rim_image_u16(b->term, 4 * i + 2);
    bool fits = false;
    switch ((basis_op)op) {
    case BASIS_MEAN:
    case BASIS_ABS: fits = first < filters; break;
    case BASIS_PRODUCT: fits = first < filters && second < filters; break;
    case BASIS_DECAY: fits = second < b->times; break;
    case BASIS_INTEGRAL: fits = first < b->inputs; break;
    case BASIS_INITIAL: fits = first < outcomes && second < b->times; break;
    case BASIS_TIME: fits = true; break;
    case BASIS_ROLLED: fits = first < outcomes; break;
    }
    if (!fits)
      return false;
  }
  for (size_t m = 0; m < b->means; ++m) {
    if (rim_image_u16(b->mean, 2 * m) >= filters)
      return false;
  }
  return true;
}

rim_status rim_basis_open(rim_basis *view, const uint8_t *section, size_t bytes, uint32_t features,
                          uint32_t outcomes) {
  if (bytes < 4u * HEADER_WORDS)
    return RIM_E_TRUNCATED;
  rim_basis b;
  if (rim_image_u32(section, 0) != BASIS_LAYOUT)
    return RIM_E_VERSION;
  b.inputs = rim_image_u32(section, 1);
  b.times = rim_image_u32(section, 2);
  b.terms = rim_image_u32(section, 3);
  b.means = rim_image_u32(section, 4);
  if (b.inputs > BASIS_MAX_INPUTS || b.times > BASIS_MAX_TIMES || b.terms > BASIS_MAX_TERMS ||
      b.means > BASIS_MAX_MEANS)
    return RIM_E_RANGE;
  const size_t need = 4u * (HEADER_WORDS + (size_t)b.inputs + b.times + 4u * (size_t)b.terms +
                            3u * (size_t)b.means + outcomes);
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
  if (!inputs_fit(&b, features) || !terms_fit(&b, outcomes))
    return RIM_E_RANGE;
  if (!finite_numbers(b.center, b.terms, false) || !finite_numbers(b.inverse_sd, b.terms, true) ||
      !finite_numbers(b.mean_center, b.means, false) ||
      !finite_numbers(b.mean_inverse_sd, b.means, true) ||
      !finite_numbers(b.first, outcomes, false))
    return RIM_E_DATA;
  *view = b;
  return RIM_OK;
}

rim_status rim_behaviour_open(rim_behaviour *view, const uint8_t *section, size_t bytes,
                              uint32_t terms, uint32_t outcomes) {
  if (bytes < 4u * SHORT_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rim_image_u32(section, 0) != 1u)
    return RIM_E_VERSION;
  if (rim_image_u32(section, 1) != terms || rim_image_u32(section, 2) != 2u * outcomes)
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
    if (rim_image_u32(b.from_start, i) > 1u)
      return RIM_E_RANGE;
  }
  if (!finite_numbers(b.intercept, targets * (1u + (size_t)terms), false))
    return RIM_E_DATA;
  *view = b;
  return RIM_OK;
}

void rim_behaviour_predict(const rim_behaviour *view, const double *term, const double *first,
                           double *predicted) {
  const uint32_t outcomes = view->targets / 2u;
  for (size_t o = 0; o < view->targets; ++o) {
    double sum = (double)rim_image_f32(view->intercept, o);
    const uint8_t *row = view->weight + 4u * o * view->terms;
    for (size_t i = 0; i < view->terms; ++i)
      sum += (double)rim_image_f32(row, i) * term[i];
    if (o < outcomes && rim_image_u32(view->from_start, o) != 0u)
      sum += first[o];
    predicted[o] = sum;
  }
}

rim_status rim_agreement_open(rim_agreement *view, const uint8_t *section, size_t bytes,
                              uint32_t outcomes, uint32_t means) {
  if (bytes < 4u * SHORT_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rim_image_u32(section, 0) != 1u)
    return RIM_E_VERSION;
  if (rim_image_u32(section, 1) != outcomes || rim_image_u32(section, 2) != means)
    return RIM_E_RANGE;
  const size_t numbers = (size_t)outcomes * (3u + (size_t)outcomes * (2u + (size_t)means));
  if (bytes != 4u * (SHORT_HEADER_WORDS + numbers))
    return RIM_E_TRUNCATED;
  const uint8_t *data = section + 4u * SHORT_HEADER_WORDS;
  if (!finite_numbers(data, outcomes, true) || !finite_numbers(data, numbers, false))
    return RIM_E_DATA;
  *view = (rim_agreement){outcomes, means, data, data + 4u * outcomes};
  return RIM_OK;
}

void rim_agreement_evaluate(const rim_agreement *view, const double *residual, const double *mean,
                            const double *measured, const double *level, double *before,
                            double *remains) {
  const size_t o_count = view->outcomes;
  const size_t stride = 2u + o_count * (2u + view->means);
  for (size_t o = 0; o < o_count; ++o) {
    const uint8_t *row = view->row + 4u * o * stride;
    if (level != NULL && rim_image_f32(row, 0) > 0.5f) {
      remains[o] = measured[o] - level[o];
      continue;
    }
    double sum = (double)rim_image_f32(row, 1);
    for (size_t j = 0; j < o_count; ++j) {
      if (j == o)
        continue;
      const double now = rim_clamp(residual[j] * (double)rim_image_f32(view->inverse_sd, j),
                                   -AGREEMENT_CLIP, AGREEMENT_CLIP);
      double weight = (double)rim_image_f32(row, 2u + j);
      for (size_t m = 0; m < view->means; ++m)
        weight += (double)rim_image_f32(row, 2u + (2u + m) * o_count + j) * mean[m];
      sum += weight * now + (double)rim_image_f32(row, 2u + o_count + j) * before[j];
    }
    remains[o] = residual[o] - sum / (double)rim_image_f32(view->inverse_sd, o);
  }
  for (size_t j = 0; j < o_count; ++j)
    before[j] = rim_clamp(residual[j] * (double)rim_image_f32(view->inverse_sd, j), -AGREEMENT_CLIP,
                          AGREEMENT_CLIP);
}
