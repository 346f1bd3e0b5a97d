// SPDX-License-Identifier: MIT
#include "replay/outputs.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include "bus/jsonl.hpp"
#include "log/labels.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/gnuplot.hpp"
#include "util/interrupt.hpp"
#include "util/json.hpp"
#include "util/run_program.hpp"

#include "monitor/inspect.h"

namespace rim {

namespace {

std::unique_ptr<AtomicFile> open_if(const std::string &path) {
  return path.empty() ? nullptr : std::make_unique<AtomicFile>(path);
}

// With its folder: logs of several folders often share their names.
std::string short_name(const std::string &path) {
  const std::filesystem::path whole(path);
  return (whole.parent_path().filename() / whole.filename()).string();
}

} // namespace

ReplayOutputs::ReplayOutputs(const OutputPaths &paths, const Replayer &replayer)
    : alarms_(open_if(paths.alarms)), labels_(open_if(paths.labels)), trace_(open_if(paths.trace)),
      report_file_(open_if(paths.report)), plot_path_(paths.plot), mcap_path_(paths.mcap),
      replayer_(replayer), names_(replayer.names()),
      model_id_(replayer.monitor().image().model_id) {
  if (!paths.candump.empty())
    candump_ = std::make_unique<CandumpFile>(paths.candump, paths.node, paths.can_fd);
  node_ = paths.node;
  can_fd_ = paths.can_fd;
  if (!paths.can.empty()) {
    try {
      can_ = std::make_unique<CanBus>(paths.can);
    } catch (const DataError &e) {
      throw DataError(std::string(e.what()) +
                      "; --candump FILE writes the same frames for canplayer");
    }
  }
  if (!paths.lcm_url.empty())
    lcm_ = std::make_unique<LcmBus>(paths.lcm_url);
  if (report_file_)
    report_ = std::make_unique<FlightReport>(paths.model, paths.made_by, names_.outcomes.size());
  if (labels_)
    labels_->write(labels_header());
  if (trace_)
    trace_->write("t_s,ln_anom,threshold,score,level,log\n");
  if (!plot_path_.empty())
    check_plot_path(plot_path_);
}

// Topics are named by the log, without what a topic's name cannot hold.
void ReplayOutputs::add_mcap(bool is_alarm, const std::string &message) {
  std::string topic = short_name(log_name_);
  std::replace_if(
      topic.begin(), topic.end(), [](char c) { return static_cast<unsigned char>(c) <= ' '; }, '_');
  mcap_lines_ += json_text({{"topic", "/" + topic + (is_alarm ? "/alarm" : "/verdict")},
                            {"alarm", is_alarm},
                            {"message", parse_json(message)}}) +
                 "\n";
}

// By the package mcap, from a file that goes when it is written.
void ReplayOutputs::write_mcap() const {
  const std::string lines = mcap_path_ + ".lines." + std::to_string(::getpid());
  const Unfinished goes(lines);
  if (!(std::ofstream(lines) << mcap_lines_).flush())
    throw DataError(lines + ": write failed");
  const ProgramResult result =
      run_program({python_program(), readers_path(), lines, "--write-mcap", mcap_path_});
  ::unlink(lines.c_str());
  if (result.status == 127)
    throw DataError(mcap_path_ + ": writing MCAP needs " + python_program());
  if (result.status != 0)
    throw DataError(result.err.substr(0, result.err.find_last_not_of('\n') + 1));
  const HoldInterrupts whole;
  note_kept(mcap_path_);
}

void ReplayOutputs::begin(const Log &log) {
  log_name_ = log.path;
  blocks_ = 0;
  if (report_)
    report_->begin(log);
  if (!plot_path_.empty())
    traces_.push_back({short_name(log.path), {}, {}, ""});
}

void ReplayOutputs::verdict(const rim_verdict &v) {
  if (report_)
    report_->verdict(v, rimi_monitor_residuals(replayer_.monitor().get()),
                     rimi_monitor_channels(replayer_.monitor().get()));
  if (!mcap_path_.empty())
    add_mcap(false, fmt::format("{{\"t_s\":{:.6f},\"ln_anom\":{:.9g},\"threshold\":{:.9g},"
                                "\"score\":{:.9g},\"level\":{}}}",
                                v.t_s, v.ln_anom, v.threshold, v.score, v.level));
  if (trace_) {
    trace_->write(fmt::format("{:.6f},{:.9g},{:.9g},{:.9g},{},{}\n", v.t_s, v.ln_anom, v.threshold,
                              v.score, v.level, csv_field(log_name_)));
  }
  if (!traces_.empty() && v.blocks != blocks_) {
    traces_.back().points.push_back({v.t_s, v.ln_anom, v.threshold});
    blocks_ = v.blocks;
  }
}

void ReplayOutputs::record(const rim_alarm &record) {
  ++records_;
  if (report_)
    report_->record(record);
  if (!mcap_path_.empty() && record.state != RIM_ALARM_NONE)
    add_mcap(true, alarm_json(record, names_));
  if (alarms_ && record.state != RIM_ALARM_NONE) // that one tells of no alarm
    alarms_->write(alarm_json(record, names_) + "\n");
  if (candump_)
    candump_->write(record);
  for (const rim_can_frame &frame :
       can_ ? alarm_frames(record, node_, can_fd_) : std::vector<rim_can_frame>{})
    can_->send(frame);
  if (lcm_)
    lcm_->publish(record);
  if (!traces_.empty() && record.state == RIM_ALARM_RAISED)
    traces_.back().alarms_s.push_back(record.t_s);
}

void ReplayOutputs::end(const ReplayedLog &log) {
  if (report_)
    report_->end(log, names_);
  // What was said in the end: more blocks may have named another outcome.
  const rim_alarm &found = log.raised > 0 ? log.last : log.interference.first;
  if (!traces_.empty() && found.state != RIM_ALARM_NONE)
    traces_.back().sentence =
        found.channels > 0 ? names_.outcome(found.channel[0]).words : std::string("motion");
  if (labels_)
    labels_->write(labels_text(log.labels));
  if (!lcm_)
    return;
  rim_health_message health = {};
  health.t_s = log.health.last_valid_s;
  health.sequence = ++health_sequence_;
  health.model_id = model_id_;
  health.observations = log.health.rows.rows_used;
  health.rejected = log.rows_skipped + log.health.rows.not_finite + log.health.rows.time_back;
  health.gaps = log.health.rows.gaps;
  health.alarms = records_;
  health.level = log.alarms.level;
  health.flags = RIM_HEALTH_FLAG_REPLAY;
  lcm_->publish(health);
}

void ReplayOutputs::commit() {
  if (!mcap_path_.empty())
    write_mcap();
  if (!plot_path_.empty())
    write_plot(traces_, plot_path_);
  if (report_)
    report_file_->write(report_->html());
  const HoldInterrupts whole; // a moment: all files of this flight or none
  for (AtomicFile *file : {alarms_.get(), labels_.get(), trace_.get(), report_file_.get()}) {
    if (file != nullptr)
      file->commit();
  }
  if (candump_)
    candump_->commit();
}

} // namespace rim
