// SPDX-License-Identifier: MIT
// rim simulate: logs of a simulated vehicle, with effects hidden in them where asked.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "diagnose/apply_extension.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"
#include "util/version.hpp"
#include "world/cobot_log.hpp"
#include "world/golf_params.hpp"
#include "world/keepaway_log.hpp"
#include "world/lander_params.hpp"
#include "world/recording.hpp"
#include "world/soccer_log.hpp"

#include <cstdio>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <map>

namespace {

using rim::world::Recording;

constexpr std::size_t kShots = 100; // of a goalie or freekick run, unless --rows says otherwise

struct Options {
  std::string world, out, params, truth, labels, variant = "continuous", goalie = "region",
                                                 defence = "time";
  std::vector<std::string> effects, extensions;
  std::uint64_t runs = 1, first = 1, seed = 1;
  std::size_t rows = 0;
  rim::GolfOptions golf;
  bool no_bump = false;
  bool encoders = false;
};

const char *const kFooter =
    "The same seed and run number give the same run, whatever --runs, --first and the number of\n"
    "threads. DIR also gets simulate.toml with the version, the seed and every parameter, but "
    "never\n"
    "the effects: only --truth writes which rows they act on. An effect is a TOML file or the "
    "name\n"
    "of one in data/effects (02_thrust_loss); data/README.md says how to write one.\n\n"
    "Example: five healthy landings and five with a hidden fault, and what a golf robot sees\n"
    "  rim simulate lander --out nominal --runs 5 --seed 1\n"
    "  rim simulate lander --out faulty --runs 5 --seed 1 --first 101 \\\n"
    "      --effect 10_radar_high --truth truth.csv\n"
    "  rim simulate golf --out golf --runs 1 --seed 7 --dims 10";

void declare_golf(rim::cli::Arguments &app, Options &o) {
  app.add_option("--variant", o.variant, "golf: continuous (default) or binary")
      ->check(rim::cli::is_member({"continuous", "binary"}));
  app.add_option("--anomalous", o.golf.anomalous,
                 "golf: end a run after this many shots from behind the bump (default 30)")
      ->check(rim::cli::range(1, 1000000));
  app.add_flag("--better", o.golf.better,
               "golf: the bump improves shots by as much as it would make them worse");
  app.add_flag("--no-bump", o.no_bump, "golf: leave the bump out; a run ends after --shots");
  app.add_option("--shots", o.golf.shots,
                 "golf: shots per run with --no-bump (default 1000), else the most shots per run")
      ->check(rim::cli::range(1, 10000000));
}

void declare(rim::cli::Arguments &app, Options &o) {
  app.add_option("WORLD", o.world, "lander, golf, cobot, keepaway, goalie or freekick")
      ->required()
      ->check(rim::cli::is_member({"lander", "golf", "cobot", "keepaway", "goalie", "freekick"}));
  app.add_option("--out", o.out, "folder for the logs, made if missing: DIR/run_0001.csv ...")
      ->required()
      ->type_name("DIR")
      ->writes();
  app.add_option("--runs", o.runs, "number of runs (default 1)")
      ->check(rim::cli::range(1, 1000000));
  app.add_option("--first", o.first, "number of the first run (default 1)")
      ->check(rim::cli::range(1, 100000000));
  app.add_option("--seed", o.seed, "seed of all random numbers (default 1)")
      ->check(rim::cli::non_negative_number());
  app.add_option("--effect", o.effects, "hide an effect (lander, cobot); may be repeated")
      ->type_name("FILE.toml")
      ->repeated()
      ->reads();
  app.add_option("--extension", o.extensions,
                 "add the terms that rim diagnose found to the predictions in the logs (golf:\n"
                 "m.reward, sd.reward); may be repeated")
      ->type_name("FILE.toml")
      ->repeated()
      ->reads();
  app.add_option("--params", o.params, "parameters that replace those in data/WORLD.toml")
      ->type_name("FILE.toml")
      ->reads();
  app.add_option("--rows", o.rows,
                 "end every log after this many rows (default: whole runs; keepaway: 300 passes)")
      ->check(rim::cli::non_negative_number());
  app.add_option(
         "--truth", o.truth,
         "write the rows on which an effect acts (CSV log,row,t_s,finding) into one file, or\n"
         "one file per log into a folder")
      ->type_name("FILE|DIR")
      ->writes();
  app.add_option("--labels", o.labels,
                 "cobot: write the times of interference (CSV log,start_s,end_s,kind)")
      ->type_name("FILE")
      ->writes();
  app.add_flag("--encoders", o.encoders,
               "cobot: log wheel counters instead of velocities and their predictions");
  app.add_option("--dims", o.golf.dims,
                 "dimensions of the context; golf: default 2, cobot: 7 (default), 15, 30, 100")
      ->check(rim::cli::range(2, 999));
  app.add_option("--goalie", o.goalie,
                 "goalie: nominal, region (default), obstructed or overshoot (thesis 5.3.2)");
  app.add_option("--defence", o.defence,
                 "freekick: time (default), angle or combined (thesis B.4.1)");
  declare_golf(app, o);
  app.footer(kFooter);
}

void check_soccer(const rim::cli::Arguments &app, const Options &o) {
  const bool is_soccer = o.world == "goalie" || o.world == "freekick";
  if (is_soccer && !o.effects.empty())
    throw rim::UsageError("--effect: the " + o.world +
                          " world has none; its opponent is its effect");
  for (const char *world : {"goalie", "defence"}) {
    const bool is_its = o.world == (std::string(world) == "goalie" ? "goalie" : "freekick");
    if (!is_its && app.count(std::string("--") + world) > 0)
      throw rim::UsageError(std::string("--") + world + ": the " + o.world + " world has none");
  }
}

void check_cobot(const rim::cli::Arguments &app, Options &o) {
  for (const char *option : {"--labels", "--encoders"}) {
    if (o.world != "cobot" && app.count(option) > 0)
      throw rim::UsageError(std::string(option) + ": only the cobot world has it");
  }
  if (o.world != "cobot")
    return;
  if (o.encoders && !o.extensions.empty())
    throw rim::UsageError("--extension: --encoders leaves no prediction that it could be added to");
  if (app.count("--dims") == 0)
    o.golf.dims = 7;
  if (o.golf.dims != 7 && o.golf.dims < 15)
    throw rim::UsageError("--dims: the cobot's context has 7 or 15 dimensions and more");
  if (o.rows == 0)
    o.rows = 3600; // three minutes, as in the thesis
}

void check(const rim::cli::Arguments &app, Options &o) {
  if (o.world == "golf" && !o.effects.empty())
    throw rim::UsageError("--effect: the golf world has none; its bump is its effect");
  if (o.world == "keepaway" && !o.effects.empty())
    throw rim::UsageError("--effect: the keepaway world has none; its takers' habits, [[habit]] in "
                          "--params, are its effects");
  if (o.world == "keepaway" && o.rows == 0)
    o.rows = 300; // passes of a run, as in the thesis's figures
  if (o.world == "lander" && !o.extensions.empty())
    throw rim::UsageError("--extension: the lander's logs carry no prediction that it could be "
                          "added to; rim diagnose --world lander takes it");
  check_soccer(app, o);
  for (const char *option :
       {"--dims", "--variant", "--anomalous", "--no-bump", "--better", "--shots"}) {
    if (o.world != "golf" && app.count(option) > 0 &&
        (o.world != "cobot" || std::string(option) != "--dims"))
      throw rim::UsageError(std::string(option) + ": only the golf world has it");
  }
  check_cobot(app, o);
  if (o.no_bump && app.count("--anomalous") > 0)
    throw rim::UsageError("--anomalous: without a bump no shot is anomalous; use --shots");
  if (o.golf.better && (o.no_bump || o.variant == "binary"))
    throw rim::UsageError("--better: needs a bump and the continuous variant");
  o.golf.bump = !o.no_bump;
  if (o.golf.bump && app.count("--shots") > 0)
    o.golf.max_shots = o.golf.shots;
  if (o.variant == "binary")
    o.golf.variant = rim::GolfVariant::binary;
}

// Of one run of those asked for.
bool is_its_log(const Options &o, const std::string &name) {
  unsigned long long run = 0;
  return std::sscanf(name.c_str(), "run_%llu.csv", &run) == 1 && run >= o.first &&
         run - o.first < o.runs && rim::world::run_path("", run) == name;
}

// What is written beside the logs must not take the place of one.
void check_beside(const Options &o, const char *option, const std::string &given) {
  const std::filesystem::path path(given);
  const std::string name = path.filename().string();
  const std::string folder = path.has_parent_path() ? path.parent_path().string() : ".";
  if ((name == "simulate.toml" || is_its_log(o, name)) && rim::cli::name_same_file(folder, o.out))
    throw rim::UsageError(std::string(option) + " " + given + ": --out " + o.out +
                          " writes this file itself");
}

// A file as given; else the name of a shipped effect.
std::string effect_path(const std::string &given) {
  if (std::filesystem::exists(given) || given.find('/') != std::string::npos)
    return given;
  const bool has_ending = given.size() > 5 && given.substr(given.size() - 5) == ".toml";
  return rim::data_path("effects/" + given + (has_ending ? "" : ".toml"));
}

// What makes run k, and the parameters it is made from.
struct World {
  std::function<Recording(std::uint64_t)> run;
  std::string parameters;
  // Interference of run k, made again; empty: the world has none.
  std::function<std::vector<rim::world::CobotInterval>(std::uint64_t)> intervals = {};
};

World lander_world(const Options &o) {
  const auto params = rim::world::read_lander_params(rim::data_path("lander.toml"), o.params);
  std::vector<rim::world::Effect> effects;
  for (const std::string &given : o.effects)
    effects.push_back(rim::world::read_effect(effect_path(given), params));
  return {[o, params, effects](std::uint64_t k) {
            return rim::world::record_lander(
                rim::world::simulate_lander(params, effects, o.seed, k), o.rows);
          },
          rim::world::lander_params_toml(params)};
}

World golf_world(const Options &o) {
  const auto params = rim::world::read_golf_params(rim::data_path("golf.toml"), o.params);
  return {[o, params](std::uint64_t k) {
            try {
              rim::Golf golf(params, o.golf, o.seed, k);
              return rim::world::record_golf(golf, o.golf.dims, o.rows);
            } catch (const std::invalid_argument &error) {
              throw rim::DataError(o.params + ": " + error.what());
            }
          },
          rim::world::golf_params_toml(params)};
}

World cobot_world(const Options &o) {
  rim::world::CobotParams params;
  rim::world::CobotMap map;
  rim::world::read_cobot(rim::data_path("cobot.toml"), o.params, &params, &map);
  std::vector<rim::world::CobotEffect> effects;
  for (const std::string &path : o.effects) {
    const auto read = rim::world::read_cobot_effects(path, map);
    effects.insert(effects.end(), read.begin(), read.end());
  }
  World world;
  world.run = [o, params, map, effects](std::uint64_t k) {
    rim::world::Cobot cobot(params, map, effects, o.seed, k);
    return rim::world::record_cobot(cobot, params, o.golf.dims, o.rows, o.encoders);
  };
  world.intervals = [o, params, map, effects](std::uint64_t k) {
    rim::world::Cobot cobot(params, map, effects, o.seed, k);
    for (std::size_t row = 0; row <= o.rows; ++row)
      cobot.next();
    return cobot.intervals();
  };
  world.parameters = rim::world::cobot_params_toml(params);
  return world;
}

World keepaway_world(const Options &o) {
  const auto params = rim::world::read_keepaway_params(rim::data_path("keepaway.toml"), o.params);
  return {[o, params](std::uint64_t k) {
            rim::world::Keepaway keepaway(params, o.seed, k);
            return rim::world::record_keepaway(keepaway, params, o.rows);
          },
          rim::world::keepaway_params_toml(params)};
}

// Runs are of seeds of their own: the worlds' streams know no run.
std::uint64_t seed_of(const Options &o, std::uint64_t run) { return o.seed * 1000003u + run; }

World goalie_world(const Options &o) {
  const auto params = rim::read_goalie_params(rim::data_path("goalie.toml"), o.params);
  const rim::GoalieBehaviour behaviour = rim::parse_goalie(o.goalie);
  return {[o, params, behaviour](std::uint64_t k) {
            return rim::world::record_goalie(params, behaviour, o.rows > 0 ? o.rows : kShots,
                                             seed_of(o, k));
          },
          rim::goalie_params_toml(params)};
}

World freekick_world(const Options &o) {
  const auto params = rim::read_freekick_params(rim::data_path("freekick.toml"), o.params);
  const rim::Defence defence = rim::parse_defence(o.defence);
  return {[o, params, defence](std::uint64_t k) {
            return rim::world::record_freekick(params, defence, o.rows > 0 ? o.rows : kShots,
                                               seed_of(o, k));
          },
          rim::freekick_params_toml(params)};
}

World make_world(const Options &o) {
  static const std::map<std::string, World (*)(const Options &)> makers = {
      {"lander", lander_world},     {"golf", golf_world},     {"cobot", cobot_world},
      {"keepaway", keepaway_world}, {"goalie", goalie_world}, {"freekick", freekick_world}};
  return makers.at(o.world)(o);
}

void write_labels(const Options &o, const World &world) {
  std::vector<rim::world::InterferenceLabels> labels(o.runs);
  rim::parallel_for(o.runs, [&](std::size_t i) {
    labels[i] = {rim::world::run_path(o.out, o.first + i), world.intervals(o.first + i)};
  });
  rim::world::write_labels(labels, o.labels);
}

std::string record_of(const Options &o, const World &world) {
  std::string text =
      fmt::format("# rim simulate {}, rimwatch {}\n# --seed {} --first {} --runs {} --rows {}",
                  o.world, RIM_VERSION, o.seed, o.first, o.runs, o.rows);
  if (o.world == "golf") {
    text += " --dims " + std::to_string(o.golf.dims) + " --variant " + o.variant +
            (o.golf.bump ? " --anomalous " + std::to_string(o.golf.anomalous)
                         : " --no-bump --shots " + std::to_string(o.golf.shots));
    text += o.golf.better ? " --better" : "";
  }
  if (o.world == "goalie")
    text += " --goalie " + o.goalie;
  if (o.world == "freekick")
    text += " --defence " + o.defence;
  if (o.world == "cobot")
    text += " --dims " + std::to_string(o.golf.dims) + (o.encoders ? " --encoders" : "");
  for (const std::string &path : o.extensions)
    text += " --extension " + path;
  return text + "\n# All parameters follow; the file can be given as --params.\n\n" +
         world.parameters;
}

// The record without the numbers of the runs: more of the same may be added to a folder.
std::string recipe_of(std::string record) {
  const std::size_t from = record.find(" --first "), to = record.find(" --rows ");
  return from < to && to != std::string::npos ? record.erase(from, to - from) : record;
}

// One record stands for all runs of a folder: where others stay in it that were made by something
// else, it says so.
void warn_of_others(const Options &o, const std::string &record, const std::string &path) {
  if (std::filesystem::exists(path) && recipe_of(rim::read_file(path)) == recipe_of(record))
    return;
  std::size_t others = 0;
  std::error_code none;
  for (const auto &entry : std::filesystem::directory_iterator(o.out, none)) {
    unsigned long long run = 0;
    const std::string name = entry.path().filename().string();
    others += std::sscanf(name.c_str(), "run_%llu.csv", &run) == 1 &&
                      (run < o.first || run - o.first >= o.runs)
                  ? 1
                  : 0;
  }
  if (others > 0)
    std::fprintf(stderr,
                 "rim: warning: %s holds %zu %s of another world, seed, version or parameters; "
                 "simulate.toml is of the new runs alone\n",
                 o.out.c_str(), others, others == 1 ? "run" : "runs");
}

void write_record(const std::string &record, const std::string &path) {
  rim::AtomicFile file(path);
  file.write(record);
  file.commit();
}

rim::LabelledLog truth_of(const std::string &path, const Recording &recording) {
  rim::LabelledLog labels = rim::unlabelled(recording.log);
  labels.path = path;
  labels.finding.assign(recording.finding.begin(), recording.finding.end());
  return labels;
}

void write_truths(const Options &o, const std::vector<rim::LabelledLog> &truths) {
  const bool is_folder = o.truth.back() == '/' || std::filesystem::is_directory(o.truth);
  if (!is_folder) {
    rim::world::write_truth(truths, o.truth);
    return;
  }
  rim::make_folder(o.truth);
  for (std::size_t i = 0; i < truths.size(); ++i)
    rim::world::write_truth({truths[i]}, rim::world::run_path(o.truth, o.first + i));
}

int cmd_simulate(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Write logs of a simulated vehicle.", "rim simulate"};
  declare(app, o);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  check(app, o);
  check_beside(o, "--truth", o.truth);
  check_beside(o, "--labels", o.labels);
  const auto extensions = rim::diagnose::read_extensions(o.extensions);
  const World world = make_world(o);
  if (!extensions.empty()) { // what does not fit the world is refused before anything is written
    rim::Log log = world.run(o.first).log;
    rim::diagnose::apply_extension(extensions, &log);
  }
  const std::string record = record_of(o, world), record_path = o.out + "/simulate.toml";
  warn_of_others(o, record, record_path);
  rim::make_folder(o.out);
  std::vector<rim::LabelledLog> truths(o.runs);
  std::vector<std::size_t> rows(o.runs);
  {
    rim::Progress progress("simulate", o.runs);
    rim::parallel_for(o.runs, [&](std::size_t i) {
      Recording recording = world.run(o.first + i);
      if (!extensions.empty())
        rim::diagnose::apply_extension(extensions, &recording.log);
      const std::string path = rim::world::run_path(o.out, o.first + i);
      rim::write_log(recording.log, path);
      rows[i] = recording.finding.size();
      if (!o.truth.empty())
        truths[i] = truth_of(path, recording);
      progress.add();
    });
  }
  write_record(record, record_path);
  if (!o.truth.empty())
    write_truths(o, truths);
  if (!o.labels.empty())
    write_labels(o, world);
  std::size_t total = 0;
  for (const std::size_t n : rows)
    total += n;
  std::printf("%s: %llu %s of the %s, %zu rows\n", o.out.c_str(),
              static_cast<unsigned long long>(o.runs), o.runs == 1 ? "run" : "runs",
              o.world.c_str(), total);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(simulate, "write logs of a simulated vehicle, with an effect hidden in them",
            cmd_simulate)
