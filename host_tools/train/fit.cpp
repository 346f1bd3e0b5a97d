// SPDX-License-Identifier: MIT
#include "train/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "image/nominal.h"
#include "stats/single.hpp"
#include "train/fit_gate.hpp"
#include "train/fit_gram.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"

namespace rim {
namespace {

// Training data in standardised units; outputs are brought back at the end.
struct Data {
  Matrix xs, ys;
  std::vector<RunSpan> spans;
};

// Everything that follows from prototypes and bandwidths on one set of rows.
struct Fitted {
  Gates gates;
  Eigen::Index prototypes = 0;
  Eigen::VectorXd reach_squared;
  std::vector<Eigen::VectorXd> run_reach; // the same of each run
  std::vector<Gram> total;                // per prototype, all runs
  std::vector<double> ridge, ridge_global;
  Matrix mean; // rows x outputs, left-one-run-out, standardised
  Eigen::VectorXd mse;
};


Gram sum_of(const std::vector<Gram> &grams) {
  Gram sum = grams.front();
  for (std::size_t p = 1; p < grams.size(); ++p) {
    sum += grams[p];
  }
  return sum;
}

void check(const Matrix &x, const Matrix &y, const std::vector<RunSpan> &spans,
           const FitOptions &options) {
  if (x.rows() != y.rows() ||
      (spans.empty() ? 0 : spans.back().end) != static_cast<std::size_t>(x.rows()) ||
      x.rows() < 2 || x.cols() < 1 || y.cols() < 1) {
    throw DataError("training: inputs and outcomes differ in rows, or there are none");
  }
  if (x.cols() > RIM_NOMINAL_MAX_INPUTS || y.cols() > RIM_NOMINAL_MAX_OUTPUTS) {
    throw DataError("training: at most 128 inputs and 128 outcomes fit the flight model, not " +
                    std::to_string(x.cols()) + " and " + std::to_string(y.cols()));
  }
  if (spans.size() < 2) {
    throw DataError("training: at least two runs are needed, to leave one out");
  }
  if (!x.allFinite() || !y.allFinite()) {
    throw DataError("training: a value is not finite");
  }
  const auto outputs = static_cast<std::size_t>(y.cols());
  if ((!options.exclude.empty() && options.exclude.size() != outputs) ||
      (!options.gate_weight.empty() &&
       options.gate_weight.size() != static_cast<std::size_t>(x.cols())) ||
      options.prototypes.empty() || options.bandwidth.empty() || options.ridge.empty()) {
    throw std::invalid_argument("fit_nominal: options do not fit the data");
  }
}

Data every_nth_of_runs(const Data &all, std::size_t most) {
  const auto rows = static_cast<std::size_t>(all.xs.rows());
  const std::size_t stride = std::max<std::size_t>(1, (rows + most - 1) / most);
  std::vector<std::size_t> keep;
  Data some;
  for (std::size_t r = 0; r < all.spans.size(); ++r) {
    const std::size_t begin = keep.size();
    // Another phase in each run, so that a periodic log is not sampled at one phase only.
    for (std::size_t i = all.spans[r].begin + r % stride; i < all.spans[r].end; i += stride) {
      keep.push_back(i);
    }
    if (keep.size() > begin) {
      some.spans.push_back({begin, keep.size()});
    }
  }
  some.xs.resize(static_cast<Eigen::Index>(keep.size()), all.xs.cols());
  some.ys.resize(static_cast<Eigen::Index>(keep.size()), all.ys.cols());
  for (std::size_t i = 0; i < keep.size(); ++i) {
    some.xs.row(static_cast<Eigen::Index>(i)) = all.xs.row(static_cast<Eigen::Index>(keep[i]));
    some.ys.row(static_cast<Eigen::Index>(i)) = all.ys.row(static_cast<Eigen::Index>(keep[i]));
  }
  return some;
}

// One run's Gram of every prototype. They are made again where they are needed: kept for all runs
// they would be by far the largest thing in memory, and making them costs less than what follows.
std::vector<Gram> grams_of(const Data &data, const Fitted &fit, std::size_t run) {
  return run_grams(data.xs, data.ys, data.spans[run], fit.gates, fit.prototypes);
}

void fill_gates(const Data &data, const NominalModel &model, Fitted &fit) {
  const auto rows = static_cast<std::size_t>(data.xs.rows());
  fit.gates.top = model.top;
  fit.gates.index.assign(rows * model.top, 0);
  fit.gates.weight.assign(rows * model.top, 0.0);
  std::vector<Eigen::VectorXd> reach(data.spans.size(),
                                     Eigen::VectorXd::Zero(model.prototypes.rows()));
  fit.prototypes = model.prototypes.rows();
  parallel_in_order(
      data.spans.size(),
      [&](std::size_t r) {
        open_gates(model, data.xs, data.spans[r], fit.gates, &reach[r]);
        return grams_of(data, fit, r);
      },
      [&](std::size_t r, std::vector<Gram> grams) {
        if (r == 0) {
          fit.total = std::move(grams);
          return;
        }
        for (std::size_t p = 0; p < fit.total.size(); ++p)
          fit.total[p] += grams[p];
      });
  fit.reach_squared = reach.front();
  for (const Eigen::VectorXd &of_run : reach)
    fit.reach_squared = fit.reach_squared.cwiseMax(of_run);
  fit.run_reach = std::move(reach);
}

// One run's rows of FitResult::beyond. reach_squared: of the other runs.
void judge_beyond(const Data &data, std::size_t run, const NominalModel &model,
                  const Eigen::VectorXd &reach_squared, const std::vector<int> &own,
                  Matrix *beyond) {
  const Eigen::Index count = model.prototypes.rows();
  Matrix squares(count, data.xs.cols());
  for (std::size_t i = data.spans[run].begin; i < data.spans[run].end; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    for (Eigen::Index p = 0; p < count; ++p)
      squares.row(p) = ((data.xs.row(row) - model.prototypes.row(p)).array() *
                        model.gate_weight.transpose().array())
                           .square();
    const Eigen::VectorXd all = squares.rowwise().sum();
    Eigen::Index nearest = 0;
    if (all.minCoeff(&nearest) <= reach_squared[nearest])
      continue;
    for (Eigen::Index o = 0; o < beyond->cols(); ++o) {
      const int input = own[static_cast<std::size_t>(o)];
      const double rest =
          input < 0 ? all.minCoeff(&nearest) : (all - squares.col(input)).minCoeff(&nearest);
      (*beyond)(row, o) = rest > reach_squared[nearest] ? 1.0 : 0.0;
    }
  }
}

Matrix all_beyond(const Data &data, const NominalModel &model, const Fitted &fit,
                  const std::vector<int> &own) {
  Matrix beyond = Matrix::Zero(data.xs.rows(), data.ys.cols());
  if (own.empty())
    return beyond;
  parallel_for(data.spans.size(), [&](std::size_t r) {
    Eigen::VectorXd reach = model.bandwidth.array().square();
    for (std::size_t other = 0; other < fit.run_reach.size(); ++other) {
      if (other != r)
        reach = reach.cwiseMax(fit.run_reach[other]);
    }
    judge_beyond(data, r, model, RIM_NOMINAL_BELIEVED * RIM_NOMINAL_BELIEVED * reach, own, &beyond);
  });
  return beyond;
}

// Per output, the candidate of least error summed over runs; error[run](output, candidate).
std::vector<double> best_candidate(const std::vector<Eigen::MatrixXd> &error,
                                   const std::vector<double> &candidates) {
  Eigen::MatrixXd sum = error.front();
  for (std::size_t r = 1; r < error.size(); ++r) {
    sum += error[r];
  }
  std::vector<double> best;
  for (Eigen::Index j = 0; j < sum.rows(); ++j) {
    Eigen::Index at = 0;
    sum.row(j).minCoeff(&at);
    best.push_back(candidates[static_cast<std::size_t>(at)]);
  }
  return best;
}

// Chooses the ridges by leaving every run out (exact downdates); returns the global map without
// each.
std::vector<Matrix> choose_ridges(const Data &data, const RidgeShape &shape,
                                  const FitOptions &options, Fitted &fit) {
  const std::size_t runs = data.spans.size();
  const auto candidates = static_cast<Eigen::Index>(options.ridge.size());
  const Gram all = sum_of(fit.total);
  const Matrix zero = Matrix::Zero(shape.outputs, 1 + shape.inputs);
  std::vector<Eigen::MatrixXd> error(runs, Eigen::MatrixXd::Zero(shape.outputs, candidates));
  parallel_for(runs, [&](std::size_t r) {
    const Gram own = sum_of(grams_of(data, fit, r));
    const Gram rest = all - own;
    for (Eigen::Index c = 0; c < candidates; ++c) {
      const Matrix maps = ridge_maps(rest, shape, zero, options.ridge[static_cast<std::size_t>(c)]);
      error[r].col(c) = squared_error(own, shape, maps);
    }
  });
  fit.ridge_global = best_candidate(error, options.ridge);
  std::vector<Matrix> global(runs);
  parallel_for(runs, [&](std::size_t r) {
    const std::vector<Gram> own = grams_of(data, fit, r);
    global[r] = ridge_maps(all - sum_of(own), shape, zero, fit.ridge_global);
    error[r].setZero();
    for (std::size_t p = 0; p < fit.total.size(); ++p) {
      const Gram rest = fit.total[p] - own[p];
      for (Eigen::Index c = 0; c < candidates; ++c) {
        const double ridge = options.ridge[static_cast<std::size_t>(c)];
        error[r].col(c) += squared_error(own[p], shape, ridge_maps(rest, shape, global[r], ridge));
      }
    }
  });
  fit.ridge = best_candidate(error, options.ridge);
  return global;
}

// Gate-weighted sum of the maps' predictions on rows of one run, written into mean.
void predict_rows(const Data &data, RunSpan rows, const Gates &gates,
                  const std::vector<Matrix> &maps, Matrix &mean) {
  const auto first = static_cast<Eigen::Index>(rows.begin);
  const auto count = static_cast<Eigen::Index>(rows.end - rows.begin);
  const Eigen::Index d = data.xs.cols();
  mean.middleRows(first, count).setZero();
  Matrix inputs(count, 1 + d);
  std::vector<Eigen::Index> row(rows.end - rows.begin);
  Eigen::VectorXd weight(count);
  for (std::size_t p = 0; p < maps.size(); ++p) {
    Eigen::Index used = 0;
    for (std::size_t i = rows.begin; i < rows.end; ++i) {
      for (std::size_t k = i * gates.top; k < (i + 1) * gates.top; ++k) {
        if (gates.index[k] == p && gates.weight[k] > 0.0) {
          inputs(used, 0) = 1.0;
          inputs.row(used).tail(d) = data.xs.row(static_cast<Eigen::Index>(i));
          weight[used] = gates.weight[k];
          row[static_cast<std::size_t>(used++)] = static_cast<Eigen::Index>(i);
        }
      }
    }
    const Matrix local = inputs.topRows(used) * maps[p].transpose();
    for (Eigen::Index i = 0; i < used; ++i) {
      mean.row(row[static_cast<std::size_t>(i)]) += weight[i] * local.row(i);
    }
  }
}

Fitted fit_at(const Data &data, const NominalModel &model, const RidgeShape &shape,
              const FitOptions &options) {
  Fitted fit;
  fill_gates(data, model, fit);
  const std::vector<Matrix> global = choose_ridges(data, shape, options, fit);
  fit.mean.resize(data.ys.rows(), data.ys.cols());
  parallel_for(data.spans.size(), [&](std::size_t r) {
    const std::vector<Gram> own = grams_of(data, fit, r);
    std::vector<Matrix> maps;
    for (std::size_t p = 0; p < fit.total.size(); ++p) {
      maps.push_back(ridge_maps(fit.total[p] - own[p], shape, global[r], fit.ridge));
    }
    predict_rows(data, data.spans[r], fit.gates, maps, fit.mean);
  });
  fit.mse = (data.ys - fit.mean).array().square().colwise().mean().transpose();
  return fit;
}

// Geometric mean, so that no outcome outweighs the others by its scale.
double overall_error(const Eigen::VectorXd &mse) {
  return std::exp(0.5 * mse.array().max(1e-30).log().mean());
}

void set_bandwidth(NominalModel &model, const Eigen::VectorXd &radius, double scale) {
  model.bandwidth = (scale * radius).unaryExpr(&single);
}

// Rows to place prototypes by: k-means alone spends them on the phases that last longest, and the
// short ones, where a map of its own is needed most, would share one.
Matrix rows_to_cover(const Data &some, const NominalModel &blank, const RidgeShape &shape,
                     const FitOptions &options) {
  constexpr std::size_t most_rows = 20000;
  constexpr double most_square = 25.0; // a single row counts as five standard deviations at most
  NominalModel one = blank;
  one.top = 1;
  set_bandwidth(one, place_prototypes(sample_rows(some.xs, {}, 1000), 1, options.seed, one), 1.0);
  const Fitted fit = fit_at(some, one, shape, options);
  const Eigen::RowVectorXd mse = fit.mse.transpose().cwiseMax(1e-30);
  const Matrix squares = (some.ys - fit.mean).array().square().rowwise() / mse.array();
  const Eigen::VectorXd error = squares.cwiseMin(most_square).rowwise().mean();
  const double mean = std::max(error.mean(), 1e-30);
  const Eigen::VectorXd weight = (1.0 - options.focus) + options.focus * error.array() / mean;
  return sample_rows(some.xs, weight, most_rows);
}

NominalModel choose_prototypes(const Data &data, const NominalModel &blank, const RidgeShape &shape,
                               const FitOptions &options, FitResult &result) {
  const bool choose = options.prototypes.size() * options.bandwidth.size() > 1;
  const Data some = every_nth_of_runs(data, options.search_rows);
  const Matrix cover = rows_to_cover(some, blank, shape, options);
  NominalModel best;
  for (const std::uint32_t count : options.prototypes) {
    NominalModel model = blank;
    model.top = std::min(options.top, count);
    const Eigen::VectorXd radius = place_prototypes(cover, count, options.seed, model);
    const double before = result.chosen.prototypes == 0 ? std::numeric_limits<double>::infinity()
                                                        : result.chosen.error;
    for (const double scale : options.bandwidth) {
      set_bandwidth(model, radius, scale);
      FitCandidate candidate{count, scale, 0.0};
      candidate.error = choose ? overall_error(fit_at(some, model, shape, options).mse) : 0.0;
      result.candidates.push_back(candidate);
      const bool enough = candidate.error < (1.0 - options.prefer_fewer) * before;
      const bool better =
          result.chosen.prototypes != count || candidate.error < result.chosen.error;
      if (enough && better) {
        result.chosen = candidate;
        best = model;
      }
    }
  }
  return best;
}

// Variance per prototype from left-one-run-out residuals, per run so that each can leave itself
// out.
struct Scatter {
  std::vector<Matrix> squares;         // per run: P x outputs
  std::vector<Eigen::VectorXd> weight; // per run: P
};

Scatter scatter_of(const Data &data, const Fitted &fit) {
  const auto prototypes = static_cast<Eigen::Index>(fit.total.size());
  Scatter s;
  s.squares.assign(data.spans.size(), Matrix::Zero(prototypes, data.ys.cols()));
  s.weight.assign(data.spans.size(), Eigen::VectorXd::Zero(prototypes));
  parallel_for(data.spans.size(), [&](std::size_t r) {
    for (std::size_t i = data.spans[r].begin; i < data.spans[r].end; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const Eigen::RowVectorXd square = (data.ys.row(row) - fit.mean.row(row)).array().square();
      for (std::size_t k = i * fit.gates.top; k < (i + 1) * fit.gates.top; ++k) {
        s.squares[r].row(fit.gates.index[k]) += fit.gates.weight[k] * square;
        s.weight[r][fit.gates.index[k]] += fit.gates.weight[k];
      }
    }
  });
  return s;
}

// Shrunk to the overall variance by ten rows' worth, which keeps rarely visited prototypes finite.
Matrix variance_of(const Matrix &squares, const Eigen::VectorXd &weight) {
  constexpr double shrink_rows = 10.0;
  const Eigen::RowVectorXd overall = squares.colwise().sum() / std::max(weight.sum(), 1.0);
  Matrix variance(squares.rows(), squares.cols());
  for (Eigen::Index p = 0; p < squares.rows(); ++p) {
    variance.row(p) = (squares.row(p) + shrink_rows * overall) / (weight[p] + shrink_rows);
  }
  return variance.cwiseMax(
      1e-12); // of the outcome's own variance: a constant outcome stays above 0
}

void fill_deviations(const Data &data, const Fitted &fit, NominalModel &model, Matrix &sd) {
  const Scatter s = scatter_of(data, fit);
  Matrix squares = s.squares.front();
  Eigen::VectorXd weight = s.weight.front();
  for (std::size_t r = 1; r < s.squares.size(); ++r) {
    squares += s.squares[r];
    weight += s.weight[r];
  }
  model.variance = variance_of(squares, weight);
  sd.resize(data.ys.rows(), data.ys.cols());
  parallel_for(data.spans.size(), [&](std::size_t r) {
    const Matrix variance =
        variance_of((squares - s.squares[r]).cwiseMax(0.0), weight - s.weight[r]);
    for (std::size_t i = data.spans[r].begin; i < data.spans[r].end; ++i) {
      Eigen::RowVectorXd sum = Eigen::RowVectorXd::Zero(data.ys.cols());
      for (std::size_t k = i * fit.gates.top; k < (i + 1) * fit.gates.top; ++k) {
        sum += fit.gates.weight[k] * variance.row(fit.gates.index[k]);
      }
      sd.row(static_cast<Eigen::Index>(i)) = sum.array().sqrt();
    }
  });
}

void fill_maps(const Fitted &fit, const RidgeShape &shape, NominalModel &model) {
  const Matrix zero = Matrix::Zero(shape.outputs, 1 + shape.inputs);
  const Matrix global = ridge_maps(sum_of(fit.total), shape, zero, fit.ridge_global);
  model.offset.resize(static_cast<Eigen::Index>(fit.total.size()), shape.outputs);
  for (std::size_t p = 0; p < fit.total.size(); ++p) {
    const Matrix maps = ridge_maps(fit.total[p], shape, global, fit.ridge);
    model.offset.row(static_cast<Eigen::Index>(p)) = maps.col(0).transpose();
    model.maps.emplace_back(maps.rightCols(shape.inputs));
    const auto at = static_cast<Eigen::Index>(p);
    // An empty prototype still needs a reach above zero.
    model.reach[at] = single(std::max(std::sqrt(fit.reach_squared[at]), model.bandwidth[at]));
  }
}

// From standardised outputs back to the outcomes' units.
void restore_units(const Eigen::RowVectorXd &centre, const Eigen::RowVectorXd &scale,
                   FitResult &result) {
  NominalModel &m = result.model;
  for (Eigen::Index p = 0; p < m.offset.rows(); ++p) {
    m.offset.row(p) = centre.array() + m.offset.row(p).array() * scale.array();
    m.variance.row(p).array() *= scale.array().square();
    m.maps[static_cast<std::size_t>(p)].array().colwise() *= scale.transpose().array();
  }
  for (Eigen::Index i = 0; i < result.mean.rows(); ++i) {
    result.mean.row(i) = centre.array() + result.mean.row(i).array() * scale.array();
    result.sd.row(i).array() *= scale.array();
  }
}

// Variance of each input's own error in standardised units.
Eigen::VectorXd input_errors(const Matrix &x, const std::vector<std::uint32_t> &run,
                             const NominalModel &model, const FitOptions &options) {
  // Commands have no noise; without a floor their coefficients would not be shrunk at all.
  constexpr double least_sd = 1e-3;
  const std::vector<double> sd =
      options.input_error.empty() ? white_noise(x, run) : options.input_error;
  Eigen::VectorXd variance(x.cols());
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double v = sd[static_cast<std::size_t>(i)] * model.inverse_scale[i];
    variance[i] = v > 0.0 ? v * v : least_sd * least_sd;
  }
  return variance;
}

} // namespace

