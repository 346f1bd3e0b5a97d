// SPDX-License-Identifier: MIT
#include "train/fit_gate.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "stats/robust.hpp"
#include "stats/single.hpp"
#include "util/error.hpp"

namespace rim {
namespace {


// Squared gate distances of all rows to one centre.
Eigen::VectorXd distances(const Matrix &xs, const Eigen::RowVectorXd &centre,
                          const Eigen::RowVectorXd &gate_weight) {
  Eigen::VectorXd out(xs.rows());
  for (Eigen::Index i = 0; i < xs.rows(); ++i) {
    out[i] = ((xs.row(i) - centre).array() * gate_weight.array()).square().sum();
  }
  return out;
}

// 53 random bits: the same on every standard library, unlike std::uniform_real_distribution.
double uniform(std::mt19937_64 &random) {
  return (static_cast<double>(random() >> 11) + 0.5) * 0x1p-53;
}

Matrix plus_plus(const Matrix &xs, const Eigen::RowVectorXd &gate_weight, std::uint32_t count,
                 std::mt19937_64 &random) {
  Matrix centres(count, xs.cols());
  const auto first = static_cast<Eigen::Index>(uniform(random) * static_cast<double>(xs.rows()));
  centres.row(0) = xs.row(first);
  Eigen::VectorXd nearest = distances(xs, centres.row(0), gate_weight);
  for (Eigen::Index p = 1; p < centres.rows(); ++p) {
    double left = uniform(random) * nearest.sum();
    Eigen::Index pick = 0;
    while (pick + 1 < xs.rows() && left > nearest[pick]) {
      left -= nearest[pick++];
    }
    centres.row(p) = xs.row(pick);
    nearest = nearest.cwiseMin(distances(xs, centres.row(p), gate_weight));
  }
  return centres;
}

struct Assignment {
  std::vector<Eigen::Index> nearest;
  Eigen::VectorXd distance; // squared
};

Assignment assign(const Matrix &xs, const Matrix &centres, const Eigen::RowVectorXd &gate_weight) {
  Assignment a;
  a.nearest.assign(static_cast<std::size_t>(xs.rows()), 0);
  a.distance = distances(xs, centres.row(0), gate_weight);
  for (Eigen::Index p = 1; p < centres.rows(); ++p) {
    const Eigen::VectorXd d = distances(xs, centres.row(p), gate_weight);
    for (Eigen::Index i = 0; i < xs.rows(); ++i) {
      if (d[i] < a.distance[i]) {
        a.distance[i] = d[i];
        a.nearest[static_cast<std::size_t>(i)] = p;
      }
    }
  }
  return a;
}

void lloyd(const Matrix &xs, const Eigen::RowVectorXd &gate_weight, Matrix &centres) {
  constexpr int max_rounds = 25;
  std::vector<Eigen::Index> before;
  for (int round = 0; round < max_rounds; ++round) {
    const Assignment a = assign(xs, centres, gate_weight);
    if (a.nearest == before) {
      return;
    }
    Matrix sum = Matrix::Zero(centres.rows(), centres.cols());
    Eigen::VectorXd mass = Eigen::VectorXd::Zero(centres.rows());
    for (Eigen::Index i = 0; i < xs.rows(); ++i) {
      const Eigen::Index p = a.nearest[static_cast<std::size_t>(i)];
      sum.row(p) += xs.row(i);
      mass[p] += 1.0;
    }
    for (Eigen::Index p = 0; p < centres.rows(); ++p) {
      if (mass[p] > 0.0) {
        centres.row(p) = sum.row(p) / mass[p];
      }
    }
    before = a.nearest;
  }
}

// One row's gates from the squared distances d2[P].
void gate_row(const NominalModel &m, const double *d2, std::uint32_t top, std::uint8_t *index,
              double *weight) {
  std::uint32_t kept = 0;
  for (Eigen::Index p = 0; p < m.prototypes.rows(); ++p) {
    const double logit = m.ln_mass[p] - d2[p] / (2.0 * m.bandwidth[p] * m.bandwidth[p]);
    std::uint32_t at = kept;
    while (at > 0 && logit > weight[at - 1]) {
      --at;
    }
    if (at >= top) {
      continue;
    }
    kept = std::min(kept + 1, top);
    for (std::uint32_t i = kept - 1; i > at; --i) {
      weight[i] = weight[i - 1];
      index[i] = index[i - 1];
    }
    weight[at] = logit;
    index[at] = static_cast<std::uint8_t>(p);
  }
  const double largest = weight[0];
  double sum = 0.0;
  for (std::uint32_t k = 0; k < top; ++k) {
    weight[k] = std::exp(weight[k] - largest);
    sum += weight[k];
  }
  for (std::uint32_t k = 0; k < top; ++k) {
    weight[k] /= sum;
  }
}

} // namespace

std::vector<RunSpan> run_spans(const std::vector<std::uint32_t> &run) {
  std::vector<RunSpan> spans;
  std::vector<std::uint32_t> seen;
  for (std::size_t i = 0; i < run.size(); ++i) {
    if (i > 0 && run[i] == run[i - 1]) {
      spans.back().end = i + 1;
      continue;
    }
    if (std::find(seen.begin(), seen.end(), run[i]) != seen.end()) {
      throw DataError("training: the rows of run " + std::to_string(run[i]) +
                      " are not contiguous");
    }
    seen.push_back(run[i]);
    spans.push_back({i, i + 1});
  }
  return spans;
}

std::vector<double> white_noise(const Matrix &series, const std::vector<std::uint32_t> &run) {
  constexpr double median_to_sd = 1.4826; // of the absolute value of a normal
  std::vector<double> out;
  for (Eigen::Index j = 0; j < series.cols(); ++j) {
    std::vector<double> size;
    for (std::size_t i = 2; i < run.size(); ++i) {
      if (run[i] == run[i - 2]) {
        const auto r = static_cast<Eigen::Index>(i);
        size.push_back(std::abs(series(r, j) - 2.0 * series(r - 1, j) + series(r - 2, j)));
      }
    }
    out.push_back(median(std::move(size)) * median_to_sd / std::sqrt(6.0));
  }
  return out;
}

void standardise_inputs(const Matrix &x, NominalModel &model) {
  model.centre.resize(x.cols());
  model.inverse_scale.resize(x.cols());
  const auto n = static_cast<double>(x.rows());
  const Eigen::RowVectorXd mean = x.colwise().sum() / n;
  for (Eigen::Index i = 0; i < x.cols(); ++i) {
    const double sd = std::sqrt((x.col(i).array() - mean[i]).square().sum() / n);
    const bool constant = !(sd > 1e-12 * (1.0 + std::abs(mean[i])));
    model.centre[i] = single(mean[i]);
    model.inverse_scale[i] = constant ? 1.0 : single(1.0 / sd);
  }
}

Matrix standardised(const NominalModel &model, const Matrix &x) {
  Matrix xs(x.rows(), x.cols());
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    xs.row(i) =
        (x.row(i) - model.centre.transpose()).array() * model.inverse_scale.transpose().array();
  }
  return xs;
}

