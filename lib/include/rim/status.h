/* SPDX-License-Identifier: MIT */
/* rim/status.h - how a call ended.
 *
 * 0 is fine; a negative value is misuse, bad configuration or refused data, and the header of the
 * function that returns it says what caused it and whether anything was changed. The values are
 * part of the interface: never renumbered. */
#ifndef RIM_STATUS_H
#define RIM_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum rim_status {
  RIM_OK = 0,
  RIM_E_ARGUMENT = -1,  /* a null pointer, or an argument that has no meaning */
  RIM_E_SIZE = -2,      /* the memory given is too small or too large */
  RIM_E_ALIGN = -3,     /* the memory given is not aligned as required */
  RIM_E_CONFIG = -4,    /* a configuration that contradicts itself */
  RIM_E_MAGIC = -5,     /* not the kind of data expected */
  RIM_E_VERSION = -6,   /* a layout that this library does not read */
  RIM_E_ENDIAN = -7,    /* written with the bytes of every number swapped */
  RIM_E_CRC = -8,       /* the check sum disagrees: the data is damaged */
  RIM_E_TRUNCATED = -9, /* the data ends before what it announces */
  RIM_E_RANGE = -10,    /* an index, count or offset outside what is allowed */
  RIM_E_SINGULAR = -11, /* a matrix that is not positive definite */
  RIM_E_CAPACITY = -12, /* a fixed capacity is exhausted */
  RIM_E_DATA = -13      /* a value that is not finite, or not in its physical range */
} rim_status;

/* Returns a constant English phrase for a status, "unknown status" for any other value; never NULL.
 * Cost O(1). */
const char *rim_status_text(rim_status status);

#ifdef __cplusplus
}
#endif
#endif
