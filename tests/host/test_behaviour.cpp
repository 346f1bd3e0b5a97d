// SPDX-License-Identifier: MIT
// Behaviour models: a vehicle whose constants are known is learnt to its noise, what obeys nothing
// is said to, and what training computes is what flies, bit for bit.
#include "learnt.hpp"
#include "made_vehicle.hpp"
#include "train/fitter.hpp"
#include "train/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <setjmp.h>
extern "C" {
#include <cmocka.h>
#define _Static_assert static_assert
#include "monitor/monitor_private.h"
#include "rim/image.h"
}

namespace {

constexpr std::uint64_t kSeed = 4000; // of the first run everywhere here
constexpr std::size_t kLag = 0, kProduct = 1, kState = 2, kNothing = 4, kOutcomes = 5;

// Terms as flight clips them.
rim::Matrix standard_terms(const rim::Basis &basis, const rim::BlockRun &run) {
  rim::Matrix x = run.terms;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    for (Eigen::Index b = 0; b < x.rows(); ++b)
      x(b, i) = std::min(BASIS_CLIP,
                         std::max(-BASIS_CLIP, (x(b, i) - basis.center[k]) * basis.inverse_sd[k]));
  }
  return x;
}

const Learnt &plain() {
  static const Learnt learnt = learn(made_vehicles(kSeed, 12));
  return learnt;
}

void known_constants_are_learnt_to_the_noise(void **) {
  const double noise = MadeVehicle{}.noise / std::sqrt(static_cast<double>(kBlockRows));
  for (const std::size_t o : {kLag, kProduct, kState}) {
    const rim::TargetModel &m = plain().behaviour.targets[o];
    print_message("outcome %zu: R2 %.4f, error %.2f of the noise of a block\n", o, m.r2,
                  m.error / noise);
    assert_true(m.error > 0.9 * noise); // no less than can be known
    // Where the run's first readings are used, their own noise comes in.
    assert_true(m.error < (o == kState ? 2.2 : 1.4) * noise);
    assert_true(m.r2 > 0.99);
  }
}

// Coulomb friction follows the sign of a command, smooth about 0, and a load, a lever arm and a
// speed multiply: neither sums of the commands nor products of two of them say it.
void directions_and_triple_products_are_learnt(void **) {
  std::vector<rim::Log> logs = made_vehicles(kSeed, 12);
  const double noise = MadeVehicle{}.noise;
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 7);
  for (rim::Log &log : logs) {
    for (Eigen::Index t = 0; t < log.values.rows(); ++t) {
      const double a = log.values(t, 0), b = log.values(t, 1);
      log.values(t, 2) = 0.3 * a + 0.4 * a / (std::abs(a) + 0.05) + noise * rimi_rng_normal(&rng);
      log.values(t, 3) = 2.0 * a * b * b + noise * rimi_rng_normal(&rng);
    }
  }
  const Learnt l = learn(logs);
  const double of_block = noise / std::sqrt(static_cast<double>(kBlockRows));
  for (const std::size_t o : {kLag, kProduct}) {
    const rim::TargetModel &m = l.behaviour.targets[o];
    print_message("outcome %zu: error %.2f of the noise of a block\n", o, m.error / of_block);
    assert_true(m.steep && m.error < 3.0 * of_block);
    assert_false(plain().behaviour.targets[o].steep); // where nothing needs them
  }
}

// A mount slews to one place after the other, each far from the last, and is a little behind its
// command; its motor takes a current while it goes, either way. How far it is behind is small
// against how far it goes.
std::vector<rim::Log> mounts() {
  std::vector<rim::Log> logs = made_vehicles(kSeed, 12);
  const double noise = MadeVehicle{}.noise;
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 8);
  for (rim::Log &log : logs) {
    double target = 0.0, command = 0.0, place = 0.0;
    for (Eigen::Index t = 0; t < log.values.rows(); ++t) {
      if (rimi_rng_below(&rng, 60) == 0)
        target = 150.0 * rimi_rng_normal(&rng);
      const double before = command;
      command += std::clamp(target - command, -4.0, 4.0);
      place = t == 0 ? command : place + 0.6 * (command - place);
      const double way = command - before;
      log.values(t, 0) = command;
      log.values(t, 2) = place + noise * rimi_rng_normal(&rng);
      log.values(t, 3) = (way != 0.0 ? 1.0 : 0.0) + noise * rimi_rng_normal(&rng);
    }
  }
  return logs;
}

