// SPDX-License-Identifier: MIT
#include "predict/unicycle.hpp"

#include <algorithm>
#include <cmath>

#include "predict/columns.hpp"
#include "stats/robust.hpp"
#include "util/error.hpp"

namespace rim::world {

namespace {

constexpr double kGap_s = 0.1;
constexpr double kLeastSd = 1e-6; // m/s and rad/s: a simulated log may have no scatter at all
const char *const kWho = "world unicycle";

struct Columns {
  int x, y, theta, v, w, ok;
  explicit Columns(const Log &log)
      : x(needed_column(log, "x.x_m", kWho)), y(needed_column(log, "x.y_m", kWho)),
        theta(needed_column(log, "x.theta_rad", kWho)), v(needed_column(log, "u.cmd_v_mps", kWho)),
        w(needed_column(log, "u.cmd_w_radps", kWho)), ok(needed_column(log, "x.pose_ok", kWho)) {}
};

double wrapped(double angle_rad) { return std::remainder(angle_rad, 2.0 * M_PI); }

// What was driven and commanded from row `first` to row `last`.
struct Drive {
  double forward_mps, turn_radps, command_mps, command_radps;
};

Drive drive(const Log &log, const Columns &c, std::size_t first, std::size_t last) {
  const auto at = [&log](std::size_t row, int column) {
    return log.values(static_cast<Eigen::Index>(row), column);
  };
  double turn = 0.0, v = 0.0, w = 0.0;
  for (std::size_t r = first; r < last; ++r) {
    const double dt = log.t_s[r + 1] - log.t_s[r];
    turn += wrapped(at(r + 1, c.theta) - at(r, c.theta));
    v += dt * at(r, c.v);
    w += dt * at(r, c.w);
  }
  const double time_s = log.t_s[last] - log.t_s[first];
  const double heading = at(first, c.theta) + 0.5 * turn;
  const double along = (at(last, c.x) - at(first, c.x)) * std::cos(heading) +
                       (at(last, c.y) - at(first, c.y)) * std::sin(heading);
  // A turning robot drives an arc; its chord is shorter by sin(a)/a.
  const double half = 0.5 * turn;
  const double chord = std::fabs(half) < 1e-6 ? 1.0 : std::sin(half) / half;
  return {along / chord / time_s, turn / time_s, v / time_s, w / time_s};
}

// Row nearest to a moment, or the number of rows where none is within half the longest gap.
std::size_t nearest(const Log &log, double t_s) {
  const auto after = std::lower_bound(log.t_s.begin(), log.t_s.end(), t_s);
  auto row = static_cast<std::size_t>(after - log.t_s.begin());
  if (row == log.t_s.size() || (row > 0 && t_s - log.t_s[row - 1] < log.t_s[row] - t_s))
    --row;
  return std::fabs(log.t_s[row] - t_s) <= 0.5 * kGap_s ? row : log.t_s.size();
}

bool is_whole(const Log &log, const Columns &c, std::size_t first, std::size_t last) {
  if (first >= log.t_s.size() || last >= log.t_s.size() || last <= first)
    return false;
  for (std::size_t r = first; r <= last; ++r) {
    if (!(log.values(static_cast<Eigen::Index>(r), c.ok) > 0.5) ||
        (r > first && log.t_s[r] - log.t_s[r - 1] > kGap_s))
      return false;
  }
  return true;
}

// Fills a column of standard deviations from the second differences of its outcome.
void fill_sd(Log *log, const OutcomeColumns &c) {
  std::vector<double> bends;
  for (Eigen::Index r = 2; r < log->values.rows(); ++r) {
    const auto i = static_cast<std::size_t>(r);
    if (log->t_s[i] - log->t_s[i - 2] < 2.5 * kUnicycleWindow_s)
      bends.push_back(log->values(r, c.z) - 2.0 * log->values(r - 1, c.z) +
                      log->values(r - 2, c.z));
  }
  log->values.col(c.sd).setConstant(
      std::max(kLeastSd, mad_sd(std::move(bends), 0.0) / std::sqrt(6)));
}

} // namespace

Log Unicycle::predict(const Log &log) const {
  const Columns c(log);
  PredictionRows rows(log, {"u.cmd_v_mps", "u.cmd_w_radps", "x.x_m", "x.y_m", "x.theta_rad"},
                      {"forward_mps", "turn_radps"});
  for (auto i = next_window(log, 0, kUnicycleWindow_s); i;
       i = next_window(log, *i + 1, kUnicycleWindow_s)) {
    const double t_s = log.t_s.front() + static_cast<double>(*i) * kUnicycleWindow_s;
    if (t_s + kUnicycleWindow_s > log.t_s.back() + 0.5 * kGap_s)
      break;
    const std::size_t first = nearest(log, t_s), last = nearest(log, t_s + kUnicycleWindow_s);
    if (!is_whole(log, c, first, last))
      continue;
    const Drive d = drive(log, c, first, last);
    const auto pose = log.values.row(static_cast<Eigen::Index>(first));
    rows.add(t_s, log.row[first],
             {d.command_mps, d.command_radps, pose(c.x), pose(c.y), wrapped(pose(c.theta)),
              d.forward_mps, d.command_mps, 1.0, d.turn_radps, d.command_radps, 1.0});
  }
  if (rows.rows() < kUnicycleLeastRows) {
    throw DataError(log.path + ": world unicycle: fewer than " +
                    std::to_string(kUnicycleLeastRows) +
                    " windows of 0.2 s with good poses and rows at most 0.1 s apart");
  }
  Log result = std::move(rows).finish();
  fill_sd(&result, outcome_columns(result, "forward_mps"));
  fill_sd(&result, outcome_columns(result, "turn_radps"));
  return result;
}

bool Unicycle::advance(const Log &now, const Matrix &outcome, Log *next) const {
  if (outcome.rows() != next->values.rows() || now.values.rows() != next->values.rows())
    throw std::logic_error("Unicycle::advance: rows do not correspond");
  return true;
}

} // namespace rim::world
