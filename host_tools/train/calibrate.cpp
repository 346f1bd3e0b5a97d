// SPDX-License-Identifier: MIT
#include "train/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>

#include <boost/math/distributions/gamma.hpp>
#include <boost/math/distributions/normal.hpp>

#include "image/image_writer.hpp"
#include "stats/conformal.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

extern "C" {
#include "search/search.h"
}

namespace rim {

Promise promise_for(std::size_t runs, double false_alarm) {
  Promise promise;
  promise.rank = static_cast<std::uint32_t>(std::min(runs, conformal_rank(runs, false_alarm)));
  promise.rate = conformal_rate(runs, promise.rank);
  return promise;
}

void set_alarm(Thresholds *t, std::vector<float> maxima, const CalibrationOptions &options) {
  std::sort(maxima.begin(), maxima.end());
  const Promise promise = promise_for(maxima.size(), options.false_alarm);
  const Promise warning = promise_for(maxima.size(), options.warn_rate);
  t->maxima = maxima;
  t->rank = promise.rank;
  t->promised_rate = static_cast<float>(promise.rate);
  // Alarms are raised at the threshold itself: the next float above it keeps the promise.
  const auto threshold = [&maxima](std::uint32_t rank) {
    return std::max(1e-3F, std::nextafter(maxima[rank - 1], 1e30F));
  };
  t->alarm_score = threshold(promise.rank);
  t->warn_score = std::min(t->alarm_score, threshold(warning.rank));
}

ScoreSpread score_spread(std::vector<double> scores) {
  std::sort(scores.begin(), scores.end());
  const std::size_t n = scores.size(), half = n / 2, upper = n - 1 - half;
  const double middle = scores[half];
  const std::size_t odd = std::max<std::size_t>(1, n / 10);
  if (upper <= odd)
    return {middle, scores[3 * n / 4] - middle, n, n - 1 - 3 * n / 4};
  const std::size_t counted = upper - odd;
  double sum = 0.0;
  for (std::size_t i = half + 1; i <= half + counted; ++i)
    sum += scores[i] - middle;
  sum += static_cast<double>(odd) * (scores[half + counted] - middle);
  return {middle, std::log(2.0) * sum / static_cast<double>(counted), n, counted};
}

double set_margin(double scale, std::size_t r, double kept) {
  const auto shape = static_cast<double>(r);
  const double most = boost::math::quantile(boost::math::gamma_distribution<>(shape), kept);
  return scale * std::log(most / shape);
}

double tail_bound(const ScoreSpread &spread, double rate, double kept) {
  const double scale = spread.above / std::log(2.0), far = std::log(0.5 / rate);
  const auto shape = static_cast<double>(spread.counted);
  const double most =
      shape / boost::math::quantile(boost::math::gamma_distribution<>(shape), 1.0 - kept);
  const double of_middle = boost::math::quantile(boost::math::normal_distribution<>(), kept) /
                           std::sqrt(static_cast<double>(spread.runs));
  return spread.middle + scale * (far + std::hypot(far * (most - 1.0), of_middle));
}

namespace {

// Runs whose alarm is not theirs to set: those unlike the others, where they are no more than a
// tenth of all. What more of them do is what runs do.
std::vector<bool> forgiven_runs(const std::vector<double> &scores) {
  const double bar = score_spread(scores).unlike_bar();
  std::vector<bool> forgiven;
  for (const double s : scores)
    forgiven.push_back(s > bar);
  if (10 * std::count(forgiven.begin(), forgiven.end(), true) >
      static_cast<std::ptrdiff_t>(scores.size()))
    forgiven.assign(scores.size(), false);
  return forgiven;
}

// The largest score of the runs that are neither forgiven nor `odd`; at least 0.
double largest_like(const std::vector<double> &scores, const std::vector<bool> &forgiven,
                    std::size_t odd) {
  double largest = 0.0;
  for (std::size_t r = 0; r < scores.size(); ++r) {
    if (r != odd && !forgiven[r])
      largest = std::max(largest, scores[r]);
  }
  return largest;
}

} // namespace

void set_alarm_from_runs(Thresholds *t, const std::vector<float> &alone,
                         const std::vector<float> &together, const CalibrationOptions &options,
                         double most_margin) {
  const std::vector<double> scores(alone.begin(), alone.end());
  const auto odd = static_cast<std::size_t>(
      std::distance(alone.begin(), std::max_element(alone.begin(), alone.end())));
  const ScoreSpread spread = score_spread(scores);
  const std::vector<bool> forgiven = forgiven_runs(scores);
  const auto second = static_cast<float>(largest_like(scores, forgiven, odd));
  std::vector<float> counted = alone;
  for (std::size_t r = 0; r < alone.size(); ++r) {
    if (forgiven[r] || (r == odd && scores[r] > spread.unlike_bar()))
      counted[r] = second;
    else if (r == odd)
      counted[r] = std::max(second, std::min(together[r], alone[r]));
  }
  set_alarm(t, counted, options);
  const std::size_t n = counted.size(), from_above = n - t->rank + 1;
  const auto rate = static_cast<double>(t->promised_rate);
  const double margin = set_margin(spread.above / std::log(2.0), from_above, kEachKept);
  const float by_order = t->alarm_score + static_cast<float>(std::min(margin, most_margin));
  if (rate <= std::min(options.false_alarm + 1e-6, 0.5) && spread.counted > 0) {
    std::vector<float> capped = t->maxima;
    for (std::size_t k = 1; 2 * k <= n; ++k) {
      const double most = tail_bound(spread, conformal_rate(n, n - k + 1), kEachKept);
      capped[n - k] = std::min(capped[n - k], static_cast<float>(most));
    }
    set_alarm(t, capped, options);
    const auto bound = static_cast<float>(tail_bound(spread, rate, kEachKept));
    t->by_tail = bound < by_order;
    t->alarm_score = t->by_tail ? std::max(bound, t->alarm_score) : by_order;
  } else {
    t->alarm_score = by_order;
  }
}

namespace {

constexpr double kPredictable = 0.9; // part of the variance from which on a prediction stands for a
                                     // measured feature: a reading selects on its own noise
// The inflation of a family in one channel: the tail of the healthy runs' largest ratios beyond
// this quantile of them is taken as exponential, ...
constexpr double kTailFrom = 0.5;
// ... with a scale drawn to the one that is usual for the family, by as much as its own is not
// larger by this many of its standard errors: a scale of a dozen runs is uncertain, and the
// channels share the search. One that is larger is larger still farther out, by this power of
// how much larger: such a tail is heavier than exponential, and no channel may set all alarms.
constexpr double kTailAlike = 1.6;
constexpr double kTailHeavier = 1.5;
// And what has a chance of exp(-kTailNats) by it scores kTailNats, about what an alarm needs.
constexpr double kTailNats = 10.0;
// Blocks in the ring of the flight profile: 80 % of a run, with many channels less.
constexpr std::uint16_t kFlightRing = 192, kLeastFlightRing = 64;
constexpr std::size_t kFlightSearchBytes = 40400;

Eigen::VectorXd ranks(const Eigen::VectorXd &x) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(x.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&x](Eigen::Index a, Eigen::Index b) { return x[a] < x[b]; });
  Eigen::VectorXd rank(x.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    rank[order[i]] = static_cast<double>(i);
  return rank;
}

// A region feature in every block of every run, as flight sees it.
Eigen::VectorXd region_values(const std::vector<SearchRun> &runs, std::uint16_t feature,
                              std::uint16_t outcome) {
  Eigen::Index rows = 0;
  for (const SearchRun &run : runs)
    rows += run.blocks->blocks();
  Eigen::VectorXd all(rows);
  Eigen::Index at = 0;
  for (const SearchRun &run : runs) {
    const Eigen::Index n = run.blocks->blocks();
    all.segment(at, n) =
        outcome == 0xffff ? run.blocks->context.col(feature) : run.predicted->col(outcome);
    at += n;
  }
  return all;
}

double byte_of(const FlightPlan &plan, std::size_t feature, double value) {
  const double low = static_cast<double>(plan.low[feature]);
  const double width = static_cast<double>(plan.high[feature]) - low;
  return std::clamp(std::floor(256.0 * (value - low) / width), 0.0, 255.0);
}

// Half of the cuts by quantiles, half of equal width: a feature may have a mass at one value.
std::vector<std::uint8_t> cuts_of(const FlightPlan &plan, std::uint16_t feature,
                                  const Eigen::VectorXd &values) {
  std::vector<double> bytes;
  for (const double v : values)
    bytes.push_back(byte_of(plan, feature, v));
  std::sort(bytes.begin(), bytes.end());
  std::vector<std::uint8_t> cuts;
  constexpr std::size_t by_quantile = SEARCH_CUTS / 2;
  for (std::size_t k = 1; k <= by_quantile; ++k)
    cuts.push_back(static_cast<std::uint8_t>(bytes[k * (bytes.size() - 1) / (by_quantile + 1)]));
  constexpr std::size_t by_width = SEARCH_CUTS - by_quantile;
  for (std::size_t k = 1; k <= by_width; ++k)
    cuts.push_back(static_cast<std::uint8_t>(
        bytes.front() + (bytes.back() - bytes.front()) * static_cast<double>(k) /
                            static_cast<double>(by_width + 1)));
  std::sort(cuts.begin(), cuts.end());
  return cuts;
}

search_config search_of(const FlightPlan &plan, const rim_noise &noise) {
  search_config config{};
  config.features = static_cast<std::uint16_t>(plan.region.size());
  config.channels = static_cast<std::uint16_t>(noise.channels);
  config.outcomes = static_cast<std::uint16_t>(plan.layout.outcomes());
  config.means = static_cast<std::uint16_t>(noise.raw - NOISE_RAW_FIRST);
  config.ring = static_cast<std::uint16_t>(plan.ring);
  config.cells_per_turn = static_cast<std::uint8_t>(plan.pairs);
  config.noise = &noise;
  config.cuts = plan.cuts.data();
  return config;
}

// As many blocks as fit beside what the channels need: a monitor of 25 outcomes has 55 kB.
std::uint32_t flight_ring(const FlightPlan &plan, const rim_noise &noise) {
  search_config config = search_of(plan, noise);
  config.ring = kFlightRing;
  while (config.ring > kLeastFlightRing && rimi_search_size(&config) > kFlightSearchBytes)
    config.ring = static_cast<std::uint16_t>(config.ring - 4);
  return config.ring;
}

// Sections REGION and OUTCOMES, by which the search tells an outcome's own reading.
SectionBytes region_section(const FlightPlan &plan) {
  SectionBytes section;
  for (std::size_t k = 0; k < plan.region.size(); ++k) {
    section.u16(plan.region[k]);
    section.u16(plan.region_outcome[k]);
  }
  return section;
}

SectionBytes outcomes_section(const FlightPlan &plan) {
  SectionBytes section;
  for (const std::uint16_t f : plan.layout.outcome_feature)
    section.u16(f);
  return section;
}

// Which channels say nothing of block i; none: all are known.
std::unique_ptr<bool[]> unknown_channels(const SearchRun &run, Eigen::Index i) {
  if (run.unknown == nullptr || run.unknown->row(i).sum() == 0.0)
    return nullptr;
  const auto channels = static_cast<std::size_t>(run.residual->cols());
  const Eigen::Index outcomes = run.unknown->cols();
  auto unknown = std::make_unique<bool[]>(channels);
  for (Eigen::Index o = 0; o < outcomes; ++o)
    unknown[static_cast<std::size_t>(RIM_CHANNEL_AGREEMENT * outcomes + o)] =
        (*run.unknown)(i, o) != 0.0;
  return unknown;
}

// The flight code's search over one healthy run: the largest ratio of every channel and family.
std::vector<float> run_maxima(const FlightPlan &plan, const rim_noise &noise, const Basis &basis,
                              const SearchRun &run) {
  const SectionBytes region = region_section(plan), outcome_feature = outcomes_section(plan);
  search_config config = search_of(plan, noise);
  config.region = region.bytes().data();
  config.outcome_feature = plan.layout.external ? nullptr : outcome_feature.bytes().data();
  std::vector<std::uint64_t> memory(rimi_search_size(&config) / 8 + 1);
  rim_search *search = nullptr;
  if (rimi_search_init(&search, memory.data(), memory.size() * 8, &config) != RIM_OK)
    throw std::logic_error("rimi_search_init");
  std::vector<float> maxima(noise.channels * NOISE_FAMILIES, 0.0F);
  rimi_search_keep_maxima(search, maxima.data());
  std::vector<std::uint8_t> place(plan.region.size());
  const Matrix means = standard_means(basis, *run.blocks);
  const Eigen::Index fine = std::min(run.residual->cols(), 2 * run.predicted->cols());
  Matrix expected_all(run.blocks->blocks(), fine);
  for (Eigen::Index c = 0; c < fine; ++c)
    expected_all.col(c) = expected(run, c);
  for (Eigen::Index i = 0; i < run.blocks->blocks(); ++i) {
    for (std::size_t k = 0; k < place.size(); ++k) {
      const double x = plan.region_outcome[k] == 0xffff
                           ? run.blocks->context(i, plan.region[k])
                           : (*run.predicted)(i, plan.region_outcome[k]);
      place[k] = static_cast<std::uint8_t>(byte_of(plan, plan.region[k], x));
    }
    const Eigen::VectorXd residual = run.residual->row(i), predicted = expected_all.row(i);
    const Eigen::VectorXd mean = means.row(i);
    search_block block{};
    block.t_s = run.blocks->time_s[i];
    block.feature = place.data();
    block.mean = mean.data();
    block.predicted = predicted.data();
    block.residual = residual.data();
    block.disturbance = (*run.disturbance)[i];
    std::unique_ptr<bool[]> unknown = unknown_channels(run, i);
    block.unknown = unknown.get();
    block.apart = !run.blocks->follows[static_cast<std::size_t>(i)];
    if (rimi_search_observe(search, &block) != RIM_OK)
      throw std::logic_error("rimi_search_observe");
    rimi_search_work(search, plan.budget * plan.block_rows);
  }
  return maxima;
}

double description(std::size_t family) {
  return rimi_search_description(static_cast<search_family>(family));
}

// The runs' largest ratios of one channel and family: ascending, the place of every run among them,
// and the sums from every place to the end.
struct Tail {
  std::vector<double> sorted, above;
  std::vector<std::size_t> place;
};

std::vector<Tail> tails_of(const std::vector<std::vector<float>> &maxima) {
  const std::size_t n = maxima.size();
  std::vector<Tail> tails(maxima.front().size());
  parallel_for(tails.size(), [&](std::size_t at) {
    std::vector<std::size_t> order(n);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return maxima[a][at] < maxima[b][at]; });
    Tail &tail = tails[at];
    tail.place.resize(n);
    tail.above.assign(n + 1, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      tail.place[order[i]] = i;
      tail.sorted.push_back(static_cast<double>(maxima[order[i]][at]));
    }
    for (std::size_t i = n; i-- > 0;)
      tail.above[i] = tail.above[i + 1] + tail.sorted[i];
  });
  return tails;
}

