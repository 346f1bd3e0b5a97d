// SPDX-License-Identifier: MIT
// Two basins that keep what flows in are rolled forward from the start of a run on the commands
// alone: their levels are predicted to the noise, by the flight code as in training, and whatever
// their sensors say.
#include "base/rng.h"
#include "learnt.hpp"
#include "train/rolled.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include "image/basis.h"
#include <cmocka.h>
}

namespace {

constexpr std::uint64_t kSeed = 8100; // of the first run
constexpr std::size_t kRuns = 14, kRows = 2000;
constexpr double kPeriod = 0.5, kNoise = 0.02;
enum { kUpper, kLower, kCurrent, kOutcomes };

// A pump fills the upper basin, a valve lets as much of it into the lower one as stands in it, and
// that runs dry through a narrow pipe. The pump's current follows its command at once.
rim::Log basins(std::uint64_t seed, double bias_of_lower = 0.0) {
  rim_rng rng;
  rimi_rng_seed(&rng, seed, 3);
  rim::Log log;
  log.path = "basins" + std::to_string(seed);
  log.columns = {{"u.pump", "", rim::Role::command},
                 {"u.valve", "", rim::Role::command},
                 {"s.upper_m", "m", rim::Role::sensor},
                 {"s.lower_m", "m", rim::Role::sensor},
                 {"s.pump_A", "A", rim::Role::sensor}};
  double upper = 2.0 + 4.0 * rimi_rng_uniform(&rng), lower = 1.0 + 3.0 * rimi_rng_uniform(&rng);
  double pump = 0.5, valve = 0.5;
  log.values.resize(static_cast<Eigen::Index>(kRows), static_cast<Eigen::Index>(2 + kOutcomes));
  for (std::size_t t = 0; t < kRows; ++t) {
    if (t % 160 == 0)
      pump = 0.1 + 0.8 * rimi_rng_uniform(&rng);
    if (t % 210 == 0)
      valve = 0.2 + 0.8 * rimi_rng_uniform(&rng);
    const double passes = 0.02 * valve * upper;
    upper += kPeriod * (0.1 * pump - passes);
    lower += kPeriod * (passes - 0.004 * lower * lower);
    const double off = t > kRows / 2 ? bias_of_lower : 0.0; // of the sensor
    log.t_s.push_back(kPeriod * static_cast<double>(t));
    log.values.row(static_cast<Eigen::Index>(t)) << pump, valve,
        upper + kNoise * rimi_rng_normal(&rng), lower + off + kNoise * rimi_rng_normal(&rng),
        5.0 * pump + kNoise * rimi_rng_normal(&rng);
  }
  return log;
}

// Without the rows from `first` on, so many.
rim::Log with_gap(const rim::Log &log, std::size_t first, std::size_t missing) {
  rim::Log rest = log;
  const auto at = static_cast<std::ptrdiff_t>(first);
  const auto end = static_cast<std::ptrdiff_t>(first + missing);
  rest.t_s.erase(rest.t_s.begin() + at, rest.t_s.begin() + end);
  rest.values.resize(static_cast<Eigen::Index>(rest.t_s.size()), log.values.cols());
  rest.values << log.values.topRows(at), log.values.bottomRows(log.values.rows() - end);
  return rest;
}

// gap: rows that each run lacks, somewhere.
Learnt learn_basins(std::size_t gap = 0) {
  std::vector<rim::Log> logs;
  for (std::uint64_t i = 0; i < kRuns; ++i)
    logs.push_back(with_gap(basins(kSeed + i), 200 + 110 * i, gap));
  return learn(logs);
}

// Whether the model of an outcome takes the state of another (or its own).
bool rolls_on(const Learnt &l, std::size_t outcome, std::size_t of) {
  const std::vector<std::uint16_t> &states = l.behaviour.targets[outcome].states;
  return std::any_of(states.begin(), states.end(),
                     [&](std::uint16_t s) { return l.basis.states[s].outcome == of; });
}

void levels_are_rolled_and_currents_are_not(void **) {
  const Learnt l = learn_basins();
  assert_true(rolls_on(l, kUpper, kUpper));
  assert_true(rolls_on(l, kLower, kLower));
  assert_true(l.behaviour.targets[kCurrent].states.empty());
  for (const std::size_t o : {kUpper, kLower}) {
    assert_true(l.behaviour.targets[o].r2 > 0.995);
    assert_true(l.behaviour.targets[o].error < 2.5 * kNoise);
  }
}

// What the flight code says of a fresh run by the models that fly.
Eigen::VectorXd predicted(const Learnt &l, const rim::Log &log, std::size_t outcome) {
  const rim::BlockRun run = rim::block_run(log, l.layout, l.basis, l.options);
  const rim::TargetModel &m = l.behaviour.targets[outcome];
  Eigen::VectorXd p = Eigen::VectorXd::Constant(run.blocks(), m.intercept);
  for (Eigen::Index i = 0; i < run.terms.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    p.array() +=
        m.weight[i] * ((run.terms.col(i).array() - l.basis.center[k]) * l.basis.inverse_sd[k])
                          .max(-BASIS_CLIP)
                          .min(BASIS_CLIP);
  }
  return m.initial ? Eigen::VectorXd(p.array() + run.first[static_cast<Eigen::Index>(outcome)]) : p;
}

void a_fresh_run_is_predicted_whatever_its_sensor_says(void **) {
  Learnt l = learn_basins();
  rim::shrink_basis(&l.basis, &l.behaviour);
  assert_int_equal(l.basis.states.size(), 2);
  const rim::Log healthy = basins(kSeed + 100), biased = basins(kSeed + 100, 0.5);
  const rim::BlockRun run = rim::block_run(healthy, l.layout, l.basis, l.options);
  for (const std::size_t o : {kUpper, kLower}) {
    const Eigen::VectorXd p = predicted(l, healthy, o);
    const Eigen::VectorXd e = run.outcome.col(static_cast<Eigen::Index>(o)) - p;
    assert_true(std::sqrt(e.squaredNorm() / static_cast<double>(e.size())) < 3.0 * kNoise);
    assert_true(predicted(l, biased, o) == p); // to the last bit
  }
}

// What is learnt from runs that lack rows is as good, and predicts a run that does: behind the gap
// the levels go on from their readings, and what was commanded in it is soon without effect.
void gaps_cost_little(void **) {
  constexpr std::size_t gap = 100, at = 900; // rows; the commands move several times in so many
  Learnt l = learn_basins(gap);
  std::size_t left_out = 0, blocks = 0;
  for (const rim::BlockRun &run : l.runs) {
    left_out += run.left_out;
    blocks += static_cast<std::size_t>(run.blocks());
  }
  assert_true(left_out > 0 && left_out < blocks / 3);
  for (const std::size_t o : {kUpper, kLower, kCurrent})
    assert_true(l.behaviour.targets[o].error < 2.5 * kNoise);
  rim::shrink_basis(&l.basis, &l.behaviour);
  const rim::Log lacks = with_gap(basins(kSeed + 102), at, gap);
  const rim::BlockRun run = rim::block_run(lacks, l.layout, l.basis, l.options);
  for (const std::size_t o : {kUpper, kLower}) {
    const Eigen::VectorXd e =
        run.outcome.col(static_cast<Eigen::Index>(o)) - predicted(l, lacks, o);
    assert_true(std::sqrt(e.squaredNorm() / static_cast<double>(e.size())) < 3.0 * kNoise);
  }
}

// The columns that training makes of the states are those that the flight code makes of them.
void training_and_flight_make_the_same_terms(void **) {
  const Learnt l = learn_basins();
  const rim::BlockRun run = rim::block_run(basins(kSeed + 101), l.layout, l.basis, l.options);
  Eigen::Index wide = 0;
  while (l.basis.terms[static_cast<std::size_t>(wide)].op != BASIS_ROLLED)
    ++wide;
  rim::Matrix values(run.blocks(), static_cast<Eigen::Index>(l.basis.states.size()));
  bool has_hinge = false;
  for (std::size_t i = static_cast<std::size_t>(wide); i < l.basis.terms.size(); ++i) {
    const rim::Basis::Term &t = l.basis.terms[i];
    if (t.b == BASIS_PLAIN && t.c == BASIS_PLAIN)
      values.col(t.a) = run.terms.col(static_cast<Eigen::Index>(i));
    has_hinge = has_hinge || (t.c >= BASIS_HINGE && t.c != BASIS_PLAIN);
  }
  assert_true(has_hinge);
  const rim::Matrix all = rim::with_rolled(l.basis, run.terms.leftCols(wide), values);
  assert_int_equal(all.cols(), run.terms.cols());
  assert_true((all - run.terms).cwiseAbs().maxCoeff() < 1e-9);
}

// States and rates that no model uses do not fly, and the others find theirs.
void unused_states_do_not_fly(void **) {
  Learnt l = learn_basins();
  for (std::size_t t = 0; t < l.behaviour.targets.size(); ++t) {
    if (t == kUpper)
      continue;
    l.behaviour.targets[t].weight.setZero();
    l.behaviour.targets[t].states.clear();
  }
  Eigen::VectorXd &weight = l.behaviour.targets[kUpper].weight;
  std::uint16_t upper = 0;
  while (l.basis.states[upper].outcome != kUpper)
    ++upper;
  for (Eigen::Index i = 0; i < weight.size(); ++i) {
    const rim::Basis::Term &t = l.basis.terms[static_cast<std::size_t>(i)];
    if (t.op == BASIS_ROLLED && (t.a != upper || t.b != BASIS_PLAIN || t.c != BASIS_PLAIN))
      weight[i] = 0.0;
  }
  rim::shrink_basis(&l.basis, &l.behaviour);
  assert_int_equal(l.basis.states.size(), 1); // what flows on does not come back
  assert_int_equal(l.basis.states.front().outcome, kUpper);
  for (const rim::Basis::Rate &rate : l.basis.rates)
    assert_int_equal(rate.state, 0);
  assert_true(basis_opens(l));
}

// A plant of more basins than there are states: as many are rolled forward as fly.
void a_plant_of_many_states_is_learnt(void **) {
  constexpr std::size_t runs = 8, rows = 1000, basins_of_plant = BASIS_MAX_STATES + 2;
  std::vector<rim::Log> logs;
  for (std::uint64_t seed = kSeed + 200; seed < kSeed + 200 + runs; ++seed) {
    rim_rng rng;
    rimi_rng_seed(&rng, seed, 3);
    rim::Log log;
    log.path = "plant" + std::to_string(seed);
    log.columns = {{"u.pump", "", rim::Role::command}, {"u.valve", "", rim::Role::command}};
    Eigen::VectorXd level(basins_of_plant);
    for (Eigen::Index i = 0; i < level.size(); ++i) {
      log.columns.push_back({"s.level" + std::to_string(i) + "_m", "m", rim::Role::sensor});
      level[i] = 2.0 + 2.0 * rimi_rng_uniform(&rng);
    }
    log.values.resize(static_cast<Eigen::Index>(rows), 2 + level.size());
    double pump = 0.5, valve = 0.5;
    for (std::size_t t = 0; t < rows; ++t) {
      if (t % 80 == 0)
        pump = 0.1 + 0.8 * rimi_rng_uniform(&rng);
      if (t % 110 == 0)
        valve = 0.2 + 0.8 * rimi_rng_uniform(&rng);
      log.t_s.push_back(kPeriod * static_cast<double>(t));
      const auto row = static_cast<Eigen::Index>(t);
      log.values(row, 0) = pump;
      log.values(row, 1) = valve;
      for (Eigen::Index i = 0; i < level.size(); ++i) {
        const double each = 1.0 + 0.2 * static_cast<double>(i);
        level[i] += kPeriod * (0.1 * pump - 0.02 / each * valve * level[i]);
        log.values(row, 2 + i) = level[i] + kNoise * rimi_rng_normal(&rng);
      }
    }
    logs.push_back(std::move(log));
  }
  const Learnt l = learn(logs);
  assert_int_equal(l.basis.states.size(), BASIS_MAX_STATES);
  assert_true(basis_opens(l));
}

} // namespace

int main() {
  const CMUnitTest tests[] = {cmocka_unit_test(levels_are_rolled_and_currents_are_not),
                              cmocka_unit_test(a_fresh_run_is_predicted_whatever_its_sensor_says),
                              cmocka_unit_test(gaps_cost_little),
                              cmocka_unit_test(training_and_flight_make_the_same_terms),
                              cmocka_unit_test(unused_states_do_not_fly),
                              cmocka_unit_test(a_plant_of_many_states_is_learnt)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
