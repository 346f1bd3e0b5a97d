/* SPDX-License-Identifier: MIT */
/* rim/monitor.h - the onboard monitor (thesis Alg. 1, p. 26).
 *
 * Give it a flight image (rim/image.h) and memory, then one row of telemetry at a time. Each step
 * checks the row, gathers rows into blocks, predicts the outcomes of a complete block, gives the
 * residuals to the search, does a bounded slice of search, compares the largest score with its
 * threshold and updates the alarms. lib/README.md describes the method.
 * One alarm record leaves with each row, in verdict.alarm; rim_monitor_next_record takes more.
 * Threads: no function blocks, allocates, uses a global variable or calls back. Calls on the same
 * monitor must not overlap: use one thread, or a lock of your own; do not call from an interrupt
 * that may interrupt another call. Different monitors are independent, also with one image. */
#ifndef RIM_MONITOR_H
#define RIM_MONITOR_H

#include "rim/alarm.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_MONITOR_MAX_FEATURES 128
#define RIM_MONITOR_MAX_OUTCOMES 128
#define RIM_MONITOR_KINDS 4u        /* channels per outcome of a trained image, without steps */
#define RIM_MONITOR_LEAST_BLOCKS 8u /* with fewer examined blocks: RIM_REASON_TOO_FEW */

typedef struct rim_monitor rim_monitor;
/* One row. Only images for rows that bring their own predictions read the last three. */
typedef struct rim_observation {
  double t_s;            /* must increase from row to row */
  const double *context; /* [features], in the image's order and units */
  const double *outcome; /* [outcomes] measured, or NULL */
  const double *mean;    /* [outcomes] predicted, or NULL */
  const double *sd;      /* [outcomes] standard deviation of the prediction, > 0, at most 1e150 */
} rim_observation;

/* Why a level says nothing about the vehicle. */
typedef enum rim_reason {
  RIM_REASON_NONE = 0,         /* the level is about the vehicle */
  RIM_REASON_SILENT = 1,       /* no usable row for longer than the limit for STALE */
  RIM_REASON_RATE = 2,         /* rows come at another rate than the image was trained for */
  RIM_REASON_TOO_FEW = 3,      /* too few blocks, or the newest ones, said anything of an outcome */
  RIM_REASON_OUT_OF_RANGE = 4, /* a value beyond what was trained: out_feature, out_value */
  RIM_REASON_INTEGRITY = 5     /* the monitor's memory is damaged, see rim_monitor_repair */
} rim_reason;

typedef struct rim_verdict {
  double t_s;
  double score;     /* the largest normalised score now; an alarm is raised at the image's limit */
  double ln_anom;   /* evidence in the channel with that score, nats */
  double threshold; /* on ln_anom, in that channel, now */
  double p_value;   /* of the whole run, conformal */
  double out_value; /* with RIM_REASON_OUT_OF_RANGE: in the feature's unit */
  uint32_t step, blocks; /* rows offered, observations given to the search, so far */
  uint16_t channel;      /* residual channel with the largest score: kind * outcomes + outcome */
  uint16_t out_feature;
  uint8_t level, reason; /* rim_level of the vehicle; rim_reason */
  bool valid;            /* this row was used; otherwise it was counted in health */
  rim_alarm alarm;       /* the record to send with this row; seq 0: none */
  const struct rim_interference_verdict *interference; /* of this row; NULL: not watched or used */
} rim_verdict;

/* Counted since init, reset or restart, saturating: no row or block is lost without a count. */
typedef struct rim_row_health {
  uint32_t rows, rows_used; /* offered; that entered a block */
  uint32_t not_finite;      /* skipped: NaN, infinity, or an sd that is not within 0 to 1e150 */
  uint32_t time_back;       /* skipped: time did not increase */
  uint32_t gaps;            /* times between rows longer than 1.5 periods */
  uint32_t out_of_range;    /* rows with a value beyond the trained range, which was limited */
  uint32_t wrong_rate;      /* not examined: the rate was not the image's */
  uint32_t refused;         /* blocks that the search refused: a number was not finite */
} rim_row_health;

/* Constants, indices and the state of alarms; the flight image; what was gathered of the run. */
enum { RIM_DAMAGE_CONTROL = 1, RIM_DAMAGE_IMAGE = 2, RIM_DAMAGE_RUN = 4 };
typedef struct rim_monitor_health {
  rim_row_health rows;
  uint32_t blocks, alarms, stale; /* examined; raised by all detectors; times input became stale */
  double last_valid_s, period_s;  /* time of the last used row; recent mean time between rows */
  uint16_t out_feature;           /* of the first value out of range; 0xffff: there was none */
  double out_value, out_t_s;      /* that value and its time */
  uint8_t damage;                 /* RIM_DAMAGE_...: what was found damaged; 0: nothing */
  uint32_t partly; /* blocks examined in part: commands not seen act in them, or a long run is on */
} rim_monitor_health;

