// SPDX-License-Identifier: MIT
#include "train/external_residuals.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "search/select.h"
#include "monitor/inspect.h"
#include "stats/robust.hpp"

namespace rim {

namespace {

using Series = std::vector<std::vector<double>>; // [log][row]

constexpr double kClip = 4.0;       // robust sd beyond which a residual tells nothing more of noise
constexpr double kScaleNats = 2.0;  // gain from which another scale is believed,
constexpr double kMemoryNats = 4.0; // and from which autocorrelation is
constexpr std::size_t kMostTerms = 4;
constexpr std::size_t kTableBins = 8;
constexpr double kMeanNats = 2.0; // of a mean, beside its size
constexpr double kTermNats = 4.0; // of any other term, beside its sizes and what it chooses from
constexpr double kOffsetSd = 2.0; // offsets this many standard errors wide are believed

double logistic(double x) { return 1.0 / (1.0 + std::exp(-x)); }

// Gain of r = w + v with the best scale, by the Kalman filter of one state.
ResidualNoise weighed(const Series &series, double share, double keeps) {
  double squares = 0.0, ln_det = 0.0, innovations = 0.0, n = 0.0;
  for (const std::vector<double> &log : series) {
    double state = 0.0, variance = share;
    for (const double r : log) {
      const double total = variance + 1.0 - share;
      const double surprise = r - state;
      squares += r * r;
      ln_det += std::log(total);
      innovations += surprise * surprise / total;
      const double weight = variance / total;
      state = keeps * (state + weight * surprise);
      variance = keeps * keeps * (1.0 - weight) * variance + share * (1.0 - keeps * keeps);
    }
    n += static_cast<double>(log.size());
  }
  ResidualNoise noise;
  noise.share = share;
  noise.keeps = keeps;
  noise.scale = std::max(1e-6, innovations / n);
  noise.gain = 0.5 * (squares - ln_det - n * std::log(noise.scale) - n);
  return noise;
}

// From the best of a grid on, by steps that are halved.
ResidualNoise with_memory(const Series &series) {
  double best_share = 0.0, best_keeps = 0.0; // logits
  ResidualNoise best;
  best.gain = -1e300;
  const auto consider = [&](double share, double keeps) {
    const ResidualNoise noise = weighed(series, logistic(share), logistic(keeps));
    if (noise.gain <= best.gain)
      return false;
    best = noise;
    best_share = share;
    best_keeps = keeps;
    return true;
  };
  for (double share = -4.0; share <= 6.0; share += 2.0) {
    for (double keeps = -2.0; keeps <= 5.0; keeps += 1.0)
      (void)consider(share, keeps);
  }
  for (double step = 1.0; step > 0.1; step *= 0.5) {
    const double share = best_share, keeps = best_keeps;
    (void)consider(share + step, keeps);
    (void)consider(share - step, keeps);
    (void)consider(best_share, keeps + step);
    (void)consider(best_share, keeps - step);
  }
  return best;
}

// The residuals of one outcome as the monitor sees them.
Series residuals_of(const std::vector<ExternalRows> &logs, Eigen::Index outcome) {
  Series series;
  for (const ExternalRows &log : logs) {
    std::vector<double> r;
    for (Eigen::Index t = 0; t < log.outcome.rows(); ++t)
      r.push_back((log.outcome(t, outcome) - log.mean(t, outcome)) / log.sd(t, outcome));
    series.push_back(std::move(r));
  }
  return series;
}

void centre(Series *series) {
  for (std::vector<double> &log : *series) {
    const double middle = median(log);
    for (double &r : log)
      r -= middle;
  }
}

void clip(Series *series) {
  std::vector<double> all;
  for (const std::vector<double> &log : *series)
    all.insert(all.end(), log.begin(), log.end());
  const double most = kClip * std::max(1.0, mad_sd(all, 0.0));
  for (std::vector<double> &log : *series) {
    for (double &r : log)
      r = std::clamp(r, -most, most);
  }
}

// The best region of every outcome in one log of residuals, by the flight profile's search.
class RegionSearch {
public:
  RegionSearch(FlightPlan plan, const ExternalRows &log) : plan_(std::move(plan)), log_(log) {
    use_profile(&plan_, true, false);
  }

