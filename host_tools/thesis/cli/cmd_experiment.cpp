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
  rim::cli::Arguments app{"Measure the thesis's tables and figures again.",
                          "rim-thesis experiment"};
  std::vector<rim::ExperimentCommand> commands = rim::experiment_commands();
  std::sort(commands.begin(), commands.end(),
            [](const auto &a, const auto &b) { return a.name < b.name; });
  std::vector<std::function<int()>> run;
  for (const rim::ExperimentCommand &command : commands)
    run.push_back(command.add(app));
  app.footer("Examples:\n"
             "  rim-thesis experiment golf --dims 2,100 --runs 20 --nominal 40 --calibration 100\n"
             "  rim-thesis experiment lander --nominal 40 --runs 3");
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (app.subcommand(i).parsed())
      return run[i]();
  }
  return rim::EXIT_USAGE; // not reached: one subcommand is required
}

} // namespace

RIM_COMMAND(experiment, "the thesis's tables and figures", cmd_experiment)
