#include "experiment/lander.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "bus/sentence.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"
#include "util/table.hpp"
#include "world/recording.hpp"

namespace rim::experiment {

std::size_t FaultSummary::found() const {
  return static_cast<std::size_t>(
      std::count_if(runs.begin(), runs.end(), [](const LandingResult &r) { return r.alarmed; }));
}

std::vector<world::Effect> lander_faults(const world::LanderParams &params) {
  std::vector<std::string> paths;
  for (const auto &entry : std::filesystem::directory_iterator(data_path("effects"))) {
    if (entry.path().extension() == ".toml") paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<world::Effect> faults;
  for (const std::string &path : paths) faults.push_back(world::read_effect(path, params));
  return faults;
}

Log lander_log(const world::LanderParams &params, const std::vector<world::Effect> &effects,
               std::uint64_t seed, std::uint64_t run) {
  Log log = world::record_lander(world::simulate_lander(params, effects, seed, run), 0).log;
  log.path = fmt::format("seed {} run {}", seed, run);
  return log;
}

LandingResult fly(const std::vector<std::uint8_t> &image, const Log &log,
                  const std::string &sensor) {
  Monitor monitor(image, "lander image");
  const Layout layout = layout_of_image(monitor.image());
  const std::vector<int> columns = feature_columns(log);
  std::vector<double> context(columns.size());
  LandingResult result;
  result.row = static_cast<double>(log.t_s.size());
  result.score = -1e30;
  for (std::size_t t = 0; t < log.t_s.size(); ++t) {
    for (std::size_t f = 0; f < columns.size(); ++f) {
      context[f] = log.values(static_cast<Eigen::Index>(t), columns[f]);
    }
    rim_observation row = {};
    row.t_s = log.t_s[t];
    row.context = context.data();
    rim_verdict verdict;
    (void)rim_monitor_step(monitor.get(), &row, &verdict);
    result.score = std::max(result.score, verdict.score);
    if (verdict.alarm.state != RIM_ALARM_RAISED || result.alarmed) continue;
    result.alarmed = true;
    result.row = static_cast<double>(t + 1);
    result.t_s = verdict.t_s;
    result.channel = layout.outcome_names.at(verdict.alarm.channel[0]);
    result.kind = kind_text(verdict.alarm.kind);
    result.sensor_named = result.channel == sensor;
  }
  return result;
}

namespace {

std::string sensor_of(const world::Effect &effect) {
  const std::vector<std::string> columns = world::lander_columns();
  const std::size_t sensor = effect.terms.front().sensor;
  return sensor < world::kSensors ? columns.at(world::kEngines + sensor) : std::string();
}

} // namespace

LanderCampaign run_lander_campaign(const LanderOptions &options) {
  const world::LanderParams params = world::read_lander_params(data_path("lander.toml"));
  const std::vector<world::Effect> faults = lander_faults(params);
  std::vector<Log> logs(options.training_runs);
  parallel_for(logs.size(),
               [&](std::size_t i) { logs[i] = lander_log(params, {}, options.seed, i + 1); });
  LanderCampaign campaign;
  const auto start = std::chrono::steady_clock::now();
  campaign.training = train(logs, options.train);
  campaign.seconds_training =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  logs.clear();
  const std::vector<std::uint8_t> image = make_image(campaign.training.plan);

  campaign.nominal.resize(options.nominal_runs);
  for (const world::Effect &fault : faults) {
    campaign.faults.push_back({fault.name, sensor_of(fault), {}});
    campaign.faults.back().runs.resize(options.fault_runs);
  }
  const std::size_t units = options.nominal_runs + faults.size() * options.fault_runs;
  Progress progress("replay", units);
  parallel_for(units, [&](std::size_t unit) {
    const bool nominal = unit < options.nominal_runs;
    const std::size_t k = nominal ? 0 : (unit - options.nominal_runs) / options.fault_runs;
    const std::size_t i = nominal ? unit : (unit - options.nominal_runs) % options.fault_runs;
    // Every landing is one of its own: no two faults share a run.
    const std::uint64_t run = nominal ? i + 1 : 10000 * (k + 1) + i;
    const std::vector<world::Effect> effects =
        nominal ? std::vector<world::Effect>{} : std::vector<world::Effect>{faults[k]};
    const Log log = lander_log(params, effects, options.seed + 1, run);
    const LandingResult result =
        fly(image, log, nominal ? std::string() : campaign.faults[k].sensor);
    (nominal ? campaign.nominal[i] : campaign.faults[k].runs[i]) = result;
    progress.add();
  });
  return campaign;
}

namespace {

// Wilson's 95 % interval of a share, as text in percent.
std::string share_text(std::size_t hits, std::size_t n) {
  if (n == 0) return "-";
  const double z = 1.96, total = static_cast<double>(n), p = static_cast<double>(hits) / total;
  const double centre = (p + z * z / (2 * total)) / (1 + z * z / total);
  const double half =
      z / (1 + z * z / total) * std::sqrt(p * (1 - p) / total + z * z / (4 * total * total));
  return fmt::format("{:.1f} % [{:.1f}, {:.1f}] ({} of {})", 100 * p,
                     100 * std::max(0.0, centre - half), 100 * (centre + half), hits, n);
}

double median_row(const FaultSummary &fault) {
  std::vector<double> rows;
  for (const LandingResult &r : fault.runs) {
    if (r.alarmed) rows.push_back(r.row);
  }
  if (rows.empty()) return 0.0;
  std::sort(rows.begin(), rows.end());
  return rows[rows.size() / 2];
}

} // namespace

void print_lander_campaign(const LanderCampaign &campaign, const LanderOptions &options,
                           std::FILE *to) {
  const Thresholds &t = campaign.training.plan.thresholds;
  fmt::print(to,
             "lander: {} training runs of seed {}, fresh runs of seed {}; training {:.1f} s\n"
             "alarm at score {:.2f} (rank {} of {}): promised run-level false alarms {:.1f} %\n",
             options.training_runs, options.seed, options.seed + 1, campaign.seconds_training,
             static_cast<double>(t.alarm_score), t.rank, t.maxima.size(),
             100.0 * static_cast<double>(t.promised_rate));
  std::size_t alarmed = 0;
  for (const LandingResult &r : campaign.nominal) alarmed += r.alarmed ? 1 : 0;
  fmt::print(to, "nominal runs with any alarm: {}\n", share_text(alarmed, campaign.nominal.size()));
  Table table({{"fault", ""},
               {"found", "runs"},
               {"row of alarm", "median"},
               {"score", "least / alarm"},
               {"score", "median / alarm"},
               {"named first", "mode"},
               {"kind", ""},
               {"right sensor", "detections"}});
  std::size_t always = 0, never = 0, sensor_found = 0, sensor_right = 0;
  for (const FaultSummary &fault : campaign.faults) {
    const std::size_t found = fault.found();
    always += found == fault.runs.size() ? 1 : 0;
    never += found == 0 ? 1 : 0;
    std::vector<double> scores;
    std::size_t right = 0;
    std::string first = "-", kind = "-";
    for (const LandingResult &r : fault.runs) {
      scores.push_back(r.score / static_cast<double>(t.alarm_score));
      right += r.sensor_named ? 1 : 0;
      if (r.alarmed && first == "-") {
        first = r.channel;
        kind = r.kind;
      }
    }
    if (!fault.sensor.empty()) {
      sensor_found += found;
      sensor_right += right;
    }
    std::sort(scores.begin(), scores.end());
    table.add({fault.name, fmt::format("{} of {}", found, fault.runs.size()),
               fmt::format("{:.0f}", median_row(fault)), fmt::format("{:.2f}", scores.front()),
               fmt::format("{:.2f}", scores[scores.size() / 2]), first, kind,
               fault.sensor.empty() ? "physics" : fmt::format("{} of {}", right, found)});
  }
  table.print(to);
  fmt::print(to, "found in every run: {} of {} faults; never found: {}; right sensor: {}\n", always,
             campaign.faults.size(), never, share_text(sensor_right, sensor_found));
}

} // namespace rim::experiment
