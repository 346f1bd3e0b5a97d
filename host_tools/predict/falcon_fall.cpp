// SPDX-License-Identifier: MIT
#include "predict/falcon_fall.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "predict/columns.hpp"
#include "stats/robust.hpp"
#include "util/error.hpp"

namespace rim::world {

namespace {

constexpr double kEarthRadius_m = 6371000.0; // mean (IUGG)
constexpr double kStandardGravity_mps2 = 9.80665;
// Half the window of a speed, and the longest time between its readings; of a slow log in rows.
constexpr double kHalf_s = 0.25, kGap_s = 0.2, kHalf_rows = 1.05, kGap_rows = 1.6;
constexpr double kSlowest_s = 1.5;       // rows farther apart say too little of a second's fall
constexpr double kLeastSpeed_mps = 10.0; // below it stands on the ground
constexpr double kLeastNoise_mps = 0.05; // of a reading
constexpr double kCoarseStep_m = 500.0;  // from here on the longer window
constexpr double kWindow_s = 5.0, kCoarseWindow_s = 10.0, kLongestWindow_s = 60.0;
constexpr double kSlopeError_mps = 0.15; // of the prediction, that calls for a longer window
constexpr double kMisfit = 0.4;          // rms over the step; rounding alone gives 0.29
constexpr double kCovered = 0.8;         // least share of a window with readings
const char *const kWho = "world falcon";

// Columns of the input, and how many rows up to each have an engine on or an event near.
struct Flight {
  const Log &log;
  int speed, altitude, step;
  double usual_step_m = 0.0;
  double noise_mps = 0.0; // of a reading of the speed
  double row_s = 0.0, half_s = kHalf_s, gap_s = kGap_s;
  std::vector<std::uint32_t> on, event; // rows before

