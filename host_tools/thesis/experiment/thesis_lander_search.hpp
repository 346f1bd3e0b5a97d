// SPDX-License-Identifier: MIT
// Offline FS-RIM on binned contexts: Alg. 4 (p. 49) with heuristic H3 (eq. 4.5, p. 52).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace rim {

// A region over zero to two features and what it holds.
struct ThesisRegion {
  int features[2] = {-1, -1};
  double ln_anom = 0.0;
  int outcome = -1; // with the largest share
};

// Sufficient statistics of everything seen, for every pair of features on a grid. About 400 bytes
// times 8 * 256 per pair: 20 MB for 29 features and 25 outcomes.
class ThesisSearch {
public:
  static constexpr int bins = 16;

  ThesisSearch(int features, int outcomes, std::uint64_t seed);

  // One observation: its bin of each feature, and per outcome dz / var and 1 / var.
  void add(const std::uint8_t *bin, const float *weighted, const float *weight);

  // Best-first search from the empty projection. O(expansions * (features + ellipses) * bins *
  // outcomes).
  ThesisRegion search(std::uint32_t expansions) const;

private:
  using Table = std::vector<float>; // bins x statistics

  struct Node {
    int feature = -1; // first feature; its interval [from, to] is the base for a second
    int from = 0, to = bins - 1;
    ThesisRegion region;
  };
  struct Edge {
    int base = -1; // node that it extends; -1: the empty projection
    int feature = -1;
    int from = 0, to = bins - 1; // the most anomalous range, given the base
    double ln_anom = 0.0;        // H3
  };

  std::size_t cells(int a, int b) const;
  const float *cell(int a, int b, int i, int j) const;
  Table table_of(int feature) const;
  Table table_given(const Node &base, int feature) const;
  double score(const float *statistics, int *outcome) const;
  void best_interval(const Table &table, Edge &edge, int *outcome) const;
  std::vector<Edge> edges_of(int base, const std::vector<Node> &nodes) const;
  ThesisRegion best_ellipse(const Node &base, const Edge &edge) const;

  int features_, outcomes_;
  std::size_t width_; // statistics a cell: outcomes x {dz / var, 1 / var}
  std::uint64_t seed_;
  std::vector<float> grid_; // pair a < b, bin of a, bin of b, statistics
};

} // namespace rim
