/* SPDX-License-Identifier: MIT */
#include "image/noise.h"

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "rim/image.h"

static bool is_channel_valid(const rim_noise *view, uint32_t c) {
  const noise_channel n = rimi_noise_channel(view, c);
  const uint8_t *at = view->channel + 4u * (size_t)c * view->stride;
  if (!numbers_are_finite(at, view->stride) || !(rimi_le_f32(at, 1) >= 0.0f) ||
      n.fields > view->fields || !(n.rho >= 0.0f) || !(n.rho_rise >= 0.0f) ||
      !(rimi_noise_rho(&n, true) < 1.0) || !(n.s > 0.0f) || !(n.p_scale > 0.0f))
    return false;
  if (!numbers_are_positive(n.inverse_prior, view->fields))
    return false;
  for (size_t f = 0; f < NOISE_FAMILIES; ++f) {
    if (!(rimi_le_f32(n.phi, f) >= 1.0f))
      return false;
  }
  return true;
}

uint32_t rimi_noise_kinds(const uint8_t *section, size_t bytes, uint32_t outcomes) {
  const bool has_steps =
      bytes >= 8u && rimi_le_u32(section, 1) == (RIM_CHANNEL_STEP + 1u) * outcomes;
  return has_steps ? RIM_CHANNEL_STEP + 1u : RIM_CHANNEL_STEP;
}

rim_status rimi_noise_open(rim_noise *view, const uint8_t *section, size_t bytes, uint32_t channels,
                           uint32_t means) {
  if (bytes < 4u * NOISE_HEADER_WORDS)
    return RIM_E_TRUNCATED;
  const uint32_t layout = rimi_le_u32(section, 0);
  if (layout != NOISE_LAYOUT && layout != NOISE_LAYOUT_GAPS)
    return RIM_E_VERSION;
  rim_noise n;
  n.with_gaps = layout == NOISE_LAYOUT_GAPS;
  n.channels = rimi_le_u32(section, 1);
  n.raw = rimi_le_u32(section, 2);
  n.fields = rimi_le_u32(section, 3);
  n.run_s = (double)rimi_le_f32(section, 4);
  n.decay_s = (double)rimi_le_f32(section, 5);
  n.trend_s = (double)rimi_le_f32(section, 6);
  n.runs = rimi_le_u32(section, 7);
  n.activity = (double)rimi_le_f32(section, 8);
  if (n.channels != channels || n.raw != NOISE_RAW_FIRST + means || n.raw > NOISE_MAX_RAW ||
      n.fields < 1u || n.fields > NOISE_MAX_FIELDS || !rimi_is_finite(n.run_s) ||
      !rimi_is_finite(n.decay_s) || !(n.run_s > 0.0) || !(n.decay_s > 0.0) ||
      !rimi_is_finite(n.trend_s) || !(n.trend_s > 0.0) || !rimi_is_finite(n.activity))
    return RIM_E_RANGE;
  n.stride = NOISE_CHANNEL_WORDS + n.fields * (1u + n.raw) + NOISE_FAMILIES;
  if (bytes != 4u * (NOISE_HEADER_WORDS + (size_t)channels * n.stride))
    return RIM_E_TRUNCATED;
  n.channel = section + 4u * NOISE_HEADER_WORDS;
  for (uint32_t c = 0; c < channels; ++c) {
    if (!is_channel_valid(&n, c))
      return RIM_E_DATA;
  }
  *view = n;
  return RIM_OK;
}

