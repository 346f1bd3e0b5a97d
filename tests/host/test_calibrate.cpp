// SPDX-License-Identifier: MIT
// Calibration: what is promised is kept on runs that nothing has seen, by the flight code's search,
// and no run is judged by what it taught itself.
#include "check.hpp"
#include "made_noise.hpp"
#include "made_vehicle.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"

extern "C" {
#include "search/search.h"
}

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>

namespace {

constexpr std::uint64_t kSeed = 325;

void promises_follow_the_ranks(void **) {
  for (std::size_t n = 1; n < 300; ++n) {
    for (const double wished : {0.001, 0.01, 0.05, 0.1, 0.5}) {
      const rim::Promise promise = rim::promise_for(n, wished);
      assert_true(promise.rank >= 1 && promise.rank <= n);
      const double exact = (static_cast<double>(n + 1) - promise.rank) / static_cast<double>(n + 1);
      assert_true(std::abs(promise.rate - exact) < 1e-15);
      // As wished or, with too few runs, the best that they allow; and no lower rank would do.
      assert_true(promise.rate <= wished + 1e-9 || promise.rank == n);
      const double lower = exact + 1.0 / static_cast<double>(n + 1);
      assert_true(promise.rank == 1 || lower > wished - 1e-9);
    }
  }
  assert_int_equal(rim::promise_for(8, 0.05).rank, 8);
  assert_true(std::abs(rim::promise_for(8, 0.05).rate - 1.0 / 9.0) < 1e-15);
  rim::Thresholds t;
  rim::set_alarm(&t, {3.0F, 1.0F, 2.0F, 5.0F, 4.0F, 8.0F, 7.0F, 6.0F}, rim::CalibrationOptions{});
  assert_int_equal(t.rank, 8);
  assert_true(t.alarm_score > 8.0F && t.alarm_score < 8.00001F && t.warn_score <= t.alarm_score);
  assert_true(std::abs(t.promised_rate - 1.0F / 9.0F) < 1e-7F);
}

// How many sets of n runs, whose scores have an exponential tail, get a threshold that keeps the
// promise; `threshold` is of the ascending scores.
template <typename Threshold>
double share_of_sets_kept(std::size_t n, double rate, const Threshold &threshold) {
  std::mt19937_64 draw(kSeed);
  std::exponential_distribution<double> tail(0.5);
  std::size_t kept = 0;
  constexpr std::size_t sets = 2000;
  for (std::size_t k = 0; k < sets; ++k) {
    std::vector<double> scores(n);
    for (double &s : scores)
      s = tail(draw);
    std::sort(scores.begin(), scores.end());
    kept += std::exp(-0.5 * threshold(scores)) <= rate ? 1U : 0U;
  }
  return static_cast<double>(kept) / sets;
}

// The threshold lets more than the promise through in no more of the sets than said.
void the_promise_holds_in_most_sets(void **) {
  for (const std::size_t n : {12U, 20U, 29U, 30U, 50U, 100U, 300U}) {
    const rim::Promise promise = rim::promise_for(n, 0.05);
    const double by_order = share_of_sets_kept(n, promise.rate, [&](const auto &scores) {
      return scores[promise.rank - 1] +
             rim::set_margin(2.0, n - promise.rank + 1, rim::kEachKept);
    });
    const double by_tail = share_of_sets_kept(n, promise.rate, [&](const auto &scores) {
      return rim::tail_bound(rim::score_spread(scores), promise.rate, rim::kEachKept);
    });
    const double asked = std::max(promise.rate, 0.05);
    const double by_both = share_of_sets_kept(n, asked, [&](const auto &scores) {
      const std::vector<float> alone(scores.begin(), scores.end());
      rim::Thresholds t;
      rim::set_alarm_from_runs(&t, alone, alone, rim::CalibrationOptions{});
      return static_cast<double>(t.alarm_score);
    });
    print_message("%zu runs: kept in %.3f, %.3f and %.3f of the sets\n", n, by_order, by_tail,
                  by_both);
    assert_true(std::abs(by_order - rim::kEachKept) < 0.02); // four standard errors
    assert_true(std::abs(by_tail - rim::kEachKept) < 0.02);
    assert_true(by_both > rim::sets_kept(n));
  }
}

// Two odd runs of fifty do not set the alarm: no run counts more than its place in the tail of the
// others allows. The scores that the image keeps agree: no alarm has a p-value above the promise.
void odd_runs_count_as_their_place(void **) {
  std::vector<float> scores;
  for (int i = 0; i < 50; ++i) // quantiles of an exponential distribution of scale 2
    scores.push_back(-2.0F * std::log(1.0F - (static_cast<float>(i) + 0.5F) / 50.0F));
  const auto calibrated = [](const std::vector<float> &alone) {
    rim::Thresholds t;
    rim::set_alarm_from_runs(&t, alone, alone, rim::CalibrationOptions{});
    assert_true(std::is_sorted(t.maxima.begin(), t.maxima.end()));
    const auto above = std::count_if(t.maxima.begin(), t.maxima.end(),
                                     [&t](float m) { return m > t.alarm_score; });
    assert_true(above < static_cast<std::ptrdiff_t>(t.maxima.size() - t.rank + 1));
    return t;
  };
  const rim::Thresholds usual = calibrated(scores);
  scores[10] = 18.0F;
  scores[20] = 17.0F;
  const rim::Thresholds odd = calibrated(scores);
  print_message("alarm %.2f, with two odd runs %.2f\n", static_cast<double>(usual.alarm_score),
                static_cast<double>(odd.alarm_score));
  assert_true(usual.alarm_score > 5.0F && odd.alarm_score > usual.alarm_score);
  assert_true(odd.by_tail && odd.alarm_score < 17.0F - 4.0F); // the lower one of the two: 17
}

// Of three runs, or at a rate beyond the upper half, no tail is known: the order statistic counts.
void a_tail_that_is_not_known_bounds_nothing(void **) {
  for (const double rate : {0.3, 0.5, 0.9}) {
    for (const std::size_t n : {2U, 3U, 4U, 20U}) {
      std::vector<float> scores;
      for (std::size_t i = 0; i < n; ++i)
        scores.push_back(static_cast<float>(i));
      rim::CalibrationOptions options;
      options.false_alarm = rate;
      rim::Thresholds t;
      rim::set_alarm_from_runs(&t, scores, scores, options);
      assert_true(std::isfinite(t.alarm_score) && t.alarm_score >= t.maxima[t.rank - 1]);
      assert_true(!t.by_tail || (n > 3 && rate <= 0.5));
    }
  }
}

// One odd run moves the alarm no further than its score by the image's own inflation, and runs
// unlike the others do not move it, up to a tenth of the runs.
void one_odd_run_does_not_set_the_alarm(void **) {
  std::vector<float> alone;
  for (int i = 0; i < 31; ++i) // quantiles of an exponential distribution of scale 2
    alone.push_back(-2.0F * std::log(1.0F - (static_cast<float>(i) + 0.5F) / 31.0F));
  const auto alarm = [](const std::vector<float> &a, const std::vector<float> &together) {
    rim::Thresholds t;
    rim::set_alarm_from_runs(&t, a, together, rim::CalibrationOptions{});
    assert_true(t.maxima.size() == a.size() && t.warn_score <= t.alarm_score);
    return static_cast<double>(t.alarm_score);
  };
  const auto near = [](double a, double b) { return std::abs(a - b) < 0.1; };
  const double second = static_cast<double>(alone[29]), largest = static_cast<double>(alone[30]);
  const double margin = 2.0 * std::log(std::log(20.0)); // 1 - exp(-log(20)) = kEachKept
  assert_true(near(alarm(alone, alone), largest + margin));
  rim::Thresholds limited;
  rim::set_alarm_from_runs(&limited, alone, alone, rim::CalibrationOptions{}, 1.0);
  assert_true(margin > 1.5 && near(static_cast<double>(limited.alarm_score), largest + 1.0));
  std::vector<float> odd = alone, together = alone;
  odd[30] = 20.0F;     // twice the largest of the others, and like them
  together[30] = 3.0F; // not below the second
  assert_true(near(alarm(odd, together), second + margin));
  together[30] = 8.0F;
  assert_true(near(alarm(odd, together), 8.0 + margin));
  together[30] = 400.0F; // no more than its place in the tail
  const double bound = rim::tail_bound(rim::score_spread({odd.begin(), odd.end()}), 1.0 / 32.0,
                                       rim::kEachKept);
  assert_true(near(alarm(odd, together), bound) && bound > 8.0 + margin && bound < 20.0);
  odd[30] = 155.0F; // unlike the others: the image has seen its like
  assert_true(near(alarm(odd, together), second + margin));
  odd[3] = 140.0F; // a second one, and a third
  odd[7] = 150.0F;
  together[30] = together[3] = together[7] = 20.0F;
  assert_true(alarm(odd, together) > second && alarm(odd, together) < second + 2.0 * margin);
  odd[9] = 145.0F; // more than a tenth of the runs: what runs do
  assert_true(alarm(odd, together) > 140.0);
}

// The spread is that of the tail they are drawn from, with one run far off or without. No single
// score decides on it: 18 runs as those of SKAB, of which one is faulty, and one near the quartile.
void the_spread_is_that_of_the_tail(void **) {
  for (const std::size_t n : {12U, 18U, 50U, 100U}) {
    std::vector<double> scores;
    const auto count = static_cast<double>(n);
    for (std::size_t i = 0; i < n; ++i)
      scores.push_back(-3.0 * std::log(1.0 - (static_cast<double>(i) + 0.5) / count));
    const double quartile = 3.0 * std::log(2.0);
    assert_true(std::abs(rim::score_spread(scores).above - quartile) < 0.15 * quartile);
    const double before = rim::score_spread(scores).above;
    scores.back() = 500.0;
    assert_true(rim::score_spread(scores).above == before);
  }
  std::vector<double> runs{0.1, 0.6, 0.8, 1.1, 1.4, 1.7, 1.8, 2.7, 2.9,
                           3.2, 3.3, 3.4, 3.8, 3.9, 7.2, 7.3, 7.6, 24.2};
  const double low = rim::score_spread(runs).unlike_bar();
  runs[13] = 7.1;
  const double high = rim::score_spread(runs).unlike_bar();
  assert_true(low < runs.back() && high < 1.2 * low);
  const std::vector<double> few{1.0, 4.0, 2.0};
  assert_true(rim::score_spread(few).middle == 2.0 && rim::score_spread(few).above == 2.0);
}

// ---- features of regions ----

// The columns that may describe a region, of runs whose columns are these waves.
std::set<std::string> chosen(const std::vector<std::string> &columns, std::size_t most) {
  constexpr Eigen::Index blocks = 200;
  std::vector<MadeRun> runs(3);
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 93);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    runs[r].blocks.context.resize(blocks, static_cast<Eigen::Index>(columns.size()));
    runs[r].blocks.outcome = rim::Matrix::Zero(blocks, 1);
    for (Eigen::Index b = 0; b < blocks; ++b) {
      const double t = 0.1 * static_cast<double>(b) + 2.0 * static_cast<double>(r);
      const std::map<std::string, double> value{
          {"u.push", std::sin(t)},
          {"u.turn", std::sin(0.3 * t)},
          {"s.push", 2.0 * std::sin(t) + 1.0}, // repeats the command
          {"s.late", std::sin(t - 0.5)},       // much like it
          {"s.noise", rimi_rng_normal(&rng)},
          {"s.still", 4.0},
          {"u.still_s", 1.0},
          {"s.slow", std::sin(0.5 * t)},
          {"s.warm", 1.0 - std::exp(-0.1 * t)}};
      for (std::size_t f = 0; f < columns.size(); ++f)
        runs[r].blocks.context(b, static_cast<Eigen::Index>(f)) = value.at(columns[f]);
    }
  }
  rim::FlightPlan plan;
  plan.layout.feature_names = columns;
  plan.layout.command.assign(columns.size(), 0);
  plan.low.assign(columns.size(), -5.0F);
  plan.high.assign(columns.size(), 5.0F);
  for (std::size_t f = 0; f < columns.size(); ++f) {
    if (columns[f].front() == 's')
      plan.layout.outcome_feature.push_back(static_cast<std::uint16_t>(f));
  }
  std::vector<rim::SearchRun> seen;
  for (const MadeRun &run : runs)
    seen.push_back(run.seen());
  rim::CalibrationOptions options;
  options.region_features = most;
  rim::choose_region(&plan, seen, {}, options);
  assert_int_equal(plan.cuts.size(), plan.region.size() * SEARCH_CUTS);
  assert_true(std::is_sorted(plan.region.begin(), plan.region.end()));
  std::set<std::string> names;
  for (const std::uint16_t f : plan.region)
    names.insert(columns[f]);
  return names;
}

