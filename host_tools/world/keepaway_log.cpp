// SPDX-License-Identifier: MIT
#include "world/keepaway_log.hpp"

#include <algorithm>
#include <cmath>

namespace rim::world {
namespace {

constexpr double kLeastSd = 0.01;

} // namespace

Recording record_keepaway(Keepaway &keepaway, const KeepawayParams &params, std::size_t passes) {
  Recording recording;
  Log &log = recording.log;
  for (const char *feature : kKeepawayFeatureNames)
    log.columns.push_back(column_of(std::string("x.") + feature));
  for (const char *name : {"z.success", "m.success", "sd.success"})
    log.columns.push_back(column_of(name));
  log.values.resize(static_cast<Eigen::Index>(passes),
                    static_cast<Eigen::Index>(log.columns.size()));
  const KeepawayModel model(params);
  play_passes(
      model, keepaway, params, passes,
      [](const std::vector<PassOption> &options) {
        return best_pass(options, [](const PassOption &o) { return o.nominal(); });
      },
      [&](const PassOption &option, const PassResult &result) {
        const auto row = static_cast<Eigen::Index>(log.t_s.size());
        const double m = option.nominal();
        log.t_s.push_back(keepaway.state().time_s);
        for (std::size_t k = 0; k < kKeepawayFeatures; ++k)
          log.values(row, static_cast<Eigen::Index>(k)) = option.context[option.decisive][k];
        log.values.row(row).tail(3) << (result.success ? 1.0 : 0.0), m,
            std::max(kLeastSd, std::sqrt(m * (1.0 - m)));
        recording.finding.push_back(
            std::any_of(result.habit.begin(), result.habit.end(), [](bool h) { return h; }) ? 1
                                                                                            : 0);
      });
  number_rows(log);
  return recording;
}

} // namespace rim::world