void what_follows_its_command_closely_is_learnt_to_the_noise(void **) {
  const Learnt l = learn(mounts());
  const double noise = MadeVehicle{}.noise / std::sqrt(static_cast<double>(kBlockRows));
  const rim::TargetModel &place = l.behaviour.targets[kLag];
  print_message("place: error %.2f of the noise of a block, ridge %g\n", place.error / noise,
                place.ridge);
  assert_true(place.error < 4.0 * noise && place.ridge < rim::kUsualRidge);
  assert_true(plain().behaviour.targets[kLag].ridge >= rim::kUsualRidge);
}

void what_answers_a_movement_is_learnt(void **) {
  const Learnt l = learn(mounts());
  const rim::TargetModel &current = l.behaviour.targets[kProduct];
  print_message("current: error %.3f, R2 %.3f\n", current.error, current.r2);
  assert_true(!current.still && current.r2 > 0.9);
  for (const std::size_t o : {kProduct, kState, kNothing}) // where nothing needs them
    assert_true(plain().behaviour.targets[o].still);
}

// Only the run's first readings say where s.state began; where all runs begin alike it needs none.
void the_models_that_are_needed_are_chosen(void **) {
  assert_true(plain().behaviour.targets[kState].initial);
  assert_false(plain().behaviour.targets[kLag].initial);
  MadeVehicle same;
  same.start_spread = 0.0;
  const Learnt always = learn(made_vehicles(kSeed, 12, same));
  assert_true(always.behaviour.targets[kState].r2 > 0.99);
}

// A start that differs by a few standard deviations of the noise is an effect of the run, which an
// offset from the start is judged by: were the first readings used, it would never be seen.
void a_small_difference_of_starts_stays_visible(void **) {
  MadeVehicle near;
  near.start_spread = 2.0 * MadeVehicle{}.noise / std::sqrt(static_cast<double>(kBlockRows));
  const Learnt l = learn(made_vehicles(kSeed, 12, near));
  assert_false(l.behaviour.targets[kState].initial);
  double squares = 0.0;
  for (const rim::Matrix &e : l.behaviour.residual)
    squares += std::pow(e.col(kState).mean(), 2) / 12.0;
  print_message("starts differ by %.4f, residuals by %.4f\n", near.start_spread,
                std::sqrt(squares));
  assert_true(std::sqrt(squares) > 0.5 * near.start_spread);
}

// The error is that of runs left out: what obeys nothing is not explained, however many terms.
void held_out_errors_are_honest(void **) {
  for (const std::size_t runs : {3u, 12u}) {
    const Learnt few = runs == 12 ? plain() : learn(made_vehicles(kSeed + 50, runs));
    const rim::TargetModel &m = few.behaviour.targets[kNothing];
    print_message("%zu runs: R2 of what obeys nothing %.4f\n", runs, m.r2);
    assert_true(std::fabs(m.r2) < 0.03);
    double squares = 0.0, n = 0.0;
    for (const rim::Matrix &e : few.behaviour.residual) {
      squares += e.col(kNothing).squaredNorm();
      n += static_cast<double>(e.rows());
    }
    assert_true(std::fabs(std::sqrt(squares / n) - m.error) < 1e-9 * m.error);
  }
}

// rms error of an outcome in fresh runs, by the weights that fly.
double fresh_error(const Learnt &l, std::size_t outcome, const std::vector<rim::Log> &logs) {
  const rim::TargetModel &m = l.behaviour.targets[outcome];
  const auto o = static_cast<Eigen::Index>(outcome);
  double squares = 0.0, n = 0.0;
  for (const rim::Log &log : logs) {
    const rim::BlockRun run = rim::block_run(log, l.layout, l.basis, l.options);
    const double start = m.intercept + (m.initial ? run.first[o] : 0.0);
    const Eigen::VectorXd p = standard_terms(l.basis, run) * m.weight;
    squares += (run.outcome.col(o).array() - p.array() - start).square().sum();
    n += static_cast<double>(run.blocks());
  }
  return std::sqrt(squares / n);
}

void fresh_runs_are_predicted_as_well_as_runs_left_out(void **) {
  const std::vector<rim::Log> fresh = made_vehicles(kSeed + 80, 12);
  for (const std::size_t o : {kLag, kProduct, kState}) {
    const double error = fresh_error(plain(), o, fresh), said = plain().behaviour.targets[o].error;
    print_message("outcome %zu: fresh error %.2f of the one said\n", o, error / said);
    assert_true(error < 1.3 * said && error > 0.75 * said);
  }
}

void a_run_is_predicted_without_itself(void **) {
  std::vector<rim::Log> logs = made_vehicles(kSeed, 12);
  const Eigen::Index rows = logs[4].values.rows(), half = rows / 2;
  logs[4].values.col(2).tail(half).array() += 0.5; // s.lag of run 4 alone
  const Learnt l = learn(logs);
  const Eigen::Index late = l.runs[4].blocks() / 2 - 2;
  const double own = l.behaviour.residual[4].col(kLag).tail(late).mean();
  print_message("an offset of 0.5 in one run of 12 leaves %.3f of itself\n", own / 0.5);
  assert_true(own > 0.9 * 0.5); // in a fit with the run itself a twelfth would be gone
}

