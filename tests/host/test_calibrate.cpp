// Training's second computation of the channels is held to the flight code's, and calibration to
// what it promises: on runs that no model has seen.
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <random>

#include "rim/channels.h"
#include "rim/envelope.h"
#include "train/nominal_spread.hpp"
#include "train/trainer.hpp"
#include "util/error.hpp"

extern "C" {
#include <cmocka.h> // last: its macro fail() breaks the standard streams
}

namespace {

using rim::Matrix;

constexpr unsigned seed = 325;
constexpr double period_s = 0.1;
constexpr std::uint32_t block_rows = 12;

bool mentions(const std::string &text, const std::string &part) {
  if (text.find(part) != std::string::npos)
    return true;
  print_message("'%s' not in: %s\n", part.c_str(), text.c_str());
  return false;
}

// A command and three sensors: one follows the command, one lags behind, one is quantised and at
// times exactly 0. `gaps`: rows are missing here and there, one to eight in a row.
rim::Log vehicle(unsigned run, std::size_t rows, bool gaps) {
  std::mt19937_64 random(seed + run);
  std::normal_distribution<double> normal;
  rim::Log log;
  log.path = "run" + std::to_string(run) + ".csv";
  log.columns = {{"x.wind_mps", "m/s", rim::Role::context},
                 {"u.push", "", rim::Role::command},
                 {"s.speed_mps", "m/s", rim::Role::sensor},
                 {"s.place_m", "m", rim::Role::sensor},
                 {"s.count", "", rim::Role::sensor}};
  std::vector<double> values;
  double place = 0.0;
  std::size_t missing = 0;
  for (std::size_t t = 0; t < rows; ++t) {
    const double i = static_cast<double>(t);
    const double push = std::sin(i / 37.0) + 0.4 * std::sin(i / 11.0);
    place += 0.1 * (2.0 * push - place);
    const double wind = std::cos(i / 53.0) + 0.1 * normal(random);
    const double speed = push + 0.2 * wind + 0.05 * normal(random);
    const double count = std::round(2.0 * push + normal(random)) / 2.0;
    const double measured = place + 0.05 * normal(random);
    if (gaps && missing == 0 && random() % 40 == 0)
      missing = 1 + random() % 8;
    if (missing > 0) {
      --missing;
      continue;
    }
    for (const double v : {wind, push, speed, measured, count})
      values.push_back(v);
    log.t_s.push_back(period_s * i);
    log.row.push_back(static_cast<std::uint32_t>(t + 1));
  }
  const auto kept = static_cast<Eigen::Index>(log.t_s.size());
  log.values = Eigen::Map<const Matrix>(values.data(), kept, 5);
  return log;
}

// What rim_channels makes of a log: as train_models() says it, by models in flight form.
struct Flight {
  rim_nominal step{}, level{}, increment{};
  std::vector<std::uint32_t> step_bytes, level_bytes, increment_bytes; // aligned
  std::vector<std::uint16_t> outcome_feature;
  rim_channels_config config{};
  std::vector<std::uint64_t> memory;
  rim_channels *channels = nullptr;

  Flight(const rim::Layout &layout, std::uint32_t kinds) : outcome_feature(layout.outcome_feature) {
    config.features = static_cast<std::uint16_t>(layout.features());
    config.outcomes = static_cast<std::uint16_t>(layout.outcomes());
    config.block_rows = block_rows;
    config.kinds = static_cast<std::uint8_t>(kinds);
    config.period_s = period_s;
    config.outcome_feature = reinterpret_cast<const std::uint8_t *>(outcome_feature.data());
    config.command = layout.command.data();
  }

  static const rim_nominal *open(const rim::NominalModel &model, std::vector<std::uint32_t> *bytes,
                                 rim_nominal *view) {
    const std::vector<std::uint8_t> section = rim::nominal_section(model);
    bytes->resize(section.size() / 4);
    std::memcpy(bytes->data(), section.data(), section.size());
    const auto *data = reinterpret_cast<const std::uint8_t *>(bytes->data());
    assert_int_equal(rim_nominal_open(view, data, section.size()), RIM_OK);
    return view;
  }

