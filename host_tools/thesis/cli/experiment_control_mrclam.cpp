// SPDX-License-Identifier: MIT
// rim-thesis experiment control_mrclam: false alarms of the interference detector on measured
// robots.
#include <cstdio>

#include "thesis/cli/experiment.hpp"
#include "thesis/cli/measured_arguments.hpp"
#include "thesis/experiment/control_mrclam.hpp"

namespace {

using rim::experiment::HeldRuns;
using rim::experiment::MeasuredOptions;

struct Arguments {
  MeasuredOptions measured;
  HeldRuns holds;
  bool halves = false;
};

std::function<int()> add_control_mrclam(rim::cli::Arguments &app) {
  const auto a = std::make_shared<Arguments>();
  rim::experiment::add_measured(
      app, "control_mrclam",
      "measured robots that nobody interferes with: false alarms of motion interference",
      a->measured)
      ->add_flag("--halves", a->halves,
                 "judge the odd-numbered robots by the even-numbered ones, and the reverse");
  return [a] {
    rim::experiment::print_control_mrclam(
        rim::experiment::run_control_mrclam(a->measured, a->holds, a->halves), stdout);
    return static_cast<int>(rim::EXIT_FINE);
  };
}

} // namespace

RIM_EXPERIMENT(control_mrclam, add_control_mrclam)
