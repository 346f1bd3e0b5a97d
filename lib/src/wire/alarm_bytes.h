/* SPDX-License-Identifier: MIT */
/* alarm_bytes.h - private: numbers to and from bytes, and what makes an alarm record well formed.
 */
#ifndef RIM_ALARM_BYTES_H
#define RIM_ALARM_BYTES_H

#include <string.h>

#include "base/real.h"
#include "rim/alarm.h"

static inline bool alarm_codes_in_range(const rim_alarm *a) {
  return a->detector <= RIM_DETECTOR_INTERFERENCE && a->state <= RIM_ALARM_CLEARED &&
         a->level <= RIM_LEVEL_STALE && a->kind <= RIM_KIND_PUSHED &&
         a->channels <= RIM_ALARM_MAX_CHANNELS && a->region.dims <= RIM_REGION_MAX_DIMS;
}

static inline bool all_finite(const double *x, size_t n) {
  for (size_t i = 0; i < n; i++)
    if (!rimi_is_finite(x[i]))
      return false;
  return true;
}

/* Every number that the record uses or that a reader might show. */
static inline bool alarm_is_finite(const rim_alarm *a) {
  const double single[5] = {a->t_s, a->since_s, a->ln_anom, a->threshold, a->p_value};
  return all_finite(single, 5) && all_finite(a->shift, RIM_ALARM_MAX_CHANNELS) &&
         all_finite(a->shift_sd, RIM_ALARM_MAX_CHANNELS) &&
         all_finite(a->region.center, RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.lower, RIM_REGION_MAX_DIMS) &&
         all_finite(a->region.upper, RIM_REGION_MAX_DIMS);
}

#endif