FitResult fit_nominal(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
                      const FitOptions &options) {
  Data data;
  data.spans = run_spans(run);
  check(x, y, data.spans, options);
  FitResult result;
  NominalModel blank;
  blank.gate_weight = Eigen::VectorXd::Ones(x.cols());
  for (std::size_t i = 0; i < options.gate_weight.size(); ++i) {
    blank.gate_weight[static_cast<Eigen::Index>(i)] = single(options.gate_weight[i]);
  }
  standardise_inputs(x, blank);
  data.xs = standardised(blank, x);

  const auto rows = static_cast<double>(y.rows());
  const Eigen::RowVectorXd centre = y.colwise().mean();
  data.ys = y.rowwise() - centre;
  Eigen::RowVectorXd scale = (data.ys.array().square().colwise().sum() / rows).sqrt();
  scale = (scale.array() > 1e-12 * (1.0 + centre.array().abs())).select(scale, 1.0);
  data.ys.array().rowwise() /= scale.array();

  const RidgeShape shape{x.cols(), y.cols(), options.exclude, input_errors(x, run, blank, options)};
  result.model = choose_prototypes(data, blank, shape, options, result);
  Fitted fit = fit_at(data, result.model, shape, options);
  fill_maps(fit, shape, result.model);
  fill_deviations(data, fit, result.model, result.sd);
  result.chosen.error = overall_error(fit.mse);
  result.beyond = all_beyond(data, result.model, fit, options.exclude);
  result.mean = std::move(fit.mean);
  result.ridge = std::move(fit.ridge);
  result.ridge_global = std::move(fit.ridge_global);
  for (Eigen::Index j = 0; j < y.cols(); ++j) {
    result.rmse.push_back(std::sqrt(fit.mse[j]) * scale[j]);
  }
  restore_units(centre, scale, result);
  return result;
}

} // namespace rim
