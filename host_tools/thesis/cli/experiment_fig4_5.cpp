// SPDX-License-Identifier: MIT
// rim-thesis experiment fig4.5: what the searches find in the golf domain, and for how much work.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig4_5.hpp"

namespace {

std::function<int()> add_fig4_5(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig45>>();
  rim::cli::Arguments *figure =
      app.add_subcommand("fig4.5", "golf: F1 against the work of five searches (thesis 4.2.3)");
  figure->add_option("--dims", a->experiment.dims, "features, 2 to 128 (default 2,10,30,100)")
      ->delimiter(',')
      ->check(rim::cli::range(2, 128));
  figure->add_option("--runs", a->experiment.runs, "runs per number of dimensions (default 20)")
      ->check(rim::cli::positive_number());
  a->add(figure);
  return [a] { return a->run(rim::run_fig4_5, rim::print_fig4_5); };
}

} // namespace

RIM_EXPERIMENT(fig4_5, add_fig4_5)
