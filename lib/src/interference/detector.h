/* SPDX-License-Identifier: MIT */
/* interference/detector.h - private: motion interference: is somebody or something holding,
 * blocking or pushing the vehicle (thesis App. C, p. 127-134).
 *
 * Three detectors over the forward velocity, each with a threshold of its own; the largest score
 * decides:
 *   HMM        five states, observations (u - v, a, j, u) as in C.2: acceleration a by regression
 *              over the last 4, for the jerk j over the last 8 velocities; log odds of state MI;
 *   one-step   CUSUM of v against the velocity one step ahead of the measured one: limited
 *              acceleration towards the command in force (eq. 4.10);
 *   open-loop  CUSUM of v against the same prediction made from the commands alone: a band, as wide
 *              as the limits of acceleration differ from run to run.
 * A residual against the direction of travel means blocked, along it pushed. All state is in
 * rim_interference; a step is a bounded amount of work.
 *
 * The model is one packed section, alone or in a flight image; little-endian, 4-byte aligned:
 *   u32 layout, bytes in all, 0, CRC-32 of everything but these four bytes; then f64s in the order
 *   of rim_interference_model. */
#ifndef RIM_INTERFERENCE_DETECTOR_H
#define RIM_INTERFERENCE_DETECTOR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "interference/hmm.h"
#include "rim/alarm.h"
#include "rim/image.h"
#include "rim/interference.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_INTERFERENCE_LAYOUT 1u
#define RIM_INTERFERENCE_NUMBERS 70u
#define RIM_INTERFERENCE_BYTES (16u + 8u * RIM_INTERFERENCE_NUMBERS)
#define RIM_INTERFERENCE_STATES 5
#define RIM_INTERFERENCE_GAUSSIANS 3 /* u - v, a, j; u itself is only 0 or not */
#define RIM_INTERFERENCE_A_ROWS 4    /* windows of the regressions, p. 131 */
#define RIM_INTERFERENCE_J_ROWS 8
#define RIM_INTERFERENCE_COMMANDS 32 /* changes of command not in force yet */
#define RIM_INTERFERENCE_CLIP 6.0    /* a residual is limited to this many sd */

typedef struct rim_interference_cusum {
  double sd_steady; /* of the residual at constant velocity, m/s, > 0 */
  double sd_ramp;   /* while the prediction accelerates and shortly after, m/s, > 0 */
  double slack;     /* taken off every standardised residual, >= 0 */
  double threshold; /* on the sum, in sd, > 0 */
} rim_interference_cusum;

typedef struct rim_interference_model {
  double transition[RIM_INTERFERENCE_STATES][RIM_INTERFERENCE_STATES]; /* [i][MI]: p_mi */
  double mean[RIM_INTERFERENCE_STATES][RIM_INTERFERENCE_GAUSSIANS];    /* m/s, m/s^2, m/s^3 */
  double sd[RIM_INTERFERENCE_STATES][RIM_INTERFERENCE_GAUSSIANS];      /* > 0 */
  double ln_odds;      /* of MI at which the HMM alarms; 0: P > 1/2, as in the thesis */
  double latency_s;    /* from a command to its effect, >= 0 */
  double accel_mps2;   /* limits when the speed rises, > 0 */
  double decel_mps2;   /* and when it falls, > 0 */
  double limit_spread; /* limits differ from run to run by this share either way, 0..0.9: the
                          open-loop prediction is a band, and what lies in it is no residual */
  double settle_s;     /* after an acceleration sd_ramp holds on for so long, >= 0 */
  double gap_s;        /* a longer time between rows resets, > 0 */
  rim_interference_cusum one_step, open_loop;
} rim_interference_model;

