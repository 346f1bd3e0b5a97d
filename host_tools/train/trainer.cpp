// SPDX-License-Identifier: MIT
#include "train/trainer.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "image/names.hpp"
#include "util/error.hpp"
#include "util/memory.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "image/basis.h"
}

namespace rim {

namespace {

constexpr double kBlocksPerRun = 240.0;
constexpr double kStalePeriods = 5.0;
constexpr std::size_t kNoiseFolds = 6;
constexpr std::uint32_t kRing = 384; // calibrate_runs() gives flight its own
// Error over behaviour's, above which the others' residuals say nothing.
constexpr double kLeastAgreement = 0.95;

// Channels by kind: behaviour, agreement, scatter, repeats; blocks x channels per run.
std::vector<Matrix> all_residuals(const RunStore &runs, const Behaviour &behaviour,
                                  const Agreement &agreement) {
  std::vector<Matrix> all;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Eigen::Index o = runs[r].outcome.cols();
    Matrix m(runs[r].blocks(), 4 * o);
    m.leftCols(o) = behaviour.residual[r];
    m.middleCols(o, o) = agreement.remains[r];
    m.middleCols(2 * o, o) = behaviour.scatter[r];
    m.rightCols(o) = runs[r].repeats;
    all.push_back(m);
  }
  return all;
}

// A share of repeats is a count of few readings: its noise is never below that of one of ten. And a
// constant share (none) is not evidence of its own.
void settle_repeats(NoiseModel *noise, std::size_t outcomes) {
  for (std::size_t o = 0; o < outcomes; ++o) {
    ChannelNoise &c = noise->channels[3 * outcomes + o];
    constexpr double least = 0.1;
    if (c.active && c.s >= least)
      continue;
    if (c.combination.rows() > 0 && c.active)
      c.combination *= c.s / least;
    c.active = true;
    c.s = least;
  }
}

// An agreement with the others' residuals that says no more than behaviour's channel is not
// searched twice. Other sources are chosen by the smallest offset that they show, whatever their
// error. With one outcome there are no others that it could agree with.
void settle_agreement(NoiseModel *noise, const Agreement &agreement, std::size_t outcomes) {
  for (std::size_t o = 0; o < outcomes; ++o) {
    if (outcomes < 2 ||
        (agreement.source[o] == AGREEMENT_RESIDUALS && agreement.error[o] > kLeastAgreement))
      noise->channels[outcomes + o].active = false;
  }
}

// The noise of all runs; returns that of the runs without every fold, by which the fold's runs are
// judged: a run whose own effects were learnt is no guide to what a new one shows.
std::vector<NoiseModel> fit_noises(const FlightPlan &plan, const std::vector<SearchRun> &seen,
                                   const Agreement &agreement, NoiseModel *of_all) {
  const std::size_t folds = std::min(kNoiseFolds, seen.size());
  const std::size_t outcomes = plan.layout.outcomes();
  std::vector<NoiseModel> without;
  for (std::size_t f = 0; f <= folds; ++f) {
    std::vector<std::size_t> which;
    for (std::size_t r = 0; r < seen.size(); ++r) {
      if (r % folds != f)
        which.push_back(r);
    }
    without.push_back(fit_noise(plan.basis, seen, which, plan.block_rows * plan.period_s));
    settle_repeats(&without.back(), outcomes);
    settle_agreement(&without.back(), agreement, outcomes);
  }
  *of_all = without.back();
  without.pop_back();
  return without;
}

Behaviour external_behaviour(const RunStore &runs, std::size_t outcomes) {
  Behaviour b;
  b.targets.resize(2 * outcomes);
  for (const BlockRun &run : runs) {
    b.predicted.push_back(run.predicted);
    b.residual.push_back(run.outcome);
    b.scatter.push_back(run.scatter);
  }
  return b;
}

// What the others' readings say of every outcome, block by block (thesis 4.2.5, eq. 4.9-4.14).
struct Level {
  std::vector<Matrix> predicted; // per run: blocks x outcomes; empty: there is no section LEVEL
  std::vector<Matrix> beyond;    // 1 where a block lies beyond what the other runs taught
};

Level fit_level(FlightPlan *plan, const RunStore &runs) {
  const Layout &layout = plan->layout;
  Eigen::Index rows = 0;
  for (const BlockRun &run : runs)
    rows += run.blocks();
  Matrix x(rows, static_cast<Eigen::Index>(layout.features()));
  Matrix y(rows, static_cast<Eigen::Index>(layout.outcomes()));
  std::vector<std::uint32_t> run_of;
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    x.middleRows(at, runs[r].blocks()) = runs[r].context;
    y.middleRows(at, runs[r].blocks()) = runs[r].outcome;
    at += runs[r].blocks();
    run_of.insert(run_of.end(), static_cast<std::size_t>(runs[r].blocks()),
                  static_cast<std::uint32_t>(r));
  }
  FitOptions options;
  options.focus = 0.0; // prototypes by phase alone: else they learn the runs' own offsets
  for (const std::uint16_t f : layout.outcome_feature)
    options.exclude.push_back(f);
  const FitResult fit = fit_nominal(x, y, run_of, options);
  plan->level = nominal_section(fit.model);
  Level level;
  at = 0;
  for (const BlockRun &run : runs) {
    level.predicted.push_back(fit.mean.middleRows(at, run.blocks()));
    level.beyond.push_back(fit.beyond.middleRows(at, run.blocks()));
    at += run.blocks();
  }
  return level;
}

