// SPDX-License-Identifier: MIT
// One case: what was claimed against what was hidden.
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "grade.hpp"

namespace grade {

namespace {

constexpr double kWorse = 1.02; // a hold-out's RMSE after over before

Json read_json(const std::string &path) {
  std::ifstream in(path, std::ios::binary);
  if (!in)
    throw std::runtime_error(path + ": cannot be read");
  return Json::parse(in);
}

std::string base_name(const std::string &path) {
  const std::size_t cut = path.find_last_of('/');
  return cut == std::string::npos ? path : path.substr(cut + 1);
}

// labels.csv as (log's file name, row) of the rows that some finding claims. `lines` counts them
// all.
std::map<std::string, std::set<std::size_t>>
read_labels(const std::string &path, std::map<std::string, std::size_t> &lines) {
  std::map<std::string, std::set<std::size_t>> claimed;
  std::ifstream in(path);
  std::string line;
  if (!std::getline(in, line) || line.rfind("log,row,finding", 0) != 0)
    throw std::runtime_error("labels.csv: no header log,row,finding");
  while (std::getline(in, line)) {
    const std::size_t second = line.rfind(','), first = line.rfind(',', second - 1);
    if (second == std::string::npos || first == std::string::npos)
      throw std::runtime_error("labels.csv: '" + line + "'");
    std::string log = line.substr(0, first);
    if (log.size() > 1 && log.front() == '"')
      log = log.substr(1, log.size() - 2);
    ++lines[base_name(log)];
    if (std::stol(line.substr(second + 1)) != 0)
      claimed[base_name(log)].insert(std::stoul(line.substr(first + 1)));
  }
  return claimed;
}

double f1_of_labels(const Json &truth, const std::string &path) {
  std::map<std::string, std::size_t> lines;
  const auto claimed = read_labels(path, lines);
  double both = 0.0, missed = 0.0, wrong = 0.0;
  for (const Json &log : truth.at("logs")) {
    if (log.at("holdout"))
      continue;
    const std::string name = log.at("file");
    if (lines[name] != log.at("rows").get<std::size_t>())
      throw std::runtime_error("labels.csv: " + std::to_string(lines[name]) + " rows of " + name);
    const auto found = claimed.find(name);
    const Json &acts = log.at("acts");
    for (std::size_t i = 0; i < acts.size(); ++i) {
      const bool is = acts[i].get<int>() != 0;
      const bool said = found != claimed.end() && found->second.count(i + 1) > 0;
      both += is && said ? 1.0 : 0.0;
      missed += is && !said ? 1.0 : 0.0;
      wrong += !is && said ? 1.0 : 0.0;
    }
  }
  const double sum = 2.0 * both + missed + wrong;
  return sum > 0.0 ? 2.0 * both / sum : 1.0;
}

std::string at_channel(const Json &e) {
  return e.at("cause").get<std::string>() + "@" + e.at("channel").get<std::string>();
}

// No region: the field is absent, null or without features.
bool is_everywhere(const Json &finding) {
  const auto region = finding.find("region");
  return region == finding.end() || region->is_null() || !region->contains("features") ||
         region->at("features").empty();
}

double number(const Json &object, const char *key, double otherwise) {
  const auto at = object.find(key);
  return at != object.end() && at->is_number() ? at->get<double>() : otherwise;
}

// Share of the true model's gain that the extension has on the held-out logs: of mean squared
// error over the channels with an effect of the mean (each in its sd), else of likelihood. Null for
// faults of sensors alone.
Json gain_share(const Json &truth, const Json &channels) {
  std::map<std::string, std::set<std::string>> kinds;
  for (const Json &e : truth.at("effects"))
    kinds[e.at("channel")].insert(e.at("kind").get<std::string>());
  double mean_got = 0.0, mean_all = 0.0, nll_got = 0.0, nll_all = 0.0;
  for (const Json &channel : truth.at("channels")) {
    const std::string name = channel.at("name");
    const auto &kind = kinds[name];
    if (kind.empty() || kind.count("stuck") || kind.count("dropout"))
      continue;
    const Json &best = truth.at("holdout").at(name);
    const Json mine = channels.contains(name) ? channels.at(name) : Json::object();
    if (kind.count("mean")) {
      const double sd = channel.at("sd"), before = best.at("rmse_before"),
                   after = best.at("rmse_true");
      const double own_before = number(mine, "rmse_before", before);
      const double own = number(mine, "rmse_after", own_before);
      mean_got += (own_before * own_before - own * own) / (sd * sd);
      mean_all += (before * before - after * after) / (sd * sd);
    } else {
      nll_got += number(mine, "nll_before", 0.0) - number(mine, "nll_after", 0.0);
      nll_all += best.at("nll_before").get<double>() - best.at("nll_true").get<double>();
    }
  }
  if (mean_all > 0.0)
    return mean_got / mean_all;
  return nll_all > 0.0 ? Json(nll_got / nll_all) : Json(nullptr);
}

void grade_gain(const Json &truth, const Json &diagnosis, Json &line) {
  const Json gain = diagnosis.value("gain", Json::object());
  const Json channels = gain.value("channels", Json::object());
  if (!line["null"])
    line["gain_share"] = gain_share(truth, channels);
  double worst = 0.0;
  for (const auto &[name, score] : channels.items()) {
    const double before = number(score, "rmse_before", 0.0),
                 after = number(score, "rmse_after", 0.0);
    if (before > 0.0)
      worst = std::max(worst, after / before);
    const Json &best = truth.at("holdout").at(name);
    const double stated = best.at("rmse_before");
    bool sensor = false; // rows that are no measurement may be left out
    for (const Json &e : truth.at("effects"))
      sensor = sensor ||
               (e.at("channel") == name && (e.at("kind") == "stuck" || e.at("kind") == "dropout"));
    if (!sensor && std::abs(before - stated) > 0.01 * stated)
      line["notes"].push_back(name + ": rmse_before is not that of the hold-out logs");
  }
  line["worse_ratio"] = worst;
  line["worse"] = worst > kWorse;
  if (diagnosis.at("findings").size() > 0 && channels.empty())
    line["notes"].push_back("no gain reported");
}

void grade_findings(const Json &truth, const Json &diagnosis, Json &line) {
  const Json &findings = diagnosis.at("findings"), &effects = truth.at("effects");
  for (const Json &f : findings)
    line["claimed"].push_back(at_channel(f));
  if (line["null"]) {
    line["false_claim"] = !findings.empty();
    return;
  }
  bool first_is_right = false, everywhere = false, listed = false;
  std::size_t named = 0;
  for (const Json &e : effects) {
    const std::string wanted = at_channel(e);
    bool any = false;
    for (const Json &f : findings)
      any = any || at_channel(f) == wanted;
    named += any ? 1 : 0;
    if (findings.empty())
      continue;
    const Json &first = findings[0];
    first_is_right = first_is_right || at_channel(first) == wanted;
    everywhere = everywhere ||
                 (at_channel(first) == wanted && e.at("gate").is_null() && is_everywhere(first));
    for (const Json &a : first.value("alternatives", Json::array()))
      listed = listed || a.at("cause") == e.at("cause");
    line["separable"] = first.value("separable", true);
  }
  const double f1 = line["f1"];
  line["found"] = !findings.empty() && (f1 >= 0.7 || everywhere);
  line["listed"] = listed;
  if (line["two"])
    line["two_named"] = named == effects.size();
  else
    line["named"] = first_is_right;
}

} // namespace

Json grade_case(const std::string &truth_path, const std::string &folder, int exit_status,
                double seconds) {
  const Json truth = read_json(truth_path);
  const Json &effects = truth.at("effects");
  Json line = {{"seed", truth.at("seed")},
               {"family", truth.at("family")},
               {"world", truth.at("world")},
               {"noise", truth.at("noise")},
               {"null", effects.empty()},
               {"two", effects.size() > 1},
               {"expected", Json::array()},
               {"claimed", Json::array()},
               {"exit", exit_status},
               {"seconds", seconds},
               {"failed", false},
               {"found", nullptr},
               {"named", nullptr},
               {"two_named", nullptr},
               {"false_claim", nullptr},
               {"f1", nullptr},
               {"gain_share", nullptr},
               {"worse", nullptr},
               {"worse_ratio", nullptr},
               {"separable", nullptr},
               {"listed", nullptr},
               {"notes", Json::array()}};
  for (const Json &e : effects)
    line["expected"].push_back(at_channel(e));
  try {
    const Json diagnosis = read_json(folder + "/diagnosis.json");
    const double f1 = f1_of_labels(truth, folder + "/labels.csv");
    if (!line["null"])
      line["f1"] = f1;
    grade_findings(truth, diagnosis, line);
    grade_gain(truth, diagnosis, line);
    const int wanted = diagnosis.at("findings").empty() ? 0 : 1;
    if (exit_status != wanted)
      throw std::runtime_error("exit status " + std::to_string(exit_status) + " instead of " +
                               std::to_string(wanted));
  } catch (const std::exception &e) {
    line["failed"] = true;
    line["notes"].push_back(e.what());
    if (line["null"]) {
      line["false_claim"] = true; // a null that breaks the tool is no success
    } else {
      line["found"] = false;
      line["f1"] = 0.0;
      line["gain_share"] = 0.0;
      line[line["two"] ? "two_named" : "named"] = false;
    }
  }
  return line;
}

} // namespace grade