// Where more features differ than are searched, it does not matter in which order the sensors are:
// those that last and are unlike the commands and each other are taken.
void the_most_telling_features_describe_regions(void **) {
  std::vector<std::string> sensors{"s.late", "s.noise", "s.push", "s.slow", "s.still", "s.warm"};
  do {
    std::vector<std::string> columns{"u.push", "u.turn"};
    columns.insert(columns.end(), sensors.begin(), sensors.end());
    assert_true(
        (chosen(columns, 4) == std::set<std::string>{"u.push", "u.turn", "s.slow", "s.warm"}));
    assert_true((chosen(columns, 12) == std::set<std::string>{"u.push", "u.turn", "s.late",
                                                              "s.noise", "s.slow", "s.warm"}));
    assert_true((chosen(columns, 1) == std::set<std::string>{"u.push"}));
  } while (std::next_permutation(sensors.begin(), sensors.end()));
  assert_true((chosen({"u.still_s", "s.still"}, 4) == std::set<std::string>{"s.still"}));
}

// ---- calibration on residuals that need no models ----

MadeNoise made() {
  MadeNoise m;
  m.outcomes = 2;
  m.blocks = 100;
  m.offset_sd = 0.6;
  m.gain_sd = 0.3;
  m.rho = 0.4;
  return m;
}

