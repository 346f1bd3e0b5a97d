// SPDX-License-Identifier: MIT
#include "world/golf_params.hpp"

#include "util/toml_table.hpp"

namespace rim::world {
namespace {

std::vector<NumberKey> keys_of(GolfParams &p) {
  return {{"length_m", &p.length_m, Range::positive},
          {"width_m", &p.width_m, Range::positive},
          {"reward_at_target", &p.reward_at_target, Range::any},
          {"reward_slope", &p.reward_slope, Range::any},
          {"noise_sd", &p.noise_sd, Range::positive},
          {"shift", &p.shift, Range::any},
          {"success", &p.success, Range::fraction},
          {"success_behind", &p.success_behind, Range::fraction},
          {"min_distance_fraction", &p.min_distance_fraction, Range::positive},
          {"max_distance_fraction", &p.max_distance_fraction, Range::positive},
          {"min_direction_deg", &p.min_direction_deg, Range::any},
          {"max_direction_deg", &p.max_direction_deg, Range::any},
          {"min_subtended_rad", &p.min_subtended_rad, Range::positive},
          {"max_subtended_rad", &p.max_subtended_rad, Range::positive},
          {"binary_min_distance_m", &p.binary_min_distance_m, Range::positive},
          {"binary_max_distance_m", &p.binary_max_distance_m, Range::positive},
          {"binary_min_subtended_rad", &p.binary_min_subtended_rad, Range::positive},
          {"binary_max_subtended_rad", &p.binary_max_subtended_rad, Range::positive},
          {"binary_max_tilt_rad", &p.binary_max_tilt_rad, Range::not_negative},
          {"min_region_fraction", &p.min_region_fraction, Range::fraction}};
}

void check_order(const std::string &path, const char *name, double low, double high) {
  if (low > high)
    throw DataError(path + ": key 'golf.min_" + name + "': must not exceed its max");
}

void read_file(const std::string &path, GolfParams &params, bool complete) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"golf"});
  const toml::node *golf = root.get("golf");
  if (golf == nullptr || !golf->is_table())
    throw DataError(path + ": table '[golf]' is missing");
  read_numbers(path, *golf->as_table(), "golf", keys_of(params), complete);
  check_order(path, "distance_fraction", params.min_distance_fraction,
              params.max_distance_fraction);
  check_order(path, "direction_deg", params.min_direction_deg, params.max_direction_deg);
  check_order(path, "subtended_rad", params.min_subtended_rad, params.max_subtended_rad);
}

} // namespace

GolfParams read_golf_params(const std::string &base, const std::string &overlay) {
  return read_overlaid<GolfParams>(base, overlay, read_file);
}

std::string golf_params_toml(const GolfParams &params) {
  GolfParams copy = params;
  return table_toml("[golf]", keys_of(copy));
}

} // namespace rim::world
