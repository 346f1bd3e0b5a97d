// SPDX-License-Identifier: MIT
// PX4's clock.
#pragma once
#include <cstdint>
typedef uint64_t hrt_abstime;
hrt_abstime hrt_absolute_time();
hrt_abstime hrt_elapsed_time(const hrt_abstime *then);
