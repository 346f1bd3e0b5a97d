/* SPDX-License-Identifier: MIT */
#include "rim/status.h"

const char *rim_status_text(rim_status status) {
  switch (status) {
  case RIM_OK:
    return "ok";
  case RIM_E_ARGUMENT:
    return "invalid argument";
  case RIM_E_SIZE:
    return "memory of the wrong size";
  case RIM_E_ALIGN:
    return "memory not aligned";
  case RIM_E_CONFIG:
    return "contradictory configuration";
  case RIM_E_MAGIC:
    return "not data of this kind";
  case RIM_E_VERSION:
    return "unsupported version";
  case RIM_E_ENDIAN:
    return "bytes of numbers swapped";
  case RIM_E_CRC:
    return "check sum mismatch: damaged data";
  case RIM_E_TRUNCATED:
    return "data truncated";
  case RIM_E_RANGE:
    return "out of range";
  case RIM_E_SINGULAR:
    return "matrix not positive definite";
  case RIM_E_CAPACITY:
    return "capacity exhausted";
  case RIM_E_DATA:
    return "invalid value in data";
  }
  return "unknown status";
}