// Where a tail begins, and the mean of what lies beyond; of all runs but one (-1: of all).
struct TailFit {
  double from = 0.0, scale = 0.0, count = 0.0;
};

TailFit fit_tail(const Tail &tail, int without) {
  const std::size_t left_out =
      without < 0 ? tail.sorted.size() : tail.place[static_cast<std::size_t>(without)];
  const std::size_t n = tail.sorted.size() - (without < 0 ? 0 : 1);
  if (n < 2)
    return {};
  const auto begin = std::min(static_cast<std::size_t>(kTailFrom * static_cast<double>(n)), n - 2);
  const std::size_t at = begin < left_out ? begin : begin + 1; // among all runs
  double sum = tail.above[at + 1];
  if (left_out > at && without >= 0)
    sum -= tail.sorted[left_out];
  TailFit fit;
  fit.from = tail.sorted[at];
  fit.count = static_cast<double>(n - begin - 1);
  fit.scale = sum / fit.count - fit.from;
  return fit;
}

// Per family the scale in the middle of all channels in which something is searched, at least that
// of a ratio of Gaussian noise.
std::vector<double> usual_scales(const std::vector<TailFit> &fits, const std::vector<Tail> &tails) {
  std::vector<double> usual;
  for (std::size_t family = 0; family < NOISE_FAMILIES; ++family) {
    std::vector<double> scales;
    for (std::size_t at = family; at < fits.size(); at += NOISE_FAMILIES) {
      if (tails[at].sorted.back() > 0.0)
        scales.push_back(fits[at].scale);
    }
    std::sort(scales.begin(), scales.end());
    usual.push_back(std::max(1.0, scales.empty() ? 1.0 : scales[scales.size() / 2]));
  }
  return usual;
}

