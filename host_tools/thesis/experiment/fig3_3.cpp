// SPDX-License-Identifier: MIT
#include "thesis/experiment/fig3_3.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <fmt/format.h>

#include "batch/faro.h"
#include "batch/stats.h"
#include "search/cem.h"
#include "thesis/experiment/plan_figure.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/table.hpp"
#include "world/golf_params.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "fig3.3";
constexpr double kThreshold = 41.6; // 3.5.1: twice the highest nominal ln anom of the thesis
constexpr double kEnough = 60.0;
constexpr std::size_t kAbnormal = 60, kMostShots = 4000;
// The search runs after every shot of the first hundred, then ever more rarely.
constexpr std::size_t kEvery = 100;

struct Shots {
  std::vector<double> u; // two a shot, of the field
  std::vector<double> dz;
  std::vector<bool> abnormal;
  double var = 0.16;
};

double ln_anom_of(const rim_ellipsoid *e, void *context) {
  const auto &shots = *static_cast<const Shots *>(context);
  rim_stats stats{};
  double n = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < shots.dz.size(); ++i) {
    if (rimi_ellipsoid_contains(e, &shots.u[2 * i])) {
      n += 1.0;
      sum += shots.dz[i];
    }
  }
  stats.n = n;
  stats.s = sum / shots.var;
  stats.w = n / shots.var;
  return rimi_stats_ln_anom(&stats);
}

void score(const Shots &shots, const rim_faro &faro, FaroTrace &trace) {
  double hit = 0.0, inside = 0.0, abnormal = 0.0;
  for (std::size_t i = 0; i < shots.dz.size(); ++i) {
    const bool in = rimi_ellipsoid_contains(&faro.candidate[0], &shots.u[2 * i]);
    inside += in ? 1.0 : 0.0;
    abnormal += shots.abnormal[i] ? 1.0 : 0.0;
    hit += in && shots.abnormal[i] ? 1.0 : 0.0;
  }
  trace.ln_anom.push_back(faro.value[0]);
  trace.precision.push_back(inside > 0.0 ? hit / inside : 0.0);
  trace.recall.push_back(abnormal > 0.0 ? hit / abnormal : 0.0);
}

FaroTrace run_faro(Golf &golf, const GolfParams &params, std::uint64_t seed, std::size_t shots_max,
                   std::size_t abnormal, double enough) {
  rim_faro_config config{};
  config.dims = 2;
  config.seed = seed;
  config.cem.iterations = 5; // it goes on at the next shot
  rim_faro faro;
  if (rimi_faro_init(&faro, &config) != RIM_OK)
    throw std::logic_error("fig3.3: FARO refused its configuration");
  Shots shots;
  shots.var = params.success * (1.0 - params.success);
  FaroTrace trace;
  for (std::size_t n = 0; n < shots_max; ++n) {
    const GolfShot shot = golf.next();
    shots.u.push_back(shot.x[0] / params.length_m);
    shots.u.push_back(shot.x[1] / params.width_m);
    shots.dz.push_back(shot.z - params.success);
    shots.abnormal.push_back(shot.anomalous);
    bool found = false;
    const bool searches = n % (1 + n / kEvery) == 0;
    if (searches &&
        rimi_faro_step(&faro, &shots.u[2 * n], ln_anom_of, &shots, enough, &found) != RIM_OK)
      throw std::logic_error("fig3.3: FARO refused a shot");
    if (searches)
      trace.highest = std::max(trace.highest, faro.value[0]);
    if (shot.anomalous)
      score(shots, faro, trace);
    if (trace.ln_anom.size() >= abnormal && !trace.ln_anom.empty() &&
        trace.ln_anom.back() >= enough)
      break;
  }
  return trace;
}

GolfParams golf_params(double q) {
  GolfParams params = world::read_golf_params(data_path("golf.toml"));
  params.success_behind = q;
  return params;
}

Fig33 experiment_of(const Campaign &campaign) {
  require_whole(campaign, kKind);
  Fig33 e;
  e.runs = campaign.config.at("runs");
  e.nominal = campaign.config.at("nominal");
  e.shots = campaign.config.at("shots");
  e.seed = campaign.config.at("seed");
  e.q = campaign.config.at("q").get<std::vector<double>>();
  return e;
}

