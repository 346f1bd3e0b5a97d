// SPDX-License-Identifier: MIT
// thesis/experiment/search_curve.hpp - what a search over a finished set finds for how much work:
// FS-RIM with its three heuristics, breadth first, and no selection of features (thesis 4.2.1).
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "thesis/experiment/plan_figure.hpp"
#include "batch/select_batch.h"
#include "thesis/shard.hpp"
#include "util/table.hpp"

namespace rim {

constexpr std::size_t kSearchMethods = 5;
const char *search_method_name(std::size_t method); // FS H3, FS H2, FS H1, BFS, No FS
// Feature sets explored at each point of a curve.
const std::vector<std::uint16_t> &search_checkpoints();

struct SearchPoint {
  double evaluations = 0.0; // of the likelihood of a region or along one feature, each O(n)
  double f1 = 0.0;          // eq. 4.7
};

// One point a checkpoint. No FS takes a cross-entropy search over ellipsoids in all features, their
// axes along the features where there are more than RIM_CEM_MAX_DIMS, with as many evaluations as
// FS H3 has used at that checkpoint, at most 6000. Deterministic.
std::vector<SearchPoint> search_curve(std::size_t method, const rim_batch_data &data,
                                      const std::vector<bool> &truth, std::uint64_t seed);

// All methods: [method][checkpoint][evaluations, F1].
nlohmann::json search_curves(const rim_batch_data &data, const std::vector<bool> &truth,
                             std::uint64_t seed);

// Of several runs' search_curves: a panel of F1 against evaluations, and table rows.
struct SearchPanel {
  std::string title;
  std::vector<nlohmann::json> runs;
  double reference = -1.0; // F1 of what they are compared with, "ours"; below 0: nothing
};
void add_search_rows(Table &table, const SearchPanel &panel, const std::vector<std::string> &last);
std::vector<TableColumn> search_columns(); // the last column is the caller's
void plot_search(const std::vector<SearchPanel> &panels, const std::string &path);

} // namespace rim
