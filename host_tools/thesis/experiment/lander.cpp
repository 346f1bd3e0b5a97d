// SPDX-License-Identifier: MIT
#include "thesis/experiment/lander.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include <fmt/format.h>

#include "bus/sentence.hpp"
#include "thesis/experiment/thesis_lander.hpp"
#include "util/data_path.hpp"
#include "util/parallel_for.hpp"
#include "world/recording.hpp"

namespace rim::experiment {

std::vector<world::Effect> lander_faults(const world::LanderParams &params) {
  std::vector<std::string> paths;
  for (const auto &entry : std::filesystem::directory_iterator(data_path("effects"))) {
    if (entry.path().extension() == ".toml")
      paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<world::Effect> faults;
  for (const std::string &path : paths)
    faults.push_back(world::read_effect(path, params));
  return faults;
}

LandingResult fly(const std::vector<std::uint8_t> &image, const Log &log) {
  Monitor monitor(image, "lander image");
  const Layout layout = layout_of_image(monitor.image());
  const std::vector<int> columns = feature_columns(log);
  std::vector<double> context(columns.size());
  LandingResult result;
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
    if (verdict.alarm.state != RIM_ALARM_RAISED || result.alarmed)
      continue;
    result.alarmed = true;
    result.row = static_cast<std::uint32_t>(t + 1);
    result.t_s = verdict.t_s;
    result.channel = layout.outcome_names.at(verdict.alarm.channel[0]);
    result.kind = kind_text(verdict.alarm.kind);
  }
  return result;
}

namespace {

// Column that an effect hits; empty for one on the physics.
std::string sensor_of(const world::Effect &effect) {
  const std::size_t sensor = effect.terms.front().sensor;
  return sensor < world::kSensors ? world::lander_columns().at(world::kEngines + sensor)
                                  : std::string();
}

nlohmann::json thesis_json(const std::vector<ThesisPoint> &points) {
  nlohmann::json list = nlohmann::json::array();
  for (const ThesisPoint &p : points)
    list.push_back({p.rows, p.normalised, p.outcome});
  return list;
}

struct Trained {
  std::vector<std::uint8_t> image;
  Thresholds thresholds;
  std::unique_ptr<ThesisLander> thesis;
  double seconds = 0.0;
};

Trained train_on_nominal(const LanderOptions &options, const world::LanderParams &params) {
  std::vector<Log> logs(options.training_runs);
  parallel_for(logs.size(), [&](std::size_t i) {
    logs[i] = world::lander_log(params, {}, options.seed, i + 1);
  });
  const auto start = std::chrono::steady_clock::now();
  const Training training = train(logs, options.train);
  Trained trained;
  trained.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  trained.image = make_image(training.plan);
  trained.thresholds = training.plan.thresholds;
  if (options.thesis)
    trained.thesis = std::make_unique<ThesisLander>(logs, ThesisOptions{});
  return trained;
}

nlohmann::json result_json(const LandingResult &r, std::size_t fault) {
  return {{"fault", fault},   {"alarmed", r.alarmed}, {"row", r.row},  {"t_s", r.t_s},
          {"score", r.score}, {"channel", r.channel}, {"kind", r.kind}};
}

} // namespace

Campaign run_lander_campaign(const LanderOptions &options, const Shard &shard) {
  const world::LanderParams params = world::read_lander_params(data_path("lander.toml"));
  const std::vector<world::Effect> faults = lander_faults(params);
  const Trained trained = train_on_nominal(options, params);

  Campaign campaign;
  campaign.kind = "lander";
  campaign.total = options.nominal_runs + faults.size() * options.fault_runs;
  nlohmann::json names = nlohmann::json::array();
  for (const world::Effect &fault : faults) {
    names.push_back({{"name", fault.name}, {"sensor", sensor_of(fault)}});
  }
  const std::vector<std::string> columns = world::lander_columns();
  campaign.config = {
      {"seed", options.seed},
      {"training_runs", options.training_runs},
      {"nominal_runs", options.nominal_runs},
      {"fault_runs", options.fault_runs},
      {"thesis", options.thesis},
      {"flight", options.train.calibration.flight},
      {"faults", names},
      {"sensors", std::vector<std::string>(columns.begin() + world::kEngines, columns.end())},
      {"rank", trained.thresholds.rank},
      {"alarm_score", trained.thresholds.alarm_score},
      {"promised_rate", trained.thresholds.promised_rate},
      {"image_bytes", trained.image.size()}};
  fmt::print(stderr, "training took {:.1f} s\n", trained.seconds);

  compute_units(&campaign, shard, "replay", [&](std::uint64_t unit) {
    const bool nominal = unit < options.nominal_runs;
    const std::size_t k = nominal ? 0 : (unit - options.nominal_runs) / options.fault_runs;
    const std::size_t i = nominal ? unit : (unit - options.nominal_runs) % options.fault_runs;
    // Every landing is one of its own: no two faults share a run.
    const std::uint64_t run = nominal ? i + 1 : 10000 * (k + 1) + i;
    const Log log = world::lander_log(
        params, nominal ? std::vector<world::Effect>{} : std::vector<world::Effect>{faults[k]},
        options.seed + 1, run);
    nlohmann::json result = result_json(fly(trained.image, log), nominal ? 0 : k + 1);
    if (trained.thesis)
      result["thesis"] = thesis_json(trained.thesis->run(log));
    return result;
  });
  return campaign;
}

} // namespace rim::experiment
