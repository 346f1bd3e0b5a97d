/* SPDX-License-Identifier: MIT */
/* rim/monitor.h - the onboard monitor: one call per row, everything else behind it (thesis Alg. 1,
 * p. 26).
 *
 * A flight image (rim/image.h) holds the nominal models, the noise of healthy runs, the thresholds
 * and the configuration; the monitor keeps a view of it and works in memory of the caller. Each
 * step checks the row, gathers rows into blocks, predicts every outcome of a completed block, gives
 * the residuals to the search, does a bounded slice of search, compares the largest score with its
 * threshold and lets the alarm live (rim/alarm.h).
 *
 * An image made by training has the section NOISE: residuals are judged with the run's own effects
 * and their autocorrelation allowed for. Without it, every row is an observation of its own with
 * the caller's prediction, and residuals are independent (rim/select.h).
 *
 * Where the image has the sections for it, every valid row also goes through the detector of motion
 * interference (rim/interference.h), whose alarm lives beside the other one: records of both leave
 * in verdict->alarm, told apart by their detector and counted in one sequence, at most one a row.
 * When both have one in the same row that of the regions goes first, the other with the next row,
 * or at once by rim_monitor_next_record(). */
#ifndef RIM_MONITOR_H
#define RIM_MONITOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/threshold.h"
#include "rim/alarm.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/plan/correct.h"
#include "rim/status.h"
#include "search/select.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_MONITOR_MAX_FEATURES 128
#define RIM_MONITOR_MAX_OUTCOMES 128
#define RIM_MONITOR_KINDS                                                                          \
  4u /* residual channels per outcome of a trained image, see rim_channel  \
                              */

/* Sections of a flight image. All but NAMES are read on board. */
typedef enum rim_section {
  RIM_SECTION_CONFIG = 1,    /* u32[RIM_CONFIG_WORDS], see rim_config_word */
  RIM_SECTION_LEVEL = 3,     /* rim_nominal: a block's outcomes from its other features; optional */
  RIM_SECTION_SCALES = 5,    /* f32[outcomes], > 0: by which the caller's standardised residuals are
                                multiplied; without NOISE only; absent: 1 */
  RIM_SECTION_THRESHOLD = 6, /* rim_threshold */
  RIM_SECTION_FEATURES = 7,  /* f32 low[features], f32 high[features]: trained range, high > low */
  RIM_SECTION_REGION = 8,    /* u16[region features][2]: feature, and 0xffff or the outcome whose
                                prediction stands for it */
  RIM_SECTION_OUTCOMES = 9, /* u16[outcomes]: feature index of each outcome; absent when external */
  RIM_SECTION_COMMANDS =
      10, /* u8[features]: 1 for a command, + 2 an angle in rad, + 4 in degrees */
  RIM_SECTION_CORRECT = RIM_CORRECT_SECTION, /* rim_correct; absent: the models stand as trained */
  /* Both or neither; absent: no detector of motion interference. */
  RIM_SECTION_INTERFERENCE = RIM_INTERFERENCE_SECTION, /* rim_interference_model, packed */
  RIM_SECTION_INTERFERENCE_INPUTS = 16, /* u16 feature: forward velocity commanded, m/s; u16
                                           outcome: the one measured, m/s */
  /* NOISE: all or none of these; BEHAVIOUR not when external. */
  RIM_SECTION_BASIS = 17,     /* inputs of the models: filtered commands */
  RIM_SECTION_BEHAVIOUR = 18, /* outcomes from the commands */
  RIM_SECTION_AGREEMENT = 19, /* what remains of an outcome from what remains of the others */
  RIM_SECTION_NOISE = 20,     /* healthy residuals: run effects, autocorrelation, scale */
  RIM_SECTION_CUTS = 21,      /* u8[region features][23]: where a feature's bytes are cut to bins */
  RIM_SECTION_NAMES = 11 /* text for the ground: features' then outcomes' names, '\n' after each */
} rim_section;

/* What a residual channel looks at; channel kind * outcomes + outcome. */
typedef enum rim_channel {
  RIM_CHANNEL_BEHAVIOUR = 0, /* the outcome less its prediction from the commands */
  RIM_CHANNEL_AGREEMENT = 1, /* that, less what the other outcomes' residuals say of it */
  RIM_CHANNEL_SCATTER = 2,   /* logarithm of the mean square second difference */
  RIM_CHANNEL_REPEAT = 3     /* share of readings equal to the one before */
} rim_channel;

