// SPDX-License-Identifier: MIT
// rim-thesis experiment fig3.3: one RIM in the golf domain, 3.5.1.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig3_3.hpp"

namespace {

std::function<int()> add_fig3_3(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig33>>();
  rim::cli::Arguments *figure = app.add_subcommand(
      "fig3.3", "FARO in the binary golf world: precision, recall, shots needed (thesis 3.5.1)");
  figure->add_option("--runs", a->experiment.runs, "runs per value of q (default 30)")
      ->check(rim::cli::positive_number());
  figure->add_option("--nominal", a->experiment.nominal, "runs without a bump (default 30)")
      ->check(rim::cli::positive_number());
  figure->add_option("--shots", a->experiment.shots, "shots per run without a bump (default 1000)")
      ->check(rim::cli::range(10, 4000));
  figure->add_option("--q", a->experiment.q, "chances behind the bump (0.2,0.3,0.4,0.5)")
      ->delimiter(',')
      ->check(rim::cli::range(0.01, 0.79));
  a->add(figure);
  return [a] { return a->run(rim::run_fig3_3, rim::print_fig3_3); };
}

} // namespace

RIM_EXPERIMENT(fig3_3, add_fig3_3)
