// SPDX-License-Identifier: MIT
// Logs with their own predictions and nothing to learn from: the table of thresholds against
// simulation, and what is made of residuals that are not independent.
#include "check.hpp"
#include "image/threshold.h"
#include "replay/replay.hpp"
#include "train/external_residuals.hpp"
#include "train/external_table.hpp"
#include "util/parallel_for.hpp"

#include "base/rng.h"
#include "image/threshold.h"

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

namespace {

constexpr std::uint64_t kSeed = 4711;

using rim::ExternalSearch;
using rim::ExternalSize;

// ---- logs ----

enum class Places { uniform, clustered, discrete, trajectory };

// What is wrong with a log beside white noise of the stated sd.
struct Flaws {
  double memory = 0.0; // AR(1), of unit variance
  double scale = 1.0;  // true sd over the stated one
  double shift = 0.0;  // sd, where the first context is in (.4, .6) of its range
  double since = 0.0;  // sd, in the last 40 %
  double offset = 0.0; // sd of the log's own offset
};

std::vector<double> places(Places kind, std::size_t rows, rim_rng *rng) {
  std::vector<double> x(rows);
  const double phase = 6.28 * rimi_rng_uniform(rng);
  const double turns = 0.002 * std::exp(3.0 * rimi_rng_uniform(rng)); // a row
  for (std::size_t t = 0; t < rows; ++t) {
    const double u = rimi_rng_uniform(rng);
    switch (kind) {
    case Places::uniform:
      x[t] = u;
      break;
    case Places::clustered: // two narrow ones and what lies between
      x[t] = (u < 0.5 ? 0.1 : u < 0.9 ? 0.8 : 0.5) + 0.03 * rimi_rng_normal(rng);
      break;
    case Places::discrete:
      x[t] = std::floor(5.0 * u);
      break;
    case Places::trajectory:
      x[t] = std::sin(phase + 6.28 * turns * static_cast<double>(t));
      break;
    }
  }
  return x;
}

rim::Log own_log(std::uint64_t stream, Places kind, const ExternalSize &size, const Flaws &flaws) {
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, stream);
  rim::Log log;
  log.path = "own" + std::to_string(stream) + ".csv";
  const auto rows = static_cast<Eigen::Index>(size.rows);
  log.values.resize(rows, static_cast<Eigen::Index>(size.features + 2 * size.outcomes));
  Eigen::Index c = 0;
  std::vector<double> first;
  for (std::size_t f = 0; f + size.outcomes < size.features; ++f) { // m. is a feature as well
    log.columns.push_back({"x." + std::to_string(f), "", rim::Role::context});
    const std::vector<double> x = places(kind, size.rows, &rng);
    log.values.col(c++) = Eigen::Map<const Eigen::VectorXd>(x.data(), rows);
    if (f == 0)
      first = x;
  }
  const double low = kind == Places::trajectory ? -1.0 : 0.0;
  const double wide = kind == Places::trajectory ? 2.0 : kind == Places::discrete ? 4.0 : 1.0;
  for (std::size_t o = 0; o < size.outcomes; ++o) {
    const std::string name = std::to_string(o);
    log.columns.push_back({"z." + name, "", rim::Role::outcome});
    log.columns.push_back({"m." + name, "", rim::Role::mean});
    log.columns.push_back({"sd." + name, "", rim::Role::sd});
    const std::vector<double> mean = places(kind, size.rows, &rng);
    const double offset = flaws.offset * rimi_rng_normal(&rng);
    double noise = rimi_rng_normal(&rng);
    for (std::size_t t = 0; t < size.rows; ++t) {
      const double u = (first[t] - low) / wide;
      double r = offset + flaws.scale * noise;
      r += u > 0.4 && u < 0.6 ? flaws.shift : 0.0;
      r += 10 * t >= 6 * size.rows ? flaws.since : 0.0;
      log.values.row(static_cast<Eigen::Index>(t)).segment(c, 3) << mean[t] + 0.5 * r, mean[t], 0.5;
      noise = flaws.memory * noise +
              std::sqrt(1.0 - flaws.memory * flaws.memory) * rimi_rng_normal(&rng);
    }
    c += 3;
  }
  for (std::size_t t = 0; t < size.rows; ++t) {
    log.t_s.push_back(static_cast<double>(t));
    log.row.push_back(static_cast<std::uint32_t>(t + 1));
  }
  log.rows_in_file = static_cast<std::uint32_t>(size.rows);
  return log;
}

