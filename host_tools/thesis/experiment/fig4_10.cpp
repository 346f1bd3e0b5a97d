// SPDX-License-Identifier: MIT
#include "thesis/experiment/fig4_10.hpp"

#include <cstdio>
#include <fmt/format.h>

#include "thesis/experiment/cobot_watch.hpp"
#include "thesis/experiment/precision_recall.hpp"
#include "thesis/experiment/search_curve.hpp"
#include "util/error.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "fig4.10";
constexpr std::size_t kOutcomes = 3;
constexpr double kQuarters[] = {0.25, 0.5, 0.75, 1.0};

// The drive until then.
CobotDrive first_part(const CobotDrive &drive, double share) {
  CobotDrive out = drive;
  const auto n = static_cast<std::size_t>(share * static_cast<double>(drive.size()));
  out.u.resize(n * drive.dims);
  out.slip.resize(n);
  out.predicted.resize(n);
  out.is_ramp.resize(n);
  out.anomalous.resize(n);
  return out;
}

Fig410 experiment_of(const Campaign &campaign) {
  require_whole(campaign, kKind);
  Fig410 e;
  e.failure = static_cast<CobotCase>(campaign.config.at("failure").get<int>());
  e.dims = campaign.config.at("dims").get<std::vector<std::size_t>>();
  e.runs = campaign.config.at("runs");
  e.searches = campaign.config.at("searches");
  e.seed = campaign.config.at("seed");
  return e;
}

std::vector<double> f1_of(const Campaign &campaign, const Fig410 &e, std::size_t k,
                          std::size_t quarter) {
  std::vector<double> out;
  for (std::size_t i = 0; i < e.runs; ++i)
    out.push_back(campaign.units.at(k * e.runs + i).at("f1").at(quarter));
  return out;
}

void print_ours(const Campaign &campaign, const Fig410 &e) {
  Table table({{"dims", ""},
               {"F1 at 1/4", "of the drive"},
               {"at 1/2", ""},
               {"at 3/4", ""},
               {"at the end", "95 %"},
               {"less than in the fewest", "95 %"}});
  const std::vector<double> fewest = f1_of(campaign, e, 0, 3);
  for (std::size_t k = 0; k < e.dims.size(); ++k) {
    std::vector<double> loss = f1_of(campaign, e, k, 3);
    for (std::size_t i = 0; i < loss.size(); ++i)
      loss[i] = fewest[i] - loss[i];
    std::vector<std::string> row = {cell(e.dims[k])};
    for (std::size_t q = 0; q < 3; ++q)
      row.push_back(fmt::format("{:.3f}", bootstrap_mean(f1_of(campaign, e, k, q)).value));
    row.push_back(interval_text(bootstrap_mean(f1_of(campaign, e, k, 3)), 3));
    row.push_back(k == 0 ? "-" : interval_text(bootstrap_mean(loss), 3));
    table.add(row);
  }
  table.print();
}

} // namespace

Campaign run_fig4_10(const Fig410 &e, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {{"failure", static_cast<int>(e.failure)},
                     {"dims", e.dims},
                     {"runs", e.runs},
                     {"searches", e.searches},
                     {"seed", e.seed}};
  campaign.total = e.dims.size() * e.runs;
  const std::vector<CobotDrive> nominal = nominal_drives(e.seed);
  const CobotScatter scatter(nominal);
  const auto sd = thesis_deviations(nominal);
  compute_units(&campaign, shard, kKind, [&](std::uint64_t unit) {
    const std::uint64_t seed = e.seed + kCobotNominal + unit % e.runs;
    const CobotDrive drive = drive_cobot(e.failure, e.dims[unit / e.runs], kCobotDrive_s, seed);
    nlohmann::json out = {{"f1", nlohmann::json::array()}};
    for (const double share : kQuarters) {
      const CobotDrive part = first_part(drive, share);
      const CobotRegion region = explain_cobot(part, scatter, seed);
      out["f1"].push_back(compare_points(region.inside, part.anomalous).f1);
    }
    if (e.searches) {
      const std::vector<double> r = thesis_residuals(drive, sd);
      const rim_batch_data data = {static_cast<std::uint32_t>(drive.size()),
                                   static_cast<std::uint16_t>(drive.dims), kOutcomes,
                                   drive.u.data(), r.data()};
      out["searches"] = search_curves(data, drive.anomalous, seed);
    }
    return out;
  });
  return campaign;
}

void print_fig4_10(const Campaign &campaign, const std::string &path) {
  const Fig410 e = experiment_of(campaign);
  const bool is_corridor = e.failure == CobotCase::corridor;
  std::printf("fig. %s: %s failure, drives of %g s, seeds %llu-%llu\n",
              is_corridor ? "4.10" : "4.11", cobot_case_name(e.failure), kCobotDrive_s,
              static_cast<unsigned long long>(e.seed),
              static_cast<unsigned long long>(e.seed + kCobotNominal + e.runs - 1));
  std::printf("thesis: FS-RIM holds its F1 as the dimensions grow, no FS loses it; BFS %s\n",
              is_corridor ? "slightly worse" : "as good");
  print_ours(campaign, e);
  if (!e.searches) {
    if (!path.empty())
      throw UsageError("--plot draws the searches, which --no-searches leaves out");
    return;
  }
  std::printf("the thesis's searches over its three velocities, against their work:\n");
  Table table(search_columns());
  std::vector<SearchPanel> panels;
  for (std::size_t k = 0; k < e.dims.size(); ++k) {
    SearchPanel panel{cell(e.dims[k]), {}, -1.0};
    for (std::size_t i = 0; i < e.runs; ++i)
      panel.runs.push_back(campaign.units.at(k * e.runs + i).at("searches"));
    add_search_rows(table, panel, {});
    panel.reference = bootstrap_mean(f1_of(campaign, e, k, 3)).value;
    panels.push_back(panel);
  }
  table.print();
  if (!path.empty())
    plot_search(panels, path);
}

} // namespace rim
