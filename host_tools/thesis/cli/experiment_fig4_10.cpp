// SPDX-License-Identifier: MIT
// rim-thesis experiment fig4.10, fig4.11: the service robot's failures in many dimensions.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig4_10.hpp"

namespace {

std::function<int()> add_figure(rim::cli::Arguments &app, const char *name, const char *text,
                                rim::CobotCase failure) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig410>>();
  a->experiment.failure = failure;
  rim::cli::Arguments *figure = app.add_subcommand(name, text);
  figure
      ->add_option("--dims", a->experiment.dims,
                   "dimensions of the context, 7 or 15 to 100 (default 7,15,30,100)")
      ->delimiter(',')
      ->check(rim::cli::range(7, 100));
  figure
      ->add_option("--runs", a->experiment.runs,
                   "drives for each number of dimensions (default 20)")
      ->check(rim::cli::positive_number());
  figure->add_flag("!--no-searches", a->experiment.searches, "leave out the other searches");
  a->add(figure);
  return [a] { return a->run(rim::run_fig4_10, rim::print_fig4_10); };
}

std::function<int()> add_fig4_10(rim::cli::Arguments &app) {
  return add_figure(app, "fig4.10", "corridor failure in 7 to 100 dimensions: F1 (thesis 4.2.4)",
                    rim::CobotCase::corridor);
}

std::function<int()> add_fig4_11(rim::cli::Arguments &app) {
  return add_figure(app, "fig4.11", "left-turn failure in 7 to 100 dimensions: F1 (thesis 4.2.4)",
                    rim::CobotCase::left_turn);
}

} // namespace

RIM_EXPERIMENT(fig4_10, add_fig4_10)
RIM_EXPERIMENT(fig4_11, add_fig4_11)
