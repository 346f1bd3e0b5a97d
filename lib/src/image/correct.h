/* SPDX-License-Identifier: MIT */
/* image/correct.h - the corrected model: what is predicted once the regions where the nominal model
 * is wrong are known (thesis 3.4, p. 34-36).
 *
 * Up to 8 regions, each with the shift of every outcome's mean (eq. 3.20) and the confidence
 * P(R follows theta_i) in it (eq. 3.25-3.27: 1 less the p-value). The prediction becomes the mean,
 * eq. 3.30, of a mixture of nominal model and shifted models (eq. 3.18, 3.28).
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

/* Expected outcomes, eq. 3.30. x[features] is the whole context; nominal and mean have [outcomes]
 * numbers, and may be the same. NaN in a feature lies outside of regions over it. RIM_E_ARGUMENT:
 * NULL or not open; mean is unchanged then. O(regions (dims^2 + outcomes)). Stack below 1 kB. */
rim_status rimi_correct_mean(const rim_correct *view, const double *x, const double *nominal,
                             double *mean);

#ifdef __cplusplus
}
#endif
#endif