// Only outcomes whose agreement is by section LEVEL.
void keep_beyond(const Agreement &agreement, std::vector<Matrix> *beyond) {
  for (Matrix &run : *beyond) {
    for (std::size_t o = 0; o < agreement.source.size(); ++o) {
      if (agreement.source[o] != AGREEMENT_LEVEL)
        run.col(static_cast<Eigen::Index>(o)).setZero();
    }
  }
}

bool wants_level(const Layout &layout, const RunStore &runs) {
  Eigen::Index rows = 0;
  for (const BlockRun &run : runs)
    rows += run.blocks();
  const bool has_angle = std::any_of(layout.command.begin(), layout.command.end(),
                                     [](std::uint8_t role) { return role > 1; });
  return !layout.external && layout.outcomes() >= 3 && !has_angle &&
         rows >= 40 * static_cast<Eigen::Index>(layout.features());
}

std::string model_words(const Layout &layout, const Basis &basis, const TargetModel &m) {
  std::string text = m.quick ? "commands" : "filtered commands";
  if (m.shape)
    text += ", products";
  if (m.steep)
    text += ", directions and triple products";
  if (m.slow)
    text += ", integrals";
  if (m.initial)
    text += ", first readings";
  for (const std::size_t o : m.outside)
    text += ", sensor " + quantity_of(layout.outcome_names[o]).words;
  for (const std::uint16_t s : m.states)
    text +=
        ", " + quantity_of(layout.outcome_names[basis.states[s].outcome]).words + " rolled forward";
  return text;
}

void report_outcomes(Training *training, const Behaviour &behaviour, const Agreement &agreement) {
  const std::size_t outcomes = training->plan.layout.outcomes();
  const double alarm = static_cast<double>(training->plan.thresholds.alarm_score);
  for (std::size_t o = 0; o < outcomes; ++o) {
    OutcomeReport report;
    report.r2 = behaviour.targets[o].r2;
    report.error = behaviour.targets[o].error;
    report.model = model_words(training->plan.layout, training->plan.basis, behaviour.targets[o]);
    report.agreement = agreement.error[o];
    report.source = agreement.source[o];
    report.detectable = 1e300;
    for (const std::size_t c : {o, outcomes + o}) {
      const ChannelNoise &n = training->noise.channels[c];
      if (!n.active || (c != o && report.source == AGREEMENT_INTO))
        continue; // INTO is in the unit of another outcome
      // An offset over the later half of the run, known as well as noise and effects allow.
      const double blocks = 0.5 * kBlocksPerRun * (1.0 - n.rho) * (1.0 - n.rho);
      const double sd = n.s * std::sqrt(1.0 / std::max(blocks, 1.0) +
                                        n.effect_sd * n.effect_sd / (n.s * n.s) / 3.0);
      const double needed = sd * std::sqrt(2.0 * n.phi[0] * (alarm + 4.0));
      if (needed < report.detectable) {
        report.detectable = needed;
        report.noise = n.s;
        report.effect = n.effect_sd;
        report.rho = n.rho;
      }
    }
    training->outcomes.push_back(report);
  }
}

