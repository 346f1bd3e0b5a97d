// SPDX-License-Identifier: MIT
#include "replay/replay.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "base/crc.h"
#include "base/real.h"
#include "bus/can_table.hpp"
#include "bus/sentence.hpp"
#include "monitor/inspect.h"
#include "rim/image.h"
#include "search/select.h"
#include "util/error.hpp"

namespace rim {

namespace {

constexpr double kMembershipCut = RIM_SELECT_MEMBERSHIP_CUT;
constexpr double kMostUnjudged = 0.1; // of a run that is called healthy

// Column of every name, or a DataError.
std::vector<int> columns_named(const Log &log, const std::vector<std::string> &names) {
  std::vector<int> columns;
  for (const std::string &name : names) {
    columns.push_back(find_column(log, name));
    if (columns.back() < 0)
      throw DataError(log.path + ": column '" + name + "' is missing; the model needs it");
  }
  return columns;
}

void warn_of_others(const Log &log, const Layout &layout) {
  std::string others;
  for (const int c : feature_columns(log)) {
    const std::string &name = log.columns[static_cast<std::size_t>(c)].name;
    const auto &known = layout.feature_names;
    if (std::find(known.begin(), known.end(), name) == known.end())
      others += (others.empty() ? "" : ", ") + name;
  }
  if (!others.empty()) {
    std::fprintf(stderr, "rim: warning: %s: not used, since the model does not know them: %s\n",
                 log.path.c_str(), others.c_str());
  }
}

Matrix pick(const Log &log, const std::vector<int> &columns) {
  Matrix out(log.values.rows(), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t i = 0; i < columns.size(); ++i)
    out.col(static_cast<Eigen::Index>(i)) = log.values.col(columns[i]);
  return out;
}

// The times without a usable row that are longer than `limit_s`. Rows that the schema leaves out on
// purpose are no silence: where most of those in between are such, the log itself goes on.
std::vector<Silence> silences_of(const Log &log, double limit_s) {
  std::vector<Silence> found;
  if (log.t_s.empty() || !(limit_s > 0.0))
    return found;
  const auto filtered_before = [&log](std::uint32_t row) {
    const auto &rows = log.filtered;
    return std::lower_bound(rows.begin(), rows.end(), row) - rows.begin();
  };
  Silence now{std::isnan(log.first_s) ? log.t_s.front() : log.first_s, 0.0};
  std::uint32_t row = 0;
  const auto until = [&](double t_s, std::uint32_t next_row) {
    now.to_s = t_s;
    const std::uint32_t between = next_row > row ? next_row - row - 1 : 0;
    const auto left_out = filtered_before(next_row) - filtered_before(row + 1);
    if (t_s - now.from_s > limit_s && (between == 0 || 2 * left_out < between))
      found.push_back(now);
    now.from_s = t_s;
    row = next_row;
  };
  for (std::size_t i = 0; i < log.t_s.size(); ++i)
    until(log.t_s[i], i < log.row.size() ? log.row[i] : row + 1); // made in memory: without
  if (log.last_s > log.t_s.back())
    until(log.last_s, log.rows_in_file + 1);
  return found;
}

// What the monitor is offered, row by row.
ExternalRows rows_for(const Log &log, const Layout &layout) {
  if (layout.external) {
    columns_named(log, layout.feature_names);
    columns_named(log, layout.outcome_names);
    return external_rows(log, layout);
  }
  ExternalRows rows;
  rows.context = pick(log, columns_named(log, layout.feature_names));
  rows.t_s = log.t_s;
  warn_of_others(log, layout);
  return rows;
}

rim_observation observation_of(const ExternalRows &rows, Eigen::Index t, bool has_predictions) {
  rim_observation row = {};
  row.t_s = rows.t_s[static_cast<std::size_t>(t)];
  row.context = rows.context.row(t).data();
  if (has_predictions) {
    row.outcome = rows.outcome.row(t).data();
    row.mean = rows.mean.row(t).data();
    row.sd = rows.sd.row(t).data();
  }
  return row;
}

rim_verdict step(rim_monitor *monitor, const rim_observation &row) {
  rim_verdict verdict;
  const rim_status status = rim_monitor_step(monitor, &row, &verdict);
  if (status != RIM_OK)
    throw std::logic_error(std::string("rim_monitor_step: ") + rim_status_text(status));
  return verdict;
}

// The score that the last `persistence` blocks all reached: what an alarm is raised by.
class HeldScore {
public:
  explicit HeldScore(std::uint32_t persistence) : latest_(std::max(1u, persistence), -1e300) {}
  double add(double score) {
    latest_[next_++ % latest_.size()] = score;
    return *std::min_element(latest_.begin(), latest_.end());
  }

private:
  std::vector<double> latest_;
  std::size_t next_ = 0;
};

void note_blindness(const std::vector<double> &t_s, std::size_t row, const rim_verdict &verdict,
                    ReplayedLog *log) {
  if (verdict.level != RIM_LEVEL_STALE || verdict.reason != RIM_REASON_TOO_FEW)
    return;
  if (!(log->blind_s > 0.0))
    log->blind_from_s = t_s[row];
  log->blind_s += row > 0 ? t_s[row] - t_s[row - 1] : 0.0;
}

} // namespace

void Found::add(const rim_alarm &record) {
  if (record.state == RIM_ALARM_NONE)
    return;
  ++records;
  last = record;
  if (record.state == RIM_ALARM_RAISED && ++raised == 1)
    first = record;
}

Replayer::Replayer(std::vector<std::uint8_t> image, const std::string &name)
    : monitor_(std::move(image), name), layout_(layout_of_image(monitor_.image())),
      names_(names_of_image(monitor_.image(), name)), digest_(RIM_DIGEST_START) {}

ReadOptions Replayer::read_options(const std::string &name) const {
  ReadOptions options;
  options.observation_names = layout_.feature_names;
  options.can = can_reading(monitor_.image(), name);
  return options;
}

ReplayedLog Replayer::replay(const Log &log, const ReplayOptions &options, const Watcher &watch) {
  const ExternalRows rows = rows_for(log, layout_);
  rim_monitor *monitor = monitor_.get();
  rim_monitor_reset(monitor);
  ReplayedLog result;
  result.path = log.path;
  result.score = -1e300;
  std::uint32_t blocks = 0;
  Eigen::Index block_end = 0; // the row after the last block's
  Examined examined;
  UnitCheck units(layout_.outcomes());
  HeldScore held(rim_monitor_config(monitor, RIM_CONFIG_PERSISTENCE));
  const auto tell = [&](rim_alarm record) {
    record.flags = static_cast<std::uint8_t>(record.flags | options.flags);
    if (record.detector == RIM_DETECTOR_INTERFERENCE)
      result.interference.add(record);
    else
      result.add(record);
    if (options.record)
      options.record(record);
  };
  const auto tell_waiting = [&] {
    for (rim_alarm record; rim_monitor_next_record(monitor, &record);)
      tell(record);
  };
  const auto idle = [&](double now_s) { // the board's clock goes on without rows
    (void)rim_monitor_idle(monitor, now_s);
    tell_waiting();
  };
  idle(log.first_s);
  for (Eigen::Index t = 0; t < rows.context.rows(); ++t) {
    const rim_observation row = observation_of(rows, t, layout_.external);
    idle(row.t_s);
    const rim_verdict verdict = step(monitor, row);
    digest_ = rim_verdict_digest(digest_, &verdict);
    if (verdict.blocks != blocks) { // alarms are decided where a block ends
      result.score = std::max(result.score, held.add(verdict.score));
      add_block(rows.context, block_end, t + 1, &units);
      block_end = t + 1;
      if (options.label)
        note_place(t + 1, &examined);
    }
    blocks = verdict.blocks;
    if (Ended now{}; rim_monitor_ended(monitor, &now.first, &now.end) != examined.ended.size())
      examined.ended.push_back(now);
    result.watches_interference = result.watches_interference || verdict.interference != nullptr;
    if (verdict.alarm.seq != 0)
      tell(verdict.alarm);
    tell_waiting();
    note_blindness(rows.t_s, static_cast<std::size_t>(t), verdict, &result);
    note_explanation(result, &examined);
    if (watch)
      watch(static_cast<std::size_t>(t), verdict);
  }
  idle(log.last_s);
  result.blocks = blocks;
  result.units = units.found(names_);
  finish(log, rows.context, options, examined, &result);
  return result;
}

// The block that ends before row `end`, the one before it before row `from`: its readings, and what
// the commands let expect of them. Where rows are missing it has fewer than others.
void Replayer::add_block(const Matrix &context, Eigen::Index from, Eigen::Index end,
                         UnitCheck *units) const {
  const double *residuals = rimi_monitor_residuals(monitor_.get());
  const Eigen::Index n =
      std::min<Eigen::Index>(rim_monitor_config(monitor_.get(), RIM_CONFIG_BLOCK_ROWS), end - from);
  if (layout_.external || residuals == nullptr || n < 1)
    return; // predictions of the log's own are in the unit of its readings
  const auto outcomes = static_cast<Eigen::Index>(layout_.outcomes());
  Eigen::VectorXd measured(outcomes);
  for (Eigen::Index o = 0; o < outcomes; ++o) {
    const std::uint16_t feature = layout_.outcome_feature[static_cast<std::size_t>(o)];
    measured[o] = context.col(feature).segment(end - n, n).mean();
  }
  units->add(measured, measured - Eigen::Map<const Eigen::VectorXd>(residuals, outcomes));
}

// Where in the space of regions the block lies that ends before row `end`.
void Replayer::note_place(Eigen::Index end, Examined *examined) const {
  const std::uint8_t *place = rimi_monitor_place(monitor_.get());
  if (place != nullptr)
    examined->blocks.push_back(
        {{place, place + rim_monitor_config(monitor_.get(), RIM_CONFIG_REGION_FEATURES)}, end});
}

// Whether what is said of the alarm now is of what raised it. A new record may change that for all
// blocks; between records only the newest block is asked about, for its cost.
void Replayer::note_explanation(const ReplayedLog &log, Examined *examined) const {
  if (log.records == examined->records) {
    for (std::size_t b = examined->raising.size(); b < examined->blocks.size(); ++b)
      examined->raising.push_back(!examined->is_later &&
                                  rimi_monitor_inside(monitor_.get(),
                                                      examined->blocks[b].place.data(),
                                                      static_cast<std::uint32_t>(b)));
    return;
  }
  examined->records = log.records;
  std::vector<bool> newest = inside(examined->blocks);
  if (log.last.state == RIM_ALARM_RAISED)
    examined->raised_at = newest.size();
  const auto first = std::find(newest.begin(), newest.end(), true);
  examined->is_later = static_cast<std::size_t>(first - newest.begin()) >= examined->raised_at;
  if (!examined->is_later)
    examined->raising = std::move(newest);
}

std::vector<bool> Replayer::inside(const std::vector<Block> &blocks) const {
  std::vector<bool> are(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b)
    are[b] =
        rimi_monitor_inside(monitor_.get(), blocks[b].place.data(), static_cast<std::uint32_t>(b));
  return are;
}

// Per row the number of the finding whose deviation was in it: those that ended, in their order,
// then what the alarm that stands says. What begins after an alarm was raised did not raise it: the
// rows of what was said before remain. A row that ended no examined block shares the label of the
// block that follows, or, after the last, of the one before.
std::vector<std::uint32_t> Replayer::findings(const Matrix &context, const Examined &examined,
                                              bool stands) const {
  const rim_monitor *monitor = monitor_.get();
  std::vector<std::uint32_t> finding(static_cast<std::size_t>(context.rows()), 0);
  if (rimi_monitor_search(monitor) != nullptr) { // rows are independent observations
    for (Eigen::Index t = 0; stands && t < context.rows(); ++t)
      finding[static_cast<std::size_t>(t)] =
          rim_monitor_membership(monitor, context.row(t).data()) >= kMembershipCut ? 1 : 0;
    return finding;
  }
  const std::vector<Block> &blocks = examined.blocks;
  std::vector<bool> standing = stands ? inside(blocks) : std::vector<bool>(blocks.size());
  if (stands && examined.is_later) {
    for (std::size_t b = 0; b < examined.raising.size(); ++b)
      standing[b] = standing[b] || examined.raising[b];
  }
  Eigen::Index from = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const auto block = static_cast<std::uint32_t>(b);
    std::uint32_t number = standing[b] ? static_cast<std::uint32_t>(examined.ended.size() + 1) : 0;
    for (std::size_t e = 0; e < examined.ended.size(); ++e) {
      if (block >= examined.ended[e].first && block < examined.ended[e].end)
        number = static_cast<std::uint32_t>(e + 1);
    }
    const Eigen::Index to = b + 1 < blocks.size() ? blocks[b].end : context.rows();
    for (Eigen::Index t = from; t < to; ++t)
      finding[static_cast<std::size_t>(t)] = number;
    from = to;
  }
  return finding;
}

