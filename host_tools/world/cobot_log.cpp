// SPDX-License-Identifier: MIT
#include "world/cobot_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>

#include "log/csv_text.hpp"
#include "log/labels.hpp"
#include "util/atomic_file.hpp"
#include "util/error.hpp"
#include "util/toml_table.hpp"

namespace rim::world {
namespace {

const char *const kOutcomes[] = {"vx_mps", "vy_mps", "omega_radps"};

std::vector<Column> columns_of(std::size_t dims, bool encoders) {
  std::vector<std::string> names = {"x.time_s", "x.x_m",    "x.y_m",        "x.phi_rad",
                                    "u.vx_mps", "u.vy_mps", "u.omega_radps"};
  if (dims >= 15) {
    for (const char *name :
         {"x.battery_v", "x.edge_done_m", "x.edge_left_m", "x.edge_error_rad", "x.planes",
          "x.plane_points", "x.plane_distance_m", "x.plane_angle_rad"})
      names.emplace_back(name);
  }
  for (std::size_t i = 15; i < dims; ++i)
    names.push_back(fmt::format("x.ray{:03d}_m", i - 14));
  for (int w = 1; encoders && w <= 4; ++w)
    names.push_back(fmt::format("s.enc{}_ticks", w));
  for (const char *outcome : kOutcomes) {
    for (const char *prefix : {"z.", "m.", "sd."}) {
      if (!encoders)
        names.push_back(std::string(prefix) + outcome);
    }
  }
  std::vector<Column> columns;
  for (const std::string &name : names) {
    Column column{name, unit_of_name(name), Role::context};
    role_of_name(name, column.role);
    columns.push_back(column);
  }
  return columns;
}

// Eq. 4.10 one row on, and what the encoders' noise makes of it.
void add_predictions(const CobotParams &p, const CobotRow &before, const CobotRow &row,
                     std::vector<double> &values) {
  const double dt_s = row.t_s - before.t_s;
  const double limit[3] = {p.accel_mps2, p.accel_mps2, p.turn_accel_radps2};
  // The noise of w: least squares over four wheels at the base's radius.
  const double noise[3] = {p.encoder_noise_mps, p.encoder_noise_mps,
                           p.encoder_noise_mps / (std::sqrt(2.0) * p.base_radius_m)};
  for (std::size_t i = 0; i < 3; ++i) {
    const double change = row.in_force[i] - before.velocity[i];
    const double most = limit[i] * dt_s;
    const double floor = std::hypot(noise[i], p.floor_noise_mps);
    values.push_back(row.velocity[i]);
    values.push_back(before.velocity[i] + std::clamp(change, -most, most));
    values.push_back(std::fabs(change) > most ? std::sqrt(2.0) * floor : floor);
  }
}

std::vector<double> values_of(Cobot &cobot, const CobotParams &params, const CobotRow &before,
                              const CobotRow &row, std::size_t dims, bool encoders) {
  std::vector<double> v = {row.t_s,        row.x_m,        row.y_m,       row.phi_rad,
                           row.command[0], row.command[1], row.command[2]};
  if (dims >= 15) {
    v.push_back(row.battery_v);
    v.insert(v.end(), row.edge.begin(), row.edge.end());
    v.insert(v.end(), row.plane.begin(), row.plane.end());
  }
  if (dims > 15) {
    const std::vector<double> rays = cobot.rays(dims - 15);
    v.insert(v.end(), rays.begin(), rays.end());
  }
  if (encoders)
    v.insert(v.end(), row.ticks.begin(), row.ticks.end());
  else
    add_predictions(params, before, row, v);
  return v;
}

std::size_t number_from_one(const std::string &path, const toml::table &table, const char *key,
                            std::size_t most) {
  const toml::node *node = table.get(key);
  if (node == nullptr)
    return 0;
  const double value = read_number(path, *node, key, Range::positive);
  if (value != std::floor(value) || value > static_cast<double>(most))
    fail(path, *node, std::string(key) + ": a whole number, 1 to " + std::to_string(most));
  return static_cast<std::size_t>(value) - 1;
}

CobotEffect effect_of(const std::string &path, const toml::table &table, const CobotMap &map) {
  CobotEffect effect;
  read_numbers(path, table, "effect",
               {{"after_s", &effect.after_s, Range::not_negative},
                {"duration_s", &effect.duration_s, Range::not_negative},
                {"share", &effect.share, Range::not_negative}},
               false, {"kind", "phase", "wheel", "corridor"});
  effect.wheel = number_from_one(path, table, "wheel", 4);
  effect.corridor = number_from_one(path, table, "corridor", map.corridors.size());
  const toml::node *kind = table.get("kind");
  if (kind == nullptr)
    fail(path, table, "effect: 'kind' is missing");
  const std::string text = read_string(path, *kind, "kind");
  bool is_known = false;
  for (int k = 0; k <= static_cast<int>(CobotEffectKind::pushed); ++k) {
    if (text == cobot_effect_name(static_cast<CobotEffectKind>(k))) {
      effect.kind = static_cast<CobotEffectKind>(k);
      is_known = true;
    }
  }
  if (!is_known)
    fail(path, *kind,
         "kind: encoder, corridor, left_turn, collision, hold, stuck or pushed, not '" + text +
             "'");
  if (const toml::node *phase = table.get("phase")) {
    const std::string name = read_string(path, *phase, "phase");
    if (name != "moving" && name != "starting" && name != "accelerating")
      fail(path, *phase, "phase: moving, starting or accelerating");
    effect.phase = name == "moving"     ? CobotPhase::moving
                   : name == "starting" ? CobotPhase::starting
                                        : CobotPhase::accelerating;
  }
  return effect;
}

double label_number(const std::string &text, const std::string &where, const char *column) {
  char *end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str() || *end != '\0' || !std::isfinite(value))
    throw DataError(where + ": column '" + column + "': '" + text + "' is not a number");
  return value;
}

} // namespace

