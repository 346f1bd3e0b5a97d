// SPDX-License-Identifier: MIT
// bus/key.hpp - commands that a monitor with a key obeys (firmware/SECURITY.md).
#pragma once

#include "rim/can.h"

#include <array>
#include <cstdint>
#include <string>

namespace rim {

// A key shared with monitors. Its commands carry a counter, the microseconds since 1970, so that
// none is good twice.
class Key {
public:
  // A file of 64 hexadecimal digits that nobody but its owner may read. Throws DataError.
  explicit Key(const std::string &path);

  using Message = std::array<std::uint8_t, RIM_LCM_COMMAND_SIZE + 24>;
  // rim_sealed_command_t, and the CAN FD frame.
  Message lcm(const rim_command &command) const;
  rim_can_frame can(unsigned node, const rim_command &command) const;

private:
  std::array<std::uint8_t, 32> key_{};
};

} // namespace rim
