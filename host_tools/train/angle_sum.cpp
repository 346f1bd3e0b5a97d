// SPDX-License-Identifier: MIT
#include "train/angle_sum.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

extern "C" {
#include "monitor/blocks.h"
}

namespace rim {

namespace {

using Phasors = Eigen::ArrayXcd; // exp(i angle) of every block

constexpr double kLeastResultant = 0.82; // exp(-(2 pi / 10)^2 / 2): a tenth of a turn
constexpr double kSecondWins = 0.1;      // of what remains: a second angle is worth as much

Phasors phasors_of(const RunStore &runs, std::size_t run, Eigen::Index outcome, double turn) {
  const Eigen::ArrayXd angle = runs[run].outcome.col(outcome).array() * (2.0 * M_PI / turn);
  return angle.cos().cast<std::complex<double>>() +
         std::complex<double>(0.0, 1.0) * angle.sin().cast<std::complex<double>>();
}

// Of the runs that teach, one behind the other.
Phasors phasors_of(const RunStore &runs, Eigen::Index outcome, double turn) {
  Eigen::Index blocks = 0, at = 0;
  for (std::size_t r = 0; r < runs.size(); ++r)
    blocks += runs[r].blocks();
  Phasors all(blocks);
  for (std::size_t r = 0; r < runs.size(); at += runs[r].blocks(), ++r)
    all.segment(at, runs[r].blocks()) = phasors_of(runs, r, outcome, turn);
  return all;
}

Phasors times(const Phasors &angle, double weight) {
  return weight > 0.0 ? angle : angle.conjugate();
}

// The mean resultant length: 1 where all angles are the same, 0 where they lie anywhere.
double resultant(const Phasors &angle) { return std::abs(angle.mean()); }

// Circular variance of noise of that resultant length.
double variance(double resultant) { return -2.0 * std::log(std::max(resultant, 1e-300)); }

struct Others {
  std::array<Eigen::Index, 2> outcome{-1, -1};
  std::array<double, 2> weight{};
  double resultant = 0.0;
};

std::vector<Eigen::Index> others_of(const Layout &layout, Eigen::Index outcome,
                                    std::optional<Eigen::Index> without) {
  const auto role = [&](Eigen::Index o) {
    return role_of_outcome(layout, static_cast<std::size_t>(o));
  };
  std::vector<Eigen::Index> others;
  for (Eigen::Index k = 0; k < static_cast<Eigen::Index>(layout.outcomes()); ++k) {
    if (k != outcome && k != without &&
        rimi_blocks_turn(role(k)) == rimi_blocks_turn(role(outcome)))
      others.push_back(k);
  }
  return others;
}

// The best one or two of the others, whose phasors these are.
Others choose(const Phasors &own, const std::vector<Phasors> &phasors) {
  Others one, two;
  for (std::size_t k = 0; k < phasors.size(); ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Phasors rest = own * times(phasors[k], -sign);
      const auto first = static_cast<Eigen::Index>(k);
      if (const double r = resultant(rest); r > one.resultant)
        one = {{first, -1}, {sign, 0.0}, r};
      for (std::size_t l = 0; l < k; ++l) {
        for (const double other : {1.0, -1.0}) {
          const double r = resultant(rest * times(phasors[l], -other));
          if (r > two.resultant)
            two = {{first, static_cast<Eigen::Index>(l)}, {sign, other}, r};
        }
      }
    }
  }
  const bool is_worth = variance(two.resultant) < (1.0 - kSecondWins) * variance(one.resultant);
  return is_worth ? two : one;
}

} // namespace

Eigen::VectorXd wrapped(Eigen::VectorXd x, std::uint8_t role) {
  if (rimi_blocks_turn(role) > 0.0)
    x = x.unaryExpr([role](double v) { return rimi_blocks_wrapped(v, role); });
  return x;
}

std::optional<AngleSum> angle_sum(const Layout &layout, const RunStore &runs, Eigen::Index outcome,
                                  std::optional<Eigen::Index> without) {
  const std::vector<Eigen::Index> others = others_of(layout, outcome, without);
  const double turn = rimi_blocks_turn(role_of_outcome(layout, static_cast<std::size_t>(outcome)));
  std::vector<Phasors> phasors;
  for (const Eigen::Index k : others)
    phasors.push_back(phasors_of(runs, k, turn));
  const Others best = choose(phasors_of(runs, outcome, turn), phasors);
  if (best.resultant < kLeastResultant)
    return std::nullopt;
  AngleSum sum;
  sum.weight = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(layout.outcomes()));
  for (std::size_t i = 0; i < best.outcome.size() && best.outcome[i] >= 0; ++i)
    sum.weight[others[static_cast<std::size_t>(best.outcome[i])]] = best.weight[i];
  std::array<std::complex<double>, kFolds + 1> mean{};
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const Eigen::ArrayXd rest = runs[r].outcome.col(outcome) - runs[r].outcome * sum.weight;
    const Eigen::ArrayXd angle = rest * (2.0 * M_PI / turn);
    const std::complex<double> of_run{angle.cos().sum(), angle.sin().sum()};
    for (std::size_t f = 0; f <= kFolds; ++f)
      mean[f] += runs.fold(r) == f ? 0.0 : of_run;
  }
  for (const std::complex<double> &m : mean)
    sum.constant.push_back(
        static_cast<double>(static_cast<float>(std::arg(m) * turn / (2.0 * M_PI))));
  return sum;
}

} // namespace rim