/* Words of RIM_SECTION_CONFIG. Zero of an optional word takes the default named here. */
typedef enum rim_config_word {
  RIM_CONFIG_FEATURES = 0,
  RIM_CONFIG_OUTCOMES = 1,
  RIM_CONFIG_RESERVED = 2, /* 0 */
  RIM_CONFIG_BLOCK_ROWS = 3,
  RIM_CONFIG_EXTERNAL = 4,  /* 1: every row brings its own prediction */
  RIM_CONFIG_PERIOD_US = 5, /* nominal time between rows; 0: rows have no rate */
  RIM_CONFIG_STALE_MS = 6,  /* no valid row for so long: STALE; 0: never */
  RIM_CONFIG_REGION_FEATURES = 7,
  RIM_CONFIG_RING = 8,
  RIM_CONFIG_BINS = 9,
  RIM_CONFIG_GRID = 10,
  RIM_CONFIG_PAIRS = 11,
  RIM_CONFIG_PERSISTENCE = 12, /* blocks above threshold before an alarm; 0: 1 */
  RIM_CONFIG_INHIBIT_MS = 13,  /* least time between records of one alarm; 0: none */
  RIM_CONFIG_SEED = 14,
  RIM_CONFIG_CLEAR = 15, /* blocks below the warning score before it is cleared; 0: never (images
                            of `rim train` say 30) */
  RIM_CONFIG_SCANS = 16, /* rim_select_config.scans, .edges, .moves; 0: its defaults */
  RIM_CONFIG_EDGES = 17,
  RIM_CONFIG_MOVES = 18,
  RIM_CONFIG_BUDGET = 19, /* units of search per row; 0: 1 */
  RIM_CONFIG_WORDS = 20
} rim_config_word;

/* One row. context: `features` doubles in image order. The rest only with external predictions. */
typedef struct rim_observation {
  double t_s;
  const double *context;
  const double *outcome; /* [outcomes] or NULL */
  const double *mean;    /* [outcomes] or NULL */
  const double *sd;      /* [outcomes], > 0, or NULL */
} rim_observation;

/* Why a level says nothing about the vehicle. */
typedef enum rim_reason {
  RIM_REASON_NONE = 0,
  RIM_REASON_SILENT = 1,      /* no usable row for RIM_CONFIG_STALE_MS */
  RIM_REASON_RATE = 2,        /* rows come at another rate than the image's */
  RIM_REASON_TOO_FEW = 3,     /* fewer blocks were examined than a verdict needs */
  RIM_REASON_OUT_OF_RANGE = 4 /* a value beyond what was trained: out_feature, out_value */
} rim_reason;

typedef struct rim_verdict {
  double t_s;
  double score;     /* largest normalised score now; the alarm is at threshold_score */
  double ln_anom;   /* of the channel with the largest score */
  double threshold; /* on ln_anom, for that channel, now */
  double p_value;   /* run-level, conformal */
  double out_value; /* reason OUT_OF_RANGE: in the feature's unit */
  uint32_t step;    /* rows offered so far */
  uint32_t blocks;  /* observations given to the search so far */
  uint16_t channel; /* with the largest score */
  uint16_t out_feature;
  uint8_t level;   /* rim_level of the vehicle: see rim_alarm_status */
  uint8_t reason;  /* rim_reason; NONE: the level is about the vehicle */
  bool valid;      /* this row was used; otherwise it was counted in health */
  rim_alarm alarm; /* seq 0 (and state NONE) when this step has no record to publish */
  rim_interference_verdict interference; /* valid false: no such detector, or row not used */
} rim_verdict;

/* Counted since init or reset, saturating: nothing is silently lost. */
typedef struct rim_row_health {
  uint32_t rows;         /* offered */
  uint32_t rows_used;    /* that entered a block */
  uint32_t not_finite;   /* NaN or infinity: skipped */
  uint32_t time_back;    /* time did not increase: skipped */
  uint32_t gaps;         /* longer than 1.5 periods */
  uint32_t out_of_range; /* with a value beyond what was trained; it was limited */
  uint32_t wrong_rate;   /* while the rate was another than the image's: not examined */
  uint32_t refused;      /* blocks that the search did not take (a number not finite) */
} rim_row_health;

typedef struct rim_monitor_health {
  rim_row_health rows;
  uint32_t blocks;                      /* examined */
  uint32_t alarms;                      /* raised so far, by all detectors */
  uint32_t stale;                       /* times the input went stale */
  double last_valid_s;                  /* time of the last used row */
  double period_s;                      /* recent mean time between rows */
  uint16_t out_feature;                 /* first value out of range: its feature, or 0xffff, */
  double out_value, out_t_s;            /* the value and its time */
  rim_interference_health interference; /* all 0 without that detector */
} rim_monitor_health;

