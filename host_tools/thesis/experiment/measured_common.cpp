// SPDX-License-Identifier: MIT
#include "thesis/experiment/measured_common.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "diagnose/gain.hpp"
#include "util/error.hpp"

namespace rim::experiment {

namespace fs = std::filesystem;
using diagnose::Diagnosis;
using diagnose::Finding;
using diagnose::Measured;
using diagnose::Term;
using diagnose::TermKind;

namespace {

constexpr std::size_t kBlocks = 20; // of a log, resampled whole
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

} // namespace

std::string measured_folder(const MeasuredOptions &options) {
  if (!fs::is_directory(options.data))
    throw DataError("--data " + options.data + ": no such folder");
  return options.data;
}

std::vector<std::string> measured_names(const std::string &folder, const MeasuredOptions &options,
                                        const std::function<bool(const std::string &)> &is_log) {
  std::vector<std::string> names;
  for (const auto &entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    const auto &gone = options.exclude;
    if (entry.path().extension() == ".csv" && is_log(name) &&
        std::find(gone.begin(), gone.end(), name) == gone.end())
      names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

Log predicted_log(const std::string &path, const Schema &schema, const world::Predictor &world) {
  return world.predict(read_log(path, &schema));
}

std::vector<Term> terms_of(const Diagnosis &diagnosis) {
  std::vector<Term> terms;
  for (const Finding &finding : diagnosis.findings)
    terms.push_back(finding.term);
  return terms;
}

Judgement judge(const std::vector<Term> &first, const std::vector<Term> &second,
                const Measured &held, const std::string &channel,
                const std::vector<std::uint8_t> &where, std::uint64_t seed) {
  const diagnose::Channel &c =
      held.channels.at(static_cast<std::size_t>(held.find_channel(channel)));
  const auto before = diagnose::extended_prediction(first, c, held);
  const auto after = diagnose::extended_prediction(second, c, held);
  diagnose::Judged judged;
  std::size_t unit = kNone;
  for (std::size_t l = 0; l < held.logs.size(); ++l) {
    std::size_t block = kNone;
    for (std::size_t r = 0; r < held.logs[l].rows; ++r) {
      const std::size_t i = held.logs[l].first + r;
      const auto k = static_cast<Eigen::Index>(i);
      if (where.at(i) == 0)
        continue;
      if (r * kBlocks / held.logs[l].rows != block) { // without empty units
        block = r * kBlocks / held.logs[l].rows;
        ++unit;
      }
      judged.z.push_back(c.z(k));
      judged.before.push_back(before.m(k));
      judged.after.push_back(after.m(k));
      judged.sd_before.push_back(before.sd(k));
      judged.sd_after.push_back(after.sd(k));
      judged.inside.push_back(0);
      judged.unit.push_back(unit);
    }
  }
  Judgement result;
  const auto gains = diagnose::summarise(judged, c, 0.0, "held-out logs", seed);
  if (!gains.empty()) {
    const diagnose::Gain &gain = gains.front();
    result = {gain.rows, gain.rmse_before, gain.rmse_after, gain.ratio, gain.ratio_ci95};
  }
  return result;
}

Judgement judge(const std::vector<Term> &terms, const Measured &held, const std::string &channel,
                const std::vector<std::uint8_t> &where, std::uint64_t seed) {
  return judge({}, terms, held, channel, where, seed);
}

std::string ratio_text(double ratio, const diagnose::Interval95 &ci95) {
  return fmt::format("{:.3f} ({:.3f} to {:.3f})", ratio, ci95.low, ci95.high);
}

std::string ratio_text(const Judgement &judgement) {
  return judgement.rows > 0 ? ratio_text(judgement.ratio, judgement.ci95) : "-";
}

std::string cause_text(const Finding &finding) {
  std::string text = finding.term.cause;
  if (!finding.separable) {
    std::vector<std::string> rivals;
    for (const auto &alternative : finding.alternatives) {
      if (alternative.cause != finding.term.cause &&
          std::find(rivals.begin(), rivals.end(), alternative.cause) == rivals.end())
        rivals.push_back(alternative.cause);
    }
    if (!rivals.empty())
      text += fmt::format(" (or {})", fmt::join(rivals, ", "));
  }
  const std::string where = diagnose::gate_text(finding.term.gate);
  return where.empty() ? text : text + " where " + where;
}

} // namespace rim::experiment