  // residual: [outcome][row].
  void run(const std::vector<const std::vector<double> *> &residual) {
    monitor_.emplace(make_image(plan_), "residuals");
    const std::vector<double> mean(residual.size(), 0.0), sd(residual.size(), 1.0);
    std::vector<double> z(residual.size());
    for (Eigen::Index t = 0; t < log_.context.rows(); ++t) {
      const auto i = static_cast<std::size_t>(t);
      for (std::size_t o = 0; o < z.size(); ++o)
        z[o] = (*residual[o])[i];
      const rim_observation row = {log_.t_s[i], log_.context.row(t).data(), z.data(), mean.data(),
                                   sd.data()};
      rim_verdict verdict;
      (void)rim_monitor_step(monitor_->get(), &row, &verdict);
    }
  }

  // Takes the outcome's best region out of its residuals. Returns the nats that an alarm needs of
  // it, before its description is paid for.
  double take_out(std::size_t outcome, const Matrix &unit, std::vector<double> *residual) const {
    rim_candidate best{};
    (void)rimi_select_shift_of_channel(rimi_monitor_search(monitor_->get()),
                                      static_cast<std::uint16_t>(outcome), &best);
    std::vector<std::size_t> inside;
    double sum = 0.0;
    for (std::size_t t = 0; t < residual->size(); ++t) {
      if (!rimi_unit_region_contains(&best.region, unit.row(static_cast<Eigen::Index>(t)).data()))
        continue;
      inside.push_back(t);
      sum += (*residual)[t];
    }
    for (const std::size_t t : inside)
      (*residual)[t] -= sum / static_cast<double>(inside.size());
    const double growth = std::max(kLeastGrowth, std::log(static_cast<double>(residual->size())));
    return static_cast<double>(plan_.thresholds.alarm_score) * growth + best.ln_anom - best.score;
  }

private:
  FlightPlan plan_;
  const ExternalRows &log_;
  std::optional<Monitor> monitor_;
};

// ln likelihood of the residuals under their noise, less what the noise must gain to be believed,
// up to a constant.
double ln_likelihood(const Series &series, const ResidualNoise &noise) {
  const double asked = noise.share > 0.0 ? kMemoryNats : noise.gain > 0.0 ? kScaleNats : 0.0;
  double squares = 0.0;
  for (const std::vector<double> &log : series) {
    for (const double r : log)
      squares += r * r;
  }
  return noise.gain - asked - 0.5 * squares;
}

// Unit features, [row][feature].
Matrix unit_contexts(const FlightPlan &plan, const ExternalRows &log) {
  Matrix unit = log.context;
  for (Eigen::Index f = 0; f < unit.cols(); ++f) {
    const auto i = static_cast<std::size_t>(f);
    const double low = static_cast<double>(plan.low[i]);
    unit.col(f) = (unit.col(f).array() - low) / (static_cast<double>(plan.high[i]) - low);
  }
  return unit;
}

struct Explained {
  std::vector<double> fit; // per row
  double squares = 0.0;    // taken off the sum of squares
  double sizes = 0.0;      // numbers in its description
};

// Least squares of a line in one feature.
Explained line_over(const Eigen::VectorXd &u, const std::vector<double> &r) {
  const Eigen::Map<const Eigen::VectorXd> y(r.data(), static_cast<Eigen::Index>(r.size()));
  const double middle = u.mean(), mean = y.mean();
  const Eigen::VectorXd off = u.array() - middle;
  const double spread = off.squaredNorm();
  const double slope = spread > 0.0 ? off.dot(y) / spread : 0.0;
  const Eigen::VectorXd fit = (mean + slope * off.array()).matrix();
  return {{fit.data(), fit.data() + fit.size()}, fit.squaredNorm(), 2.0};
}

// Means over equal bins of one feature.
Explained table_over(const Eigen::VectorXd &u, const std::vector<double> &r) {
  const auto bin = [&u](std::size_t t) {
    const double at = u[static_cast<Eigen::Index>(t)] * static_cast<double>(kTableBins);
    return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(kTableBins) - 1.0));
  };
  double sum[kTableBins] = {}, n[kTableBins] = {};
  for (std::size_t t = 0; t < r.size(); ++t) {
    sum[bin(t)] += r[t];
    n[bin(t)] += 1.0;
  }
  Explained out;
  for (std::size_t k = 0; k < kTableBins; ++k) {
    out.squares += n[k] > 0.0 ? sum[k] * sum[k] / n[k] : 0.0;
    out.sizes += n[k] > 0.0 ? 1.0 : 0.0;
  }
  for (std::size_t t = 0; t < r.size(); ++t)
    out.fit.push_back(sum[bin(t)] / n[bin(t)]);
  return out;
}

