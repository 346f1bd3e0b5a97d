// SPDX-License-Identifier: MIT
#include "thesis/experiment/search_curve.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>

#include "thesis/experiment/precision_recall.hpp"
#include "replay/plot.hpp"
#include "base/rng.h"

namespace rim {
namespace {

constexpr rim_heuristic kHeuristics[] = {RIM_HEURISTIC_H3, RIM_HEURISTIC_H2, RIM_HEURISTIC_H1,
                                         RIM_HEURISTIC_BREADTH, RIM_HEURISTIC_NONE};
const char *const kNames[] = {"FS H3", "FS H2", "FS H1", "BFS", "No FS"};
const char *const kColours[] = {"#1f5fa8", "#2e8b57", "#e08214", "#777777", "#b22222"};
constexpr std::size_t kNone = 4;
constexpr std::uint8_t kBins = 16;
constexpr std::size_t kStarts = 3;          // of a search: two balls and the heuristic's
constexpr std::size_t kClimb = 24 * 10 + 1; // evaluations of one start, the defaults of rim/cem.h
constexpr double kMostEvaluations = 6000.0; // of No FS: each looks at every feature
constexpr std::size_t kSamples = 24, kElites = 5, kIterations = 10;

// Intervals along one feature that the search has weighed, each a pass over the points.
double intervals_of(rim_heuristic heuristic, const rim_batch_result &result, double features) {
  const double pairs = static_cast<double>(result.evaluations / (kStarts * kClimb));
  const double others = static_cast<double>(result.nodes) - 1.0 - pairs;
  const bool has_edges = heuristic == RIM_HEURISTIC_H3 || heuristic == RIM_HEURISTIC_H2;
  return features + pairs + (has_edges ? others * features : 0.0);
}

SearchPoint run_batch(rim_heuristic heuristic, std::uint16_t nodes, const rim_batch_data &data,
                      const std::vector<bool> &truth, std::uint64_t seed) {
  rim_batch_config config{};
  config.heuristic = heuristic;
  config.nodes = nodes;
  config.bins = kBins;
  config.seed = seed;
  std::vector<std::uint64_t> work(RIM_BATCH_SIZE(data.n, data.features, nodes) / 8 + 1);
  rim_batch_result result{};
  if (rimi_select_batch(&config, &data, work.data(), 8 * work.size(), &result) != RIM_OK)
    throw std::logic_error("search: the library refused its configuration");
  std::vector<bool> inside;
  for (std::uint32_t i = 0; i < data.n; ++i) {
    double x[RIM_CEM_MAX_DIMS];
    for (std::uint8_t k = 0; k < result.dims; ++k)
      x[k] = data.u[static_cast<std::size_t>(i) * data.features + result.feature[k]];
    inside.push_back(result.dims == 0 || rimi_ellipsoid_contains(&result.ellipsoid, x));
  }
  return {static_cast<double>(result.evaluations) +
              intervals_of(heuristic, result, static_cast<double>(data.features)),
          compare_points(inside, truth).f1};
}

// Cross-entropy over ellipsoids with axes along all features: centres, logarithms of half axes.
class FullSearch {
public:
  FullSearch(const rim_batch_data &data, std::uint64_t seed) : data_(data) {
    rimi_rng_seed(&rng_, seed, 4);
  }

  SearchPoint run(double evaluations, const std::vector<bool> &truth);

private:
  using Parameters = std::vector<double>; // [2 features]

