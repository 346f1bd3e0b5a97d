// SPDX-License-Identifier: MIT
#include "util/progress.hpp"

#include <algorithm>
#include <cstdio>
#include <unistd.h>

namespace rim {

namespace {
double seconds(std::chrono::steady_clock::duration d) {
  return std::chrono::duration<double>(d).count();
}
} // namespace

Progress::Progress(std::string label, std::size_t total)
    : label_(std::move(label)), total_(std::max<std::size_t>(total, 1)),
      terminal_(::isatty(STDERR_FILENO) == 1), start_(std::chrono::steady_clock::now()),
      last_(start_) {}

Progress::~Progress() {
  if (drawn_)
    std::fputs("\r\033[K", stderr);
}

void Progress::add(std::size_t done) {
  const std::size_t now_done = done_ += done;
  const std::unique_lock<std::mutex> lock(drawing_, std::try_to_lock);
  if (!lock.owns_lock())
    return;
  const auto now = std::chrono::steady_clock::now();
  if (seconds(now - start_) < 2.0 || seconds(now - last_) < (terminal_ ? 0.2 : 10.0))
    return;
  last_ = now;
  draw(std::min(now_done, total_), seconds(now - start_));
}

void Progress::draw(std::size_t done, double elapsed_s) {
  const double fraction = static_cast<double>(done) / static_cast<double>(total_);
  if (!terminal_) {
    std::fprintf(stderr, "%s: %.0f %%, %.0f s so far\n", label_.c_str(), 100.0 * fraction,
                 elapsed_s);
    return;
  }
  const int width = 30;
  const int filled = static_cast<int>(fraction * width);
  const double left_s = fraction > 0.0 ? elapsed_s * (1.0 - fraction) / fraction : 0.0;
  const std::string bar = std::string(static_cast<std::size_t>(filled), '#') +
                          std::string(static_cast<std::size_t>(width - filled), '.');
  std::fprintf(stderr, "\r%s [%s] %3.0f %%, %.0f s left\033[K", label_.c_str(), bar.c_str(),
               100.0 * fraction, left_s);
  std::fflush(stderr);
  drawn_ = true;
}

} // namespace rim
