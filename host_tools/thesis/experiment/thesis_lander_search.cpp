// SPDX-License-Identifier: MIT
#include "thesis/experiment/thesis_lander_search.hpp"

#include <algorithm>
#include <cmath>

#include "base/rng.h"

namespace rim {

ThesisSearch::ThesisSearch(int features, int outcomes, std::uint64_t seed)
    : features_(features), outcomes_(outcomes), width_(2 * static_cast<std::size_t>(outcomes)),
      seed_(seed) {
  const auto n = static_cast<std::size_t>(features);
  grid_.assign(n * (n - 1) / 2 * bins * bins * width_, 0.0F);
}

std::size_t ThesisSearch::cells(int a, int b) const {
  // Pairs in order (0,1) (0,2) ... (1,2) ...
  const auto i = static_cast<std::size_t>(a);
  const auto n = static_cast<std::size_t>(features_);
  const std::size_t pair = i * (2 * n - i - 1) / 2 + static_cast<std::size_t>(b) - i - 1;
  return pair * bins * bins * width_;
}

// Cell of bin i of feature a and bin j of feature b, whichever comes first.
const float *ThesisSearch::cell(int a, int b, int i, int j) const {
  const bool swap = a > b;
  const auto row = static_cast<std::size_t>(swap ? j : i);
  const auto column = static_cast<std::size_t>(swap ? i : j);
  return &grid_[(swap ? cells(b, a) : cells(a, b)) + (row * bins + column) * width_];
}

void ThesisSearch::add(const std::uint8_t *bin, const float *weighted, const float *weight) {
  const auto outcomes = static_cast<std::size_t>(outcomes_);
  std::size_t pair = 0;
  for (int a = 0; a < features_; ++a) {
    for (int b = a + 1; b < features_; ++b, ++pair) {
      float *at = &grid_[((pair * bins + bin[a]) * bins + bin[b]) * width_];
      for (std::size_t k = 0; k < outcomes; ++k) {
        at[k] += weighted[k];
        at[outcomes + k] += weight[k];
      }
    }
  }
}

// Eq. 3.7 (p. 28), diagonal, summed over the outcomes.
double ThesisSearch::score(const float *statistics, int *outcome) const {
  const auto outcomes = static_cast<std::size_t>(outcomes_);
  double sum = 0.0;
  double largest = -1.0;
  for (std::size_t k = 0; k < outcomes; ++k) {
    const double s = statistics[k];
    const double w = statistics[outcomes + k];
    const double f = w > 0.0 ? 0.5 * s * s / w : 0.0;
    sum += f;
    if (outcome != nullptr && f > largest) {
      largest = f;
      *outcome = static_cast<int>(k);
    }
  }
  return sum;
}

ThesisSearch::Table ThesisSearch::table_of(int feature) const {
  Node everything;
  everything.feature = feature == 0 ? 1 : 0;
  return table_given(everything, feature);
}

// One-dimensional statistics of a feature over the rows in the base's interval.
ThesisSearch::Table ThesisSearch::table_given(const Node &base, int feature) const {
  Table table(bins * width_, 0.0F);
  for (int i = base.from; i <= base.to; ++i) {
    for (int j = 0; j < bins; ++j) {
      const float *from = cell(base.feature, feature, i, j);
      float *to = &table[static_cast<std::size_t>(j) * width_];
      for (std::size_t k = 0; k < width_; ++k) {
        to[k] += from[k];
      }
    }
  }
  return table;
}

// The exact most anomalous interval, App. A (p. 115): O(bins^2 outcomes).
void ThesisSearch::best_interval(const Table &table, Edge &edge, int *outcome) const {
  std::vector<float> sum(width_);
  for (int from = 0; from < bins; ++from) {
    std::fill(sum.begin(), sum.end(), 0.0F);
    for (int to = from; to < bins; ++to) {
      const float *add = &table[static_cast<std::size_t>(to) * width_];
      for (std::size_t k = 0; k < width_; ++k) {
        sum[k] += add[k];
      }
      int which = -1;
      const double f = score(sum.data(), outcome != nullptr ? &which : nullptr);
      if (f > edge.ln_anom) {
        edge.ln_anom = f;
        edge.from = from;
        edge.to = to;
        if (outcome != nullptr) {
          *outcome = which;
        }
      }
    }
  }
}

std::vector<ThesisSearch::Edge> ThesisSearch::edges_of(int base,
                                                       const std::vector<Node> &nodes) const {
  std::vector<Edge> edges;
  for (int f = 0; f < features_; ++f) {
    if (base >= 0 && nodes[static_cast<std::size_t>(base)].feature == f) {
      continue;
    }
    Edge edge;
    edge.base = base;
    edge.feature = f;
    const Table table =
        base < 0 ? table_of(f) : table_given(nodes[static_cast<std::size_t>(base)], f);
    best_interval(table, edge, nullptr);
    edges.push_back(edge);
  }
  return edges;
}

namespace {

struct Ellipse {
  double center[2], ln_axis[2], angle;
};

// Statistics inside an ellipse over bin coordinates: a range of columns for each row of the grid.
class EllipseSum {
public:
  EllipseSum(std::vector<double> prefix, std::size_t width)
      : prefix_(std::move(prefix)), width_(width), sum_(width) {}

