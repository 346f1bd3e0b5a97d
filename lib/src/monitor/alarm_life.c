/* SPDX-License-Identifier: MIT */
#include "monitor/alarm_life.h"

#include <string.h>

#include "base/real.h"
#include "base/usable.h"

static bool is_bound(double x) { return rimi_is_finite(x) && x >= 0.0; }

rim_status rimi_alarm_life_init(rim_alarm_life *life, const rim_alarm_life_config *config) {
  if (life == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    if (!is_bound(config->slot[i].inhibit_s) || !is_bound(config->slot[i].update_ratio))
      return RIM_E_CONFIG;
  if (!is_bound(config->policy.stale_s))
    return RIM_E_CONFIG;
  memset(life, 0, sizeof *life);
  life->config = *config;
  life->slot[0].record.model_id = config->model_id;
  return RIM_OK;
}

/* ---- records that wait ---- */

static bool waits_as(const rim_alarm_slot *slot, rim_alarm_state state) {
  return slot->due && slot->record.state == state;
}

/* The slot's record is to be sent with this state. A RAISED that has not left yet stays one. */
static void make_due(rim_alarm_life *life, rim_alarm_slot *slot, double t_s,
                     rim_alarm_state state) {
  const bool is_unheard = waits_as(slot, RIM_ALARM_RAISED);
  slot->record.t_s = t_s;
  slot->record.state =
      (uint8_t)(is_unheard && state == RIM_ALARM_UPDATED ? RIM_ALARM_RAISED : state);
  if (!slot->due)
    slot->ticket = ++life->tickets;
  slot->due = true;
}

static void describe(rim_alarm_slot *slot, const rim_alarm *candidate) {
  const uint32_t seq = slot->record.seq;
  const uint8_t state = slot->record.state;
  slot->record = *candidate;
  slot->record.seq = seq;
  slot->record.state = state;
}

static void clear(rim_alarm_life *life, rim_alarm_slot *slot, double t_s) {
  slot->stands = slot->is_over = slot->acknowledged = false;
  make_due(life, slot, t_s, RIM_ALARM_CLEARED);
}

/* The cause is gone. */
static void end(rim_alarm_life *life, rim_alarm_slot *slot, double t_s) {
  if (!life->config.policy.latch || slot->acknowledged) {
    clear(life, slot, t_s);
    return;
  }
  slot->is_over = true;
  make_due(life, slot, t_s, RIM_ALARM_UPDATED);
}

static bool any_stands(const rim_alarm_life *life) {
  return life->slot[0].stands || life->slot[1].stands;
}

/* Sends a record of every alarm that stands; where none does, of the level alone. */
static void tell_all(rim_alarm_life *life, double t_s) {
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    if (life->slot[i].stands)
      make_due(life, &life->slot[i], t_s, RIM_ALARM_UPDATED);
  life->empty_due = !any_stands(life);
  life->empty_s = t_s;
}

rim_status rimi_alarm_life_set_policy(rim_alarm_life *life, const rim_alarm_policy *policy) {
  if (life == NULL || policy == NULL)
    return RIM_E_ARGUMENT;
  if (!is_bound(policy->stale_s))
    return RIM_E_CONFIG;
  life->config.policy = *policy;
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    if (life->slot[i].is_over && !policy->latch)
      clear(life, &life->slot[i], life->row_s);
  return RIM_OK;
}

/* ---- rows and silence ---- */

static bool is_silence(const rim_alarm_life *life, double now_s) {
  const double stale_s = life->config.policy.stale_s;
  return life->started && !life->stale && stale_s > 0.0 && now_s - life->row_s > stale_s;
}

/* Steps on either side of a silence are not in a row. */
static void note_silence(rim_alarm_life *life) {
  count(&life->stale_times);
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    life->slot[i].found = life->slot[i].missing = 0;
}

void rimi_alarm_life_row(rim_alarm_life *life, double now_s) {
  if (life->has_row && is_silence(life, now_s)) /* before it another clock may have been asked */
    note_silence(life);
  if (life->stale) {
    life->stale = false;
    tell_all(life, now_s);
  }
  life->row_s = now_s;
  life->started = life->has_row = true;
}

bool rimi_alarm_life_idle(rim_alarm_life *life, double now_s) {
  if (!rimi_is_finite(now_s))
    return false;
  if (!life->started) {
    life->row_s = now_s;
    life->started = true;
  }
  if (!is_silence(life, now_s))
    return false;
  note_silence(life);
  life->stale = true;
  tell_all(life, life->row_s + life->config.policy.stale_s);
  return true;
}

/* ---- what a detector says ---- */

/* What a reader would call another alarm. */
static bool is_other(const rim_alarm *a, const rim_alarm *b) {
  if (a->kind != b->kind || a->channels != b->channels || a->region.dims != b->region.dims)
    return true;
  if (a->channels > 0 && (a->channel[0] != b->channel[0] || a->shift[0] * b->shift[0] < 0.0))
    return true;
  for (uint8_t d = 0; d < a->region.dims && d < RIM_REGION_MAX_DIMS; ++d)
    if (a->region.feature[d] != b->region.feature[d])
      return true;
  return false;
}

static bool is_update(const rim_alarm *last, const rim_alarm_slot_config *config, double now_s,
                      const rim_alarm *candidate) {
  const double since_s = now_s - last->t_s;
  if (since_s >= 0.0 && since_s < config->inhibit_s) /* a clock that went back inhibits nothing */
    return false;
  /* What would not raise an alarm does not replace what has raised one. */
  if (is_other(candidate, last))
    return candidate->level == RIM_LEVEL_ERROR;
  const double moved = rimi_abs(candidate->ln_anom - last->ln_anom);
  return moved > 0.0 && moved >= config->update_ratio * rimi_abs(last->ln_anom);
}

static void begin(rim_alarm_life *life, rim_alarm_slot *slot, double now_s,
                  const rim_alarm *candidate) {
  const bool is_back = slot->is_over; /* latched, and found again: the same alarm goes on */
  describe(slot, candidate);
  make_due(life, slot, now_s, is_back ? RIM_ALARM_UPDATED : RIM_ALARM_RAISED);
  slot->stands = true;
  slot->is_over = false;
  if (!is_back)
    count(&life->raised);
}

bool rimi_alarm_life_would_raise(const rim_alarm_life *life, rim_detector detector,
                                 const rim_alarm *candidate) {
  if ((unsigned)detector >= RIM_DETECTORS)
    return false;
  const rim_alarm_slot *slot = &life->slot[detector];
  return candidate->level == RIM_LEVEL_ERROR && !slot->stands &&
         slot->found + 1u >= life->config.slot[detector].raise_steps;
}

void rimi_alarm_life_step(rim_alarm_life *life, rim_detector detector, double now_s,
                          const rim_alarm *candidate) {
  if ((unsigned)detector >= RIM_DETECTORS || !rimi_is_finite(now_s))
    return;
  rim_alarm_slot *slot = &life->slot[detector];
  const rim_alarm_slot_config *config = &life->config.slot[detector];
  const uint8_t level = candidate != NULL ? candidate->level : (uint8_t)RIM_LEVEL_OK;
  const bool found = level == RIM_LEVEL_ERROR;
  const bool is_held = slot->stands && !slot->is_over;
  slot->level = level;
  slot->found = found ? slot->found + (slot->found != UINT32_MAX) : 0;
  if (found || (is_held && level == RIM_LEVEL_WARN))
    slot->missing = 0;
  else
    count(&slot->missing);
  const bool waits_raised = waits_as(slot, RIM_ALARM_RAISED);
  const bool waits_cleared = waits_as(slot, RIM_ALARM_CLEARED);
  if (!is_held) {
    if (found && slot->found >= config->raise_steps && !waits_cleared)
      begin(life, slot, now_s, candidate);
  } else if (slot->missing == 0) {
    if (is_update(&slot->record, config, now_s, candidate)) {
      describe(slot, candidate);
      make_due(life, slot, now_s, RIM_ALARM_UPDATED);
    }
  } else if (config->clear_steps != 0 && slot->missing >= config->clear_steps && !waits_raised) {
    end(life, slot, now_s);
  }
}

bool rimi_alarm_life_over(rim_alarm_life *life, rim_detector detector, double now_s) {
  if ((unsigned)detector >= RIM_DETECTORS || !rimi_is_finite(now_s))
    return false;
  rim_alarm_slot *slot = &life->slot[detector];
  const bool waits_raised = waits_as(slot, RIM_ALARM_RAISED);
  if (!slot->stands || slot->is_over || waits_raised)
    return false;
  slot->found = slot->missing = 0;
  end(life, slot, now_s);
  return true;
}

/* ---- commands, restarts ---- */

static bool means_any(const rim_alarm_life *life, uint32_t asked) {
  return asked == 0 && life->config.policy.command_any;
}

/* On 8 bits 0 is a number like any other: it names record 256 as well as any record. */
static bool agrees(uint32_t asked, uint32_t have, uint32_t mask) {
  return (asked & mask) == (have & mask);
}

/* Until its RAISED has left, an alarm has no number: its slot's is of the alarm before. */
static bool is_named(const rim_alarm_slot *slot, uint32_t asked, uint32_t mask) {
  return !waits_as(slot, RIM_ALARM_RAISED) && agrees(asked, slot->record.seq, mask);
}

static void acknowledge(rim_alarm_life *life, rim_alarm_slot *slot) {
  if (slot->acknowledged)
    return;
  slot->acknowledged = true;
  if (slot->is_over)
    clear(life, slot, life->row_s);
  else
    make_due(life, slot, life->row_s, RIM_ALARM_UPDATED);
}

static void forget(rim_alarm_slot *slot) {
  slot->found = slot->missing = 0;
  slot->level = RIM_LEVEL_OK;
}

rim_status rimi_alarm_life_command(rim_alarm_life *life, const rim_command *command, unsigned bits,
                                   uint32_t *forget_detectors) {
  if (life == NULL || command == NULL || forget_detectors == NULL)
    return RIM_E_ARGUMENT;
  *forget_detectors = 0;
  if (command->command != RIM_COMMAND_ACKNOWLEDGE && command->command != RIM_COMMAND_CLEAR)
    return RIM_E_RANGE;
  const uint32_t mask = bits >= 32u ? UINT32_MAX : ((uint32_t)1 << bits) - 1u;
  const bool all = means_any(life, command->sequence);
  uint32_t meant = 0, number = 0;
  for (size_t i = 0; i < RIM_DETECTORS; ++i) {
    if (life->slot[i].stands && (all || is_named(&life->slot[i], command->sequence, mask))) {
      meant |= (uint32_t)1 << i;
      ++number;
    }
  }
  if (number == 0 || (number > 1 && !all) ||
      !(means_any(life, command->model_id) ||
        agrees(command->model_id, life->config.model_id, mask)))
    return RIM_E_DATA;
  for (size_t i = 0; i < RIM_DETECTORS; ++i) {
    if ((meant >> i & 1u) == 0)
      continue;
    if (command->command == RIM_COMMAND_ACKNOWLEDGE) {
      acknowledge(life, &life->slot[i]);
    } else {
      clear(life, &life->slot[i], life->row_s);
      forget(&life->slot[i]);
      *forget_detectors |= (uint32_t)1 << i;
    }
  }
  return RIM_OK;
}

void rimi_alarm_life_restart(rim_alarm_life *life, double now_s) {
  for (size_t i = 0; i < RIM_DETECTORS; ++i) {
    rim_alarm_slot *slot = &life->slot[i];
    forget(slot);
    if (slot->stands && !slot->is_over)
      end(life, slot, now_s);
  }
  life->row_s = now_s;
}

void rimi_alarm_life_reset(rim_alarm_life *life) {
  const rim_alarm_life before = *life;
  (void)rimi_alarm_life_init(life, &before.config); /* which was accepted before */
  life->seq = before.seq;
  life->raised = before.raised;
  life->stale_times = before.stale_times;
}

void rimi_alarm_life_repeat(rim_alarm_life *life) {
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    if (life->slot[i].stands)
      make_due(life, &life->slot[i], life->row_s, RIM_ALARM_UPDATED);
}

/* ---- what leaves ---- */

/* A record leaves: numbered, with what is true of the slot now. */
static void send(rim_alarm_life *life, size_t detector, rim_alarm *out) {
  rim_alarm_slot *slot = &life->slot[detector];
  rim_alarm *record = &slot->record;
  unsigned flags = life->config.policy.replay ? RIM_ALARM_FLAG_REPLAY : 0u;
  if (slot->is_over)
    flags |= RIM_ALARM_FLAG_LATCHED;
  if (slot->acknowledged)
    flags |= RIM_ALARM_FLAG_ACKNOWLEDGED;
  if (++life->seq == 0) /* 0 means: never sent */
    life->seq = 1;
  record->seq = life->seq;
  record->flags = (uint8_t)flags;
  record->level =
      (uint8_t)(record->state == RIM_ALARM_CLEARED ? RIM_LEVEL_OK : rimi_alarm_life_level(life));
  record->detector = (uint8_t)detector;
  record->model_id = life->config.model_id;
  life->told = (uint8_t)detector;
  slot->due = false;
  *out = *record;
}

void rimi_alarm_life_go_on(rim_alarm_life *life, const rim_alarm_policy *policy, uint32_t seq,
                           uint32_t raised) {
  if (is_bound(policy->stale_s))
    life->config.policy = *policy;
  life->seq = seq;
  life->raised = raised;
  life->stale = life->started = true;
}

bool rimi_alarm_life_waits(const rim_alarm_life *life) {
  return life->slot[0].due || life->slot[1].due || life->empty_due;
}

bool rimi_alarm_life_next_record(rim_alarm_life *life, rim_alarm *out) {
  const rim_alarm_slot *a = &life->slot[0], *b = &life->slot[1];
  if (a->due || b->due) {
    const bool second = !a->due || (b->due && a->ticket - b->ticket < UINT32_MAX / 2);
    send(life, second ? 1 : 0, out);
    return true;
  }
  const bool empty = life->empty_due && !any_stands(life);
  life->empty_due = false;
  if (!empty)
    return false;
  memset(&life->slot[0].record, 0, sizeof life->slot[0].record);
  life->slot[0].record.t_s = life->slot[0].record.since_s = life->empty_s;
  send(life, 0, out);
  return true;
}

rim_level rimi_alarm_life_level(const rim_alarm_life *life) {
  if (life->stale)
    return RIM_LEVEL_STALE;
  if (any_stands(life))
    return RIM_LEVEL_ERROR;
  return life->slot[0].level != RIM_LEVEL_OK || life->slot[1].level != RIM_LEVEL_OK ? RIM_LEVEL_WARN
                                                                                    : RIM_LEVEL_OK;
}

const rim_alarm *rimi_alarm_life_standing(const rim_alarm_life *life, rim_detector detector) {
  const bool stands = (unsigned)detector < RIM_DETECTORS && life->slot[detector].stands;
  return stands ? &life->slot[detector].record : NULL;
}

void rimi_alarm_life_status(const rim_alarm_life *life, rim_alarm_status *status) {
  memset(status, 0, sizeof *status);
  const size_t front =
      life->slot[life->told].stands || !any_stands(life) ? life->told : 1u - life->told;
  status->newest = life->slot[front].record;
  status->records = life->seq;
  status->level = (uint8_t)rimi_alarm_life_level(life);
  status->stands = any_stands(life);
  status->acknowledged = status->stands;
  for (size_t i = 0; i < RIM_DETECTORS; ++i)
    if (life->slot[i].stands && !life->slot[i].acknowledged)
      status->acknowledged = false;
}
