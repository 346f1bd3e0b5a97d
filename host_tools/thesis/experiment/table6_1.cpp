// SPDX-License-Identifier: MIT
#include "thesis/experiment/table6_1.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>

#include "thesis/baseline/baseline.hpp"
#include "thesis/experiment/alarm_score.hpp"
#include "thesis/experiment/cobot_watch.hpp"
#include "thesis/experiment/golf.hpp"
#include "thesis/experiment/golf_points.hpp"
#include "thesis/experiment/plan_figure.hpp"
#include "thesis/experiment/precision_recall.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"
#include "util/table.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "table6.1";
constexpr double kFalseAlarms = 0.05;
constexpr std::size_t kCobotDims = 7;

// A domain is calibrated once and has one or more effects.
struct Effect {
  const char *name;
  std::size_t golf_dims; // 0: the robot
  CobotCase which;
};
constexpr Effect kEffects[] = {
    {"golf 2-D", 2, CobotCase::nominal},  {"golf 30-D", 30, CobotCase::nominal},
    {"encoder", 0, CobotCase::encoder},   {"collision", 0, CobotCase::collision},
    {"corridor", 0, CobotCase::corridor}, {"left turn", 0, CobotCase::left_turn},
};
constexpr std::size_t kEffectCount = sizeof kEffects / sizeof kEffects[0];
constexpr std::size_t kDomains = 3; // golf 2-D, golf 30-D, robot
std::size_t domain_of(std::size_t effect) { return std::min(effect, kDomains - 1); }

struct Unit {
  std::size_t effect;
  bool has_effect;
  std::uint64_t seed;
};

std::size_t units_of(const Table61 &e) { return kDomains * e.calibration + kEffectCount * e.runs; }

Unit unit_of(const Table61 &e, std::uint64_t number) {
  const std::uint64_t first = e.seed + kCobotNominal;
  if (number < kDomains * e.calibration)
    return {number / e.calibration, false, first + number % e.calibration};
  const std::uint64_t i = number - kDomains * e.calibration;
  return {i / e.runs, true, first + e.calibration + i % e.runs};
}

// What a detector leaves of a run: the records of its score, and F1, or the scores of the true and
// of the other points where they are reported one by one.
nlohmann::json outcome_of(const BaselineResult &result, const std::vector<bool> &truth) {
  nlohmann::json out = {{"records", score_records(result.score, truth)},
                        {"anomalous", std::count(truth.begin(), truth.end(), true)}};
  if (!result.is_pointwise) {
    out["f1"] = compare_points(result.inside, truth).f1;
    return out;
  }
  out["scores"] = {nlohmann::json::array(), nlohmann::json::array()};
  for (std::size_t i = 0; i < truth.size(); ++i)
    out["scores"][truth[i] ? 0 : 1].push_back(result.score[i]);
  return out;
}

nlohmann::json run_baselines(const BaselineData &data, const std::vector<bool> &truth) {
  nlohmann::json out = nlohmann::json::array();
  for (const Baseline &baseline : baselines())
    out.push_back(outcome_of(baseline.detect(data), truth));
  return out;
}

nlohmann::json golf_json(const Unit &unit) {
  const std::size_t dims = kEffects[unit.effect].golf_dims;
  const GolfPoints points = golf_points(dims, unit.seed, unit.has_effect);
  const BaselineData data{points.r.size(), dims, 1, points.u.data(), points.r.data(), points.place};
  nlohmann::json out = run_baselines(data, points.truth);
  const GolfRun ours = run_golf(dims, unit.seed, unit.has_effect, GolfSearch::rich);
  nlohmann::json records = nlohmann::json::array();
  for (std::size_t k = 0; k < ours.score_by_anomalous.size(); ++k)
    records.push_back({ours.score_by_anomalous[k], k});
  out.push_back(
      {{"records", records}, {"anomalous", ours.score_by_anomalous.size() - 1}, {"f1", ours.f1}});
  return out;
}

nlohmann::json cobot_json(const Unit &unit, const CobotScatter &scatter) {
  const CobotCase which = unit.has_effect ? kEffects[unit.effect].which : CobotCase::nominal;
  const CobotDrive drive = drive_cobot(which, kCobotDims, kCobotDrive_s, unit.seed);
  const std::vector<double> r = cobot_innovations(drive, scatter);
  const BaselineData data{drive.size(),   kCobotDims, kCobotChannels,
                          drive.u.data(), r.data(),   {{1, 2}}};
  nlohmann::json out = run_baselines(data, drive.anomalous);
  BaselineResult ours;
  ours.score = watch_cobot(drive, scatter, unit.seed);
  ours.inside = explain_cobot(drive, scatter, unit.seed).inside;
  out.push_back(outcome_of(ours, drive.anomalous));
  return out;
}

std::size_t detectors() { return baselines().size() + 1; }
std::string detector_name(std::size_t d) {
  return d < baselines().size() ? baselines()[d].name : "ours";
}

