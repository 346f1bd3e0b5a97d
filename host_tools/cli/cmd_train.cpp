// SPDX-License-Identifier: MIT
// rim train: a flight image from healthy runs.
#include "bus/sentence.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "log/schema.hpp"
#include "train/interference_report.hpp"
#include "train/train_report.hpp"
#include "train/trainer.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/memory.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"
#include "world/cobot.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <sys/resource.h>
#include <utility>

namespace {

struct Options {
  std::vector<std::string> logs;
  std::string out, schema, interference, robot, model, shard;
  rim::TrainOptions train;
  unsigned threads = 0;
  bool quick = false, merge = false, leave_out = false;
};

const char *const kFooter =
    "Every log must be a healthy run of its own, from start to end, with the same columns.\n"
    "With n runs no false-alarm rate below 1/(n+1) can be promised. The report states the rate\n"
    "that is promised.\n\n"
    "Example: your own logs, with the schema that rim schema proposed and you corrected\n"
    "  rim train healthy/*.csv --schema mine.toml --out mine.rim\n"
    "Example: learn fifty healthy landings, and watch the fifty-first\n"
    "  rim simulate lander --out nominal --runs 50 --seed 1\n"
    "  rim train nominal/run_*.csv --out lander.rim\n"
    "  rim replay --model lander.rim flight51.csv\n"
    "Example: a robot's image that also detects when somebody holds the robot\n"
    "  rim train held/*.csv control/*.csv --interference held.csv --model robot.rim --out "
    "both.rim\n"
    "Example: the blocks of many landings made in two places, and the image learnt from them\n"
    "  rim train landings/*.csv --shard 1/2 --out 1.part     (2/2 elsewhere, of the same logs)\n"
    "  rim train --merge 1.part 2.part --out lander.rim";

void declare(rim::cli::Arguments &app, Options &o) {
  app.add_option("LOG", o.logs, "logs of healthy runs, at least 3; with --merge part files")
      ->required()
      ->reads();
  app.add_option("--out", o.out, "the flight image")
      ->required()
      ->type_name("MODEL.rim")
      ->check(rim::cli::new_or_image())
      ->writes();
  app.add_option("--schema", o.schema, "roles, units and rates of foreign logs")
      ->type_name("FILE.toml")
      ->reads();
  app.add_flag("--flight", o.train.calibration.flight,
               "make an image that searches less per row and needs less memory, for "
               "small\nprocessors (make size shows how much)");
  app.add_option("--false-alarm", o.train.calibration.false_alarm,
                 "largest acceptable share of healthy runs with any alarm (default 0.05)")
      ->check(rim::cli::range(1e-6, 0.999999));
  app.add_option("--block-seconds", o.train.blocking.block_s,
                 "length of a block of rows, which the search takes as one observation\n(default: "
                 "such that a run has about 240 blocks)")
      ->check(rim::cli::range(1e-6, 1e6));
  app.add_option("--threads", o.threads, "threads (default 2, or RIM_THREADS)")
      ->check(rim::cli::range(1, 64));
  app.add_option("--interference", o.interference,
                 "learn to detect motion interference instead. LABELS.csv gives the times of\n"
                 "interference (log,start_s,end_s,kind); a log without any is a control run. The\n"
                 "logs need the column u.vx_mps, and s.vx_mps or z.vx_mps, or the counters\n"
                 "s.enc1_ticks to s.enc4_ticks with --robot")
      ->type_name("LABELS.csv")
      ->reads();
  app.add_option("--robot", o.robot,
                 "with --interference and encoder counters: the wheels, base_radius_m and tick_m\n"
                 "in [cobot] as in data/cobot.toml, which describes the simulated robot")
      ->type_name("FILE.toml")
      ->check(rim::cli::existing_file())
      ->reads();
  app.add_option("--model", o.model,
                 "with --interference: flight image to add the detector to. The result is written\n"
                 "to --out. Its rows need u.vx_mps, and s.vx_mps or z.vx_mps")
      ->type_name("MODEL.rim")
      ->reads();
  app.add_option("--shard", o.shard,
                 "make only the blocks of the runs I, I + N, I + 2 N, ... of the logs, and write\n"
                 "them to --out, a part file. Name all the logs: every shard reads all of them")
      ->type_name("I/N");
  app.add_flag("--merge", o.merge,
               "the files are not logs but the N parts of --shard: learn from them. The image is\n"
               "the one that the logs would give, to the last bit");
  app.add_flag("--leave-out-unlike", o.leave_out,
               "where a run is unlike the others, learn again without it. At most a tenth of the\n"
               "runs, at least one, is left out, and each is named");
  app.add_flag("--quick", o.quick, "print the short report, without the table of models");
  app.footer(kFooter);
}

std::optional<rim::Schema> schema_of(const Options &o) {
  if (o.schema.empty())
    return std::nullopt;
  return rim::read_schema(o.schema);
}

// All at once, for what is learnt row by row.
std::vector<rim::Log> read_logs(const Options &o) {
  const std::optional<rim::Schema> schema = schema_of(o);
  std::vector<rim::Log> logs(o.logs.size());
  rim::Progress progress("read", o.logs.size());
  rim::parallel_for(o.logs.size(), [&](std::size_t i) {
    logs[i] = rim::read_log(o.logs[i], schema ? &*schema : nullptr);
    progress.add();
  });
  return logs;
}

void print_input(const rim::Training &training) {
  const rim::FlightPlan &plan = training.plan;
  const rim::InputRows &input = training.input;
  std::size_t commands = 0;
  for (const std::uint8_t bits : plan.layout.command) // 2 and 4: an angle
    commands += (bits & 1U) != 0;
  std::printf("%zu runs, %zu rows at %.4g Hz: %zu sensor%s, %zu command%s, %zu further context\n",
              training.scores.size(), input.rows, 1.0 / plan.period_s, plan.layout.outcomes(),
              plan.layout.outcomes() == 1 ? "" : "s", commands, commands == 1 ? "" : "s",
              plan.layout.features() - plan.layout.outcome_feature.size() - commands);
  std::printf("rows skipped for a missing or infinite value, or a time that does not increase: %zu",
              input.skipped);
  if (input.filtered > 0)
    std::printf("; left out by the schema: %zu", input.filtered);
  std::printf("\n");
  if (!training.plan.basis.begin.empty())
    std::printf("the logs begin under way: before its first row a command is taken to have been as "
                "healthy runs are on average\n");
  if (input.left_out > 0)
    std::printf("blocks left out after gaps, until the commands were known again: %zu of %zu\n",
                input.left_out, input.blocks + input.left_out);
}

double peak_gb() {
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1048576.0; // kB on Linux
}

void learn_interference(const std::vector<rim::Log> &logs, const Options &o) {
  std::optional<rim::world::Cobot> robot;
  if (!o.robot.empty()) {
    rim::world::CobotParams params;
    rim::world::CobotMap map;
    rim::world::read_cobot(rim::data_path("cobot.toml"), o.robot, &params, &map);
    robot.emplace(params, map, std::vector<rim::world::CobotEffect>{}, 1, 1);
  }
  rim::train_interference(logs, o.interference, robot ? &robot->wheels() : nullptr, o.model, o.out);
}

void check_options(const Options &o) {
  if (!o.model.empty() && o.interference.empty())
    throw rim::UsageError("--model needs --interference: there is no detector to add");
  if (!o.robot.empty() && o.interference.empty())
    throw rim::UsageError("--robot needs --interference");
  if ((o.merge || !o.shard.empty()) && !o.interference.empty())
    throw rim::UsageError(
        "--interference learns from all logs at once, without --shard and --merge");
  if (o.leave_out && (o.merge || !o.shard.empty() || !o.interference.empty()))
    throw rim::UsageError(
        "--leave-out-unlike needs the logs, to learn from them again; it cannot be "
        "combined with --shard, --merge or --interference");
  if (o.merge && !o.shard.empty())
    throw rim::UsageError(
        "--shard makes a part and --merge learns from parts; give only one of them");
  if (o.merge && (!o.schema.empty() || o.train.blocking.block_s > 0.0))
    throw rim::UsageError(
        "--schema and --block-seconds belong to --shard; the parts hold blocks already");
}

void make_part(const Options &o) {
  const rim::Shard shard = rim::parse_shard(o.shard);
  rim::LogSet logs(o.logs, schema_of(o));
  const rim::PartWritten part = rim::write_part(&logs, o.train.blocking, shard, o.out);
  std::printf("%s written: the blocks of %zu of %zu runs, %.2f GB of memory\n", o.out.c_str(),
              part.runs, part.all, peak_gb());
}

rim::Training learn(const std::vector<std::string> &files, const Options &o) {
  rim::LogSet logs(o.merge ? std::vector<std::string>() : files, schema_of(o));
  return rim::train(o.merge ? rim::merged_parts(files) : rim::healthy_runs(&logs, o.train.blocking),
                    o.train);
}

// Without the runs that are unlike the others, as far as that leaves nine in ten.
rim::Training learn_without_unlike(const Options &o) {
  std::vector<std::string> files = o.logs;
  const std::size_t most = std::max<std::size_t>(1, files.size() / 10);
  rim::Training training = learn(files, o);
  while (!training.unlike.empty() &&
         files.size() - training.unlike.size() + most >= o.logs.size() &&
         files.size() - training.unlike.size() >= 3) {
    for (std::size_t k = training.unlike.size(); k-- > 0;) {
      const auto at = files.begin() + static_cast<std::ptrdiff_t>(training.unlike[k]);
      std::printf("left out: %s, a run unlike the others (score %.1f)\n", at->c_str(),
                  training.scores[training.unlike[k]].score);
      files.erase(at);
    }
    training = learn(files, o);
  }
  return training;
}

void learn_image(const Options &o) {
  const auto start = std::chrono::steady_clock::now();
  rim::AtomicFile file(o.out); // a place that cannot be written is found before the work
  const rim::Training training = o.leave_out ? learn_without_unlike(o) : learn(o.logs, o);
  const std::vector<std::uint8_t> image = rim::make_image(training.plan);
  print_input(training);
  for (const std::string &warning : training.warnings)
    std::fprintf(stderr, "rim: warning: %s\n", warning.c_str());
  if (!o.quick)
    std::fputs(rim::outcome_report(training).c_str(), stdout);
  std::fputs(rim::choice_report(training).c_str(), stdout);
  std::fputs(rim::promise_report(training, o.train.calibration.false_alarm).c_str(), stdout);
  std::fputs(rim::image_report(image).c_str(), stdout);
  file.write(image.data(), image.size());
  file.commit();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  std::printf("%s written: %.1f s, %.2f GB of memory\n", o.out.c_str(), elapsed.count(), peak_gb());
}

int cmd_train(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Learn what healthy runs do and write the flight image.", "rim train"};
  declare(app, o);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  check_options(o);
  rim::map_large_pieces();
  if (o.threads > 0)
    rim::set_parallel_threads(o.threads);
  o.train.blocking.folder = (std::filesystem::path(o.out).parent_path() / ".").string();
  if (!o.shard.empty())
    make_part(o);
  else if (!o.interference.empty()) {
    rim::AtomicFile place(o.out); // one that cannot be written is found before the work
    learn_interference(read_logs(o), o);
  } else
    learn_image(o);
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(train, "learn from healthy runs and write the flight image with calibrated thresholds",
            cmd_train)
