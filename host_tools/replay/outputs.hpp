// SPDX-License-Identifier: MIT
// Where a replay's alarms and numbers go: files that appear whole, and LCM.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bus/can_bus.hpp"
#include "bus/candump.hpp"
#include "bus/lcm_bus.hpp"
#include "replay/flight_report.hpp"
#include "replay/plot.hpp"
#include "replay/replay.hpp"
#include "util/atomic_file.hpp"

namespace rim {

// Empty: not wanted.
struct OutputPaths {
  std::string alarms, labels, candump, trace, plot, report, mcap, lcm_url, can;
  std::string model;      // of the report: the flight image's path, or empty
  std::uint32_t node = 1; // of the CAN identifiers
  bool can_fd = false;    // detail in one frame of 64 bytes
  std::string made_by;    // the command line, for the report
};

class ReplayOutputs {
public:
  // Opens everything, so that a wrong name is found before the work. DataError.
  ReplayOutputs(const OutputPaths &paths, const Replayer &replayer);

  void begin(const Log &log);
  void verdict(const rim_verdict &verdict);
  void record(const rim_alarm &record);
  // The labels and the health message of the log that begin() named.
  void end(const ReplayedLog &log);
  // All files appear.
  void commit();

private:
  void add_mcap(bool is_alarm, const std::string &message);
  void write_mcap() const;

  std::unique_ptr<AtomicFile> alarms_, labels_, trace_, report_file_;
  std::unique_ptr<FlightReport> report_;
  std::unique_ptr<CandumpFile> candump_;
  std::unique_ptr<CanBus> can_;
  std::uint32_t node_ = 0;
  bool can_fd_ = false;
  std::unique_ptr<LcmBus> lcm_;
  std::string plot_path_, log_name_, mcap_path_, mcap_lines_;
  std::vector<Trace> traces_;
  const Replayer &replayer_;
  const Names &names_;
  std::uint32_t model_id_, health_sequence_ = 0, records_ = 0;
  std::uint32_t blocks_ = 0;
};

} // namespace rim
