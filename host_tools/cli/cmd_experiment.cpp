// rim experiment NAME: the thesis's tables and figures, measured again.
#include <cstdio>
#include <map>
#include <string>

#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "experiment/falcon.hpp"
#include "experiment/fig5_10.hpp"
#include "experiment/figB_6.hpp"
#include "experiment/fig_C5.hpp"
#include "experiment/golf.hpp"
#include "experiment/lander.hpp"
#include "experiment/measured_falcon.hpp"
#include "experiment/measured_mrclam.hpp"
#include "replay/plot.hpp"
#include "util/shard.hpp"

namespace {

using rim::Campaign;

// What every campaign takes: a shard of it, and where its units go or come from.
struct CampaignArguments {
  std::string shard = "1/1";
  std::string out;
  std::string from;

  void add(CLI::App *app) {
    app->add_option("--shard", shard, "I/N: only this part, needs --out");
    app->add_option("--out", out, "write the units for 'rim merge' and --from");
    app->add_option("--from", from, "print the tables of this file, run nothing")
        ->check(CLI::ExistingFile);
  }

  template <class Run, class Print> int run(const Run &measure, const Print &print) const {
    if (!from.empty()) {
      print(rim::read_campaign(from));
      return rim::EXIT_FINE;
    }
    const rim::Shard part = rim::parse_shard(shard);
    if (part.count > 1 && out.empty())
      throw rim::UsageError("--shard needs --out");
    const Campaign campaign = measure(part);
    if (!out.empty())
      rim::write_campaign(campaign, out);
    if (campaign.complete())
      print(campaign);
    return rim::EXIT_FINE;
  }
};

struct GolfArguments {
  rim::GolfExperiment experiment;
  std::string search = "rich";
  CampaignArguments campaign;
};

CLI::App *add_golf(CLI::App &app, GolfArguments &a) {
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
  a.campaign.add(golf);
  return golf;
}

int run_golf(GolfArguments &a) {
  a.experiment.search = rim::parse_golf_search(a.search);
  return a.campaign.run(
      [&a](const rim::Shard &shard) { return rim::run_golf_campaign(a.experiment, shard); },
      [](const Campaign &campaign) { rim::print_golf(campaign); });
}

struct LanderArguments {
  rim::experiment::LanderOptions options;
  CampaignArguments campaign;
};

CLI::App *add_lander(CLI::App &app, LanderArguments &a) {
  CLI::App *lander = app.add_subcommand(
      "lander", "false alarms and faults found on fresh landings (thesis 4.2.5, table 4.1)");
  lander->add_option("--training", a.options.training_runs, "nominal landings to train on (50)")
      ->check(CLI::Range(3, 4000));
  lander->add_option("--nominal", a.options.nominal_runs, "fresh nominal landings (200)");
  lander->add_option("--runs", a.options.fault_runs, "fresh landings a fault (10)")
      ->check(CLI::PositiveNumber);
  lander->add_option("--seed", a.options.seed,
                     "of the training landings; fresh ones are of the next seed (101)");
  lander
      ->add_option("--false-alarm", a.options.train.calibration.false_alarm,
                   "run-level false-alarm rate wished (0.05)")
      ->check(CLI::Range(0.001, 0.5));
  lander->add_flag("--thesis", a.options.thesis,
                   "also the thesis's own procedure on the same landings (about 1 s a landing)");
  a.campaign.add(lander);
  return lander;
}

int run_lander(LanderArguments &a) {
  return a.campaign.run(
      [&a](const rim::Shard &shard) {
        return rim::experiment::run_lander_campaign(a.options, shard);
      },
      [](const Campaign &campaign) { rim::experiment::print_lander_campaign(campaign, stdout); });
}

struct Fig510Arguments {
  rim::Fig510 experiment;
  std::string plot;
  CampaignArguments campaign;
};

CLI::App *add_fig5_10(CLI::App &app, Fig510Arguments &a) {
  CLI::App *figure = app.add_subcommand(
      "fig5.10", "GP-UCB, RIM-UCB and RIM+GP-UCB shooting at three goalies (thesis 5.3)");
  figure->add_option("--runs", a.experiment.runs, "a goalie and policy (40)")
      ->check(CLI::PositiveNumber);
  figure->add_option("--shots", a.experiment.shots, "a run (100)")->check(CLI::Range(10, 500));
  figure->add_option("--seed", a.experiment.seed, "of the first run (20000)");
  figure->add_option("--plot", a.plot, "the figure, FILE.svg or FILE.png");
  a.campaign.add(figure);
  return figure;
}

int run_fig5_10_command(const Fig510Arguments &a) {
  if (!a.plot.empty())
    rim::check_plot_path(a.plot);
  return a.campaign.run(
      [&a](const rim::Shard &shard) { return rim::run_fig5_10(a.experiment, shard); },
      [&a](const Campaign &campaign) { rim::print_fig5_10(campaign, a.plot); });
}

struct FigB6Arguments {
  rim::FigB6 experiment;
  std::string plot;
  CampaignArguments campaign;
};

CLI::App *add_figB_6(CLI::App &app, FigB6Arguments &a) {
  CLI::App *figure = app.add_subcommand(
      "figB.6", "regret of learning free-kick plans against three defences (thesis app. B)");
  figure->add_option("--runs", a.experiment.runs, "a defence (100)")->check(CLI::PositiveNumber);
  figure->add_option("--kicks", a.experiment.kicks, "a run (40)")->check(CLI::Range(2, 500));
  figure->add_option("--seed", a.experiment.seed, "of the first run (20000)");
  const std::map<std::string, rim::FreekickPrior> priors = {{"flat", rim::FreekickPrior::flat},
                                                            {"own", rim::FreekickPrior::own},
                                                            {"others", rim::FreekickPrior::others}};
  figure
      ->add_option(
          "--prior", a.experiment.prior,
          "expected of a plan: flat, own (the team's own model, the default), others (what "
          "it brings against the other two defences)")
      ->transform(CLI::CheckedTransformer(priors));
  figure->add_option("--plot", a.plot, "the figure, FILE.svg or FILE.png");
  a.campaign.add(figure);
  return figure;
}

int run_figB_6_command(const FigB6Arguments &a) {
  if (!a.plot.empty())
    rim::check_plot_path(a.plot);
  return a.campaign.run(
      [&a](const rim::Shard &shard) { return rim::run_figB_6(a.experiment, shard); },
      [&a](const Campaign &campaign) { rim::print_figB_6(campaign, a.plot); });
}

struct FigC5Arguments {
  rim::FigC5 experiment;
  std::string plot;
  CampaignArguments campaign;
};

CLI::App *add_fig_C5(CLI::App &app, FigC5Arguments &a) {
  CLI::App *figure = app.add_subcommand(
      "figC.5", "motion interference on the robot: recall, delays, false alarms (thesis app. C)");
  figure->add_option("--worlds", a.experiment.worlds, "of 29 events and 2 control runs (10)")
      ->check(CLI::PositiveNumber);
  figure->add_option("--hours", a.experiment.nominal_h, "of nominal driving a world (10)")
      ->check(CLI::NonNegativeNumber);
  figure->add_option("--seed", a.experiment.seed, "of the first world (20000)");
  figure->add_option("--plot", a.plot, "the figure, FILE.svg or FILE.png");
  a.campaign.add(figure);
  return figure;
}

int run_fig_C5_command(const FigC5Arguments &a) {
  if (!a.plot.empty())
    rim::check_plot_path(a.plot);
  return a.campaign.run(
      [&a](const rim::Shard &shard) { return rim::run_fig_C5(a.experiment, shard); },
      [&a](const Campaign &campaign) { rim::print_fig_C5(campaign, a.plot); });
}

CLI::App *add_falcon(CLI::App &app, rim::experiment::FalconOptions &o) {
  CLI::App *falcon = app.add_subcommand(
      "falcon", "measured Falcon 9 landings: one left out, the others trained on, faults put in");
  falcon->add_option("--data", o.data, "folder of the logs (../shared/measured/falcon9)");
  falcon->add_option("--exclude", o.exclude, "missions not to use, say nrol76")->delimiter(',');
  falcon->add_option("--false-alarm", o.train.calibration.false_alarm,
                     "wished run-level false-alarm rate (0.05)");
  falcon->add_option("--block-seconds", o.train.block_s, "length of an observation (0.5)")
      ->check(CLI::PositiveNumber);
  return falcon;
}

int run_falcon_command(const rim::experiment::FalconOptions &o) {
  if (rim::experiment::falcon_folder(o).empty()) {
    std::printf("skipped: no folder %s\n",
                o.data.empty() ? "../shared/measured/falcon9 beside the source" : o.data.c_str());
    return o.data.empty() ? rim::EXIT_FINE : rim::EXIT_DATA;
  }
  rim::experiment::print_falcon(rim::experiment::run_falcon(o), stdout);
  if (o.exclude.empty()) {
    std::printf("\nWithout nrol76, whose altitude is shown to 1 km only:\n\n");
    rim::experiment::FalconOptions alike = o;
    alike.exclude = {"nrol76"};
    rim::experiment::print_falcon(rim::experiment::run_falcon(alike), stdout);
  }
  return rim::EXIT_FINE;
}

CLI::App *add_measured(CLI::App &app, const char *name, const char *description,
                       rim::experiment::MeasuredOptions &o) {
  CLI::App *command = app.add_subcommand(name, description);
  command->add_option("--data", o.data, "folder of the logs (in ../shared/measured)");
  command->add_option("--exclude", o.exclude, "logs not to use, say d7_r1")->delimiter(',');
  command->add_option("--null-runs", o.null_runs, "as for 'rim diagnose'");
  command->add_option("--seed", o.seed, "of all random numbers (1)");
  return command;
}

int run_measured_falcon_command(const rim::experiment::MeasuredOptions &o) {
  const int skipped = rim::experiment::skip_without(o, "falcon9");
  if (skipped >= 0)
    return skipped;
  rim::experiment::print_measured_falcon(rim::experiment::run_measured_falcon(o), o, stdout);
  return rim::EXIT_FINE;
}

int run_measured_mrclam_command(const rim::experiment::MeasuredOptions &o) {
  const int skipped = rim::experiment::skip_without(o, "mrclam");
  if (skipped >= 0)
    return skipped;
  rim::experiment::print_measured_mrclam(rim::experiment::run_measured_mrclam(o), stdout);
  return rim::EXIT_FINE;
}

int cmd_experiment(int argc, char **argv) {
  CLI::App app{"Measure the thesis's tables and figures again.", "rim experiment"};
  app.require_subcommand(1);
  GolfArguments golf;
  LanderArguments lander;
  const CLI::App *golf_command = add_golf(app, golf);
  add_lander(app, lander);
  rim::experiment::FalconOptions falcon;
  const CLI::App *falcon_command = add_falcon(app, falcon);
  Fig510Arguments fig5_10;
  const CLI::App *fig5_10_command = add_fig5_10(app, fig5_10);
  FigC5Arguments fig_C5;
  const CLI::App *fig_C5_command = add_fig_C5(app, fig_C5);
  FigB6Arguments figB_6;
  const CLI::App *figB_6_command = add_figB_6(app, figB_6);
  rim::experiment::MeasuredOptions flights, robots;
  CLI::App *flights_command = add_measured(app, "measured_falcon",
                                           "measured Falcon 9 flights: a point mass extended by "
                                           "the others' findings, on the one left out",
                                           flights);
  flights_command->add_option("--horizon", flights.horizon_s, "of the roll-out, s (10)")
      ->check(CLI::PositiveNumber);
  const CLI::App *robots_command = add_measured(
      app, "measured_mrclam",
      "measured robots: a unicycle extended by what some robots show, on the others", robots);
  app.footer("Examples:\n"
             "  rim experiment golf --dims 2,100 --runs 20 --nominal 40 --calibration 100\n"
             "  rim experiment lander --nominal 40 --runs 3");
  if (!rim::parse_arguments(app, argc, argv))
    return rim::EXIT_FINE;
  if (falcon_command->parsed())
    return run_falcon_command(falcon);
  if (flights_command->parsed())
    return run_measured_falcon_command(flights);
  if (robots_command->parsed())
    return run_measured_mrclam_command(robots);
  if (fig_C5_command->parsed())
    return run_fig_C5_command(fig_C5);
  if (fig5_10_command->parsed())
    return run_fig5_10_command(fig5_10);
  if (figB_6_command->parsed())
    return run_figB_6_command(figB_6);
  return golf_command->parsed() ? run_golf(golf) : run_lander(lander);
}

} // namespace

RIM_COMMAND(experiment, "the thesis's tables and figures", cmd_experiment)
