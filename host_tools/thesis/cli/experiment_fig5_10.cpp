// SPDX-License-Identifier: MIT
// rim-thesis experiment fig5.10: planning under what is left uncertain, 5.3.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/fig5_10.hpp"

namespace {

std::function<int()> add_fig5_10(CLI::App &app) {
  const auto a = std::make_shared<rim::FigureArguments<rim::Fig510>>();
  CLI::App *figure = app.add_subcommand(
      "fig5.10", "GP-UCB, RIM-UCB and RIM+GP-UCB shooting at three goalies (thesis 5.3)");
  figure->add_option("--runs", a->experiment.runs, "a goalie and policy (200)")
      ->check(CLI::PositiveNumber);
  figure->add_option("--shots", a->experiment.shots, "a run (100)")->check(CLI::Range(10, 500));
  const auto shape = std::make_shared<std::string>();
  figure->add_option("--shape", *shape, "of the regions: box (default) or ellipsoid")
      ->check(CLI::IsMember({"box", "ellipsoid"}));
  const auto volume = std::make_shared<bool>();
  figure->add_flag("--by-volume", *volume, "the set of regions by volume, as the thesis's");
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
