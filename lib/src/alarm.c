#include "rim/alarm.h"

#include <string.h>

#include "rim/real.h"

static bool is_bound(double x) { return rim_is_finite(x) && x >= 0.0; }

static uint32_t saturated(uint32_t n) { return n < UINT32_MAX ? n + 1u : n; }

rim_status rim_alarm_life_init(rim_alarm_life *life, const rim_alarm_life_config *config) {
  if (life == NULL)
    return RIM_E_ARGUMENT;
  if (config != NULL &&
      !(is_bound(config->inhibit_s) && is_bound(config->update_ratio) && is_bound(config->stale_s)))
    return RIM_E_CONFIG;
  memset(life, 0, sizeof *life);
  if (config != NULL)
    life->config = *config;
  return RIM_OK;
}

/* What a reader would call another alarm. */
static bool is_other(const rim_alarm *a, const rim_alarm *b) {
  if (a->detector != b->detector || a->kind != b->kind || a->channels != b->channels ||
      a->region.dims != b->region.dims)
    return true;
  if (a->channels > 0 && a->channel[0] != b->channel[0])
    return true;
  for (uint8_t d = 0; d < a->region.dims && d < RIM_REGION_MAX_DIMS; d++)
    if (a->region.feature[d] != b->region.feature[d])
      return true;
  return false;
}

static bool is_update(const rim_alarm_life *life, double now_s, const rim_alarm *candidate,
                      rim_level level) {
  const rim_alarm *last = &life->last;
  if (level > (rim_level)life->level)
    return true;
  const double since_s = now_s - last->t_s;
  if (since_s >= 0.0 && since_s < life->config.inhibit_s)
    return false;
  const double moved = rim_abs(candidate->ln_anom - last->ln_anom);
  return level != (rim_level)life->level || is_other(candidate, last) ||
         (moved > 0.0 && moved >= life->config.update_ratio * rim_abs(last->ln_anom));
}

static bool emit(rim_alarm_life *life, double now_s, const rim_alarm *record, rim_alarm_state state,
                 rim_level level, rim_alarm *out) {
  rim_alarm sent = *record; /* record may be out itself */
  life->seq++;
  sent.t_s = now_s;
  sent.seq = life->seq;
  sent.state = (uint8_t)state;
  sent.level = (uint8_t)level;
  if (life->config.clear_steps == 0 && state != RIM_ALARM_NONE)
    sent.flags |= (uint8_t)RIM_ALARM_FLAG_LATCHED;
  life->last = sent;
  *out = sent;
  return true;
}

static bool emit_empty(rim_alarm_life *life, double now_s, rim_level level, rim_alarm *out) {
  rim_alarm empty;
  memset(&empty, 0, sizeof empty);
  empty.since_s = now_s;
  empty.model_id = life->last.model_id;
  empty.flags = (uint8_t)(life->last.flags & RIM_ALARM_FLAG_REPLAY);
  return emit(life, now_s, &empty, RIM_ALARM_NONE, level, out);
}

static bool step_found(rim_alarm_life *life, double now_s, const rim_alarm *candidate,
                       bool was_stale, rim_alarm *out) {
  const rim_level level = candidate->level == RIM_LEVEL_WARN ? RIM_LEVEL_WARN : RIM_LEVEL_ERROR;
  if (life->active) {
    if (!was_stale && !is_update(life, now_s, candidate, level))
      return false;
    life->level = (uint8_t)level;
    return emit(life, now_s, candidate, RIM_ALARM_UPDATED, level, out);
  }
  if (life->found >= life->config.raise_steps) {
    life->active = true;
    life->level = (uint8_t)level;
    return emit(life, now_s, candidate, RIM_ALARM_RAISED, level, out);
  }
  return was_stale && emit_empty(life, now_s, RIM_LEVEL_OK, out);
}

static bool step_missing(rim_alarm_life *life, double now_s, bool was_stale, rim_alarm *out) {
  if (life->active && life->config.clear_steps != 0 && life->missing >= life->config.clear_steps) {
    life->active = false;
    return emit(life, now_s, &life->last, RIM_ALARM_CLEARED, RIM_LEVEL_OK, out);
  }
  if (!was_stale)
    return false;
  if (!life->active)
    return emit_empty(life, now_s, RIM_LEVEL_OK, out);
  return emit(life, now_s, &life->last, RIM_ALARM_UPDATED, (rim_level)life->level, out);
}

bool rim_alarm_life_step(rim_alarm_life *life, double now_s, const rim_alarm *candidate,
                         rim_alarm *out) {
  if (life == NULL || out == NULL)
    return false;
  if (!rim_is_finite(now_s)) {
    life->bad_time = saturated(life->bad_time);
    return false;
  }
  const bool found = candidate != NULL && candidate->level != RIM_LEVEL_OK;
  const bool was_stale = life->stale;
  life->step_s = now_s;
  life->started = true;
  life->stale = false;
  life->found = found ? saturated(life->found) : 0;
  life->missing = found ? 0 : saturated(life->missing);
  return found ? step_found(life, now_s, candidate, was_stale, out)
               : step_missing(life, now_s, was_stale, out);
}

bool rim_alarm_life_idle(rim_alarm_life *life, double now_s, rim_alarm *out) {
  if (life == NULL || out == NULL)
    return false;
  if (!rim_is_finite(now_s)) {
    life->bad_time = saturated(life->bad_time);
    return false;
  }
  if (life->stale || !life->started || !(life->config.stale_s > 0.0) ||
      now_s - life->step_s < life->config.stale_s)
    return false;
  life->stale = true;
  life->found = 0; /* steps on either side of a gap are not in a row */
  life->missing = 0;
  if (life->active)
    return emit(life, now_s, &life->last, RIM_ALARM_UPDATED, RIM_LEVEL_STALE, out);
  return emit_empty(life, now_s, RIM_LEVEL_STALE, out);
}