struct Calibrated {
  rim::FlightPlan plan;
  rim::NoiseModel noise;
  std::vector<rim::RunScore> scores;
};

// Two commands, two sensors; regions over all four.
Calibrated calibrate(const std::vector<MadeRun> &runs) {
  Calibrated c;
  c.plan.layout.feature_names = {"u.a", "u.b", "s.a", "s.b"};
  c.plan.layout.feature_units = {"", "", "", ""};
  c.plan.layout.outcome_names = {"s.a", "s.b"};
  c.plan.layout.outcome_units = {"", ""};
  c.plan.layout.outcome_feature = {2, 3};
  c.plan.layout.command = {1, 1, 0, 0};
  c.plan.low.assign(4, -5.0F);
  c.plan.high.assign(4, 5.0F);
  c.plan.block_rows = 10;
  c.plan.ring = 128;
  c.plan.pairs = 8;
  c.plan.budget = 3;
  c.plan.basis = made_basis(made());
  c.noise = fit_made(made(), runs);
  std::vector<rim::SearchRun> seen;
  for (const MadeRun &run : runs)
    seen.push_back(run.seen());
  rim::choose_region(&c.plan, seen, {1.0, 1.0}, rim::CalibrationOptions{});
  const rim::NoiseModel noise = c.noise;
  std::vector<rim::JudgedRun> judged;
  for (const rim::SearchRun &run : seen)
    judged.push_back({run, &c.plan.basis, &noise});
  c.scores = rim::calibrate_runs(&c.plan, &c.noise, judged, rim::CalibrationOptions{});
  return c;
}

