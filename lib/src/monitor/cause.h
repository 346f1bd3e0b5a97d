/* SPDX-License-Identifier: MIT */
/* Whose fault it is: several channels deviate, of which one leads; which outcome is named, and
 * which channel shows its deviation best. Of trained images only. */
#ifndef RIM_SRC_CAUSE_H
#define RIM_SRC_CAUSE_H

#include "monitor/monitor_private.h"

#define CAUSE_TOGETHER 3u /* behaviour channels asked whether they deviate with an agreement */
#define CAUSE_READINGS 6u /* passes over the ring to tell which of two readings is off */
#define CAUSE_COMPARED 4u /* agreements of which the one that is farthest off is named, at most */
#define CAUSE_SUMS 4u     /* that are asked about the bias of one of two sensors, at most */

double rimi_cause_score(const rim_monitor *m, uint16_t channel); /* the best that it has found */

/* Whether a hypothesis is of a gain: its shift is a share of what is expected. */
bool rimi_cause_is_gain(const search_hypothesis *h);

/* Whether the outcome of a channel is watched as an integral of outcome j. */
bool rimi_cause_integrates(const rim_monitor *m, uint16_t channel, uint16_t j);

/* Whether a channel holds a sum of its outcome against the one that integrates it (AGREEMENT_INTO):
 * its residuals are in that one's unit. */
bool rimi_cause_is_into(const rim_monitor *m, uint32_t channel);

/* Whether the outcome is the first that left the trained range, in a run most of whose rows lie
 * outside of it: a wrong unit, or a broken sensor. Such a reading is not blamed on what the outcome
 * integrates. */
bool rimi_cause_is_out_of_range(const rim_monitor *m, uint32_t outcome);

/* The channel of the outcome to be named, where this one leads. A few passes over the ring. */
uint16_t rimi_cause(const rim_monitor *m, uint16_t leading);

/* The channel that shows best what is said of a channel's outcome: that of its difference from its
 * twin, where that deviates more clearly or the channel is a sum; else the channel itself. */
uint16_t rimi_cause_shown_by(const rim_monitor *m, uint16_t channel);

/* ln likelihood ratio, as healthy runs inflate it, of a bias of outcome j, in its unit, since this
 * block: by its behaviour and by its agreement, or its difference from its twin. Two passes over
 * the ring. */
double rimi_cause_support(const rim_monitor *m, uint32_t j, double bias, uint32_t onset);

#endif
