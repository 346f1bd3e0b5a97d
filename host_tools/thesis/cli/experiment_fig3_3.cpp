// SPDX-License-Identifier: MIT
// rim-thesis experiment fig3.3: one RIM in the golf domain, 3.5.1.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig3_3.hpp"

namespace {

std::function<int()> add_fig3_3(CLI::App &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig33>>();
  CLI::App *figure = app.add_subcommand(
      "fig3.3", "FARO in the binary golf world: precision, recall, shots needed (thesis 3.5.1)");
  figure->add_option("--runs", a->experiment.runs, "a value of q (30)")->check(CLI::PositiveNumber);
  figure->add_option("--nominal", a->experiment.nominal, "runs without a bump (30)")
      ->check(CLI::PositiveNumber);
  figure->add_option("--shots", a->experiment.shots, "of a run without a bump (1000)")
      ->check(CLI::Range(10, 4000));
  figure->add_option("--q", a->experiment.q, "chances behind the bump (0.2,0.3,0.4,0.5)")
      ->delimiter(',')
      ->check(CLI::Range(0.01, 0.79));
  a->add(figure);
  return [a] { return a->run(rim::run_fig3_3, rim::print_fig3_3); };
}

} // namespace

RIM_EXPERIMENT(fig3_3, add_fig3_3)