// A run far above the others' scores.
void find_unlike_runs(const std::vector<std::string> &paths, Training *training) {
  std::vector<double> scores;
  for (const RunScore &s : training->scores)
    scores.push_back(s.score);
  const ScoreSpread spread = score_spread(scores);
  for (std::size_t r = 0; r < paths.size(); ++r) {
    const RunScore &s = training->scores[r];
    if (s.score <= spread.unlike_bar())
      continue;
    training->unlike.push_back(r);
    const std::size_t outcomes = training->plan.layout.outcomes();
    training->warnings.push_back(fmt::format(
        "{} is unlike the other runs: judged by what they taught it scores {:.1f}, where their "
        "median is {:.1f}; '{}' deviates most. If this run is not healthy, train again without it "
        "(--leave-out-unlike does so): this image has learnt from it",
        paths[r], s.score, spread.middle,
        training->plan.layout.outcome_names[s.channel % outcomes]));
  }
}

// R2 of every outcome's behaviour; none where the predictions are the user's.
std::vector<double> explained_parts(const FlightPlan &plan, const Behaviour &behaviour) {
  std::vector<double> r2;
  for (std::size_t o = 0; o < plan.layout.outcomes() && !plan.layout.external; ++o)
    r2.push_back(behaviour.targets[o].r2);
  return r2;
}

// How much is kept and searched.
void set_search(FlightPlan *plan, const TrainOptions &options) {
  plan->ring = kRing;
  plan->pairs = 8;
  plan->budget = options.calibration.flight ? 3 : 12;
  plan->persistence = 2;
  plan->stale_s = std::max(options.stale_s, kStalePeriods * plan->period_s);
}

} // namespace

Training train(const std::vector<Log> &logs, const TrainOptions &options) {
  LogSet set(logs);
  return train(healthy_runs(&set, options.blocking), options);
}

Training train(HealthyRuns healthy, const TrainOptions &options) {
  RunStore &runs = healthy.runs;
  Training training;
  FlightPlan &plan = training.plan;
  plan = healthy.plan;
  training.warnings = healthy.warnings;
  training.input = healthy.input;
  const std::size_t outcomes = plan.layout.outcomes();
  Behaviour behaviour = plan.layout.external
                            ? external_behaviour(runs, outcomes)
                            : fit_behaviour(&plan.basis, plan.layout, healthy.integrands, runs,
                                            plan.block_rows * plan.period_s);
  if (plan.layout.external)
    learn_means(&plan.basis, runs);
  give_back_memory();
  Level level = wants_level(plan.layout, runs) ? fit_level(&plan, runs) : Level{};
  give_back_memory();
  Agreement agreement = fit_agreement(plan.layout, plan.basis, healthy.integrands, runs,
                                      behaviour.residual, behaviour.predicted, level.predicted);
  if (std::count(agreement.source.begin(), agreement.source.end(), AGREEMENT_LEVEL) == 0)
    plan.level.clear();
  const std::vector<Matrix> residual = all_residuals(runs, behaviour, agreement);
  const std::vector<Eigen::VectorXd> disturbance = disturbances(agreement, behaviour.residual);
  runs.forget_wide(); // what is not needed any more goes
  keep_beyond(agreement, &level.beyond);
  for (auto *matrices :
       {&level.predicted, &behaviour.residual, &behaviour.scatter, &agreement.remains})
    std::vector<Matrix>().swap(*matrices);
  give_back_memory();
  std::vector<SearchRun> seen;
  for (std::size_t r = 0; r < runs.size(); ++r)
    seen.push_back({&runs[r], &behaviour.predicted[r], &agreement.expected[r], &residual[r],
                    &disturbance[r], level.beyond.empty() ? nullptr : &level.beyond[r]});
  const std::vector<NoiseModel> without = fit_noises(plan, seen, agreement, &training.noise);
  if (!plan.layout.external) {
    shrink_basis(&plan.basis, &behaviour);
    plan.behaviour = behaviour_section(plan.basis, behaviour);
  }
  plan.agreement = agreement_section(agreement, plan.basis.means.size());
  set_search(&plan, options);
  choose_region(&plan, seen, explained_parts(plan, behaviour), options.calibration);
  training.scores = calibrate_runs(&plan, &training.noise, without, seen, options.calibration);
  plan.noise = noise_section(training.noise);
  training.promise = promise_for(runs.size(), options.calibration.false_alarm);
  report_outcomes(&training, behaviour, agreement);
  find_unlike_runs(healthy.paths, &training);
  return training;
}

} // namespace rim
