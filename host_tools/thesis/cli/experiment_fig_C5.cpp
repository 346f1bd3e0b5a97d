// SPDX-License-Identifier: MIT
// rim-thesis experiment figC.5: motion interference, appendix C.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig_C5.hpp"

namespace {

std::function<int()> add_fig_C5(CLI::App &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::FigC5>>();
  CLI::App *figure = app.add_subcommand(
      "figC.5", "motion interference on the robot: recall, delays, false alarms (thesis app. C)");
  figure->add_option("--worlds", a->experiment.worlds, "of 29 events and 2 control runs (10)")
      ->check(CLI::PositiveNumber);
  figure->add_option("--hours", a->experiment.nominal_h, "of nominal driving a world (10)")
      ->check(CLI::NonNegativeNumber);
  rim::InterferenceOptions &o = a->experiment.options;
  figure->add_option("--quiet-hours", o.quiet_h, "nominal driving a crossing is extrapolated to")
      ->check(CLI::PositiveNumber);
  figure->add_option("--margin", o.margin, "least threshold over the largest nominal excursion")
      ->check(CLI::PositiveNumber);
  figure->add_option("--tail", o.tail, "quantile of the excursions above which a tail is fitted")
      ->check(CLI::Range(0.0, 0.99));
  figure->add_option("--tail-z", o.tail_z, "confidence of the tail's scale, standard errors")
      ->check(CLI::NonNegativeNumber);
  a->add(figure);
  return [a] { return a->run(rim::run_fig_C5, rim::print_fig_C5); };
}

} // namespace

RIM_EXPERIMENT(fig_C5, add_fig_C5)
