// SPDX-License-Identifier: MIT
// The onboard monitor over a log, deterministically: what a replay shows is what flight would have
// shown, bit for bit.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "image/flight_image.hpp"
#include "image/names.hpp"
#include "log/labels.hpp"
#include "log/log.hpp"
#include "log/schema.hpp"
#include "replay/unit_check.hpp"
#include "train/external_residuals.hpp"

namespace rim {

// Alarm records of one detector.
struct Found {
  std::uint32_t raised = 0;  // alarms
  std::uint32_t records = 0; // of any state
  rim_alarm first{};         // record that first raised an alarm; state NONE: none did
  rim_alarm last{};          // newest record
  void add(const rim_alarm &record);
};

// A time without a row that the monitor could use; on board it is STALE.
struct Silence {
  double from_s = 0.0, to_s = 0.0; // the last row before it, or the log's begin; and the next
};

// What one log came to: by the regions, and beside them.
struct ReplayedLog : Found {
  std::string path;
  std::uint32_t rows_in_file = 0, rows_skipped = 0, rows_filtered = 0; // by the reader
  std::uint32_t rows = 0;                                              // offered to the monitor
  double begin_s = 0.0, duration_s = 0.0;                              // of its rows
  std::vector<Silence> silences; // longer than the image allows, in order
  // The monitor examined blocks that said nothing of any outcome: for so long, first at this row.
  double blind_s = 0.0, blind_from_s = 0.0;
  double recorded_s = 0.0; // from the first row of the file to the last, used or skipped
  rim_monitor_health health{};
  std::uint32_t blocks = 0;          // examined
  double image_period_s = 0.0;       // rows as the image wants them
  rim_alarm_status alarms{};         // how they stand at the end
  bool watches_interference = false; // the image has that detector
  Found interference;
  double score = 0.0;           // largest that was held for as many blocks as an alarm needs
  double alarm_score = 0.0;     // at which an alarm is raised
  std::vector<OtherUnit> units; // outcomes that seem to be read in another unit
  LabelledLog labels;           // of every row of the file; empty unless asked for
};

struct ReplayOptions {
  bool label = false;  // fill ReplayedLog::labels
  double hold_s = 0.0; // resampled logs: file rows up to so long before a row share its label
  std::uint8_t flags = RIM_ALARM_FLAG_REPLAY; // set in every record
  // Given every record in the order in which it leaves, also those of a silence in the log: what
  // rimd would have sent.
  std::function<void(const rim_alarm &)> record;
};

// Runs logs one after another; the monitor forgets everything between them.
class Replayer {
public:
  // DataError "NAME: reason" when the image is refused.
  Replayer(std::vector<std::uint8_t> image, const std::string &name);

  // Every verdict, in order, with the log's row index it belongs to.
  using Watcher = std::function<void(std::size_t row, const rim_verdict &)>;

  // Columns are found by the names the image carries. DataError names the file and a column that is
  // missing; further features are left out with one warning. Cost: rim_monitor_step() per row.
  ReplayedLog replay(const Log &log, const ReplayOptions &options, const Watcher &watch = nullptr);

  // To read a log for this image: logs of LCM events and of CAN frames need what it carries. name:
  // of the image, for messages.
  ReadOptions read_options(const std::string &name) const;

  std::uint64_t digest() const { return digest_; } // over all verdicts of all logs so far
  const Layout &layout() const { return layout_; }
  const Names &names() const { return names_; }
  const Monitor &monitor() const { return monitor_; }

private:
  // A block that was examined, and its rows.
  struct Block {
    std::vector<std::uint8_t> place;
    Eigen::Index end = 0; // one past its last row
  };
  // Blocks of a deviation that came and went.
  struct Ended {
    std::uint32_t first = 0, end = 0; // one past its last block
  };
  struct Examined {
    std::vector<Block> blocks;
    std::vector<Ended> ended;
    std::vector<bool> raising; // blocks by the last explanation of what raised the alarm
    std::size_t raised_at = 0; // blocks examined when it was raised
    std::uint32_t records = 0; // of the alarm so far
    bool is_later = false;     // the newest explanation begins after the alarm was raised
  };
  void add_block(const Matrix &context, Eigen::Index from, Eigen::Index end,
                 UnitCheck *units) const;
  void note_place(Eigen::Index end, Examined *examined) const;
  void note_explanation(const ReplayedLog &log, Examined *examined) const;
  std::vector<bool> inside(const std::vector<Block> &blocks) const; // by the newest explanation
  void finish(const Log &log, const Matrix &context, const ReplayOptions &options,
              const Examined &examined, ReplayedLog *result) const;
  std::vector<std::uint32_t> findings(const Matrix &context, const Examined &examined,
                                      bool stands) const;

  Monitor monitor_;
  Layout layout_;
  Names names_;
  std::uint64_t digest_;
};

// A flight image for logs that bring their own predictions (z. m. sd. columns), its threshold from
// the table (runs = 0) or by Monte Carlo on their contexts (thesis eq. 3.9, p. 30), with what their
// residuals are not allowed for; names the outcomes whose sd had to be estimated.
struct ExternalImage {
  std::vector<std::uint8_t> image;
  std::vector<std::string> sd_estimated;
  double promised_rate = 1.0;
  std::vector<ResidualTest> residuals; // per outcome
  std::string residuals_sentence;
};
ExternalImage external_image(const std::vector<Log> &logs, std::size_t runs,
                             const CalibrationOptions &options);

// Whether most rows came at another rate than the image's: nothing was examined.
bool is_at_another_rate(const ReplayedLog &log);

// Whether nobody judged the run, or more than a tenth of it: another rate, too few rows, silence.
// doubt() says which.
bool is_stale(const ReplayedLog &log);

// What keeps silence from being health, in sentences: a value out of the trained range, another
// unit, another rate, too few rows, a time without any. Empty: nothing does.
std::string doubt(const ReplayedLog &log, const Names &names);

// What a person reads: a sentence, then the counts.
std::string replay_text(const ReplayedLog &log, const Names &names);

} // namespace rim
