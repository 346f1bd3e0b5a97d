// SPDX-License-Identifier: MIT
#include "diagnose/flagged.hpp"

#include <algorithm>
#include <cmath>

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kLeastNats = 5.0; // beyond ln of the number of rows
constexpr double kMostChance = 0.98;
constexpr double kSmall = 0.1;           // of the readings' root mean square
constexpr double kMoreThanRounded = 3.0; // times as many zeros as by rounding
constexpr double kCoarse = 0.5;          // sd: a step that is no smaller shows in what is read
constexpr double kBesideStep = 3.0;      // sd: by how much noise takes a reading over a step's ends

// Natural share of equal neighbours. Only isolated repeats count, so that a stuck stretch cannot
// raise the share by which it is judged.
double natural_repeats(const Measured &measured, const Vector &z) {
  double single = 0.0, pairs = 1.0;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i + 2 < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      pairs += 1.0;
      const bool alone = i == log.first || z(k - 1) != z(k);
      single += z(k) == z(k + 1) && alone && z(k + 2) != z(k + 1);
    }
  }
  return single / pairs;
}

// Share of the readings that are zero by rounding: as many as are one step beside it.
double natural_zeros(const Vector &z, double step) {
  const auto beside = (z.array().abs() > 0.0 && z.array().abs() < 1.5 * step).cast<double>();
  return 0.5 * beside.mean();
}

const Channel &of_whole(const Measured &measured, const Channel &channel) {
  return measured.whole
      ->channels[static_cast<std::size_t>(measured.whole->find_channel(channel.name))];
}

// Of the rows of a thinned table.
Flagged picked(const Flagged &whole, const Measured &measured) {
  Flagged out;
  out.stuck_ln = whole.stuck_ln;
  out.dropout_ln = whole.dropout_ln;
  for (const Index row : measured.picked) {
    const auto i = static_cast<std::size_t>(row);
    out.stuck.push_back(whole.stuck[i]);
    out.dropout.push_back(whole.dropout[i]);
    out.stuck_rows += whole.stuck[i];
    out.dropout_rows += whole.dropout[i];
  }
  return out;
}

// Whether nothing but a little motion is predicted in these rows: friction may hold what stands.
bool is_held(const Channel &channel, std::size_t first, std::size_t end) {
  const double rms = std::sqrt(channel.z.squaredNorm() / static_cast<double>(channel.z.size()));
  return channel.m.segment(static_cast<Index>(first), static_cast<Index>(end - first))
             .cwiseAbs()
             .maxCoeff() < kSmall * rms;
}

// Whether so little is predicted to change that a coarse reading may well stay: by no more than its
// step, and the noise at both ends of it. Noise that lasts holds a reading for many rows.
bool is_within_step(const Channel &channel, double step, std::size_t first, std::size_t end) {
  const auto at = static_cast<Index>(first), rows = static_cast<Index>(end - first);
  const double sd = channel.sd.segment(at, rows).mean();
  const auto m = channel.m.segment(at, rows);
  return step > kCoarse * sd && m.maxCoeff() - m.minCoeff() < step + kBesideStep * sd;
}

// Zeros of a vehicle that stands: about zero is predicted somewhere among them, or the log begins
// with them, or the readings before and after them are small already.
std::vector<std::uint8_t> zeros_at_rest(const Measured &measured, const Channel &channel) {
  std::vector<std::uint8_t> rest(measured.rows(), 0);
  const double small =
      kSmall * std::sqrt(channel.z.squaredNorm() / static_cast<double>(channel.z.size()));
  for (const LogSpan &log : measured.logs) {
    const std::size_t last = log.first + log.rows;
    for (std::size_t i = log.first; i < last;) {
      std::size_t end = i;
      bool stands = i == log.first;
      for (; end < last && channel.z(static_cast<Index>(end)) == 0.0; ++end)
        stands = stands || std::abs(channel.m(static_cast<Index>(end))) <
                               0.05 * channel.sd(static_cast<Index>(end));
      if (end == i) {
        ++i;
        continue;
      }
      stands = stands || (std::abs(channel.z(static_cast<Index>(i) - 1)) < small &&
                          (end == last || std::abs(channel.z(static_cast<Index>(end))) < small));
      std::fill(rest.begin() + static_cast<std::ptrdiff_t>(i),
                rest.begin() + static_cast<std::ptrdiff_t>(end), stands ? 1 : 0);
      i = end;
    }
  }
  return rest;
}

} // namespace