#define RIM_MONITOR_HEADER_BYTES 2248u
#define RIM_MONITOR_ROUND8(n) (((size_t)(n) + 7u) / 8u * 8u)
/* Bytes for rows and blocks. filters: inputs times time constants of section BASIS, 0 without. */
#define RIM_MONITOR_ROWS_SIZE(features, outcomes, filters, terms)                                  \
  (512u + 8u * (4u * (size_t)(features) + 13u * (size_t)(outcomes) + 2u * (size_t)(filters) +      \
                (size_t)(terms) + ((size_t)(terms) + 3u) / 4u + 112u + 20u * (size_t)(outcomes)))
/* Bytes, at most, for a monitor of an image whose rows bring predictions; a constant expression. */
#define RIM_MONITOR_SIZE(features, outcomes, region_features, ring, bins, grid, pairs)             \
  (RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(features, outcomes, 0, 0) + 1688u +            \
   (size_t)(outcomes) * (56u + 8u * (size_t)(region_features)) + 8u * (size_t)(region_features) +  \
   (size_t)(region_features) * (size_t)(bins) * (4u * (size_t)(outcomes) + 2u) +                   \
   (size_t)(ring) * (((size_t)(region_features) + 7u) / 4u * 4u + 2u * (size_t)(outcomes)) +       \
   2u * (size_t)(grid) * (size_t)(grid) +                                                          \
   (size_t)(pairs) * (4u * (size_t)(grid) * ((size_t)(grid) + 1u) + 904u))
/* The same with section NOISE (fields, means: as there), without QUADRATIC: of train --flight. */
#define RIM_MONITOR_TRAINED_SIZE(features, outcomes, region_features, ring, filters, terms,        \
                                 fields, means)                                                    \
  (RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(features, outcomes, filters, terms) + 4752u +  \
   RIM_MONITOR_KINDS * (size_t)(outcomes) *                                                        \
       (2u * (size_t)(fields) * ((fields) + 3u) + 74u + (region_features)) +                       \
   (size_t)(ring) *                                                                                \
       (4u * (4u + (fields)) + 8u * (size_t)(outcomes) + (region_features) + (means) + 3u))
#define RIM_MONITOR_INTERFERENCE_BYTES 4096u /* more, for an image that watches interference */

/* Writes the bytes that this image needs. Errors as rim_monitor_init; then *bytes is unchanged. */
rim_status rim_monitor_size(const void *image, size_t image_bytes, size_t *bytes);

/* Validates the whole image and prepares a monitor in the caller's memory, aligned to 8. The image
 * must outlive the monitor and stay unchanged. RIM_E_ARGUMENT: NULL; RIM_E_ALIGN, RIM_E_SIZE: the
 * memory; RIM_E_MAGIC, _VERSION, _ENDIAN, _CRC, _TRUNCATED, _RANGE, _DATA: the image is damaged or
 * of another version; RIM_E_CONFIG: its sections do not fit together. O(image bytes). */
rim_status rim_monitor_init(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                            size_t image_bytes);

/* Offers one row, with bounded work (lib/README.md). A row with NaN or infinity, or whose time does
 * not increase, is counted in health and has no other effect: the result is RIM_OK and
 * verdict->valid is false. RIM_E_ARGUMENT: NULL. */
rim_status rim_monitor_step(rim_monitor *monitor, const rim_observation *row, rim_verdict *verdict);

/* Takes the next record that waits: the second one of a row, and those of idle, command, restart
 * and repeat. Returns false, with *record unchanged, when none waits. If this is never called, one
 * waiting record leaves with each row. O(1). */
bool rim_monitor_next_record(rim_monitor *monitor, rim_alarm *record);

/* Reports that it is now_s on the clock of the rows and no row has come since the newest. Call it
 * from time to time while none comes. Returns true once, when the silence is longer than the limit
 * for STALE: records of that level then wait, with the time at which the input became stale. The
 * next valid row ends it. A time that is not finite or not later has no effect. O(1). */
bool rim_monitor_idle(rim_monitor *monitor, double now_s);

/* Sets what the application asks of the alarms; until then the limit for STALE is the image's. Call
 * it again after init; attach and the resets keep it. Where latching ends, what it held is cleared.
 * RIM_E_ARGUMENT: NULL; RIM_E_CONFIG: stale_s < 0, not finite; RIM_E_CRC: damaged memory. O(1). */
rim_status rim_monitor_set_policy(rim_monitor *monitor, const rim_alarm_policy *policy);