// ---- training and flight ----

void same_row(const rim::Matrix &trained, Eigen::Index block, const double *flown) {
  for (Eigen::Index i = 0; i < trained.cols(); ++i)
    assert_true(trained(block, i) == flown[i]);
}

// Raw terms come to training through a division, so that they are the same up to their last bits.
void near_row(const rim::Matrix &trained, Eigen::Index block, const double *flown, double within) {
  for (Eigen::Index i = 0; i < trained.cols(); ++i)
    assert_true(std::fabs(trained(block, i) - flown[i]) <= within);
}

// A training log through the monitor: the blocks that training saw, bit for bit, and the residuals
// that the image's weights give on them. What training left out, gaps had left unknown.
void training_and_flight_see_the_same(void **) {
  MadeVehicle made;
  made.gaps = true;
  made.rows = 1200;
  // Of fewer runs all is learnt again without each, of which nothing is asked here.
  const std::vector<rim::Log> logs = made_vehicles(kSeed + 200, 12, made);
  const rim::FlightPlan plan = rim::train(logs, rim::TrainOptions{}).plan;
  rim::Monitor monitor(rim::make_image(plan), "made");
  const rim_monitor *m = monitor.get();
  const rim::BlockOptions options{plan.block_rows, plan.period_s, plan.low, plan.high, {}};
  std::size_t blocks_seen = 0, gaps = 0, left_out = 0;
  double largest = 0.0;
  for (const rim::Log &log : logs) {
    rim_monitor_reset(monitor.get());
    const rim::BlockRun run = rim::block_run(log, plan.layout, plan.basis, options);
    const rim::Matrix terms = standard_terms(plan.basis, run);
    const rim::Matrix means = rim::standard_means(plan.basis, run);
    Eigen::Index b = 0, without = 0;
    for (std::size_t t = 0; t < log.t_s.size(); ++t) {
      rim_observation row = {};
      row.t_s = log.t_s[t];
      row.context = log.values.row(static_cast<Eigen::Index>(t)).data();
      rim_verdict verdict;
      assert_int_equal(rim_monitor_step(monitor.get(), &row, &verdict), RIM_OK);
      if (verdict.blocks == static_cast<std::uint32_t>(b + without))
        continue;
      if (b == run.blocks() || run.time_s[b] != rimi_blocks_since_start_s(m->rows)) {
        assert_false(rimi_blocks_knows_all(m->rows));
        ++without;
        continue;
      }
      same_row(run.context, b, rimi_blocks_context(m->rows));
      same_row(run.outcome, b, rimi_blocks_outcomes(m->rows));
      same_row(run.scatter, b, rimi_blocks_scatter(m->rows));
      same_row(run.repeats, b, rimi_blocks_repeats(m->rows));
      same_row(run.repeats, b, m->residual + RIM_CHANNEL_REPEAT * kOutcomes);
      assert_true(run.time_s[b] == rimi_blocks_since_start_s(m->rows));
      near_row(terms, b, rimi_blocks_terms(m->rows), 1e-9);
      near_row(means, b, rimi_blocks_means(m->rows), 1e-9);
      for (std::size_t o = 0; o < kOutcomes; ++o) {
        const double p = run.outcome(b, static_cast<Eigen::Index>(o)) - m->residual[o];
        assert_true(std::fabs(p - m->predicted[o]) <= 1e-12 * (1.0 + std::fabs(p)));
        largest = std::max(largest, std::fabs(p));
      }
      ++b;
    }
    assert_true(b == run.blocks() && static_cast<std::size_t>(without) == run.left_out);
    left_out += run.left_out;
    blocks_seen += static_cast<std::size_t>(b);
    gaps += rim_monitor_get_health(m).rows.gaps;
  }
  print_message("%zu blocks, %zu left out, %zu gaps, largest prediction %.3g\n", blocks_seen,
                left_out, gaps, largest);
  assert_true(blocks_seen > 800 && left_out > 10 && gaps > 60 && largest > 0.5);
}

