/* SPDX-License-Identifier: MIT */
#include "image/threshold.h"

#include <float.h>
#include <stdbool.h>

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "rim/image.h"

enum { HEADER_U32S = 4, HEADER_F32S = 4 };

static bool maxima_ascend(const rim_threshold *t) {
  for (size_t i = 1; i < t->runs; ++i) {
    if (rimi_le_f32(t->maxima, i) < rimi_le_f32(t->maxima, i - 1))
      return false;
  }
  return true;
}

static bool scales_are_valid(const rim_threshold *t) {
  for (size_t i = 0; i < t->knots; ++i) {
    if (!(rimi_le_f32(t->growth, i) >= FLT_MIN))
      return false;
  }
  for (size_t c = 0; c < t->channels; ++c) {
    if (!(rimi_le_f32(t->scale, c) > 0.0f) || !(rimi_le_f32(t->offset, c) >= 0.0f)) {
      return false;
    }
  }
  return t->alarm_score > 0.0 && t->warn_score <= t->alarm_score && t->promised_rate > 0.0 &&
         t->promised_rate <= 1.0;
}

rim_status rimi_threshold_open(rim_threshold *view, const uint8_t *section, size_t bytes) {
  if (view == NULL || section == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_THRESHOLD_HEADER_BYTES)
    return RIM_E_TRUNCATED;
  rim_threshold t;
  t.channels = rimi_le_u32(section, 0);
  t.runs = rimi_le_u32(section, 1);
  t.knots = rimi_le_u32(section, 2);
  t.rank = rimi_le_u32(section, 3);
  if (t.channels < 1 || t.channels > 1024 || t.runs > RIM_THRESHOLD_MAX_RUNS ||
      t.knots > RIM_THRESHOLD_MAX_KNOTS || t.rank > t.runs + 1u) {
    return RIM_E_RANGE;
  }
  const size_t values = HEADER_F32S + t.runs + t.knots + 2u * (size_t)t.channels;
  if (bytes != 4u * (HEADER_U32S + values))
    return RIM_E_TRUNCATED;
  if (!numbers_are_finite(section + 4u * HEADER_U32S, values))
    return RIM_E_RANGE;
  t.alarm_score = (double)rimi_le_f32(section, HEADER_U32S);
  t.warn_score = (double)rimi_le_f32(section, HEADER_U32S + 1);
  t.promised_rate = (double)rimi_le_f32(section, HEADER_U32S + 2);
  t.maxima = section + RIM_THRESHOLD_HEADER_BYTES;
  t.growth = t.maxima + 4u * (size_t)t.runs;
  t.offset = t.growth + 4u * (size_t)t.knots;
  t.scale = t.offset + 4u * (size_t)t.channels;
  if (!maxima_ascend(&t) || !scales_are_valid(&t))
    return RIM_E_RANGE;
  *view = t;
  return RIM_OK;
}

double rimi_threshold_growth(const rim_threshold *view, uint32_t observations) {
  if (view->knots == 0)
    return 1.0;
  const uint32_t n = observations > 0 ? observations : 1;
  uint32_t octave = 0;
  while (octave < 31u && n >> (octave + 1u) != 0u)
    ++octave; /* at most 31 turns */
  if (octave + 1u >= view->knots)
    return (double)rimi_le_f32(view->growth, view->knots - 1u);
  const double low = (double)rimi_le_f32(view->growth, octave);
  const double high = (double)rimi_le_f32(view->growth, octave + 1u);
  const double base = (double)(1u << octave);
  /* Linear in n within the octave: close to linear in log2 n and free of a logarithm. */
  return low + (high - low) * (((double)n - base) / base);
}

double rimi_threshold_score(const rim_threshold *view, uint16_t channel, double ln_anom,
                            uint32_t observations) {
  return (ln_anom / rimi_threshold_growth(view, observations) -
          (double)rimi_le_f32(view->offset, channel)) /
         (double)rimi_le_f32(view->scale, channel);
}

double rimi_threshold_ln_anom(const rim_threshold *view, uint16_t channel, uint32_t observations) {
  return (view->alarm_score * (double)rimi_le_f32(view->scale, channel) +
          (double)rimi_le_f32(view->offset, channel)) *
         rimi_threshold_growth(view, observations);
}

double rimi_threshold_p_value(const rim_threshold *view, double score) {
  uint32_t low = 0;
  uint32_t high = view->runs;
  while (low < high) { /* bisection: at most 13 turns */
    const uint32_t middle = low + (high - low) / 2u;
    if ((double)rimi_le_f32(view->maxima, middle) >= score) {
      high = middle;
    } else {
      low = middle + 1u;
    }
  }
  return (double)(1u + (view->runs - low)) / (double)(view->runs + 1u);
}
