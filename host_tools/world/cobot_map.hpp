// SPDX-License-Identifier: MIT
// world/cobot_map.hpp - the floor that the cobot drives on: free rectangles, a graph of nodes.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace rim::world {

struct CobotParams;

struct CobotMap {
  using Rectangle = std::array<double, 4>; // x0 y0 x1 y1, m
  std::vector<Rectangle> corridors, doors, offices;
  std::vector<std::array<double, 2>> nodes;
  std::vector<std::array<std::size_t, 2>> edges;
  std::vector<std::size_t> goals; // nodes
};

// Distance from a free point to the next wall, range_m at most; 0 from within a wall.
double cast_ray(const CobotMap &map, double x_m, double y_m, double angle_rad, double range_m);

// Nodes after `from` up to `to`, shortest first in metres; empty where there is no way.
std::vector<std::size_t> find_path(const CobotMap &map, std::size_t from, std::size_t to);

// data/cobot.toml with parameters of `overlay` over it (empty: none). Throws DataError.
void read_cobot(const std::string &base, const std::string &overlay, CobotParams *params,
                CobotMap *map);
std::string cobot_params_toml(const CobotParams &params);

} // namespace rim::world
