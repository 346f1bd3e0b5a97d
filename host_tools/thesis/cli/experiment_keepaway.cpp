// SPDX-License-Identifier: MIT
// rim-thesis experiment fig3.4, fig3.5: keepers that correct their model, 3.5.4.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/keepaway_figures.hpp"

namespace {

using Figure = rim::FigureArguments<rim::KeepawayFigure>;

std::shared_ptr<Figure> declare(rim::cli::Arguments &app, const char *name, const char *what) {
  const auto a = std::make_shared<Figure>();
  rim::cli::Arguments *figure = app.add_subcommand(name, what);
  figure->add_option("--runs", a->experiment.runs, "runs (default 40)")
      ->check(rim::cli::positive_number());
  figure->add_option("--passes", a->experiment.passes, "passes per run (default 300)")
      ->check(rim::cli::range(2, 1000));
  figure
      ->add_option("--nominal", a->experiment.learner.nominal_runs,
                   "nominal runs, for the confidence in a region (default 99)")
      ->check(rim::cli::range(1, 10000));
  a->add(figure);
  return a;
}

std::function<int()> add_fig3_4(rim::cli::Arguments &app) {
  const auto a = declare(app, "fig3.4",
                         "keepaway: failures that model correction avoids, over passes "
                         "(thesis 3.5.4)");
  return [a] { return a->run(rim::run_fig3_4, rim::print_fig3_4); };
}

std::function<int()> add_fig3_5(rim::cli::Arguments &app) {
  const auto a = declare(app, "fig3.5",
                         "keepaway: prediction accuracy inside RIMs, corrected and not "
                         "(thesis 3.5.4)");
  return [a] { return a->run(rim::run_fig3_5, rim::print_fig3_5); };
}

} // namespace

RIM_EXPERIMENT(fig3_4, add_fig3_4)
RIM_EXPERIMENT(fig3_5, add_fig3_5)
