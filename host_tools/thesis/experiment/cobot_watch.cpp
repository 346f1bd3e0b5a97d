// SPDX-License-Identifier: MIT
#include "thesis/experiment/cobot_watch.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "thesis/experiment/select_engine.hpp"
#include "search/cem.h"
#include "batch/interval.h"
#include "batch/stats.h"
#include "base/ellipsoid.h"
#include "search/select.h"

namespace rim {
namespace {

constexpr std::uint32_t kShareUnits = 7; // of search a point, over the shares of the speed
constexpr std::uint32_t kDriftUnits = 4; // and over the other three channels
constexpr double kCountsAPoint = 2.0;    // on average: 1 at a door's speed, 3 in a corridor
constexpr std::uint16_t kRing = 1024;    // a drive of three minutes, so counted
constexpr double kGrowthFrom = 3.5;      // ln of 33 points: fewer are judged like these
constexpr double kTrusted = 3.0;         // sd of a residual that teaches the drive's offset
constexpr double kLeastPoints = 3.0;     // in a region
constexpr std::size_t kSteps = 512;      // different values of a feature that are told apart
constexpr std::size_t kPairs = 4;        // of features that are given an ellipse
constexpr double kMember = 0.7;          // chance from which a point counts as inside
constexpr double kMostDeviations = 8.0;  // of one point of a finished drive
constexpr double kNegligible = 20.0;     // nats below the best
constexpr double kBoxToEllipse = 0.575;  // half axis over side: equal areas, nearly

// One channel of a finished drive whose own offset is unknown, of variance b: generalised least
// squares of a region's size beside it. With X, W the sums over the drive the score of a region is
// sum x - w b X / (1 + b W), its variance sum w - (sum w)^2 b / (1 + b W).
struct Column {
  const CobotDrive &drive;
  const CobotScores &scores;
  std::size_t channel;
  double offset = 0.0, shrink = 0.0; // b X / (1 + b W), b / (1 + b W)