/* Obeys a command from a bus that carries the low `bits` bits of sequence and model_id (8 on CAN,
 * 32 on LCM). It has to name the alarm's newest record and the model; where the policy says
 * command_any, a 0 stands for any. ACKNOWLEDGE: the alarm will not be latched; a latched one is
 * cleared. CLEAR: the alarm is cleared and its detector forgets all observations. Records then
 * wait. RIM_E_ARGUMENT: NULL; RIM_E_RANGE: unknown command; RIM_E_DATA: no alarm stands that it can
 * mean, or both could be; RIM_E_CRC: damaged memory. On errors no effect. O(1), CLEAR O(memory). */
rim_status rim_monitor_command(rim_monitor *monitor, const rim_command *command, unsigned bits);

/* Forgets all observations, and their counts, because the rows' clock moved to now_s within a run
 * (rim_clock_guard_take). Waiting records end or latch the alarms. now_s not finite: no effect. */
void rim_monitor_restart(rim_monitor *monitor, double now_s);

/* The same for a new run; the alarms end without a record, and their counters go on. O(memory). */
void rim_monitor_reset(rim_monitor *monitor);

/* Goes on from the bytes of another monitor (a restart of the process), bit for bit: memory holds a
 * copy of them, made with this image and the same library build. Errors as rim_monitor_init;
 * RIM_E_DATA: no such monitor, or a call on it never ended: nobody can check it. O(image bytes). */
rim_status rim_monitor_attach(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes);

/* As init, after RIM_LEVEL_INTEGRITY: policy, sequence numbers and the count of alarms go on; the
 * next row's record says that none stands. RIM_E_CRC: the image itself is damaged. */
rim_status rim_monitor_repair(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes);

/* Lets a record of every standing alarm leave once more, as UPDATED. Use: after attach. O(1). */
void rim_monitor_repeat(rim_monitor *monitor);

/* Queries, O(1) except membership. For a NULL monitor they return STALE, NULL, 0. */
rim_alarm_status rim_monitor_alarms(const rim_monitor *monitor);
rim_monitor_health rim_monitor_get_health(const rim_monitor *monitor);
/* The standing alarm of a detector as it was last described, valid until the next call; or NULL. */
const rim_alarm *rim_monitor_standing(const rim_monitor *monitor, rim_detector detector);
/* Probability that a context lies in the region of the standing alarm; 0: none stands. */
double rim_monitor_membership(const rim_monitor *monitor, const double *context);
/* A word of the image's configuration (rim_config_word of rim/image.h); 0: no such word. */
uint32_t rim_monitor_config(const rim_monitor *monitor, uint32_t word);

/* Number of deviations that an alarm described and that ended since the last reset; their blocks
 * are no evidence any more. The newest took the blocks *first to *end - 1, counted from 0; either
 * may be NULL. 0 for NULL and for an image without section NOISE. O(1). */
uint32_t rim_monitor_ended(const rim_monitor *monitor, uint32_t *first, uint32_t *end);

/* Returns the digest continued by every bit of the verdict that decides anything. Start with
 * RIM_DIGEST_START; a replay that gives the same value decided the same. NULL: unchanged. */
#define RIM_DIGEST_START UINT64_C(0xcbf29ce484222325)
uint64_t rim_verdict_digest(uint64_t digest, const rim_verdict *verdict);

/* The clock guard keeps rows whose time cannot be right away from the monitor: a time too far ahead
 * or back is left out until resync_rows rows in succession agree with it. max_jump_s bounds how far
 * one wrong time can move the clock: keep it at a few periods. Plain data; all zero: no row yet. */
typedef struct rim_clock_guard_config {
  double max_jump_s;    /* accepted ahead of the newest time, beyond 1.01 times what passed here */
  double max_skew_s;    /* accepted difference from day_s; 0: not compared */
  uint32_t resync_rows; /* refused in succession, no repeats, until their clock is accepted; 0: 1 */
} rim_clock_guard_config;

typedef struct rim_clock_guard {
  double last_s, last_here_s;   /* newest accepted row: its time, and when it came */
  double other_s, other_here_s; /* newest refused row */
  uint32_t refused;             /* in succession */
  bool started;
} rim_clock_guard;

typedef enum rim_clock_answer {
  RIM_CLOCK_BELIEVED = 0, /* offer the row */
  RIM_CLOCK_BACK = 1,     /* the time does not increase: leave the row out */
  RIM_CLOCK_FUTURE = 2,   /* it is too far ahead: leave the row out */
  RIM_CLOCK_RESTARTED = 3 /* another clock: call rim_monitor_restart, then offer the row */
} rim_clock_answer;

/* Judges the time t_s of a row that came at here_s on the receiver's steady clock and at day_s by
 * day (a replay gives t_s for both). RIM_CLOCK_FUTURE for NULL or a time not finite. O(1). */
rim_clock_answer rim_clock_guard_take(rim_clock_guard *guard, const rim_clock_guard_config *config,
                                      double t_s, double here_s, double day_s);

#ifdef __cplusplus
}
#endif
#endif
