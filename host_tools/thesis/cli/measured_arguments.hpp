// SPDX-License-Identifier: MIT
// thesis/cli/measured_arguments.hpp - what every experiment on measured logs takes.
#pragma once

#include "cli/arguments.hpp"

#include "thesis/experiment/measured_common.hpp"

namespace rim::experiment {

inline rim::cli::Arguments *add_measured(rim::cli::Arguments &app, const char *name,
                                         const char *description, MeasuredOptions &o) {
  rim::cli::Arguments *command = app.add_subcommand(name, description);
  command->add_option("--data", o.data, "folder of the logs")->required();
  command->add_option("--exclude", o.exclude, "logs to leave out, for example d7_r1")
      ->delimiter(',');
  command->add_option("--null-runs", o.null_runs, "as for 'rim diagnose'");
  command->add_option("--seed", o.seed, "seed of all random numbers (default 1)");
  return command;
}

} // namespace rim::experiment