double resolution(const Vector &z) {
  std::vector<double> values(z.data(), z.data() + z.size());
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  if (values.size() < 2)
    return 0.0;
  std::vector<double> gaps;
  for (std::size_t i = 1; i < values.size(); ++i)
    gaps.push_back(values[i] - values[i - 1]);
  const bool is_quantised = 3 * values.size() < static_cast<std::size_t>(z.size());
  const auto at =
      gaps.begin() + static_cast<std::ptrdiff_t>(is_quantised ? gaps.size() / 2 : gaps.size() / 10);
  std::nth_element(gaps.begin(), at, gaps.end());
  return *at;
}

bool is_of_one_step(const Channel &channel, const Vector &inside) {
  double least = 1e300, most = -1e300, sd = 0.0;
  for (Index i = 0; i < inside.size(); ++i) {
    if (inside(i) <= 0.0)
      continue;
    least = std::min(least, channel.m(i));
    most = std::max(most, channel.m(i));
    sd = std::max(sd, channel.sd(i));
  }
  const double step = resolution(channel.z);
  return step > kCoarse * sd && most - least < step;
}

Flagged find_flagged(const Measured &measured, const Channel &channel) {
  if (measured.whole != nullptr)
    return picked(find_flagged(*measured.whole, of_whole(measured, channel)), measured);
  Flagged out;
  const std::size_t n = measured.rows();
  out.stuck.assign(n, 0);
  out.dropout.assign(n, 0);
  const double step = resolution(channel.z);
  const double natural = natural_repeats(measured, channel.z);
  const auto chance = [&](Index i, double value, double floor) {
    const double sd = channel.sd(i), r = (value - channel.m(i)) / sd;
    const double p = step / (2.5066 * sd) * std::exp(-0.5 * std::min(100.0, r * r));
    return std::clamp(std::max(p, floor), 1e-12, kMostChance);
  };
  const std::vector<std::uint8_t> rest = zeros_at_rest(measured, channel);
  const auto is_at_rest = [&rest](Index i) { return rest[static_cast<std::size_t>(i)] != 0; };
  const double ln_rows = std::log(static_cast<double>(n));
  const double rounded = natural_zeros(channel.z, step);
  double zeros_ln = 0.0;
  std::size_t zeros = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (channel.z(static_cast<Index>(i)) == 0.0 && !is_at_rest(static_cast<Index>(i))) {
      zeros_ln -= std::log(chance(static_cast<Index>(i), 0.0, rounded));
      ++zeros;
    }
  }
  const bool is_dropout =
      zeros >= 3 && zeros < n / 2 &&
      static_cast<double>(zeros) > kMoreThanRounded * rounded * static_cast<double>(n) &&
      zeros_ln > static_cast<double>(zeros) * 3.0 + ln_rows + kLeastNats;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i < log.first + log.rows;) {
      std::size_t end = i + 1;
      double nats = 0.0;
      const double value = channel.z(static_cast<Index>(i));
      while (end < log.first + log.rows && channel.z(static_cast<Index>(end)) == value) {
        // Only a reading that should have changed says something by staying.
        if (channel.m(static_cast<Index>(end)) != channel.m(static_cast<Index>(end) - 1))
          nats -= std::log(chance(static_cast<Index>(end), value, natural));
        ++end;
      }
      if (is_dropout && value == 0.0 && !is_at_rest(static_cast<Index>(i))) {
        std::fill(out.dropout.begin() + static_cast<std::ptrdiff_t>(i),
                  out.dropout.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{1});
        out.dropout_rows += end - i;
      } else if (end - i >= 3 && nats > ln_rows + kLeastNats &&
                 !is_within_step(channel, step, i, end) &&
                 !(value == 0.0 && is_at_rest(static_cast<Index>(i)) && is_held(channel, i, end))) {
        std::fill(out.stuck.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                  out.stuck.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{1});
        out.stuck_rows += end - i - 1;
        out.stuck_ln += nats - ln_rows;
      }
      i = end;
    }
  }
  out.dropout_ln = is_dropout ? zeros_ln - ln_rows : 0.0;
  return out;
}

} // namespace rim::diagnose
