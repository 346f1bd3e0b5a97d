// SPDX-License-Identifier: MIT
// rim-thesis experiment NAME: the thesis's tables and figures, measured again.
#include <algorithm>

#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "thesis/cli/experiment.hpp"

namespace rim {

std::vector<ExperimentCommand> &experiment_commands() {
  static std::vector<ExperimentCommand> list;
  return list;
}

} // namespace rim

namespace {

int cmd_experiment(int argc, char **argv) {
  CLI::App app{"Measure the thesis's tables and figures again.", "rim-thesis experiment"};
  app.require_subcommand(1);
  std::vector<rim::ExperimentCommand> commands = rim::experiment_commands();
  std::sort(commands.begin(), commands.end(),
            [](const auto &a, const auto &b) { return a.name < b.name; });
  std::vector<std::function<int()>> run;
  for (const rim::ExperimentCommand &command : commands)
    run.push_back(command.add(app));
  app.footer("Examples:\n"
             "  rim-thesis experiment golf --dims 2,100 --runs 20 --nominal 40 --calibration 100\n"
             "  rim-thesis experiment lander --nominal 40 --runs 3");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  const std::vector<CLI::App *> added = app.get_subcommands({});
  for (std::size_t i = 0; i < added.size(); ++i) {
    if (added[i]->parsed())
      return run[i]();
  }
  return rim::EXIT_USAGE; // not reached: one subcommand is required
}

} // namespace

RIM_COMMAND(experiment, "the thesis's tables and figures", cmd_experiment)