/* Blocks without which nothing is said about the vehicle: RIM_REASON_TOO_FEW. */
#define RIM_MONITOR_LEAST_BLOCKS 8u

typedef struct rim_monitor rim_monitor;

#define RIM_MONITOR_HEADER_BYTES 2048u
#define RIM_MONITOR_ROUND8(n) (((size_t)(n) + 7u) / 8u * 8u)
/* Bytes for rows and blocks. filters: inputs times time constants of section BASIS, 0 without. */
#define RIM_MONITOR_ROWS_SIZE(features, outcomes, filters, terms)                                  \
  (512u + 8u * (4u * (size_t)(features) + 13u * (size_t)(outcomes) + 2u * (size_t)(filters) +      \
                (size_t)(terms) + 64u + 12u * (size_t)(outcomes)))
/* Bytes for a monitor of an image without section NOISE, a constant expression. */
#define RIM_MONITOR_SIZE(features, outcomes, region_features, ring, bins, grid, pairs)             \
  (RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(features, outcomes, 0, 0) +                    \
   8u * (size_t)(outcomes) + 8u * (size_t)(region_features) +                                      \
   RIM_SELECT_SIZE(region_features, outcomes, ring, bins, grid, pairs))
/* Bytes, at most, for a monitor of an image with section NOISE: fields and means as there. */
#define RIM_MONITOR_TRAINED_SIZE(features, outcomes, region_features, ring, filters, terms,        \
                                 fields, means)                                                    \
  (RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(features, outcomes, filters, terms) +          \
   RIM_MONITOR_SEARCH_HEADER +                                                                     \
   RIM_MONITOR_KINDS * (size_t)(outcomes) *                                                        \
       (4u * (size_t)(fields) * ((fields) + 3u) + 80u + (region_features)) +                       \
   (size_t)(ring) * (4u * (5u + (fields)) + RIM_MONITOR_KINDS * 2u * (size_t)(outcomes) +          \
                     (region_features) + (means) + 3u * (size_t)(outcomes)) +                      \
   128u)
#define RIM_MONITOR_SEARCH_HEADER 4096u

/* To be added for an image that watches motion interference. */
#define RIM_MONITOR_INTERFERENCE_BYTES 4096u

/* Bytes this image needs. Errors as rim_monitor_init; *bytes unchanged on error. */
rim_status rim_monitor_size(const void *image, size_t image_bytes, size_t *bytes);

/* Validate the whole image and prepare a monitor in the caller's memory (aligned to 8). The image
 * must outlive the monitor and stay unchanged. RIM_E_ARGUMENT NULL; RIM_E_ALIGN, RIM_E_SIZE memory;
 * RIM_E_MAGIC, _VERSION, _ENDIAN, _CRC, _TRUNCATED, _RANGE the image is not whole or not of this
 * version; RIM_E_CONFIG it is whole but its sections do not fit together. */
rim_status rim_monitor_init(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                            size_t image_bytes);

/* Offer one row; never blocks, bounded work (see lib/README.md). A row with NaN or infinity, or
 * whose time does not increase, is counted in health and otherwise has no effect: RIM_OK,
 * verdict->valid false. RIM_E_ARGUMENT: NULL. */
rim_status rim_monitor_step(rim_monitor *monitor, const rim_observation *row, rim_verdict *verdict);

/* What else the application asks of the alarms: latching, the replay flag, another limit for STALE
 * than the image's (which holds until this is called). To be called again after rim_monitor_init;
 * rim_monitor_attach and the resets keep it. RIM_E_ARGUMENT NULL; RIM_E_CONFIG stale_s negative or
 * not finite: the policy before stays. Where latching ends, an alarm that was held by it is
 * cleared. O(1). */
rim_status rim_monitor_set_policy(rim_monitor *monitor, const rim_alarm_policy *policy);

/* Says that it is now_s, on the clock of the rows, and that no row has come since the newest one:
 * the monitor itself sees only rows that come. To be called now and then while none comes, and on
 * the ground with the time of the next row before it is offered. Returns true once, when no valid
 * row has come for longer than stale_s (before the first row: since the first call): records with
 * level STALE then wait, with the time at which the input became stale, however late it was
 * noticed. The next valid row ends it. NULL, a time that is not finite or is not later: false, no
 * effect. O(1). */
