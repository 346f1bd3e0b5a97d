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
#include "util/parallel_for.hpp"
#include "util/progress.hpp"
#include "world/cobot.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sys/resource.h>

namespace {

struct Options {
  std::vector<std::string> logs;
  std::string out, schema, interference, robot, model;
  rim::TrainOptions train;
  unsigned threads = 0;
  bool quick = false;
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
    "  rim train held/*.csv control/*.csv --interference held.csv --model robot.rim --out both.rim";

void declare(rim::cli::Arguments &app, Options &o) {
  app.add_option("LOG", o.logs, "logs of healthy runs, at least 3")->required();
  app.add_option("--out", o.out, "the flight image")->required()->type_name("MODEL.rim");
  app.add_option("--schema", o.schema, "roles, units and rates of foreign logs")
      ->type_name("FILE.toml");
  app.add_flag("--flight", o.train.calibration.flight,
               "make an image that searches less per row and needs less memory, for "
               "small\nprocessors (make size shows how much)");
  app.add_option("--false-alarm", o.train.calibration.false_alarm,
                 "largest acceptable share of healthy runs with any alarm (default 0.05)")
      ->check(rim::cli::range(1e-6, 0.999999));
  app.add_option("--block-seconds", o.train.block_s,
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
      ->type_name("LABELS.csv");
  app.add_option("--robot", o.robot,
                 "with --interference and encoder counters: the wheels, base_radius_m and tick_m\n"
                 "in [cobot] as in data/cobot.toml, which describes the simulated robot")
      ->type_name("FILE.toml")
      ->check(rim::cli::existing_file());
  app.add_option("--model", o.model,
                 "with --interference: flight image to add the detector to. The result is written\n"
                 "to --out. Its rows need u.vx_mps, and s.vx_mps or z.vx_mps")
      ->type_name("MODEL.rim");
  app.add_flag("--quick", o.quick, "print the short report, without the table of models");
  app.footer(kFooter);
}

std::vector<rim::Log> read_logs(const Options &o) {
  std::optional<rim::Schema> schema;
  if (!o.schema.empty())
    schema = rim::read_schema(o.schema);
  std::vector<rim::Log> logs(o.logs.size());
  rim::Progress progress("read", o.logs.size());
  rim::parallel_for(o.logs.size(), [&](std::size_t i) {
    logs[i] = rim::read_log(o.logs[i], schema ? &*schema : nullptr);
    progress.add();
  });
  return logs;
}

void print_input(const std::vector<rim::Log> &logs, const rim::FlightPlan &plan) {
  std::size_t rows = 0, skipped = 0, filtered = 0, commands = 0;
  for (const rim::Log &log : logs) {
    rows += log.t_s.size();
    skipped += log.rows_skipped;
    filtered += log.rows_filtered;
  }
  for (const std::uint8_t bits : plan.layout.command) // 2 and 4: an angle
    commands += (bits & 1U) != 0;
  std::printf("%zu runs, %zu rows at %.4g Hz: %zu sensors, %zu commands, %zu further context\n",
              logs.size(), rows, 1.0 / plan.period_s, plan.layout.outcomes(), commands,
              plan.layout.features() - plan.layout.outcome_feature.size() - commands);
  std::printf("rows skipped for a missing or infinite value: %zu", skipped);
  if (filtered > 0)
    std::printf("; left out by the schema: %zu", filtered);
  std::printf("\n");
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

int cmd_train(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Learn what healthy runs do and write the flight image.", "rim train"};
  declare(app, o);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  if (!o.model.empty() && o.interference.empty())
    throw rim::UsageError("--model needs --interference: there is no detector to add");
  if (!o.robot.empty() && o.interference.empty())
    throw rim::UsageError("--robot needs --interference");
  if (o.threads > 0)
    rim::set_parallel_threads(o.threads);
  const auto start = std::chrono::steady_clock::now();
  rim::AtomicFile file(o.out); // a place that cannot be written is found before the work
  const std::vector<rim::Log> logs = read_logs(o);
  if (!o.interference.empty()) {
    learn_interference(logs, o);
    return rim::EXIT_FINE;
  }
  const rim::Training training = rim::train(logs, o.train);
  const std::vector<std::uint8_t> image = rim::make_image(training.plan);
  print_input(logs, training.plan);
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
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(train, "learn from healthy runs and write the flight image with calibrated thresholds",
            cmd_train)
