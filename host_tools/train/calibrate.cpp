#include "train/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "rim/rng.h"
#include "train/nominal_spread.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim {

Promise promise_for(std::size_t runs, double false_alarm) {
  const double n = static_cast<double>(runs);
  const double wished = std::ceil((n + 1.0) * (1.0 - false_alarm) - 1e-9);
  Promise promise;
  promise.rank = static_cast<std::uint32_t>(std::clamp(wished, 1.0, n));
  promise.rate = (n + 1.0 - promise.rank) / (n + 1.0);
  return promise;
}

namespace {

constexpr double kClip = RIM_CHANNELS_VALUE_CLIP;
// Weight of the excess that all channels of a kind show, in runs, against the channel's own.
constexpr double kPrior = 20.0;

std::vector<double> ranks(const Eigen::VectorXd &x) {
  std::vector<std::size_t> order(static_cast<std::size_t>(x.size()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&x](std::size_t a, std::size_t b) {
    return x[static_cast<Eigen::Index>(a)] < x[static_cast<Eigen::Index>(b)];
  });
  std::vector<double> rank(order.size());
  for (std::size_t i = 0; i < order.size();) { // ties share the mean of their ranks
    std::size_t j = i;
    while (j < order.size() &&
           !(x[static_cast<Eigen::Index>(order[j])] > x[static_cast<Eigen::Index>(order[i])])) {
      ++j;
    }
    for (std::size_t k = i; k < j; ++k)
      rank[order[k]] = 0.5 * static_cast<double>(i + j - 1);
    i = j;
  }
  return rank;
}

double correlation(const std::vector<double> &a, const std::vector<double> &b) {
  const double n = static_cast<double>(a.size());
  const double ma = std::accumulate(a.begin(), a.end(), 0.0) / n;
  const double mb = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0.0, aa = 0.0, bb = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

std::vector<double> column(const Matrix &values, Eigen::Index c) {
  const Eigen::VectorXd copy = values.col(c);
  return {copy.data(), copy.data() + copy.size()};
}

Matrix all_contexts(const std::vector<ChannelSeries> &series) {
  Eigen::Index rows = 0;
  for (const ChannelSeries &s : series)
    rows += s.context.rows();
  Matrix all(rows, series.front().context.cols());
  Eigen::Index at = 0;
  for (const ChannelSeries &s : series) {
    all.middleRows(at, s.context.rows()) = s.context;
    at += s.context.rows();
  }
  return all;
}

// From the least to the largest value and a little beyond, so that a new run's edges fit in.
void set_ranges(FlightPlan *plan, const Matrix &context) {
  plan->low.clear();
  plan->high.clear();
  for (Eigen::Index f = 0; f < context.cols(); ++f) {
    const double low = context.col(f).minCoeff();
    const double high = context.col(f).maxCoeff();
    const double margin = std::max({0.02 * (high - low), 1e-6 * std::abs(low), 1e-9});
    plan->low.push_back(static_cast<float>(low - margin));
    plan->high.push_back(static_cast<float>(high + margin));
  }
}

void set_channel_scales(FlightPlan *plan, const std::vector<ChannelSeries> &series) {
  const Eigen::Index channels = series.front().raw.cols();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(channels);
  Eigen::VectorXd squares = sum;
  double n = 0.0;
  for (const ChannelSeries &s : series) {
    sum += s.raw.colwise().sum().transpose();
    n += static_cast<double>(s.raw.rows());
  }
  const Eigen::VectorXd mean = sum / n;
  for (const ChannelSeries &s : series) {
    squares +=
        (s.raw.rowwise() - mean.transpose()).array().square().colwise().sum().matrix().transpose();
  }
  plan->center.clear();
  plan->inverse_sd.clear();
  for (Eigen::Index c = 0; c < channels; ++c) {
    plan->center.push_back(static_cast<float>(mean[c]));
    plan->inverse_sd.push_back(static_cast<float>(1.0 / std::max(0.01, std::sqrt(squares[c] / n))));
  }
}

double unit_of(const FlightPlan &plan, std::size_t feature, double value) {
  const double low = static_cast<double>(plan.low[feature]);
  return (value - low) / (static_cast<double>(plan.high[feature]) - low);
}

BinnedRun binned(const FlightPlan &plan, const ChannelSeries &series) {
  BinnedRun run;
  const auto blocks = static_cast<std::size_t>(series.raw.rows());
  run.bin.resize(blocks * plan.region.size());
  for (std::size_t t = 0; t < blocks; ++t) {
    for (std::size_t i = 0; i < plan.region.size(); ++i) {
      const double u = unit_of(plan, plan.region[i],
                               series.context(static_cast<Eigen::Index>(t), plan.region[i]));
      // As the search does: cells of 256, then bins of those.
      const double cell = std::clamp(std::floor(u * 256.0), 0.0, 255.0);
      run.bin[t * plan.region.size() + i] =
          static_cast<std::uint8_t>((static_cast<unsigned>(cell) * plan.bins) >> 8);
    }
  }
  run.value.resize(series.raw.rows(), series.raw.cols());
  for (Eigen::Index c = 0; c < series.raw.cols(); ++c) {
    const auto i = static_cast<std::size_t>(c);
    run.value.col(c) = ((series.raw.col(c).array() - static_cast<double>(plan.center[i])) *
                        static_cast<double>(plan.inverse_sd[i]))
                           .max(-kClip)
                           .min(kClip);
  }
  return run;
}

// Two readings for channels that count readings; other channels change continuously.
std::vector<double> quanta(const FlightPlan &plan) {
  std::vector<double> quantum(plan.channels(), 0.0);
  std::size_t kind = 0;
  for (unsigned k = 0; k < RIM_CHANNELS_KINDS; ++k) {
    if ((plan.kinds >> k & 1u) == 0)
      continue;
    for (std::size_t o = 0; k == RIM_KIND_REPEAT && o < plan.layout.outcomes(); ++o) {
      const std::size_t c = kind * plan.layout.outcomes() + o;
      quantum[c] = 2.0 / plan.block_rows * static_cast<double>(plan.inverse_sd[c]);
    }
    ++kind;
  }
  return quantum;
}

// Thresholds that never alarm: what a run shows, before anything is known of others.
Thresholds open_thresholds(std::size_t channels) {
  Thresholds t;
  t.offset.assign(channels, 0.0F);
  t.scale.assign(channels, 1.0F);
  return t;
}

// Largest ln anom that each channel reaches in one run, by the flight code.
std::vector<double> run_maxima(const FlightPlan &plan, const ChannelSeries &series,
                               const BinnedRun &run) {
  Monitor monitor(make_image(plan), "calibration");
  std::vector<double> maxima(static_cast<std::size_t>(run.value.cols()), 0.0);
  for (Eigen::Index t = 0; t < run.value.rows(); ++t) {
    rim_verdict verdict;
    (void)rim_monitor_block(monitor.get(), series.start_s[static_cast<std::size_t>(t)],
                            series.context.row(t).data(), run.value.row(t).data(), plan.block_rows,
                            &verdict);
    const float *scores = rim_select_channel_scores(rim_monitor_search(monitor.get()));
    for (std::size_t c = 0; c < maxima.size(); ++c) {
      maxima[c] = std::max(maxima[c], static_cast<double>(scores[c]));
    }
  }
  return maxima;
}

// Offset: what half of the runs exceed. Scale: mean excess over it, drawn towards that of all
// channels of the same kind, never below 1 (the tail of a Gaussian likelihood ratio).
void put_on_one_scale(Thresholds *t, const std::vector<std::vector<double>> &maxima, int left_out,
                      std::size_t outcomes) {
  const std::size_t channels = maxima.front().size();
  std::vector<double> excess(channels), offset(channels);
  std::vector<double> above(channels);
  for (std::size_t c = 0; c < channels; ++c) {
    std::vector<double> values;
    for (std::size_t r = 0; r < maxima.size(); ++r) {
      if (static_cast<int>(r) != left_out)
        values.push_back(maxima[r][c]);
    }
    std::sort(values.begin(), values.end());
    offset[c] = values[values.size() / 2];
    for (const double v : values) {
      if (v <= offset[c])
        continue;
      excess[c] += v - offset[c];
      above[c] += 1.0;
    }
  }
  t->offset.assign(channels, 0.0F);
  t->scale.assign(channels, 1.0F);
  for (std::size_t first = 0; first < channels; first += outcomes) {
    double kind_excess = 0.0, kind_above = 0.0;
    for (std::size_t c = first; c < first + outcomes; ++c) {
      kind_excess += excess[c];
      kind_above += above[c];
    }
    const double pooled = kind_excess / std::max(1.0, kind_above);
    for (std::size_t c = first; c < first + outcomes; ++c) {
      t->offset[c] = static_cast<float>(offset[c]);
      t->scale[c] =
          static_cast<float>(std::max(1.0, (excess[c] + kPrior * pooled) / (above[c] + kPrior)));
    }
  }
}

} // namespace

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

std::vector<std::uint16_t> choose_region_features(const std::vector<ChannelSeries> &series,
                                                  const CalibrationOptions &options) {
  const Matrix context = all_contexts(series);
  std::vector<std::vector<double>> chosen_ranks, chosen_values;
  std::vector<std::uint16_t> chosen;
  std::vector<const Matrix *> contexts;
  for (const ChannelSeries &s : series)
    contexts.push_back(&s.context);
  const std::vector<double> tells_phase = phase_weights(contexts);
  for (Eigen::Index f = 0; f < context.cols() && chosen.size() < options.region_features; ++f) {
    if (!(tells_phase[static_cast<std::size_t>(f)] > 0.0))
      continue;
    const std::vector<double> rank = ranks(context.col(f));
    const std::vector<double> value = column(context, f);
    bool repeats = false;
    for (std::size_t i = 0; i < chosen.size() && !repeats; ++i) {
      repeats = std::abs(correlation(rank, chosen_ranks[i])) >= options.redundant ||
                std::abs(correlation(value, chosen_values[i])) >= options.redundant;
    }
    if (repeats)
      continue;
    chosen.push_back(static_cast<std::uint16_t>(f));
    chosen_ranks.push_back(rank);
    chosen_values.push_back(value);
  }
  return chosen;
}

void calibrate_trained(FlightPlan *plan, const std::vector<ChannelSeries> &series,
                       const CalibrationOptions &options) {
  const std::size_t runs = series.size();
  if (runs < 3)
    throw DataError("calibration needs at least 3 nominal runs");
  set_ranges(plan, all_contexts(series));
  plan->region = choose_region_features(series, options);
  set_channel_scales(plan, series);
  std::vector<BinnedRun> run(runs);
  parallel_for(runs, [&](std::size_t r) { run[r] = binned(*plan, series[r]); });
  const NominalSpread spread(run, plan->region.size(), plan->bins, options.least_n, quanta(*plan));

  std::vector<std::vector<double>> maxima(runs);
  Progress progress("calibrate", runs);
  parallel_for(runs, [&](std::size_t r) {
    FlightPlan one = *plan;
    one.envelope = spread.section(static_cast<int>(r));
    one.thresholds = open_thresholds(plan->channels());
    maxima[r] = run_maxima(one, series[r], run[r]);
    progress.add();
  });

  std::vector<float> largest(runs);
  for (std::size_t r = 0; r < runs; ++r) {
    Thresholds others;
    put_on_one_scale(&others, maxima, static_cast<int>(r), plan->layout.outcomes());
    float best = -1e30F;
    for (std::size_t c = 0; c < maxima[r].size(); ++c) {
      best =
          std::max(best, (static_cast<float>(maxima[r][c]) - others.offset[c]) / others.scale[c]);
    }
    largest[r] = best;
  }
  plan->envelope = spread.section(-1);
  put_on_one_scale(&plan->thresholds, maxima, -1, plan->layout.outcomes());
  set_alarm(&plan->thresholds, std::move(largest), options);
}

} // namespace rim
