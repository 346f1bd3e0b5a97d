// SPDX-License-Identifier: MIT
#include "diagnose/model.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "stats/orthogonal.hpp"

namespace rim::diagnose {

namespace {
using Index = Eigen::Index;
constexpr int kMostPasses = 30;
constexpr double kThroughout = 0.95; // of the rows
constexpr double kSmallStep = 1e-3; // standard errors

bool signs_allowed(const std::vector<Member> &members, const Vector &beta) {
  Index at = 0;
  for (const Member &member : members) {
    if (member.is_fixed)
      continue;
    if (member.is_positive && !(beta(at) > 0.0))
      return false;
    if (is_by_direction(member.term) && std::abs(beta(at + 1)) > std::abs(beta(at)) &&
        acts_throughout(member.h.col(1)))
      return false;
    if (member.term.form == kSmoothStribeck && beta(at) * beta(at + 1) < 0.0)
      return false;
    at += member.h.cols();
  }
  return true;
}

} // namespace

bool acts_throughout(const Eigen::Ref<const Vector> &column) {
  return (column.array() != 0.0).cast<double>().mean() > kThroughout;
}

void add_ridge(double share, Eigen::MatrixXd *gram) {
  auto diagonal = gram->diagonal().array();
  diagonal = (diagonal > 0.0).select(diagonal * (1.0 + share), 1.0);
}

Fit fit_members(const Vector &y, const std::vector<Member> &members, const Noise &noise) {
  Index free = 0;
  for (const Member &member : members)
    free += member.is_fixed ? 0 : member.h.cols();
  Fit fit;
  Eigen::MatrixXd h(y.size(), free);
  Vector fixed = Vector::Zero(y.size());
  Index at = 0;
  for (const Member &member : members) {
    if (member.is_fixed) {
      fixed += member.h.rowwise().sum();
      continue;
    }
    h.middleCols(at, member.h.cols()) = member.h;
    at += member.h.cols();
  }
  const Vector root = noise.weight.cwiseSqrt();
  const Vector target = y - fixed;
  const double corner = noise.clip * noise.scale;
  // Huber's estimate by pseudo-data: clip the weighted residual, solve, repeat.
  const auto clip = [&](const Vector &residual) -> Vector {
    return residual.cwiseProduct(root).cwiseMax(-corner).cwiseMin(corner);
  };
  fit.beta = Vector::Zero(free);
  if (free > 0) {
    const Eigen::MatrixXd weighted = root.asDiagonal() * h;
    Eigen::MatrixXd gram = weighted.transpose() * weighted;
    add_ridge(1e-10, &gram);
    const Eigen::LDLT<Eigen::MatrixXd> solver(gram);
    fit.beta = solver.solve(weighted.transpose() * root.cwiseProduct(target));
    const Vector sd =
        (noise.scale *
         solver.solve(Eigen::MatrixXd::Identity(free, free)).diagonal().cwiseMax(0.0).cwiseSqrt())
            .cwiseMax(1e-300);
    for (int pass = 0; pass < kMostPasses; ++pass) {
      const Vector step = solver.solve(weighted.transpose() * clip(target - h * fit.beta));
      fit.beta += step;
      if (pass >= 2 && (step.cwiseQuotient(sd).cwiseAbs().array() < kSmallStep).all())
        break;
    }
    fit.covariance = solver.solve(Eigen::MatrixXd::Identity(free, free));
    fit.orthonormal = orthonormal_basis(weighted);
  }
  fit.fitted = fixed;
  if (free > 0)
    fit.fitted += h * fit.beta;
  fit.residual = y - fit.fitted;
  const Vector standard = fit.residual.cwiseProduct(root);
  fit.clipped = standard.cwiseMax(-corner).cwiseMin(corner);
  const Vector size = standard.cwiseAbs();
  fit.loss = (size.array() <= corner)
                 .select(0.5 * size.array().square(), corner * size.array() - 0.5 * corner * corner)
                 .sum();
  fit.is_allowed = signs_allowed(members, fit.beta);
  return fit;
}

} // namespace rim::diagnose
