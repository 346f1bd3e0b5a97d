// SPDX-License-Identifier: MIT
// rim-thesis experiment figB.6: free kicks, appendix B.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/figB_6.hpp"

namespace {

std::function<int()> add_figB_6(CLI::App &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::FigB6>>();
  CLI::App *figure = app.add_subcommand(
      "figB.6", "regret of learning free-kick plans against three defences (thesis app. B)");
  figure->add_option("--runs", a->experiment.runs, "a defence (100)")->check(CLI::PositiveNumber);
  figure->add_option("--kicks", a->experiment.kicks, "a run (40)")->check(CLI::Range(2, 500));
  a->add(figure);
  return [a] { return a->run(rim::run_figB_6, rim::print_figB_6); };
}

} // namespace

RIM_EXPERIMENT(figB_6, add_figB_6)
