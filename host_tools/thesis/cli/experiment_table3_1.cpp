// SPDX-License-Identifier: MIT
// rim-thesis experiment table3.1: four failures of the service robot.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/table3_1.hpp"

namespace {

std::function<int()> add_table3_1(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Table31>>();
  rim::cli::Arguments *table = app.add_subcommand(
      "table3.1", "failures of the service robot: points until the alarm, precision, recall");
  table->add_option("--runs", a->experiment.runs, "drives with each failure (default 20)")
      ->check(rim::cli::positive_number());
  table->add_option("--nominal", a->experiment.nominal,
                    "drives without, for false alarms (default 60)");
  table->add_option("--calibration", a->experiment.calibration,
                    "drives without, for the threshold (default 99; 19 are the least for 5 %)");
  table->add_flag("!--no-thesis", a->experiment.thesis, "leave out the thesis's own procedure");
  a->add(table);
  return [a] { return a->run(rim::run_table3_1, rim::print_table3_1); };
}

} // namespace

RIM_EXPERIMENT(table3_1, add_table3_1)
