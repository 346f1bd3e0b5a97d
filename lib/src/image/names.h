/* SPDX-License-Identifier: MIT */
/* image/names.h - private: units and the suffixes of names that say them. */
#ifndef RIM_IMAGE_NAMES_H
#define RIM_IMAGE_NAMES_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RIMI_UNITS 58u

typedef struct rimi_unit {
  char suffix[8]; /* "mps" */
  char text[8];   /* "m/s" */
} rimi_unit;

/* Returns entry i of the table; NULL from RIMI_UNITS on. O(1). */
const rimi_unit *rimi_unit_at(size_t i);

#ifdef __cplusplus
}
#endif

#endif
