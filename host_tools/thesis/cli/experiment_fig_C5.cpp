// SPDX-License-Identifier: MIT
// rim-thesis experiment figC.5: motion interference, appendix C.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig_C5.hpp"

namespace {

std::function<int()> add_fig_C5(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::FigC5>>();
  rim::cli::Arguments *figure = app.add_subcommand(
      "figC.5", "motion interference on the robot: recall, delays, false alarms (thesis app. C)");
  figure
      ->add_option("--worlds", a->experiment.worlds,
                   "number of worlds, each with 29 events and 2 control runs (default 10)")
      ->check(rim::cli::positive_number());
  figure
      ->add_option("--hours", a->experiment.nominal_h,
                   "hours of nominal driving per world (default 10)")
      ->check(rim::cli::non_negative_number());
  rim::InterferenceOptions &o = a->experiment.options;
  figure
      ->add_option("--quiet-hours", o.quiet_h,
                   "hours of nominal driving until a threshold is crossed once")
      ->check(rim::cli::positive_number());
  figure->add_option("--margin", o.margin, "least threshold over the largest nominal excursion")
      ->check(rim::cli::positive_number());
  figure->add_option("--tail", o.tail, "quantile of the excursions above which a tail is fitted")
      ->check(rim::cli::range(0.0, 0.99));
  figure->add_option("--tail-z", o.tail_z, "confidence of the tail's scale, standard errors")
      ->check(rim::cli::non_negative_number());
  a->add(figure);
  return [a] { return a->run(rim::run_fig_C5, rim::print_fig_C5); };
}

} // namespace

RIM_EXPERIMENT(fig_C5, add_fig_C5)
