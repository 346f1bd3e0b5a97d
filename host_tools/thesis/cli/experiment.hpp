// SPDX-License-Identifier: MIT
// thesis/cli/experiment.hpp - how an experiment makes itself known to 'rim-thesis experiment'.
//
// In experiment_x.cpp, at namespace scope:
//   namespace { std::function<int()> add_x(rim::cli::Arguments &app) { ... } }
//   RIM_EXPERIMENT(x, add_x)
// add_x adds one subcommand with its options and returns what it does once the command line has
// been read: an exit code, or an exception, as for a command (cli/command.hpp). They are listed in
// the order of x.
#pragma once

#include "cli/arguments.hpp"
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "cli/command.hpp"
#include "thesis/shard.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"

namespace rim {

struct ExperimentCommand {
  std::string name;
  std::function<int()> (*add)(rim::cli::Arguments &app);
};

std::vector<ExperimentCommand> &experiment_commands();

struct ExperimentRegistration {
  ExperimentRegistration(const char *name, std::function<int()> (*add)(rim::cli::Arguments &)) {
    experiment_commands().push_back({name, add});
  }
};

// What every campaign takes: a shard of it, and where its units go or come from.
struct CampaignArguments {
  std::string shard = "1/1";
  std::string out;
  std::string from;

  void add(rim::cli::Arguments *app) {
    app->add_option("--shard", shard, "I/N: run only part I of N; needs --out");
    app->add_option("--out", out, "write the results for 'rim-thesis merge' and --from");
    app->add_option("--from", from, "print the tables of this file and run nothing")
        ->check(rim::cli::existing_file());
  }

  // measure(shard) returns the campaign, print(campaign) shows a complete one.
  template <class Run, class Print> int run(const Run &measure, const Print &print) const {
    if (!from.empty()) {
      print(read_campaign(from));
      return EXIT_FINE;
    }
    const Shard part = parse_shard(shard);
    if (part.count > 1 && out.empty())
      throw UsageError("--shard needs --out");
    const Campaign campaign = measure(part);
    if (!out.empty())
      write_campaign(campaign, out);
    if (campaign.complete())
      print(campaign);
    return EXIT_FINE;
  }
};

// A campaign that also draws its figure.
template <class Options> struct FigureArguments {
  Options experiment;
  std::string plot;
  CampaignArguments campaign;

  void add(rim::cli::Arguments *app) {
    app->add_option("--seed", experiment.seed,
                    "seed of the first run (default " + std::to_string(experiment.seed) + ")");
    app->add_option("--plot", plot, "draw the figure into FILE.svg or FILE.png");
    campaign.add(app);
  }

  // measure(options, shard) returns the campaign, print(campaign, plot) shows it.
  template <class Run, class Print> int run(const Run &measure, const Print &print) const {
    if (!plot.empty())
      check_plot_path(plot);
    return campaign.run([&](const Shard &shard) { return measure(experiment, shard); },
                        [&](const Campaign &c) { print(c, plot); });
  }
};

} // namespace rim

#define RIM_EXPERIMENT(name, function)                                                             \
  static const rim::ExperimentRegistration rim_experiment_##name{#name, function};
