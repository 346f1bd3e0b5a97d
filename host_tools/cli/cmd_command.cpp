// SPDX-License-Identifier: MIT
// rim command: what an operator says back to a monitor: acknowledge, clear.
#include "bus/can_bus.hpp"
#include "bus/key.hpp"
#include "bus/lcm_bus.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "util/error.hpp"

#include <cstdio>
#include <lcm/lcm.h>
#include <optional>
#include <vector>

namespace {

void send_lcm(const std::string &url, const rim_command &command, const rim::Key *key) {
  std::vector<std::uint8_t> bytes(RIM_LCM_COMMAND_SIZE);
  bool packed = true;
  if (key != nullptr) {
    const rim::Key::Message sealed = key->lcm(command);
    bytes.assign(sealed.begin(), sealed.end());
  } else {
    packed = rim_lcm_pack_command(bytes.data(), bytes.size(), &command) == RIM_OK;
  }
  lcm_t *lcm = lcm_create(url.c_str());
  if (lcm == nullptr)
    throw rim::DataError(url + ": LCM cannot open it");
  const bool sent = packed && lcm_publish(lcm, RIM_LCM_CHANNEL_COMMAND, bytes.data(),
                                          static_cast<unsigned>(bytes.size())) == 0;
  lcm_destroy(lcm);
  if (!sent)
    throw rim::DataError(url + ": LCM could not send " RIM_LCM_CHANNEL_COMMAND);
}

void send_can(const std::string &interface, unsigned node, const rim_command &command,
              const rim::Key *key) {
  rim_can_frame frame;
  if (key != nullptr)
    frame = key->can(node, command);
  else if (rim_can_pack_command(&frame, node, &command) != RIM_OK)
    throw rim::UsageError("--node: 0 to 127");
  rim::CanBus(interface).send(frame);
}

int cmd_command(int argc, char **argv) {
  std::string what, url, interface, key_file;
  unsigned node = 1;
  bool any = false;
  rim_command command{};
  rim::cli::Arguments app{"Acknowledge or clear a monitor's alarm, or ask it to describe itself.",
                          "rim command"};
  app.add_option("WHAT", what,
                 "acknowledge: a latched alarm may end once its cause is gone. clear: the monitor\n"
                 "forgets the alarm and the observations behind it. describe: it sends RIM_MODEL\n"
                 "now, and on CAN the newest record's finding and detail once more")
      ->required()
      ->check(rim::cli::is_member({"acknowledge", "clear", "describe"}));
  app.add_option("--lcm", url,
                 std::string("LCM URL (default, unless --can is given: ") + rim::kLcmUrl + ")");
  app.add_option("--can", interface, "CAN interface");
  app.add_option("--node", node, "CAN node number of the monitor (default 1)")
      ->check(rim::cli::range(0u, RIM_CAN_MAX_NODE));
  const rim::cli::Option sequence = app.add_option(
      "--sequence", command.sequence, "sequence number (seq) of the alarm's newest record");
  const rim::cli::Option model =
      app.add_option("--model-id", command.model_id, "model of that record");
  app.add_flag(
      "--any", any,
      "instead of these two: mean every standing alarm of any model; only a monitor whose\n"
      "configuration says command_any = yes obeys");
  app.add_option("--key", key_file,
                 "file of the key that the monitor's configuration names: the command is sealed\n"
                 "with it. Over CAN that is one FD frame");
  app.footer("Example:\n  rim listen --can can0     # shows the sequence number and the model\n"
             "  rim command acknowledge --can can0 --node 5 --sequence 3 --model-id 71");
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  if (what == "describe" && (any || sequence.count() + model.count() > 0))
    throw rim::UsageError("describe is asked of the monitor: --sequence, --model-id and --any are "
                          "for acknowledge and clear");
  if (what != "describe" && !any && (sequence.count() == 0 || model.count() == 0))
    throw rim::UsageError("--sequence and --model-id say which alarm is meant; or --any");
  command.command = what == "clear"         ? RIM_COMMAND_CLEAR
                    : what == "acknowledge" ? RIM_COMMAND_ACKNOWLEDGE
                                            : RIM_COMMAND_DESCRIBE;
  std::optional<rim::Key> key;
  if (!key_file.empty())
    key.emplace(key_file);
  const rim::Key *sealed = key ? &*key : nullptr;
  if (url.empty() && interface.empty())
    url = rim::kLcmUrl;
  if (!url.empty())
    send_lcm(url, command, sealed);
  if (!interface.empty())
    send_can(interface, node, command, sealed);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(command, "acknowledge or clear a monitor's alarm over LCM or CAN, or ask for its names",
            cmd_command)
