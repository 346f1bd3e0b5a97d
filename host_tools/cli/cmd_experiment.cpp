// rim experiment NAME: the thesis's tables and figures, measured again.
#include <cstdio>
#include <string>

#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "experiment/golf.hpp"
#include "util/shard.hpp"

namespace {

using rim::Campaign;

struct GolfArguments {
  rim::GolfExperiment experiment;
  std::string search = "rich";
  std::string shard = "1/1";
  std::string out;
  std::string from;
};

void add_golf(CLI::App &app, GolfArguments &a) {
  CLI::App *golf = app.add_subcommand(
      "golf", "F1, false alarms and shots until the alarm in the golf domain of 4.2.3");
  golf->add_option("--dims", a.experiment.dims, "features, 2 to 128 (2,10,30,100)")
      ->delimiter(',')
      ->check(CLI::Range(2, 128));
  golf->add_option("--runs", a.experiment.runs, "runs with a bump (100)")
      ->check(CLI::PositiveNumber);
  golf->add_option("--nominal", a.experiment.nominal, "runs without, for the false alarms (400)");
  golf->add_option("--calibration", a.experiment.calibration,
                   "runs without, for the threshold (800; 19 are the least for 5 %)");
  golf->add_option("--seed", a.experiment.seed, "of the first run (20000)");
  golf->add_option("--search", a.search,
                   "work a step: flight, standard (the default of the library) or rich (rich)");
  golf->add_option("--shard", a.shard, "I/N: only this part, needs --out");
  golf->add_option("--out", a.out, "write the units for 'rim merge' and --from");
  golf->add_option("--from", a.from, "print the tables of this file, run nothing")
      ->check(CLI::ExistingFile);
}

int run_golf_command(GolfArguments &a) {
  if (!a.from.empty()) {
    rim::print_golf(rim::read_campaign(a.from));
    return rim::EXIT_FINE;
  }
  a.experiment.search = rim::parse_golf_search(a.search);
  const rim::Shard shard = rim::parse_shard(a.shard);
  if (shard.count > 1 && a.out.empty())
    throw rim::UsageError("--shard needs --out");
  const Campaign campaign = rim::run_golf_campaign(a.experiment, shard);
  if (!a.out.empty())
    rim::write_campaign(campaign, a.out);
  if (campaign.complete())
    rim::print_golf(campaign);
  return rim::EXIT_FINE;
}

int cmd_experiment(int argc, char **argv) {
  CLI::App app{"Measure the thesis's tables and figures again.", "rim experiment"};
  app.require_subcommand(1);
  GolfArguments golf;
  add_golf(app, golf);
  app.footer(
      "Example:\n  rim experiment golf --dims 2,100 --runs 20 --nominal 40 --calibration 100");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  return run_golf_command(golf);
}

} // namespace

RIM_COMMAND(experiment, "the thesis's tables and figures", cmd_experiment)