Recording record_cobot(Cobot &cobot, const CobotParams &params, std::size_t dims, std::size_t rows,
                       bool encoders) {
  if (dims != 7 && (dims < 15 || dims > 515))
    throw UsageError("cobot: dims 7 or 15 to 515");
  Recording out;
  out.log.columns = columns_of(dims, encoders);
  out.log.values.resize(static_cast<Eigen::Index>(rows),
                        static_cast<Eigen::Index>(out.log.columns.size()));
  CobotRow before = cobot.next();
  for (std::size_t i = 0; i < rows; ++i) {
    const CobotRow row = cobot.next();
    const std::vector<double> values = values_of(cobot, params, before, row, dims, encoders);
    for (std::size_t k = 0; k < values.size(); ++k)
      out.log.values(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) = values[k];
    out.log.t_s.push_back(row.t_s);
    out.log.row.push_back(static_cast<std::uint32_t>(i + 1));
    out.finding.push_back(row.acts ? 1 : 0);
    before = row;
  }
  out.log.rows_in_file = static_cast<std::uint32_t>(rows);
  return out;
}

std::vector<CobotEffect> read_cobot_effects(const std::string &path, const CobotMap &map) {
  const toml::table root = parse_toml(path);
  read_numbers(path, root, "", {}, false, {"effect"});
  const toml::array *effects = root["effect"].as_array();
  if (effects == nullptr || effects->empty())
    throw DataError(path + ": no [[effect]]");
  std::vector<CobotEffect> out;
  for (const toml::node &node : *effects) {
    if (!node.is_table())
      fail(path, node, "effect: a table is needed");
    out.push_back(effect_of(path, *node.as_table(), map));
  }
  return out;
}

void write_labels(const std::vector<InterferenceLabels> &labels, const std::string &path) {
  AtomicFile file(path);
  file.write("log,start_s,end_s,kind\n");
  for (const InterferenceLabels &l : labels) {
    for (const CobotInterval &i : l.intervals)
      file.write(
          fmt::format("{},{:.12g},{:.12g},{}\n", csv_field(l.log), i.start_s, i.end_s, i.kind));
  }
  file.commit();
}

std::vector<InterferenceLabels> read_labels(const std::string &path) {
  const std::string all = read_file(path);
  const std::string_view text = all;
  constexpr std::string_view mark = "\xEF\xBB\xBF"; // before what spreadsheets write
  std::size_t at = text.substr(0, mark.size()) == mark ? mark.size() : 0;
  std::string_view line;
  if (!take_line(text, at, line) || trimmed(line) != "log,start_s,end_s,kind")
    throw DataError(path + ": the first line must be log,start_s,end_s,kind");
  std::vector<InterferenceLabels> out;
  std::vector<std::string_view> fields;
  for (std::size_t row = 1; take_line(text, at, line); ++row) {
    if (trimmed(line).empty())
      continue;
    const std::string where = path + ":row " + std::to_string(row);
    split_fields(line, ',', fields);
    std::vector<std::string> cells;
    for (const std::string_view field : fields)
      cells.emplace_back(trimmed(field));
    if (cells.size() != 4)
      throw DataError(where + ": " + std::to_string(cells.size()) + " columns instead of 4");
    const CobotInterval interval{label_number(cells[1], where, "start_s"),
                                 label_number(cells[2], where, "end_s"), cells[3]};
    if (!(interval.end_s > interval.start_s))
      throw DataError(where + ": column 'end_s': not after start_s");
    const auto same = std::find_if(out.begin(), out.end(),
                                   [&](const auto &labels) { return labels.log == cells[0]; });
    if (same == out.end())
      out.push_back({cells[0], {interval}});
    else
      same->intervals.push_back(interval);
  }
  return out;
}

} // namespace rim::world
