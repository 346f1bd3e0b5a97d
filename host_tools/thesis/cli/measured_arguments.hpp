// SPDX-License-Identifier: MIT
// thesis/cli/measured_arguments.hpp - what every experiment on measured logs takes.
#pragma once

#include <CLI/CLI.hpp>

#include "thesis/experiment/measured_common.hpp"

namespace rim::experiment {

inline CLI::App *add_measured(CLI::App &app, const char *name, const char *description,
                              MeasuredOptions &o) {
  CLI::App *command = app.add_subcommand(name, description);
  command->add_option("--data", o.data, "folder of the logs (in ../shared/measured)");
  command->add_option("--exclude", o.exclude, "logs not to use, say d7_r1")->delimiter(',');
  command->add_option("--null-runs", o.null_runs, "as for 'rim diagnose'");
  command->add_option("--seed", o.seed, "of all random numbers (1)");
  return command;
}

} // namespace rim::experiment
