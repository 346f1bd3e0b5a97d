// SPDX-License-Identifier: MIT
#include "world/cobot_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "world/cobot.hpp"
#include "util/toml_table.hpp"

namespace rim::world {
namespace {

constexpr double kOn_m = 1e-9; // how far beyond a side a ray goes on

bool holds(const CobotMap::Rectangle &r, double x, double y) {
  return x >= r[0] && x <= r[2] && y >= r[1] && y <= r[3];
}

// Along (dx, dy) from a point inside to the side where the ray leaves.
double way_out(const CobotMap::Rectangle &r, double x, double y, double dx, double dy) {
  double way = std::numeric_limits<double>::infinity();
  if (dx != 0.0)
    way = std::min(way, ((dx > 0.0 ? r[2] : r[0]) - x) / dx);
  if (dy != 0.0)
    way = std::min(way, ((dy > 0.0 ? r[3] : r[1]) - y) / dy);
  return way;
}

std::vector<NumberKey> keys_of(CobotParams &p) {
  return {{"period_s", &p.period_s, Range::positive},
          {"period_jitter_s", &p.period_jitter_s, Range::not_negative},
          {"speed_mps", &p.speed_mps, Range::positive},
          {"door_speed_mps", &p.door_speed_mps, Range::positive},
          {"turn_radps", &p.turn_radps, Range::positive},
          {"accel_mps2", &p.accel_mps2, Range::positive},
          {"decel_mps2", &p.decel_mps2, Range::positive},
          {"turn_accel_radps2", &p.turn_accel_radps2, Range::positive},
          {"latency_s", &p.latency_s, Range::not_negative},
          {"latency_jitter_s", &p.latency_jitter_s, Range::not_negative},
          {"encoder_noise_mps", &p.encoder_noise_mps, Range::not_negative},
          {"floor_noise_mps", &p.floor_noise_mps, Range::not_negative},
          {"floor_time_s", &p.floor_time_s, Range::positive},
          {"run_limit_sd", &p.run_limit_sd, Range::fraction},
          {"run_gain_sd", &p.run_gain_sd, Range::fraction},
          {"base_radius_m", &p.base_radius_m, Range::positive},
          {"body_radius_m", &p.body_radius_m, Range::positive},
          {"body_height_m", &p.body_height_m, Range::positive},
          {"tick_m", &p.tick_m, Range::positive},
          {"counter_bits", &p.counter_bits, Range::positive},
          {"pose_noise_m", &p.pose_noise_m, Range::not_negative},
          {"battery_v", &p.battery_v, Range::positive},
          {"battery_drop_vps", &p.battery_drop_vps, Range::not_negative},
          {"ray_view_rad", &p.ray_view_rad, Range::positive},
          {"ray_range_m", &p.ray_range_m, Range::positive},
          {"ray_noise_m", &p.ray_noise_m, Range::not_negative},
          {"failure", &p.failure, Range::fraction}};
}

template <std::size_t N>
std::vector<std::array<double, N>> read_rows(const std::string &path, const toml::table &table,
                                             const char *key) {
  const toml::array *rows = table[key].as_array();
  if (rows == nullptr)
    throw DataError(path + ": key 'map." + key + "': an array of arrays is needed");
  std::vector<std::array<double, N>> out;
  for (const toml::node &node : *rows) {
    const toml::array *row = node.as_array();
    if (row == nullptr || row->size() != N)
      fail(path, node, std::string(key) + ": " + std::to_string(N) + " numbers are needed");
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i)
      values[i] = read_number(path, *row->get(i), key, Range::any);
    out.push_back(values);
  }
  return out;
}

std::size_t node_number(const std::string &path, double value, std::size_t nodes) {
  if (!(value >= 0.0 && value < static_cast<double>(nodes) && value == std::floor(value)))
    throw DataError(path + ": key 'map': there is no node " + std::to_string(value));
  return static_cast<std::size_t>(value);
}

void read_map(const std::string &path, const toml::table &table, CobotMap *map) {
  map->corridors = read_rows<4>(path, table, "corridors");
  map->doors = read_rows<4>(path, table, "doors");
  map->offices = read_rows<4>(path, table, "offices");
  map->nodes = read_rows<2>(path, table, "nodes");
  const std::size_t n = map->nodes.size();
  for (const auto &edge : read_rows<2>(path, table, "edges"))
    map->edges.push_back({node_number(path, edge[0], n), node_number(path, edge[1], n)});
  for (const auto &goal : read_rows<1>(path, table, "goals"))
    map->goals.push_back(node_number(path, goal[0], n));
  if (map->goals.size() < 2)
    throw DataError(path + ": key 'map.goals': at least 2 are needed");
}

} // namespace

double cast_ray(const CobotMap &map, double x_m, double y_m, double angle_rad, double range_m) {
  const double dx = std::cos(angle_rad), dy = std::sin(angle_rad);
  double gone = 0.0;
  for (int step = 0; step < 64 && gone < range_m; ++step) {
    const double x = x_m + gone * dx, y = y_m + gone * dy;
    double way = -1.0;
    for (const auto *areas : {&map.corridors, &map.doors, &map.offices}) {
      for (const CobotMap::Rectangle &r : *areas) {
        if (holds(r, x, y))
          way = std::max(way, way_out(r, x, y, dx, dy));
      }
    }
    if (way < 0.0)
      break;
    gone += way + kOn_m;
  }
  return std::min(gone, range_m);
}

std::vector<std::size_t> find_path(const CobotMap &map, std::size_t from, std::size_t to) {
  const std::size_t n = map.nodes.size();
  const double far = std::numeric_limits<double>::infinity();
  std::vector<double> way(n, far);
  std::vector<std::size_t> next(n, n);
  way[to] = 0.0;
  for (std::size_t round = 0; round < n; ++round) { // Bellman and Ford, from the goal
    for (const auto &edge : map.edges) {
      const auto &a = map.nodes[edge[0]], &b = map.nodes[edge[1]];
      const double length = std::hypot(a[0] - b[0], a[1] - b[1]);
      for (int turn = 0; turn < 2; ++turn) {
        const std::size_t i = edge[turn == 0 ? 0 : 1], k = edge[turn == 0 ? 1 : 0];
        if (way[k] + length < way[i]) {
          way[i] = way[k] + length;
          next[i] = k;
        }
      }
    }
  }
  std::vector<std::size_t> path;
  while (from != to && next[from] < n) {
    from = next[from];
    path.push_back(from);
  }
  return path;
}

void read_cobot(const std::string &base, const std::string &overlay, CobotParams *params,
                CobotMap *map) {
  for (const std::string &path : {base, overlay}) {
    if (path.empty())
      continue;
    const toml::table root = parse_toml(path);
    read_numbers(path, root, "", {}, false, {"cobot", "map"});
    const toml::table *numbers = root["cobot"].as_table();
    if (numbers == nullptr)
      throw DataError(path + ": table '[cobot]' is missing");
    read_numbers(path, *numbers, "cobot", keys_of(*params), path == base);
    const toml::table *places = root["map"].as_table();
    if (places != nullptr) {
      *map = CobotMap{};
      read_map(path, *places, map);
    } else if (path == base) {
      throw DataError(path + ": table '[map]' is missing");
    }
    const double bits = params->counter_bits;
    if (bits < 8.0 || bits > 32.0 || bits != std::floor(bits))
      throw DataError(path + ": key 'cobot.counter_bits': a whole number, 8 to 32");
  }
}

std::string cobot_params_toml(const CobotParams &params) {
  CobotParams copy = params;
  return table_toml("[cobot]", keys_of(copy));
}

} // namespace rim::world
