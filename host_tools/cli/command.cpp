#include "cli/command.hpp"

namespace rim {

std::vector<Command> &commands() {
  static std::vector<Command> list;
  return list;
}

} // namespace rim
