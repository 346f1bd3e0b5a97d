/* SPDX-License-Identifier: MIT */
/* image/threshold.h - from ln anom to a promise: scores, the alarm threshold, the confidence
 * P(anom).
 *
 * Nominal runs do not only scatter, each has an offset of its own, so ln anom of eq. 3.7 (p. 28)
 * grows without bound in a perfectly healthy run. A trained image's statistic allows for that
 * (section NOISE) and scores by itself; beside it, learnt from nominal runs that the models had not
 * seen:
 *   - each channel's ln anom is put on one scale with the others', by the level o_c that its
 * largest value in a nominal run exceeds half the time and the size s_c of the excess, and by a
 * factor e(n) over the number of observations n: score = (ln_anom / e(n) - o_c) / s_c;
 *   - the alarm threshold is an order statistic of the largest score of whole nominal runs. With n
 *     exchangeable runs the k-th smallest bounds the chance of *any* false alarm in a new run by
 *     (n + 1 - k) / (n + 1): a finite-sample (conformal) promise. No rate below 1 / (n + 1) can be
 *     promised. (The thesis's eq. 3.9, p. 30, bounds the rate at one instant.)
 *
 * P(anom), eq. 3.25-3.26 (p. 35), is 1 - p with p the conformal p-value of the score.
 *
 * Section bytes, little-endian (all f32 finite):
 *   u32 channels, u32 runs, u32 knots, u32 rank
 *   f32 alarm_score, f32 warn_score, f32 promised_rate, f32 reserved
 *   f32 maxima[runs]            ascending largest score of each calibration run (any sign)
 *   f32 growth[knots]           e(n) >= FLT_MIN at n = 2^k; linear in n between; constant outside
 *   f32 offset[channels] >= 0, f32 scale[channels] > 0 */
#ifndef RIM_THRESHOLD_H
#define RIM_THRESHOLD_H

#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_THRESHOLD_HEADER_BYTES 32u
#define RIM_THRESHOLD_MAX_RUNS 4096u
#define RIM_THRESHOLD_MAX_KNOTS 32u

/* A view into the section: valid as long as the image is. */
typedef struct rim_threshold {
  uint32_t channels;
  uint32_t runs;
  uint32_t knots;
  uint32_t rank; /* of the alarm threshold among the maxima, 1-based */
  double alarm_score;
  double warn_score;
  double promised_rate; /* run-level false-alarm rate that the rank can promise */
  const uint8_t *maxima;
  const uint8_t *growth;
  const uint8_t *offset;
  const uint8_t *scale;
} rim_threshold;

/* Validate the whole section and fill the view. RIM_E_ARGUMENT: NULL; RIM_E_TRUNCATED: bytes do not
 * match the counts; RIM_E_RANGE: a count, rank or value out of range, maxima not ascending. The
 * view is unchanged on error. O(bytes). */
rim_status rimi_threshold_open(rim_threshold *view, const uint8_t *section, size_t bytes);

/* e(n), at least FLT_MIN. n: observations in the run so far (0 counts as 1). O(log n). */
double rimi_threshold_growth(const rim_threshold *view, uint32_t observations);

/* (ln_anom / e(n) - offset_c) / scale_c. channel < channels. */
double rimi_threshold_score(const rim_threshold *view, uint16_t channel, double ln_anom,
                            uint32_t observations);

/* The ln anom at which the alarm is raised in this channel now: a_thresh(t) of eq. 3.9. */
double rimi_threshold_ln_anom(const rim_threshold *view, uint16_t channel, uint32_t observations);

/* Chance that a whole nominal run reaches this score: (1 + maxima >= score) / (runs + 1),
 * conformal; never below 1 / (runs + 1). O(log runs). */
double rimi_threshold_p_value(const rim_threshold *view, double score);

#ifdef __cplusplus
}
#endif
#endif