noise_channel rimi_noise_channel(const rim_noise *view, uint32_t channel) {
  const uint8_t *at = view->channel + 4u * (size_t)channel * view->stride;
  noise_channel c;
  c.active = rimi_le_f32(at, 0);
  c.limit = c.active >= NOISE_LEAST_LIMIT ? c.active : 0.0f;
  const float fields = rimi_le_f32(at, 1);
  c.fields = fields >= 0.0f && fields <= (float)NOISE_MAX_FIELDS ? (uint32_t)fields : 0u;
  c.rho = rimi_le_f32(at, 2);
  c.s = rimi_le_f32(at, 3);
  c.p_center = rimi_le_f32(at, 4);
  c.p_scale = rimi_le_f32(at, 5);
  for (size_t i = 0; i < NOISE_SIGMA_TERMS; ++i)
    c.ln_sigma[i] = rimi_le_f32(at, 6 + i);
  c.mean = rimi_le_f32(at, 6 + NOISE_SIGMA_TERMS);
  c.rho_rise = rimi_le_f32(at, 7 + NOISE_SIGMA_TERMS);
  c.inverse_prior = at + 4u * NOISE_CHANNEL_WORDS;
  c.combination = c.inverse_prior + 4u * view->fields;
  c.phi = c.combination + 4u * view->fields * view->raw;
  return c;
}

double rimi_noise_rho(const noise_channel *c, bool moving) {
  return (double)c->rho + (moving ? (double)c->rho_rise : 0.0);
}

double rimi_noise_weight(const noise_channel *c, double p, double activity, double disturbance) {
  const double ln_sigma = (double)c->ln_sigma[0] * p + (double)c->ln_sigma[1] * (p * p - 1.0) +
                          (double)c->ln_sigma[2] * activity +
                          (double)c->ln_sigma[3] * (activity * activity - 1.0) +
                          (double)c->ln_sigma[4] * disturbance;
  return rimi_exp(-rimi_clamp(ln_sigma, -NOISE_LN_SIGMA, NOISE_LN_SIGMA));
}

double rimi_noise_gap_weight(double rho) {
  return rimi_sqrt((1.0 - rho * rho) / (1.0 + rho * rho));
}

double rimi_noise_counted(double fresh, double limit, noise_level *of_late) {
  double level = (double)of_late->level * NOISE_LEVEL_STEP;
  const double low = 2.0 * rimi_min(level, 0.0) - limit, high = 2.0 * rimi_max(level, 0.0) + limit;
  const int side = fresh > high ? 1 : fresh < low ? -1 : 0;
  const int beyond = side * of_late->beyond > 0 ? of_late->beyond + side : side;
  const bool lasts = beyond > NOISE_PATIENCE || beyond < -NOISE_PATIENCE;
  const double counted = lasts ? fresh : rimi_clamp(fresh, low, high);
  level = lasts ? fresh : level + NOISE_LEVEL_GAIN * (counted - level);
  level = rimi_clamp(level / NOISE_LEVEL_STEP, -32000.0, 32000.0);
  of_late->level = (int16_t)rimi_floor(level + 0.5);
  of_late->beyond = lasts ? 0 : (int16_t)beyond;
  return counted;
}

double rimi_noise_moved(double predicted, double before, double sd) {
  const double moved = rimi_clamp((predicted - before) / sd, -NOISE_MOVED, NOISE_MOVED);
  return moved * moved;
}

double rimi_noise_ln_moved(double squares, size_t outcomes) {
  return rimi_log(NOISE_STILL + rimi_sqrt(squares / (double)outcomes));
}

double rimi_noise_activity(const rim_noise *view, const double *predicted, const float *before,
                           size_t outcomes) {
  double squares = 0.0;
  for (size_t o = 0; o < outcomes; ++o) {
    const noise_channel c = rimi_noise_channel(view, (uint32_t)o);
    squares += rimi_noise_moved(predicted[o], (double)before[o], (double)c.p_scale);
  }
  return rimi_noise_ln_moved(squares, outcomes) - view->activity;
}

double rimi_noise_disturbance(const double *residual, size_t outcomes) {
  if (outcomes < 2)
    return 0.0;
  double sum = 0.0, largest = 0.0;
  for (size_t o = 0; o < outcomes; ++o) {
    const double in_sd = rimi_clamp(residual[o], -NOISE_DISTURBED, NOISE_DISTURBED);
    sum += in_sd * in_sd;
    largest = rimi_max(largest, in_sd * in_sd);
  }
  return rimi_log(NOISE_CALM + (sum - largest) / (double)(outcomes - 1u));
}
