// SPDX-License-Identifier: MIT
#include "thesis/experiment/golf.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>

#include "base/rng.h"
#include "search/select.h"
#include "thesis/experiment/alarm_score.hpp"
#include "thesis/experiment/golf_points.hpp"
#include "thesis/experiment/precision_recall.hpp"
#include "thesis/experiment/select_engine.hpp"
#include "train/calibrate_external.hpp"
#include "util/error.hpp"
#include "util/table.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "golf";
constexpr double kFalseAlarms = 0.05;
constexpr std::size_t kTimedRuns = 10;

const char *const kSearchNames[] = {"flight", "standard", "rich"};

rim_select_config search_config(std::size_t dims, std::uint64_t seed, GolfSearch search) {
  rim_select_config config{};
  config.features = static_cast<std::uint16_t>(dims);
  config.seed = seed;
  if (search == GolfSearch::standard)
    return config;
  FlightPlan plan;
  plan.layout.external = true;
  plan.layout.feature_names.resize(dims);
  use_profile(&plan, search == GolfSearch::flight, true);
  const auto narrow = [](std::uint32_t value) { return static_cast<std::uint16_t>(value); };
  config.scans = narrow(plan.scans);
  config.edges = narrow(plan.edges);
  config.small = plan.small;
  config.moves = narrow(plan.moves);
  config.ring = narrow(plan.ring);
  config.grid = narrow(plan.grid);
  config.pairs = narrow(plan.pairs);
  return config;
}

// The best score of chance grows as the logarithm of the number of observations; never as if there
// were fewer than a dozen, or the first shot alone could alarm.
double growth(std::size_t observations) {
  return std::max(kLeastGrowth, std::log(static_cast<double>(observations)));
}

void score_points(const rim_select *engine, const GolfPoints &points, GolfRun &run) {
  rim_candidate best{};
  if (!rimi_select_best(engine, &best))
    return;
  std::vector<bool> member, in_best;
  for (std::size_t i = 0; i < points.r.size(); ++i) {
    const double *u = &points.u[i * points.dims];
    member.push_back(rimi_select_membership(engine, best.channel, u) > RIM_SELECT_MEMBERSHIP_CUT);
    in_best.push_back(rimi_unit_region_contains(&best.region, u));
  }
  run.f1 = compare_points(member, points.truth).f1;
  run.f1_best = compare_points(in_best, points.truth).f1;
  const auto [low, high] = std::minmax(points.place[0], points.place[1]);
  run.right_features =
      best.dims == 2 && best.region.unit.feature[0] == low && best.region.unit.feature[1] == high;
}

enum class Role { calibration, nominal, bump };

struct Unit {
  std::size_t dims;
  Role role;
  std::uint64_t seed;
};

std::size_t units_a_dims(const GolfExperiment &e) { return e.calibration + e.nominal + e.runs; }

Unit unit_of(const GolfExperiment &e, std::uint64_t number) {
  const std::size_t each = units_a_dims(e);
  const std::size_t index = number % each;
  Unit unit{e.dims[number / each], Role::bump, e.seed + index};
  if (index < e.calibration)
    unit.role = Role::calibration;
  else if (index < e.calibration + e.nominal)
    unit.role = Role::nominal;
  return unit;
}

nlohmann::json value_of(const Unit &unit, GolfSearch search) {
  const GolfRun run = run_golf(unit.dims, unit.seed, unit.role == Role::bump, search);
  if (unit.role != Role::bump)
    return {{"largest", run.largest_score}};
  return {{"f1", run.f1},
          {"f1_best", run.f1_best},
          {"right", run.right_features},
          {"shots", run.shots},
          {"scores", run.score_by_anomalous}};
}

GolfExperiment experiment_of(const Campaign &campaign) {
  if (campaign.kind != kKind)
    throw DataError("campaign of kind '" + campaign.kind + "', not golf");
  GolfExperiment e;
  e.dims = campaign.config.at("dims").get<std::vector<std::size_t>>();
  e.runs = campaign.config.at("runs");
  e.nominal = campaign.config.at("nominal");
  e.calibration = campaign.config.at("calibration");
  e.seed = campaign.config.at("seed");
  e.search = parse_golf_search(campaign.config.at("search"));
  if (!campaign.complete())
    throw DataError("golf: shards are missing");
  return e;
}

Bootstrapped bootstrap_over_runs(const std::vector<double> &values) {
  BootstrapOptions options;
  options.seed = 4207;
  return bootstrap_mean(values, options);
}

