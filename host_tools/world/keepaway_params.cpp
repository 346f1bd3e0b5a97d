// SPDX-License-Identifier: MIT
#include <cmath>
#include <limits>

#include "util/toml_table.hpp"
#include "world/keepaway.hpp"

namespace rim::world {
namespace {

std::vector<NumberKey> keys_of(KeepawayParams &p) {
  return {{"field_length_m", &p.field_length_m, Range::positive},
          {"field_width_m", &p.field_width_m, Range::positive},
          {"keepers", &p.keepers, Range::positive},
          {"takers", &p.takers, Range::positive},
          {"robot_radius_m", &p.sizes.robot_radius_m, Range::positive},
          {"robot_front_m", &p.sizes.robot_front_m, Range::positive},
          {"ball_radius_m", &p.sizes.ball_radius_m, Range::positive},
          {"robot_mass_kg", &p.sizes.robot_mass_kg, Range::positive},
          {"ball_mass_kg", &p.sizes.ball_mass_kg, Range::positive},
          {"ball_restitution", &p.sizes.ball_restitution, Range::fraction},
          {"robot_restitution", &p.sizes.robot_restitution, Range::fraction},
          {"accel_mps2", &p.limits.accel_mps2, Range::positive},
          {"speed_mps", &p.limits.speed_mps, Range::positive},
          {"turn_radps", &p.limits.turn_radps, Range::positive},
          {"slide_mps2", &p.friction.slide_mps2, Range::positive},
          {"roll_mps2", &p.friction.roll_mps2, Range::positive},
          {"latency_s", &p.latency_s, Range::not_negative},
          {"keeper_latency_s", &p.keeper_latency_s, Range::not_negative},
          {"keeper_start_s", &p.keeper_start_s, Range::any},
          {"aim_s", &p.aim_s, Range::not_negative},
          {"hold_min_s", &p.hold_min_s, Range::not_negative},
          {"hold_max_s", &p.hold_max_s, Range::not_negative},
          {"kick_min_mps", &p.kick_min_mps, Range::positive},
          {"kick_max_mps", &p.kick_max_mps, Range::positive},
          {"kick_speeds", &p.kick_speeds, Range::positive},
          {"kick_directions", &p.kick_directions, Range::positive},
          {"kick_heading_sd_rad", &p.kick_heading_sd_rad, Range::not_negative},
          {"kick_speed_sd", &p.kick_speed_sd, Range::not_negative},
          {"capture_mps", &p.capture_mps, Range::positive},
          {"mark_passer_m", &p.mark_passer_m, Range::positive},
          {"mark_receiver_m", &p.mark_receiver_m, Range::positive},
          {"keeper_start_m", &p.keeper_start_m, Range::not_negative},
          {"taker_start_m", &p.taker_start_m, Range::not_negative},
          {"keeper_apart_m", &p.keeper_apart_m, Range::not_negative},
          {"spots", &p.spots, Range::not_negative},
          {"held_s", &p.held_s, Range::not_negative},
          {"loose_s", &p.loose_s, Range::positive},
          {"step_s", &p.step_s, Range::positive},
          {"control_s", &p.control_s, Range::positive},
          {"plan_step_s", &p.plan_step_s, Range::positive},
          {"plan_horizon_s", &p.plan_horizon_s, Range::positive},
          {"time_sd_s", &p.time_sd_s, Range::positive}};
}

void read_bounds(const std::string &path, const toml::node &node, const std::string &key,
                 double *low, double *high) {
  const toml::array *pair = node.as_array();
  if (pair == nullptr || pair->size() != 2)
    fail(path, node, "key '" + key + "': expected [low, high]");
  *low = read_number(path, *pair->get(0), key, Range::any);
  *high = read_number(path, *pair->get(1), key, Range::any);
  if (*low > *high)
    fail(path, node, "key '" + key + "': low must not exceed high");
}

TakerHabit read_habit(const std::string &path, const toml::node &node) {
  const toml::table *table = node.as_table();
  if (table == nullptr)
    fail(path, node, "key 'habit': expected [[habit]]");
  TakerHabit habit;
  std::vector<std::string> others = {"name", "why"};
  for (std::size_t k = 0; k < kKeepawayFeatures; ++k) {
    habit.low[k] = -std::numeric_limits<double>::infinity();
    habit.high[k] = -habit.low[k];
    const std::string key = kKeepawayFeatureNames[k];
    others.push_back(key);
    if (const toml::node *bounds = table->get(key))
      read_bounds(path, *bounds, "habit." + key, &habit.low[k], &habit.high[k]);
  }
  read_numbers(path, *table, "habit",
               {{"start_s", &habit.start_s, Range::any},
                {"accel_factor", &habit.accel_factor, Range::positive},
                {"speed_factor", &habit.speed_factor, Range::positive}},
               true, others);
  const toml::node *name = table->get("name");
  if (name == nullptr)
    fail(path, node, "key 'habit.name': missing");
  habit.name = read_string(path, *name, "habit.name");
  return habit;
}

void check(const std::string &path, const KeepawayParams &p) {
  const auto wrong = [&](const char *key, const char *reason) {
    throw DataError(path + ": key 'keepaway." + key + "': " + reason);
  };
  if (p.keepers != std::floor(p.keepers) || p.keepers < 2.0 || p.keepers > 8.0)
    wrong("keepers", "expected a whole number from 2 to 8");
  if (p.takers != std::floor(p.takers) || p.takers < 1.0 || p.takers > kMostTakers)
    wrong("takers", "expected a whole number from 1 to 5");
  if (p.hold_min_s > p.hold_max_s)
    wrong("hold_min_s", "must not exceed hold_max_s");
  if (p.kick_min_mps > p.kick_max_mps || p.kick_max_mps > 8.0)
    wrong("kick_max_mps", "must lie between kick_min_mps and the league's 8 m/s");
  if (p.sizes.robot_front_m > p.sizes.robot_radius_m)
    wrong("robot_front_m", "must not exceed robot_radius_m");
  // A ball may not jump over a robot, nor be kicked into one within a step.
  if (p.step_s * p.kick_max_mps > p.sizes.robot_radius_m)
    wrong("step_s", "so long that a ball could pass through a robot");
  if (p.kick_directions < 1.0 || p.kick_directions > 360.0)
    wrong("kick_directions", "expected 1 to 360");
  if (p.kick_speeds < 1.0 || p.kick_speeds > 32.0)
    wrong("kick_speeds", "expected 1 to 32");
  if (p.plan_step_s > p.plan_horizon_s)
    wrong("plan_step_s", "must not exceed plan_horizon_s");
}

void read_file(const std::string &path, KeepawayParams &params, bool complete) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"keepaway", "habit"});
  const toml::node *table = root.get("keepaway");
  if (table != nullptr && !table->is_table())
    fail(path, *table, "key 'keepaway': expected a table");
  if (complete && table == nullptr)
    throw DataError(path + ": table '[keepaway]' is missing");
  if (table != nullptr)
    read_numbers(path, *table->as_table(), "keepaway", keys_of(params), complete);
  if (const toml::node *habits = root.get("habit")) {
    if (!habits->is_array())
      fail(path, *habits, "key 'habit': expected [[habit]]");
    params.habits.clear();
    for (const toml::node &habit : *habits->as_array())
      params.habits.push_back(read_habit(path, habit));
  }
  check(path, params);
}

} // namespace

KeepawayParams read_keepaway_params(const std::string &base, const std::string &overlay) {
  return read_overlaid<KeepawayParams>(base, overlay, read_file);
}

std::string keepaway_params_toml(const KeepawayParams &params) {
  KeepawayParams copy = params;
  return table_toml("[keepaway]", keys_of(copy));
}

} // namespace rim::world
