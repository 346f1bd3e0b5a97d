/* SPDX-License-Identifier: MIT */
/* Every bit of a verdict that decides anything, folded into one number. */
#include "base/crc.h"
#include "rim/monitor.h"

static uint64_t digest_interference(uint64_t digest, const rim_interference_verdict *v) {
  const double numbers[7] = {v->score[0],     v->score[1],     v->score[2],     v->ln_odds,
                             v->residual_mps, v->one_step_mps, v->since_onset_s};
  for (size_t i = 0; i < 7; ++i)
    digest = rimi_digest_f64(digest, numbers[i]);
  const uint32_t codes = (uint32_t)v->motion | (uint32_t)v->kind << 8 | (uint32_t)v->alarmed << 16;
  return rimi_digest_u32(digest, codes);
}

static uint64_t digest_alarm(uint64_t digest, const rim_alarm *a) {
  const rim_region *r = &a->region;
  digest = rimi_digest_u32(digest, (uint32_t)a->kind | (uint32_t)a->detector << 8);
  for (size_t i = 0; i < r->dims; ++i) {
    digest = rimi_digest_u32(digest, r->feature[i]);
    digest = rimi_digest_f64(digest, r->center[i]);
    digest = rimi_digest_f64(digest, r->lower[i]);
    digest = rimi_digest_f64(digest, r->upper[i]);
  }
  for (size_t i = 0; i < (size_t)r->dims * r->dims; ++i)
    digest = rimi_digest_f64(digest, r->inverse_shape[i]);
  for (size_t i = 0; i < a->channels; ++i) {
    digest = rimi_digest_u32(digest, a->channel[i]);
    digest = rimi_digest_f64(digest, a->shift[i]);
    digest = rimi_digest_f64(digest, a->shift_sd[i]);
  }
  digest = rimi_digest_f64(digest, a->since_s);
  return rimi_digest_f64(digest, a->since_sd_s);
}

uint64_t rim_verdict_digest(uint64_t digest, const rim_verdict *v) {
  if (v == NULL)
    return digest;
  const uint32_t words[4] = {
      v->blocks, v->channel,
      (uint32_t)v->level | (uint32_t)v->valid << 8 | (uint32_t)v->reason << 16, v->alarm.state};
  digest = rimi_digest_f64(digest, v->score);
  digest = rimi_digest_f64(digest, v->ln_anom);
  digest = rimi_digest_f64(digest, v->threshold);
  digest = rimi_digest_f64(digest, v->p_value);
  for (size_t i = 0; i < 4; ++i)
    digest = rimi_digest_u32(digest, words[i]);
  if (v->reason == RIM_REASON_OUT_OF_RANGE)
    digest = rimi_digest_u32(digest, v->out_feature);
  if (v->interference.valid)
    digest = digest_interference(digest, &v->interference);
  return v->alarm.state == RIM_ALARM_NONE ? digest : digest_alarm(digest, &v->alarm);
}