// phi of every channel and family by itself, from the runs but one (-1: from all).
std::vector<double> plain_phi(const std::vector<Tail> &tails, int without) {
  std::vector<TailFit> fits;
  for (const Tail &tail : tails)
    fits.push_back(fit_tail(tail, without));
  const std::vector<double> usual = usual_scales(fits, tails);
  std::vector<double> phi;
  for (std::size_t at = 0; at < tails.size(); ++at) {
    const TailFit &fit = fits[at];
    const double common = usual[at % NOISE_FAMILIES];
    const double above = std::log(std::max(fit.scale / common, 1.0));
    const double weight = std::min(1.0, above * std::sqrt(std::max(fit.count, 1.0)) / kTailAlike);
    const double scale = common * std::exp(kTailHeavier * above * weight);
    const double large = fit.from + kTailNats * scale;
    phi.push_back(std::max(1.0, large / (description(at % NOISE_FAMILIES) + kTailNats)));
  }
  return phi;
}

// A richer family is never inflated less than what it contains, or it would be preferred for that
// alone.
void order_families(std::vector<double> *phi) {
  for (std::size_t first = 0; first < phi->size(); first += NOISE_FAMILIES) {
    double *p = phi->data() + first;
    p[SEARCH_RAMP] = std::max(p[SEARCH_RAMP], p[SEARCH_SINCE]);
    p[SEARCH_GAIN] = std::max(p[SEARCH_GAIN], p[SEARCH_SINCE]);
    p[SEARCH_DURING] = std::max(p[SEARCH_DURING], p[SEARCH_SINCE]);
    p[SEARCH_BOX] = std::max(p[SEARCH_BOX], p[SEARCH_INTERVAL]);
    p[SEARCH_INTERVAL_SINCE] =
        std::max({p[SEARCH_INTERVAL_SINCE], p[SEARCH_INTERVAL], p[SEARCH_SINCE]});
    p[SEARCH_BOX_SINCE] = std::max({p[SEARCH_BOX_SINCE], p[SEARCH_BOX], p[SEARCH_INTERVAL_SINCE]});
  }
}

