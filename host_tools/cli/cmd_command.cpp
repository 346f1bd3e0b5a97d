// SPDX-License-Identifier: MIT
// rim command: what an operator says back to a monitor: acknowledge, clear.
#include "bus/can_bus.hpp"
#include "bus/lcm_bus.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "util/error.hpp"

#include <cstdio>
#include <lcm/lcm.h>

namespace {

void send_lcm(const std::string &url, const rim_command &command) {
  std::uint8_t bytes[RIM_LCM_COMMAND_SIZE];
  lcm_t *lcm = lcm_create(url.c_str());
  if (lcm == nullptr)
    throw rim::DataError(url + ": LCM cannot open it");
  const bool sent = rim_lcm_pack_command(bytes, sizeof bytes, &command) == RIM_OK &&
                    lcm_publish(lcm, RIM_LCM_CHANNEL_COMMAND, bytes, sizeof bytes) == 0;
  lcm_destroy(lcm);
  if (!sent)
    throw rim::DataError(url + ": LCM could not send " RIM_LCM_CHANNEL_COMMAND);
}

void send_can(const std::string &interface, unsigned node, const rim_command &command) {
  rim_can_frame frame;
  if (rim_can_pack_command(&frame, node, &command) != RIM_OK)
    throw rim::UsageError("--node: 0 to 127");
  rim::CanBus(interface).send(frame);
}

int cmd_command(int argc, char **argv) {
  std::string what, url, interface;
  unsigned node = 0;
  rim_command command{};
  CLI::App app{"Say to a monitor that its alarm was seen, or that its cause is gone.",
               "rim command"};
  app.add_option("WHAT", what,
                 "acknowledge: a latched alarm may go when it is over; clear: forget "
                 "the alarm and what was learnt from it")
      ->required()
      ->check(CLI::IsMember({"acknowledge", "clear"}));
  app.add_option("--lcm", url,
                 std::string("LCM URL (default, unless --can is given: ") + rim::kLcmUrl + ")");
  app.add_option("--can", interface, "CAN interface");
  app.add_option("--node", node, "of the monitor, on CAN")->check(CLI::Range(0u, RIM_CAN_MAX_NODE));
  app.add_option("--sequence", command.sequence,
                 "only the alarm whose newest record this is (0: all that stand)");
  app.add_option("--model-id", command.model_id, "only to a monitor with this model (0: any)");
  app.footer("Example:\n  rim command acknowledge --can can0 --node 5");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  command.command = what == "clear" ? RIM_COMMAND_CLEAR : RIM_COMMAND_ACKNOWLEDGE;
  if (url.empty() && interface.empty())
    url = rim::kLcmUrl;
  if (!url.empty())
    send_lcm(url, command);
  if (!interface.empty())
    send_can(interface, node, command);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(command, "acknowledge or clear the alarm of a monitor, over LCM or CAN", cmd_command)
