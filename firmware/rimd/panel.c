#include "rimd/panel.h"

#include <string.h>

static bool send(panel *p, const panel_config *config, const rim_alarm *record,
                 rim_alarm_state state, uint8_t level, rim_alarm *out) {
  rim_alarm next = *record;
  next.seq = ++p->seq;
  next.state = (uint8_t)state;
  next.level = level;
  next.model_id = p->model_id;
  unsigned flags = record->flags & (unsigned)RIM_ALARM_FLAG_LATCHED;
  if (config->replay)
    flags |= RIM_ALARM_FLAG_REPLAY;
  if (p->stands && p->is_over)
    flags |= RIM_ALARM_FLAG_LATCHED;
  if (p->stands && p->acknowledged)
    flags |= RIM_ALARM_FLAG_ACKNOWLEDGED;
  next.flags = (uint8_t)flags;
  p->newest = next;
  *out = next;
  return true;
}

static rim_alarm empty_at(double t_s) {
  rim_alarm empty;
  memset(&empty, 0, sizeof empty);
  empty.t_s = empty.since_s = t_s;
  return empty;
}

/* The standing alarm at a new time; an empty record where none stands. */
static rim_alarm record_at(const panel *p, double t_s) {
  rim_alarm record = p->stands ? p->newest : empty_at(t_s);
  record.t_s = t_s;
  return record;
}

static bool send_standing(panel *p, const panel_config *config, double t_s, uint8_t level,
                          rim_alarm *out) {
  const rim_alarm record = record_at(p, t_s);
  return send(p, config, &record, p->stands ? RIM_ALARM_UPDATED : RIM_ALARM_NONE, level, out);
}

static bool send_cleared(panel *p, const panel_config *config, double t_s, rim_alarm *out) {
  rim_alarm record = record_at(p, t_s);
  p->stands = p->is_over = p->acknowledged = false;
  memset(p->held, 0, sizeof p->held);
  record.flags = 0;
  return send(p, config, &record, RIM_ALARM_CLEARED, RIM_LEVEL_OK, out);
}

/* The cause is gone. */
static bool over(panel *p, const panel_config *config, double t_s, rim_alarm *out) {
  if (!config->latch || p->acknowledged)
    return send_cleared(p, config, t_s, out);
  p->is_over = true;
  return send_standing(p, config, t_s, RIM_LEVEL_ERROR, out);
}

/* One detector finds nothing any more; the alarm of the other one still stands and comes to the
 * front. */
static bool one_over(panel *p, const panel_config *config, const rim_alarm *cleared,
                     rim_alarm *out) {
  const rim_alarm *other = &p->held[cleared->detector == RIM_DETECTOR_RIM];
  if (!p->stands || other->state == RIM_ALARM_NONE)
    return false;
  const rim_alarm front = *other;
  (void)send(p, config, cleared, RIM_ALARM_CLEARED, RIM_LEVEL_OK, out);
  p->newest = front;
  return true;
}

uint8_t panel_level(const panel *p) {
  if (p->stale)
    return RIM_LEVEL_STALE;
  return p->stands ? RIM_LEVEL_ERROR : p->level;
}

const rim_alarm *panel_region(const panel *p) {
  const rim_alarm *alarm =
      p->newest.detector == RIM_DETECTOR_RIM ? &p->newest : &p->held[RIM_DETECTOR_RIM];
  return p->stands && alarm->state != RIM_ALARM_NONE ? alarm : NULL;
}

bool panel_step(panel *p, const panel_config *config, const rim_verdict *verdict, rim_alarm *out) {
  const bool was_stale = p->stale;
  if (!verdict->valid)
    return false;
  p->stale = false;
  p->level = verdict->level == RIM_LEVEL_WARN || verdict->level == RIM_LEVEL_ERROR ? verdict->level
                                                                                   : RIM_LEVEL_OK;
  switch ((rim_alarm_state)verdict->alarm.state) {
  case RIM_ALARM_RAISED:
  case RIM_ALARM_UPDATED: {
    /* After a restart without its state a monitor updates what nobody has heard raised. */
    const bool is_new = !p->stands || verdict->alarm.state == RIM_ALARM_RAISED;
    p->stands = true;
    p->is_over = false;
    if (is_new)
      p->acknowledged = false;
    (void)send(p, config, &verdict->alarm, is_new ? RIM_ALARM_RAISED : RIM_ALARM_UPDATED,
               verdict->alarm.level, out);
    p->held[verdict->alarm.detector == RIM_DETECTOR_INTERFERENCE] = *out;
    return true;
  }
  case RIM_ALARM_CLEARED:
    p->held[verdict->alarm.detector == RIM_DETECTOR_INTERFERENCE].state = RIM_ALARM_NONE;
    return one_over(p, config, &verdict->alarm, out) ||
           (p->stands && over(p, config, verdict->t_s, out));
  case RIM_ALARM_NONE:
    break;
  }
  return was_stale && send_standing(p, config, verdict->t_s, panel_level(p), out);
}

bool panel_stale(panel *p, const panel_config *config, double t_s, rim_alarm *out) {
  if (p->stale)
    return false;
  p->stale = true;
  return send_standing(p, config, t_s, RIM_LEVEL_STALE, out);
}

bool panel_forgotten(panel *p, const panel_config *config, double t_s, rim_alarm *out) {
  p->level = RIM_LEVEL_OK;
  memset(p->held, 0, sizeof p->held);
  return p->stands && !p->is_over && over(p, config, t_s, out);
}

bool panel_resume(panel *p, const panel_config *config, double t_s, rim_alarm *out) {
  return p->stands && send_standing(p, config, t_s, panel_level(p), out);
}

panel_answer panel_command(panel *p, const panel_config *config, const rim_command *command,
                           unsigned bits, double t_s, rim_alarm *out) {
  if (!p->stands || !rim_command_is_for(command, p->newest.seq, p->model_id, bits))
    return PANEL_REFUSED;
  if (command->command == RIM_COMMAND_CLEAR) {
    (void)send_cleared(p, config, t_s, out);
    p->level = RIM_LEVEL_OK;
    return PANEL_RESET;
  }
  if (p->acknowledged)
    return PANEL_TAKEN;
  p->acknowledged = true;
  if (p->is_over)
    (void)send_cleared(p, config, t_s, out);
  else
    (void)send_standing(p, config, t_s, panel_level(p), out);
  return PANEL_SEND;
}