// phi of every channel and family.
std::vector<double> all_phi(const std::vector<Tail> &tails, int without) {
  std::vector<double> phi = plain_phi(tails, without);
  order_families(&phi);
  return phi;
}

RunScore run_score(const std::vector<float> &maxima, const std::vector<double> &phi) {
  RunScore best;
  best.score = -1e30;
  for (std::size_t at = 0; at < maxima.size(); ++at) {
    const double score =
        static_cast<double>(maxima[at]) / phi[at] - description(at % NOISE_FAMILIES);
    if (score > best.score)
      best = {score, at / NOISE_FAMILIES};
  }
  return best;
}

// The ratios of these slots of channel and family alone.
std::vector<std::vector<float>> slots_of(const std::vector<std::vector<float>> &maxima,
                                         std::size_t from, std::size_t end) {
  std::vector<std::vector<float>> some;
  for (const std::vector<float> &run : maxima)
    some.emplace_back(run.begin() + static_cast<std::ptrdiff_t>(from),
                      run.begin() + static_cast<std::ptrdiff_t>(end));
  return some;
}

// phi of the channels of steps: such that kStepsAbove times their largest ratio in healthy runs
// scores no more than the highest run but one does by the other channels. What a step leaves has
// heavy tails where a model of products is wrong, and would set the alarm of all channels
// otherwise.
constexpr double kStepsAbove = 2.0;
std::vector<double> phi_of_steps(const std::vector<std::vector<float>> &maxima,
                                 std::vector<RunScore> of_others) {
  if (maxima.front().empty())
    return {};
  std::vector<double> phi = all_phi(tails_of(maxima), -1);
  std::sort(of_others.begin(), of_others.end(),
            [](const RunScore &a, const RunScore &b) { return a.score > b.score; });
  const double most =
      std::max(of_others[std::min<std::size_t>(1, of_others.size() - 1)].score, 0.0);
  for (const std::vector<float> &run : maxima) {
    for (std::size_t at = 0; at < phi.size(); ++at)
      phi[at] = std::max(phi[at], kStepsAbove * static_cast<double>(run[at]) /
                                      (most + description(at % NOISE_FAMILIES)));
  }
  order_families(&phi);
  return phi;
}

