/* rim/channels.h - from rows of telemetry to residual channels: what the search looks at.
 *
 * A channel is one outcome seen one way. Rows (say 20 Hz) are predicted one by one; residuals are
 * gathered in blocks of `block_rows` (say 1 s), and each block yields one value per channel:
 *
 *   SHIFT      block mean of the outcome minus its prediction from all other features of the block
 *              (without its own past: sees a constant bias)
 *   INCREMENT  change of the block mean since the last block minus its prediction (drift, forces)
 *   VARIANCE   logarithm of the variance, about the block's mean, of the one-step residuals, each
 *              clipped at RIM_CHANNELS_CLIP standard deviations (noise, stuck, dropout)
 *   STEP       mean of the one-step residuals
 *   REPEAT     share of readings that equal the one before bit for bit, or are exactly 0 (stuck,
 *              dropout): quantised readings do so by nature, at a rate that training learns
 *
 * Values are standardised by the mean and standard deviation that training found for the channel,
 * so that in nominal running each is near N(0, 1) within a run; the run's own offset is the
 * business of `threshold`. The outcome may instead come with the caller's own prediction (z, m, sd
 * columns): then a block is one row and SHIFT is (z - m) / sd.
 *
 * A corrected model (rim/correct.h) takes the place of the prediction of the kinds that it names.
 * Its context is the one that the model predicts from: of SHIFT the block's mean, of INCREMENT the
 * block's before, of STEP the row's before.
 *
 * Which kinds of channel exist is a mask; channel c of kind k (counted among those present) and
 * outcome o has index k * outcomes + o. */
#ifndef RIM_CHANNELS_H
#define RIM_CHANNELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/alarm.h"
#include "rim/correct.h"
#include "rim/nominal.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_CHANNELS_MAX_FEATURES 128
#define RIM_CHANNELS_MAX_OUTCOMES 128
#define RIM_CHANNELS_KINDS 5
#define RIM_CHANNELS_CLIP 6.0
#define RIM_CHANNELS_VALUE_CLIP 8.0      /* standard deviations that a block's value may be off */
#define RIM_CHANNELS_LEAST_VARIANCE 1e-4 /* of standardised residuals: a frozen reading */
#define RIM_CHANNELS_FAR                                                                           \
  3.0 /* reaches of the nearest prototype beyond which a block counts as far */

/* What a trained image says of the channels; zero-initialise, then fill. */
typedef struct rim_channels_config {
  uint16_t features;
  uint16_t outcomes;
  uint16_t block_rows;          /* rows in a block; 1 with the caller's own predictions */
  uint8_t kinds;                /* bit k set: channels of rim_kind k exist; 0 is an error */
  bool external;                /* predictions come with every row */
  double period_s;              /* nominal time between rows; 0: never a gap */
  const rim_nominal *step;      /* one row ahead; needed by VARIANCE and STEP */
  const rim_nominal *level;     /* same block, own column unused; needed by SHIFT unless external */
  const rim_nominal *increment; /* next block minus this one; needed by INCREMENT */
  const uint8_t *outcome_feature; /* u16[outcomes] in image order: feature index of each outcome */
  const uint8_t *command;         /* u8[features]: 1 where the feature is a command; may be NULL */
  const uint8_t *center;          /* f32[channels] subtracted; NULL: 0 */
  const uint8_t *inverse_sd;      /* f32[channels] multiplied; NULL: 1 */
  const rim_correct *correct;     /* added to the predictions of its kinds; NULL: nothing */
} rim_channels_config;

/* Counted since init, saturating: nothing is silently lost. */
typedef struct rim_channels_health {
  uint32_t rows;       /* rows offered */
  uint32_t rows_used;  /* rows that entered a block */
  uint32_t not_finite; /* rows with NaN or infinity: skipped */
  uint32_t time_back;  /* rows whose time did not increase: skipped */
  uint32_t gaps;       /* longer than 1.5 periods; from a quarter of a block on it is begun anew */
  uint32_t far;        /* blocks far from all that was trained (RIM_CHANNELS_FAR) */
} rim_channels_health;

typedef struct rim_channels rim_channels;

#define RIM_CHANNELS_HEADER_BYTES 192u
#define RIM_CHANNELS_COUNT(outcomes, kinds_present) ((size_t)(outcomes) * (size_t)(kinds_present))
/* Bytes of one instance: rows, block sums and predictions of `features` and `outcomes` doubles. */
#define RIM_CHANNELS_SIZE(features, outcomes, kinds_present)                                       \
  (RIM_CHANNELS_HEADER_BYTES + 8u * (3u * (size_t)(features) + 9u * (size_t)(outcomes) +           \
                                     RIM_CHANNELS_COUNT(outcomes, kinds_present)))

/* Prepare an instance in the caller's memory.
 * RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: memory not aligned to 8; RIM_E_SIZE: fewer bytes than
 * RIM_CHANNELS_SIZE; RIM_E_CONFIG: counts out of range, a model missing or of another shape. */
rim_status rim_channels_init(rim_channels **instance, void *memory, size_t bytes,
                             const rim_channels_config *config);

/* Forget all rows and counts; the configuration stays. */
void rim_channels_reset(rim_channels *instance);

/* After the instance's bytes were copied: where the models and tables of the same content are now.
 */
void rim_channels_attach(rim_channels *instance, const rim_channels_config *config);

/* Offer one row. context: `features` finite doubles, in image order and units. With an external
 * model outcome, mean, sd hold `outcomes` doubles each (sd > 0), otherwise they are ignored.
 * Returns 1 when a block was completed: values and block context can then be read until the next
 * call; 0 when not; a bad row (RIM_E_DATA) is counted in health, and the block begun is kept.
 * Cost: one prediction a row, two more a block: O(K * outcomes * features). Stack < 64 bytes. */
int rim_channels_row(rim_channels *instance, double t_s, const double *context,
                     const double *outcome, const double *mean, const double *sd);

const double *rim_channels_values(const rim_channels *instance);  /* [channels], standardised */
const double *rim_channels_context(const rim_channels *instance); /* [features], block mean */
double rim_channels_block_start_s(const rim_channels *instance);
const rim_channels_health *rim_channels_get_health(const rim_channels *instance);
uint16_t rim_channels_count(const rim_channels *instance);
/* SHIFT for a channel that there is not. */
rim_kind rim_channels_kind(const rim_channels *instance, uint16_t channel);
uint16_t rim_channels_outcome(const rim_channels *instance, uint16_t channel);
/* Multiply a mean of standardised values of the channel by this for the outcome's own unit, as
 * predicted at the last block (SHIFT, INCREMENT: sd of the prediction; STEP, VARIANCE likewise). */
double rim_channels_unit(const rim_channels *instance, uint16_t channel);

#ifdef __cplusplus
}
#endif
#endif
