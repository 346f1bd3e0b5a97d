/* SPDX-License-Identifier: MIT */
/* image/nominal.h - the nominal model: mean and standard deviation of every outcome in a context.
 *
 * The compressed kernel model of eq. 4.13 and 4.14 (p. 63): a few prototypes stand for the training
 * rows. Order 0 keeps a mean and a variance per prototype (the kernel average itself, compressed);
 * order 1 keeps a local-linear map per prototype, which follows the state instead of averaging it.
 *
 * A model is one section of the flight image, read in place and never copied; any number of views
 * may share it. The writer is rim::nominal_section() in host_tools/train/fit.hpp.
 *
 * Section, little endian, 4-byte aligned:
 *   u32  layout (RIM_NOMINAL_LAYOUT), inputs d, outputs o, prototypes P, top K, order, 0, 0
 *   f32  centre[d], inverse_scale[d]   xs = (x - centre) * inverse_scale
 *   f32  gate_weight[d]                weight of an input in the gate's distance; 0: does not gate
 *   f32  per prototype p = 0..P-1:
 *          bandwidth h > 0, reach > 0 (holds the training rows nearest to p), ln_mass, 0
 *          prototype centre[d]         standardised
 *          variance[o] > 0             of the residual (order 1) or of the outcome (order 0)
 *          offset b[o]                 in the outcome's unit
 *          map A[o][d]                 order 1 only; outcome's unit per standardised input
 */
#ifndef RIM_NOMINAL_H
#define RIM_NOMINAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_NOMINAL_LAYOUT 1u
#define RIM_NOMINAL_MAX_INPUTS 128
#define RIM_NOMINAL_MAX_OUTPUTS 128
#define RIM_NOMINAL_MAX_PROTOTYPES 64
#define RIM_NOMINAL_MAX_TOP 8
#define RIM_NOMINAL_HEADER_WORDS 8
#define RIM_NOMINAL_MAX_STANDARDISED 1e6 /* larger standardised inputs are clamped to it */

/* Exact bytes of a section: 48.8 kB for 29 inputs, 25 outputs, 16 prototypes, order 1. */
#define RIM_NOMINAL_STRIDE(inputs, outputs, order)                                                 \
  (4u + (inputs) + 2u * (outputs) + ((order) ? (outputs) * (inputs) : 0u))
#define RIM_NOMINAL_BYTES(inputs, outputs, prototypes, order)                                      \
  (4u * (RIM_NOMINAL_HEADER_WORDS + 3u * (inputs) +                                                \
         (prototypes)*RIM_NOMINAL_STRIDE(inputs, outputs, order)))

/* A view; every field is read only for the caller. A zeroed view predicts RIM_E_ARGUMENT. */
typedef struct rim_nominal {
  const uint8_t *section; /* not owned: must outlive the view */
  uint32_t inputs;        /* d, 1..RIM_NOMINAL_MAX_INPUTS */
  uint32_t outputs;       /* o, 1..RIM_NOMINAL_MAX_OUTPUTS */
  uint32_t prototypes;    /* P, 1..RIM_NOMINAL_MAX_PROTOTYPES */
  uint32_t top;           /* K, 1..min(P, RIM_NOMINAL_MAX_TOP) */
  uint32_t order;         /* 0: prototypes average; 1: local-linear maps */
  uint32_t stride;        /* floats per prototype */
} rim_nominal;

/* Opens a view of the model in section[0..bytes).
 *
 * RIM_OK             the view is ready.
 * RIM_E_ARGUMENT     a null pointer.
 * RIM_E_ALIGN        section is not 4-byte aligned.
 * RIM_E_TRUNCATED    bytes is below the header, or below what the header's dimensions need.
 * RIM_E_SIZE         bytes is above what they need.
 * RIM_E_VERSION      another layout.
 * RIM_E_RANGE        a dimension out of its range, or a reserved word not 0.
 * RIM_E_DATA         a value not finite, or a scale, bandwidth, reach or variance not above 0.
 *
 * On any error the view is left as it was. Cost O(bytes); stack below 200 bytes. */
rim_status rimi_nominal_open(rim_nominal *model, const uint8_t *section, size_t bytes);

/* Predicts the outcomes in context x: eq. 4.13 for the mean, eq. 4.14 (diagonal) for the deviation,
 * over the K prototypes of largest gate weight exp(ln_mass - |g (xs - c_p)|^2 / 2h_p^2), ties by
 * index, normalised over those K. Weights are taken relative to the largest, so that a context far
 * from all prototypes is predicted by the nearest instead of dividing by zero.
 *
 * x[inputs]          in the units of training. Standardised values beyond +-1e6 are clamped.
 * mean[outputs]      in the outcomes' units.
 * sd[outputs]        standard deviation, > 0; order 0 includes the spread between the prototypes.
 * extrapolation      may be NULL: distance to the nearest prototype over its reach; at most 1 for
 *                    what was trained, well above 1 in a context that never was.
 *
 * RIM_OK; RIM_E_ARGUMENT null pointer or unopened view; RIM_E_DATA an input that is not finite.
 * On any error nothing is written. Cost P d + K o d multiply-adds, P divisions and K exponentials
 * (16*29 + 4*25*29 = 3364 multiply-adds on the lander); stack below 3 kB. */
rim_status rimi_nominal_predict(const rim_nominal *model, const double *x, double *mean, double *sd,
                                double *extrapolation);

/* Part of a prototype's reach up to which its map is believed: few rows lie at the end of it. */
#define RIM_NOMINAL_BELIEVED 0.75

/* beyond[outputs]: whether context x lies farther from its nearest prototype than most rows of
 * training nearest to it did, by RIM_NOMINAL_BELIEVED, when the output's own input own[o] (below
 * inputs) is left out:
 * a sensor that is wrong does not hide itself. A map says nothing of such a context. Cost P (d + o)
 * multiply-adds; stack below 4 kB. RIM_E_ARGUMENT, RIM_E_DATA as above. */
rim_status rimi_nominal_beyond(const rim_nominal *model, const double *x, const uint16_t *own,
                               bool *beyond);

#ifdef __cplusplus
}
#endif
#endif
