// SPDX-License-Identifier: MIT
// rim-thesis experiment fig5.10: planning under what is left uncertain, 5.3.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig5_10.hpp"

namespace {

std::function<int()> add_fig5_10(rim::cli::Arguments &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig510>>();
  rim::cli::Arguments *figure = app.add_subcommand(
      "fig5.10", "GP-UCB, RIM-UCB and RIM+GP-UCB shooting at three goalies (thesis 5.3)");
  figure->add_option("--runs", a->experiment.runs, "runs per goalie and policy (default 200)")
      ->check(rim::cli::positive_number());
  figure->add_option("--shots", a->experiment.shots, "shots per run (default 100)")
      ->check(rim::cli::range(10, 500));
  const auto shape = std::make_shared<std::string>();
  figure->add_option("--shape", *shape, "shape of the regions: box (default) or ellipsoid")
      ->check(rim::cli::is_member({"box", "ellipsoid"}));
  const auto volume = std::make_shared<bool>();
  figure->add_flag("--by-volume", *volume, "take the set of regions by volume, as the thesis does");
  a->add(figure);
  return [a, shape, volume] {
    for (rim::GoaliePolicy &policy : a->experiment.policies) {
      policy.shape = *shape == "ellipsoid" ? RIM_EXTENT_ELLIPSOID : RIM_EXTENT_BOX;
      policy.set = *volume ? RIM_EXTENT_BY_VOLUME : RIM_EXTENT_SAMPLED;
    }
    return a->run(rim::run_fig5_10, rim::print_fig5_10);
  };
}

} // namespace

RIM_EXPERIMENT(fig5_10, add_fig5_10)
