#include "bus/can_refusal.hpp"

#include <cerrno>
#include <cstring>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include "util/error.hpp"

namespace rim {

void refuse_can(const std::string &interface, const std::string &task, const std::string &instead) {
  const int descriptor = ::socket(AF_CAN, SOCK_RAW, 1);
  if (descriptor < 0) {
    throw DataError(interface + ": this machine's kernel has no CAN (" + std::strerror(errno) +
                    "); " + instead);
  }
  ::close(descriptor);
  if (::if_nametoindex(interface.c_str()) == 0)
    throw DataError(interface + ": no such interface; " + instead);
  throw DataError(interface + ": " + task + " on CAN is not in this version; " + instead);
}

} // namespace rim