// Logs of a campaign: a quarter of them, but all with RIM_LONG (`make test-long`).
std::size_t of_all(std::size_t runs) {
  return std::getenv("RIM_LONG") != nullptr ? runs : runs / 4;
}

struct Outcome {
  std::size_t alarms = 0, independent = 0;
  double promised = 1.0;
};

// `runs` logs, each calibrated from itself alone as `rim replay` does.
Outcome replay_each(std::size_t runs, Places kind, const ExternalSize &size, const Flaws &flaws,
                    bool flight) {
  std::atomic<std::size_t> alarms{0}, independent{0};
  std::vector<double> promised(runs);
  rim::parallel_for(runs, [&](std::size_t r) {
    const rim::Log log = own_log(r + 1, kind, size, flaws);
    rim::CalibrationOptions options;
    options.flight = flight;
    const rim::ExternalImage made = rim::external_image({log}, 0, options);
    promised[r] = made.promised_rate;
    independent += made.residuals_sentence.find("independent") != std::string::npos ? 1 : 0;
    alarms += rim::Replayer(made.image, "own").replay(log, {}).raised > 0 ? 1 : 0;
  });
  return {alarms, independent, promised.front()};
}

// What so many runs may show at most where the true rate is the promised one: its 95 % interval.
double most_alarms(std::size_t runs, double rate) {
  const double n = static_cast<double>(runs);
  return n * rate + 1.96 * std::sqrt(n * rate * (1.0 - rate));
}

// ---- the table ----

// Sizes that are no knots: the promise holds for them, on contexts of every kind.
void false_alarms_keep_the_promise(void **) {
  const struct {
    Places places;
    ExternalSize size;
    bool flight;
    std::size_t runs;
    bool always = true; // not with RIM_LONG alone
  } cases[] = {
      {Places::uniform, {6, 3, 300}, true, 400},
      {Places::clustered, {6, 3, 300}, true, 300, false},
      {Places::discrete, {4, 1, 700}, true, 300},
      {Places::trajectory, {20, 2, 400}, true, 300},
      {Places::uniform, {60, 1, 250}, true, 300},
      {Places::trajectory, {60, 1, 250}, true, 300, false},
      {Places::uniform, {6, 1, 200}, false, 100, false},
      {Places::clustered, {20, 2, 100}, false, 100},
      {Places::trajectory, {4, 1, 250}, false, 100, false}};
  std::size_t uniform = 0;
  for (const auto &one : cases) {
    if (!one.always && std::getenv("RIM_LONG") == nullptr)
      continue;
    const std::size_t runs = of_all(one.runs);
    const Outcome seen = replay_each(runs, one.places, one.size, {}, one.flight);
    print_message("%s, contexts %d, %zu features, %zu outcomes, %zu rows: %zu of %zu alarm, %zu "
                  "independent\n",
                  one.flight ? "flight" : "ground", static_cast<int>(one.places), one.size.features,
                  one.size.outcomes, one.size.rows, seen.alarms, runs, seen.independent);
    assert_true(std::abs(seen.promised - 0.05) < 1e-6);
    assert_true(static_cast<double>(seen.alarms) <= most_alarms(runs, seen.promised));
    assert_true(10 * seen.independent >= 8 * runs);
    uniform += one.places == Places::uniform ? seen.alarms : 0;
  }
  assert_true(uniform >=
              of_all(8)); // of 800 (100) like those of the table: or it would be an empty promise
}

