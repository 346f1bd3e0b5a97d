/* SPDX-License-Identifier: MIT */
/* rim/gp.h - Gaussian process regression in fixed memory (thesis 5.1, p. 67; B.3, p. 119).
 *
 * Model: y = f(x) + noise, f a Gaussian process with a constant prior mean and covariance
 * signal_var * k(r), r^2 the sum over dimensions of ((x_d - x'_d) / length_d)^2. The posterior of f
 * comes from the Cholesky factor of K = signal_var k + diag(noise), which is kept up to date: a
 * point is added (a new row) or removed (a rank-one update of the rows behind it) in O(n^2).
 *
 * Each point carries a target y and an offset (0 unless set): the process describes y - offset. So
 * a corrected model can change what it explains without a new factorisation (Algorithm 6, p. 74:
 * a GP on the residuals of the corrected model).
 *
 * When the memory is full, the least informative point makes room for the new one: the point i with
 * the least information about f given all the others, 1/2 ln(1 + s_i^2 / noise_i), s_i^2 + noise_i
 * = 1 / (K^-1)_ii; the oldest among equals. Duplicates go first, points at the rim of what was
 * explored last. The values y play no part. The new point itself is never the one to go.
 *
 * Points may coincide. A pivot of the factor must keep 1e-14 of its diagonal element; where it does
 * not (duplicates without noise), the point's own noise is raised by a jitter of signal_var times
 * 1e-12, then 1e-11, ... 1e-6, and when that is not enough the point is refused, RIM_E_SINGULAR.
 * Both are counted.
 *
 * A process is one flat block of memory without pointers: its bytes copied elsewhere (aligned to 8)
 * go on as the original would. Equal calls give equal bits on every target. No function keeps a
 * pointer. Functions returning rim_status change nothing on error, except counters. Pointers are
 * not checked in functions that return double, void or a count. Stack below 1 kB. */
#ifndef RIM_GP_H
#define RIM_GP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_GP_MAX_DIMS 8
#define RIM_GP_MAX_POINTS 512
#define RIM_GP_BATCH 8 /* contexts predicted side by side: see rim_gp_predict_many */
#define RIM_GP_HEADER_BYTES 256
/* Hyperparameters, in the order of the gradient: ln signal_var, ln noise_var, ln length[dims]. */
#define RIM_GP_PARAMETERS(dims) ((size_t)(dims) + 2u)

/* Bytes of a process; 512 points in 2 dimensions: 1.12 MB, 128 points: 84 kB. */
#define RIM_GP_SIZE(dims, points)                                                                  \
  (RIM_GP_HEADER_BYTES + 8u * (size_t)(points) * ((size_t)(dims) + 7u + RIM_GP_BATCH) +            \
   4u * (size_t)(points) * ((size_t)(points) + 1u))

typedef enum rim_gp_kernel {
  RIM_GP_SQUARED_EXPONENTIAL = 0, /* exp(-r^2 / 2) */
  RIM_GP_MATERN_3_2 = 1,          /* (1 + a) exp(-a), a = sqrt(3) r */
  RIM_GP_MATERN_5_2 = 2           /* (1 + a + a^2 / 3) exp(-a), a = sqrt(5) r */
} rim_gp_kernel;

/* Zero-initialise, then fill. */
typedef struct rim_gp_config {
  uint8_t kernel;                 /* rim_gp_kernel */
  uint8_t dims;                   /* 1..RIM_GP_MAX_DIMS */
  uint16_t points;                /* capacity, 1..RIM_GP_MAX_POINTS */
  double mean;                    /* prior mean of f, in y's unit */
  double signal_var;              /* prior variance of f, > 0; 0: 1 */
  double noise_var;               /* variance of the noise of every point, >= 0; 0: none */
  double length[RIM_GP_MAX_DIMS]; /* > 0, in the unit of that dimension; 0: 1 */
} rim_gp_config;

/* Saturating; all zero after init and reset. */
typedef struct rim_gp_counters {
  uint32_t added;    /* points taken in */
  uint32_t removed;  /* least informative points that made room */
  uint32_t refused;  /* x, y or noise not finite, noise below 0 */
  uint32_t jittered; /* points that needed a jitter */
  uint32_t singular; /* points refused because no jitter was enough */
} rim_gp_counters;

typedef struct rim_gp rim_gp;