// Raises phi where a forgiven run still scores more than those like each other do: the channel that
// deviates in it is judged less strictly, for it would set the alarm of all channels otherwise.
void forgive_unlike_runs(const std::vector<std::vector<float>> &maxima,
                         const std::vector<RunScore> &alone, std::vector<double> *phi) {
  std::vector<double> scores;
  for (const RunScore &s : alone)
    scores.push_back(s.score);
  const std::vector<bool> forgiven = forgiven_runs(scores);
  const double like = largest_like(scores, forgiven, scores.size());
  for (std::size_t r = 0; r < scores.size(); ++r) {
    for (std::size_t at = 0; forgiven[r] && at < phi->size(); ++at) {
      const double most = like + description(at % NOISE_FAMILIES);
      (*phi)[at] = std::max((*phi)[at], static_cast<double>(maxima[r][at]) / most);
    }
  }
  order_families(phi);
}

} // namespace

namespace {

// A feature that may describe a region.
struct RegionFeature {
  std::uint16_t feature = 0;
  std::uint16_t outcome = 0xffff;    // whose prediction stands for it; 0xffff: as measured
  Eigen::VectorXd values;            // in every block of every run
  Eigen::VectorXd by_value, by_rank; // centred, of length one: their products are correlations
};

Eigen::VectorXd centred(const Eigen::VectorXd &x) {
  return (x.array() - x.mean()).matrix().normalized();
}

// How much two features are alike, 0 to 1, by rank or by value, whichever is more.
double alike(const RegionFeature &a, const RegionFeature &b) {
  return std::max(std::abs(a.by_rank.dot(b.by_rank)), std::abs(a.by_value.dot(b.by_value)));
}

// A region can be told from noise where the vehicle stays in it for some blocks: the correlation of
// a feature with itself so many blocks later, at least 0.
constexpr Eigen::Index kStay = 4;

double lasting(const std::vector<SearchRun> &runs, const RegionFeature &f) {
  double with_later = 0.0, with_itself = 0.0;
  Eigen::Index at = 0;
  for (const SearchRun &run : runs) {
    const Eigen::Index n = run.blocks->blocks(), pairs = std::max<Eigen::Index>(0, n - kStay);
    const auto now = f.by_value.segment(at, pairs);
    with_later += now.dot(f.by_value.segment(at + std::min(n, kStay), pairs));
    with_itself += now.squaredNorm();
    at += n;
  }
  return with_itself > 0.0 ? std::max(0.0, with_later / with_itself) : 0.0;
}

// Features that vary (there is one at least): commands and context, then sensors, without those
// that repeat an earlier one.
std::vector<RegionFeature> distinct_features(const Layout &layout,
                                             const std::vector<SearchRun> &runs,
                                             const std::vector<double> &r2, double redundant) {
  constexpr std::uint16_t none = 0xffff;
  std::vector<std::pair<std::uint16_t, std::uint16_t>> candidates;
  std::vector<RegionFeature> distinct;
  for (std::uint16_t f = 0; f < layout.features(); ++f) {
    if (!is_outcome(layout, f))
      candidates.emplace_back(f, none);
  }
  for (std::size_t o = 0; o < layout.outcome_feature.size(); ++o) {
    const std::uint16_t f = layout.outcome_feature[o];
    const bool predicted = o < r2.size() && r2[o] >= kPredictable && !is_angle(layout, f);
    candidates.emplace_back(f, predicted ? static_cast<std::uint16_t>(o) : none);
  }
  for (const auto &[feature, outcome] : candidates) {
    RegionFeature next{feature, outcome, region_values(runs, feature, outcome), {}, {}};
    const bool is_only = &feature == &candidates.back().first && distinct.empty();
    if (!(next.values.maxCoeff() > next.values.minCoeff()) && !is_only)
      continue;
    next.by_value = centred(next.values);
    next.by_rank = centred(ranks(next.values));
    const bool repeats =
        std::any_of(distinct.begin(), distinct.end(), [&](const RegionFeature &earlier) {
          return alike(next, earlier) >= redundant;
        });
    if (!repeats)
      distinct.push_back(std::move(next));
  }
  return distinct;
}

// Of more features than are searched: commands and context, then those sensors that last and are
// least like what is chosen already. They keep their order.
std::vector<RegionFeature> most_telling(std::vector<RegionFeature> features, const Layout &layout,
                                        const std::vector<SearchRun> &runs, std::size_t most) {
  if (features.size() <= most)
    return features;
  std::vector<double> lasts, unlike(features.size(), 1.0);
  for (const RegionFeature &f : features)
    lasts.push_back(is_outcome(layout, f.feature) ? lasting(runs, f) : HUGE_VAL);
  std::vector<bool> chosen(features.size(), false);
  for (std::size_t count = 0; count < most; ++count) {
    std::size_t best = features.size();
    for (std::size_t i = 0; i < features.size(); ++i) {
      if (!chosen[i] &&
          (best == features.size() || lasts[i] * unlike[i] > lasts[best] * unlike[best]))
        best = i;
    }
    chosen[best] = true;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const double like = alike(features[i], features[best]);
      unlike[i] = std::min(unlike[i], 1.0 - like * like);
    }
  }
  std::vector<RegionFeature> kept;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (chosen[i])
      kept.push_back(std::move(features[i]));
  }
  return kept;
}

} // namespace

