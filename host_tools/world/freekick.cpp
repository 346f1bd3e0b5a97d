// SPDX-License-Identifier: MIT
#include "world/freekick.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "util/error.hpp"
#include "util/toml_table.hpp"

namespace rim {
namespace {

constexpr std::uint64_t kBallStream = 1;
constexpr std::uint64_t kLuckStream = 2;
constexpr std::uint64_t kChoiceStream = 3;
constexpr double kGoalieBeforeLine_m = 0.2;
constexpr double kBlockerPart = 0.4; // of the way from the ball to the goal

std::vector<NumberKey> keys_of(FreekickParams &p) {
  return {{"half_length_m", &p.half_length_m, Range::positive},
          {"half_width_m", &p.half_width_m, Range::positive},
          {"goal_half_m", &p.goal_half_m, Range::positive},
          {"robot_radius_m", &p.robot_radius_m, Range::positive},
          {"pass_speed_mps", &p.pass_speed_mps, Range::positive},
          {"shot_speed_mps", &p.shot_speed_mps, Range::positive},
          {"open_angle_rad", &p.open_angle_rad, Range::positive},
          {"ball_min_x_m", &p.ball_min_x_m, Range::not_negative},
          {"ball_max_x_m", &p.ball_max_x_m, Range::positive},
          {"ball_min_y_m", &p.ball_min_y_m, Range::not_negative},
          {"ball_max_y_m", &p.ball_max_y_m, Range::positive},
          {"robot_accel_mps2", &p.robot_accel_mps2, Range::positive},
          {"robot_speed_mps", &p.robot_speed_mps, Range::positive},
          {"mark_m", &p.mark_m, Range::not_negative},
          {"latency_s", &p.latency_s, Range::not_negative},
          {"pass_half_m", &p.pass_half_m, Range::not_negative},
          {"pass_scale_m", &p.pass_scale_m, Range::positive},
          {"shot_half_rad", &p.shot_half_rad, Range::not_negative},
          {"shot_scale_rad", &p.shot_scale_rad, Range::positive},
          {"best_chance", &p.best_chance, Range::fraction}};
}

FreekickPlan read_plan(const std::string &path, const toml::table &table, const std::string &name) {
  const toml::node *node = table.get(name);
  if (node == nullptr)
    throw DataError(path + ": key 'plan." + name + "' is missing");
  const toml::array *numbers = node->as_array();
  if (numbers == nullptr || numbers->size() != 4 * kFreekickReceivers)
    fail(path, *node, "key 'plan." + name + "': expected 16 numbers");
  FreekickPlan plan;
  for (std::size_t i = 0; i < kFreekickReceivers; ++i) {
    double at[4];
    for (std::size_t k = 0; k < 4; ++k)
      at[k] = read_number(path, *numbers->get(4 * i + k), "plan." + name, Range::any);
    plan[i] = {{at[0], at[1]}, {at[2], at[3]}};
  }
  return plan;
}

double distance_m(const FieldPoint &a, const FieldPoint &b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

// A place on the way from a to b, this far from a.
FieldPoint towards(const FieldPoint &a, const FieldPoint &b, double metres) {
  const double all_m = distance_m(a, b);
  const double part = all_m > 0.0 ? metres / all_m : 0.0;
  return {a.x_m + part * (b.x_m - a.x_m), a.y_m + part * (b.y_m - a.y_m)};
}

double distance_to_segment_m(const FieldPoint &p, const FieldPoint &a, const FieldPoint &b) {
  const double dx = b.x_m - a.x_m, dy = b.y_m - a.y_m;
  const double length2 = dx * dx + dy * dy;
  const double along =
      length2 > 0.0 ? ((p.x_m - a.x_m) * dx + (p.y_m - a.y_m) * dy) / length2 : 0.0;
  const double part = std::clamp(along, 0.0, 1.0);
  return distance_m(p, {a.x_m + part * dx, a.y_m + part * dy});
}

double logistic(double x) { return 1.0 / (1.0 + std::exp(-x)); }

} // namespace

const char *defence_name(Defence defence) {
  static const char *const names[] = {"time", "angle", "combined"};
  return names[static_cast<int>(defence)];
}

Defence parse_defence(const std::string &name) {
  for (const Defence defence : {Defence::time, Defence::angle, Defence::combined}) {
    if (name == defence_name(defence))
      return defence;
  }
  throw UsageError("defence '" + name + "': expected time, angle or combined");
}

static void read_file(const std::string &path, FreekickParams &params, bool complete) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"freekick", "plan"});
  for (const char *name : {"freekick", "plan"}) {
    const toml::node *table = root.get(name);
    if (table == nullptr ? complete : !table->is_table())
      throw DataError(path + ": table '[" + name + "]' is missing");
  }
  if (root.contains("freekick"))
    read_numbers(path, *root.get("freekick")->as_table(), "freekick", keys_of(params), complete);
  if (root.contains("plan")) {
    const toml::table &plans = *root.get("plan")->as_table();
    std::vector<std::string> names;
    for (std::size_t k = 0; k < kFreekickPlans; ++k) {
      names.push_back("fk" + std::to_string(k + 1));
      if (complete || plans.contains(names.back()))
        params.plans[k] = read_plan(path, plans, names.back());
    }
    read_numbers(path, plans, "plan", {}, false, names);
  }
  if (params.ball_max_x_m < params.ball_min_x_m || params.ball_max_y_m < params.ball_min_y_m)
    throw DataError(path + ": key 'freekick.ball_min_x_m', '.ball_min_y_m': must not exceed max");
}