std::uint8_t byte_of(double value) {
  const double byte = std::floor(256.0 * (value + 5.0) / 10.0);
  return static_cast<std::uint8_t>(std::min(255.0, std::max(0.0, byte)));
}

// Largest score of a run by the section that flies, as the monitor would find it.
double flown_score(const Calibrated &c, const MadeRun &run) {
  const std::vector<std::uint8_t> section = rim::noise_section(c.noise);
  rim_noise noise;
  const auto channels = static_cast<std::uint32_t>(run.residual.cols());
  assert_int_equal(rimi_noise_open(&noise, section.data(), section.size(), channels, 0), RIM_OK);
  search_config config{};
  config.features = static_cast<std::uint16_t>(c.plan.region.size());
  config.channels = static_cast<std::uint16_t>(channels);
  config.outcomes = 2;
  config.ring = static_cast<std::uint16_t>(c.plan.ring);
  config.cells_per_turn = static_cast<std::uint8_t>(c.plan.pairs);
  config.noise = &noise;
  config.cuts = c.plan.cuts.data();
  std::vector<std::uint64_t> memory(rimi_search_size(&config) / 8 + 1);
  rim_search *search = nullptr;
  assert_int_equal(rimi_search_init(&search, memory.data(), memory.size() * 8, &config), RIM_OK);
  double largest = -1e300;
  const double no_mean = 0.0;
  for (Eigen::Index b = 0; b < run.residual.rows(); ++b) {
    std::vector<std::uint8_t> place;
    for (std::size_t k = 0; k < c.plan.region.size(); ++k)
      place.push_back(byte_of(c.plan.region_outcome[k] == 0xffff
                                  ? run.blocks.context(b, c.plan.region[k])
                                  : run.predicted(b, c.plan.region_outcome[k])));
    search_block block{};
    block.t_s = run.blocks.time_s[b];
    block.feature = place.data();
    block.mean = &no_mean;
    const Eigen::RowVectorXd expected = run.predicted.row(b).replicate(1, 2); // by both kinds
    block.predicted = expected.data();
    block.residual = run.residual.row(b).data();
    assert_int_equal(rimi_search_observe(search, &block), RIM_OK);
    rimi_search_work(search, c.plan.budget * c.plan.block_rows);
    for (std::uint32_t i = 0; i < channels; ++i)
      largest = std::max(largest, static_cast<double>(rimi_search_best(search, i)->score));
  }
  return largest;
}