void Replayer::finish(const Log &log, const Matrix &context, const ReplayOptions &options,
                      const Examined &examined, ReplayedLog *result) const {
  const rim_monitor *monitor = monitor_.get();
  result->rows_in_file = log.rows_in_file;
  result->rows_skipped = log.rows_skipped;
  result->rows_filtered = log.rows_filtered;
  result->rows = static_cast<std::uint32_t>(context.rows());
  result->begin_s = log.t_s.empty() ? 0.0 : log.t_s.front();
  result->duration_s = log.t_s.empty() ? 0.0 : log.t_s.back() - log.t_s.front();
  result->recorded_s = std::isnan(log.first_s) ? result->duration_s : log.last_s - log.first_s;
  result->silences = silences_of(log, 1e-3 * rim_monitor_config(monitor, RIM_CONFIG_STALE_MS));
  result->health = rim_monitor_get_health(monitor);
  result->image_period_s = 1e-6 * rim_monitor_config(monitor, RIM_CONFIG_PERIOD_US);
  result->alarms = rim_monitor_alarms(monitor);
  result->alarm_score = rimi_monitor_threshold(monitor)->alarm_score;
  if (!options.label)
    return;
  result->labels = unlabelled(log);
  const bool stands =
      result->last.state == RIM_ALARM_RAISED || result->last.state == RIM_ALARM_UPDATED;
  const std::vector<std::uint32_t> finding = findings(context, examined, stands);
  for (std::size_t i = 0; i < finding.size(); ++i) {
    if (finding[i] == 0)
      continue;
    const std::uint32_t to = std::min(log.row[i], log.rows_in_file);
    std::uint32_t from = to;
    if (i > 0 && log.row[i] > log.row[i - 1] && log.t_s[i] - log.t_s[i - 1] <= options.hold_s)
      from = log.row[i - 1] + 1; // file rows that the grid stepped over
    for (std::uint32_t row = std::max(from, 1u); row <= to; ++row)
      result->labels.finding[row - 1] = finding[i];
  }
}

