// SPDX-License-Identifier: MIT
// The logs as a user would have them, and the truth apart from them.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "nature.hpp"

namespace nature {

namespace {

using nlohmann::json;

std::string log_name(const Case &c, std::size_t i) {
  const std::size_t runs = c.run_rows.size();
  return i < runs ? "run_" + std::to_string(i + 1) + ".csv"
                  : "holdout_" + std::to_string(i - runs + 1) + ".csv";
}

void append(std::string &text, const char *format, double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, format, value == 0.0 ? 0.0 : value); // no -0
  text += buffer;
}

void write_file(const std::string &path, const std::string &text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out)
    throw std::runtime_error(path + ": cannot be written");
}

json rounded(double value) { return std::round(value * 1e4) / 1e4; }

// Of one channel over the hold-out logs: the simulation, and the truth as a model.
json holdout_scores(const Case &c, const std::vector<Record> &records, std::size_t k) {
  const double sd = c.world->channels[k].sd;
  double before = 0.0, after = 0.0, nll_before = 0.0, nll_after = 0.0, n = 0.0;
  for (std::size_t i = c.run_rows.size(); i < records.size(); ++i) {
    const Record &r = records[i];
    for (std::size_t j = 0; j < r.rows(); ++j) {
      const double a = r.z[k][j] - r.m[k][j], b = r.z[k][j] - r.truth[k][j];
      const double var = sd * sd * r.ratio[k][j];
      before += a * a;
      after += b * b;
      nll_before += 0.5 * (a * a / (sd * sd) + std::log(6.283185307179586 * sd * sd));
      nll_after += 0.5 * (b * b / var + std::log(6.283185307179586 * var));
      n += 1.0;
    }
  }
  return {{"rmse_before", std::sqrt(before / n)},
          {"rmse_true", std::sqrt(after / n)},
          {"nll_before", nll_before / n},
          {"nll_true", nll_after / n}};
}

json effect_json(const Case &c, const std::vector<Record> &records, std::size_t number) {
  const Effect &e = c.effects[number];
  const World &w = *c.world;
  const Fairness fair = judge(c, records, number);
  static const char *kinds[] = {"mean", "variance", "dropout", "stuck"};
  json gate = nullptr;
  if (!e.gate.features.empty()) {
    gate = {{"lower", e.gate.lower}, {"upper", e.gate.upper}, {"ellipse", e.gate.ellipse}};
    for (const std::size_t f : e.gate.features)
      gate["features"].push_back(w.features[f].name);
  }
  const auto feature = [&w](int f) -> json {
    return f < 0 ? json(nullptr) : json(w.features[static_cast<std::size_t>(f)].name);
  };
  return {{"family", e.family},
          {"cause", e.cause},
          {"kind", kinds[static_cast<int>(e.kind)]},
          {"channel", w.channels[e.channel].name},
          {"gate", gate},
          {"size", e.size},
          {"size_sd", e.size / w.channels[e.channel].sd},
          {"features", {feature(e.first), feature(e.second)}},
          {"shape", e.shape},
          {"width", e.width},
          {"order", e.order},
          {"share_of_rows", rounded(fair.share)},
          {"llr", rounded(fair.llr)},
          {"rival", fair.rival},
          {"rival_margin", rounded(fair.margin)}};
}

// Per row: noise-free effect in sd by channel, and whether any effect acts.
json log_json(const Case &c, const Record &r, std::size_t number) {
  json log = {{"file", log_name(c, number)},
              {"holdout", number >= c.run_rows.size()},
              {"rows", r.rows()},
              {"effect_sd", json::object()}};
  std::vector<int> acts(r.rows(), 0);
  for (std::size_t k = 0; k < r.m.size(); ++k) {
    if (!c.world->channels[k].logged)
      continue;
    json column = json::array();
    bool any = false;
    for (std::size_t i = 0; i < r.rows(); ++i) {
      column.push_back(rounded(r.effect[k][i]));
      any = any || std::abs(r.effect[k][i]) > 0.0;
      if (std::abs(r.effect[k][i]) > 0.1 || r.ratio[k][i] > 1.0 || r.fault[k][i])
        acts[i] = 1;
    }
    if (any)
      log["effect_sd"][c.world->channels[k].name] = column;
  }
  log["acts"] = acts;
  return log;
}

} // namespace

void write_logs(const Case &c, const std::vector<Record> &records, const std::string &folder) {
  std::filesystem::create_directories(folder);
  const World &w = *c.world;
  Random random(c.seed, 0, 3);
  std::vector<std::size_t> order(w.features.size()); // of the columns: says nothing
  for (std::size_t i = 0; i < order.size(); ++i)
    order[i] = i;
  for (std::size_t i = order.size() - 1; i > 0; --i)
    std::swap(order[i], order[random.below(i + 1)]);
  const bool from_zero = random.uniform() < 0.5;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const double start_s = from_zero ? 0.0 : std::floor(random.uniform(10.0, 5000.0));
    std::string text = "t_s";
    for (const std::size_t f : order)
      text += "," + w.features[f].name;
    for (const Channel &k : w.channels)
      if (k.logged)
        text += ",z." + k.name + ",m." + k.name + ",sd." + k.name;
    const Record &r = records[i];
    for (std::size_t j = 0; j < r.rows(); ++j) {
      append(text, "\n%.9g", start_s + r.t_s[j]);
      for (const std::size_t f : order)
        append(text, ",%.9g", r.x[j][f]);
      for (std::size_t k = 0; k < w.channels.size(); ++k) {
        if (!w.channels[k].logged)
          continue;
        append(text, ",%.9g", r.z[k][j]);
        append(text, ",%.9g", r.m[k][j]);
        append(text, ",%.9g", w.channels[k].sd);
      }
    }
    write_file((std::filesystem::path(folder) / log_name(c, i)).string(), text + "\n");
  }
}

void write_truth(const Case &c, const std::vector<Record> &records, const std::string &path) {
  json truth = {{"schema", "rim-hidden-truth/1"},
                {"seed", c.seed},
                {"family", c.family},
                {"attempts", c.attempt + 1},
                {"world", c.world->name},
                {"noise", c.noise},
                {"noise_parameter", c.noise_parameter},
                {"effects", json::array()},
                {"logs", json::array()},
                {"holdout", json::object()}};
  for (std::size_t k = 0; k < c.effects.size(); ++k)
    truth["effects"].push_back(effect_json(c, records, k));
  for (std::size_t k = 0; k < c.world->channels.size(); ++k) {
    if (!c.world->channels[k].logged)
      continue;
    truth["channels"].push_back(
        {{"name", c.world->channels[k].name}, {"sd", c.world->channels[k].sd}});
    truth["holdout"][c.world->channels[k].name] = holdout_scores(c, records, k);
  }
  for (std::size_t i = 0; i < records.size(); ++i)
    truth["logs"].push_back(log_json(c, records[i], i));
  write_file(path, truth.dump() + "\n");
}

} // namespace nature
