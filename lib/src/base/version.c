/* SPDX-License-Identifier: MIT */
#include "rim/version.h"

int rim_version(void) { return RIM_VERSION_NUMBER; }
