// SPDX-License-Identifier: MIT
#include "diagnose/mixed.hpp"

#include <algorithm>
#include <cmath>

namespace rim::diagnose {

namespace {

constexpr int kSteps = 60;

struct At {
  double ln_likelihood = 0.0, mean = 0.0, weight = 0.0;
};

At at(double tau2, const std::vector<double> &size, const std::vector<double> &stderror) {
  At out;
  double sum = 0.0;
  for (std::size_t j = 0; j < size.size(); ++j) {
    const double w = 1.0 / (tau2 + stderror[j] * stderror[j]);
    out.weight += w;
    sum += w * size[j];
    out.ln_likelihood += 0.5 * std::log(w);
  }
  out.mean = sum / out.weight;
  for (std::size_t j = 0; j < size.size(); ++j)
    out.ln_likelihood -=
        0.5 * std::pow(size[j] - out.mean, 2.0) / (tau2 + stderror[j] * stderror[j]);
  out.ln_likelihood -= 0.5 * std::log(out.weight);
  return out;
}

} // namespace

MixedSize mixed_size(const std::vector<double> &size, const std::vector<double> &stderror) {
  std::vector<double> e = stderror;
  double widest = 0.0;
  for (std::size_t j = 0; j < size.size(); ++j) {
    e[j] = std::max(e[j], 1e-9 * std::abs(size[j]) + 1e-300);
    widest = std::max({widest, std::abs(size[j] - size[0]), e[j]});
  }
  double best_tau2 = 0.0;
  At best = at(0.0, size, e);
  for (int step = 0; step < kSteps && size.size() > 1; ++step) {
    const double tau = 3.0 * widest * std::pow(1e-4, step / (kSteps - 1.0));
    const At one = at(tau * tau, size, e);
    if (one.ln_likelihood > best.ln_likelihood) {
      best = one;
      best_tau2 = tau * tau;
    }
  }
  // The least of the sizes as they are expected to be: uncertain ones nearer to the mean.
  const double side = best.mean < 0.0 ? -1.0 : 1.0;
  double least = 1e300;
  for (std::size_t j = 0; j < size.size(); ++j) {
    const double share = best_tau2 / (best_tau2 + e[j] * e[j]);
    least = std::min(least, side * (best.mean + share * (size[j] - best.mean)));
  }
  const double most = std::max(0.0, 2.0 * least);
  return {best.mean, std::sqrt(1.0 / best.weight), std::sqrt(best_tau2),
          side * std::min(std::abs(best.mean), most)};
}

} // namespace rim::diagnose