// A log that lacks every tenth row has as many blocks as one that has all of them: more than its
// rows would fill.
void filled_gaps_make_more_blocks_than_rows_do(void **) {
  const rim::Log whole = made_vehicle(kSeed + 300);
  rim::Log lacks = whole;
  lacks.t_s.clear();
  for (std::size_t t = 0; t < whole.t_s.size(); ++t) {
    if (t % 10 == 5)
      continue;
    lacks.values.row(static_cast<Eigen::Index>(lacks.t_s.size())) =
        whole.values.row(static_cast<Eigen::Index>(t));
    lacks.t_s.push_back(whole.t_s[t]);
  }
  lacks.values.conservativeResize(static_cast<Eigen::Index>(lacks.t_s.size()), Eigen::NoChange);
  const Learnt &l = plain();
  const Eigen::Index all = rim::block_run(whole, l.layout, l.basis, l.options).blocks();
  const rim::BlockRun run = rim::block_run(lacks, l.layout, l.basis, l.options);
  assert_true(run.blocks() >= all - 1);
  assert_true(run.blocks() > lacks.values.rows() / kBlockRows + 1);
  for (const rim::Matrix *m : {&run.context, &run.outcome, &run.terms, &run.early, &run.late})
    assert_true(m->rows() == run.blocks() && m->allFinite());
  assert_true((run.outcome.bottomRows(1).array() != 0.0).any());
}

// The image's weights are those of fit_behaviour: one computation in Eigen, one on board.
void training_and_flight_predict_the_same(void **) {
  Learnt l = plain();
  rim::shrink_basis(&l.basis, &l.behaviour);
  const std::vector<std::uint8_t> basis = rim::basis_section(l.basis);
  const std::vector<std::uint8_t> models = rim::behaviour_section(l.basis, l.behaviour);
  rim_basis view;
  assert_int_equal(rimi_basis_open(&view, basis.data(), basis.size(),
                                   static_cast<std::uint32_t>(l.layout.features()), kOutcomes),
                   RIM_OK);
  rim_behaviour flight;
  assert_int_equal(
      rimi_behaviour_open(&flight, models.data(), models.size(), view.terms, kOutcomes), RIM_OK);
  const rim::BlockRun run = rim::block_run(made_vehicle(kSeed + 300), l.layout, l.basis, l.options);
  const rim::Matrix terms = standard_terms(l.basis, run);
  double predicted[2 * kOutcomes];
  for (Eigen::Index b = 0; b < run.blocks(); ++b) {
    rimi_behaviour_predict(&flight, terms.row(b).data(), run.first.data(), predicted);
    for (std::size_t t = 0; t < 2 * kOutcomes; ++t) {
      const rim::TargetModel &model = l.behaviour.targets[t];
      const double start = model.initial ? run.first[static_cast<Eigen::Index>(t)] : 0.0;
      const double own = start + model.intercept + terms.row(b).dot(model.weight.transpose());
      assert_true(std::fabs(predicted[t] - own) <= 1e-9 * (1.0 + std::fabs(own)));
    }
  }
  assert_true(run.blocks() > 200);
}

// A switch that is on at the start of one run in thirty, and a speed that differs a little.
void no_run_that_was_learnt_from_began_late(void **) {
  std::vector<Eigen::VectorXd> starts;
  for (int run = 0; run < 30; ++run)
    starts.emplace_back(Eigen::Vector2d(run == 14 ? 1.0 : 0.0, 5.0 + 0.1 * (run % 5)));
  starts.emplace_back(); // of a run without rows
  rim::Basis basis;
  rim::learn_start(&basis, starts, {0.0, 0.0}, {1.0, 20.0});
  const auto limit = [&basis](std::size_t f) { return BASIS_START_LIMIT * basis.start_sd[f]; };
  for (int f = 0; f < 2; ++f) {
    for (int run = 0; run < 30; ++run)
      assert_true(std::fabs(starts[static_cast<std::size_t>(run)][f] -
                            basis.start[static_cast<std::size_t>(f)]) <
                  limit(static_cast<std::size_t>(f)));
  }
  assert_true(limit(0) < 1.5 && limit(1) < 2.0); // what is far from all is late
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const CMUnitTest tests[] = {
      cmocka_unit_test(known_constants_are_learnt_to_the_noise),
      cmocka_unit_test(directions_and_triple_products_are_learnt),
      cmocka_unit_test(what_follows_its_command_closely_is_learnt_to_the_noise),
      cmocka_unit_test(what_answers_a_movement_is_learnt),
      cmocka_unit_test(the_models_that_are_needed_are_chosen),
      cmocka_unit_test(a_small_difference_of_starts_stays_visible),
      cmocka_unit_test(held_out_errors_are_honest),
      cmocka_unit_test(fresh_runs_are_predicted_as_well_as_runs_left_out),
      cmocka_unit_test(a_run_is_predicted_without_itself),
      cmocka_unit_test(no_run_that_was_learnt_from_began_late),
      cmocka_unit_test(training_and_flight_see_the_same),
      cmocka_unit_test(training_and_flight_predict_the_same),
      cmocka_unit_test(filled_gaps_make_more_blocks_than_rows_do),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
