// bus/can_refusal.hpp - why this program cannot use a CAN interface: SocketCAN is the daemon's.
#pragma once

#include <string>

namespace rim {

// Throws DataError "INTERFACE: reason; instead": the kernel has no CAN, there is no such interface,
// or `task` ("listening") on CAN is not in this version.
[[noreturn]] void refuse_can(const std::string &interface, const std::string &task,
                             const std::string &instead);

} // namespace rim
