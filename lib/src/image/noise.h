/* SPDX-License-Identifier: MIT */
/* Section NOISE of a flight image: what healthy residuals do.
 *
 * A channel's residual in block i of a run is r_i = mean + B_i b + n_i: what healthy runs have in
 * common (of repeats; 0 of the others), the run's own effects b ~ N(0, diag(prior)) along a few
 * fields B (an offset, a gain, a slow wander of the run), and autocorrelated noise
 * n_i = rho(x_i) n_(i-1) + sigma(x_i) a_i, with a_i of standard deviation s. The
 * scale is that of what is new in a block: an error that arose in a manoeuvre stays, where the
 * outcome keeps it, as it was after the manoeuvre. rho has two values: where predictions move more
 * than is usual, a model errs for as long as a manoeuvre lasts; elsewhere there is little beside
 * the sensors' noise, which is new in every block.
 * The fields are combinations of R raw ones: 1, the prediction p, a trend, a decay, and the means
 * of the commands. The trend is the time, bending as the sums of section AGREEMENT do: (1 - exp(-t
 * / trend_s)) trend_s / run_s.
 *
 *   u32 layout (9; 10: half of the runs that taught it or more had gaps, and what follows from
 *     gaps is in the noise), channels C, raw R = 4 + M, fields K (largest of any channel)
 *   f32 run_s, decay_s, trend_s > 0; u32 runs that taught the effects' prior, 0: it is known
 *   f32 the healthy blocks' mean activity before it is taken off, see rimi_noise_activity()
 *   per channel f32: active (0; 1; NOISE_LEAST_LIMIT or more: 1, and it is the limit of
 *     rimi_noise_counted()), fields k <= K, rho in [0, 1), s > 0, p_center, p_scale > 0,
 *     ln sigma per p, per p^2 - 1, per activity a, per a^2 - 1,
 *     per disturbance, mean in the unit of the residual, what is added to rho, 0 or
 *     more, in a block whose activity is above 0 (their sum < 1), inverse prior [K] > 0,
 *     combination [K][R], phi[NOISE_FAMILIES] >= 1 */
#ifndef RIM_SRC_NOISE_H
#define RIM_SRC_NOISE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#define NOISE_LAYOUT 9u
#define NOISE_LAYOUT_GAPS 10u
#define NOISE_MAX_FIELDS 6u
#define NOISE_RAW_FIRST 4u
#define NOISE_MAX_RAW 12u
#define NOISE_FAMILIES 9u
#define NOISE_HEADER_WORDS 9u
#define NOISE_CHANNEL_WORDS 13u
#define NOISE_SIGMA_TERMS 5u
/* ln sigma(x) stays within +- this. A controller's errors are far larger where a lander brakes than
 * where it coasts; how far that may go is limited, for a scale is extrapolated as well. */
#define NOISE_LN_SIGMA 2.0
#define NOISE_DISTURBED 4.0
#define NOISE_MOVED 4.0  /* a prediction's movement per block counts up to this, in its sd */
#define NOISE_STILL 0.02 /* added to the movement before its logarithm */
/* Activity of a block whose predecessor is not known: as in a manoeuvre. What is wrong at the start
 * of a run or after a gap is no news. */
#define NOISE_APART 2.0
#define NOISE_LEAST_LIMIT 2.0f /* of what is new in a block, standard deviations */
#define NOISE_LEVEL_STEP (1.0 / 64.0)
#define NOISE_LEVEL_GAIN 0.25 /* a new block's part in the level */
#define NOISE_PATIENCE 3      /* blocks */
#define NOISE_CALM 0.05       /* added to the mean square before its logarithm */

typedef struct rim_noise {
  uint32_t channels, raw, fields, stride, runs;
  bool with_gaps; /* NOISE_LAYOUT_GAPS */
  double run_s, decay_s, trend_s, activity;
  const uint8_t *channel;
} rim_noise;

/* RIM_E_VERSION, _RANGE counts or a value out of range; _TRUNCATED bytes; _DATA not finite. */
rim_status rimi_noise_open(rim_noise *view, const uint8_t *section, size_t bytes, uint32_t channels,
                           uint32_t means);

/* Kinds of channels per outcome that a section is for: RIM_MONITOR_KINDS, or one more with those of
 * RIM_CHANNEL_STEP. */
uint32_t rimi_noise_kinds(const uint8_t *section, size_t bytes, uint32_t outcomes);

/* One channel's numbers, read from the section. */
typedef struct noise_channel {
  uint32_t fields;
  float active, limit, rho, s, p_center, p_scale, ln_sigma[NOISE_SIGMA_TERMS], mean, rho_rise;
  const uint8_t *inverse_prior, *combination, *phi;
} noise_channel;

/* limit: 0 where there is none. */
noise_channel rimi_noise_channel(const rim_noise *view, uint32_t channel);

/* rho(x) in [0, 1). moving: in a block whose activity is above 0. */
double rimi_noise_rho(const noise_channel *c, bool moving);

/* exp(-ln sigma(x)): the weight of what is new in a block. p: the prediction, standardised.
 * disturbance: by rimi_noise_disturbance(). */
double rimi_noise_weight(const noise_channel *c, double p, double activity, double disturbance);

/* What is new in the first block after a gap, r_i - rho r_(i-1), counts by this much less: what the
 * noise did in the gap is in it, however long that was. What was before still is, as noise that
 * lasts (of a position, a level) has no level of its own to return to. */
double rimi_noise_gap_weight(double rho);

/* What is new in a channel's blocks of late. level: in NOISE_LEVEL_STEP; beyond: how many blocks in
 * a row were beyond what counts, above (> 0) or below. Both are 0 at the start of a run. */
typedef struct noise_level {
  int16_t level, beyond;
} noise_level;

/* How much of what is new in a block counts, fresh, in standard deviations: at most the channel's
 * limit beyond twice the level that it has had of late; all of it once more than NOISE_PATIENCE
 * blocks in a row were beyond that on the same side. An actuator that saturates, in a healthy run
 * too, is a dozen standard deviations wrong for a block or two; were all of it to count, the alarm
 * would have to lie above it, and hide what is weaker and lasts. */
double rimi_noise_counted(double fresh, double limit, noise_level *of_late);

/* How quickly the nominal predictions move, beside the mean of healthy runs: ln(NOISE_STILL + root
 * mean square over the outcomes of their movement since the block before, in standard deviations
 * of the predictions). A model errs in proportion to how quickly what it models changes: by its
 * timing, and by what it smooths. predicted[outcomes] and before[outcomes]: in the outcomes' units,
 * of channels 0 .. outcomes - 1. */
double rimi_noise_activity(const rim_noise *view, const double *predicted, const float *before,
                           size_t outcomes);
/* Of which it is made: one outcome's square, and the logarithm of their sum. */
double rimi_noise_moved(double predicted, double before, double sd);
double rimi_noise_ln_moved(double squares, size_t outcomes);

/* How far a block is from what the commands let all outcomes be: ln(NOISE_CALM + mean square of the
 * behaviour residuals in standard deviations, the largest left out), between about -3 and 3. One
 * sensor that is wrong does not disturb; a manoeuvre unlike those of training does, and there the
 * relations between sensors hold less well too. residual[outcomes] in standard deviations; each is
 * limited to NOISE_DISTURBED. 0 where there are fewer than two outcomes. */
double rimi_noise_disturbance(const double *residual, size_t outcomes);

#endif
