// SPDX-License-Identifier: MIT
#include "train/healthy_runs.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "monitor/blocks.h"
#include "train/begin.hpp"
#include "train/part_file.hpp"
#include "train/survey.hpp"
#include "util/error.hpp"
#include "util/parallel_for.hpp"
#include "util/progress.hpp"

namespace rim {

namespace {

constexpr double kBlocksPerRun = 240.0;
constexpr Eigen::Index kLeastBlocks = 16;
constexpr double kRateRatio = 1.0 + BLOCKS_RATE_OFF; // of two runs' rates: from there they differ
// Of the range that was seen: by how much it is widened.
constexpr double kMargin = 0.02;
// Roundings to single precision that the same value may differ by: of a reading, of a factor
// between units, and of the bound.
constexpr double kRoundings = 2.0;
constexpr double kNearZero = 1e-9;   // what a value that is always 0 may be off by
constexpr double kOfMagnitude = 1e-3, kOfSpread = 0.5; // what it may vary by unseen, at most

// The image holds the period in whole microseconds, in 32 bits.
constexpr double kLeastPeriod_s = 1e-6, kMostPeriod_s = 4294.0;

// Squares of readings and products of commands must be numbers of single precision. What never
// changes is multiplied with nothing, but has a range.
constexpr double kLargestReading = 1e24, kLargestConstant = 1e30;

void check_sizes(const Survey &survey) {
  for (std::size_t f = 0; f < survey.layout.features(); ++f) {
    const bool varies = survey.high(f) > survey.low(f) || is_outcome(survey.layout, f);
    const double most = varies ? kLargestReading : kLargestConstant;
    for (const RunFacts &run : survey.runs) {
      const FeatureFacts &of = run.features[f];
      const double size = std::max(std::abs(of.low), std::abs(of.high));
      if (run.rows > 0 && size > most)
        throw DataError(fmt::format("{}: column '{}' reaches {:.4g}, and {:g} is the most that is "
                                    "computed with: give it another unit (scale in a schema), or, "
                                    "where this stands for no value, say so (missing = [\"...\"])",
                                    run.path, survey.layout.feature_names[f], size, most));
    }
  }
}

// As the image says it, in whole microseconds: training and flight must agree on what is a gap.
double image_period_s(const Survey &survey) {
  const double seen_s = survey.period_s(), period_s = 1e-6 * std::round(1e6 * seen_s);
  if (period_s < kLeastPeriod_s || period_s > kMostPeriod_s)
    throw DataError(fmt::format("{}: the rows of the runs come every {:.4g} s, and an image holds "
                                "{:g} s to {:g} s: count the time in another unit (scale under "
                                "[time] in a schema, here and for replay)",
                                survey.runs.front().path, seen_s, kLeastPeriod_s, kMostPeriod_s));
  return period_s;
}

void check_rates(const Survey &survey, double period_s) {
  for (const RunFacts &run : survey.runs) {
    const double own = period_of(run);
    if (own > kRateRatio * period_s || own < period_s / kRateRatio)
      throw DataError(fmt::format("{}: its rows come at {:.4g} Hz, those of the other runs at "
                                  "{:.4g} Hz: runs of one rate are needed (a schema with "
                                  "resample_hz makes one)",
                                  run.path, 1.0 / own, 1.0 / period_s));
  }
}

std::vector<std::string> same_runs(const Survey &survey) {
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::vector<std::size_t>> of_content;
  for (std::size_t r = 0; r < survey.runs.size(); ++r) {
    if (survey.runs[r].rows > 0)
      of_content[{survey.runs[r].content[0], survey.runs[r].content[1]}].push_back(r);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto &[content, runs] : of_content) {
    for (std::size_t i = 0; i < runs.size(); ++i) {
      for (std::size_t j = i + 1; j < runs.size(); ++j)
        pairs.emplace_back(runs[i], runs[j]);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<std::string> warnings;
  for (const auto &[i, j] : pairs)
    warnings.push_back(survey.runs[j].path + " holds the same rows as " + survey.runs[i].path +
                       ": the same run counts once");
  return warnings;
}

// Below this, differences of a feature's values count as rounding errors somewhere in training:
// floors of 1e-9 to 1e-12 are in no unit.
constexpr double kLeastSize = 1e-10;

std::vector<std::string> small_features(const Survey &survey) {
  std::vector<std::string> warnings;
  for (std::size_t f = 0; f < survey.layout.features(); ++f) {
    const double size = std::max(std::abs(survey.low(f)), std::abs(survey.high(f)));
    if (size > 0.0 && size < kLeastSize)
      warnings.push_back(fmt::format("{} is nowhere farther from 0 than {:.2g}: so small a number "
                                     "is taken for a rounding error. If it is none, give it a "
                                     "smaller unit (scale of its [[column]] in a schema)",
                                     survey.layout.feature_names[f], size));
  }
  return warnings;
}

std::uint32_t block_rows_for(const Survey &survey, double period_s, double block_s,
                             double *run_rows) {
  std::vector<double> rows;
  for (const RunFacts &run : survey.runs)
    rows.push_back(static_cast<double>(run.rows));
  std::sort(rows.begin(), rows.end());
  *run_rows = rows[rows.size() / 2];
  const double wanted = block_s > 0.0 ? block_s / period_s : *run_rows / kBlocksPerRun;
  return static_cast<std::uint32_t>(std::clamp(std::lround(wanted), 1L, 10000L));
}

void set_ranges(FlightPlan *plan, const Survey &survey) {
  for (std::size_t f = 0; f < plan->layout.features(); ++f) {
    double low = survey.low(f), high = survey.high(f);
    if (is_angle(plan->layout, f)) { // it may be anywhere
      const double half_turn = 0.5 * whole_turn(plan->layout, f);
      low = std::min(low, -half_turn);
      high = std::max(high, half_turn);
    }
    const double margin = range_margin(low, high, kMargin);
    plan->low.push_back(static_cast<float>(low - margin));
    plan->high.push_back(static_cast<float>(high + margin));
  }
}

// Names those commands of which no model can know.
void warn_of_commands(const Survey &survey, std::vector<std::string> *warnings) {
  std::vector<std::string> names;
  for (const std::uint16_t f : no_inputs(survey))
    names.push_back(survey.layout.feature_names[f]);
  if (!names.empty())
    warnings->push_back(
        fmt::format("there are more commands than the models have room for ({} inputs, of which an "
                    "angle takes two): no model knows of {}. Put the columns that matter first",
                    kMostCommands, fmt::join(names, ", ")));
}

// All but the runs' blocks, and what the commands were before the first rows.
HealthyRuns prepared_but_begin(const Survey &survey, double block_s) {
  HealthyRuns healthy;
  FlightPlan &plan = healthy.plan;
  plan.layout = survey.layout;
  plan.period_s = image_period_s(survey);
  check_rates(survey, plan.period_s);
  check_sizes(survey);
  healthy.warnings = same_runs(survey);
  for (const std::string &warning : small_features(survey))
    healthy.warnings.push_back(warning);
  double run_rows = 0.0;
  plan.block_rows = block_rows_for(survey, plan.period_s, block_s, &run_rows);
  set_ranges(&plan, survey);
  plan.basis = make_basis(survey, run_rows);
  if (!plan.layout.external)
    warn_of_commands(survey, &healthy.warnings);
  healthy.integrands = possible_integrands(plan.layout);
  for (const RunFacts &run : survey.runs) {
    healthy.paths.push_back(run.path);
    healthy.input.rows += run.rows;
    healthy.input.skipped += run.skipped;
    healthy.input.filtered += run.filtered;
  }
  for (std::size_t f = 0; f < plan.layout.features(); ++f) {
    healthy.low.push_back(survey.low(f));
    healthy.high.push_back(survey.high(f));
  }
  return healthy;
}

BlockRun blocks_of(const std::shared_ptr<const Log> &log, const RunFacts &facts,
                   const HealthyRuns &healthy, const Basis &basis) {
  const FlightPlan &plan = healthy.plan;
  std::uint64_t content[2];
  hash_of(*log, content);
  if (content[0] != facts.content[0] || content[1] != facts.content[1])
    throw DataError(log->path + ": changed while it was read");
  BlockRun run =
      block_run(*log, plan.layout, basis,
                {plan.block_rows, plan.period_s, plan.low, plan.high, healthy.integrands});
  if (run.blocks() < kLeastBlocks)
    throw DataError(fmt::format(
        "{}: {} blocks of {} rows{}; a run needs at least {}", log->path, run.blocks(),
        plan.block_rows,
        run.left_out == 0 ? "" : fmt::format(", and {} that follow on gaps", run.left_out),
        kLeastBlocks));
  return run;
}

// All but the runs' blocks.
HealthyRuns prepared(LogSet *logs, const Survey &survey, const BlockingOptions &options) {
  HealthyRuns healthy = prepared_but_begin(survey, options.block_s);
  const std::vector<std::size_t> which = runs_for_begin(survey);
  const auto blocks = [&](const Basis &basis) {
    RunStore runs(which.size(), options.wide_bytes, options.folder);
    parallel_for(which.size(), [&](std::size_t k) {
      const std::size_t r = which[k];
      runs.put(k, blocks_of(logs->get(r), survey.runs[r], healthy, basis));
    });
    return runs;
  };
  if (!which.empty())
    learn_begin(&healthy.plan.basis, healthy.plan.period_s, blocks);
  return healthy;
}

// How far the runs went from which enough was learnt there: all but the longest tenth.
double learnt_length(std::vector<double> lengths_s) {
  std::sort(lengths_s.rbegin(), lengths_s.rend());
  return lengths_s[lengths_s.size() / 10];
}

void learn_starts(HealthyRuns *healthy) {
  const FlightPlan &plan = healthy->plan;
  std::vector<Eigen::VectorXd> starts;
  std::vector<double> lengths_s;
  for (const BlockRun &run : healthy->runs) {
    starts.push_back(run.start);
    lengths_s.push_back(run.time_s[run.blocks() - 1] + 0.5 * plan.block_rows * plan.period_s);
    healthy->input.blocks += static_cast<std::size_t>(run.blocks());
    healthy->input.left_out += run.left_out;
  }
  learn_start(&healthy->plan.basis, starts, healthy->low, healthy->high);
  if (plan.layout.external) // the user's predictions hold for as long as the user says
    return;
  healthy->plan.basis.learnt_s = learnt_length(lengths_s);
  learn_later(&healthy->plan.basis, plan.layout, healthy->runs);
}

Survey checked_survey(LogSet *logs) {
  if (logs->size() < 3)
    throw DataError("training needs at least 3 logs, each a run of its own; got " +
                    std::to_string(logs->size()));
  return survey_of(logs);
}

} // namespace

double range_margin(double low, double high, double part) {
  const double magnitude = std::max(std::abs(low), std::abs(high));
  if (!(magnitude > 0.0))
    return kNearZero;
  const auto rounded = static_cast<float>(magnitude);
  const double step = static_cast<double>(std::nextafter(rounded, HUGE_VALF) - rounded);
  const double spread = high - low, of_magnitude = kOfMagnitude * magnitude;
  const double more = spread > 0.0 ? std::min(of_magnitude, kOfSpread * spread) : of_magnitude;
  return std::max({part * spread, more, kRoundings * step});
}

HealthyRuns healthy_runs(LogSet *logs, const BlockingOptions &options) {
  const Survey survey = checked_survey(logs);
  HealthyRuns healthy = prepared(logs, survey, options);
  healthy.runs = RunStore(logs->size(), options.wide_bytes, options.folder);
  Progress progress("blocks", logs->size());
  parallel_for(logs->size(), [&](std::size_t r) {
    healthy.runs.put(r, blocks_of(logs->take(r), survey.runs[r], healthy, healthy.plan.basis));
    progress.add();
  });
  learn_starts(&healthy);
  return healthy;
}

PartWritten write_part(LogSet *logs, const BlockingOptions &options, const Shard &shard,
                       const std::string &path) {
  PartWriter part(path); // a place that cannot be written is found before the work
  const Survey survey = checked_survey(logs);
  const HealthyRuns healthy = prepared(logs, survey, options);
  std::vector<std::size_t> mine;
  for (std::size_t r = 0; r < logs->size(); ++r) {
    if (shard.owns(r))
      mine.push_back(r);
  }
  part.begin(healthy, mine.size());
  Progress progress("blocks", mine.size());
  parallel_in_order(
      mine.size(),
      [&](std::size_t k) {
        return blocks_of(logs->take(mine[k]), survey.runs[mine[k]], healthy, healthy.plan.basis);
      },
      [&](std::size_t k, const BlockRun &run) {
        part.add(mine[k], run);
        progress.add();
      });
  part.commit();
  return {mine.size(), logs->size()};
}

HealthyRuns merged_parts(const std::vector<std::string> &paths) {
  if (paths.empty())
    throw UsageError("--merge needs part files");
  HealthyRuns healthy = read_part_header(paths.front());
  const std::string first = plan_text(healthy);
  healthy.runs = RunStore(healthy.paths.size());
  std::vector<std::string> holder(healthy.paths.size()); // the file that each run came from
  Progress progress("read", paths.size());
  for (const std::string &path : paths) {
    if (plan_text(read_part_header(path)) != first)
      throw DataError(path + ": is of other logs, or of another --block-seconds, than " +
                      paths.front());
    read_part_runs(path, &healthy, &holder);
    progress.add();
  }
  for (std::size_t r = 0; r < holder.size(); ++r) {
    if (holder[r].empty())
      throw DataError(healthy.paths[r] + ": its blocks are in none of the " +
                      std::to_string(paths.size()) + " part files: are some missing?");
  }
  learn_starts(&healthy);
  return healthy;
}

} // namespace rim
