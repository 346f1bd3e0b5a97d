// SPDX-License-Identifier: MIT
// rim-thesis experiment figB.6: free kicks, appendix B.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/figB_6.hpp"

namespace {

std::function<int()> add_figB_6(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::FigB6>>();
  rim::cli::Arguments *figure = app.add_subcommand(
      "figB.6", "regret of learning free-kick plans against three defences (thesis app. B)");
  figure->add_option("--runs", a->experiment.runs, "runs per defence (default 100)")
      ->check(rim::cli::positive_number());
  figure->add_option("--kicks", a->experiment.kicks, "kicks per run (default 40)")
      ->check(rim::cli::range(2, 500));
  a->add(figure);
  return [a] { return a->run(rim::run_figB_6, rim::print_figB_6); };
}

} // namespace

RIM_EXPERIMENT(figB_6, add_figB_6)
