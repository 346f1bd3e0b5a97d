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

std::function<int()> add_control_mrclam(CLI::App &app) {
  const auto a = std::make_shared<Arguments>();
  rim::experiment::add_measured(
      app, "control_mrclam",
      "measured robots that nobody interferes with: false alarms of motion interference",
      a->measured)
      ->add_flag("--halves", a->halves, "robots of odd number by those of even number, and back");
  return [a] {
    const int skipped = rim::experiment::skip_without(a->measured, "mrclam");
    if (skipped >= 0)
      return skipped;
    rim::experiment::print_control_mrclam(
        rim::experiment::run_control_mrclam(a->measured, a->holds, a->halves), stdout);
    return static_cast<int>(rim::EXIT_FINE);
  };
}

} // namespace

RIM_EXPERIMENT(control_mrclam, add_control_mrclam)