bool rim_monitor_idle(rim_monitor *monitor, double now_s);

/* Obeys a command that came by a bus which carries `bits` low bits of sequence and model_id (8 on
 * CAN, 32 on LCM). ACKNOWLEDGE: the alarm that is meant carries RIM_ALARM_FLAG_ACKNOWLEDGED from
 * now on and will not be latched; a latched one is cleared. Twice is once. CLEAR: it is cleared,
 * and its detector forgets all observations; the other detector's alarm goes on. Records then wait.
 * RIM_E_ARGUMENT NULL; RIM_E_RANGE an unknown command; RIM_E_DATA no alarm stands that the command
 * could mean: another record or model, or low bits that fit the records of both alarms. Nothing
 * changes then. O(1) for ACKNOWLEDGE, O(memory) for CLEAR. */
rim_status rim_monitor_command(rim_monitor *monitor, const rim_command *command, unsigned bits);

/* Takes a record that waits: the second one of a row, and those of idle, command, restart and
 * repeat. Returns false, *record unchanged, when none waits. Whoever does not call it gets one with
 * each row. NULL: false. O(1). */
bool rim_monitor_next_record(rim_monitor *monitor, rim_alarm *record);

/* The rows' clock went to now_s and will stay there (rim/clock_guard.h): forgets all observations;
 * what stands is over, and CLEARED or latched by records that wait. NULL or a time that is not
 * finite: no effect. O(memory). */
void rim_monitor_restart(rim_monitor *monitor, double now_s);

/* Every alarm that stands is told once more, as UPDATED: after rim_monitor_attach, for listeners
 * that were told nothing meanwhile. O(1). */
void rim_monitor_repeat(rim_monitor *monitor);

/* How the alarms stand. NULL: level STALE, everything else 0. O(1). */
rim_alarm_status rim_monitor_alarms(const rim_monitor *monitor);

/* The alarm of this detector while it stands, as it was described last; NULL: none stands. It stays
 * where it is, and changes with the next call. */
const rim_alarm *rim_monitor_standing(const rim_monitor *monitor, rim_detector detector);

/* Chance, 0..1, that a context lies in the region of the alarm that stands; 0 when none stands, and
 * for NULL. */
double rim_monitor_membership(const rim_monitor *monitor, const double *context);

/* All 0 for NULL. */
rim_monitor_health rim_monitor_get_health(const rim_monitor *monitor);

/* Forget all observations, and the alarms without a record; the image, the policy, the counts and
 * the sequence of records stay. */
void rim_monitor_reset(rim_monitor *monitor);

/* Go on from a copy of a monitor's bytes (another process, a restart): memory holds `bytes` bytes
 * copied from a monitor of this library version, image is the image it was made with. Errors as
 * rim_monitor_init, and RIM_E_DATA when memory holds no monitor of this image. The monitor then
 * goes on as the original would have, bit for bit. */
rim_status rim_monitor_attach(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes);

/* Bytes per region feature: where the newest block lies, for rimi_monitor_inside(). NULL: no block
 * yet, or an image without section NOISE. Valid until the next step. */
const uint8_t *rimi_monitor_place(const rim_monitor *monitor);

/* Whether block `block` of the run (counted from 0; verdict->blocks - 1 is the newest) at this
 * place is among those in which the alarm that stands, or stood last, says the deviation was. */
bool rimi_monitor_inside(const rim_monitor *monitor, const uint8_t *place, uint32_t block);

/* Deviations that an alarm told and that ended since the start or the last reset. Where there is
 * one, *first is the first block of the newest and *end the block after its last, counted as by
 * rimi_monitor_inside(); either may be NULL. Its alarm is cleared, and its blocks are no evidence
 * any more. Trained images alone. */
uint32_t rim_monitor_ended(const rim_monitor *monitor, uint32_t *first, uint32_t *end);

/* For tools on the ground. The search is NULL where the image has section NOISE. */
const rim_select *rimi_monitor_search(const rim_monitor *monitor);
const rim_threshold *rimi_monitor_threshold(const rim_monitor *monitor);
/* A word of the image's configuration; 0 for NULL and for a word that there is not. */
uint32_t rim_monitor_config(const rim_monitor *monitor, rim_config_word word);

/* Fold every bit that decides anything into a digest (rim/crc.h). NULL: the digest as it was. */
uint64_t rim_verdict_digest(uint64_t digest, const rim_verdict *verdict);

#ifdef __cplusplus
}
#endif
#endif
