// SPDX-License-Identifier: MIT
#include "thesis/experiment/thesis_lander.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "thesis/experiment/thesis_lander_search.hpp"
#include "train/fit.hpp"
#include "train/kernel.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"

namespace rim {
namespace {

// Contexts and the outcomes one row later; rows that were skipped between them break the pair.
struct Transitions {
  Matrix x, y;
};

Transitions transitions_of(const Log &log) {
  const std::vector<int> features = feature_columns(log);
  const std::vector<int> sensors = role_columns(log, Role::sensor);
  std::vector<Eigen::Index> first;
  for (Eigen::Index i = 0; i + 1 < log.values.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (log.row[at + 1] == log.row[at] + 1) {
      first.push_back(i);
    }
  }
  Transitions t;
  const auto rows = static_cast<Eigen::Index>(first.size());
  t.x.resize(rows, static_cast<Eigen::Index>(features.size()));
  t.y.resize(rows, static_cast<Eigen::Index>(sensors.size()));
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index at = first[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < t.x.cols(); ++k) {
      t.x(i, k) = log.values(at, features[static_cast<std::size_t>(k)]);
    }
    for (Eigen::Index k = 0; k < t.y.cols(); ++k) {
      t.y(i, k) = log.values(at + 1, sensors[static_cast<std::size_t>(k)]);
    }
  }
  return t;
}

// At most 15 edges of a feature: half are quantiles of its values, half of its distinct values, so
// that a command which is mostly zero still has bins where it is not.
std::vector<double> bin_edges(std::vector<double> values) {
  const auto quantiles = [](const std::vector<double> &sorted, int count,
                            std::vector<double> &edges) {
    for (int k = 1; k <= count; ++k) {
      edges.push_back(sorted[sorted.size() * static_cast<std::size_t>(k) /
                             static_cast<std::size_t>(count + 1)]);
    }
  };
  std::vector<double> edges;
  std::sort(values.begin(), values.end());
  quantiles(values, 8, edges);
  values.erase(std::unique(values.begin(), values.end()), values.end());
  quantiles(values, ThesisSearch::bins - 1 - 8, edges);
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// Bandwidth of the largest Gaussian likelihood on left-out runs.
double choose_bandwidth(const PlainKernel &kernel, const std::vector<Transitions> &logs,
                        const Eigen::RowVectorXd &least_variance,
                        const std::vector<double> &times) {
  constexpr Eigen::Index rows_a_run = 20;
  std::vector<double> candidates;
  for (const double t : times) {
    candidates.push_back(t * kernel.spacing());
  }
  const auto count = static_cast<Eigen::Index>(candidates.size());
  std::vector<Eigen::VectorXd> loss(logs.size(), Eigen::VectorXd::Zero(count));
  parallel_for(logs.size(), [&](std::size_t r) {
    Matrix mean;
    Matrix variance;
    for (Eigen::Index k = 0; k < rows_a_run; ++k) {
      const Eigen::Index at = k * logs[r].x.rows() / rows_a_run;
      kernel.predict(logs[r].x.row(at).data(), static_cast<std::uint32_t>(r), candidates, mean,
                     variance);
      variance = variance.cwiseMax(least_variance.replicate(count, 1));
      const Matrix squares = (mean.rowwise() - logs[r].y.row(at)).cwiseAbs2();
      loss[r] +=
          (squares.array() / variance.array() + variance.array().log()).rowwise().sum().matrix();
    }
  });
  Eigen::VectorXd sum = loss.front();
  for (std::size_t r = 1; r < loss.size(); ++r) {
    sum += loss[r];
  }
  Eigen::Index best = 0;
  sum.minCoeff(&best);
  return candidates[static_cast<std::size_t>(best)];
}

} // namespace

struct ThesisLander::Model {
  ThesisOptions options;
  std::unique_ptr<PlainKernel> kernel;
  double bandwidth = 1.0;
  Eigen::RowVectorXd least_variance;
  std::vector<std::vector<double>> edges; // per feature
  std::vector<double> threshold;          // per instant

  std::size_t instant(std::uint32_t rows) const {
    const std::size_t at = (rows - 1) / options.every_rows;
    return std::min(at, threshold.size() - 1);
  }