GolfSummary summarise_dims(const GolfExperiment &e, const Campaign &campaign, std::size_t k) {
  std::vector<double> maxima, nominal, f1, f1_best, right;
  std::vector<std::vector<double>> scores;
  const std::size_t each = units_a_dims(e);
  for (std::size_t i = 0; i < each; ++i) {
    const nlohmann::json &value = campaign.units.at(k * each + i);
    const Unit unit = unit_of(e, k * each + i);
    if (unit.role == Role::calibration)
      maxima.push_back(value.at("largest"));
    if (unit.role == Role::nominal)
      nominal.push_back(value.at("largest"));
    if (unit.role != Role::bump)
      continue;
    f1.push_back(value.at("f1"));
    f1_best.push_back(value.at("f1_best"));
    right.push_back(value.at("right").get<bool>() ? 1.0 : 0.0);
    scores.push_back(value.at("scores").get<std::vector<double>>());
  }
  GolfSummary s;
  s.dims = e.dims[k];
  s.threshold = run_level_threshold(maxima, kFalseAlarms);
  const auto alarms = std::count_if(nominal.begin(), nominal.end(),
                                    [&](double largest) { return largest > s.threshold; });
  s.false_alarms =
      nominal.empty() ? 0.0 : static_cast<double>(alarms) / static_cast<double>(nominal.size());
  std::vector<double> waited;
  for (const auto &run : scores) {
    const auto alarm =
        std::find_if(run.begin(), run.end(), [&](double x) { return x > s.threshold; });
    if (alarm == run.end())
      ++s.missed;
    waited.push_back(static_cast<double>(alarm - run.begin()));
  }
  s.f1 = bootstrap_over_runs(f1);
  s.f1_best = bootstrap_over_runs(f1_best);
  s.shots_to_alarm = bootstrap_over_runs(waited);
  s.right_features = bootstrap_over_runs(right).value;
  return s;
}

std::string interval_text(const Bootstrapped &x, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f [%.*f, %.*f]", digits, x.value, digits, x.low, digits,
                x.high);
  return text;
}

std::string number_text(double x, int digits) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, x);
  return text;
}

} // namespace

GolfSearch parse_golf_search(const std::string &name) {
  for (int i = 0; i < 3; ++i) {
    if (name == kSearchNames[i])
      return static_cast<GolfSearch>(i);
  }
  throw UsageError("--search " + name + ": expected flight, standard or rich");
}

std::size_t golf_search_bytes(std::size_t dims, GolfSearch search) {
  const rim_select_config config = search_config(dims, 0, search);
  std::size_t bytes = 0;
  rimi_select_size(&config, &bytes);
  return bytes;
}

GolfRun run_golf(std::size_t dims, std::uint64_t seed, bool effect, GolfSearch search) {
  const GolfPoints points = golf_points(dims, seed, effect);
  const SelectEngine engine(search_config(dims, seed, search));
  GolfRun run;
  run.shots = points.r.size();
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < run.shots; ++i) {
    rimi_select_observe(engine.get(), &points.u[i * dims], &points.r[i]);
    rimi_select_work(engine.get(), 1);
    if (points.truth[i])
      run.score_by_anomalous.push_back(run.largest_score);
    const auto score = static_cast<double>(rimi_select_channel_scores(engine.get())[0]);
    run.largest_score = std::max(run.largest_score, score / growth(i + 1));
  }
  run.score_by_anomalous.push_back(run.largest_score);
  run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  score_points(engine.get(), points, run);
  return run;
}

Campaign run_golf_campaign(const GolfExperiment &experiment, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {{"dims", experiment.dims},
                     {"runs", experiment.runs},
                     {"nominal", experiment.nominal},
                     {"calibration", experiment.calibration},
                     {"seed", experiment.seed},
                     {"search", kSearchNames[static_cast<int>(experiment.search)]}};
  campaign.total = experiment.dims.size() * units_a_dims(experiment);
  compute_units(&campaign, shard, "golf", [&](std::uint64_t unit) {
    return value_of(unit_of(experiment, unit), experiment.search);
  });
  return campaign;
}

std::vector<GolfSummary> summarise_golf(const Campaign &campaign) {
  const GolfExperiment e = experiment_of(campaign);
  std::vector<GolfSummary> out;
  for (std::size_t k = 0; k < e.dims.size(); ++k)
    out.push_back(summarise_dims(e, campaign, k));
  return out;
}

void print_golf(const Campaign &campaign) {
  const GolfExperiment e = experiment_of(campaign);
  const std::size_t each = units_a_dims(e);
  std::printf("golf 4.2.3: seeds %llu-%llu calibration, -%llu no bump, -%llu bump; search %s\n",
              static_cast<unsigned long long>(e.seed),
              static_cast<unsigned long long>(e.seed + e.calibration - 1),
              static_cast<unsigned long long>(e.seed + e.calibration + e.nominal - 1),
              static_cast<unsigned long long>(e.seed + each - 1),
              kSearchNames[static_cast<int>(e.search)]);
  Table table({{"dims", ""},
               {"F1", "95 %"},
               {"best ellipse", "F1"},
               {"right pair", "share"},
               {"no bump", "runs alarmed"},
               {"to alarm", "anomalous shots"},
               {"missed", "runs"},
               {"one run", "ms"},
               {"memory", "bytes"}});
  for (const GolfSummary &s : summarise_golf(campaign)) {
    double seconds = 0.0; // one core, the same runs as the table's first
    for (std::size_t i = 0; i < kTimedRuns; ++i)
      seconds += run_golf(s.dims, e.seed + each - e.runs + i, true, e.search).seconds;
    table.add({cell(s.dims), interval_text(s.f1, 3), number_text(s.f1_best.value, 3),
               number_text(s.right_features, 3), number_text(s.false_alarms, 4),
               interval_text(s.shots_to_alarm, 1), cell(s.missed),
               number_text(1e3 * seconds / kTimedRuns, 1),
               cell(golf_search_bytes(s.dims, e.search))});
  }
  table.print();
}

} // namespace rim
