// SPDX-License-Identifier: MIT
// util/progress.hpp - a progress bar on stderr for work that takes more than two seconds.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <mutex>
#include <string>

namespace rim {

// Where stderr is no terminal: a line every ten seconds. add() may be called from any thread; the
// line is removed when the object ends.
class Progress {
public:
  Progress(std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress &) = delete;
  Progress &operator=(const Progress &) = delete;
  void add(std::size_t done = 1);

private:
  void draw(std::size_t done, double elapsed_s);

  std::string label_;
  std::size_t total_;
  bool terminal_;
  bool drawn_ = false;
  std::atomic<std::size_t> done_{0};
  std::mutex drawing_;
  std::chrono::steady_clock::time_point start_, last_;
};

} // namespace rim
