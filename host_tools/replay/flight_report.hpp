// SPDX-License-Identifier: MIT
// replay/flight_report.hpp - rim replay --report: what the monitor said of logs, as a page.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "log/log.hpp"
#include "replay/replay.hpp"
#include "report/explore.hpp"

namespace rim {

// Gathers logs as they are replayed, and writes one self-contained page: every alarm with its
// outcome measured against expected and the band, where and since when, what the other outcomes do,
// and the score against its threshold. Readable without scripts; with dygraphs it can be touched
// (report/explore.hpp).
class FlightReport {
public:
  // model: the flight image's path; empty: the logs bring their predictions.
  FlightReport(std::string model, std::string made_by, std::size_t outcomes);
  void begin(const Log &log);
  // residuals: of the newest block in so many channels (monitor/inspect.h), or nullptr.
  void verdict(const rim_verdict &verdict, const double *residuals, std::size_t channels);
  void record(const rim_alarm &record);
  // result must hold the labels of the rows.
  void end(const ReplayedLog &result, const Names &names);
  std::string html() const;

private:
  struct Alarm {
    rim_alarm raised{}, last{};
    std::size_t block = 0; // of the last record
    std::string sentence;
  };
  // Outcomes beside what was expected of them, a row or a block each.
  struct Flight {
    Log rows; // z. m. sd. columns, and context
    ReplayedLog result;
    std::string text, why_not_drawn;
    std::vector<std::pair<rim_alarm, std::size_t>> records; // and the block
    std::vector<Alarm> alarms;
    std::vector<double> t_s, score; // of blocks
    std::vector<std::uint16_t> channel;
    std::vector<std::vector<float>> residual; // [blocks][channels]; empty: not known
  };
  report::Explore explore() const;
  void add_findings(const Flight &flight, int log, report::Explore *data) const;
  std::string card(const Flight &flight) const;
  std::string judged_picture(const Flight &flight, const Alarm &alarm, const Names &names) const;
  std::string alarm_card(const Flight &flight, std::size_t number, const Names &names) const;

  std::string model_, made_by_;
  std::size_t outcomes_;
  std::vector<Flight> flights_;
  Names names_;
  std::uint32_t blocks_ = 0;
};

} // namespace rim
