/* SPDX-License-Identifier: MIT */
/* image/correct.h - the corrected model: what is predicted once the regions where the nominal model
 * is wrong are known (thesis 3.4, p. 34-36).
 *
 * Up to 8 regions, each with the shift of every outcome's mean (eq. 3.20) and the confidence
 * P(R follows theta_i) in it (eq. 3.25-3.27, rimi_threshold_confidence). The prediction becomes a
 * mixture of nominal model and shifted models (eq. 3.18, 3.28); its mean is eq. 3.30.
 *
 * Where regions overlap:
 *   FIRST     the first of them alone counts (assumption 1, p. 31): eq. 3.29, 3.30. With regions in
 *             the order of rim_dmaps_result an observation belongs to whom DMAPS gave it;
 *   MIXTURE   eq. 3.28 as it stands: each with its confidence; where these exceed 1 together they
 *             are scaled down to 1, and nothing is left for the nominal model;
 *   SUM       each acts or not for itself, and what acts adds up: corrections that were found one
 *             after another, each on what the earlier ones leave (`rim diagnose`).
 *
 * A model is one packed section, read in place and never copied, on its own or in a flight image;
 * any number of views may share it. Section, little-endian, 4-byte aligned:
 *   u32  layout (RIM_CORRECT_LAYOUT), bytes in all, features, outcomes, regions, overlap, kinds,
 *        CRC-32 of everything but these four bytes
 *   per region:
 *     u8   dims 0..3, 1 for a box
 *     u16  feature[3], those beyond dims 0
 *     f64  confidence in [0, 1], center[3], inverse_shape[9] (dims x dims by rows), lower[3],
 *          upper[3], those beyond dims 0
 *     f64  shift[outcomes] */
#ifndef RIM_CORRECT_H
#define RIM_CORRECT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/image.h"
#include "rim/region.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_CORRECT_LAYOUT 1u
#define RIM_CORRECT_MAX_REGIONS 8
#define RIM_CORRECT_MAX_OUTCOMES 128
#define RIM_CORRECT_MAX_FEATURES 128
#define RIM_CORRECT_HEADER_BYTES 32u
#define RIM_CORRECT_BYTES(outcomes, regions)                                                       \
  (RIM_CORRECT_HEADER_BYTES + (size_t)(regions) * (160u + 8u * (size_t)(outcomes)))

typedef enum rim_overlap {
  RIM_OVERLAP_FIRST = 0,
  RIM_OVERLAP_MIXTURE = 1,
  RIM_OVERLAP_SUM = 2
} rim_overlap;

typedef struct rim_correct_region {
  rim_region region; /* in the features' units; dims 0: everywhere */
  bool is_box;       /* lower <= x <= upper in every feature instead of the ellipsoid; with lower
                        above upper (an angle) x >= lower or x <= upper */
  double confidence; /* 0..1; 0: does nothing */
} rim_correct_region;

/* What is packed; the arrays are the caller's. */
typedef struct rim_correct_model {
  uint32_t features; /* of a context, 1..128 */
  uint32_t outcomes; /* 1..128 */
  uint32_t regions;  /* 0..8; 0: the nominal model */
  rim_overlap overlap;
  uint32_t kinds; /* on board: mask of rim_kind (rim/alarm.h) whose predictions are corrected: SHIFT
                     (the level model, or the caller's own), INCREMENT, STEP (one row ahead: STEP
                     and VARIANCE); 0: none */
  const rim_correct_region *region; /* [regions] */
  const double *shift;              /* [regions][outcomes], outcomes' units */
} rim_correct_model;

/* A view; read only for the caller. All zero is not open. */
typedef struct rim_correct {
  const uint8_t *section; /* not owned: must outlive the view */
  uint32_t features, outcomes, regions;
  uint32_t kinds;
  rim_overlap overlap;
} rim_correct;

/* Packs a model. bytes: exactly RIM_CORRECT_BYTES. RIM_E_ARGUMENT: NULL; RIM_E_SIZE: bytes;
 * RIM_E_RANGE: a count, kind, overlap, dims or feature; RIM_E_DATA: a number not finite (a box's
 * bounds may be infinite), a confidence outside [0, 1]; RIM_E_SINGULAR: an ellipsoid that is none.
 * The section is unchanged on error. */
rim_status rimi_correct_pack(const rim_correct_model *model, uint8_t *section, size_t bytes);

/* Opens a view of section[0..bytes), validated whole: RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: not
 * 4-aligned; RIM_E_TRUNCATED, RIM_E_SIZE: fewer, more bytes than it announces; RIM_E_VERSION:
 * another layout; RIM_E_CRC: damaged; RIM_E_RANGE, RIM_E_DATA, RIM_E_SINGULAR as rimi_correct_pack,
 * also where unused entries are not 0. The view is unchanged on error. O(bytes). */
rim_status rimi_correct_open(rim_correct *view, const uint8_t *section, size_t bytes);

/* Opens the section of an image. RIM_E_RANGE also: the image has none. */
rim_status rimi_correct_of_image(rim_correct *view, const rim_image *image);

/* Below: x[features] is the whole context; nominal, sd, z, mean have [outcomes] numbers, sd > 0.
 * NaN in a feature lies outside of regions over it. RIM_E_ARGUMENT: NULL or not open. Nothing is
 * written on error. O(regions (dims^2 + outcomes)), the densities with SUM O(2^k outcomes) for k
 * regions that contain x. Stack below 1 kB. */

/* alpha_0 of the nominal model (eq. 3.21) and alpha_1..alpha_regions (eq. 3.27): weight[regions +
 * 1]. With SUM alpha_i is the chance that i acts and alpha_0 the chance that none does. */
rim_status rimi_correct_weights(const rim_correct *view, const double *x, double *weight);

/* Expected outcomes, eq. 3.30. mean may be nominal itself. */
rim_status rimi_correct_mean(const rim_correct *view, const double *x, const double *nominal,
                             double *mean);

/* Mean and standard deviation of the mixture; may be nominal and sd themselves. */
rim_status rimi_correct_moments(const rim_correct *view, const double *x, const double *nominal,
                                const double *sd, double *mean, double *mixed_sd);

/* Density of one outcome at z, in 1/unit: the mixture's marginal (eq. 3.28, 3.29). RIM_E_RANGE: no
 * such outcome; RIM_E_DATA: sd not above 0. */
rim_status rimi_correct_density(const rim_correct *view, const double *x, uint32_t outcome,
                                double nominal, double sd, double z, double *density);

/* Natural logarithm of the joint density of all outcomes, independent given which model acts.
 * RIM_E_DATA: an sd not above 0. */
rim_status rimi_correct_ln_density(const rim_correct *view, const double *x, const double *nominal,
                                   const double *sd, const double *z, double *ln_density);

#ifdef __cplusplus
}
#endif
#endif