  explicit Flight(const Log &source);
  double value(std::size_t row, int column) const {
    return log.values(static_cast<Eigen::Index>(row), column);
  }
  // First row not before t_s.
  std::size_t at(double t_s) const {
    return static_cast<std::size_t>(std::lower_bound(log.t_s.begin(), log.t_s.end(), t_s - 1e-9) -
                                    log.t_s.begin());
  }
  bool powered(std::size_t first, std::size_t end) const { return on[end] > on[first]; }
  bool disturbed(std::size_t first, std::size_t end) const {
    return powered(first, end) || event[end] > event[first];
  }
  double step_m(std::size_t row) const { return step < 0 ? usual_step_m : value(row, step); }
};

Flight::Flight(const Log &source) : log(source) {
  speed = needed_column(log, "s.speed_mps", kWho);
  altitude = needed_column(log, "s.altitude_m", kWho);
  const int engine = needed_column(log, "u.engine_on", kWho);
  const int near = find_column(log, "u.near_event");
  step = find_column(log, "x.altitude_step_m");
  on.assign(1, 0);
  event.assign(1, 0);
  std::vector<double> changes, steps;
  for (std::size_t r = 1; r < log.t_s.size(); ++r)
    steps.push_back(log.t_s[r] - log.t_s[r - 1]);
  row_s = median(std::move(steps));
  half_s = std::max(kHalf_s, kHalf_rows * row_s);
  gap_s = std::max(kGap_s, kGap_rows * row_s);
  double bend = 0.0;
  std::size_t bends = 0;
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    on.push_back(on.back() + (value(r, engine) > 0.5 ? 1 : 0));
    event.push_back(event.back() + (near >= 0 && value(r, near) > 0.5 ? 1 : 0));
    if (r > 0 && value(r, altitude) != value(r - 1, altitude))
      changes.push_back(std::fabs(value(r, altitude) - value(r - 1, altitude)));
    if (r > 1 && log.t_s[r] - log.t_s[r - 2] < std::max(kGap_s, 2.0 * gap_s - kGap_s) &&
        !disturbed(r - 2, r + 1)) {
      bend += std::fabs(value(r, speed) - 2.0 * value(r - 1, speed) + value(r - 2, speed));
      ++bends;
    }
  }
  usual_step_m = median(std::move(changes));
  // Mean absolute second difference: sqrt(2/pi) sqrt(6) sd. The median would be 0: steps.
  const double mean = bends > 0 ? bend / static_cast<double>(bends) : 0.0;
  noise_mps = std::max(kLeastNoise_mps, mean * std::sqrt(M_PI / 12.0));
}

struct Reading {
  double value, sd;
};

// Straight line through the readings about a moment, at the moment.
std::optional<Reading> speed_at(const Flight &f, double t_s) {
  const std::size_t first = f.at(t_s - f.half_s), end = f.at(t_s + f.half_s + 2e-9);
  if (end - first < 3 || f.log.t_s[first] > t_s + 1e-9 || f.log.t_s[end - 1] < t_s - 1e-9)
    return std::nullopt;
  double s0 = 0, s1 = 0, s2 = 0, y0 = 0, y1 = 0;
  for (std::size_t r = first; r < end; ++r) {
    if (r > first && f.log.t_s[r] - f.log.t_s[r - 1] > f.gap_s)
      return std::nullopt;
    const double x = f.log.t_s[r] - t_s, y = f.value(r, f.speed);
    s0 += 1.0;
    s1 += x;
    s2 += x * x;
    y0 += y;
    y1 += x * y;
  }
  const double value = (s2 * y0 - s1 * y1) / (s0 * s2 - s1 * s1);
  // The steps of a display make neighbouring errors alike: half as many count.
  return Reading{value, f.noise_mps * std::sqrt(2.0 / s0)};
}

struct Slope {
  double rate_mps, sd_mps, altitude_m, misfit; // misfit: rms over the altitude's step
};

// Quadratic through the altitude of the last window_s; none where the readings do not cover it.
std::optional<Slope> altitude_slope(const Flight &f, double t_s, double window_s,
                                    bool engines_off) {
  const std::size_t first = f.at(t_s - window_s), end = f.at(t_s + 2e-9);
  if (end < first + 5 || t_s - f.log.t_s[first] < kCovered * window_s)
    return std::nullopt;
  if (engines_off && f.powered(first, end))
    return std::nullopt;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double origin = f.value(end - 1, f.altitude);
  double low = origin, high = origin, step = 0.0;
  for (std::size_t r = first; r < end; ++r) {
    const double x = (f.log.t_s[r] - t_s) / window_s, h = f.value(r, f.altitude);
    const Eigen::Vector3d powers(1.0, x, x * x);
    normal += powers * powers.transpose();
    right += powers * (h - origin);
    low = std::min(low, h);
    high = std::max(high, h);
    step = std::max(step, f.step_m(r));
  }
  const Eigen::Vector3d fit = normal.ldlt().solve(right);
  double square = 0.0;
  std::size_t runs = 1;
  double before = 0.0;
  for (std::size_t r = first; r < end; ++r) {
    const double x = (f.log.t_s[r] - t_s) / window_s;
    const double error = f.value(r, f.altitude) - origin - fit.dot(Eigen::Vector3d(1.0, x, x * x));
    square += error * error;
    runs += r > first && (error < 0.0) != (before < 0.0) ? 1 : 0;
    before = error;
  }
  double rms = std::sqrt(square / static_cast<double>(end - first));
  const double misfit = step > 0.0 ? rms / step : 0.0;
  if (high - low < 3.0 * step) // too few steps to show their own error
    rms = std::max(rms, step / std::sqrt(12.0));
  // Slope at the end of a quadratic through n independent errors; runs of one sign stand for them.
  const double n = static_cast<double>(std::max<std::size_t>(runs, 3));
  return Slope{fit(1) / window_s, rms * std::sqrt(192.0 / n) / window_s, origin + fit(0), misfit};
}

std::optional<Slope> best_slope(const Flight &f, double t_s, double speed_mps) {
  const std::size_t newest = f.at(t_s + 2e-9) - 1;
  double window_s = f.step_m(newest) >= kCoarseStep_m ? kCoarseWindow_s : kWindow_s;
  std::optional<Slope> best = altitude_slope(f, t_s, window_s, false);
  while (best && 1.5 * window_s <= kLongestWindow_s) {
    const double error = best->sd_mps / speed_mps * fall_gravity_mps2(best->altitude_m);
    if (error * kFallStep_s <= kSlopeError_mps)
      break;
    window_s *= 1.5;
    const auto longer = altitude_slope(f, t_s, window_s, true);
    if (!longer || longer->misfit > kMisfit)
      break;
    if (longer->sd_mps < best->sd_mps)
      best = longer;
  }
  return best;
}

} // namespace

