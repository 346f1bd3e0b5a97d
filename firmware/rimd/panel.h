/* panel.h - what the outside is told of the monitor's alarm: latch, acknowledge, clear, stale
 * input.
 *
 * The monitor raises an alarm after persistence and clears it when its cause is gone (both in the
 * flight image). The panel numbers the records, holds an alarm that is over until somebody has
 * acknowledged it when asked to, and says STALE when the input stops.
 *
 * The alarms of both detectors, regions and motion interference, may stand at once: one of them
 * being over is told as CLEARED, and the other is then the one that the summary repeats and that
 * commands are for. Latch and acknowledgement are of what stands last. */
#ifndef PANEL_H
#define PANEL_H

#include <stdbool.h>
#include <stdint.h>

#include "rim/alarm_control.h"
#include "rim/monitor.h"

typedef struct panel_config {
  bool latch;
  bool replay;
} panel_config;

/* All zero: nothing has happened. Plain data: its bytes are its state. */
typedef struct panel {
  rim_alarm newest;  /* record sent last; what the cyclic summary repeats */
  rim_alarm held[2]; /* newest of each detector while it stands; state NONE: it does not */
  uint32_t seq;      /* records sent */
  uint32_t model_id;
  uint8_t level; /* of the newest row: OK, WARN or ERROR */
  bool stands;   /* raised and not cleared */
  bool is_over;  /* the monitor finds it no longer: it is latched */
  bool acknowledged;
  bool stale;
} panel;

/* Each returns whether *out is a record to send. */

/* A row's verdict; also ends STALE. */
bool panel_step(panel *p, const panel_config *config, const rim_verdict *verdict, rim_alarm *out);

/* The input has stopped, t_s on its clock. Once. */
bool panel_stale(panel *p, const panel_config *config, double t_s, rim_alarm *out);

/* The monitor was reset and has forgotten: as if it had cleared the alarm. */
bool panel_forgotten(panel *p, const panel_config *config, double t_s, rim_alarm *out);

/* After a restart: an alarm that stands is told again, as updated. */
bool panel_resume(panel *p, const panel_config *config, double t_s, rim_alarm *out);

typedef enum panel_answer {
  PANEL_REFUSED, /* for another record or model, or nothing stands */
  PANEL_TAKEN,   /* nothing to send */
  PANEL_SEND,    /* *out */
  PANEL_RESET    /* *out, and the monitor is to be reset */
} panel_answer;
/* bits: of sequence and model that the command's bus carries, 8 or 32. */
panel_answer panel_command(panel *p, const panel_config *config, const rim_command *command,
                           unsigned bits, double t_s, rim_alarm *out);

/* The standing alarm of the regions; NULL: none stands. */
const rim_alarm *panel_region(const panel *p);

/* rim_level of the vehicle now. */
uint8_t panel_level(const panel *p);

#endif
