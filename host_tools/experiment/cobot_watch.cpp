#include "experiment/cobot_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "rim/cem.h"
#include "rim/interval.h"
#include "rim/select.h"
#include "rim/stats.h"

namespace rim {
namespace {

constexpr std::uint32_t kUnitsAPoint = 10; // of search: one a row of the log
constexpr double kGrowthFrom = 3.5;        // ln of 33 points: fewer are judged like these
constexpr double kTrusted = 3.0;           // sd of a residual that teaches the drive's offset
constexpr double kLeastPoints = 3.0;       // in a region
constexpr std::size_t kSteps = 512;        // different values of a feature that are told apart
constexpr std::size_t kPairs = 4;          // of features that are given an ellipse
constexpr double kMember = 0.7;            // chance from which a point counts as inside
constexpr double kBoxToEllipse = 0.575;    // half axis over side: equal areas, nearly

// One channel of a finished drive.
struct Column {
  const CobotDrive &drive;
  const CobotScores &scores;
  std::size_t channel;

  double u(std::size_t i, std::size_t f) const { return drive.u[i * drive.dims + f]; }
  void add(std::size_t i, rim_stats *to) const {
    to->n += 1.0;
    to->s += scores.x[i * kCobotChannels + channel];
    to->w += scores.w[i * kCobotChannels + channel];
  }
};

// ln of the number of alternatives, as good as: which feature, and the edges of an interval.
double price(std::size_t region_dims, std::size_t dims, std::size_t n) {
  const auto k = static_cast<double>(region_dims);
  return k * (std::log(static_cast<double>(dims)) + std::log(static_cast<double>(n)));
}

struct Range {
  double low = 0.0, high = 1.0, ln_anom = 0.0;
};

// The points along one feature where `use` holds, those of one value together.
struct Bins {
  std::vector<rim_stats> stats;
  std::vector<double> first, last;          // values of u in a bin
  std::vector<std::vector<std::size_t>> of; // points in a bin
};

Bins bins_of(const Column &c, std::size_t f, const std::vector<std::size_t> &order,
             const std::vector<bool> &use) {
  Bins out;
  const std::size_t group = order.size() / kSteps + 1;
  for (const std::size_t i : order) {
    if (!use[i])
      continue;
    const double u = c.u(i, f);
    if (out.stats.empty() || (out.of.back().size() >= group && u > out.last.back())) {
      out.stats.push_back({});
      out.first.push_back(u);
      out.last.push_back(u);
      out.of.emplace_back();
    }
    out.last.back() = u;
    out.of.back().push_back(i);
    c.add(i, &out.stats.back());
  }
  return out;
}

// The exact most anomalous interval (App. A).
Range best_range(const Bins &bins) {
  Range out;
  rim_interval best{};
  if (rim_interval_find(bins.stats.data(), bins.stats.size(), kLeastPoints, &best) != RIM_OK ||
      best.bins == 0)
    return out;
  const std::size_t end = best.first + best.bins - 1;
  out.ln_anom = best.ln_anom;
  out.low = best.first > 0 ? 0.5 * (bins.last[best.first - 1] + bins.first[best.first]) : -0.01;
  out.high = end + 1 < bins.stats.size() ? 0.5 * (bins.last[end] + bins.first[end + 1]) : 1.01;
  return out;
}

// Chance of every bin to lie in the region: share of the likelihood of all intervals (flat prior)
// that the intervals with it have. Averages over edges that the data leave open.
std::vector<double> membership_of(const Bins &bins, double best_ln_anom) {
  std::vector<double> edge(bins.stats.size() + 1, 0.0);
  double total = 0.0;
  for (std::size_t a = 0; a < bins.stats.size(); ++a) {
    rim_stats in{};
    for (std::size_t b = a; b < bins.stats.size(); ++b) {
      rim_stats_merge(&in, &bins.stats[b]);
      const double weight = std::exp(rim_stats_ln_anom(&in) - best_ln_anom);
      edge[a] += weight;
      edge[b + 1] -= weight;
      total += weight;
    }
  }
  double sum = 0.0;
  std::vector<double> out;
  for (std::size_t k = 0; k < bins.stats.size(); ++k) {
    sum += edge[k];
    out.push_back(sum / total);
  }
  return out;
}

struct Value {
  const Column *column;
  std::array<std::size_t, 2> feature;
};

double value_of(const rim_ellipsoid *ellipsoid, void *context) {
  const auto &v = *static_cast<const Value *>(context);
  rim_stats in{};
  for (std::size_t i = 0; i < v.column->drive.size(); ++i) {
    const double x[2] = {v.column->u(i, v.feature[0]), v.column->u(i, v.feature[1])};
    if (rim_ellipsoid_contains(ellipsoid, x))
      v.column->add(i, &in);
  }
  return in.n >= kLeastPoints ? rim_stats_ln_anom(&in) : 0.0;
}

// All features' orders, shared by the channels.
std::vector<std::vector<std::size_t>> orders_of(const CobotDrive &d) {
  std::vector<std::vector<std::size_t>> out(d.dims, std::vector<std::size_t>(d.size()));
  for (std::size_t f = 0; f < d.dims; ++f) {
    std::iota(out[f].begin(), out[f].end(), std::size_t{0});
    std::stable_sort(out[f].begin(), out[f].end(), [&](std::size_t a, std::size_t b) {
      return d.u[a * d.dims + f] < d.u[b * d.dims + f];
    });
  }
  return out;
}

rim_region interval_region(std::size_t f, const Range &range) {
  rim_region region{};
  const auto feature = static_cast<std::uint16_t>(f);
  if (rim_region_from_box(&region, 1, &feature, &range.low, &range.high) != RIM_OK)
    return {};
  return region;
}

class Explanation {
public:
  Explanation(const CobotDrive &drive, const CobotScores &scores, std::uint64_t seed)
      : drive_(drive), scores_(scores), orders_(orders_of(drive)), seed_(seed) {}

