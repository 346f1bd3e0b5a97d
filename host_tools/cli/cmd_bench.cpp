// SPDX-License-Identifier: MIT
// rim bench: memory of monitors, time of a choice, time of training, speed of replay.
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "plan/choice_time.hpp"
#include "replay/replay.hpp"
#include "search/select.h"
#include "train/external_table.hpp"
#include "train/trainer.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/parallel_for.hpp"
#include "util/table.hpp"
#include "world/lander_params.hpp"
#include "world/recording.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fmt/format.h>
#include <sys/resource.h>

namespace {

constexpr std::size_t kChoices = 201; // timed without --choice

struct Options {
  bool memory = false;
  std::vector<std::string> replay;
  std::string external_table;
  std::size_t runs = 50, choices = 0;
};

struct Size {
  const char *what;
  std::size_t features, outcomes, region, bytes;
};

// The sizes are constant expressions, as a static array needs them.
void print_memory() {
  constexpr Size sizes[] = {
      {"own predictions, small", 6, 3, 6,
       RIM_MONITOR_SIZE(6, 3, 6, RIM_SELECT_DEFAULT_RING, RIM_SELECT_DEFAULT_BINS,
                        RIM_SELECT_DEFAULT_GRID, RIM_SELECT_DEFAULT_PAIRS)},
      {"own predictions, 100-D", 100, 1, 100,
       RIM_MONITOR_SIZE(100, 1, 100, RIM_SELECT_DEFAULT_RING, RIM_SELECT_DEFAULT_BINS,
                        RIM_SELECT_DEFAULT_GRID, RIM_SELECT_DEFAULT_PAIRS)},
      {"lander, as trained for flight (at most)", 29, 25, 12,
       RIM_MONITOR_TRAINED_SIZE(29, 25, 12, 124, 180, 300, 4, 8)},
  };
  std::printf("Memory of one monitor (rim/monitor.h; the image stays where it is)\n");
  rim::Table table({{"monitor", ""},
                    {"features", ""},
                    {"outcomes", ""},
                    {"in regions", "features"},
                    {"RAM", "kB"}});
  for (const Size &s : sizes) {
    table.add({s.what, rim::cell(s.features), rim::cell(s.outcomes), rim::cell(s.region),
               fmt::format("{:.1f}", static_cast<double>(s.bytes) / 1000.0)});
  }
  table.print();
}

void print_choice(std::size_t repeats) {
  constexpr std::uint32_t kActions = 200, kObservations = 200;
  struct Setting {
    const char *name;
    rim_bandit_policy policy;
    rim_gp_kernel kernel;
  };
  const Setting settings[] = {
      {"GP-UCB, squared exponential", RIM_BANDIT_GP_UCB, RIM_GP_SQUARED_EXPONENTIAL},
      {"GP-UCB, Matern 5/2", RIM_BANDIT_GP_UCB, RIM_GP_MATERN_5_2},
      {"RIM+GP-UCB, squared exponential", RIM_BANDIT_RIM_GP_UCB, RIM_GP_SQUARED_EXPONENTIAL},
      {"RIM+GP-UCB, Matern 5/2", RIM_BANDIT_RIM_GP_UCB, RIM_GP_MATERN_5_2}};
  std::printf("A choice among %u actions with %u observations, %zu times:\n", kActions,
              kObservations, repeats);
  rim::Table table({{"policy", ""}, {"least", "ms"}, {"median", "ms"}, {"memory", "kB"}});
  for (const Setting &s : settings) {
    const rim::ChoiceTime t =
        rim::time_choice(s.policy, s.kernel, kActions, kObservations, repeats);
    table.add({s.name, fmt::format("{:.2f}", t.least_ms), fmt::format("{:.2f}", t.choose_ms),
               fmt::format("{:.1f}", static_cast<double>(t.bytes) / 1000.0)});
  }
  table.print();
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The best of some repetitions: what the machine can do when nobody else wants it.
void print_replay(rim::Replayer replayer, const rim::Log &log) {
  constexpr int kRepetitions = 5;
  double best_s = 1e300;
  rim::ReplayedLog result;
  for (int i = 0; i < kRepetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    result = replayer.replay(log, rim::ReplayOptions{});
    best_s = std::min(best_s, seconds_since(start));
  }
  std::printf(
      "Replay of %s: %u %s in %.3f s (best of %d), %.2f us per row, %.0f times real time; "
      "RAM of the monitor %.1f kB\n",
      log.path.c_str(), result.rows, result.rows == 1 ? "row" : "rows", best_s, kRepetitions,
      1e6 * best_s / result.rows, result.duration_s / best_s,
      static_cast<double>(replayer.monitor().bytes()) / 1000.0);
}

void bench_lander(std::size_t runs) {
  const rim::world::LanderParams params =
      rim::world::read_lander_params(rim::data_path("lander.toml"));
  std::vector<rim::Log> logs(runs);
  rim::parallel_for(runs,
                    [&](std::size_t i) { logs[i] = rim::world::lander_log(params, {}, 1, i + 1); });
  std::size_t rows = 0;
  for (const rim::Log &log : logs)
    rows += log.t_s.size();
  const auto start = std::chrono::steady_clock::now();
  const rim::Training training = rim::train(logs, rim::TrainOptions{});
  const double training_s = seconds_since(start);
  struct rusage usage {};
  ::getrusage(RUSAGE_SELF, &usage);
  std::printf("Training on %zu runs, %zu rows, %zu columns: %.1f s on %zu threads, %.2f GB\n", runs,
              rows, training.plan.layout.features(), training_s, rim::parallel_threads(),
              static_cast<double>(usage.ru_maxrss) / 1048576.0);
  print_replay(rim::Replayer(rim::make_image(training.plan), "lander"),
               rim::world::lander_log(params, {}, 2, 1));
}

int cmd_bench(int argc, char **argv) {
  Options o;
  rim::cli::Arguments app{"Measure memory, training time and replay speed.", "rim bench"};
  app.add_flag("--memory", o.memory, "print only the memory of monitors");
  app.add_option("--choice", o.choices,
                 "measure only the time of a planner's choice, this many times")
      ->check(rim::cli::range(1, 1000000));
  app.add_option("--replay", o.replay, "measure only the replay speed of this model and log")
      ->expected(2)
      ->type_name("MODEL.rim LOG");
  app.add_option(
         "--external-table", o.external_table,
         "compute the table of thresholds for logs with their own predictions anew (an hour\n"
         "on one core) and write it as the source file that the program contains")
      ->type_name("FILE.cpp");
  app.add_option("--runs", o.runs, "landings to train on (default 50)")
      ->check(rim::cli::range(3, 1000));
  app.footer(
      "Detection is measured by 'rim-thesis experiment golf', 'lander' and 'falcon', planning by "
      "'fig5.10' and 'figB.6'.\n\n"
      "Example:\n  rim bench --memory\n  rim bench --choice 1000\n  rim bench --replay "
      "lander.rim flight.csv");
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  if (!o.replay.empty()) {
    const std::string bytes = rim::read_file(o.replay[0]);
    rim::Replayer replayer({bytes.begin(), bytes.end()}, o.replay[0]);
    const rim::Log log =
        rim::read_log(o.replay[1], nullptr, replayer.read_options(o.replay[0]));
    print_replay(std::move(replayer), log);
    return rim::EXIT_FINE;
  }
  if (!o.external_table.empty()) {
    rim::AtomicFile file(o.external_table);
    file.write(rim::make_external_table());
    file.commit();
    return rim::EXIT_FINE;
  }
  if (o.choices > 0) {
    print_choice(o.choices);
    return rim::EXIT_FINE;
  }
  print_memory();
  if (!o.memory) {
    print_choice(kChoices);
    bench_lander(o.runs);
  }
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(bench, "measure a monitor's memory, the time of training and the speed of replay",
            cmd_bench)