  Column(const CobotDrive &d, const CobotScores &s, std::size_t c, double variance)
      : drive(d), scores(s), channel(c) {
    double sum = 0.0, weight = 0.0;
    for (std::size_t i = 0; i < drive.size(); ++i) {
      sum += x(i);
      weight += w(i);
    }
    shrink = variance / (1.0 + variance * weight);
    offset = shrink * sum;
  }
  double u(std::size_t i, std::size_t f) const { return drive.u[i * drive.dims + f]; }
  double w(std::size_t i) const { return scores.w[i * kCobotChannels + channel]; }
  double x(std::size_t i) const { // one point counts so many deviations at most
    const double most = kMostDeviations * std::sqrt(w(i));
    return std::clamp(scores.x[i * kCobotChannels + channel], -most, most);
  }
  void add(std::size_t i, rim_stats *to) const {
    to->n += 1.0;
    to->s += x(i) - w(i) * offset;
    to->w += w(i);
  }
  double ln_anom(const rim_stats &in) const {
    return rimi_stats_ln_anom_run(in.s, in.w, 1.0, -shrink);
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
Range best_range(const Column &c, const Bins &bins) {
  Range out;
  rim_interval best{};
  if (rimi_interval_find(bins.stats.data(), bins.stats.size(), kLeastPoints, &best) != RIM_OK ||
      best.bins == 0)
    return out;
  const std::size_t end = best.first + best.bins - 1;
  out.ln_anom = c.ln_anom({best.n, best.s, best.w});
  out.low = best.first > 0 ? 0.5 * (bins.last[best.first - 1] + bins.first[best.first]) : -0.01;
  out.high = end + 1 < bins.stats.size() ? 0.5 * (bins.last[end] + bins.first[end + 1]) : 1.01;
  return out;
}

// Adds the likelihood of every interval, over e^reference and times `prior`, to the points in it;
// returns the sum over the intervals.
double add_intervals(const Column &c, const Bins &bins, double reference, double prior,
                     std::vector<double> &to) {
  std::vector<double> edge(bins.stats.size() + 1, 0.0);
  double total = 0.0;
  for (std::size_t a = 0; a < bins.stats.size(); ++a) {
    rim_stats in{};
    for (std::size_t b = a; b < bins.stats.size(); ++b) {
      rimi_stats_merge(&in, &bins.stats[b]);
      const double weight = prior * std::exp(c.ln_anom(in) - reference);
      edge[a] += weight;
      edge[b + 1] -= weight;
      total += weight;
    }
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < bins.stats.size(); ++k) {
    sum += edge[k];
    for (const std::size_t i : bins.of[k])
      to[i] += sum;
  }
  return total;
}

struct Value {
  const Column *column;
  std::array<std::size_t, 2> feature;
  const std::vector<bool> *use;
};

double value_of(const rim_ellipsoid *ellipsoid, void *context) {
  const auto &v = *static_cast<const Value *>(context);
  rim_stats in{};
  for (std::size_t i = 0; i < v.column->drive.size(); ++i) {
    const double x[2] = {v.column->u(i, v.feature[0]), v.column->u(i, v.feature[1])};
    if ((*v.use)[i] && rimi_ellipsoid_contains(ellipsoid, x))
      v.column->add(i, &in);
  }
  return in.n >= kLeastPoints ? v.column->ln_anom(in) : 0.0;
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

// Points whose wheels are told to turn at a speed that can be told from standing.
std::vector<bool> moving_points(const CobotDrive &d, double wheel_deviation) {
  std::vector<bool> out;
  for (const CobotWheels &speed : d.predicted)
    out.push_back(std::any_of(speed.begin(), speed.end(),
                              [&](double v) { return std::fabs(v) > wheel_deviation; }));
  return out;
}

bool tells_speed(std::size_t f) { return f >= kCobotFirstMotion && f <= kCobotLastMotion; }

rim_region interval_region(std::size_t f, const Range &range) {
  rim_region region{};
  const auto feature = static_cast<std::uint16_t>(f);
  if (rimi_region_from_box(&region, 1, &feature, &range.low, &range.high) != RIM_OK)
    return {};
  return region;
}

class Explanation {
  struct Hypothesis {
    std::size_t channel, feature; // drive.dims: everywhere
    double ln_anom;               // of its best interval
  };

public:
  Explanation(const CobotDrive &drive, const CobotScatter &scatter, std::uint64_t seed)
      : drive_(drive), scatter_(scatter), scores_(scatter.scores(drive)), orders_(orders_of(drive)),
        everything_(drive.size(), true), moving_(moving_points(drive, scatter.wheel_deviation())),
        seed_(seed) {}

  CobotRegion best();

private:
  void offer(std::size_t channel, const rim_region &region, double ln_anom);
  void average();
  void look_at(const Column &column);
  void look_at_pairs(const Column &column, std::size_t base, const Range &range);
  void climb(const Column &column, std::array<std::size_t, 2> feature, const Range &a,
             const Range &b);
  const std::vector<bool> &points_of(std::size_t channel,
                                     const std::vector<std::size_t> &features) const;

  Column column_of(std::size_t channel) const {
    return {drive_, scores_, channel, scatter_.size_variance(channel)};
  }

  const CobotDrive &drive_;
  const CobotScatter &scatter_;
  CobotScores scores_;
  std::vector<std::vector<std::size_t>> orders_;
  std::vector<bool> everything_, moving_;
  std::uint64_t seed_, streams_ = 0;
  CobotRegion best_;
  std::vector<Hypothesis> hypotheses_;
};

CobotRegion Explanation::best() {
  for (std::size_t c = 0; c < kCobotChannels; ++c)
    look_at(column_of(c));
  const rim_region &region = best_.region;
  const std::vector<bool> &use =
      points_of(best_.channel, {region.feature, region.feature + region.dims});
  for (std::size_t i = 0; i < drive_.size(); ++i)
    best_.inside.push_back(use[i] && rim_region_contains(&region, &drive_.u[i * drive_.dims]));
  if (best_.region.dims < 2)
    average();
  return best_;
}

// The points that a region over these features may hold. A share of no speed is no inaccuracy: the
// corridor's region encompasses 'non-zero velocity points in a rectangular region of physical
// space' (4.2.4), and no likelihood could tell of a robot that stands. Where features tell the
// speed the region itself says which it holds, and everywhere is the whole domain (3.5.2).
const std::vector<bool> &Explanation::points_of(std::size_t channel,
                                                const std::vector<std::size_t> &features) const {
  const bool all_speeds = channel > kCobotAllWheels || features.empty() ||
                          std::any_of(features.begin(), features.end(), tells_speed);
  return all_speeds ? everything_ : moving_;
}

void Explanation::offer(std::size_t channel, const rim_region &region, double ln_anom) {
  const double score = ln_anom - price(region.dims, drive_.dims, drive_.size());
  if (score <= best_.score)
    return;
  best_ = {channel, region, ln_anom, score, {}};
}

// Everywhere and an interval are as likely beforehand, and so is every interval of every feature.
void Explanation::average() {
  const auto n = static_cast<double>(drive_.size());
  const double prior = 2.0 / (static_cast<double>(drive_.dims) * n * (n + 1.0));
  std::vector<double> chance(drive_.size(), 0.0);
  double total = 0.0;
  for (const Hypothesis &h : hypotheses_) {
    if (h.ln_anom < best_.ln_anom - kNegligible)
      continue;
    if (h.feature == drive_.dims) {
      const double weight = std::exp(h.ln_anom - best_.ln_anom);
      for (double &c : chance)
        c += weight;
      total += weight;
    } else {
      const Column column = column_of(h.channel);
      const Bins bins =
          bins_of(column, h.feature, orders_[h.feature], points_of(h.channel, {h.feature}));
      total += add_intervals(column, bins, best_.ln_anom, prior, chance);
    }
  }
  for (std::size_t i = 0; i < drive_.size(); ++i)
    best_.inside[i] = chance[i] > kMember * total;
}

void Explanation::look_at(const Column &column) {
  rim_stats all{};
  for (std::size_t i = 0; i < drive_.size(); ++i)
    column.add(i, &all);
  offer(column.channel, {}, column.ln_anom(all));
  hypotheses_.push_back({column.channel, drive_.dims, column.ln_anom(all)});
  std::vector<Range> ranges;
  std::size_t base = 0;
  for (std::size_t f = 0; f < drive_.dims; ++f) {
    const std::vector<bool> &use = points_of(column.channel, {f});
    ranges.push_back(best_range(column, bins_of(column, f, orders_[f], use)));
    offer(column.channel, interval_region(f, ranges[f]), ranges[f].ln_anom);
    hypotheses_.push_back({column.channel, f, ranges[f].ln_anom});
    if (ranges[f].ln_anom > ranges[base].ln_anom)
      base = f;
  }
  look_at_pairs(column, base, ranges[base]);
}

// Each other feature along the points of the strongest interval: H3.
void Explanation::look_at_pairs(const Column &column, std::size_t base, const Range &range) {
  std::vector<bool> inside(drive_.size());
  std::vector<std::pair<double, std::size_t>> ranked;
  std::vector<Range> along(drive_.dims);
  for (std::size_t f = 0; f < drive_.dims; ++f) {
    if (f == base)
      continue;
    const std::vector<bool> &use = points_of(column.channel, {base, f});
    for (std::size_t i = 0; i < drive_.size(); ++i)
      inside[i] = use[i] && column.u(i, base) > range.low && column.u(i, base) < range.high;
    along[f] = best_range(column, bins_of(column, f, orders_[f], inside));
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
  Value value{&column, feature, &points_of(column.channel, {feature[0], feature[1]})};
  rim_cem_config config{};
  config.least_axis = 0.005;
  double ln_anom = 0.0;
  if (rimi_cem_optimise(&config, value_of, &value, seed_, streams_++, &e, &ln_anom) != RIM_OK)
    throw std::logic_error("cobot: the search refused its configuration");
  const std::uint16_t names[2] = {static_cast<std::uint16_t>(feature[0]),
                                  static_cast<std::uint16_t>(feature[1])};
  rim_unit_region region{};
  if (rimi_ellipsoid_region(&e, names, &region) == RIM_OK)
    offer(column.channel, region.unit, ln_anom);
}

} // namespace

std::vector<double> innovations(const std::vector<double> &residuals,
                                const std::vector<double> &slopes,
                                const std::array<double, kCobotChannels> &size_variance) {
  std::vector<double> out;
  std::array<double, kCobotChannels> size{}, var = size_variance;
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const std::size_t c = k % kCobotChannels;
    const double off = residuals[k] - size[c] * slopes[k];
    const double off_variance = 1.0 + var[c] * slopes[k] * slopes[k];
    out.push_back(off / std::sqrt(off_variance));
    const double gain = var[c] * slopes[k] / off_variance;
    size[c] += gain * std::clamp(off, -kTrusted, kTrusted);
    var[c] *= 1.0 - gain * slopes[k];
  }
  return out;
}

std::vector<double> cobot_innovations(const CobotDrive &drive, const CobotScatter &scatter) {
  const CobotScores scores = scatter.scores(drive);
  std::array<double, kCobotChannels> variance{};
  for (std::size_t c = 0; c < kCobotChannels; ++c)
    variance[c] = scatter.size_variance(c);
  return innovations(scatter.residuals(scores), scatter.slopes(scores), variance);
}

namespace {

// The online search over some of the channels.
class OnlineSearch {
public:
  OnlineSearch(std::size_t dims, std::size_t first, std::size_t channels, std::uint32_t units,
               std::uint64_t seed)
      : first_(first), channels_(channels), units_(units),
        engine_(config_of(dims, channels, seed)) {}

  // A point worth `count` observations: their sum has the variance of as many, whatever the count.
  // r: of all channels. Returns the largest score.
  double observe(const double *u, const double *r, std::size_t count) {
    std::array<double, kCobotChannels> each{};
    for (std::size_t c = 0; c < channels_; ++c)
      each[c] = r[first_ + c] / std::sqrt(static_cast<double>(count));
    for (std::size_t k = 0; k < count; ++k)
      rimi_select_observe(engine_.get(), u, each.data());
    rimi_select_work(engine_.get(), units_);
    const float *scores = rimi_select_channel_scores(engine_.get());
    return static_cast<double>(*std::max_element(scores, scores + channels_));
  }

private:
  static rim_select_config config_of(std::size_t dims, std::size_t channels, std::uint64_t seed) {
    rim_select_config config{};
    config.features = static_cast<std::uint16_t>(dims);
    config.channels = static_cast<std::uint16_t>(channels);
    config.bins = RIM_SELECT_MAX_BINS;
    config.ring = kRing;
    config.seed = seed;
    return config;
  }

  std::size_t first_, channels_;
  std::uint32_t units_;
  SelectEngine engine_;
};

} // namespace

std::vector<double> watch_cobot(const CobotDrive &drive, const CobotScatter &scatter,
                                std::uint64_t seed) {
  constexpr std::size_t shares = kCobotAllWheels + 1;
  OnlineSearch share(drive.dims, 0, shares, kShareUnits, seed);
  OnlineSearch drift(drive.dims, shares, kCobotChannels - shares, kDriftUnits, seed);
  const CobotScores scores = scatter.scores(drive);
  const std::vector<double> r = cobot_innovations(drive, scatter);
  std::vector<double> out;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const double weight = scores.w[i * kCobotChannels + kCobotAllWheels];
    const auto count = static_cast<std::size_t>(
        std::max(1.0, std::round(kCountsAPoint * weight / scatter.mean_weight(kCobotAllWheels))));
    const double *u = &drive.u[i * drive.dims], *of_point = &r[i * kCobotChannels];
    const double most = std::max(share.observe(u, of_point, count), drift.observe(u, of_point, 1));
    out.push_back(most / std::max(kGrowthFrom, std::log(static_cast<double>(i + 1))));
  }
  return out;
}

CobotRegion explain_cobot(const CobotDrive &drive, const CobotScatter &scatter,
                          std::uint64_t seed) {
  return Explanation(drive, scatter, seed).best();
}

} // namespace rim