  void start() {
    std::size_t present = 0;
    for (unsigned k = 0; k < RIM_CHANNELS_KINDS; ++k)
      present += config.kinds >> k & 1u;
    const std::size_t bytes = RIM_CHANNELS_SIZE(config.features, config.outcomes, present);
    memory.assign(bytes / 8, 0);
    assert_int_equal(rim_channels_init(&channels, memory.data(), bytes, &config), RIM_OK);
  }
};

constexpr std::uint32_t all_kinds = 0x1f;

// All runs are copies of one, so that the model without a run is the model of all: then training's
// values, by left-one-run-out models, must be the flight code's, up to single precision in the
// maps.
void training_and_flight_make_the_same_channels(void **) {
  const rim::Log log = vehicle(1, 1500, true);
  const std::vector<rim::Log> logs(3, log);
  const rim::Layout layout = rim::layout_of(log);
  rim::ModelOptions options;
  options.kinds = all_kinds;
  options.block_rows = block_rows;
  options.period_s = period_s;
  options.fit.ridge = {1e-7};   // in rows: two copies and three differ by it
  options.fit.prototypes = {1}; // of several, variances are drawn together by rows
  const rim::TrainedModels models = rim::train_models(logs, layout, options);
  Flight flight(layout, all_kinds);
  flight.config.step = Flight::open(models.step.model, &flight.step_bytes, &flight.step);
  flight.config.level = Flight::open(models.level.model, &flight.level_bytes, &flight.level);
  flight.config.increment =
      Flight::open(models.increment.model, &flight.increment_bytes, &flight.increment);
  flight.start();
  const rim::ChannelSeries &series = models.series[1];
  Eigen::Index b = 0;
  double largest = 0.0;
  std::size_t repeats = 0;
  for (std::size_t t = 0; t < log.t_s.size(); ++t) {
    const double *row = log.values.row(static_cast<Eigen::Index>(t)).data();
    if (rim_channels_row(flight.channels, log.t_s[t], row, nullptr, nullptr, nullptr) != 1)
      continue;
    assert_true(b < series.raw.rows());
    assert_true(rim_channels_block_start_s(flight.channels) ==
                series.start_s[static_cast<std::size_t>(b)]);
    for (Eigen::Index f = 0; f < series.context.cols(); ++f) {
      const double mean = rim_channels_context(flight.channels)[f];
      assert_true(std::abs(mean - series.context(b, f)) <= 1e-12 * (1.0 + std::abs(mean)));
    }
    for (Eigen::Index c = 0; c < series.raw.cols(); ++c) {
      const double clip = RIM_CHANNELS_VALUE_CLIP;
      const double expected = std::min(clip, std::max(-clip, series.raw(b, c)));
      const double off = std::abs(rim_channels_values(flight.channels)[c] - expected);
      largest = std::max(largest, off / (1.0 + std::abs(expected)));
      repeats +=
          rim_channels_kind(flight.channels, static_cast<std::uint16_t>(c)) == RIM_KIND_REPEAT &&
          expected > 0.0;
    }
    ++b;
  }
  print_message("%d blocks, largest difference %.2g\n", static_cast<int>(b), largest);
  assert_true(b == series.raw.rows() && b > 20);
  assert_true(repeats > 20);
  assert_true(rim_channels_get_health(flight.channels)->gaps > 20);
  assert_true(largest <= 1e-5);
}

void blocks_are_those_of_flight(void **) {
  std::size_t broken = 0, blocks_seen = 0;
  for (unsigned run = 0; run < 30; ++run) {
    const rim::Log log = vehicle(100 + run, 400, true);
    const rim::Layout layout = rim::layout_of(log);
    const std::vector<int> columns = rim::feature_columns(log);
    const rim::Blocks blocks = rim::make_blocks(log, columns, block_rows, period_s);
    Flight flight(layout, 1u << RIM_KIND_REPEAT);
    flight.start();
    std::size_t b = 0;
    for (std::size_t t = 0; t < log.t_s.size(); ++t) {
      const double *row = log.values.row(static_cast<Eigen::Index>(t)).data();
      if (rim_channels_row(flight.channels, log.t_s[t], row, nullptr, nullptr, nullptr) != 1)
        continue;
      assert_true(b < blocks.start_s.size());
      assert_true(rim_channels_block_start_s(flight.channels) == blocks.start_s[b]);
      assert_true(blocks.start_s[b] == log.t_s[blocks.first_row[b]]);
      assert_int_equal(t, blocks.first_row[b] + block_rows - 1);
      broken += !blocks.follows[b];
      ++b;
    }
    assert_int_equal(b, blocks.start_s.size());
    blocks_seen += b;
  }
  assert_true(broken > 60 && blocks_seen - broken > 60); // both kinds were met
}

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

// ---- calibration on channels that need no models ----

constexpr std::size_t blocks_a_run = 60;

// Two channels: an offset of the run, one that bends with the context, noise that remembers.
rim::ChannelSeries nominal_series(unsigned run) {
  std::mt19937_64 random(seed * 1000003ULL + run);
  std::normal_distribution<double> normal;
  rim::ChannelSeries s;
  s.raw.resize(blocks_a_run, 2);
  s.context.resize(blocks_a_run, 2);
  const double offset[2] = {0.3 * normal(random), 0.5 * normal(random)};
  const double bend[2] = {0.4 * normal(random), 0.2 * normal(random)};
  double noise[2] = {0.0, 0.0};
  for (Eigen::Index b = 0; b < s.raw.rows(); ++b) {
    const double u = std::sin(static_cast<double>(b) / 9.0) + 0.2 * normal(random);
    s.context.row(b) << u, normal(random);
    for (Eigen::Index c = 0; c < 2; ++c) {
      noise[c] = 0.5 * noise[c] + normal(random);
      s.raw(b, c) = 1.0 + offset[c] + bend[c] * u + noise[c];
    }
    s.start_s.push_back(static_cast<double>(b));
  }
  return s;
}

// The models are never asked: blocks are given to the search directly.
rim::FlightPlan series_plan() {
  rim::FlightPlan plan;
  plan.layout.feature_names = {"s.a", "s.b"};
  plan.layout.feature_units = {"", ""};
  plan.layout.outcome_names = plan.layout.feature_names;
  plan.layout.outcome_units = plan.layout.feature_units;
  plan.layout.outcome_feature = {0, 1};
  plan.layout.command = {0, 0};
  plan.block_rows = 2;
  plan.period_s = 0.5;
  plan.bins = 8;
  plan.ring = 64;
  rim::NominalModel model;
  model.order = 0;
  model.top = 1;
  model.centre = Eigen::VectorXd::Zero(2);
  model.inverse_scale = model.gate_weight = Eigen::VectorXd::Ones(2);
  model.prototypes = Matrix::Zero(1, 2);
  model.bandwidth = model.reach = Eigen::VectorXd::Ones(1);
  model.ln_mass = Eigen::VectorXd::Zero(1);
  model.variance = Matrix::Ones(1, 2);
  model.offset = Matrix::Zero(1, 2);
  plan.level = rim::nominal_section(model);
  return plan;
}

rim::FlightPlan calibrated(unsigned first, std::size_t runs) {
  std::vector<rim::ChannelSeries> series;
  for (std::size_t r = 0; r < runs; ++r)
    series.push_back(nominal_series(first + static_cast<unsigned>(r)));
  rim::FlightPlan plan = series_plan();
  rim::calibrate_trained(&plan, series, rim::CalibrationOptions{});
  return plan;
}

// Whether a run reaches the alarm score at any time; `shift` is added where the first feature is
// high.
bool alarms(const rim::FlightPlan &plan, const rim::ChannelSeries &run, double shift) {
  rim::Monitor monitor(rim::make_image(plan), "test");
  for (Eigen::Index b = 0; b < run.raw.rows(); ++b) {
    double values[2];
    for (std::size_t c = 0; c < 2; ++c) {
      double raw = run.raw(b, static_cast<Eigen::Index>(c));
      if (c == 1 && run.context(b, 0) > 0.0)
        raw += shift;
      values[c] =
          (raw - static_cast<double>(plan.center[c])) * static_cast<double>(plan.inverse_sd[c]);
    }
    rim_verdict verdict;
    assert_int_equal(rim_monitor_block(monitor.get(), run.start_s[static_cast<std::size_t>(b)],
                                       run.context.row(b).data(), values, plan.block_rows,
                                       &verdict),
                     RIM_OK);
    if (verdict.score >= static_cast<double>(plan.thresholds.alarm_score))
      return true;
  }
  return false;
}

// The promise holds on average over calibrations: the rate of one has a spread of its own, that of
// Beta(rank from the top, rank).
void fresh_runs_alarm_no_more_often_than_promised(void **) {
  constexpr std::size_t calibrations = 10, runs = 39, fresh = 40;
  std::size_t alarmed = 0, found = 0;
  double promised = 0.0;
  for (unsigned k = 0; k < calibrations; ++k) {
    const rim::FlightPlan plan = calibrated(1000 * k, runs);
    promised = static_cast<double>(plan.thresholds.promised_rate);
    for (unsigned r = 0; r < fresh; ++r) {
      const rim::ChannelSeries run = nominal_series(1000 * k + 500 + r);
      alarmed += alarms(plan, run, 0.0);
      found += alarms(plan, run, 6.0);
    }
  }
  assert_true(std::abs(promised - 0.05) < 1e-6);
  const double n = calibrations * fresh;
  const double variance = promised * (1.0 - promised);
  const double sd = std::sqrt(variance / n + variance / (runs + 2) / calibrations);
  const double rate = static_cast<double>(alarmed) / n;
  print_message("false alarms in %.3f of runs, promised %.3f, sd %.3f; a shift is found in %.3f\n",
                rate, promised, sd, static_cast<double>(found) / n);
  assert_true(rate <= promised + 5.0 * sd);
  assert_true(static_cast<double>(found) > 0.8 * n); // or the promise would be an empty one
}

void threads_do_not_change_a_byte(void **) {
  const char *before = std::getenv("RIM_THREADS");
  const std::string kept = before != nullptr ? before : "";
  std::vector<std::vector<std::uint8_t>> images;
  for (const char *threads : {"1", "2", "7"}) {
    setenv("RIM_THREADS", threads, 1);
    images.push_back(rim::make_image(calibrated(7, 12)));
  }
  if (before != nullptr)
    setenv("RIM_THREADS", kept.c_str(), 1);
  else
    unsetenv("RIM_THREADS");
  assert_true(images[0] == images[1] && images[0] == images[2]);
  assert_false(images[0] == rim::make_image(calibrated(8, 12)));
}

template <class Call> std::string error_of(const Call &call) {
  try {
    call();
  } catch (const rim::DataError &error) {
    return error.what();
  }
  return "no error";
}

void other_columns_are_named(void **) {
  const rim::Log log = vehicle(1, 50, false);
  const rim::Layout layout = rim::layout_of(log);
  rim::check_layout(layout, vehicle(2, 50, true));
  rim::Log renamed = vehicle(3, 50, false);
  renamed.columns[3].name = "s.altitude_m";
  const std::string other = error_of([&] { rim::check_layout(layout, renamed); });
  assert_true(mentions(other, "run3.csv") && mentions(other, "'s.altitude_m'") &&
              mentions(other, "'s.place_m'"));
  rim::Log shorter = vehicle(4, 50, false);
  shorter.columns.pop_back();
  const std::string missing = error_of([&] { rim::check_layout(layout, shorter); });
  assert_true(mentions(missing, "run4.csv") && mentions(missing, "'s.count' is missing"));
  rim::Log longer = vehicle(5, 50, false);
  longer.columns.push_back({"s.extra", "", rim::Role::sensor});
  const std::string more = error_of([&] { rim::check_layout(layout, longer); });
  assert_true(mentions(more, "run5.csv") && mentions(more, "'s.extra'"));
  const std::vector<rim::Log> logs{log, log, renamed};
  const std::string trained = error_of([&] { rim::train(logs, rim::TrainOptions{}); });
  assert_true(mentions(trained, "run3.csv") && mentions(trained, "'s.altitude_m'"));
}

void too_few_runs_are_refused(void **) {
  for (std::size_t n = 0; n < 3; ++n) {
    const std::vector<rim::Log> logs(n, vehicle(1, 200, false));
    const std::string error = error_of([&] { rim::train(logs, rim::TrainOptions{}); });
    assert_true(mentions(error, "at least 3 logs") && mentions(error, std::to_string(n)));
  }
  assert_true(mentions(error_of([] { calibrated(1, 2); }), "at least 3"));
}

// ---- the nominal spread ----

constexpr std::size_t bins = 4;

// All visit the bins alike; `offset` is the run's own.
rim::BinnedRun binned_run(unsigned run, double offset) {
  std::mt19937_64 random(seed + 77 * run);
  std::normal_distribution<double> normal;
  rim::BinnedRun out;
  out.value.resize(160, 1);
  for (Eigen::Index b = 0; b < out.value.rows(); ++b) {
    out.bin.push_back(static_cast<std::uint8_t>(b % static_cast<Eigen::Index>(bins)));
    out.value(b, 0) = offset + normal(random);
  }
  return out;
}

std::vector<std::uint8_t> codes(const std::vector<std::uint8_t> &section, std::size_t kind) {
  std::vector<std::uint8_t> out;
  const std::size_t intervals = RIM_ENVELOPE_INTERVALS(bins);
  assert_int_equal(section.size(), RIM_ENVELOPE_BYTES(1, 1, bins));
  for (std::size_t i = 0; i < intervals; ++i)
    out.push_back(section[section.size() - 2 * intervals + 2 * i + kind]);
  return out;
}

// Run 5 is far off: without it the spread is that of the others, and no other one's absence shows.
// Its contrasts, inside one run, are like everyone's.
void a_run_left_out_is_not_in_the_spread(void **) {
  std::vector<rim::BinnedRun> all, others;
  for (unsigned r = 0; r < 24; ++r) {
    all.push_back(binned_run(r, r == 5 ? 30.0 : 0.0));
    if (r != 5)
      others.push_back(all.back());
  }
  const rim::NominalSpread with(all, 1, bins, 8, {0.0});
  const rim::NominalSpread without(others, 1, bins, 8, {0.0});
  const auto level = [](const std::vector<std::uint8_t> &section) { return codes(section, 0); };
  const auto contrast = [](const std::vector<std::uint8_t> &section) { return codes(section, 1); };
  rim_envelope view;
  const std::vector<std::uint8_t> section = with.section(-1);
  std::vector<std::uint32_t> aligned(section.size() / 4 + 1);
  std::memcpy(aligned.data(), section.data(), section.size());
  assert_int_equal(rim_envelope_open(&view, reinterpret_cast<const std::uint8_t *>(aligned.data()),
                                     section.size()),
                   RIM_OK);
  for (std::size_t i = 0; i < RIM_ENVELOPE_INTERVALS(bins); ++i) {
    const double full = rim_envelope_variance(level(with.section(-1))[i]);
    const double left = rim_envelope_variance(level(with.section(5))[i]);
    const double truth = rim_envelope_variance(level(without.section(-1))[i]);
    assert_true(full > 20.0 && full < 60.0);               // 30^2 / 24 = 37.5
    assert_true(left < 0.01 * full && left > truth / 1.5); // 1/400 by noise; moments may differ
    assert_true(rim_envelope_variance(level(with.section(6))[i]) > 0.9 * full);
    if (i == bins - 1)
      continue; // the whole range has no rest
    const double d = rim_envelope_variance(contrast(with.section(-1))[i]);
    const double d5 = rim_envelope_variance(contrast(with.section(5))[i]);
    assert_true(d < 1.3 * d5 && d > d5 / 1.3 && d < 1.0);
  }
}

} // namespace

int main() {
  print_message("seed %u\n", seed);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(training_and_flight_make_the_same_channels),
      cmocka_unit_test(blocks_are_those_of_flight),
      cmocka_unit_test(promises_follow_the_ranks),
      cmocka_unit_test(fresh_runs_alarm_no_more_often_than_promised),
      cmocka_unit_test(threads_do_not_change_a_byte),
      cmocka_unit_test(other_columns_are_named),
      cmocka_unit_test(too_few_runs_are_refused),
      cmocka_unit_test(a_run_left_out_is_not_in_the_spread),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
