// SPDX-License-Identifier: MIT
// util/version.hpp - RIM_VERSION, the version of rim/version.h as a text such as "0.1.0". A
// release recompiles the sources that include this, and no other.
#pragma once

#include "rim/version.h"

#define RIM_VERSION_WORDS(number) #number
#define RIM_VERSION_WORD(number) RIM_VERSION_WORDS(number)
#define RIM_VERSION                                                                                \
  RIM_VERSION_WORD(RIM_VERSION_MAJOR)                                                              \
  "." RIM_VERSION_WORD(RIM_VERSION_MINOR) "." RIM_VERSION_WORD(RIM_VERSION_PATCH)
