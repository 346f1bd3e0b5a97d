// SPDX-License-Identifier: MIT
// Tables of the landing campaign.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "thesis/experiment/lander.hpp"
#include "thesis/experiment/thesis_lander.hpp"
#include "util/error.hpp"
#include "util/table.hpp"

namespace rim::experiment {

namespace {

// Wilson's 95 % interval of a share, as text in percent.
std::string share_text(std::size_t hits, std::size_t n) {
  if (n == 0)
    return "none";
  const double z = 1.96, total = static_cast<double>(n), p = static_cast<double>(hits) / total;
  const double centre = (p + z * z / (2 * total)) / (1 + z * z / total);
  const double half =
      z / (1 + z * z / total) * std::sqrt(p * (1 - p) / total + z * z / (4 * total * total));
  return fmt::format("{:.1f} % [{:.1f}, {:.1f}] ({} of {})", 100 * p,
                     100 * std::max(0.0, centre - half), 100 * std::min(1.0, centre + half), hits,
                     n);
}

double median(std::vector<double> values) {
  if (values.empty())
    return std::nan("");
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n % 2 == 1 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

std::string number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}f}", value, digits) : "-";
}

std::vector<ThesisPoint> thesis_points(const nlohmann::json &unit) {
  std::vector<ThesisPoint> points;
  for (const nlohmann::json &p : unit.at("thesis")) {
    ThesisPoint point;
    point.rows = p.at(0);
    point.normalised = p.at(1);
    point.outcome = p.at(2);
    points.push_back(point);
  }
  return points;
}

// The runs of one fault (0: nominal), in order.
std::vector<const nlohmann::json *> runs_of(const Campaign &campaign, std::size_t fault) {
  std::vector<const nlohmann::json *> runs;
  for (const auto &[number_, unit] : campaign.units) {
    if (unit.at("fault") == fault)
      runs.push_back(&unit);
  }
  return runs;
}

struct Counts {
  std::size_t always = 0, never = 0, sensor_found = 0, sensor_right = 0;
};

Counts print_faults(const Campaign &campaign, std::FILE *to) {
  const double alarm_score = campaign.config.at("alarm_score");
  Table table({{"fault", ""},
               {"found", "runs"},
               {"alarm at row", "median"},
               {"score/alarm", "least"},
               {"score/alarm", "median"},
               {"named in most", "outcome"},
               {"kind", ""},
               {"right sensor", "detections"}});
  Counts counts;
  const nlohmann::json &faults = campaign.config.at("faults");
  for (std::size_t k = 0; k < faults.size(); ++k) {
    const std::string sensor = faults[k].at("sensor");
    std::vector<double> rows, scores;
    std::map<std::string, std::size_t> named, kinds;
    const auto runs = runs_of(campaign, k + 1);
    for (const nlohmann::json *run : runs) {
      scores.push_back(run->at("score").get<double>() / alarm_score);
      if (!run->at("alarmed").get<bool>())
        continue;
      rows.push_back(run->at("row"));
      ++named[run->at("channel")];
      ++kinds[run->at("kind")];
    }
    const auto most = [](const std::map<std::string, std::size_t> &of) {
      const auto best = std::max_element(
          of.begin(), of.end(), [](const auto &a, const auto &b) { return a.second < b.second; });
      return best == of.end() ? std::string("-") : best->first;
    };
    const std::size_t right = sensor.empty() ? 0 : named[sensor];
    if (!sensor.empty()) {
      counts.sensor_found += rows.size();
      counts.sensor_right += right;
    }
    counts.always += rows.size() == runs.size() ? 1 : 0;
    counts.never += rows.empty() ? 1 : 0;
    table.add({faults[k].at("name"), fmt::format("{} of {}", rows.size(), runs.size()),
               number(median(rows), 0), number(*std::min_element(scores.begin(), scores.end()), 2),
               number(median(scores), 2), most(named), most(kinds),
               sensor.empty() ? "(physics)" : fmt::format("{} of {}", right, rows.size())});
  }
  table.print(to);
  return counts;
}