// A shift where the first command is high, in one outcome.
MadeRun faulty(MadeRun run, double shift) {
  for (Eigen::Index b = 0; b < run.residual.rows(); ++b) {
    if (run.blocks.context(b, 0) > 0.5)
      run.residual(b, 1) += shift;
  }
  return run;
}

// The promise holds on average over calibrations: the rate of one has a spread of its own, that of
// Beta(rank from the top, rank).
void fresh_runs_alarm_no_more_often_than_promised(void **) {
  constexpr std::size_t calibrations = 10, runs = 39, fresh = 40;
  std::size_t alarmed = 0, found = 0;
  double promised = 0.0;
  for (std::uint64_t k = 0; k < calibrations; ++k) {
    const std::uint64_t seed = kSeed + 1000 * k;
    const Calibrated c = calibrate(made_noises(seed, runs, made(), true));
    promised = static_cast<double>(c.plan.thresholds.promised_rate);
    const auto alarm = static_cast<double>(c.plan.thresholds.alarm_score);
    for (std::uint64_t r = 0; r < fresh; ++r) {
      const MadeRun run = made_noise(seed + 500 + r, made(), true);
      alarmed += flown_score(c, run) >= alarm ? 1 : 0;
      if (r % 4 == 0)
        found += flown_score(c, faulty(run, 4.0)) >= alarm ? 4 : 0;
    }
  }
  assert_true(std::abs(promised - 0.05) < 1e-6);
  const double n = calibrations * fresh, variance = promised * (1.0 - promised);
  const double sd = std::sqrt(variance / n + variance / (runs + 2) / calibrations);
  const double rate = static_cast<double>(alarmed) / n;
  print_message("false alarms in %.3f of runs, promised %.3f, sd %.3f; a shift is found in %.3f\n",
                rate, promised, sd, static_cast<double>(found) / n);
  assert_true(rate <= promised + 1.96 * sd);
  assert_true(rate > 0.0);                           // or the threshold would be anything
  assert_true(static_cast<double>(found) > 0.8 * n); // or the promise would be an empty one
}