  // Half s^2 / w over the outcomes; and the outcome with the largest share.
  double operator()(const Ellipse &e, int *outcome) {
    constexpr int n = ThesisSearch::bins;
    const double c = std::cos(e.angle);
    const double s = std::sin(e.angle);
    const double p = std::exp(-2.0 * e.ln_axis[0]);
    const double q = std::exp(-2.0 * e.ln_axis[1]);
    // (x - u)' A^-1 (x - u) < 1, eq. 3.8 (p. 29)
    const double a = p * c * c + q * s * s;
    const double b = (p - q) * c * s;
    const double d = p * s * s + q * c * c;
    std::fill(sum_.begin(), sum_.end(), 0.0);
    for (int i = 0; i < n; ++i) {
      const double dx = i + 0.5 - e.center[0];
      const double root = b * b * dx * dx - d * (a * dx * dx - 1.0);
      if (root <= 0.0) {
        continue;
      }
      const double middle = e.center[1] - b * dx / d - 0.5;
      const double half = std::sqrt(root) / d;
      const int from = std::max(0, static_cast<int>(std::ceil(std::max(middle - half, -1.0))));
      const int to = std::min(n - 1, static_cast<int>(std::floor(std::min(middle + half, 20.0))));
      if (from <= to) {
        const double *high = &prefix_[(static_cast<std::size_t>(i * (n + 1) + to) + 1) * width_];
        const double *low = &prefix_[static_cast<std::size_t>(i * (n + 1) + from) * width_];
        for (std::size_t k = 0; k < width_; ++k) {
          sum_[k] += high[k] - low[k];
        }
      }
    }
    return score(outcome);
  }

private:
  double score(int *outcome) const {
    double total = 0.0;
    double largest = -1.0;
    const std::size_t outcomes = width_ / 2;
    for (std::size_t k = 0; k < outcomes; ++k) {
      // Differences of prefix sums leave a rounding where nothing was added.
      const double w = sum_[outcomes + k];
      const double f = w > 1e-9 ? 0.5 * sum_[k] * sum_[k] / w : 0.0;
      total += f;
      if (f > largest) {
        largest = f;
        *outcome = static_cast<int>(k);
      }
    }
    return total;
  }

