// What remains of one outcome from what remains of the others.
#include <cmath>

#include <Eigen/Cholesky>

#include "train/behaviour.hpp"
#include "train/image_writer.hpp"
#include "util/parallel_for.hpp"

extern "C" {
#include "../../lib/src/image/basis.h"
}

namespace rim {

namespace {

constexpr std::size_t kFolds = 6;
const double kRidges[] = {10.0, 100.0, 1e3, 1e4};
constexpr double kLevelMustWin = 0.05; // part of the error by which section LEVEL must be better

// Regressors of all outcomes in one run: residuals of this block, of the block before, and of this
// block times the means, each in standard deviations and clipped.
Matrix regressors(const Matrix &residual, const std::vector<double> &inverse_sd,
                  const Matrix &means) {
  const Eigen::Index n = residual.rows(), o = residual.cols(), m = means.cols();
  Matrix now(n, o);
  for (Eigen::Index j = 0; j < o; ++j)
    now.col(j) = (residual.col(j).array() * inverse_sd[static_cast<std::size_t>(j)])
                     .max(-AGREEMENT_CLIP)
                     .min(AGREEMENT_CLIP);
  Matrix x = Matrix::Zero(n, o * (2 + m));
  x.leftCols(o) = now;
  if (n > 1)
    x.block(1, o, n - 1, o) = now.topRows(n - 1);
  for (Eigen::Index k = 0; k < m; ++k)
    x.middleCols((2 + k) * o, o) = now.array().colwise() * means.col(k).array();
  return x;
}

std::vector<Eigen::Index> columns_without(Eigen::Index o, Eigen::Index outcome, Eigen::Index total) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index c = 0; c < total; ++c) {
    if (c % o != outcome)
      columns.push_back(c);
  }
  return columns;
}

struct Sums {
  Eigen::MatrixXd gram;
  Eigen::MatrixXd cross;
};

} // namespace

