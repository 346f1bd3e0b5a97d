/* rim/envelope.h - how far the mean of a channel strays in nominal runs, interval by interval.
 *
 * Eq. 3.7 (p. 28) takes observations as independent. Residuals of a real vehicle are not: every run
 * has offsets of its own that change with the context, so the mean over any stretch of context
 * scatters from run to run far more than eq. 3.7 allows. The envelope holds that scatter as
 * training found it, for every channel and every interval of bins of every region feature:
 *
 *   level     m = mean of the channel inside the interval
 *   contrast  d = mean inside minus mean over the rest of the run: a run's common offset cancels,
 *             and what depends on context stands out
 *
 * each with its variance over nominal runs, v, at the number of observations n_t that such an
 * interval usually holds. With fewer observations so far the variance is v + a (1/n - 1/n_t), a the
 * channel's variance of one observation within a run; for the contrast 1/n is 1/n + 1/(N - n). Then
 * ln anom = m^2 / 2 var, as the Gaussian likelihood ratio of a shift against its nominal spread.
 *
 * Section, little-endian, 4-byte aligned:
 *   u32 layout (RIM_ENVELOPE_LAYOUT), channels C, features F, bins B, least n inside and outside, 0
 *   u16 usual[F][I][2]   n_t of level, n_t (N_t - n_t) / N_t of contrast; 0: not judged
 *                        I = B (B + 1) / 2 intervals, by first bin, then last
 *   f32 a[C]             > 0
 *   u8  code[C][F][I][2] variance = 2^((code - 128) / 8)
 */
#ifndef RIM_ENVELOPE_H
#define RIM_ENVELOPE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_ENVELOPE_LAYOUT 1u
#define RIM_ENVELOPE_HEADER_WORDS 6u
#define RIM_ENVELOPE_MAX_BINS 32u
#define RIM_ENVELOPE_INTERVALS(bins) ((size_t)(bins) * ((size_t)(bins) + 1u) / 2u)
#define RIM_ENVELOPE_BYTES(channels, features, bins)                                               \
  (4u * RIM_ENVELOPE_HEADER_WORDS + 4u * (size_t)(features)*RIM_ENVELOPE_INTERVALS(bins) +         \
   4u * (size_t)(channels) +                                                                       \
   2u * (size_t)(channels) * (size_t)(features)*RIM_ENVELOPE_INTERVALS(bins))

/* A view; a zeroed one is not open. */
typedef struct rim_envelope {
  const uint8_t *usual;
  const uint8_t *a;
  const uint8_t *code;
  uint32_t channels;
  uint32_t features;
  uint32_t bins;
  double least_n;
} rim_envelope;

typedef struct rim_envelope_found {
  double ln_anom; /* 0: no interval holds enough observations */
  uint32_t first; /* bins first..last */
  uint32_t last;
  bool contrast; /* against the rest of the run; otherwise against the prediction */
} rim_envelope_found;

/* RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: not 4-aligned; RIM_E_TRUNCATED or RIM_E_SIZE: bytes do not
 * match the counts; RIM_E_VERSION: another layout; RIM_E_RANGE: a count out of range or the last
 * word not 0; RIM_E_DATA: a value of a not positive and finite. The view is unchanged on error.
 * O(channels). */
rim_status rim_envelope_open(rim_envelope *view, const uint8_t *section, size_t bytes);

/* The most anomalous interval of one feature and channel. n[k], s[k]: observations and sum of
 * residuals in bins 0..k-1, k = 0..bins. channel, feature in range. Ties: the first in order, level
 * before contrast. O(bins^2); one division for each hypothesis that holds less than usual, and one
 * more. */
rim_envelope_found rim_envelope_best(const rim_envelope *view, uint32_t channel, uint32_t feature,
                                     const double *n, const double *s);

/* The variance that a code stands for: 2^((code - 128) / 8), 2^-16 to 2^15.9. */
double rim_envelope_variance(uint8_t code);

#ifdef __cplusplus
}
#endif
#endif
