/* SPDX-License-Identifier: MIT */
/* image/quadratic.h - an outcome from products of readings of a block and of the block before: they
 * tell what a sum of readings does not (a current follows from a load times a speed), and what the
 * readings were before tells how they change (a heat flow moves a temperature).
 *
 * Section, little endian, 4-byte aligned:
 *   u32  layout (RIM_QUADRATIC_LAYOUT), inputs d, models n, paired m (d or 2 d)
 *   f32  centre[d], inverse_scale[d] > 0   z = (x - centre) * inverse_scale, clipped
 *   n times:
 *     u16  outcome, use (rim_quadratic_use)   in increasing order: of the use, then the outcome
 *     f32  weight[RIM_QUADRATIC_TERMS(d, m)], in the outcome's unit: of 1, of z[2 d], then of
 *          z[i] z[j] for i = 0..m-1, j = i..m-1; z[d..2 d) is of the block before
 * The writer is rim::quadratic_section() in host_tools/train/quadratic.hpp. */
#ifndef RIM_QUADRATIC_H
#define RIM_QUADRATIC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_QUADRATIC_LAYOUT 1u
#define RIM_QUADRATIC_MAX_INPUTS 32u
#define RIM_QUADRATIC_CLIP 4.0 /* standard deviations */
#define RIM_QUADRATIC_HEADER_WORDS 4u

#define RIM_QUADRATIC_TERMS(inputs, paired) (1u + 2u * (inputs) + (paired) * ((paired) + 1u) / 2u)

typedef enum rim_quadratic_use {
  RIM_QUADRATIC_AGREES = 0, /* what an outcome is held against by its agreement */
  RIM_QUADRATIC_STEPS = 1   /* what it does next, from the readings of the block before */
} rim_quadratic_use;

/* A view, read in place. A zeroed view has no models. */
typedef struct rim_quadratic {
  const uint8_t *section; /* not owned: must outlive the view */
  uint16_t inputs, models, paired;
} rim_quadratic;

/* Opens a view of section[0..bytes), whose inputs must be so many and whose models of outcomes
 * below `outcomes`.
 *
 * RIM_E_ALIGN      section is not 4-byte aligned.
 * RIM_E_TRUNCATED  bytes is below the header, or below what its dimensions need; RIM_E_SIZE: above.
 * RIM_E_VERSION    another layout.
 * RIM_E_RANGE      a dimension out of its range, or an outcome or a use that is none or out of
 *                  order.
 * RIM_E_DATA       a value not finite, or a scale not above 0.
 *
 * On any error the view is left as it was. O(bytes). */
rim_status rimi_quadratic_open(rim_quadratic *view, const uint8_t *section, size_t bytes,
                               uint32_t inputs, uint32_t outcomes);

/* Whether an outcome has a model of this use. O(models). */
bool rimi_quadratic_has(const rim_quadratic *view, rim_quadratic_use use, uint32_t outcome);
/* Whether any has. O(1). */
bool rimi_quadratic_has_steps(const rim_quadratic *view);

/* A block's inputs x[d], in the units of training, standardised into z[0..d); what was there moves
 * to z[d..2 d), or z[0..d) does where the block does not follow another. O(d). */
void rimi_quadratic_take(const rim_quadratic *view, const double *x, bool follows, double *z);

/* predicted[outcome] of every outcome that has a model of this use, from z[2 d]; the others are
 * left as they are. Cost: a multiply-add per term of every model of the use. */
void rimi_quadratic_predict(const rim_quadratic *view, rim_quadratic_use use, const double *z,
                            double *predicted);

#ifdef __cplusplus
}
#endif
#endif
