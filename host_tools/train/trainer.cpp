// SPDX-License-Identifier: MIT
#include "train/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>

#include "image/names.hpp"
#include "util/error.hpp"
#include "util/memory.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

extern "C" {
#include "image/basis.h"
#include "image/nominal.h"
}

namespace rim {

namespace {

constexpr double kBlocksPerRun = 240.0;
constexpr double kStalePeriods = 5.0;
constexpr double kUpdatesPerRun = 12.0;
constexpr std::uint32_t kRing = 384; // calibrate_runs() gives flight its own
// The mean of a few readings is too noisy to tell what comes next.
constexpr std::uint32_t kLeastRowsOfStep = 4;
constexpr std::size_t kNamedAtMost = 3; // features that a model does without
// Error over behaviour's, above which the others' residuals say nothing.
constexpr double kLeastAgreement = 0.95;

// Channels by kind: behaviour, agreement, scatter, repeats, and steps where there are any; blocks x
// channels per run.
std::vector<Matrix> all_residuals(const RunStore &runs, const Behaviour &behaviour,
                                  const Agreement &agreement) {
  std::vector<Matrix> all;
  for (std::size_t r = 0; r < runs.all(); ++r) {
    const Eigen::Index o = runs[r].outcome.cols();
    Matrix m(runs[r].blocks(), (RIM_MONITOR_KINDS + (agreement.has_steps() ? 1 : 0)) * o);
    m.leftCols(o) = behaviour.residual[r];
    m.middleCols(o, o) = agreement.remains[r];
    m.middleCols(2 * o, o) = behaviour.scatter[r];
    m.middleCols(3 * o, o) = runs[r].repeats;
    if (agreement.has_steps())
      m.rightCols(o) = agreement.steps[r];
    all.push_back(m);
  }
  return all;
}

// A sensor may read the same in all of a healthy run and another value in the next: a tyre's
// pressure, an ambient temperature. Its first readings predict it without any error, of which no
// noise can be learnt. A hundredth of what runs differ by is the least that is seen of it then.
void settle_exact(NoiseModel *noise, const std::vector<SearchRun> &seen,
                  const std::vector<std::size_t> &which, std::size_t outcomes) {
  constexpr double exact = 1e-6, least = 0.01; // of what runs differ by
  constexpr double rounds = 1e-7;              // of a value, in single precision
  for (std::size_t o = 0; o < outcomes; ++o) {
    double low = 1e300, high = -1e300;
    for (const std::size_t r : which) {
      const auto x = seen[r].blocks->outcome.col(static_cast<Eigen::Index>(o));
      low = std::min(low, x.minCoeff());
      high = std::max(high, x.maxCoeff());
    }
    // One that is the same in all runs teaches nothing but its rounding.
    const bool is_constant = !(high - low > rounds * std::max(std::abs(low), std::abs(high)));
    for (ChannelNoise *c : {&noise->channels[o], &noise->channels[outcomes + o]}) {
      if (is_constant) {
        c->active = false;
      } else if (!c->active || c->s < exact * (high - low)) {
        c->active = true;
        c->s = least * (high - low);
        c->combination.resize(0, c->combination.cols());
      }
    }
  }
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

// An outcome without a model of its step has no such channel.
void settle_steps(NoiseModel *noise, const Agreement &agreement, std::size_t outcomes) {
  for (std::size_t o = 0; agreement.has_steps() && o < outcomes; ++o) {
    if (!agreement.has_step[o])
      noise->channels[RIM_CHANNEL_STEP * outcomes + o].active = false;
  }
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
  std::vector<std::uint8_t> section; // empty: there is none
  std::vector<Matrix> predicted;     // of all() runs: blocks x outcomes
  std::vector<Matrix> beyond;        // 1 where a block lies beyond what the other runs taught
};

// Runs that were not learnt from, as the flight code judges them.
void judge_level(const Layout &layout, const RunStore &runs, Level *level) {
  rim_nominal model;
  if (rimi_nominal_open(&model, level->section.data(), level->section.size()) != RIM_OK)
    throw std::logic_error("section LEVEL is not as the library wants it");
  const std::size_t outcomes = layout.outcomes();
  auto beyond = std::make_unique<bool[]>(outcomes);
  for (std::size_t r = runs.size(); r < runs.all(); ++r) {
    const Matrix x = reading_inputs(layout, runs[r].context);
    level->predicted.push_back(predict_flight(level->section, x).mean);
    Matrix of_run(x.rows(), static_cast<Eigen::Index>(outcomes));
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      if (rimi_nominal_beyond(&model, x.row(i).data(), layout.outcome_feature.data(),
                              beyond.get()) != RIM_OK)
        throw std::logic_error("rimi_nominal_beyond");
      for (std::size_t o = 0; o < outcomes; ++o)
        of_run(i, static_cast<Eigen::Index>(o)) = beyond[o] ? 1.0 : 0.0;
    }
    level->beyond.push_back(of_run);
  }
}

// Whether an image holds its numbers: a variance of what is very large or small in its unit is none
// of single precision.
bool can_be_held(const std::vector<std::uint8_t> &level) {
  rim_nominal model;
  return rimi_nominal_open(&model, level.data(), level.size()) != RIM_E_DATA;
}

Level fit_level(const Layout &layout, const RunStore &runs) {
  Eigen::Index rows = 0;
  for (const BlockRun &run : runs)
    rows += run.blocks();
  Matrix x(rows, reading_inputs(layout));
  Matrix y(rows, static_cast<Eigen::Index>(layout.outcomes()));
  std::vector<std::uint32_t> run_of;
  Eigen::Index at = 0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    x.middleRows(at, runs[r].blocks()) = reading_inputs(layout, runs[r].context);
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
  Level level;
  level.section = nominal_section(fit.model);
  if (!can_be_held(level.section))
    return {};
  at = 0;
  for (const BlockRun &run : runs) {
    level.predicted.push_back(fit.mean.middleRows(at, run.blocks()));
    level.beyond.push_back(fit.beyond.middleRows(at, run.blocks()));
    at += run.blocks();
  }
  judge_level(layout, runs, &level);
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
  return !layout.external && layout.outcomes() >= 3 && rows >= 40 * reading_inputs(layout) &&
         reading_inputs(layout) <= RIM_NOMINAL_MAX_INPUTS;
}

bool wants_products(const Layout &layout) { return !layout.external && layout.outcomes() >= 3; }

// Of a model that does without some features.
std::string without_words(const Layout &layout, const std::vector<std::uint16_t> &without) {
  if (without.size() > kNamedAtMost)
    return fmt::format(", without {} inputs", without.size());
  std::string text;
  for (const std::uint16_t f : without)
    text += (text.empty() ? ", without " : " and ") + quantity_of(layout.feature_names[f]).words;
  return text;
}

// Whether a model has terms of how commands move.
bool moves(const Basis &basis, const TargetModel &m) {
  return !m.still && std::any_of(basis.terms.begin(), basis.terms.end(), [](const auto &term) {
    return term.group == TermGroup::movement;
  });
}

std::string model_words(const Layout &layout, const Basis &basis, const TargetModel &m) {
  std::string text = m.quick ? "commands" : "filtered commands";
  if (moves(basis, m))
    text += ", how they move";
  if (m.shape)
    text += ", products";
  if (m.steep)
    text += ", directions and triple products";
  if (m.slow)
    text += ", integrals";
  if (m.initial)
    text += ", first readings";
  for (const std::size_t o : m.outside) {
    if (std::find(m.without.begin(), m.without.end(), layout.outcome_feature[o]) == m.without.end())
      text += ", sensor " + quantity_of(layout.outcome_names[o]).words;
  }
  for (const std::uint16_t s : m.states)
    text +=
        ", " + quantity_of(layout.outcome_names[basis.states[s].outcome]).words + " rolled forward";
  return text + without_words(layout, m.without);
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
    report.detectable = std::numeric_limits<double>::infinity();
    for (const std::size_t c : {o, outcomes + o}) {
      const ChannelNoise &n = training->noise.channels[c];
      if (!n.active || (c != o && report.source == AGREEMENT_INTO))
        continue; // INTO is in the unit of another outcome
      // An offset over the later half of the run, known as well as noise and effects allow. Half of
      // its blocks move more than is usual.
      const double usual = 1.0 - n.rho, moving = 1.0 - n.rho_of(true);
      const double blocks = 0.25 * kBlocksPerRun * (usual * usual + moving * moving);
      const double sd = n.s * std::sqrt(1.0 / std::max(blocks, 1.0) +
                                        n.effect_sd * n.effect_sd / (n.s * n.s) / 3.0);
      const double needed = sd * std::sqrt(2.0 * n.phi[0] * (alarm + 4.0));
      if (needed < report.detectable) {
        report.detectable = needed;
        report.noise = n.s;
        report.effect = n.effect_sd;
        report.rho = n.rho + 0.5 * n.rho_rise;
      }
    }
    training->outcomes.push_back(report);
  }
}

// A run far above the others' scores.
void find_unlike_runs(Training *training) {
  std::vector<double> scores;
  for (const RunScore &s : training->scores)
    scores.push_back(s.score);
  const ScoreSpread spread = score_spread(scores);
  for (std::size_t r = 0; r < scores.size(); ++r) {
    const RunScore &s = training->scores[r];
    if (s.score <= spread.unlike_bar())
      continue;
    training->unlike.push_back(r);
    const std::size_t outcomes = training->plan.layout.outcomes();
    training->warnings.push_back(fmt::format(
        "{} is unlike the other runs: judged by what they taught it scores {:.1f}, where their "
        "median is {:.1f}; '{}' deviates most. If this run is not healthy, train again without it "
        "(--leave-out-unlike does so): this image has learnt from it",
        training->paths[r], s.score, spread.middle,
        training->plan.layout.outcome_names[s.channel % outcomes]));
  }
}

double block_s(const FlightPlan &plan) { return plan.block_rows * plan.period_s; }

// R2 of every outcome's behaviour; none where the predictions are the user's.
std::vector<double> explained_parts(const FlightPlan &plan, const Behaviour &behaviour) {
  std::vector<double> r2;
  for (std::size_t o = 0; o < plan.layout.outcomes() && !plan.layout.external; ++o)
    r2.push_back(behaviour.targets[o].r2);
  return r2;
}

// How much is kept and searched, and how often an alarm is updated: the last update is to come soon
// before a run ends, however short runs are.
void set_search(FlightPlan *plan, const std::vector<SearchRun> &seen, const TrainOptions &options) {
  Eigen::Index blocks = 0;
  for (const SearchRun &run : seen)
    blocks += run.blocks->blocks();
  const double run_s =
      block_s(*plan) * static_cast<double>(blocks) / static_cast<double>(seen.size());
  plan->inhibit_s = std::min(plan->inhibit_s, run_s / kUpdatesPerRun);
  plan->ring = kRing;
  plan->pairs = 8;
  plan->budget = options.calibration.flight ? 3 : 12;
  plan->persistence = 2;
  plan->stale_s = std::max(options.stale_s, kStalePeriods * plan->period_s);
}

// What is learnt of runs, and what it says of all() of them by models without them.
struct Learnt {
  Basis basis;
  Behaviour behaviour;
  Level level;
  Agreement agreement;
  std::vector<Matrix> residual; // blocks x channels
  std::vector<Eigen::VectorXd> disturbance;
};

// products: section QUADRATIC may be used; a small processor in flight has no time for it.
Learnt learn(const HealthyRuns &healthy, const RunStore &runs, bool products) {
  const Layout &layout = healthy.plan.layout;
  Learnt l;
  l.basis = healthy.plan.basis;
  l.behaviour = layout.external ? external_behaviour(runs, layout.outcomes())
                                : fit_behaviour(&l.basis, layout, healthy.integrands, runs,
                                                block_s(healthy.plan));
  if (layout.external)
    learn_means(&l.basis, runs);
  give_back_memory();
  if (wants_level(layout, runs))
    l.level = fit_level(layout, runs);
  give_back_memory();
  l.agreement =
      fit_agreement(layout, l.basis, healthy.integrands, runs, l.behaviour.residual,
                    l.behaviour.predicted, l.level.predicted, products && wants_products(layout),
                    healthy.plan.block_rows >= kLeastRowsOfStep);
  const std::vector<int> &source = l.agreement.source;
  if (std::count(source.begin(), source.end(), AGREEMENT_LEVEL) == 0)
    l.level.section.clear();
  l.residual = all_residuals(runs, l.behaviour, l.agreement);
  l.disturbance = disturbances(l.agreement, l.behaviour.residual);
  keep_beyond(l.agreement, &l.level.beyond);
  for (auto *matrices :
       {&l.level.predicted, &l.behaviour.residual, &l.behaviour.scatter, &l.agreement.remains})
    std::vector<Matrix>().swap(*matrices);
  return l;
}

// Views of all() runs; both must outlive them.
std::vector<SearchRun> seen_runs(const RunStore &runs, const Learnt &l) {
  std::vector<SearchRun> seen;
  for (std::size_t r = 0; r < runs.all(); ++r)
    seen.push_back({&runs[r], &l.behaviour.predicted[r], &l.agreement.expected[r], &l.residual[r],
                    &l.disturbance[r], l.level.beyond.empty() ? nullptr : &l.level.beyond[r]});
  return seen;
}

// Of the runs that are not in this fold (kFolds: of all).
NoiseModel noise_without(const HealthyRuns &healthy, const Learnt &l,
                         const std::vector<SearchRun> &seen, std::size_t fold) {
  std::vector<std::size_t> which;
  for (std::size_t r = 0; r < seen.size(); ++r) {
    if (r % kFolds != fold)
      which.push_back(r);
  }
  const std::size_t outcomes = healthy.plan.layout.outcomes();
  NoiseModel noise = fit_noise(l.basis, seen, which, block_s(healthy.plan));
  settle_exact(&noise, seen, which, outcomes);
  settle_repeats(&noise, outcomes);
  settle_agreement(&noise, l.agreement, outcomes);
  settle_steps(&noise, l.agreement, outcomes);
  return noise;
}

// Every run with what it is judged by, and what these views are of.
struct Judgement {
  std::vector<std::unique_ptr<const RunStore>> stores;
  std::vector<std::unique_ptr<const Learnt>> learnt;
  std::vector<std::unique_ptr<const NoiseModel>> noise;
  std::vector<JudgedRun> runs;
};

// By noise without the run: one whose own effects were learnt is no guide to what a new one shows.
Judgement judge_many(const HealthyRuns &healthy, const Learnt &learnt,
                     const std::vector<SearchRun> &seen) {
  Judgement j;
  for (std::size_t f = 0; f < std::min(kFolds, seen.size()); ++f)
    j.noise.push_back(std::make_unique<const NoiseModel>(noise_without(healthy, learnt, seen, f)));
  for (std::size_t r = 0; r < seen.size(); ++r)
    j.runs.push_back({seen[r], &learnt.basis, j.noise[r % kFolds].get()});
  return j;
}

// By models and noise that are learnt again without the run.
Judgement judge_few(const HealthyRuns &healthy, bool products) {
  Judgement j;
  j.runs.resize(healthy.runs.size());
  Progress progress("learn without each", j.runs.size());
  for (std::size_t r = 0; r < j.runs.size(); ++r) {
    j.stores.push_back(std::make_unique<const RunStore>(healthy.runs.without(r)));
    const RunStore &store = *j.stores.back();
    j.learnt.push_back(std::make_unique<const Learnt>(learn(healthy, store, products)));
    const std::vector<SearchRun> all = seen_runs(store, *j.learnt.back());
    j.noise.push_back(std::make_unique<const NoiseModel>(
        noise_without(healthy, *j.learnt.back(), {all.begin(), all.end() - 1}, kFolds)));
    j.runs[r] = {all.back(), &j.learnt.back()->basis, j.noise.back().get()};
    progress.add();
  }
  return j;
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
  const bool few = is_learnt_again(runs.size(), plan.layout.external);
  const bool products = !options.calibration.flight;
  Judgement judgement = few ? judge_few(healthy, products) : Judgement{};
  Learnt learnt = learn(healthy, runs, products);
  runs.forget_wide(); // what is not needed any more goes
  give_back_memory();
  const std::vector<SearchRun> seen = seen_runs(runs, learnt);
  training.noise = noise_without(healthy, learnt, seen, kFolds);
  if (!few)
    judgement = judge_many(healthy, learnt, seen);
  plan.basis = learnt.basis;
  if (!plan.layout.external) {
    shrink_basis(&plan.basis, &learnt.behaviour);
    plan.behaviour = behaviour_section(plan.basis, learnt.behaviour);
  }
  plan.agreement = agreement_section(learnt.agreement, plan.basis.means.size());
  plan.level = learnt.level.section;
  plan.quadratic = quadratic_section(learnt.agreement.quadratic);
  set_search(&plan, seen, options);
  choose_region(&plan, seen, explained_parts(plan, learnt.behaviour), options.calibration);
  training.scores = calibrate_runs(&plan, &training.noise, judgement.runs, options.calibration);
  plan.noise = noise_section(training.noise);
  training.promise = promise_for(runs.size(), options.calibration.false_alarm);
  report_outcomes(&training, learnt.behaviour, learnt.agreement);
  training.paths = healthy.paths;
  find_unlike_runs(&training);
  return training;
}

} // namespace rim
