/* SPDX-License-Identifier: MIT */
/* monitor/inspect.h - private: what tools on the ground look at inside a monitor. */
#ifndef RIM_MONITOR_INSPECT_H
#define RIM_MONITOR_INSPECT_H

#include "image/threshold.h"
#include "rim/monitor.h"
#include "search/select.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Bytes per region feature: where the newest block lies, for rimi_monitor_inside(). NULL: no block
 * yet, or an image without section NOISE. Valid until the next step. */
const uint8_t *rimi_monitor_place(const rim_monitor *monitor);

/* Whether block `block` of the run (counted from 0; verdict->blocks - 1 is the newest) at this
 * place is among those in which the alarm that stands, or stood last, says the deviation was. */
bool rimi_monitor_inside(const rim_monitor *monitor, const uint8_t *place, uint32_t block);

/* What the newest block left unexplained, in every channel (verdict->channel counts them), in the
 * outcome's unit: rimi_monitor_channels() values; of a channel that the block could not tell it
 * says nothing. NULL: no block yet, or an image without section NOISE. Valid until the next
 * step. */
const double *rimi_monitor_residuals(const rim_monitor *monitor);
uint32_t rimi_monitor_channels(const rim_monitor *monitor);

/* NULL for NULL. The search is also NULL where the image has section NOISE. */
const rim_select *rimi_monitor_search(const rim_monitor *monitor);
const rim_threshold *rimi_monitor_threshold(const rim_monitor *monitor);

#ifdef __cplusplus
}
#endif
#endif
