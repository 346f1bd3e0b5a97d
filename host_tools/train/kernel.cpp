// SPDX-License-Identifier: MIT
#include "train/kernel.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <nanoflann.hpp>

#include "image/nominal.h"
#include "train/fit_gate.hpp"
#include "util/parallel_for.hpp"

namespace rim {
namespace {

// The nearest k rows that belong to no excluded run; the interface is nanoflann's.
class NearestElsewhere {
public:
  NearestElsewhere(std::size_t k, const std::vector<std::uint32_t> &run, std::uint32_t without_run)
      : run_(run), without_run_(without_run), capacity_(k) {
    index.reserve(k + 1);
    distance.reserve(k + 1);
  }
  std::size_t size() const { return index.size(); }
  bool full() const { return index.size() == capacity_; }
  double worstDist() const { return full() ? distance.back() : std::numeric_limits<double>::max(); }
  bool addPoint(double squared, std::size_t row) {
    if (run_[row] == without_run_ || squared >= worstDist()) {
      return true;
    }
    const auto at = std::upper_bound(distance.begin(), distance.end(), squared);
    index.insert(index.begin() + (at - distance.begin()), row);
    distance.insert(at, squared);
    if (index.size() > capacity_) {
      index.pop_back();
      distance.pop_back();
    }
    return true;
  }

  std::vector<std::size_t> index;
  std::vector<double> distance; // squared, ascending

private:
  const std::vector<std::uint32_t> &run_;
  std::uint32_t without_run_;
  std::size_t capacity_;
};

struct Rows {
  Matrix x;
  std::size_t kdtree_get_point_count() const { return static_cast<std::size_t>(x.rows()); }
  double kdtree_get_pt(std::size_t i, std::size_t j) const {
    return x(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  template <typename Box> bool kdtree_get_bbox(Box &) const { return false; }
};

using Index =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Adaptor<double, Rows>, Rows, -1, std::size_t>;

std::vector<std::size_t> spread_rows(std::size_t rows, std::size_t most) {
  std::vector<std::size_t> out;
  const std::size_t count = std::min(rows, most);
  for (std::size_t i = 0; i < count; ++i) {
    out.push_back(i * rows / count);
  }
  return out;
}

} // namespace

struct PlainKernel::Tree {
  NominalModel scale; // centre and inverse scale only
  // Rows are turned to their principal axes, largest first. Distances stay; but boxes of the tree
  // then follow the trajectories, and a distance is known to be too long after a few of its terms.
  Eigen::MatrixXd axes;
  Rows rows;
  Matrix y;
  std::vector<std::uint32_t> run;
  std::size_t neighbours = 0;
  std::unique_ptr<Index> index;

  NearestElsewhere nearest(const Eigen::RowVectorXd &xs, std::size_t k,
                           std::uint32_t without_run) const {
    NearestElsewhere found(k, run, without_run);
    index->findNeighbors(found, xs.data(), nanoflann::SearchParams());
    return found;
  }

