// SPDX-License-Identifier: MIT
// rim-thesis experiment table6.1: what others would use, beside ours.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/table6_1.hpp"

namespace {

std::function<int()> add_table6_1(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Table61>>();
  rim::cli::Arguments *table = app.add_subcommand(
      "table6.1", "seven other detectors and ours on golf and on the service robot");
  table->add_option("--runs", a->experiment.runs, "runs with each effect (default 20)")
      ->check(rim::cli::positive_number());
  table
      ->add_option(
          "--calibration", a->experiment.calibration,
          "nominal runs per domain, for the thresholds (default 59; 19 are the least for 5 %)")
      ->check(rim::cli::positive_number());
  a->add(table);
  return [a] { return a->run(rim::run_table6_1, rim::print_table6_1); };
}

} // namespace

RIM_EXPERIMENT(table6_1, add_table6_1)