  CobotRegion best();

private:
  void offer(std::size_t channel, const rim_region &region, double ln_anom);
  void average_over_edges();
  void look_at(const Column &column);
  void look_at_pairs(const Column &column, std::size_t base, const Range &range);
  void climb(const Column &column, std::array<std::size_t, 2> feature, const Range &a,
             const Range &b);
  const CobotDrive &drive_;
  const CobotScores &scores_;
  std::vector<std::vector<std::size_t>> orders_;
  std::uint64_t seed_, streams_ = 0;
  CobotRegion best_;
};

CobotRegion Explanation::best() {
  for (std::size_t c = 0; c < kCobotChannels; ++c)
    look_at({drive_, scores_, c});
  for (std::size_t i = 0; i < drive_.size(); ++i)
    best_.inside.push_back(rim_region_contains(&best_.region, &drive_.u[i * drive_.dims]));
  if (best_.region.dims == 1)
    average_over_edges();
  return best_;
}

void Explanation::offer(std::size_t channel, const rim_region &region, double ln_anom) {
  const double score = ln_anom - price(region.dims, drive_.dims, drive_.size());
  if (score <= best_.score)
    return;
  best_ = {channel, region, ln_anom, score, {}};
}

void Explanation::average_over_edges() {
  const std::size_t f = best_.region.feature[0];
  const std::vector<bool> everything(drive_.size(), true);
  const Bins bins = bins_of({drive_, scores_, best_.channel}, f, orders_[f], everything);
  const std::vector<double> chance = membership_of(bins, best_.ln_anom);
  for (std::size_t k = 0; k < chance.size(); ++k) {
    for (const std::size_t i : bins.of[k])
      best_.inside[i] = chance[k] > kMember;
  }
}

void Explanation::look_at(const Column &column) {
  rim_stats all{};
  for (std::size_t i = 0; i < drive_.size(); ++i)
    column.add(i, &all);
  offer(column.channel, {}, rim_stats_ln_anom(&all));
  const std::vector<bool> everything(drive_.size(), true);
  std::vector<Range> ranges;
  std::size_t base = 0;
  for (std::size_t f = 0; f < drive_.dims; ++f) {
    ranges.push_back(best_range(bins_of(column, f, orders_[f], everything)));
    offer(column.channel, interval_region(f, ranges[f]), ranges[f].ln_anom);
    if (ranges[f].ln_anom > ranges[base].ln_anom)
      base = f;
  }
  look_at_pairs(column, base, ranges[base]);
}

// Each other feature along the points of the strongest interval: H3.
void Explanation::look_at_pairs(const Column &column, std::size_t base, const Range &range) {
  std::vector<bool> inside(drive_.size());
  for (std::size_t i = 0; i < drive_.size(); ++i)
    inside[i] = column.u(i, base) > range.low && column.u(i, base) < range.high;
  std::vector<std::pair<double, std::size_t>> ranked;
  std::vector<Range> along(drive_.dims);
  for (std::size_t f = 0; f < drive_.dims; ++f) {
    if (f == base)
      continue;
    along[f] = best_range(bins_of(column, f, orders_[f], inside));
    ranked.push_back({-along[f].ln_anom, f});
  }
  std::sort(ranked.begin(), ranked.end());
  for (std::size_t k = 0; k < std::min(kPairs, ranked.size()); ++k)
    climb(column, {base, ranked[k].second}, range, along[ranked[k].second]);
}

void Explanation::climb(const Column &column, std::array<std::size_t, 2> feature, const Range &a,
                        const Range &b) {
  rim_ellipsoid e{};
  e.dims = 2;
  const Range *sides[2] = {&a, &b};
  const double diagonal[2] = {kBoxToEllipse * (a.high - a.low), kBoxToEllipse * (b.high - b.low)};
  for (std::size_t k = 0; k < 2; ++k)
    e.center[k] = 0.5 * (sides[k]->low + sides[k]->high);
  e.factor[0] = diagonal[0];
  e.factor[2] = diagonal[1];
  Value value{&column, feature};
  rim_cem_config config{};
  config.least_axis = 0.005;
  double ln_anom = 0.0;
  if (rim_cem_optimise(&config, value_of, &value, seed_, streams_++, &e, &ln_anom) != RIM_OK)
    throw std::logic_error("cobot: the search refused its configuration");
  const std::uint16_t names[2] = {static_cast<std::uint16_t>(feature[0]),
                                  static_cast<std::uint16_t>(feature[1])};
  rim_region region{};
  if (rim_ellipsoid_region(&e, names, &region) == RIM_OK)
    offer(column.channel, region, ln_anom);
}

} // namespace

std::vector<double> innovations(const std::vector<double> &residuals,
                                const std::array<double, kCobotChannels> &offset_variance) {
  std::vector<double> out;
  std::array<double, kCobotChannels> offset{}, var = offset_variance;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const std::size_t c = k % kCobotChannels;
    const double off = residuals[k] - offset[c];
    out.push_back(off / std::sqrt(1.0 + var[c]));
    const double gain = var[c] / (1.0 + var[c]);
    offset[c] += gain * std::clamp(off, -kTrusted, kTrusted);
    var[c] *= 1.0 - gain;
  }
  return out;
}

