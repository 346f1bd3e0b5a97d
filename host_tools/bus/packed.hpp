// SPDX-License-Identifier: MIT
// bus/packed.hpp - whether a record could be packed for a bus.
#pragma once

#include <stdexcept>
#include <string>

#include "rim/status.h"

namespace rim {

// Throws std::runtime_error unless the library packed the record; on_bus: "on CAN", "over LCM".
inline void check_packed(rim_status status, const char *on_bus) {
  if (status != RIM_OK)
    throw std::runtime_error(std::string("a record cannot be sent ") + on_bus + ": " +
                             rim_status_text(status));
}

} // namespace rim
