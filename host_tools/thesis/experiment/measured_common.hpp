// SPDX-License-Identifier: MIT
// What the experiments on measured logs share: reading and predicting them, judging an extension on
// rows of choice, and saying whether a figure is met.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "diagnose/diagnose.hpp"
#include "log/schema.hpp"

namespace rim::experiment {

struct MeasuredOptions {
  std::string data;                 // folder of the logs
  std::vector<std::string> exclude; // logs not used at all, by the file's stem
  double horizon_s = 10.0;
  std::size_t null_runs = 0; // as diagnose::Options
  std::uint64_t seed = 1;
};

// options.data; DataError where there is no such folder.
std::string measured_folder(const MeasuredOptions &options);

// Stems of the folder's logs, sorted, without those excluded; `is_log` chooses.
std::vector<std::string> measured_names(const std::string &folder, const MeasuredOptions &options,
                                        const std::function<bool(const std::string &)> &is_log);

// One measured log as the world predicts it.
Log predicted_log(const std::string &path, const Schema &schema, const world::Predictor &world);

std::vector<diagnose::Term> terms_of(const diagnose::Diagnosis &diagnosis);

// RMSE after over before on the rows of one channel where `where` is 1.
struct Judgement {
  std::size_t rows = 0;
  double before = 0.0, after = 0.0, ratio = 1.0;
  diagnose::Interval95 ci95; // of the ratio, by resampling blocks of a twentieth of a log
};
Judgement judge(const std::vector<diagnose::Term> &terms, const diagnose::Measured &held,
                const std::string &channel, const std::vector<std::uint8_t> &where,
                std::uint64_t seed);
// The same of two sets of terms: the first is "before".
Judgement judge(const std::vector<diagnose::Term> &first, const std::vector<diagnose::Term> &second,
                const diagnose::Measured &held, const std::string &channel,
                const std::vector<std::uint8_t> &where, std::uint64_t seed);

// "0.131 (0.086 to 0.203)"; "-" without rows.
std::string ratio_text(const Judgement &judgement);
std::string ratio_text(double ratio, const diagnose::Interval95 &ci95);

// "quadratic_drag", with "or hinge" where the data cannot tell, and where it acts.
std::string cause_text(const diagnose::Finding &finding);

} // namespace rim::experiment