std::vector<FaroTrace> traces_of(const Campaign &campaign, const Fig33 &e, std::size_t q) {
  std::vector<FaroTrace> out(e.runs);
  for (std::size_t i = 0; i < e.runs; ++i) {
    const nlohmann::json &unit = campaign.units.at(q * e.runs + i);
    out[i].ln_anom = unit.at("ln_anom").get<std::vector<double>>();
    out[i].precision = unit.at("precision").get<std::vector<double>>();
    out[i].recall = unit.at("recall").get<std::vector<double>>();
  }
  return out;
}

double highest_nominal(const Campaign &campaign, const Fig33 &e) {
  double highest = 0.0;
  for (std::size_t i = 0; i < e.nominal; ++i)
    highest =
        std::max(highest, campaign.units.at(e.q.size() * e.runs + i).at("highest").get<double>());
  return highest;
}

// Where a trace reaches the threshold; its length when never.
std::size_t reaches(const FaroTrace &trace, double threshold) {
  const auto at = std::find_if(trace.ln_anom.begin(), trace.ln_anom.end(),
                               [&](double x) { return x >= threshold; });
  return static_cast<std::size_t>(at - trace.ln_anom.begin());
}

using Values = std::vector<double> FaroTrace::*;

std::vector<double> at_shot(const std::vector<FaroTrace> &traces, std::size_t k, Values what) {
  std::vector<double> out;
  for (const FaroTrace &trace : traces) {
    if (k < (trace.*what).size())
      out.push_back((trace.*what)[k]);
  }
  return out;
}

void print_a(const std::vector<FaroTrace> &traces) {
  Table table({{"abnormal shots", ""},
               {"precision", "95 %"},
               {"recall", "95 %"},
               {"ln anom", "95 %"},
               {"thesis", "precision and recall"}});
  for (const std::size_t k : {5, 10, 20, 30, 40, 50, 60}) {
    if (at_shot(traces, k - 1, &FaroTrace::ln_anom).size() != traces.size())
      continue;
    const auto text = [&](Values what, int digits) {
      return interval_text(bootstrap_mean(at_shot(traces, k - 1, what)), digits);
    };
    table.add({cell(k), text(&FaroTrace::precision, 2), text(&FaroTrace::recall, 2),
               text(&FaroTrace::ln_anom, 1), k == 10 ? "about .8" : "-"});
  }
  table.print();
}

// Shots until the threshold; precision and recall there. Runs that never reach it are counted.
void add_row(Table &table, double q, const std::vector<FaroTrace> &traces, double threshold) {
  std::vector<double> shots, precision, recall;
  for (const FaroTrace &trace : traces) {
    const std::size_t at = reaches(trace, threshold);
    if (at == trace.ln_anom.size())
      continue;
    shots.push_back(static_cast<double>(at + 1));
    precision.push_back(trace.precision[at]);
    recall.push_back(trace.recall[at]);
  }
  const std::string none = "-";
  const auto text = [&](const std::vector<double> &values, int digits) {
    return values.empty() ? none : interval_text(bootstrap_mean(values), digits);
  };
  table.add({fmt::format("{:.1f}", q), fmt::format("{:.1f}", threshold), text(shots, 0),
             text(precision, 2), text(recall, 2), cell(traces.size() - shots.size())});
}

PlanPanel panel_a(const std::vector<FaroTrace> &traces) {
  std::vector<std::vector<double>> precision, recall;
  std::size_t shortest = kAbnormal;
  for (const FaroTrace &trace : traces)
    shortest = std::min(shortest, trace.recall.size());
  for (const FaroTrace &trace : traces) {
    const auto end = static_cast<std::ptrdiff_t>(shortest);
    precision.emplace_back(trace.precision.begin(), trace.precision.begin() + end);
    recall.emplace_back(trace.recall.begin(), trace.recall.begin() + end);
  }
  return {"fig. 3.3a: p = .8, q = .2",
          "abnormal shots",
          "share",
          {curve_of("precision", precision, 1), curve_of("recall", recall, 1)}};
}