// Takes out what the best single feature explains. Returns the nats that this costs.
template <class Over>
double take_out_feature(const Matrix &unit, const Over &over, std::vector<double> *residual) {
  Explained best;
  for (Eigen::Index f = 0; f < unit.cols(); ++f) {
    Explained one = over(unit.col(f), *residual);
    if (one.squares > best.squares)
      best = std::move(one);
  }
  for (std::size_t t = 0; t < best.fit.size(); ++t)
    (*residual)[t] -= best.fit[t];
  return kTermNats + std::log(static_cast<double>(unit.cols())) +
         0.5 * best.sizes * std::log(static_cast<double>(residual->size()));
}

// Takes out the mean. Returns the nats that this costs: there is nothing to choose from.
double take_out_mean(std::vector<double> *residual) {
  const auto rows = static_cast<double>(residual->size());
  const double mean = std::accumulate(residual->begin(), residual->end(), 0.0) / rows;
  for (double &r : *residual)
    r -= mean;
  return kMeanNats + 0.5 * std::log(rows);
}

// Takes out the best shift since some row. Returns the nats that this costs.
double take_out_since(std::vector<double> *residual) {
  const std::size_t rows = residual->size();
  double sum = 0.0, best_sum = 0.0, best_squares = -1.0;
  std::size_t since = 0;
  for (std::size_t t = rows; t-- > 0;) {
    sum += (*residual)[t];
    const double squares = sum * sum / static_cast<double>(rows - t);
    if (squares <= best_squares)
      continue;
    best_squares = squares;
    best_sum = sum;
    since = t;
  }
  for (std::size_t t = since; t < rows; ++t)
    (*residual)[t] -= best_sum / static_cast<double>(rows - since);
  return kTermNats + 1.5 * std::log(static_cast<double>(rows)); // one size, and when
}

double longest(const Series &series) {
  std::size_t rows = 1;
  for (const std::vector<double> &log : series)
    rows = std::max(rows, log.size());
  return static_cast<double>(rows);
}

bool is_white(const ResidualNoise &noise) { return noise.share <= 0.0 && noise.scale <= 1.0; }

// One outcome of one log without the term of whatever kind that explains most, if noise does not
// explain it as well.
bool take_out_term(const RegionSearch &search, const Matrix &unit, std::size_t log,
                   std::size_t outcome, Series *series, ResidualNoise *noise) {
  const std::vector<double> before = (*series)[log];
  constexpr std::size_t kinds = 5;
  std::vector<double> candidate[kinds] = {before, before, before, before, before};
  const double cost[kinds] = {search.take_out(outcome, unit, &candidate[0]),
                              take_out_feature(unit, line_over, &candidate[1]),
                              take_out_feature(unit, table_over, &candidate[2]),
                              take_out_since(&candidate[3]), take_out_mean(&candidate[4])};
  double best = ln_likelihood(*series, *noise);
  ResidualNoise rest = *noise;
  std::size_t chosen = kinds;
  for (std::size_t k = 0; k < kinds; ++k) {
    (*series)[log] = candidate[k];
    const ResidualNoise fitted = fit_noise(*series);
    const double value = ln_likelihood(*series, fitted) - cost[k];
    if (!(value > best))
      continue;
    best = value;
    rest = fitted;
    chosen = k;
  }
  (*series)[log] = chosen < kinds ? candidate[chosen] : before;
  *noise = rest;
  return chosen < kinds;
}

// What contexts explain, from every outcome whose residuals are not white.
void take_out_terms(const FlightPlan &plan, const std::vector<ExternalRows> &logs,
                    std::vector<Series> *series, std::vector<ResidualNoise> *noise) {
  for (std::size_t j = 0; j < logs.size(); ++j) {
    const Matrix unit = unit_contexts(plan, logs[j]);
    RegionSearch search(plan, logs[j]);
    std::vector<bool> done(series->size(), false);
    for (std::size_t k = 0; k < kMostTerms; ++k) {
      for (std::size_t o = 0; o < done.size(); ++o)
        done[o] = done[o] || is_white((*noise)[o]);
      if (std::all_of(done.begin(), done.end(), [](bool x) { return x; }))
        break;
      std::vector<const std::vector<double> *> residual;
      for (const Series &outcome : *series)
        residual.push_back(&outcome[j]);
      search.run(residual);
      for (std::size_t o = 0; o < done.size(); ++o)
        done[o] = done[o] || !take_out_term(search, unit, j, o, &(*series)[o], &(*noise)[o]);
    }
  }
}

