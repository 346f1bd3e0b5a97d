// SPDX-License-Identifier: MIT
#include "diagnose/gain.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "diagnose/flagged.hpp"
#include "stats/bootstrap.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr std::size_t kUnitsPerLog = 20; // blocks of a log, where logs are few
constexpr std::size_t kLogsEnough = 6;   // from here on whole logs are resampled
constexpr std::size_t kDraws = 400;

std::size_t unit_of(const Measured &measured, std::size_t log, std::size_t row_in_log) {
  return measured.logs.size() >= kLogsEnough
             ? log
             : log * kUnitsPerLog + row_in_log * kUnitsPerLog / measured.logs[log].rows;
}

struct Sums {
  double n = 0, before = 0, after = 0, nll_before = 0, nll_after = 0, mpa_before = 0, mpa_after = 0;
  void add(const Sums &o) {
    n += o.n;
    before += o.before;
    after += o.after;
    nll_before += o.nll_before;
    nll_after += o.nll_after;
    mpa_before += o.mpa_before;
    mpa_after += o.mpa_after;
  }
  double ratio() const { return before > 0.0 ? std::sqrt(after / before) : 1.0; }
};

double density(double z, double m, double sd) {
  const double r = (z - m) / sd;
  return std::exp(-0.5 * r * r) / (2.5066282746310002 * sd);
}

double nll(double z, double m, double sd) {
  const double r = (z - m) / sd;
  return 0.5 * r * r + std::log(2.5066282746310002 * sd);
}

} // namespace

std::vector<std::uint8_t> acting(const std::vector<Term> &terms, const Measured &measured,
                                 const Channel &channel) {
  std::vector<std::uint8_t> out(measured.rows(), 0);
  for (const Term &term : terms) {
    if (term.channel != channel.name)
      continue;
    const Vector size = term.kind == TermKind::variance
                            ? gate_mask(term.gate, measured)
                            : effect_beside(term, terms, channel, measured)
                                  .cwiseAbs()
                                  .cwiseQuotient(channel.sd)
                                  .eval();
    for (std::size_t i = 0; i < out.size(); ++i)
      if (size(static_cast<Index>(i)) > kActs)
        out[i] = 1;
  }
  return out;
}

namespace {

std::size_t next_unit(const Judged &judged) {
  return judged.unit.empty() ? 0 : 1 + *std::max_element(judged.unit.begin(), judged.unit.end());
}

} // namespace

void append_judged(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                   Judged *judged) {
  const Channel &c = measured.channels[channel];
  const Prediction after = extended_prediction(terms, c, measured);
  const std::vector<std::uint8_t> inside = acting(terms, measured, c);
  const Flagged flagged = find_flagged(measured, c);
  const std::size_t base = next_unit(*judged);
  for (std::size_t log = 0; log < measured.logs.size(); ++log) {
    for (std::size_t r = 0; r < measured.logs[log].rows; ++r) {
      const std::size_t i = measured.logs[log].first + r;
      const auto k = static_cast<Index>(i);
      judged->flagged.push_back(flagged.stuck[i] != 0 || flagged.dropout[i] != 0 ? 1 : 0);
      judged->z.push_back(c.z(k));
      judged->before.push_back(c.m(k));
      judged->after.push_back(after.m(k));
      judged->sd_before.push_back(c.sd(k));
      judged->sd_after.push_back(after.sd(k));
      judged->inside.push_back(inside[i]);
      judged->unit.push_back(base + unit_of(measured, log, r));
    }
  }
}

void append_means(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                  double horizon_s, Judged *judged) {
  const Channel &c = measured.channels[channel];
  const Prediction after = extended_prediction(terms, c, measured);
  const std::vector<std::uint8_t> inside = acting(terms, measured, c);
  const Flagged flagged = find_flagged(measured, c);
  const std::size_t base = next_unit(*judged);
  for (std::size_t log = 0; log < measured.logs.size(); ++log) {
    const LogSpan &span = measured.logs[log];
    for (std::size_t r = 0; r < span.rows;) {
      const double until = measured.elapsed_s[span.first + r] + horizon_s - 1e-9;
      double z = 0, before = 0, extended = 0, var_before = 0, var_after = 0, n = 0, in = 0;
      const std::size_t start = r;
      for (; r < span.rows && measured.elapsed_s[span.first + r] < until; ++r) {
        const std::size_t i = span.first + r;
        const auto k = static_cast<Index>(i);
        if (flagged.stuck[i] != 0 || flagged.dropout[i] != 0)
          continue;
        n += 1.0;
        z += c.z(k);
        before += c.m(k);
        extended += after.m(k);
        var_before += c.sd(k) * c.sd(k);
        var_after += after.sd(k) * after.sd(k);
        in += inside[i] != 0 ? 1.0 : 0.0;
      }
      if (n < 1.0)
        continue;
      judged->flagged.push_back(0);
      judged->z.push_back(z / n);
      judged->before.push_back(before / n);
      judged->after.push_back(extended / n);
      judged->sd_before.push_back(std::sqrt(var_before) / n);
      judged->sd_after.push_back(std::sqrt(var_after) / n);
      judged->inside.push_back(2.0 * in > n ? 1 : 0);
      judged->unit.push_back(base + unit_of(measured, log, start));
    }
  }
}

