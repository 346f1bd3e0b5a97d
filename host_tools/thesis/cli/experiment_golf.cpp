// SPDX-License-Identifier: MIT
// rim-thesis experiment golf: the golf domain of 4.2.3.
#include "thesis/cli/experiment.hpp"
#include "thesis/experiment/golf.hpp"

namespace {

struct GolfArguments {
  rim::GolfExperiment experiment;
  std::string search = "rich";
  rim::CampaignArguments campaign;
};

std::function<int()> add_golf(rim::cli::Arguments &app) {
  const auto a = std::make_shared<GolfArguments>();
  rim::cli::Arguments *golf = app.add_subcommand(
      "golf", "F1, false alarms and shots until the alarm in the golf domain of 4.2.3");
  golf->add_option("--dims", a->experiment.dims, "features, 2 to 128 (default 2,10,30,100)")
      ->delimiter(',')
      ->check(rim::cli::range(2, 128));
  golf->add_option("--runs", a->experiment.runs, "runs with a bump (default 100)")
      ->check(rim::cli::positive_number());
  golf->add_option("--nominal", a->experiment.nominal,
                   "runs without, for the false alarms (default 400)");
  golf->add_option("--calibration", a->experiment.calibration,
                   "runs without, for the threshold (default 800; 19 are the least for 5 %)");
  golf->add_option("--seed", a->experiment.seed, "seed of the first run (default 20000)");
  golf->add_option(
      "--search", a->search,
      "work per step: flight (rim replay --flight), standard (the default of the library) or "
      "rich (the ground profile on a short log) (rich)");
  a->campaign.add(golf);
  return [a] {
    a->experiment.search = rim::parse_golf_search(a->search);
    return a->campaign.run(
        [&](const rim::Shard &shard) { return rim::run_golf_campaign(a->experiment, shard); },
        rim::print_golf);
  };
}

} // namespace

RIM_EXPERIMENT(golf, add_golf)