// The thesis's procedure, its threshold raised until it alarms in as many nominal runs as ours.
void print_thesis(const Campaign &campaign, double rate, std::FILE *to) {
  std::vector<std::vector<ThesisPoint>> nominal;
  for (const nlohmann::json *run : runs_of(campaign, 0))
    nominal.push_back(thesis_points(*run));
  const double scale = thesis_scale(nominal, rate);
  std::size_t per_instant = 0;
  for (const auto &run : nominal)
    per_instant += thesis_detect(run, 1.0).found ? 1 : 0;
  fmt::print(
      to,
      "\nthe thesis's procedure on the same landings: at its per-instant 95 % threshold any "
      "alarm in {};\nits threshold raised {:.2f} times to alarm in at most {:.1f} % of them:\n",
      share_text(per_instant, nominal.size()), scale, 100 * rate);
  Table table({{"fault", ""},
               {"found", "runs"},
               {"alarm at row", "median"},
               {"ours", "runs"},
               {"ours at row", "median"},
               {"ratio", "ours/thesis"}});
  std::size_t always = 0;
  std::vector<double> ratios;
  const nlohmann::json &faults = campaign.config.at("faults");
  for (std::size_t k = 0; k < faults.size(); ++k) {
    std::vector<double> theirs, ours;
    const auto runs = runs_of(campaign, k + 1);
    for (const nlohmann::json *run : runs) {
      const ThesisDetection found = thesis_detect(thesis_points(*run), scale);
      if (found.found)
        theirs.push_back(found.rows);
      const bool mine = run->at("alarmed");
      if (mine)
        ours.push_back(run->at("row"));
      if (found.found && mine) {
        ratios.push_back(run->at("row").get<double>() / static_cast<double>(found.rows));
      }
    }
    always += theirs.size() == runs.size() ? 1 : 0;
    table.add({faults[k].at("name"), fmt::format("{} of {}", theirs.size(), runs.size()),
               number(median(theirs), 0), fmt::format("{} of {}", ours.size(), runs.size()),
               number(median(ours), 0), number(median(ours) / median(theirs), 2)});
  }
  table.print(to);
  fmt::print(to,
             "the thesis's procedure finds {} of {} faults in every run; landings that both find: "
             "{}, median ratio of rows {}\n",
             always, faults.size(), ratios.size(), number(median(ratios), 2));
}

} // namespace

void print_lander_campaign(const Campaign &campaign, std::FILE *to) {
  if (campaign.kind != "lander")
    throw DataError("not a lander campaign: " + campaign.kind);
  if (!campaign.complete())
    throw DataError("the lander campaign is not complete: merge its shards");
  const nlohmann::json &config = campaign.config;
  const std::uint64_t seed = config.at("seed");
  fmt::print(to,
             "lander{}: {} training runs of seed {}; fresh runs of seed {}\n"
             "image {} bytes; alarm at score {:.2f}, rank {} of {}: promised run-level false "
             "alarms {:.1f} %\n",
             config.value("flight", false) ? ", flight profile" : "",
             config.at("training_runs").get<std::size_t>(), seed, seed + 1,
             config.at("image_bytes").get<std::size_t>(), config.at("alarm_score").get<double>(),
             config.at("rank").get<std::size_t>(), config.at("training_runs").get<std::size_t>(),
             100 * config.at("promised_rate").get<double>());
  std::size_t alarmed = 0;
  const auto nominal = runs_of(campaign, 0);
  for (const nlohmann::json *run : nominal)
    alarmed += run->at("alarmed").get<bool>() ? 1 : 0;
  fmt::print(to, "nominal runs with any alarm: {}\n\n", share_text(alarmed, nominal.size()));
  const Counts counts = print_faults(campaign, to);
  fmt::print(to,
             "found in every run: {} of {} faults; never found: {}; right sensor named first: {}\n",
             counts.always, config.at("faults").size(), counts.never,
             share_text(counts.sensor_right, counts.sensor_found));
  if (config.at("thesis").get<bool>() && !nominal.empty()) {
    print_thesis(campaign, static_cast<double>(alarmed) / static_cast<double>(nominal.size()), to);
  }
}

} // namespace rim::experiment