Agreement fit_agreement(const Basis &basis, const std::vector<BlockRun> &runs,
                        const std::vector<Matrix> &residual, const std::vector<Matrix> &level) {
  const std::size_t n = runs.size();
  const Eigen::Index o = residual.front().cols();
  const auto m = static_cast<Eigen::Index>(basis.means.size());
  const Eigen::Index total = o * (2 + m);
  Agreement a;
  for (Eigen::Index j = 0; j < o; ++j) {
    double squares = 0.0, count = 0.0;
    for (const Matrix &r : residual) {
      squares += r.col(j).squaredNorm();
      count += static_cast<double>(r.rows());
    }
    const double sd = std::sqrt(squares / std::max(count, 1.0));
    a.inverse_sd.push_back(static_cast<double>(static_cast<float>(1.0 / std::max(sd, 1e-12))));
  }
  std::vector<Matrix> x(n), y(n);
  std::vector<Sums> sums(n);
  parallel_for(n, [&](std::size_t r) {
    x[r] = regressors(residual[r], a.inverse_sd, standard_means(basis, runs[r]));
    y[r] = residual[r];
    for (Eigen::Index j = 0; j < o; ++j)
      y[r].col(j) *= a.inverse_sd[static_cast<std::size_t>(j)];
    sums[r].gram = x[r].transpose() * x[r];
    // An outcome that is far off is no guide to what healthy ones say of each other.
    sums[r].cross = x[r].transpose() * y[r].array().max(-AGREEMENT_CLIP).min(AGREEMENT_CLIP).matrix();
  });
  std::vector<Sums> folds(kFolds + 1);
  for (std::size_t f = 0; f <= kFolds; ++f) {
    folds[f].gram = Eigen::MatrixXd::Zero(total, total);
    folds[f].cross = Eigen::MatrixXd::Zero(total, o);
    for (std::size_t r = 0; r < n; ++r) {
      if (r % kFolds == f)
        continue;
      folds[f].gram += sums[r].gram;
      folds[f].cross += sums[r].cross;
    }
  }
  a.row = Matrix::Zero(o, 2 + total);
  a.error.assign(static_cast<std::size_t>(o), 1.0);
  a.from_level.assign(static_cast<std::size_t>(o), false);
  a.remains.resize(n);
  for (std::size_t r = 0; r < n; ++r)
    a.remains[r] = residual[r];
  parallel_for(static_cast<std::size_t>(o), [&](std::size_t outcome) {
    const auto j = static_cast<Eigen::Index>(outcome);
    const std::vector<Eigen::Index> columns = columns_without(o, j, total);
    const auto k = static_cast<Eigen::Index>(columns.size());
    const auto solve = [&](std::size_t f, double ridge) {
      Eigen::MatrixXd g(k, k);
      Eigen::VectorXd c(k);
      for (Eigen::Index p = 0; p < k; ++p) {
        for (Eigen::Index q = 0; q < k; ++q)
          g(p, q) = folds[f].gram(columns[static_cast<std::size_t>(p)],
                                  columns[static_cast<std::size_t>(q)]);
        c[p] = folds[f].cross(columns[static_cast<std::size_t>(p)], j);
      }
      g.diagonal().array() += ridge;
      const Eigen::VectorXd w = g.ldlt().solve(c);
      Eigen::VectorXd all = Eigen::VectorXd::Zero(total);
      for (Eigen::Index p = 0; p < k; ++p)
        all[columns[static_cast<std::size_t>(p)]] =
            static_cast<double>(static_cast<float>(w[p]));
      return all;
    };
    double least = 1e300, best = kRidges[0], own = 0.0;
    std::vector<std::vector<Eigen::VectorXd>> weights(std::size(kRidges));
    for (std::size_t l = 0; l < std::size(kRidges) && k > 0; ++l) {
      double squares = 0.0;
      own = 0.0;
      for (std::size_t f = 0; f < kFolds; ++f) {
        weights[l].push_back(solve(f, kRidges[l]));
        for (std::size_t r = f; r < n; r += kFolds) {
          squares += (y[r].col(j) - x[r] * weights[l][f]).squaredNorm();
          own += y[r].col(j).squaredNorm();
        }
      }
      if (squares < least) {
        least = squares;
        best = kRidges[l];
      }
    }
    double by_level = 1e300;
    if (!level.empty()) {
      by_level = 0.0;
      const double scale = a.inverse_sd[outcome] * a.inverse_sd[outcome];
      for (std::size_t r = 0; r < n; ++r)
        by_level += scale * (runs[r].outcome.col(j) - level[r].col(j)).squaredNorm();
    }
    if (k == 0 && level.empty())
      return;
    if (by_level < (1.0 - kLevelMustWin) * (1.0 - kLevelMustWin) * least) {
      a.from_level[outcome] = true;
      a.row(j, 0) = 1.0;
      a.error[outcome] = std::sqrt(by_level / std::max(own, 1e-300));
      for (std::size_t r = 0; r < n; ++r)
        a.remains[r].col(j) = runs[r].outcome.col(j) - level[r].col(j);
      return;
    }
    a.error[outcome] = std::sqrt(least / std::max(own, 1e-300));
    const Eigen::VectorXd all = solve(kFolds, best);
    a.row.row(j).tail(total) = all.transpose();
    for (std::size_t l = 0; l < std::size(kRidges); ++l) {
      if (!(std::abs(kRidges[l] - best) > 0.0)) {
        for (std::size_t r = 0; r < n; ++r)
          a.remains[r].col(j) =
              (y[r].col(j) - x[r] * weights[l][r % kFolds]) / a.inverse_sd[outcome];
      }
    }
  });
  return a;
}

std::vector<std::uint8_t> agreement_section(const Agreement &a, std::size_t means) {
  SectionBytes bytes;
  bytes.u32(1);
  bytes.u32(static_cast<std::uint32_t>(a.inverse_sd.size()));
  bytes.u32(static_cast<std::uint32_t>(means));
  bytes.u32(0);
  for (const double v : a.inverse_sd)
    bytes.f32(static_cast<float>(v));
  for (Eigen::Index i = 0; i < a.row.rows(); ++i) {
    for (Eigen::Index j = 0; j < a.row.cols(); ++j)
      bytes.f32(static_cast<float>(a.row(i, j)));
  }
  return bytes.bytes();
}

} // namespace rim