PlanPanel panel_anom(const std::vector<FaroTrace> &traces, double highest) {
  std::vector<std::vector<double>> ln_anom;
  std::size_t shortest = kAbnormal;
  for (const FaroTrace &trace : traces)
    shortest = std::min(shortest, trace.ln_anom.size());
  for (const FaroTrace &trace : traces)
    ln_anom.emplace_back(trace.ln_anom.begin(),
                         trace.ln_anom.begin() + static_cast<std::ptrdiff_t>(shortest));
  PlanCurve line;
  line.name = "highest of nominal runs";
  line.mean.assign(shortest, highest);
  line.half.assign(shortest, 0.0);
  return {
      "fig. 3.3a: ln anom", "abnormal shots", "ln anom", {curve_of("ln anom", ln_anom, 1), line}};
}

} // namespace

FaroTrace run_faro_golf(double q, std::size_t abnormal, double enough, std::uint64_t seed) {
  const GolfParams params = golf_params(q);
  GolfOptions options;
  options.variant = GolfVariant::binary;
  Golf golf(params, options, seed);
  return run_faro(golf, params, seed, kMostShots, abnormal, enough);
}

FaroTrace run_faro_nominal(std::size_t shots, std::uint64_t seed) {
  const GolfParams params = golf_params(0.8);
  GolfOptions options;
  options.variant = GolfVariant::binary;
  options.bump = false;
  Golf golf(params, options, seed);
  return run_faro(golf, params, seed, shots, shots, kEnough);
}

Campaign run_fig3_3(const Fig33 &e, const Shard &shard) {
  golf_params(0.5); // a bad file is told before the campaign begins
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {
      {"runs", e.runs}, {"nominal", e.nominal}, {"shots", e.shots}, {"seed", e.seed}, {"q", e.q}};
  campaign.total = e.q.size() * e.runs + e.nominal;
  compute_units(&campaign, shard, kKind, [&](std::uint64_t unit) {
    const std::uint64_t seed = e.seed + unit;
    if (unit >= e.q.size() * e.runs)
      return nlohmann::json{{"highest", run_faro_nominal(e.shots, seed).highest}};
    const double q = e.q[unit / e.runs];
    const FaroTrace trace = run_faro_golf(q, unit < e.runs ? kAbnormal : 1, kEnough, seed);
    return nlohmann::json{
        {"ln_anom", trace.ln_anom}, {"precision", trace.precision}, {"recall", trace.recall}};
  });
  return campaign;
}

void print_fig3_3(const Campaign &campaign, const std::string &plot) {
  const Fig33 e = experiment_of(campaign);
  const double highest = highest_nominal(campaign, e);
  std::printf("fig. 3.3: %zu runs a value of q, %zu without a bump, seeds %llu-%llu; p = .8\n"
              "highest ln anom of nominal runs of %zu shots: %.1f (thesis 20.8)\n\n"
              "fig. 3.3a, q = %.1f\n",
              e.runs, e.nominal, static_cast<unsigned long long>(e.seed),
              static_cast<unsigned long long>(e.seed + campaign.total - 1), e.shots, highest,
              e.q.front());
  const std::vector<FaroTrace> first = traces_of(campaign, e, 0);
  print_a(first);
  std::printf("\nfig. 3.3b: abnormal shots until ln anom reaches the thesis's threshold %.1f, and "
              "twice our highest\n",
              kThreshold);
  Table table({{"q", ""},
               {"threshold", "ln anom"},
               {"abnormal shots", "95 %"},
               {"precision", "95 %"},
               {"recall", "95 %"},
               {"never", "runs"}});
  for (const double threshold : {kThreshold, 2.0 * highest}) {
    for (std::size_t k = 0; k < e.q.size(); ++k)
      add_row(table, e.q[k], traces_of(campaign, e, k), threshold);
  }
  table.print();
  std::printf("thesis: the number grows as if exponentially as q nears p, precision and recall "
              "stay about constant\n");
  if (!plot.empty())
    plot_panels({panel_a(first), panel_anom(first, highest)}, plot);
}

} // namespace rim