  std::vector<double> prefix_;
  std::size_t width_;
  std::vector<double> sum_;
};

using Parameters = std::array<double, 5>;

Ellipse ellipse_of(const Parameters &p) { return {{p[0], p[1]}, {p[2], p[3]}, p[4]}; }

} // namespace

// The cross-entropy method (3.2, p. 29) from the ellipse inscribed in the rectangle that H3 found.
ThesisRegion ThesisSearch::best_ellipse(const Node &base, const Edge &edge) const {
  constexpr int rounds = 6;
  constexpr std::size_t samples = 24;
  constexpr std::size_t elites = 5;
  std::vector<double> prefix(static_cast<std::size_t>(bins * (bins + 1)) * width_, 0.0);
  for (int i = 0; i < bins; ++i) {
    for (int j = 0; j < bins; ++j) {
      const float *from = cell(base.feature, edge.feature, i, j);
      double *at = &prefix[static_cast<std::size_t>(i * (bins + 1) + j) * width_];
      for (std::size_t k = 0; k < width_; ++k) {
        at[width_ + k] = at[k] + static_cast<double>(from[k]);
      }
    }
  }
  EllipseSum evaluate(std::move(prefix), width_);

  const double half_a = 0.5 * (base.to - base.from + 1);
  const double half_b = 0.5 * (edge.to - edge.from + 1);
  Parameters mean = {base.from + half_a, edge.from + half_b, std::log(half_a * 1.2),
                     std::log(half_b * 1.2), 0.0};
  Parameters sd = {2.0, 2.0, 0.5, 0.5, 0.6};
  rim_rng random;
  rimi_rng_seed(&random, seed_, static_cast<std::uint64_t>(base.feature * 256 + edge.feature));

  ThesisRegion best;
  best.features[0] = base.feature;
  best.features[1] = edge.feature;
  for (int round = 0; round < rounds; ++round) {
    std::array<std::pair<double, Parameters>, samples> tried;
    for (std::size_t i = 0; i < samples; ++i) {
      Parameters &p = tried[i].second;
      for (std::size_t k = 0; k < p.size(); ++k) {
        p[k] = mean[k] + (i == 0 ? 0.0 : sd[k] * rimi_rng_normal(&random));
      }
      p[2] = std::min(std::max(p[2], -0.7), 4.0);
      p[3] = std::min(std::max(p[3], -0.7), 4.0);
      int outcome = -1;
      tried[i].first = evaluate(ellipse_of(p), &outcome);
      if (tried[i].first > best.ln_anom) {
        best.ln_anom = tried[i].first;
        best.outcome = outcome;
      }
    }
    std::stable_sort(tried.begin(), tried.end(),
                     [](const auto &a, const auto &b) { return a.first > b.first; });
    for (std::size_t k = 0; k < mean.size(); ++k) {
      double sum = 0.0;
      double squares = 0.0;
      for (std::size_t i = 0; i < elites; ++i) {
        sum += tried[i].second[k];
        squares += tried[i].second[k] * tried[i].second[k];
      }
      mean[k] = sum / elites;
      sd[k] = std::sqrt(std::max(squares / elites - mean[k] * mean[k], 1e-4));
    }
  }
  return best;
}

ThesisRegion ThesisSearch::search(std::uint32_t expansions) const {
  ThesisRegion best; // of everything: the empty projection holds all rows
  const Table all = table_of(0);
  std::vector<float> sum(width_, 0.0F);
  for (std::size_t at = 0; at < all.size(); ++at) {
    sum[at % width_] += all[at];
  }
  best.ln_anom = score(sum.data(), &best.outcome);

  std::vector<Node> nodes;
  std::vector<Edge> edges = edges_of(-1, nodes);
  std::vector<std::pair<int, int>> done; // pairs, explored from either side
  for (std::uint32_t i = 0; i < expansions && !edges.empty(); ++i) {
    const auto top = std::max_element(edges.begin(), edges.end(), [](const Edge &a, const Edge &b) {
      return a.ln_anom < b.ln_anom;
    });
    const Edge edge = *top;
    edges.erase(top);
    ThesisRegion found;
    if (edge.base < 0) {
      Edge again = edge;
      again.ln_anom = 0.0;
      best_interval(table_of(edge.feature), again, &found.outcome);
      found.features[0] = edge.feature;
      found.ln_anom = again.ln_anom;
      Node node;
      node.feature = edge.feature;
      node.from = again.from;
      node.to = again.to;
      node.region = found;
      nodes.push_back(node);
      const std::vector<Edge> more = edges_of(static_cast<int>(nodes.size()) - 1, nodes);
      edges.insert(edges.end(), more.begin(), more.end());
    } else {
      const Node &base = nodes[static_cast<std::size_t>(edge.base)];
      const auto pair = std::minmax(base.feature, edge.feature);
      if (std::find(done.begin(), done.end(), std::pair<int, int>(pair)) != done.end()) {
        continue;
      }
      done.emplace_back(pair);
      found = best_ellipse(base, edge);
    }
    if (found.ln_anom > best.ln_anom) {
      best = found;
    }
  }
  return best;
}

} // namespace rim
