// SPDX-License-Identifier: MIT
#include "plan/gp_fit.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace rim {

namespace {

constexpr double kGradientTolerance = 1e-5;
constexpr double kSufficientRise = 1e-4;
constexpr double kLongestStep = 2.0; // of a logarithm
constexpr int kHalvings = 30;

// The likelihood as a function of the logarithms of what is fitted.
class Problem {
public:
  Problem(rim_gp *gp, bool fit_noise) : gp_(gp), start_(rim_gp_get_config(gp)) {
    fit_noise_ = fit_noise && start_.noise_var > 0.0;
  }

  Eigen::VectorXd parameters(const rim_gp_config &c) const {
    Eigen::VectorXd p(static_cast<Eigen::Index>(RIM_GP_PARAMETERS(c.dims)));
    p[0] = std::log(c.signal_var);
    p[1] = fit_noise_ ? std::log(c.noise_var) : 0.0;
    for (int d = 0; d < c.dims; ++d)
      p[2 + d] = std::log(c.length[d]);
    return p;
  }

  rim_gp_config config(const Eigen::VectorXd &p) const {
    rim_gp_config c = start_;
    c.signal_var = std::exp(p[0]);
    if (fit_noise_)
      c.noise_var = std::exp(p[1]);
    for (int d = 0; d < c.dims; ++d)
      c.length[d] = std::exp(p[2 + d]);
    return c;
  }

  // -infinity where the process refuses.
  double value(const Eigen::VectorXd &p) {
    const rim_gp_config c = config(p);
    return rim_gp_set_config(gp_, &c) == RIM_OK ? rim_gp_log_likelihood(gp_) : -HUGE_VAL;
  }

  // Of the parameters in force: call value(p) before.
  Eigen::VectorXd gradient() {
    Eigen::VectorXd g(static_cast<Eigen::Index>(RIM_GP_PARAMETERS(start_.dims)));
    rim_gp_log_likelihood_gradient(gp_, g.data());
    if (!fit_noise_)
      g[1] = 0.0;
    return g;
  }

private:
  rim_gp *gp_;
  rim_gp_config start_;
  bool fit_noise_;
};

struct Climb {
  Eigen::VectorXd at;
  double value = -HUGE_VAL;
  std::uint32_t iterations = 0;
  bool converged = false;
};

// What remains of a gradient once it may not lead out of the box.
Eigen::VectorXd projected(const Eigen::VectorXd &g, const Eigen::VectorXd &p,
                          const Eigen::VectorXd &low, const Eigen::VectorXd &high) {
  Eigen::VectorXd out = g;
  for (Eigen::Index i = 0; i < g.size(); ++i)
    if ((p[i] <= low[i] && g[i] < 0.0) || (p[i] >= high[i] && g[i] > 0.0))
      out[i] = 0.0;
  return out;
}

// BFGS on the inverse Hessian of minus the likelihood, halving the step until it rises enough.
Climb climb(Problem &problem, const Eigen::VectorXd &start, const Eigen::VectorXd &low,
            const Eigen::VectorXd &high, std::uint32_t iterations) {
  Climb c;
  c.at = start;
  c.value = problem.value(start);
  if (!std::isfinite(c.value))
    return c;
  Eigen::VectorXd g = problem.gradient();
  const Eigen::Index n = start.size();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n) / std::max(1.0, g.norm());
  for (; c.iterations < iterations; ++c.iterations) {
    const Eigen::VectorXd free = projected(g, c.at, low, high);
    c.converged = free.lpNorm<Eigen::Infinity>() < kGradientTolerance;
    if (c.converged)
      break;
    Eigen::VectorXd direction = projected(inverse * free, c.at, low, high);
    if (!(direction.dot(free) > 0.0)) {
      inverse = Eigen::MatrixXd::Identity(n, n) / std::max(1.0, g.norm());
      direction = inverse * free;
    }
    direction *= std::min(1.0, kLongestStep / direction.lpNorm<Eigen::Infinity>());
    double step = 1.0, value = -HUGE_VAL;
    Eigen::VectorXd next;
    for (int k = 0; k < kHalvings; ++k, step *= 0.5) {
      next = (c.at + step * direction).cwiseMax(low).cwiseMin(high);
      value = problem.value(next);
      if (value >= c.value + kSufficientRise * free.dot(next - c.at))
        break;
      value = -HUGE_VAL;
    }
    if (!std::isfinite(value))
      break;
    const Eigen::VectorXd moved = next - c.at, before = g;
    g = problem.gradient();
    c.at = next;
    c.value = value;
    const Eigen::VectorXd bend = before - g; // of minus the likelihood
    const double curvature = moved.dot(bend);
    if (curvature > 1e-12 * moved.norm() * bend.norm()) {
      const Eigen::MatrixXd side =
          Eigen::MatrixXd::Identity(n, n) - moved * bend.transpose() / curvature;
      inverse = (side * inverse * side.transpose() + moved * moved.transpose() / curvature).eval();
    }
  }
  return c;
}

} // namespace

GpFit fit_gp(rim_gp *gp, const GpFitOptions &options) {
  Problem problem(gp, options.fit_noise);
  const Eigen::VectorXd origin = problem.parameters(rim_gp_get_config(gp));
  const double reach = std::log(std::max(options.range, 1.0));
  const Eigen::VectorXd low = origin.array() - reach, high = origin.array() + reach;
  GpFit fit;
  fit.before = rim_gp_log_likelihood(gp);
  Climb best;
  best.at = origin;
  best.value = fit.before;
  for (const double factor : {1.0, 1.0 / 3.0, 3.0}) {
    Eigen::VectorXd start = origin;
    start.tail(start.size() - 2).array() += std::log(factor);
    const Climb found =
        climb(problem, start.cwiseMax(low).cwiseMin(high), low, high, options.iterations);
    if (found.value > best.value || (factor == 1.0 && found.value >= best.value))
      best = found;
  }
  const rim_gp_config c = problem.config(best.at);
  (void)rim_gp_set_config(gp, &c);
  fit.after = rim_gp_log_likelihood(gp);
  fit.iterations = best.iterations;
  fit.converged = best.converged;
  return fit;
}

} // namespace rim
