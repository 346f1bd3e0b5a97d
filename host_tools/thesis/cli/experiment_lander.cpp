// SPDX-License-Identifier: MIT
// rim-thesis experiment lander: the landings of 4.2.5.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/lander.hpp"

namespace {

struct LanderArguments {
  rim::experiment::LanderOptions options;
  rim::CampaignArguments campaign;
};

std::function<int()> add_lander(rim::cli::Arguments &app) {
  const auto a = std::make_shared<LanderArguments>();
  rim::cli::Arguments *lander = app.add_subcommand(
      "lander", "false alarms and faults found on fresh landings (thesis 4.2.5, table 4.1)");
  lander
      ->add_option("--training", a->options.training_runs,
                   "nominal landings to train on (default 50)")
      ->check(rim::cli::range(3, 4000));
  lander->add_option("--nominal", a->options.nominal_runs, "fresh nominal landings (default 200)");
  lander->add_option("--runs", a->options.fault_runs, "fresh landings per fault (default 10)")
      ->check(rim::cli::positive_number());
  lander->add_option("--seed", a->options.seed,
                     "seed of the training landings; fresh ones have the next seed (default 101)");
  lander
      ->add_option("--false-alarm", a->options.train.calibration.false_alarm,
                   "largest acceptable share of nominal landings with any alarm (default 0.05)")
      ->check(rim::cli::range(0.001, 0.5));
  lander->add_flag("--flight", a->options.train.calibration.flight,
                   "search less per row, for small processors (rim train --flight)");
  lander->add_flag("--thesis", a->options.thesis,
                   "also the thesis's own procedure on the same landings (about 1 s a landing)");
  a->campaign.add(lander);
  return [a] {
    return a->campaign.run(
        [&](const rim::Shard &shard) {
          return rim::experiment::run_lander_campaign(a->options, shard);
        },
        [](const rim::Campaign &c) { rim::experiment::print_lander_campaign(c, stdout); });
  };
}

} // namespace

RIM_EXPERIMENT(lander, add_lander)