std::vector<double> watch_cobot(const CobotDrive &drive, const CobotScatter &scatter,
                                std::uint64_t seed) {
  rim_select_config config{};
  config.features = static_cast<std::uint16_t>(drive.dims);
  config.channels = static_cast<std::uint16_t>(kCobotChannels);
  config.bins = RIM_SELECT_MAX_BINS;
  config.seed = seed;
  std::size_t bytes = 0;
  if (rim_select_size(&config, &bytes) != RIM_OK)
    throw std::logic_error("cobot: the search has no such size");
  std::vector<std::uint64_t> memory(bytes / 8 + 1);
  rim_select *engine = nullptr;
  if (rim_select_init(&engine, memory.data(), 8 * memory.size(), &config) != RIM_OK)
    throw std::logic_error("cobot: the search refused its configuration");
  const std::vector<double> r =
      innovations(scatter.residuals(scatter.scores(drive)), scatter.offset_variance());
  std::vector<double> out;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    rim_select_observe(engine, &drive.u[i * drive.dims], &r[i * kCobotChannels]);
    rim_select_work(engine, kUnitsAPoint);
    const float *scores = rim_select_channel_scores(engine);
    const auto most = static_cast<double>(*std::max_element(scores, scores + kCobotChannels));
    out.push_back(most / std::max(kGrowthFrom, std::log(static_cast<double>(i + 1))));
  }
  return out;
}

CobotRegion explain_cobot(const CobotDrive &drive, const CobotScatter &scatter,
                          std::uint64_t seed) {
  const CobotScores scores = scatter.scores(drive);
  return Explanation(drive, scores, seed).best();
}

PrecisionRecall compare_points(const std::vector<bool> &inside, const std::vector<bool> &truth) {
  double hit = 0.0, found = 0.0, real = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    hit += inside[i] && truth[i] ? 1.0 : 0.0;
    found += inside[i] ? 1.0 : 0.0;
    real += truth[i] ? 1.0 : 0.0;
  }
  PrecisionRecall out;
  out.precision = found > 0.0 ? hit / found : 0.0;
  out.recall = real > 0.0 ? hit / real : 0.0;
  out.f1 = found + real > 0.0 ? 2.0 * hit / (found + real) : 0.0;
  return out;
}

double run_level_threshold(std::vector<double> maxima, double rate) {
  std::sort(maxima.begin(), maxima.end());
  const auto n = static_cast<double>(maxima.size());
  const auto rank = static_cast<std::size_t>(std::ceil((n + 1.0) * (1.0 - rate)));
  return rank <= maxima.size() ? maxima[rank - 1] : INFINITY;
}

} // namespace rim
