// SPDX-License-Identifier: MIT
#include "thesis/experiment/fig4_5.hpp"

#include <chrono>
#include <cstdio>
#include <fmt/format.h>

#include "thesis/experiment/golf_points.hpp"
#include "thesis/experiment/search_curve.hpp"
#include "util/error.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "fig4.5";
constexpr std::size_t kTimed = 1; // runs, of each number of dimensions

std::string seconds_of(const Fig45 &e, std::size_t dims, std::size_t method) {
  double seconds = 0.0;
  for (std::size_t i = 0; i < kTimed; ++i) {
    const GolfPoints shots = golf_points(dims, e.seed + i);
    const auto start = std::chrono::steady_clock::now();
    (void)search_curve(method, shots.data(), shots.truth, e.seed + i);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  return fmt::format("{:.3f}", seconds / kTimed);
}

} // namespace

Campaign run_fig4_5(const Fig45 &experiment, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  campaign.config = {
      {"dims", experiment.dims}, {"runs", experiment.runs}, {"seed", experiment.seed}};
  campaign.total = experiment.dims.size() * experiment.runs;
  compute_units(&campaign, shard, kKind, [&](std::uint64_t unit) {
    const std::uint64_t seed = experiment.seed + unit % experiment.runs;
    const GolfPoints shots = golf_points(experiment.dims[unit / experiment.runs], seed);
    return search_curves(shots.data(), shots.truth, seed);
  });
  return campaign;
}

void print_fig4_5(const Campaign &campaign, const std::string &path) {
  require_whole(campaign, kKind);
  Fig45 e;
  e.dims = campaign.config.at("dims").get<std::vector<std::size_t>>();
  e.runs = campaign.config.at("runs");
  e.seed = campaign.config.at("seed");
  std::printf(
      "fig. 4.5: golf, seeds %llu-%llu for each number of dimensions\n"
      "thesis, in seconds of its own: the peak after 18 s in 2-D and 20 to 30 s in 100-D; H3 "
      "loses little in 100-D, no FS most, BFS much\n",
      static_cast<unsigned long long>(e.seed),
      static_cast<unsigned long long>(e.seed + e.runs - 1));
  std::vector<TableColumn> columns = search_columns();
  columns.push_back({"all of it", "s"});
  Table table(columns);
  std::vector<SearchPanel> panels;
  for (std::size_t k = 0; k < e.dims.size(); ++k) {
    SearchPanel panel{cell(e.dims[k]), {}, -1.0};
    for (std::size_t i = 0; i < e.runs; ++i)
      panel.runs.push_back(campaign.units.at(k * e.runs + i));
    std::vector<std::string> seconds;
    for (std::size_t method = 0; method < kSearchMethods; ++method)
      seconds.push_back(seconds_of(e, e.dims[k], method));
    add_search_rows(table, panel, seconds);
    panels.push_back(panel);
  }
  table.print();
  if (!path.empty())
    plot_search(panels, path);
}

} // namespace rim