double fall_gravity_mps2(double altitude_m) {
  const double ratio = kEarthRadius_m / (kEarthRadius_m + altitude_m);
  return kStandardGravity_mps2 * ratio * ratio;
}

double fall_speed_mps(double speed_mps, double altitude_m, double sin_gamma, double step_s) {
  const double gravity = fall_gravity_mps2(altitude_m), climb = sin_gamma * speed_mps;
  const double level = speed_mps * speed_mps - climb * climb; // horizontal speed, squared
  const double down = gravity - level / (kEarthRadius_m + altitude_m);
  const double rise = (climb - 0.5 * down * step_s) * step_s;
  return std::sqrt(std::max(0.0, speed_mps * speed_mps - 2.0 * gravity * rise));
}

Log FalconFall::predict(const Log &log) const {
  const Flight f(log);
  if (f.row_s > kSlowest_s)
    throw DataError(fmt::format("{}: world falcon: rows come every {:.3g} s; one every {:g} s at "
                                "least is needed",
                                log.path, f.row_s, kSlowest_s));
  PredictionRows rows(log, {"s.speed_mps", "s.altitude_m", "x.climb_mps", "x.sin_gamma"},
                      {"speed_mps"});
  for (auto i = next_window(log, 0, kFallStep_s); i; i = next_window(log, *i + 1, kFallStep_s)) {
    const double t_s = log.t_s.front() + static_cast<double>(*i) * kFallStep_s;
    const double end_s = t_s + kFallStep_s;
    if (end_s > log.t_s.back())
      break;
    if (f.disturbed(f.at(t_s - f.half_s), f.at(end_s + f.half_s + 2e-9)))
      continue;
    const auto speed = speed_at(f, t_s), later = speed_at(f, end_s);
    if (!speed || !later || speed->value < kLeastSpeed_mps || later->value < kLeastSpeed_mps)
      continue;
    const auto slope = best_slope(f, t_s, speed->value);
    if (!slope)
      continue;
    const double sine = std::clamp(slope->rate_mps / speed->value, -1.0, 1.0);
    const double by_slope =
        fall_gravity_mps2(slope->altitude_m) * kFallStep_s * slope->sd_mps / speed->value;
    const double sd = std::hypot(std::hypot(speed->sd, later->sd), by_slope);
    rows.add(t_s, log.row[f.at(t_s + 2e-9) - 1],
             {speed->value, slope->altitude_m, slope->rate_mps, sine, later->value,
              fall_speed_mps(speed->value, slope->altitude_m, sine, kFallStep_s), sd});
  }
  if (rows.rows() == 0) {
    throw DataError(log.path + ": world falcon: no second with the engines off, no event near and "
                               "readings of speed and altitude throughout");
  }
  return std::move(rows).finish();
}

bool FalconFall::advance(const Log &now, const Matrix &outcome, Log *next) const {
  const int speed = needed_column(*next, "s.speed_mps", kWho);
  const int altitude = needed_column(*next, "s.altitude_m", kWho);
  const int climb = needed_column(*next, "x.climb_mps", kWho);
  const int sine = needed_column(*next, "x.sin_gamma", kWho);
  const OutcomeColumns columns = outcome_columns(*next, "speed_mps");
  const Eigen::Index count = next->values.rows();
  if (outcome.rows() != count || now.values.rows() != count || outcome.cols() != 1)
    throw std::logic_error("FalconFall::advance: rows do not correspond");
  for (Eigen::Index r = 0; r < count; ++r) {
    auto row = next->values.row(r);
    row(speed) = std::max(0.0, outcome(r, 0));
    row(climb) = row(sine) * row(speed);
    row(columns.m) = fall_speed_mps(row(speed), row(altitude), row(sine), kFallStep_s);
  }
  return true;
}

} // namespace rim::world
