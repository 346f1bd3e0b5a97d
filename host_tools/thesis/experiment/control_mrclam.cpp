// SPDX-License-Identifier: MIT
#include "thesis/experiment/control_mrclam.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "diagnose/term.hpp"
#include "thesis/poisson.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/progress.hpp"
#include "util/table.hpp"
#include "world/random.hpp"

namespace rim::experiment {

using diagnose::Measured;
using diagnose::Term;

namespace {

bool is_drive(const std::string &name) { return name.find("_r") != std::string::npos; }
bool is_odd(const std::string &name) { return (name.back() - '0') % 2 == 1; }

// What the model with these terms expects, and what was measured.
InterferenceRun forward_run(const std::string &name, const Log &log,
                            const std::vector<Term> &terms) {
  const Measured table = diagnose::make_measured({log}, diagnose::Constants::keep);
  const auto &channel =
      table.channels.at(static_cast<std::size_t>(table.find_channel("forward_mps")));
  const auto expected = diagnose::extended_prediction(terms, channel, table);
  InterferenceRun run;
  run.name = name;
  run.t_s = table.t_s;
  run.command_mps.assign(expected.m.data(), expected.m.data() + expected.m.size());
  run.speed_mps.assign(channel.z.data(), channel.z.data() + channel.z.size());
  return run;
}

double noise_of(const Log &log) {
  const Measured table = diagnose::make_measured({log}, diagnose::Constants::keep);
  return table.channels.at(static_cast<std::size_t>(table.find_channel("forward_mps"))).sd.mean();
}

struct Logs {
  std::vector<std::string> names;
  std::vector<Log> logs;
};

rim_interference_model learn(const Logs &others, const std::vector<Term> &terms,
                             const HeldRuns &holds, std::uint64_t seed) {
  std::vector<InterferenceRun> runs;
  InterferenceOptions options;
  options.noise_mps = 0.0;
  for (std::size_t i = 0; i < others.logs.size(); ++i) {
    runs.push_back(forward_run(others.names[i], others.logs[i], terms));
    options.noise_mps += noise_of(others.logs[i]) / static_cast<double>(others.logs.size());
  }
  const std::size_t controls = runs.size();
  for (std::size_t i = 0; i < controls; ++i)
    runs.push_back(with_holds(runs[i], holds, seed + i));
  return InterferenceTrainer(runs, options).train(runs.size()).model;
}

ControlRun judge_run(const InterferenceRun &run, const rim_interference_model &model,
                     const HeldRuns &holds, std::uint64_t seed) {
  ControlRun out;
  out.name = run.name;
  out.rows = run.t_s.size();
  for (std::size_t i = 1; i < run.t_s.size(); ++i) {
    const double dt_s = run.t_s[i] - run.t_s[i - 1];
    if (dt_s > model.gap_s)
      ++out.gaps;
    else
      out.driven_s += dt_s;
  }
  out.false_alarms = detect(model, run).detector[1].false_positives;
  const InterferenceRun held = with_holds(run, holds, seed);
  const auto outcome = detect(model, held);
  out.holds = held.intervals.size();
  out.found = outcome.detector[1].hits;
  out.delays_s = outcome.detector[1].delays_s;
  return out;
}

void judge_fold(const Logs &teach, const Logs &judged, const diagnose::Options &diagnosis,
                const HeldRuns &holds, std::vector<ControlRun> *runs) {
  const auto found = diagnose::diagnose(teach.logs, diagnosis, nullptr);
  const std::vector<Term> terms = terms_of(found);
  const std::uint64_t seed = diagnosis.seed + 100 * runs->size();
  const auto model = learn(teach, terms, holds, seed + 50);
  const auto undiagnosed = learn(teach, {}, holds, seed + 50);
  for (std::size_t i = 0; i < judged.logs.size(); ++i) {
    ControlRun run =
        judge_run(forward_run(judged.names[i], judged.logs[i], terms), model, holds, seed + i);
    run.false_alarms_plain =
        judge_run(forward_run(judged.names[i], judged.logs[i], {}), undiagnosed, holds, seed + i)
            .false_alarms;
    for (const diagnose::Finding &finding : found.findings) {
      if (finding.term.channel == "forward_mps")
        run.causes += (run.causes.empty() ? "" : "; ") + cause_text(finding);
    }
    runs->push_back(run);
  }
}

} // namespace

InterferenceRun with_holds(InterferenceRun run, const HeldRuns &holds, std::uint64_t seed) {
  world::Random random(seed, 1, 0);
  const std::size_t rows = run.t_s.size();
  double part_s = run.t_s.front() + holds.every_s;
  for (std::size_t i = 1; i < rows; ++i) {
    if (run.t_s[i] < part_s)
      continue;
    // The first place from here on where the robot drives all through it, without a gap before.
    std::size_t end = i;
    bool drives = true;
    while (end < rows && run.t_s[end] < run.t_s[i] + holds.duration_s) {
      drives = drives && run.command_mps[end] >= holds.least_mps &&
               run.t_s[end] - run.t_s[end - 1] < 1.0;
      ++end;
    }
    if (!drives || end >= rows)
      continue;
    const double share = holds.most_share * random.uniform();
    for (std::size_t k = i; k < end; ++k)
      run.speed_mps[k] *= share;
    run.intervals.push_back({run.t_s[i], run.t_s[end - 1], "hold"});
    part_s = run.t_s[end - 1] + holds.every_s;
  }
  return run;
}

std::vector<ControlRun> run_control_mrclam(const MeasuredOptions &options, const HeldRuns &holds,
                                           bool halves) {
  const std::string folder = measured_folder(options);
  const Schema schema = read_schema(data_path("diagnose_mrclam.toml"));
  const auto world = world::make_world_predictor("unicycle");
  Logs all;
  all.names = measured_names(folder, options, is_drive);
  for (const std::string &name : all.names)
    all.logs.push_back(predicted_log(folder + "/" + name + ".csv", schema, *world));
  diagnose::Options diagnosis;
  diagnosis.catalogue = diagnose::read_catalogue(data_path("causes.toml"));
  diagnosis.predictor = world.get();
  diagnosis.null_runs = options.null_runs;
  diagnosis.seed = options.seed;
  diagnosis.gains = false;
  diagnosis.model = "world unicycle";
  const std::size_t folds = halves ? 2 : all.logs.size();
  std::vector<ControlRun> runs;
  Progress progress("control runs", folds);
  for (std::size_t fold = 0; fold < folds; ++fold) {
    Logs teach, judged;
    for (std::size_t i = 0; i < all.logs.size(); ++i) {
      const bool is_judged = halves ? is_odd(all.names[i]) == (fold == 1) : i == fold;
      Logs &to = is_judged ? judged : teach;
      to.names.push_back(all.names[i]);
      to.logs.push_back(all.logs[i]);
    }
    if (teach.logs.empty())
      throw DataError(folder + ": too few logs to learn from the others (d6_r1.csv ...)");
    judge_fold(teach, judged, diagnosis, holds, &runs);
    progress.add();
  }
  return runs;
}

void print_control_mrclam(const std::vector<ControlRun> &runs, std::FILE *to) {
  fmt::print(to, "Robots that nobody interferes with, each by what the others teach: motion model "
                 "as diagnosed.\nHolds are put into a copy of the run.\n\n");
  Table table({{"run", ""},
               {"driven", "h"},
               {"gaps", ""},
               {"false", "alarms"},
               {"undiagnosed", "false alarms"},
               {"holds found", ""},
               {"mean delay", "s"}});
  ControlRun all;
  const auto add = [&table](const char *name, const ControlRun &run) {
    double delay_s = 0.0;
    for (const double s : run.delays_s)
      delay_s += s / static_cast<double>(run.delays_s.size());
    table.add({name, cell(run.driven_s / 3600.0), cell(run.gaps), cell(run.false_alarms),
               cell(run.false_alarms_plain), fmt::format("{}/{}", run.found, run.holds),
               run.delays_s.empty() ? "-" : cell(delay_s)});
  };
  for (const ControlRun &run : runs) {
    add(run.name.c_str(), run);
    all.driven_s += run.driven_s;
    all.gaps += run.gaps;
    all.false_alarms += run.false_alarms;
    all.false_alarms_plain += run.false_alarms_plain;
    all.holds += run.holds;
    all.found += run.found;
    all.delays_s.insert(all.delays_s.end(), run.delays_s.begin(), run.delays_s.end());
  }
  add("all", all);
  table.print(to);
  const double hours = all.driven_s / 3600.0;
  const RateInterval rate = poisson_interval(all.false_alarms);
  fmt::print(to,
             "\nfalse alarms in all runs: {} in {:.2f} h, {:.2f} an hour (95 % Poisson {:.2f} to "
             "{:.2f})\n",
             all.false_alarms, hours, static_cast<double>(all.false_alarms) / hours,
             rate.low / hours, rate.high / hours);
  for (const ControlRun &run : runs)
    fmt::print(to, "{} by the others: {}\n", run.name,
               run.causes.empty() ? "nothing claimed" : run.causes);
}

} // namespace rim::experiment