Matrix sample_rows(const Matrix &xs, const Eigen::VectorXd &weight, std::size_t most) {
  const auto count = static_cast<Eigen::Index>(std::min(most, static_cast<std::size_t>(xs.rows())));
  const double total = weight.size() > 0 ? weight.sum() : static_cast<double>(xs.rows());
  const double step = total / static_cast<double>(count);
  Matrix out(count, xs.cols());
  double passed = 0.0; // weight of the rows up to and with `row`
  Eigen::Index row = -1;
  for (Eigen::Index i = 0; i < count; ++i) {
    while (row + 1 < xs.rows() && passed <= (static_cast<double>(i) + 0.5) * step) {
      passed += weight.size() > 0 ? weight[++row] : (++row, 1.0);
    }
    out.row(i) = xs.row(row);
  }
  return out;
}

Eigen::VectorXd place_prototypes(const Matrix &sample, std::uint32_t count, std::uint64_t seed,
                                 NominalModel &model) {
  const Eigen::RowVectorXd gate_weight = model.gate_weight.transpose();
  std::mt19937_64 random(seed);
  Matrix centres = plus_plus(sample, gate_weight, count, random);
  lloyd(sample, gate_weight, centres);
  model.prototypes = centres.unaryExpr(&single);
  model.ln_mass = Eigen::VectorXd::Zero(count);
  model.reach = Eigen::VectorXd::Zero(count);

  const Assignment a = assign(sample, model.prototypes, gate_weight);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(count);
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(count);
  for (Eigen::Index i = 0; i < sample.rows(); ++i) {
    sum[a.nearest[static_cast<std::size_t>(i)]] += a.distance[i];
    mass[a.nearest[static_cast<std::size_t>(i)]] += 1.0;
  }
  const double typical = std::max(std::sqrt(sum.sum() / mass.sum()), 1e-6);
  Eigen::VectorXd radius(count);
  for (Eigen::Index p = 0; p < radius.size(); ++p) {
    // A prototype on a few equal rows must still have a width: never below a tenth of the typical.
    const double own = mass[p] > 0.0 ? std::sqrt(sum[p] / mass[p]) : typical;
    radius[p] = std::max(own, 0.1 * typical);
  }
  return radius;
}

void open_gates(const NominalModel &model, const Matrix &xs, RunSpan rows, Gates &gates,
                Eigen::VectorXd *reach_squared) {
  const Eigen::Index count = model.prototypes.rows();
  std::vector<double> d2(static_cast<std::size_t>(count));
  for (std::size_t i = rows.begin; i < rows.end; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    Eigen::Index nearest = 0;
    for (Eigen::Index p = 0; p < count; ++p) {
      d2[static_cast<std::size_t>(p)] =
          ((xs.row(row) - model.prototypes.row(p)).array() * model.gate_weight.transpose().array())
              .square()
              .sum();
      if (d2[static_cast<std::size_t>(p)] < d2[static_cast<std::size_t>(nearest)]) {
        nearest = p;
      }
    }
    if (reach_squared != nullptr) {
      double &reach = (*reach_squared)[nearest];
      reach = std::max(reach, d2[static_cast<std::size_t>(nearest)]);
    }
    gate_row(model, d2.data(), gates.top, &gates.index[i * gates.top],
             &gates.weight[i * gates.top]);
  }
}

} // namespace rim