  bool contains(const Parameters &p, std::uint32_t i) const;
  double value(const Parameters &p);
  void climb(double evaluations);
  const rim_batch_data &data_;
  rim_rng rng_{};
  double used_ = 0.0, best_value_ = 0.0;
  Parameters best_;
};

SearchPoint FullSearch::run(double evaluations, const std::vector<bool> &truth) {
  evaluations = std::min(evaluations, kMostEvaluations);
  while (used_ < evaluations)
    climb(evaluations);
  std::vector<bool> inside;
  for (std::uint32_t i = 0; i < data_.n; ++i)
    inside.push_back(!best_.empty() && contains(best_, i));
  return {used_, compare_points(inside, truth).f1};
}

bool FullSearch::contains(const Parameters &p, std::uint32_t i) const {
  const std::size_t features = data_.features;
  double square = 0.0;
  for (std::size_t f = 0; f < features; ++f) {
    const double off = (data_.u[i * features + f] - p[f]) * std::exp(-p[features + f]);
    square += off * off;
    if (square >= 1.0)
      return false;
  }
  return true;
}

double FullSearch::value(const Parameters &p) {
  used_ += 1.0;
  const std::size_t outcomes = data_.outcomes;
  std::vector<double> sum(outcomes, 0.0);
  double n = 0.0, square = 0.0;
  for (std::uint32_t i = 0; i < data_.n; ++i) {
    if (!contains(p, i))
      continue;
    n += 1.0;
    for (std::size_t o = 0; o < outcomes; ++o)
      sum[o] += data_.r[i * outcomes + o];
  }
  for (const double s : sum)
    square += s * s;
  const double ln_anom = n > 0.0 ? square / (2.0 * n) : 0.0;
  if (best_.empty() || ln_anom > best_value_) {
    best_ = p;
    best_value_ = ln_anom;
  }
  return ln_anom;
}

// From a ball about a point that holds about half of the data, to the best few of each draw.
void FullSearch::climb(double evaluations) {
  const std::size_t d = data_.features;
  const std::uint32_t at = rimi_rng_below(&rng_, data_.n);
  Parameters mean(2 * d), spread(2 * d, 0.3);
  for (std::size_t f = 0; f < d; ++f) {
    mean[f] = data_.u[at * d + f];
    mean[d + f] = std::log(0.45 * std::sqrt(static_cast<double>(d)));
  }
  for (std::size_t t = 0; t < kIterations && used_ < evaluations; ++t) {
    std::vector<std::pair<double, Parameters>> drawn;
    for (std::size_t s = 0; s < kSamples; ++s) {
      Parameters p = mean;
      for (std::size_t k = 0; k < p.size(); ++k)
        p[k] += spread[k] * rimi_rng_normal(&rng_);
      const double v = value(p);
      drawn.push_back({v, std::move(p)});
    }
    std::stable_sort(drawn.begin(), drawn.end(),
                     [](const auto &a, const auto &b) { return a.first > b.first; });
    for (std::size_t k = 0; k < mean.size(); ++k) {
      double sum = 0.0, square = 0.0;
      for (std::size_t e = 0; e < kElites; ++e) {
        sum += drawn[e].second[k];
        square += drawn[e].second[k] * drawn[e].second[k];
      }
      mean[k] = sum / kElites;
      spread[k] = std::sqrt(std::max(1e-6, square / kElites - mean[k] * mean[k]));
    }
  }
}

} // namespace

const char *search_method_name(std::size_t method) { return kNames[method]; }

const std::vector<std::uint16_t> &search_checkpoints() {
  static const std::vector<std::uint16_t> nodes = {2, 4, 8, 16, 32};
  return nodes;
}

std::vector<SearchPoint> search_curve(std::size_t method, const rim_batch_data &data,
                                      const std::vector<bool> &truth, std::uint64_t seed) {
  std::vector<SearchPoint> out;
  if (method != kNone) {
    for (const std::uint16_t nodes : search_checkpoints())
      out.push_back(run_batch(kHeuristics[method], nodes, data, truth, seed));
    return out;
  }
  FullSearch search(data, seed);
  for (const SearchPoint &point : search_curve(0, data, truth, seed))
    out.push_back(search.run(point.evaluations, truth));
  return out;
}

nlohmann::json search_curves(const rim_batch_data &data, const std::vector<bool> &truth,
                             std::uint64_t seed) {
  nlohmann::json out = nlohmann::json::array();
  FullSearch everything(data, seed);
  nlohmann::json last = nlohmann::json::array();
  for (std::size_t method = 0; method < kNone; ++method) {
    nlohmann::json curve = nlohmann::json::array();
    for (const SearchPoint &point : search_curve(method, data, truth, seed)) {
      curve.push_back({point.evaluations, point.f1});
      if (method == 0) {
        const SearchPoint same = everything.run(point.evaluations, truth);
        last.push_back({same.evaluations, same.f1});
      }
    }
    out.push_back(curve);
  }
  out.push_back(last);
  return out;
}

std::vector<TableColumn> search_columns() {
  std::vector<TableColumn> columns = {{"dims", ""}, {"search", ""}};
  for (const std::uint16_t nodes : search_checkpoints())
    columns.push_back({fmt::format("F1 after {}", nodes), "feature sets"});
  columns.push_back({"at the end", "95 %"});
  columns.push_back({"evaluations", "thousand"});
  return columns;
}

namespace {

std::vector<double> over_runs(const SearchPanel &panel, std::size_t method, std::size_t checkpoint,
                              std::size_t what) {
  std::vector<double> out;
  for (const nlohmann::json &run : panel.runs)
    out.push_back(run.at(method).at(checkpoint).at(what));
  return out;
}

} // namespace

void add_search_rows(Table &table, const SearchPanel &panel, const std::vector<std::string> &last) {
  const std::size_t checkpoints = search_checkpoints().size();
  for (std::size_t method = 0; method < kSearchMethods; ++method) {
    std::vector<std::string> row = {panel.title, search_method_name(method)};
    for (std::size_t k = 0; k < checkpoints; ++k)
      row.push_back(fmt::format("{:.3f}", bootstrap_mean(over_runs(panel, method, k, 1)).value));
    row.push_back(interval_text(bootstrap_mean(over_runs(panel, method, checkpoints - 1, 1)), 3));
    const double evaluations = bootstrap_mean(over_runs(panel, method, checkpoints - 1, 0)).value;
    row.push_back(fmt::format("{:.1f}", evaluations / 1000.0));
    if (!last.empty())
      row.push_back(last.at(method));
    table.add(row);
  }
}

void plot_search(const std::vector<SearchPanel> &panels, const std::string &path) {
  std::string data, plots;
  for (std::size_t p = 0; p < panels.size(); ++p) {
    plots += fmt::format("set title '{} dimensions'\nplot ", panels[p].title);
    for (std::size_t method = 0; method < kSearchMethods; ++method) {
      data += fmt::format("$d{}_{} << EOD\n", p, method);
      for (std::size_t k = 0; k < search_checkpoints().size(); ++k) {
        const MeanInterval f1 = bootstrap_mean(over_runs(panels[p], method, k, 1));
        data += fmt::format("{:.6g} {:.6g} {:.6g} {:.6g}\n",
                            bootstrap_mean(over_runs(panels[p], method, k, 0)).value, f1.value,
                            f1.low, f1.high);
      }
      data += "EOD\n";
      plots += fmt::format("{0}$d{1}_{2} using 1:3:4 with filledcurves fs transparent solid 0.15 "
                           "noborder lc rgb '{3}' notitle, $d{1}_{2} using 1:2 with linespoints "
                           "pt 7 ps 0.5 lw 2 lc rgb '{3}' title '{4}'",
                           method == 0 ? "" : ", ", p, method, kColours[method], kNames[method]);
    }
    if (panels[p].reference >= 0.0)
      plots += fmt::format(", {:.6g} with lines lw 2 dt 2 lc rgb 'black' title 'ours'",
                           panels[p].reference);
    plots += "\n";
  }
  write_gnuplot(
      [&](const std::string &to, bool svg) {
        return fmt::format(
            "set terminal {} size {},360 {}\nset output '{}'\nset tics nomirror "
            "out\nset grid y lc rgb '#dddddd'\nset key bottom right\nset yrange "
            "[0:1]\nset logscale x\nset format x '10^{{%L}}'\nset xlabel 'evaluations'\n"
            "set ylabel 'F1'\n{}set "
            "multiplot layout 1,{}\n{}unset multiplot\nunset output\n",
            svg ? "svg" : "pngcairo", 380 * panels.size(),
            svg ? "dynamic font 'sans,13' background rgb 'white'" : "font 'sans,10'", to, data,
            panels.size(), plots);
      },
      path);
}

} // namespace rim
