// SPDX-License-Identifier: MIT
// tests/hidden/grade.hpp - a diagnosis beside the truth: one line of JSON a case, and the figures
// of many.
//
// A case's line: seed family world noise null two expected["cause@channel"]
// claimed["cause@channel"] exit seconds failed (no usable diagnosis) found named two_named
// false_claim f1 gain_share worse worse_ratio separable listed (the expected cause is among the
// first finding's alternatives) notes. Fields that do not apply are null.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace grade {

using Json = nlohmann::json;

// Reads a truth file and the folder that `rim diagnose --out` wrote. std::runtime_error: the truth
// is unreadable. A missing or broken diagnosis is a graded failure, not an error.
Json grade_case(const std::string &truth_path, const std::string &folder, int exit_status,
                double seconds);

// The figures of issue 3 over the lines: measured, interval, asked; then by family; then every
// case that failed in something.
struct Figure {
  std::string key, what;
  double value = 0.0, low = 0.0, high = 0.0; // NaN: no case
  std::size_t hits = 0, cases = 0;           // hits: of a share; 0 for medians
  double asked = 0.0;
  bool at_most = false, share = true;
  bool reached() const { return cases == 0 || (at_most ? value <= asked : value >= asked); }
};
std::vector<Figure> figures(const std::vector<Json> &lines);
std::string summary_text(const std::vector<Json> &lines);
// Lines "key bound" of a floors file against the figures; one line of text each, "ok" or "FAILED".
// Sets `failed` to the number of those not reached.
std::string check_floors(const std::vector<Json> &lines, const std::string &floors_path,
                         int &failed);

} // namespace grade
