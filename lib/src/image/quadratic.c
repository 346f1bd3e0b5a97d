/* SPDX-License-Identifier: MIT */
#include "image/quadratic.h"

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"

static const uint8_t *word_at(const rim_quadratic *q, size_t word) {
  return q->section + 4u * word;
}

static size_t model_words(const rim_quadratic *q) {
  return 1u + RIM_QUADRATIC_TERMS((size_t)q->inputs, (size_t)q->paired);
}

static const uint8_t *model_at(const rim_quadratic *q, uint32_t k) {
  return word_at(q, RIM_QUADRATIC_HEADER_WORDS + 2u * q->inputs + (size_t)k * model_words(q));
}

static uint32_t use_of(const rim_quadratic *q, uint32_t k) {
  return rimi_le_u16(model_at(q, k), 1);
}

static rim_status check_models(const rim_quadratic *q, uint32_t outcomes) {
  uint32_t least = 0; /* place of the next model: use * outcomes + outcome */
  for (uint32_t k = 0; k < q->models; ++k) {
    const uint8_t *model = model_at(q, k);
    const uint32_t outcome = rimi_le_u16(model, 0);
    const uint32_t place = use_of(q, k) * outcomes + outcome;
    if (place < least || outcome >= outcomes || use_of(q, k) > RIM_QUADRATIC_STEPS)
      return RIM_E_RANGE;
    if (!numbers_are_finite(model + 4, model_words(q) - 1u))
      return RIM_E_DATA;
    least = place + 1u;
  }
  return RIM_OK;
}

static rim_status check_scales(const rim_quadratic *q) {
  const uint8_t *scales = word_at(q, RIM_QUADRATIC_HEADER_WORDS);
  return numbers_are_finite(scales, q->inputs) &&
                 numbers_are_positive(scales + 4u * (size_t)q->inputs, q->inputs)
             ? RIM_OK
             : RIM_E_DATA;
}

rim_status rimi_quadratic_open(rim_quadratic *view, const uint8_t *section, size_t bytes,
                               uint32_t inputs, uint32_t outcomes) {
  if (((uintptr_t)section & 3u) != 0u)
    return RIM_E_ALIGN;
  if (bytes < 4u * RIM_QUADRATIC_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  if (rimi_le_u32(section, 0) != RIM_QUADRATIC_LAYOUT)
    return RIM_E_VERSION;
  const uint32_t models = rimi_le_u32(section, 2), paired = rimi_le_u32(section, 3);
  if (rimi_le_u32(section, 1) != inputs || inputs > RIM_QUADRATIC_MAX_INPUTS || models == 0 ||
      models > 2u * outcomes || models > UINT16_MAX || (paired != inputs && paired != 2u * inputs))
    return RIM_E_RANGE;
  const rim_quadratic q = {.section = section,
                           .inputs = (uint16_t)inputs,
                           .models = (uint16_t)models,
                           .paired = (uint16_t)paired};
  const size_t need = (size_t)(model_at(&q, q.models) - section);
  if (bytes != need)
    return bytes < need ? RIM_E_TRUNCATED : RIM_E_SIZE;
  rim_status status = check_scales(&q);
  if (status == RIM_OK)
    status = check_models(&q, outcomes);
  if (status == RIM_OK)
    *view = q;
  return status;
}

bool rimi_quadratic_has(const rim_quadratic *q, rim_quadratic_use use, uint32_t outcome) {
  for (uint32_t k = 0; k < q->models; ++k) {
    if (use_of(q, k) == (uint32_t)use && rimi_le_u16(model_at(q, k), 0) == outcome)
      return true;
  }
  return false;
}

bool rimi_quadratic_has_steps(const rim_quadratic *q) {
  return q->models > 0 && use_of(q, q->models - 1u) == RIM_QUADRATIC_STEPS;
}

void rimi_quadratic_take(const rim_quadratic *q, const double *x, bool follows, double *z) {
  const uint8_t *scales = word_at(q, RIM_QUADRATIC_HEADER_WORDS);
  for (size_t i = 0; i < q->inputs; ++i) {
    const double off = x[i] - (double)rimi_le_f32(scales, i);
    const double now = rimi_clamp(off * (double)rimi_le_f32(scales, q->inputs + i),
                                  -RIM_QUADRATIC_CLIP, RIM_QUADRATIC_CLIP);
    z[q->inputs + i] = follows ? z[i] : now;
    z[i] = now;
  }
}

void rimi_quadratic_predict(const rim_quadratic *q, rim_quadratic_use use, const double *z,
                            double *predicted) {
  for (uint32_t k = 0; k < q->models; ++k) {
    if (use_of(q, k) != (uint32_t)use)
      continue;
    const uint8_t *model = model_at(q, k), *weight = model + 4;
    double sum = (double)rimi_le_f32(weight, 0);
    size_t at = 1;
    for (size_t i = 0; i < 2u * (size_t)q->inputs; ++i)
      sum += (double)rimi_le_f32(weight, at++) * z[i];
    for (size_t i = 0; i < q->paired; ++i) {
      double of_i = 0.0;
      for (size_t j = i; j < q->paired; ++j)
        of_i += (double)rimi_le_f32(weight, at++) * z[j];
      sum += z[i] * of_i;
    }
    predicted[rimi_le_u16(model, 0)] = sum;
  }
}