ExternalImage external_image(const std::vector<Log> &logs, std::size_t runs,
                             const CalibrationOptions &options) {
  FlightPlan plan;
  plan.layout = layout_of(logs.front());
  if (!plan.layout.external) {
    throw DataError(logs.front().path +
                    ": no column 'z.NAME' with 'm.NAME': without its own predictions a log needs "
                    "a model (--model MODEL.rim; rim train makes one)");
  }
  std::vector<ExternalRows> rows;
  for (const Log &log : logs) {
    check_layout(plan.layout, log);
    rows.push_back(external_rows(log, plan.layout));
  }
  ExternalImage result;
  calibrate_external(&plan, rows, runs, options);
  result.residuals = test_residuals(plan, rows);
  result.residuals_sentence =
      residuals_sentence(result.residuals, plan.layout.outcome_names, logs.size());
  for (std::size_t o = 0; o < result.residuals.size(); ++o) // the search sees them as they count
    plan.inverse_sd[o] = static_cast<float>(1.0 / std::sqrt(result.residuals[o].inflation));
  for (std::size_t o = 0; o < plan.layout.outcomes(); ++o) {
    const bool estimated = std::any_of(rows.begin(), rows.end(), [o](const ExternalRows &r) {
      return o < r.sd_estimated.size() && r.sd_estimated[o];
    });
    if (estimated)
      result.sd_estimated.push_back(plan.layout.outcome_names[o]);
  }
  result.promised_rate = static_cast<double>(plan.thresholds.promised_rate);
  result.image = make_image(plan);
  return result;
}

