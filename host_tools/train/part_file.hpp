// SPDX-License-Identifier: MIT
// train/part_file.hpp - the blocks of some healthy runs as a file, `rim train --shard I/N`.
//
// Little-endian. "RIMPART1"; u64 bytes of the header, the header (JSON: what is known of all runs),
// its CRC-32 as u64; u64 number of runs; then of each run u64 number, u64 bytes of its narrow and
// of its wide matrices, u64 CRC-32 of these three and of the matrices, and the matrices.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "train/healthy_runs.hpp"
#include "util/atomic_file.hpp"

namespace rim {

class PartWriter {
public:
  explicit PartWriter(const std::string &path) : file_(path) {}
  void begin(const HealthyRuns &healthy, std::size_t runs);
  void add(std::size_t number, const BlockRun &run);
  void commit() { file_.commit(); }

private:
  AtomicFile file_;
};

// What is known of all runs; equal in all parts of the same logs.
std::string plan_text(const HealthyRuns &healthy);
// The same from a part file, without its runs.
HealthyRuns read_part_header(const std::string &path);
// Puts the file's runs into healthy->runs; their wide matrices stay in the file. holder: per run
// the file that it came from, empty as yet.
void read_part_runs(const std::string &path, HealthyRuns *healthy,
                    std::vector<std::string> *holder);

} // namespace rim