/* Private to the functions below; copy it to save it. 3 kB. */
typedef struct rim_interference {
  rim_interference_model model;
  rim_hmm hmm;
  double ln_norm[RIM_INTERFERENCE_STATES]; /* -sum ln(sd sqrt(2 pi)) */
  double inverse_sd[RIM_INTERFERENCE_STATES][RIM_INTERFERENCE_GAUSSIANS];
  rim_interference_health health;
  double row_t_s[RIM_INTERFERENCE_J_ROWS], row_v[RIM_INTERFERENCE_J_ROWS]; /* ring */
  double accel_8, accel_8_t_s;
  double observation[RIM_INTERFERENCE_GAUSSIANS];
  double command_t_s[RIM_INTERFERENCE_COMMANDS], command_v[RIM_INTERFERENCE_COMMANDS]; /* ring */
  double command, in_force, last_command_s;
  double t_s, speed, open_loop[2]; /* the limits low and high */
  double ramp_until_s;
  double sum[2][2]; /* one-step, open-loop; below, above */
  double sum_from_s[2][2];
  double hmm_from_s, onset_s;
  uint32_t rows, command_first, commands;
  uint8_t kind;
  bool started, has_command, alarmed, is_observed;
} rim_interference;

/* RIM_E_ARGUMENT NULL; RIM_E_SIZE bytes is not RIM_INTERFERENCE_BYTES; RIM_E_DATA a number that is
 * not finite or outside the range named above, a row of transitions that does not sum to 1.
 * Unchanged on error. */
rim_status rimi_interference_pack(const rim_interference_model *model, uint8_t *section,
                                  size_t bytes);

/* Reads a section, validated whole: RIM_E_ARGUMENT; RIM_E_TRUNCATED, RIM_E_SIZE; RIM_E_VERSION;
 * RIM_E_CRC; RIM_E_DATA as above. The model is unchanged on error. */
rim_status rimi_interference_open(rim_interference_model *model, const uint8_t *section,
                                  size_t bytes);

/* The section of an image. RIM_E_RANGE also: the image has none. */
rim_status rimi_interference_of_image(rim_interference_model *model, const rim_image *image);

/* RIM_E_ARGUMENT; RIM_E_DATA as rimi_interference_pack. Unchanged on error. */
rim_status rimi_interference_init(rim_interference *state, const rim_interference_model *model);

/* One row: the forward velocity commanded at t_s and the one measured, m/s. command NaN: missing,
 * the last one is taken for up to gap_s. Bad rows are counted and change nothing else; RIM_OK,
 * verdict->valid false. RIM_E_ARGUMENT NULL. O(25) multiply-adds, 10 exponentials, 6 logarithms,
 * and for each change of command that takes effect (32 at most) three limited ramps. */
rim_status rimi_interference_step(rim_interference *state, double t_s, double command_mps,
                                  double speed_mps, rim_interference_verdict *verdict);

/* Forget everything but the model and the counters. */
void rimi_interference_reset(rim_interference *state);

/* The verdict as an alarm record's contents: detector, kind (BLOCKED, PUSHED), level, since_s the
 * onset, channel[0] the channel given, shift[0] the residual in m/s (below 0: blocked when driving
 * forward), ln_anom the HMM's log odds, at least 0. State and seq are left to the monitor.
 * Returns false, and level OK, while nothing is found. */
bool rimi_interference_alarm(const rim_interference_verdict *verdict, uint32_t model_id,
                             uint16_t channel, rim_alarm *candidate);

/* What the HMM sees (eq. C.2), for training: u - v, a, j. False before the windows are full. */
bool rimi_interference_observation(const rim_interference *state,
                                   double observation[RIM_INTERFERENCE_GAUSSIANS]);

/* Four omnidirectional wheels, mounted at angle_rad at radius_m, driving tangentially: wheel speed
 * = -sin(angle) vx + cos(angle) vy + radius w. Counters wrap at 2^bits. */
typedef struct rim_wheels {
  double sine[4], cosine[4]; /* of the mounting angles */
  double radius_m;           /* > 0 */
  double tick_m;             /* travelled a tick, > 0 */
  uint32_t bits;             /* of a counter, 2..32 */
} rim_wheels;

/* Least-squares velocity (vx, vy, w) from two readings dt_s apart; a counter may have wrapped once:
 * the shorter way counts. RIM_E_ARGUMENT; RIM_E_DATA dt, radius, tick or bits, a counter that does
 * not fit the bits; RIM_E_SINGULAR wheels that do not span the plane. Unchanged on error. O(1). */
rim_status rimi_wheels_velocity(const rim_wheels *wheels, const uint32_t before[4],
                                const uint32_t now[4], double dt_s, double velocity[3]);

#ifdef __cplusplus
}
#endif
#endif