/* Makes an empty process in the caller's memory. RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: memory not
 * aligned to 8; RIM_E_CONFIG: kernel, dims or points out of range; RIM_E_RANGE: a variance or
 * length not finite or out of range (lengths and signal_var within 1e-100..1e100); RIM_E_SIZE:
 * fewer bytes than RIM_GP_SIZE(dims, points). O(1). */
rim_status rim_gp_init(rim_gp **gp, void *memory, size_t bytes, const rim_gp_config *config);

/* Empties it, hyperparameters kept, counters cleared. O(1). */
void rim_gp_reset(rim_gp *gp);

/* Adds the observation (x[dims], y), whose own noise variance is noise_var of the configuration
 * plus `noise`. When full the least informative point is removed first (see above). The offset of a
 * new point is `offset`. RIM_OK; RIM_E_DATA a number not finite or noise < 0, counted;
 * RIM_E_SINGULAR not positive definite even with the largest jitter, counted (a point removed to
 * make room is gone then). O(n^2). */
rim_status rim_gp_add(rim_gp *gp, const double *x, double y, double noise, double offset);

/* Removes the point with this index; those behind it move up by one. RIM_E_RANGE: no such index.
 * O(n^2). */
rim_status rim_gp_remove(rim_gp *gp, uint32_t index);

/* Returns the index of the point that would make room for the next one; 0 when empty. O(n). */
uint32_t rim_gp_least_informative(const rim_gp *gp);

/* Returns the number of points, and the capacity. */
uint32_t rim_gp_points(const rim_gp *gp);
uint32_t rim_gp_capacity(const rim_gp *gp);

/* A point as it is stored: oldest first. `x` points into the process: valid until the next add,
 * remove or reset. */
typedef struct rim_gp_point {
  const double *x; /* [dims] */
  double y;
  double offset;
  double noise;    /* its whole noise variance, jitter included */
  uint32_t serial; /* 0 for the first point ever added, 1 for the second... */
} rim_gp_point;

/* RIM_E_RANGE: no such index. O(1). */
rim_status rim_gp_get_point(const rim_gp *gp, uint32_t index, rim_gp_point *point);

/* Changes what another model explains of a point's target. Takes effect with rim_gp_refresh. Sets
 * of offsets are changed at O(1) each and refreshed once. RIM_E_RANGE: no such index; RIM_E_DATA:
 * not finite. */
rim_status rim_gp_set_offset(rim_gp *gp, uint32_t index, double offset);

/* Solves for the weights anew after offsets were set. O(n^2). */
void rim_gp_refresh(rim_gp *gp);

/* Posterior mean and variance of f at x[dims]; either may be NULL. The variance excludes the noise,
 * lies in [0, signal_var] and without points is the prior's. RIM_E_DATA: x not finite: mean and var
 * are unchanged. Uses scratch inside the process. O(n^2), O(n) without var. */
rim_status rim_gp_predict(rim_gp *gp, const double *x, double *mean, double *var);

/* The same for `count` contexts x[count][dims], bit for bit what rim_gp_predict gives each, some
 * three times as fast. RIM_E_DATA: one of them not finite: nothing is written. */
rim_status rim_gp_predict_many(rim_gp *gp, const double *x, uint32_t count, double *mean,
                               double *var);

/* Returns the logarithm of the marginal likelihood of y - offset. O(n). */
double rim_gp_log_likelihood(const rim_gp *gp);

/* Its gradient with respect to ln signal_var, ln noise_var and ln length[dims], in this order:
 * gradient[RIM_GP_PARAMETERS(dims)]. The part of ln noise_var concerns the configuration's
 * noise_var alone. Jitter is held fixed. For fitting on the ground: O(n^3). */
void rim_gp_log_likelihood_gradient(rim_gp *gp, double *gradient);

/* Changes kernel, mean, variances and lengths (dims and points must be those of init) and factors
 * anew. On RIM_E_CONFIG and RIM_E_RANGE (as init) nothing is changed; on RIM_E_SINGULAR, where no
 * jitter is enough for some point, the old hyperparameters are back in force. O(n^3). */
rim_status rim_gp_set_config(rim_gp *gp, const rim_gp_config *config);

rim_gp_config rim_gp_get_config(const rim_gp *gp);
rim_gp_counters rim_gp_get_counters(const rim_gp *gp);

#ifdef __cplusplus
}
#endif
#endif