void choose_region(FlightPlan *plan, const std::vector<SearchRun> &runs,
                   const std::vector<double> &r2, const CalibrationOptions &options) {
  plan->region.clear();
  plan->region_outcome.clear();
  plan->cuts.clear();
  for (const RegionFeature &f :
       most_telling(distinct_features(plan->layout, runs, r2, options.redundant), plan->layout,
                    runs, options.region_features)) {
    plan->region.push_back(f.feature);
    plan->region_outcome.push_back(f.outcome);
    const std::vector<std::uint8_t> cuts = cuts_of(*plan, f.feature, f.values);
    plan->cuts.insert(plan->cuts.end(), cuts.begin(), cuts.end());
  }
}

namespace {

// A noise model as flight reads it; the bytes stay where they are.
struct FlownNoise {
  explicit FlownNoise(const NoiseModel &model) : bytes(noise_section(model)) {
    if (rimi_noise_open(&view, bytes.data(), bytes.size(),
                        static_cast<std::uint32_t>(model.channels.size()),
                        static_cast<std::uint32_t>(model.means)) != RIM_OK)
      throw DataError("the noise of the healthy runs cannot be described: a channel is not finite");
  }
  std::vector<std::uint8_t> bytes;
  rim_noise view{};
};

} // namespace

std::vector<RunScore> calibrate_runs(FlightPlan *plan, NoiseModel *noise,
                                     const std::vector<JudgedRun> &runs,
                                     const CalibrationOptions &options) {
  if (options.flight)
    plan->ring = flight_ring(*plan, FlownNoise(*noise).view);
  std::map<const NoiseModel *, std::unique_ptr<FlownNoise>> flown;
  for (const JudgedRun &run : runs) {
    std::unique_ptr<FlownNoise> &of_run = flown[run.noise];
    if (of_run == nullptr)
      of_run = std::make_unique<FlownNoise>(*run.noise);
  }
  std::vector<std::vector<float>> maxima(runs.size());
  Progress progress("calibrate", runs.size());
  parallel_for(runs.size(), [&](std::size_t r) {
    maxima[r] = run_maxima(*plan, flown.at(runs[r].noise)->view, *runs[r].basis, runs[r].run);
    progress.add();
  });
  const std::size_t slots = maxima.front().size();
  const std::vector<std::vector<float>> steps = slots_of(
      maxima, std::min(slots, RIM_MONITOR_KINDS * plan->layout.outcomes() * NOISE_FAMILIES), slots);
  maxima = slots_of(maxima, 0, slots - steps.front().size());
  const std::vector<Tail> tails = tails_of(maxima);
  std::vector<RunScore> scores(runs.size());
  parallel_for(runs.size(), [&](std::size_t r) {
    scores[r] = run_score(maxima[r], all_phi(tails, static_cast<int>(r)));
  });
  std::vector<double> phi = all_phi(tails, -1);
  forgive_unlike_runs(maxima, scores, &phi);
  for (const double of_step : phi_of_steps(steps, scores))
    phi.push_back(of_step);
  for (std::size_t at = 0; at < slots; ++at)
    noise->channels[at / NOISE_FAMILIES].phi[at % NOISE_FAMILIES] = phi[at];
  std::vector<float> alone, together;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    alone.push_back(static_cast<float>(scores[r].score));
    together.push_back(static_cast<float>(run_score(maxima[r], phi).score));
  }
  plan->thresholds = Thresholds{};
  plan->thresholds.offset.assign(noise->channels.size(), 0.0F);
  plan->thresholds.scale.assign(noise->channels.size(), 1.0F);
  const bool few = is_learnt_again(runs.size(), plan->layout.external);
  set_alarm_from_runs(&plan->thresholds, alone, together, options,
                      few ? kMostMarginOfFew : std::numeric_limits<double>::infinity());
  return scores;
}

} // namespace rim
