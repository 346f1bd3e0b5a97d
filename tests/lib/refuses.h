/* SPDX-License-Identifier: MIT */
/* refuses.h - for tests of what is refused: the status, and that what was given stays as it was. */
#ifndef REFUSES_H
#define REFUSES_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rim/status.h"

/* The call returns this status, and no byte of `what`, filled by us, changes. */
#define REFUSES(what, expected, call)                                                              \
  do {                                                                                             \
    memset(&(what), 0x5a, sizeof(what));                                                           \
    assert_int_equal(call, expected);                                                              \
    const uint8_t *byte_of_it = (const uint8_t *)&(what);                                          \
    for (size_t at_byte = 0; at_byte < sizeof(what); at_byte++)                                    \
      assert_int_equal(byte_of_it[at_byte], 0x5a);                                                 \
  } while (0)

#define IS_ARGUMENT(call) assert_int_equal(call, RIM_E_ARGUMENT)

#endif