double f1_of(const nlohmann::json &outcome, double threshold) {
  if (outcome.contains("f1"))
    return outcome.at("f1");
  double hit = 0.0, found = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const nlohmann::json &score : outcome.at("scores").at(k)) {
      const double is_found = score.get<double>() > threshold ? 1.0 : 0.0;
      found += is_found;
      hit += k == 0 ? is_found : 0.0;
    }
  }
  const double real = outcome.at("anomalous");
  return 2.0 * hit / std::max(1.0, found + real);
}

// One detector on one effect.
struct Cell {
  std::vector<double> found, points, f1;
  double rate() const { return bootstrap_mean(found).value; }
};

Cell cell_of(const Table61 &e, const Campaign &campaign, std::size_t effect, std::size_t detector) {
  std::vector<double> maxima;
  for (std::size_t i = 0; i < e.calibration; ++i) {
    const nlohmann::json &records =
        campaign.units.at(domain_of(effect) * e.calibration + i).at(detector).at("records");
    maxima.push_back(records.empty() ? 0.0 : records.back().at(0).get<double>());
  }
  const double threshold = run_level_threshold(maxima, kFalseAlarms);
  Cell out;
  for (std::size_t i = 0; i < e.runs; ++i) {
    const nlohmann::json &outcome =
        campaign.units.at(kDomains * e.calibration + effect * e.runs + i).at(detector);
    const PointsToAlarm alarm = points_to_alarm(outcome.at("records"), threshold);
    out.found.push_back(alarm.found ? 1.0 : 0.0);
    out.points.push_back(alarm.found ? alarm.points : outcome.at("anomalous").get<double>());
    out.f1.push_back(alarm.found ? f1_of(outcome, threshold) : 0.0);
  }
  return out;
}

void plot(const std::vector<std::vector<Cell>> &cells, const std::string &path) {
  std::string data, plots;
  for (std::size_t d = 0; d < detectors(); ++d) {
    data += fmt::format("$d{} << EOD\n", d);
    for (std::size_t k = 0; k < kEffectCount; ++k) {
      const Bootstrapped f1 = bootstrap_mean(cells[k][d].f1);
      data +=
          fmt::format("\"{}\" {:.6g} {:.6g} {:.6g}\n", kEffects[k].name, f1.value, f1.low, f1.high);
    }
    data += "EOD\n";
    plots += fmt::format("{}$d{} using 2:3:4:xtic(1) title '{}'", d == 0 ? "" : ", ", d,
                         detector_name(d));
  }
  write_gnuplot(
      [&](const std::string &to, bool svg) {
        return fmt::format("set terminal {} size 1080,400 {}\nset output {}\nset style data "
                           "histograms\nset style histogram errorbars gap 2 lw 1\nset errorbars "
                           "linecolor rgb '#333333'\nset xrange [-0.6:5.6]\nset style fill "
                           "solid 0.7 noborder\nset tics nomirror out\nset grid y lc rgb "
                           "'#dddddd'\nset yrange [0:1.05]\nset ylabel 'F1'\nset key outside "
                           "right\n{}plot {}\nunset output\n",
                           svg ? "svg" : "pngcairo",
                           svg ? "dynamic font 'sans,13' background rgb 'white'" : "font 'sans,10'",
                           to, data, plots);
      },
      path);
}

} // namespace

Campaign run_table6_1(const Table61 &e, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {{"runs", e.runs}, {"calibration", e.calibration}, {"seed", e.seed}};
  campaign.total = units_of(e);
  const CobotScatter scatter(nominal_drives(e.seed));
  compute_units(&campaign, shard, kKind, [&](std::uint64_t number) {
    const Unit unit = unit_of(e, number);
    return kEffects[unit.effect].golf_dims > 0 ? golf_json(unit) : cobot_json(unit, scatter);
  });
  return campaign;
}

void print_table6_1(const Campaign &campaign, const std::string &path) {
  require_whole(campaign, kKind);
  Table61 e;
  e.runs = campaign.config.at("runs");
  e.calibration = campaign.config.at("calibration");
  e.seed = campaign.config.at("seed");
  std::printf(
      "table 6.1: seeds %llu-%llu, %zu nominal runs a domain for the thresholds, %zu runs an "
      "effect\n",
      static_cast<unsigned long long>(e.seed),
      static_cast<unsigned long long>(e.seed + kCobotNominal + e.calibration + e.runs - 1),
      e.calibration, e.runs);
  Table table({{"effect", ""},
               {"detector", ""},
               {"alarm", "share of runs"},
               {"points to alarm", "mean, 95 %"},
               {"F1", "95 %"}});
  std::vector<std::vector<Cell>> cells(kEffectCount);
  for (std::size_t k = 0; k < kEffectCount; ++k) {
    for (std::size_t d = 0; d < detectors(); ++d) {
      cells[k].push_back(cell_of(e, campaign, k, d));
      const Cell &c = cells[k].back();
      table.add({kEffects[k].name, detector_name(d), fmt::format("{:.2f}", c.rate()),
                 interval_text(bootstrap_mean(c.points), 1),
                 interval_text(bootstrap_mean(c.f1), 3)});
    }
  }
  table.print();
  std::printf(
      "points: anomalous ones until the alarm, all of a run without one; 0: it came before\n");
  if (!path.empty())
    plot(cells, path);
}

} // namespace rim