namespace {

std::string count_text(std::size_t n, const char *one, const char *many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

// Only what is not zero, apart from the rows used.
std::string rows_text(const ReplayedLog &log) {
  const rim_row_health &rows = log.health.rows;
  const std::size_t skipped = log.rows_skipped + rows.not_finite + rows.time_back;
  std::string text =
      "rows: " + std::to_string(rows.rows_used) + " used, " + std::to_string(skipped) + " skipped";
  if (log.rows_filtered > 0)
    text += ", " + std::to_string(log.rows_filtered) + " left out by the schema";
  text += ", " + count_text(rows.gaps, "gap", "gaps");
  if (rows.out_of_range > 0)
    text += ", " + std::to_string(rows.out_of_range) + " out of the trained range";
  if (rows.wrong_rate > 0)
    text += ", " + std::to_string(rows.wrong_rate) + " at another rate";
  if (log.image_period_s > 0.0)
    text += "; " + count_text(log.blocks, "block", "blocks") + " examined";
  if (log.health.partly > 0)
    text += fmt::format(", {} of them in part: not where an outcome follows from commands before "
                        "the first row, in a gap, or longer ago than healthy runs went",
                        log.health.partly);
  return text;
}

std::string interference_text(const ReplayedLog &log, const Names &names) {
  const Found &found = log.interference;
  if (!log.watches_interference)
    return "";
  if (found.raised == 0)
    return "  motion interference: none\n";
  std::string text = fmt::format("  motion interference FOUND at t = {:.2f} s: {}", found.first.t_s,
                                 alarm_sentence(found.first, names));
  if (found.raised > 1)
    text += fmt::format("; {} later", count_text(found.raised - 1, "more", "more"));
  return text + "\n";
}

double silent_s(const ReplayedLog &log) {
  double all_s = 0.0;
  for (const Silence &s : log.silences)
    all_s += s.to_s - s.from_s;
  return all_s;
}

std::string silence_text(const ReplayedLog &log) {
  const Silence *longest = &log.silences.front();
  for (const Silence &s : log.silences) {
    if (s.to_s - s.from_s > longest->to_s - longest->from_s)
      longest = &s;
  }
  const std::string when =
      fmt::format("from t = {:.2f} s to t = {:.2f} s", longest->from_s, longest->to_s);
  const std::string share = fmt::format("{:.3g} s of {:.3g} s", silent_s(log), log.recorded_s);
  return log.silences.size() == 1
             ? fmt::format("no usable row {} ({})", when, share)
             : fmt::format("no usable row in {} times of {} in all, the longest {}",
                           log.silences.size(), share, when);
}

// What of the run nobody judged.
std::string unjudged_text(const ReplayedLog &log) {
  std::string text = log.silences.empty() ? "" : silence_text(log);
  if (log.blind_s > 0.0)
    text += fmt::format("{}blocks that say nothing of any outcome, first at t = {:.2f} s ({:.3g} s "
                        "of {:.3g} s)",
                        text.empty() ? "" : "; ", log.blind_from_s, log.blind_s, log.recorded_s);
  return text;
}

// So much of the run that the rest does not stand for it.
bool is_mostly_unjudged(const ReplayedLog &log) {
  return silent_s(log) + log.blind_s > kMostUnjudged * log.recorded_s;
}

bool has_too_few_blocks(const ReplayedLog &log) {
  return log.image_period_s > 0.0 && log.blocks < RIM_MONITOR_LEAST_BLOCKS + log.health.partly;
}

} // namespace

bool is_stale(const ReplayedLog &log) {
  return is_at_another_rate(log) || has_too_few_blocks(log) || is_mostly_unjudged(log);
}

bool is_at_another_rate(const ReplayedLog &log) {
  const rim_row_health &rows = log.health.rows;
  return log.image_period_s > 0.0 && 2 * rows.wrong_rate > rows.rows_used;
}

std::string doubt(const ReplayedLog &log, const Names &names) {
  const rim_monitor_health &h = log.health;
  std::string text;
  if (h.out_feature != 0xffff) {
    const Quantity q = names.feature(h.out_feature);
    text = fmt::format(
        "OUT OF RANGE: {} is {:.4g}{} at t = {:.2f} s, beyond what was trained "
        "(column {}; rows in which any reading is out of range: {}): is its unit right?",
        q.words, h.out_value, q.unit.empty() ? "" : " " + q.unit, h.out_t_s, q.name,
        h.rows.out_of_range);
  }
  for (const OtherUnit &u : log.units) {
    const Quantity q = names.outcome(static_cast<std::uint16_t>(u.outcome));
    const std::string times = fmt::format("{:.3g} times what is expected", u.factor);
    const std::string more =
        fmt::format("{:.3g} {} than {}", std::abs(u.more), u.more > 0.0 ? "more" : "less",
                    u.factor == 1.0 ? "is expected" : times);
    text += fmt::format(
        "{}UNIT: {} reads {}, as it would in {} instead of {} (column {}): is its unit right?",
        text.empty() ? "" : "\n  ", q.words, u.more == 0.0 ? times : more, u.looks_like, q.unit,
        q.name);
  }
  if (is_mostly_unjudged(log) && !is_at_another_rate(log))
    text += fmt::format("{}STALE: {}: nothing can be said of that time", text.empty() ? "" : "\n  ",
                        unjudged_text(log));
  if (is_at_another_rate(log))
    text += fmt::format("{}STALE: rows come at {:.4g} Hz, the model wants {:.4g} Hz: {} of {} rows "
                        "were not examined",
                        text.empty() ? "" : "\n  ", 1.0 / h.period_s, 1.0 / log.image_period_s,
                        h.rows.wrong_rate, h.rows.rows_used);
  else if (log.image_period_s > 0.0 && log.blocks < RIM_MONITOR_LEAST_BLOCKS)
    text += fmt::format("{}STALE: {} examined, too few to say anything", text.empty() ? "" : "\n  ",
                        count_text(log.blocks, "block was", "blocks were"));
  else if (has_too_few_blocks(log))
    text += fmt::format("{}STALE: {} examined in full, too few to say that it is healthy",
                        text.empty() ? "" : "\n  ",
                        count_text(log.blocks - h.partly, "block was", "blocks were"));
  return text;
}

std::string replay_text(const ReplayedLog &log, const Names &names) {
  std::string text = log.path + ": ";
  const std::string why_not = doubt(log, names);
  if (log.first.state == RIM_ALARM_NONE) {
    if (!why_not.empty())
      text += why_not;
    else
      text += fmt::format("{}: nothing found in {} ({:.0f} s)",
                          log.interference.raised > 0 ? "regions" : "healthy",
                          count_text(log.rows, "row", "rows"), log.duration_s);
    if (const std::string unjudged = unjudged_text(log); why_not.empty() && !unjudged.empty())
      text += "; not judged: " + unjudged;
    if (log.alarm_score > 0.0 && log.score > -1e300)
      text += fmt::format("; the score rose to {:.0f} % of the alarm's",
                          100.0 * std::max(0.0, log.score) / log.alarm_score);
  } else {
    const bool epoch = log.begin_s > 1e6; // a clock's time, which nobody reads as a time of flight
    text += fmt::format("FOUND at t = {:.2f} s{}\n  then: {}", log.first.t_s,
                        epoch ? fmt::format(", {:.2f} s after its first row (at {:.2f} s)",
                                            log.first.t_s - log.begin_s, log.begin_s)
                              : "",
                        alarm_sentence(log.first, names));
    if (log.last.seq != log.first.seq) {
      text += fmt::format("\n  in the end, {}: {}",
                          count_text(log.records - 1, "record later", "records later"),
                          alarm_sentence(log.last, names));
    }
    if (!why_not.empty())
      text += "\n  " + why_not;
  }
  return text + "\n" + interference_text(log, names) + "  " + rows_text(log) + "\n";
}

} // namespace rim