FreekickParams read_freekick_params(const std::string &path, const std::string &overlay) {
  return read_overlaid<FreekickParams>(path, overlay, read_file);
}

std::string freekick_params_toml(const FreekickParams &params) {
  FreekickParams copy = params;
  std::string text = table_toml("[freekick]", keys_of(copy)) + "\n[plan]\n";
  for (std::size_t k = 0; k < kFreekickPlans; ++k) {
    text += fmt::format("fk{} = [", k + 1);
    for (std::size_t i = 0; i < kFreekickReceivers; ++i) {
      const FreekickReceiver &r = params.plans[k][i];
      text += fmt::format("{}{}, {}, {}, {}", i > 0 ? ", " : "", r.before.x_m, r.before.y_m,
                          r.after.x_m, r.after.y_m);
    }
    text += "]\n";
  }
  return text;
}

double Freekick::goal_angle_rad(const FieldPoint &from) const {
  const double x = params_.half_length_m - from.x_m;
  return std::fabs(std::atan2(params_.goal_half_m - from.y_m, x) -
                   std::atan2(-params_.goal_half_m - from.y_m, x));
}

// Larger is more threatening.
double Freekick::threat(const FieldPoint &ball, const FieldPoint &at) const {
  const FieldPoint goal{params_.half_length_m, 0.0};
  const double time_s =
      distance_m(ball, at) / params_.pass_speed_mps + distance_m(at, goal) / params_.shot_speed_mps;
  const double angle_rad = goal_angle_rad(at);
  switch (defence_) {
  case Defence::time:
    return -time_s;
  case Defence::angle:
    return angle_rad;
  default: // wide angles before narrow ones, by time among themselves
    return angle_rad < params_.open_angle_rad ? angle_rad
                                              : params_.open_angle_rad + 1.0 / (1.0 + time_s);
  }
}

std::array<std::size_t, kFreekickReceivers> Freekick::ranking(const FieldPoint &ball,
                                                              std::size_t plan) const {
  std::array<std::size_t, kFreekickReceivers> order{};
  std::array<double, kFreekickReceivers> threats{};
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = i;
    threats[i] = threat(ball, params_.plans.at(plan)[i].before);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&threats](std::size_t a, std::size_t b) { return threats[a] > threats[b]; });
  return order;
}

// The goalie is not among them: a shot's free angle allows for it.
std::vector<FieldPoint> Freekick::defenders(const FieldPoint &ball, std::size_t plan,
                                            const Marked &marked, double moving_s) const {
  const FieldPoint goal{params_.half_length_m, 0.0};
  std::vector<FieldPoint> out;
  // Half a metre from the ball is the nearest that the rules allow (B.1).
  out.push_back(towards(ball, goal, 0.5));
  for (const double side : {-0.5, 0.5}) {
    const FieldPoint half{params_.half_length_m, side * params_.goal_half_m};
    out.push_back(towards(ball, half, kBlockerPart * distance_m(ball, half)));
  }
  const double time_s = std::max(0.0, moving_s - params_.latency_s);
  const double speeding_s = std::min(time_s, params_.robot_speed_mps / params_.robot_accel_mps2);
  const double reach_m = 0.5 * params_.robot_accel_mps2 * speeding_s * speeding_s +
                         params_.robot_speed_mps * (time_s - speeding_s);
  for (const std::size_t receiver : marked) {
    const FreekickReceiver &man = params_.plans.at(plan).at(receiver);
    const FieldPoint start = towards(man.before, goal, params_.mark_m);
    const FieldPoint end = towards(man.after, goal, params_.mark_m);
    out.push_back(towards(start, end, std::min(reach_m, distance_m(start, end))));
  }
  return out;
}

