/* SPDX-License-Identifier: MIT */
/* Section NOISE of a flight image: what healthy residuals do.
 *
 * A channel's residual in block i of a run is r_i = B_i b + sigma(x_i) a_i: the run's own effects b
 * ~ N(0, diag(prior)) along a few fields B (an offset, a gain, a slow wander of the run), and
 * noise a_i that is autocorrelated (AR(1), coefficient rho, innovations of standard deviation s).
 * The fields are combinations of R raw ones: 1, the prediction p, a trend, a decay, and the means
 * of the commands. The trend is the time, bending as the sums of section AGREEMENT do: (1 - exp(-t
 * / trend_s)) trend_s / run_s.
 *
 *   u32 layout (2), channels C, raw R = 4 + M, fields K (largest of any channel)
 *   f32 run_s, decay_s, trend_s > 0; u32 runs that taught the effects' prior, 0: it is known
 *   per channel f32: active (0, 1), fields k <= K, rho in [0, 1), s > 0, p_center, p_scale > 0,
 *     ln sigma per p, per p^2 - 1, per change, per disturbance, inverse prior [K] > 0,
 *     combination [K][R], phi[NOISE_FAMILIES] >= 1 */
#ifndef RIM_SRC_NOISE_H
#define RIM_SRC_NOISE_H

#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#define NOISE_MAX_FIELDS 6u
#define NOISE_RAW_FIRST 4u
#define NOISE_MAX_RAW 12u
#define NOISE_FAMILIES 9u
#define NOISE_HEADER_WORDS 8u
#define NOISE_CHANNEL_WORDS 10u
#define NOISE_SIGMA_TERMS 4u
#define NOISE_LN_SIGMA 1.2 /* ln sigma(x) stays within +- this */
#define NOISE_DISTURBED 4.0
#define NOISE_CALM 0.05 /* added to the mean square before its logarithm */

typedef struct rim_noise {
  uint32_t channels, raw, fields, stride, runs;
  double run_s, decay_s, trend_s;
  const uint8_t *channel;
} rim_noise;

/* RIM_E_VERSION, _RANGE counts or a value out of range; _TRUNCATED bytes; _DATA not finite. */
rim_status rimi_noise_open(rim_noise *view, const uint8_t *section, size_t bytes, uint32_t channels,
                           uint32_t means);

/* One channel's numbers, read from the section. */
typedef struct noise_channel {
  uint32_t fields;
  float active, rho, s, p_center, p_scale, ln_sigma[NOISE_SIGMA_TERMS];
  const uint8_t *inverse_prior, *combination, *phi;
} noise_channel;

noise_channel rimi_noise_channel(const rim_noise *view, uint32_t channel);

/* exp(-ln sigma(x)): the weight of a residual. p: the prediction, standardised. disturbance: by
 * rimi_noise_disturbance(). */
double rimi_noise_weight(const noise_channel *c, double p, double change, double disturbance);

/* How far a block is from what the commands let all outcomes be: ln(NOISE_CALM + mean square of the
 * behaviour residuals in standard deviations, the largest left out), between about -3 and 3. One
 * sensor that is wrong does not disturb; a manoeuvre unlike those of training does, and there the
 * relations between sensors hold less well too. residual[outcomes] in standard deviations; each is
 * limited to NOISE_DISTURBED. 0 where there are fewer than two outcomes. */
double rimi_noise_disturbance(const double *residual, size_t outcomes);

#endif
