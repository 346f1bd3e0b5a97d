// SPDX-License-Identifier: MIT
// plan/choice_time.hpp - how long a choice takes, for 'rim bench'.
#pragma once

#include "rim/plan/bandit.h"

#include <cstddef>
#include <cstdint>

namespace rim {

struct ChoiceTime {
  double choose_ms = 0.0;  // median of `repeats` choices among `actions` with `observations` held
  double least_ms = 0.0;   // their minimum: what other work on the machine does not lengthen
  double observe_ms = 0.0; // mean of an observation on the way there, region search included
  std::size_t bytes = 0;   // of the bandit; nothing else is allocated
};

// Two features, a region with better rewards than expected.
ChoiceTime time_choice(rim_bandit_policy policy, rim_gp_kernel kernel, std::uint32_t actions,
                       std::uint16_t observations, std::size_t repeats);

} // namespace rim
