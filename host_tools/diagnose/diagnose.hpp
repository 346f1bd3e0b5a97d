// SPDX-License-Identifier: MIT
// diagnose/diagnose.hpp - from predicted logs to a diagnosis: where, why, the extended model, the
// gain.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "diagnose/catalogue.hpp"
#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"
#include "predict/predictor.hpp"

namespace rim::diagnose {

struct Options {
  Catalogue catalogue;                         // read_catalogue(data_path("causes.toml"))
  std::vector<Term> given;                     // --extension
  std::vector<Log> holdout;                    // predicted like the others; empty: cross-validation
  double horizon_s = 0.0;                      // 0: one step only
  const world::Predictor *predictor = nullptr; // rolls out; null: the logs' own predictions
  double false_alarm = 0.05;                   // of any claim where nothing is wrong
  std::size_t null_runs = 0; // a channel; 0: as many as make 96 in all, at least 16
  std::uint64_t seed = 1;
  bool gains = true;
  std::string command, model;
  // Outcome ("z.force_N") -> the feature that is the velocity its friction acts on: not inferred.
  std::map<std::string, std::string> velocities;
};

// Logs carry z. and m. columns. DataError: see make_measured(); fewer rows than a fit needs.
Diagnosis diagnose(const std::vector<Log> &logs, const Options &options, Measured *table);

} // namespace rim::diagnose