// A run unlike the others is judged by what the others taught: by what it taught too, it would
// score less.
void a_runs_own_score_is_by_the_others(void **) {
  std::vector<MadeRun> runs = made_noises(kSeed + 77, 20, made(), true);
  const Calibrated before = calibrate(runs);
  runs[7] = faulty(runs[7], 6.0);
  const Calibrated c = calibrate(runs);
  const double own = c.scores[7].score, flown = flown_score(c, runs[7]);
  print_message("score by the others %.1f, by all %.1f; before the fault %.1f\n", own, flown,
                before.scores[7].score);
  assert_true(own > flown + 1.0);
  assert_true(own > before.scores[7].score + 10.0);
  assert_int_equal(c.scores[7].channel, 1);
  for (std::size_t r = 0; r < runs.size(); ++r)
    assert_true(r == 7 || c.scores[r].score < own);
}

// The channels that deviate in two runs unlike the others are judged less strictly; the others keep
// their alarm, and no family is preferred for its inflation alone.
void two_odd_runs_cost_their_channel_alone(void **) {
  std::vector<MadeRun> runs = made_noises(kSeed + 55, 40, made(), true);
  const Calibrated before = calibrate(runs);
  runs[7] = faulty(runs[7], 12.0);
  for (Eigen::Index b = 0; b < runs[21].residual.rows(); b += 2) // no region, in the other outcome
    runs[21].residual(b, 0) += b < runs[21].residual.rows() / 2 ? 0.0 : 9.0;
  const Calibrated c = calibrate(runs);
  const auto alarm = static_cast<double>(c.plan.thresholds.alarm_score);
  print_message("alarm at %.1f, before %.1f; the odd runs alone score %.1f and %.1f\n", alarm,
                static_cast<double>(before.plan.thresholds.alarm_score), c.scores[7].score,
                c.scores[21].score);
  assert_true(alarm < 0.5 * std::min(c.scores[7].score, c.scores[21].score));
  for (const std::size_t odd : {std::size_t{7}, std::size_t{21}})
    assert_true(flown_score(c, runs[odd]) < alarm + 1.0);
  const std::vector<double> &phi = c.noise.channels[1].phi, &was = before.noise.channels[1].phi;
  assert_true(phi[SEARCH_INTERVAL] > 1.5 * was[SEARCH_INTERVAL]);
  assert_true(phi[SEARCH_BOX] >= phi[SEARCH_INTERVAL] && phi[SEARCH_GAIN] >= phi[SEARCH_SINCE]);
  assert_true(phi[SEARCH_INTERVAL_SINCE] >= std::max(phi[SEARCH_INTERVAL], phi[SEARCH_SINCE]));
  assert_true(phi[SEARCH_BOX_SINCE] >= phi[SEARCH_INTERVAL_SINCE]);
}

// Healthy runs score in calibration what the monitor would find, but for what one run in 40
// teaches.
void calibration_searches_as_flight_does(void **) {
  const std::vector<MadeRun> runs = made_noises(kSeed + 99, 40, made(), true);
  const Calibrated c = calibrate(runs);
  double largest = 0.0, sum = 0.0;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const double off = c.scores[r].score - flown_score(c, runs[r]);
    largest = std::max(largest, std::abs(off));
    sum += off / static_cast<double>(runs.size());
  }
  print_message("scores differ by %.2f in the mean, by %.2f at most\n", sum, largest);
  assert_true(std::abs(sum) < 0.5 && largest < 3.0);
}

