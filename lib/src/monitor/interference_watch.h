/* SPDX-License-Identifier: MIT */
/* interference_watch.h - private: the motion-interference detector inside the monitor. Which
 * numbers of a row it is given comes from the image (RIM_SECTION_INTERFERENCE_INPUTS). The life of
 * its alarm is alarm_life.h's. Plain data without pointers: a copy goes on. */
#ifndef RIM_INTERFERENCE_WATCH_H
#define RIM_INTERFERENCE_WATCH_H

#include "interference/detector.h"
#include "monitor/alarm_life.h"
#include "rim/image.h"
#include "rim/monitor.h"

typedef struct interference_watch {
  rim_interference state;
  uint32_t model_id;
  uint16_t command;       /* feature */
  uint16_t speed;         /* outcome */
  uint16_t speed_feature; /* where it is among the features; not with external predictions */
  bool external;
} interference_watch;

_Static_assert(sizeof(interference_watch) <= RIM_MONITOR_INTERFERENCE_BYTES, "outgrown");

/* Checks both sections of an image whose rows have these numbers of features and outcomes.
 * *present: it has them. RIM_E_CONFIG one without the other, or inputs of another size; RIM_E_RANGE
 * a feature or outcome that is not there; errors of rimi_interference_open. */
rim_status rimi_interference_watch_check(const rim_image *image, size_t features, size_t outcomes,
                                         bool *present);

/* Of an image that was checked and has them. */
void rimi_interference_watch_init(interference_watch *watch, const rim_image *image);

/* How its alarm lives beside one of the regions that lives by `regions`. */
rim_alarm_slot_config rimi_interference_watch_life(const rim_alarm_slot_config *regions);

/* Forgets the motion; the model and the counters stay. */
void rimi_interference_watch_reset(interference_watch *watch);

/* One valid row. Returns whether something is found; then *candidate describes it. Where
 * verdict->valid is false the detector had nothing to say, and its alarm is to be left as it is. */
bool rimi_interference_watch_step(interference_watch *watch, const rim_observation *row,
                                  rim_interference_verdict *verdict, rim_alarm *candidate);

#endif
