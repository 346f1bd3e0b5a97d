// SPDX-License-Identifier: MIT
#include "util/parallel_for.hpp"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace rim {

namespace {
std::size_t chosen_threads = 0; // 0: by the environment
std::atomic<bool> stopped{false};
} // namespace

void set_parallel_threads(std::size_t threads) { chosen_threads = threads; }

void stop_work(bool stop) { stopped = stop; }

std::size_t parallel_threads() {
  if (chosen_threads > 0)
    return std::min<std::size_t>(chosen_threads, 64);
  const char *set = std::getenv("RIM_THREADS");
  const long n = set != nullptr ? std::strtol(set, nullptr, 10) : 2;
  return static_cast<std::size_t>(std::clamp(n, 1L, 64L));
}

void parallel_for(std::size_t n, const std::function<void(std::size_t)> &body) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> stop{false};
  std::mutex failing;
  std::exception_ptr failure;
  std::size_t failed_index = n;
  const auto work = [&] {
    for (;;) {
      const std::size_t i = next++;
      if (i >= n || stop)
        return;
      try {
        if (stopped)
          throw WorkStopped();
        body(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(failing);
        if (i < failed_index) {
          failed_index = i;
          failure = std::current_exception();
        }
        stop = true;
      }
    }
  };
  std::vector<std::thread> threads;
  for (std::size_t t = 1; t < std::min(parallel_threads(), n); ++t)
    threads.emplace_back(work);
  work();
  for (auto &t : threads)
    t.join();
  if (failure)
    std::rethrow_exception(failure);
}

} // namespace rim