// Spread of the logs' own means beyond what their noise explains; robust, since one log may be at
// fault.
double offset_sd_of(const Series &raw, const ResidualNoise &noise) {
  if (raw.size() < kLogsForOffsets)
    return 0.0;
  std::vector<double> means;
  double error = 0.0;
  for (const std::vector<double> &log : raw) {
    means.push_back(median(log)); // of the log: a region in it must not move it far
    const auto n = static_cast<double>(log.size());
    error = std::max(error, 1.5708 * std::max(1.0, noise.inflation(n)) / n); // of a median
  }
  const auto n = static_cast<double>(means.size());
  const double spread = mad_sd(means, median(means)) * n / (n - 0.8);
  // The robust spread of n has a relative standard error of 1.17 / sqrt n.
  const double chance = std::sqrt(error) * (1.0 + kOffsetSd * 1.17 / std::sqrt(n));
  return spread > chance ? std::sqrt(spread * spread - error) : 0.0;
}

std::string listed(const std::vector<std::string> &parts) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return text;
}

} // namespace

double ResidualNoise::inflation(double rows) const {
  if (keeps <= 0.0 || share <= 0.0)
    return scale;
  const double rest = 1.0 - keeps;
  const double ends = 2.0 * keeps * (1.0 - std::pow(keeps, rows)) / (rows * rest * rest);
  return scale * (1.0 - share + share * ((1.0 + keeps) / rest - ends));
}

ResidualNoise fit_noise(const std::vector<std::vector<double>> &series) {
  ResidualNoise scaled = weighed(series, 0.0, 0.0);
  if (scaled.gain < kScaleNats)
    scaled = ResidualNoise{};
  const ResidualNoise memory = with_memory(series);
  return memory.gain - scaled.gain > kMemoryNats ? memory : scaled;
}

std::vector<ResidualTest> test_residuals(const FlightPlan &plan,
                                         const std::vector<ExternalRows> &logs) {
  std::vector<Series> raw, series;
  std::vector<ResidualNoise> noise;
  for (std::size_t o = 0; o < plan.layout.outcomes(); ++o) {
    raw.push_back(residuals_of(logs, static_cast<Eigen::Index>(o)));
    series.push_back(raw.back());
    if (logs.size() >= kLogsForOffsets) // offsets are told apart from regions afterwards
      centre(&series.back());
    clip(&series.back());
    noise.push_back(fit_noise(series.back()));
  }
  take_out_terms(plan, logs, &series, &noise);
  std::vector<ResidualTest> tests(noise.size());
  for (std::size_t o = 0; o < tests.size(); ++o) {
    ResidualTest &test = tests[o];
    test.noise = noise[o];
    test.offset_sd = offset_sd_of(raw[o], noise[o]);
    const double rows = longest(raw[o]);
    test.inflation =
        std::max(1.0, noise[o].inflation(rows)) + rows * test.offset_sd * test.offset_sd;
  }
  return tests;
}

std::string residuals_sentence(const std::vector<ResidualTest> &tests,
                               const std::vector<std::string> &outcomes, std::size_t logs) {
  std::vector<std::string> found;
  for (std::size_t o = 0; o < tests.size(); ++o) {
    const ResidualTest &test = tests[o];
    if (!(test.inflation > 1.0))
      continue;
    std::vector<std::string> why;
    if (test.noise.share > 0.0)
      why.push_back(
          fmt::format("are correlated in time ({:.2f} from row to row)", test.noise.lag_one()));
    if (test.noise.scale > (test.noise.share > 0.0 ? 1.1 : 1.0)) // fitted along, it is never 1
      why.push_back(fmt::format("scatter {:.2f} times the stated sd", std::sqrt(test.noise.scale)));
    if (test.offset_sd > 0.0)
      why.push_back(
          fmt::format("have an offset of their own in every log ({:.2g} sd)", test.offset_sd));
    found.push_back(fmt::format("those of '{}' {}, so {:.1f} times the evidence is asked of them",
                                outcomes[o], listed(why), test.inflation));
  }
  const char *tested = logs >= kLogsForOffsets
                           ? "residuals were tested for scale, autocorrelation and offsets of a log"
                           : "residuals were tested for scale and autocorrelation";
  if (found.empty())
    return fmt::format("{}, and taken as independent", tested);
  std::string text = fmt::format("{}: ", tested);
  for (std::size_t i = 0; i < found.size(); ++i)
    text += (i == 0 ? "" : "; ") + found[i];
  return text;
}

} // namespace rim