  void turn(const Matrix &xs) {
    const Eigen::RowVectorXd mean = xs.colwise().mean();
    const Eigen::MatrixXd centred = xs.rowwise() - mean;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred.transpose() * centred);
    axes = eigen.eigenvectors().rowwise().reverse();
    rows.x = xs * axes;
  }
};

PlainKernel::PlainKernel(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
                         std::size_t most_rows, std::size_t neighbours)
    : tree_(std::make_unique<Tree>()) {
  const auto keep = spread_rows(static_cast<std::size_t>(x.rows()), most_rows);
  standardise_inputs(x, tree_->scale);
  tree_->neighbours = neighbours;
  Matrix some(static_cast<Eigen::Index>(keep.size()), x.cols());
  tree_->y.resize(some.rows(), y.cols());
  for (Eigen::Index i = 0; i < some.rows(); ++i) {
    const std::size_t from = keep[static_cast<std::size_t>(i)];
    some.row(i) = x.row(static_cast<Eigen::Index>(from));
    tree_->y.row(i) = y.row(static_cast<Eigen::Index>(from));
    tree_->run.push_back(run[from]);
  }
  tree_->turn(standardised(tree_->scale, some));
  constexpr std::size_t leaf_rows = 16;
  tree_->index = std::make_unique<Index>(static_cast<std::size_t>(x.cols()), tree_->rows,
                                         nanoflann::KDTreeSingleIndexAdaptorParams(leaf_rows));
  tree_->index->buildIndex();
}

PlainKernel::~PlainKernel() = default;
PlainKernel::PlainKernel(PlainKernel &&) noexcept = default;
PlainKernel &PlainKernel::operator=(PlainKernel &&) noexcept = default;

double PlainKernel::spacing() const {
  constexpr std::size_t sample = 500;
  std::vector<double> distance;
  for (const std::size_t i : spread_rows(tree_->run.size(), sample)) {
    const auto found =
        tree_->nearest(tree_->rows.x.row(static_cast<Eigen::Index>(i)), 1, tree_->run[i]);
    if (found.size() > 0) {
      distance.push_back(std::sqrt(found.distance.front()));
    }
  }
  if (distance.empty()) {
    return 1.0;
  }
  const auto middle = distance.begin() + static_cast<std::ptrdiff_t>(distance.size() / 2);
  std::nth_element(distance.begin(), middle, distance.end());
  return std::max(*middle, 1e-6);
}

void PlainKernel::predict(const double *x, std::uint32_t without_run,
                          const std::vector<double> &bandwidth, Matrix &mean,
                          Matrix &variance) const {
  const Tree &t = *tree_;
  const Matrix xs = standardised(t.scale, Eigen::Map<const Matrix>(x, 1, t.rows.x.cols())) * t.axes;
  const NearestElsewhere found = t.nearest(xs.row(0), t.neighbours, without_run);
  const auto rows = static_cast<Eigen::Index>(bandwidth.size());
  mean.setZero(rows, t.y.cols());
  variance.setZero(rows, t.y.cols());
  for (Eigen::Index b = 0; b < rows; ++b) {
    const double h = bandwidth[static_cast<std::size_t>(b)];
    std::vector<double> weight;
    double sum = 0.0;
    for (const double squared : found.distance) {
      // Relative to the nearest: far from all rows the sums of eq. 4.13 would be 0 / 0.
      weight.push_back(std::exp((found.distance.front() - squared) / (2.0 * h * h)));
      sum += weight.back();
    }
    for (std::size_t k = 0; k < weight.size(); ++k) {
      mean.row(b) += weight[k] / sum * t.y.row(static_cast<Eigen::Index>(found.index[k]));
    }
    for (std::size_t k = 0; k < weight.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(found.index[k]);
      variance.row(b) += weight[k] / sum * (t.y.row(row) - mean.row(b)).cwiseAbs2();
    }
  }
}

namespace {

// Errors on the query rows: per bandwidth (row) and outcome the sum of squares.
using Errors = Matrix;

// The bandwidth with the least geometric mean error over outcomes.
Eigen::Index best_row(const Errors &errors) {
  Eigen::Index best = 0;
  errors.cwiseMax(1e-300).array().log().rowwise().sum().minCoeff(&best);
  return best;
}

std::vector<double> rmse_of(const Eigen::RowVectorXd &squares, std::size_t rows) {
  std::vector<double> out;
  for (Eigen::Index j = 0; j < squares.size(); ++j) {
    out.push_back(std::sqrt(squares[j] / static_cast<double>(rows)));
  }
  return out;
}

Matrix fold(const std::vector<Matrix> &parts) {
  Matrix sum = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) {
    sum += parts[i];
  }
  return sum;
}

void judge_kernel(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
                  const std::vector<std::size_t> &query, const KernelOptions &options,
                  KernelReport &report) {
  const PlainKernel kernel(x, y, run, options.train_rows, options.neighbours);
  std::vector<double> bandwidth;
  for (const double b : options.bandwidth) {
    bandwidth.push_back(b * kernel.spacing());
  }
  std::vector<Matrix> errors(query.size());
  parallel_for(query.size(), [&](std::size_t q) {
    const auto row = static_cast<Eigen::Index>(query[q]);
    Matrix mean;
    Matrix variance;
    kernel.predict(x.row(row).data(), run[query[q]], bandwidth, mean, variance);
    errors[q] = (mean.rowwise() - y.row(row)).cwiseAbs2();
  });
  const Errors sum = fold(errors);
  const Eigen::Index best = best_row(sum);
  report.bandwidth = bandwidth[static_cast<std::size_t>(best)];
  report.kernel = rmse_of(sum.row(best), query.size());
}

// Sums over the rows nearest to each prototype, per run: what leaving a run out takes away.
struct Cells {
  Eigen::VectorXd rows, reach_squared;
  Matrix sum, squares; // P x outputs
};

Cells cells_of(const Matrix &xs, const Matrix &ys, RunSpan span, const NominalModel &model) {
  Cells c;
  const Eigen::Index prototypes = model.prototypes.rows();
  c.rows = Eigen::VectorXd::Zero(prototypes);
  c.reach_squared = c.rows;
  c.sum = Matrix::Zero(prototypes, ys.cols());
  c.squares = c.sum;
  for (auto i = static_cast<Eigen::Index>(span.begin); i < static_cast<Eigen::Index>(span.end);
       ++i) {
    Eigen::Index p = 0;
    const double squared =
        (model.prototypes.rowwise() - xs.row(i)).rowwise().squaredNorm().minCoeff(&p);
    c.rows[p] += 1.0;
    c.reach_squared[p] = std::max(c.reach_squared[p], squared);
    c.sum.row(p) += ys.row(i);
    c.squares.row(p) += ys.row(i).cwiseAbs2();
  }
  return c;
}

Cells sum_of(const std::vector<Cells> &cells) {
  Cells all = cells.front();
  for (std::size_t r = 1; r < cells.size(); ++r) {
    all.rows += cells[r].rows;
    all.reach_squared = all.reach_squared.cwiseMax(cells[r].reach_squared);
    all.sum += cells[r].sum;
    all.squares += cells[r].squares;
  }
  return all;
}

Cells without(Cells all, const Cells &part) {
  all.rows -= part.rows;
  all.sum -= part.sum;
  all.squares -= part.squares;
  return all;
}

// Mean, variance and mass of every prototype; one without rows gets a mass too small to be heard.
void fill_prototypes(const Cells &cells, NominalModel &model) {
  const double rows = std::max(cells.rows.sum(), 1.0);
  const Eigen::RowVectorXd mean = cells.sum.colwise().sum() / rows;
  const Eigen::RowVectorXd overall =
      (cells.squares.colwise().sum() / rows - mean.cwiseAbs2()).cwiseMax(0.0);
  const Eigen::RowVectorXd least = (overall * 1e-12).cwiseMax(1e-30);
  model.offset.resize(cells.sum.rows(), cells.sum.cols());
  model.variance.resize(cells.sum.rows(), cells.sum.cols());
  for (Eigen::Index p = 0; p < cells.rows.size(); ++p) {
    const double n = cells.rows[p];
    const bool heard = n > 0.5;
    model.ln_mass[p] = heard ? std::log(n) : -1e6;
    model.offset.row(p) = heard ? Eigen::RowVectorXd(cells.sum.row(p) / n) : mean;
    model.variance.row(p) =
        heard ? Eigen::RowVectorXd(cells.squares.row(p) / n - model.offset.row(p).cwiseAbs2())
              : overall;
    model.variance.row(p) = model.variance.row(p).cwiseMax(least);
  }
}

void set_bandwidth(NominalModel &model, double bandwidth) {
  model.bandwidth.setConstant(model.prototypes.rows(),
                              static_cast<double>(static_cast<float>(bandwidth)));
}

// Squared errors on the query rows of one run, a row a bandwidth, by prototypes that never saw it.
Errors errors_without(NominalModel model, const Matrix &x, const Matrix &ys, RunSpan span,
                      const std::vector<std::size_t> &query, const std::vector<double> &bandwidth) {
  Errors errors = Errors::Zero(static_cast<Eigen::Index>(bandwidth.size()), ys.cols());
  Eigen::RowVectorXd mean(ys.cols());
  Eigen::RowVectorXd sd(ys.cols());
  for (const std::size_t q : query) {
    if (q < span.begin || q >= span.end) {
      continue;
    }
    const auto row = static_cast<Eigen::Index>(q);
    for (std::size_t b = 0; b < bandwidth.size(); ++b) {
      set_bandwidth(model, bandwidth[b]);
      predict(model, x.row(row).data(), mean.data(), sd.data(), nullptr);
      errors.row(static_cast<Eigen::Index>(b)) += (ys.row(row) - mean).cwiseAbs2();
    }
  }
  return errors;
}

void judge_prototypes(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
                      const std::vector<std::size_t> &query, const KernelOptions &options,
                      KernelReport &report) {
  const std::vector<RunSpan> spans = run_spans(run);
  NominalModel model;
  model.order = 0;
  model.top = std::min<std::uint32_t>(RIM_NOMINAL_MAX_TOP, options.prototypes);
  model.gate_weight = Eigen::VectorXd::Ones(x.cols());
  standardise_inputs(x, model);
  const Matrix xs = standardised(model, x);
  const Eigen::VectorXd radius =
      place_prototypes(sample_rows(xs, {}, 20000), options.prototypes, options.seed, model);
  const double typical = std::sqrt(radius.squaredNorm() / static_cast<double>(radius.size()));
  std::vector<double> bandwidth;
  for (const double b : options.bandwidth) {
    bandwidth.push_back(b * typical);
  }
  // About the outcome's mean and not about zero: the sums of squares would cancel.
  const Eigen::RowVectorXd level = y.colwise().mean();
  const Matrix ys = y.rowwise() - level;
  std::vector<Cells> cells(spans.size());
  parallel_for(spans.size(), [&](std::size_t r) { cells[r] = cells_of(xs, ys, spans[r], model); });
  const Cells all = sum_of(cells);
  std::vector<Errors> errors(spans.size());
  parallel_for(spans.size(), [&](std::size_t r) {
    NominalModel rest = model;
    fill_prototypes(without(all, cells[r]), rest);
    errors[r] = errors_without(std::move(rest), x, ys, spans[r], query, bandwidth);
  });
  const Errors sum = fold(errors);
  const Eigen::Index best = best_row(sum);
  set_bandwidth(model, bandwidth[static_cast<std::size_t>(best)]);
  fill_prototypes(all, model);
  model.offset.rowwise() += level;
  model.reach = all.reach_squared.cwiseSqrt().cwiseMax(model.bandwidth);
  report.prototype_bandwidth = model.bandwidth[0];
  report.prototypes = rmse_of(sum.row(best), query.size());
  report.compressed = std::move(model);
}

} // namespace

namespace {

// What the flight section's single precision changes in the mean, over the query rows.
std::vector<double> rounding_of(const Matrix &x, const std::vector<std::size_t> &query,
                                const NominalModel &model) {
  Matrix some(static_cast<Eigen::Index>(query.size()), x.cols());
  for (Eigen::Index i = 0; i < some.rows(); ++i) {
    some.row(i) = x.row(static_cast<Eigen::Index>(query[static_cast<std::size_t>(i)]));
  }
  const Prediction flight = predict_flight(nominal_section(model), some);
  Eigen::RowVectorXd squares = Eigen::RowVectorXd::Zero(flight.mean.cols());
  Eigen::RowVectorXd mean = squares;
  Eigen::RowVectorXd sd = squares;
  for (Eigen::Index i = 0; i < some.rows(); ++i) {
    predict(model, some.row(i).data(), mean.data(), sd.data(), nullptr);
    squares += (flight.mean.row(i) - mean).cwiseAbs2();
  }
  return rmse_of(squares, query.size());
}

} // namespace

KernelReport compare_kernels(const Matrix &x, const Matrix &y,
                             const std::vector<std::uint32_t> &run, const FitResult &local,
                             const KernelOptions &options) {
  KernelReport report;
  const auto query = spread_rows(run.size(), options.query_rows);
  report.white = white_noise(y, run);
  judge_kernel(x, y, run, query, options, report);
  judge_prototypes(x, y, run, query, options, report);
  report.local = local.rmse;
  if (local.mean.rows() == x.rows()) {
    Eigen::RowVectorXd squares = Eigen::RowVectorXd::Zero(y.cols());
    for (const std::size_t q : query) {
      const auto row = static_cast<Eigen::Index>(q);
      squares += (y.row(row) - local.mean.row(row)).cwiseAbs2();
    }
    report.local = rmse_of(squares, query.size());
  }
  report.rounding = rounding_of(x, query, local.model);
  return report;
}

} // namespace rim