// The numbers in the source file are those that the program draws.
void the_table_is_what_its_program_draws(void **) {
  const struct {
    ExternalSearch search;
    std::size_t feature, outcome, rows; // indices of knots; all smaller numbers of rows too
  } cells[] = {{ExternalSearch::flight, 1, 0, 1},
               {ExternalSearch::flight, 2, 1, 0},
               {ExternalSearch::flight_wide, 1, 0, 0},
               {ExternalSearch::thorough, 2, 0, 0},
               {ExternalSearch::thorough, 0, 1, 1}};
  const std::vector<double> &levels = rim::external_levels();
  for (const auto &cell : cells) {
    const rim::ExternalKnots &knots = rim::external_knots(cell.search);
    const std::vector<std::size_t> at(
        knots.rows.begin(), knots.rows.begin() + static_cast<std::ptrdiff_t>(cell.rows + 1));
    const auto scores = rim::draw_external(cell.search, knots.features[cell.feature],
                                           knots.outcomes[cell.outcome], at, knots.runs);
    const float *table = rim::external_quantiles(cell.search);
    table +=
        (cell.feature * knots.outcomes.size() + cell.outcome) * knots.rows.size() * levels.size();
    for (std::size_t k = 0; k < at.size(); ++k) {
      assert_int_equal(scores[k].size(), knots.runs);
      for (std::size_t l = 0; l < levels.size(); ++l) {
        const float drawn = rim::quantile_of(scores[k], levels[l]);
        assert_true(std::abs(drawn - table[k * levels.size() + l]) < 6e-4F);
      }
    }
  }
}

void quantiles_meet_the_knots_and_rise_with_the_chance(void **) {
  for (std::size_t s = 0; s < rim::kExternalSearches; ++s) {
    const auto search = static_cast<ExternalSearch>(s);
    const rim::ExternalKnots &knots = rim::external_knots(search);
    const float *table = rim::external_quantiles(search);
    for (const std::size_t features : knots.features) {
      for (const std::size_t outcomes : knots.outcomes) {
        for (const std::size_t rows : knots.rows) {
          for (const double level : rim::external_levels()) {
            const double q = rim::external_quantile(search, {features, outcomes, rows}, level);
            assert_true(std::abs(q - static_cast<double>(*table++)) < 1e-5);
          }
        }
      }
    }
    const ExternalSize odd{17, 5, 1000000}; // between knots, and beyond them
    const ExternalSize last{17, 5, knots.rows.back()};
    const std::vector<float> maxima = rim::external_maxima(search, odd, 999);
    for (std::size_t i = 1; i < maxima.size(); ++i)
      assert_true(maxima[i] >= maxima[i - 1]);
    assert_true(std::abs(static_cast<double>(maxima[949]) -
                         rim::external_quantile(search, odd, 0.95)) < 1e-5);
    assert_true(rim::external_quantile(search, odd, 0.95) >=
                rim::external_quantile(search, last, 0.95));
    // A thousandth costs ln 10 nats over a hundredth, over the least growth.
    const double further =
        rim::external_quantile(search, last, 0.999) - rim::external_quantile(search, last, 0.99);
    assert_true(std::abs(further - std::log(10.0) / rim::kLeastGrowth) < 0.01);
  }
}

void a_rarer_alarm_is_promised_too(void **) {
  const rim::Log log = own_log(1, Places::uniform, {4, 1, 100}, {});
  rim::CalibrationOptions options;
  options.flight = true;
  double before = 0.0;
  for (const double rate : {0.25, 0.05, 0.01, 0.001, 1e-5}) {
    options.false_alarm = rate;
    const rim::ExternalImage made = rim::external_image({log}, 0, options);
    const double least = 1.0 / RIM_THRESHOLD_MAX_RUNS;
    assert_true(std::abs(made.promised_rate / std::max(rate, least) - 1.0) < 1e-3);
    const double score = rim::Replayer(made.image, "own").replay(log, {}).alarm_score;
    assert_true(score > before);
    before = score;
  }
}

