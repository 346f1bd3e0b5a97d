// SPDX-License-Identifier: MIT
// rim-thesis experiment falcon, measured_falcon, measured_mrclam: measured landings and robots.
#include <cstdio>

#include "thesis/cli/experiment.hpp"
#include "thesis/cli/measured_arguments.hpp"
#include "thesis/experiment/falcon.hpp"
#include "thesis/experiment/measured_falcon.hpp"
#include "thesis/experiment/measured_mrclam.hpp"

namespace {

using rim::experiment::add_measured;
using rim::experiment::FalconOptions;
using rim::experiment::MeasuredOptions;

int judge_falcon(const FalconOptions &o) {
  rim::experiment::print_falcon(rim::experiment::run_falcon(o), stdout);
  if (o.exclude.empty()) {
    std::printf("\nWithout nrol76, whose altitude is shown to 1 km only:\n\n");
    FalconOptions alike = o;
    alike.exclude = {"nrol76"};
    rim::experiment::print_falcon(rim::experiment::run_falcon(alike), stdout);
  }
  return rim::EXIT_FINE;
}

std::function<int()> add_falcon(rim::cli::Arguments &app) {
  const auto o = std::make_shared<FalconOptions>();
  rim::cli::Arguments *falcon = app.add_subcommand(
      "falcon", "measured Falcon 9 landings: one left out, the others trained on, faults put in");
  falcon->add_option("--data", o->data, "folder of the logs and missions.csv")->required();
  falcon->add_option("--exclude", o->exclude, "missions not to use, say nrol76")->delimiter(',');
  falcon->add_option("--false-alarm", o->train.calibration.false_alarm,
                     "largest acceptable share of healthy flights with any alarm (default 0.05)");
  falcon->add_option("--block-seconds", o->train.blocking.block_s, "length of an observation (0.5)")
      ->check(rim::cli::positive_number());
  return [o] { return judge_falcon(*o); };
}

std::function<int()> add_measured_falcon(rim::cli::Arguments &app) {
  const auto o = std::make_shared<MeasuredOptions>();
  add_measured(app, "measured_falcon",
               "measured Falcon 9 flights: a point mass extended by the others' findings, on the "
               "one left out",
               *o)
      ->add_option("--horizon", o->horizon_s, "horizon of the roll-out, s (default 10)")
      ->check(rim::cli::positive_number());
  return [o] {
    rim::experiment::print_measured_falcon(rim::experiment::run_measured_falcon(*o), *o, stdout);
    return static_cast<int>(rim::EXIT_FINE);
  };
}

std::function<int()> add_measured_mrclam(rim::cli::Arguments &app) {
  const auto o = std::make_shared<MeasuredOptions>();
  add_measured(app, "measured_mrclam",
               "measured robots: a unicycle extended by what some robots show, on the others", *o);
  return [o] {
    rim::experiment::print_measured_mrclam(rim::experiment::run_measured_mrclam(*o), stdout);
    return static_cast<int>(rim::EXIT_FINE);
  };
}

} // namespace

RIM_EXPERIMENT(falcon, add_falcon)
RIM_EXPERIMENT(measured_falcon, add_measured_falcon)
RIM_EXPERIMENT(measured_mrclam, add_measured_mrclam)