  std::vector<ThesisPoint> run(const Transitions &log, std::uint32_t without_run) const;
  void learn(const std::vector<Transitions> &logs);
};

std::vector<ThesisPoint> ThesisLander::Model::run(const Transitions &log,
                                                  std::uint32_t without_run) const {
  if (log.x.cols() != static_cast<Eigen::Index>(edges.size()) ||
      log.y.cols() != least_variance.size()) {
    throw DataError("log: other columns than the baseline was trained on");
  }
  ThesisSearch search(static_cast<int>(edges.size()), static_cast<int>(log.y.cols()), options.seed);
  std::vector<ThesisPoint> points;
  std::vector<std::uint8_t> bin(edges.size());
  Matrix mean;
  Matrix variance;
  for (Eigen::Index i = 0; i < log.x.rows(); ++i) {
    kernel->predict(log.x.row(i).data(), without_run, {bandwidth}, mean, variance);
    variance = variance.cwiseMax(least_variance);
    // In units of the least deviation, which leaves eq. 3.7 as it is and suits single precision.
    const Eigen::RowVectorXd w = least_variance.array() / variance.row(0).array();
    const Eigen::RowVectorXd r =
        (log.y.row(i) - mean.row(0)).array() * w.array() / least_variance.array().sqrt();
    const Eigen::RowVectorXf weighted = r.cast<float>();
    const Eigen::RowVectorXf weight = w.cast<float>();
    for (std::size_t f = 0; f < edges.size(); ++f) {
      const auto at = std::upper_bound(edges[f].begin(), edges[f].end(),
                                       log.x(i, static_cast<Eigen::Index>(f)));
      bin[f] = static_cast<std::uint8_t>(at - edges[f].begin());
    }
    search.add(bin.data(), weighted.data(), weight.data());
    const auto rows = static_cast<std::uint32_t>(i + 1);
    if (rows % options.every_rows == 0 || i + 1 == log.x.rows()) {
      const ThesisRegion region = search.search(options.expansions);
      ThesisPoint point;
      point.rows = rows;
      point.ln_anom = region.ln_anom;
      point.outcome = region.outcome;
      point.features[0] = region.features[0];
      point.features[1] = region.features[1];
      points.push_back(point);
    }
  }
  return points;
}

// Kernel, bins and the threshold of every instant from each log left out.
void ThesisLander::Model::learn(const std::vector<Transitions> &logs) {
  Eigen::Index rows = 0;
  for (const Transitions &log : logs) {
    if (log.x.cols() != logs.front().x.cols() || log.y.cols() != logs.front().y.cols() ||
        log.x.rows() == 0) {
      throw DataError("training: logs of different columns, or a log without rows");
    }
    rows += log.x.rows();
  }
  Matrix x(rows, logs.front().x.cols());
  Matrix y(rows, logs.front().y.cols());
  std::vector<std::uint32_t> run;
  for (std::size_t r = 0; r < logs.size(); ++r) {
    x.middleRows(static_cast<Eigen::Index>(run.size()), logs[r].x.rows()) = logs[r].x;
    y.middleRows(static_cast<Eigen::Index>(run.size()), logs[r].y.rows()) = logs[r].y;
    run.insert(run.end(), static_cast<std::size_t>(logs[r].x.rows()),
               static_cast<std::uint32_t>(r));
  }
  for (Eigen::Index f = 0; f < x.cols(); ++f) {
    const Eigen::VectorXd column = x.col(f);
    edges.push_back(bin_edges({column.data(), column.data() + column.size()}));
  }
  const std::vector<double> noise = white_noise(y, run);
  const Eigen::RowVectorXd spread =
      ((y.rowwise() - y.colwise().mean()).colwise().squaredNorm() / static_cast<double>(rows));
  least_variance.resize(y.cols());
  for (Eigen::Index j = 0; j < y.cols(); ++j) {
    const double sd = noise[static_cast<std::size_t>(j)];
    least_variance[j] = std::max({sd * sd, 1e-9 * spread[j], 1e-30});
  }
  kernel = std::make_unique<PlainKernel>(x, y, run, options.kernel_rows, options.neighbours);
  bandwidth = choose_bandwidth(*kernel, logs, least_variance, options.bandwidth);
}

ThesisLander::ThesisLander(const std::vector<Log> &nominal, const ThesisOptions &options)
    : model_(std::make_unique<Model>()) {
  if (nominal.size() < 3) {
    throw DataError("training: the baseline needs at least three logs");
  }
  std::vector<Transitions> logs;
  for (const Log &log : nominal) {
    logs.push_back(transitions_of(log));
  }
  model_->options = options;
  model_->learn(logs);
  std::vector<std::vector<ThesisPoint>> runs(logs.size());
  parallel_for(logs.size(), [&](std::size_t r) {
    runs[r] = model_->run(logs[r], static_cast<std::uint32_t>(r));
  });
  std::size_t instants = 0;
  for (const auto &points : runs) {
    instants = std::max(instants, points.size());
  }
  for (std::size_t i = 0; i < instants; ++i) {
    // A log that ended earlier keeps its last value: nothing more was seen of it.
    std::vector<double> values;
    for (const auto &points : runs) {
      values.push_back(points[std::min(i, points.size() - 1)].ln_anom);
    }
    std::sort(values.begin(), values.end());
    const auto n = static_cast<double>(values.size());
    const auto rank = static_cast<std::size_t>(std::ceil(options.confidence * n));
    model_->threshold.push_back(values[std::max<std::size_t>(rank, 1) - 1]);
  }
}

ThesisLander::~ThesisLander() = default;

std::vector<ThesisPoint> ThesisLander::run(const Log &log) const {
  std::vector<ThesisPoint> points = model_->run(transitions_of(log), PlainKernel::no_run);
  for (ThesisPoint &p : points) {
    p.normalised = p.ln_anom / threshold(p.rows);
  }
  return points;
}

double ThesisLander::bandwidth() const { return model_->bandwidth; }

double ThesisLander::threshold(std::uint32_t rows) const {
  return model_->threshold[model_->instant(std::max(rows, 1U))];
}

double thesis_scale(const std::vector<std::vector<ThesisPoint>> &nominal, double rate) {
  std::vector<double> largest;
  for (const auto &run : nominal) {
    double m = 0.0;
    for (const ThesisPoint &p : run) {
      m = std::max(m, p.normalised);
    }
    largest.push_back(m);
  }
  std::sort(largest.begin(), largest.end());
  const auto n = static_cast<double>(largest.size());
  const auto allowed = static_cast<std::size_t>(std::floor(rate * n + 1e-9));
  if (allowed >= largest.size()) {
    return 0.0;
  }
  return largest[largest.size() - 1 - allowed];
}

ThesisDetection thesis_detect(const std::vector<ThesisPoint> &run, double scale) {
  for (const ThesisPoint &p : run) {
    if (p.normalised > scale) {
      return {true, p.rows, p.outcome};
    }
  }
  return {};
}

} // namespace rim