void threads_do_not_change_a_byte(void **) {
  const char *before = std::getenv("RIM_THREADS");
  const std::string kept = before != nullptr ? before : "";
  MadeVehicle brief;
  brief.rows = 600;
  rim::TrainOptions coarse; // 60 blocks in a run instead of 240, in a quarter of the time
  coarse.blocking.block_s = 1.0;
  const auto logs = made_vehicles(7, 12, brief), others = made_vehicles(8, 3, brief);
  // Of few runs everything is learnt again without each.
  const std::vector<rim::Log> few(logs.begin(), logs.begin() + 3);
  std::vector<std::vector<std::uint8_t>> of_all, of_few;
  for (const char *threads : {"1", "7"}) {
    setenv("RIM_THREADS", threads, 1);
    of_all.push_back(rim::make_image(rim::train(logs, coarse).plan));
    of_few.push_back(rim::make_image(rim::train(few, coarse).plan));
  }
  if (before != nullptr)
    setenv("RIM_THREADS", kept.c_str(), 1);
  else
    unsetenv("RIM_THREADS");
  assert_true(of_all[0] == of_all[1]);
  assert_true(of_few[0] == of_few[1]);
  assert_false(of_few[0] == rim::make_image(rim::train(others, coarse).plan));
}

void other_columns_are_named(void **) {
  MadeVehicle brief;
  brief.rows = 50;
  const rim::Log log = made_vehicle(1, brief);
  const rim::Layout layout = rim::layout_of(log);
  rim::check_layout(layout, made_vehicle(2, brief));
  rim::Log renamed = made_vehicle(3, brief);
  renamed.columns[3].name = "s.altitude_m";
  const std::string other = refusal([&] { rim::check_layout(layout, renamed); });
  assert_true(has(other, "made3") && has(other, "'s.altitude_m'") && has(other, "'s.product_m'"));
  rim::Log shorter = made_vehicle(4, brief);
  shorter.columns.pop_back();
  const std::string missing = refusal([&] { rim::check_layout(layout, shorter); });
  assert_true(has(missing, "made4") && has(missing, "'s.nothing' is missing"));
  rim::Log longer = made_vehicle(5, brief);
  longer.columns.push_back({"s.extra", "", rim::Role::sensor});
  const std::string more = refusal([&] { rim::check_layout(layout, longer); });
  assert_true(has(more, "made5") && has(more, "'s.extra'"));
  const std::string trained = refusal([&] {
    rim::train({log, log, renamed}, rim::TrainOptions{});
  });
  assert_true(has(trained, "made3") && has(trained, "'s.altitude_m'"));
}

void too_few_runs_are_refused(void **) {
  for (std::size_t n = 0; n < 3; ++n) {
    const std::string error =
        refusal([&] { rim::train(made_vehicles(1, n), rim::TrainOptions{}); });
    assert_true(has(error, "at least 3 logs") && has(error, std::to_string(n)));
  }
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(promises_follow_the_ranks),
      cmocka_unit_test(the_promise_holds_in_most_sets),
      cmocka_unit_test(odd_runs_count_as_their_place),
      cmocka_unit_test(a_tail_that_is_not_known_bounds_nothing),
      cmocka_unit_test(one_odd_run_does_not_set_the_alarm),
      cmocka_unit_test(the_spread_is_that_of_the_tail),
      cmocka_unit_test(the_most_telling_features_describe_regions),
      cmocka_unit_test(fresh_runs_alarm_no_more_often_than_promised),
      cmocka_unit_test(a_runs_own_score_is_by_the_others),
      cmocka_unit_test(two_odd_runs_cost_their_channel_alone),
      cmocka_unit_test(calibration_searches_as_flight_does),
      cmocka_unit_test(threads_do_not_change_a_byte),
      cmocka_unit_test(other_columns_are_named),
      cmocka_unit_test(too_few_runs_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