// ---- residuals ----

void correlated_noise_raises_no_alarm(void **) {
  const struct {
    Places places;
    double memory;
    std::size_t rows;
  } cases[] = {{Places::uniform, 0.5, 400},
               {Places::trajectory, 0.5, 400},
               {Places::trajectory, 0.5, 150},
               {Places::trajectory, 0.9, 400}};
  const std::size_t runs = of_all(200);
  for (const auto &one : cases) {
    Flaws flaws;
    flaws.memory = one.memory;
    const Outcome seen = replay_each(runs, one.places, {6, 2, one.rows}, flaws, true);
    print_message("AR(1) %.1f, contexts %d, %zu rows: %zu of %zu alarm, %zu taken as independent\n",
                  one.memory, static_cast<int>(one.places), one.rows, seen.alarms, runs,
                  seen.independent);
    assert_true(static_cast<double>(seen.alarms) <= most_alarms(runs, seen.promised));
    assert_true(10 * seen.independent <= runs);
  }
}

void a_wrong_sd_raises_no_alarm(void **) {
  const std::size_t runs = of_all(200);
  Flaws flaws;
  flaws.scale = 1.3;
  const Outcome seen = replay_each(runs, Places::uniform, {6, 2, 400}, flaws, true);
  print_message("sd 1.3 times the stated: %zu of %zu alarm\n", seen.alarms, runs);
  assert_true(static_cast<double>(seen.alarms) <= most_alarms(runs, seen.promised));
}

// An error that lasts is not written off as correlation, whether the place is visited for many rows
// in a row or the shift never ends.
void lasting_errors_are_found(void **) {
  const std::size_t runs = std::getenv("RIM_LONG") != nullptr ? 60 : 20;
  Flaws region, since, both;
  region.shift = 2.0;
  since.since = 2.0;
  both.shift = 3.0;
  both.memory = 0.5;
  for (const Flaws &flaws : {region, since, both}) {
    const Outcome seen = replay_each(runs, Places::trajectory, {6, 1, 600}, flaws, true);
    print_message("shift %.0f, since %.0f, memory %.1f: %zu of %zu found\n", flaws.shift,
                  flaws.since, flaws.memory, seen.alarms, runs);
    assert_true(10 * seen.alarms >= 9 * runs);
  }
}

void offsets_of_logs_are_allowed_for(void **) {
  constexpr std::size_t logs = 8, sets = 20;
  std::size_t alarms = 0, plain = 0, faulty = 0;
  rim::CalibrationOptions options;
  options.flight = true;
  for (std::size_t k = 0; k < sets; ++k) {
    std::vector<rim::Log> offset, one_fault;
    for (std::size_t j = 0; j < logs; ++j) {
      Flaws flaws;
      flaws.offset = 0.5;
      offset.push_back(own_log(1000 + k * logs + j, Places::trajectory, {4, 1, 300}, flaws));
      flaws.offset = 0.0;
      flaws.shift = j == 0 ? 3.0 : 0.0;
      one_fault.push_back(own_log(1000 + k * logs + j, Places::trajectory, {4, 1, 300}, flaws));
    }
    const rim::ExternalImage made = rim::external_image(offset, 0, options);
    rim::Replayer replayer(made.image, "own");
    for (const rim::Log &log : offset)
      alarms += replayer.replay(log, {}).raised > 0 ? 1 : 0;
    const rim::ExternalImage alone = rim::external_image({offset[0]}, 0, options);
    plain += rim::Replayer(alone.image, "own").replay(offset[0], {}).raised > 0 ? 1 : 0;
    const rim::ExternalImage fault = rim::external_image(one_fault, 0, options);
    faulty += rim::Replayer(fault.image, "own").replay(one_fault[0], {}).raised > 0 ? 1 : 0;
  }
  print_message("offsets of .5 sd: %zu of %zu alarm, each alone %zu of %zu; a region in one of "
                "%zu logs: %zu of %zu\n",
                alarms, sets * logs, plain, sets, logs, faulty, sets);
  assert_true(static_cast<double>(alarms) <= most_alarms(sets * logs, 0.05));
  assert_true(4 * plain > sets); // or nothing had to be allowed for
  assert_true(10 * faulty >= 9 * sets);
}