double Freekick::pass_chance(const FieldPoint &from, const FieldPoint &to,
                             const std::vector<FieldPoint> &defenders) const {
  double clear_m = INFINITY;
  for (const FieldPoint &d : defenders)
    clear_m = std::min(clear_m, distance_to_segment_m(d, from, to) - params_.robot_radius_m);
  return logistic((clear_m - params_.pass_half_m) / params_.pass_scale_m);
}

// The widest part of the goal, seen from the shooter, that no defender and not the goalie covers.
double Freekick::shot_chance(const FieldPoint &from,
                             const std::vector<FieldPoint> &defenders) const {
  const double x = params_.half_length_m - from.x_m;
  if (x <= kGoalieBeforeLine_m)
    return 0.0;
  const double low = std::atan2(-params_.goal_half_m - from.y_m, x);
  const double high = std::atan2(params_.goal_half_m - from.y_m, x);
  std::vector<std::pair<double, double>> covered;
  // The goalie halves the angle.
  const FieldPoint goalie{params_.half_length_m - kGoalieBeforeLine_m,
                          from.y_m + (x - kGoalieBeforeLine_m) * std::tan(0.5 * (low + high))};
  std::vector<FieldPoint> all = defenders;
  all.push_back(goalie);
  for (const FieldPoint &d : all) {
    const double range_m = distance_m(from, d);
    if (d.x_m <= from.x_m || range_m <= params_.robot_radius_m)
      continue;
    const double middle = std::atan2(d.y_m - from.y_m, d.x_m - from.x_m);
    const double half = std::asin(params_.robot_radius_m / range_m);
    covered.emplace_back(middle - half, middle + half);
  }
  std::sort(covered.begin(), covered.end());
  double widest = 0.0, free_from = low;
  for (const auto &[begin, end] : covered) {
    widest = std::max(widest, std::min(begin, high) - free_from);
    free_from = std::max(free_from, end);
  }
  widest = std::max(widest, high - free_from);
  return logistic((widest - params_.shot_half_rad) / params_.shot_scale_rad);
}

double Freekick::chance(const FieldPoint &ball, std::size_t plan) const {
  const auto order = ranking(ball, plan);
  return chance_against(ball, plan, {order[0], order[1]});
}

double Freekick::own_estimate(const FieldPoint &ball, std::size_t plan) const {
  double sum = 0.0;
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < kFreekickReceivers; ++i) {
    for (std::size_t k = i + 1; k < kFreekickReceivers; ++k, ++pairs)
      sum += chance_against(ball, plan, {i, k});
  }
  return sum / static_cast<double>(pairs);
}

double Freekick::chance_against(const FieldPoint &ball, std::size_t plan,
                                const Marked &marked) const {
  double best = 0.0;
  for (const FreekickReceiver &receiver : params_.plans.at(plan)) {
    // Receivers start with the pass; the ball waits for none of them.
    const double pass_s = distance_m(ball, receiver.after) / params_.pass_speed_mps;
    const double run_s = distance_m(receiver.before, receiver.after) / params_.robot_speed_mps;
    const std::vector<FieldPoint> others = defenders(ball, plan, marked, std::max(pass_s, run_s));
    best = std::max(best, pass_chance(ball, receiver.after, others) *
                              shot_chance(receiver.after, others));
  }
  return params_.best_chance * best;
}

double Freekick::best_chance(const FieldPoint &ball) const {
  double best = 0.0;
  for (std::size_t k = 0; k < kFreekickPlans; ++k)
    best = std::max(best, chance(ball, k));
  return best;
}

std::vector<FreekickEpisode> freekick_episodes(const FreekickParams &p, std::size_t kicks,
                                               std::uint64_t seed) {
  world::Random balls(seed, 1, kBallStream), lucks(seed, 1, kLuckStream),
      choices(seed, 1, kChoiceStream);
  std::vector<FreekickEpisode> out(kicks);
  for (FreekickEpisode &e : out) {
    e.ball.x_m = balls.uniform(p.ball_min_x_m, p.ball_max_x_m);
    e.ball.y_m = balls.uniform(p.ball_min_y_m, p.ball_max_y_m);
    e.luck = lucks.uniform();
    e.choice = choices.uniform();
  }
  return out;
}

} // namespace rim