namespace {

// where: 0 all rows that are measurements, 1 those inside, 2 those outside, 3 the others too.
std::vector<Sums> sums_by_unit(const Judged &judged, int where, std::size_t units) {
  std::vector<Sums> sums(units);
  for (std::size_t i = 0; i < judged.z.size(); ++i) {
    const bool is_flagged = i < judged.flagged.size() && judged.flagged[i] != 0;
    if ((where == 1 && judged.inside[i] == 0) || (where == 2 && judged.inside[i] != 0) ||
        (where != 3 && is_flagged))
      continue;
    Sums one;
    one.n = 1.0;
    one.before = std::pow(judged.z[i] - judged.before[i], 2);
    one.after = std::pow(judged.z[i] - judged.after[i], 2);
    one.nll_before = nll(judged.z[i], judged.before[i], judged.sd_before[i]);
    one.nll_after = nll(judged.z[i], judged.after[i], judged.sd_after[i]);
    one.mpa_before = density(judged.z[i], judged.before[i], judged.sd_before[i]);
    one.mpa_after = density(judged.z[i], judged.after[i], judged.sd_after[i]);
    sums[judged.unit[i]].add(one);
  }
  return sums;
}

} // namespace

std::vector<Gain> summarise(const Judged &judged, const Channel &channel, double horizon_s,
                            const std::string &data, std::uint64_t seed) {
  std::vector<Gain> out;
  if (judged.z.empty())
    return out;
  const std::size_t units = 1 + *std::max_element(judged.unit.begin(), judged.unit.end());
  const bool any_inside = std::any_of(judged.inside.begin(), judged.inside.end(),
                                      [](std::uint8_t i) { return i != 0; });
  const bool any_flagged = std::any_of(judged.flagged.begin(), judged.flagged.end(),
                                       [](std::uint8_t f) { return f != 0; });
  const char *const wheres[] = {"all", "inside", "outside", "with flagged"};
  for (int where = 0; where < 4; ++where) {
    if ((where == 3 && !any_flagged) || (where % 3 != 0 && !any_inside))
      continue;
    const std::vector<Sums> sums = sums_by_unit(judged, where, units);
    std::vector<Sums> used;
    Sums all;
    for (const Sums &s : sums) {
      if (s.n > 0.0) {
        used.push_back(s);
        all.add(s);
      }
    }
    if (used.empty())
      continue;
    Gain gain;
    gain.channel = channel.name;
    gain.unit = channel.unit;
    gain.where = wheres[where];
    gain.horizon_s = horizon_s;
    gain.data = data;
    gain.rows = static_cast<std::size_t>(all.n);
    gain.rmse_before = std::sqrt(all.before / all.n);
    gain.rmse_after = std::sqrt(all.after / all.n);
    gain.nll_before = all.nll_before / all.n;
    gain.nll_after = all.nll_after / all.n;
    gain.mpa_before = all.mpa_before / all.n;
    gain.mpa_after = all.mpa_after / all.n;
    gain.ratio = all.ratio();
    const auto interval = [&](const std::function<double(const Sums &)> &statistic) {
      const Bootstrapped drawn = bootstrap(used.size(),
                                           [&](const std::vector<std::size_t> &pick) {
                                             Sums sum;
                                             for (const std::size_t k : pick)
                                               sum.add(used[k]);
                                             return statistic(sum);
                                           },
                                           {kDraws, seed, 77});
      return Interval95{drawn.low, drawn.high};
    };
    gain.ratio_ci95 = interval([](const Sums &sum) { return sum.ratio(); });
    gain.nll_gain_ci95 =
        interval([](const Sums &sum) { return (sum.nll_before - sum.nll_after) / sum.n; });
    gain.worse = gain.ratio > 1.02 || (gain.ratio > 1.005 && gain.ratio_ci95.low > 1.0);
    out.push_back(gain);
  }
  return out;
}

} // namespace rim::diagnose