void noise_is_fitted(void **) {
  rim_rng rng;
  rimi_rng_seed(&rng, kSeed, 5);
  for (const double memory : {0.5, 0.9}) {
    std::vector<std::vector<double>> series(3);
    for (std::vector<double> &log : series) {
      double w = rimi_rng_normal(&rng);
      for (std::size_t t = 0; t < 2000; ++t) { // two thirds of the variance remember, of 1.5 in all
        log.push_back(w + std::sqrt(0.5) * rimi_rng_normal(&rng));
        w = memory * w + std::sqrt(1.0 - memory * memory) * rimi_rng_normal(&rng);
      }
    }
    const rim::ResidualNoise noise = rim::fit_noise(series);
    assert_true(std::abs(noise.scale - 1.5) < 0.2);
    assert_true(std::abs(noise.keeps - memory) < 0.1);
    assert_true(std::abs(noise.lag_one() - memory / 1.5) < 0.05);
    const double whole = 0.5 + (1.0 + memory) / (1.0 - memory);
    assert_true(std::abs(noise.inflation(1e9) / whole - 1.0) < 0.2);
    assert_true(std::abs(noise.inflation(1.0) - noise.scale) < 1e-9); // one row has no neighbour
    assert_true(noise.gain > 100.0);
  }
  std::vector<double> white;
  for (std::size_t t = 0; t < 2000; ++t)
    white.push_back(rimi_rng_normal(&rng));
  const rim::ResidualNoise noise = rim::fit_noise({white});
  assert_true(noise.inflation(2000.0) <= 1.0 && noise.share <= 0.0);
}

void what_was_tested_is_said(void **) {
  const auto has = [](const std::string &text, const char *part) {
    return text.find(part) != std::string::npos;
  };
  std::vector<rim::ResidualTest> tests(2);
  const std::vector<std::string> names{"z.speed", "z.height"};
  const std::string plain = rim::residuals_sentence(tests, names, 1);
  assert_true(has(plain, "tested for scale and autocorrelation, and taken as independent"));
  assert_true(has(rim::residuals_sentence(tests, names, 20), "and offsets of a log, and taken as"));
  tests[1].noise.share = 1.0;
  tests[1].noise.keeps = 0.5;
  tests[1].inflation = 3.0;
  const std::string said = rim::residuals_sentence(tests, names, 1);
  assert_true(has(said, "'z.height' are correlated in time (0.50 from row to row)"));
  assert_true(has(said, "3.0 times the evidence is asked"));
  assert_false(has(said, "z.speed") || has(said, "independent"));
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(false_alarms_keep_the_promise),
      cmocka_unit_test(the_table_is_what_its_program_draws),
      cmocka_unit_test(quantiles_meet_the_knots_and_rise_with_the_chance),
      cmocka_unit_test(a_rarer_alarm_is_promised_too),
      cmocka_unit_test(correlated_noise_raises_no_alarm),
      cmocka_unit_test(a_wrong_sd_raises_no_alarm),
      cmocka_unit_test(lasting_errors_are_found),
      cmocka_unit_test(offsets_of_logs_are_allowed_for),
      cmocka_unit_test(noise_is_fitted),
      cmocka_unit_test(what_was_tested_is_said),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
