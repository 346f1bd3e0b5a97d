// SPDX-License-Identifier: MIT
// world/recording.hpp - what a run of a world leaves behind: its log and the truth about each row.
#pragma once

#include "log/log.hpp"
#include "world/golf.hpp"
#include "world/lander.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace rim::world {

struct Recording {
  Log log;
  std::vector<std::uint8_t> finding; // 1 on rows where an effect (golf: the bump) acts
};

// A column by its name (DESIGN.md, Logs). Throws std::logic_error where it has no role.
Column column_of(const std::string &name);
// Rows 1 .. of the log's times.
void number_rows(Log &log);

// `max_rows` ends the recording early; 0: the whole run.
Recording record_lander(const LanderRun &run, std::size_t max_rows);

// The log of one landing, named "seed S run R".
Log lander_log(const LanderParams &params, const std::vector<Effect> &effects, std::uint64_t seed,
               std::uint64_t run);

// Columns x.f001 .., z.reward, m.reward, sd.reward; one shot a second.
Recording record_golf(Golf &golf, std::size_t dims, std::size_t max_rows);

// "DIR/run_0001.csv"
std::string run_path(const std::string &folder, std::uint64_t run);

// CSV log,row,finding of all recordings, in order; row counts from 1. Throws DataError.
struct Truth {
  std::string log;
  std::vector<std::uint8_t> finding;
};
void write_truth(const std::vector<Truth> &truths, const std::string &path);

} // namespace rim::world
