// SPDX-License-Identifier: MIT
// util/parallel_for.hpp - a loop over independent items on a fixed number of threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <exception>
#include <functional>
#include <utility>
#include <vector>

namespace rim {

// What set_parallel_threads() said, else $RIM_THREADS (1..64), else two.
std::size_t parallel_threads();
// From 1 to 64; 0 takes it back. Not while a loop runs.
void set_parallel_threads(std::size_t threads);

// Thrown by parallel_for() after stop_work(true).
struct WorkStopped : std::exception {
  const char *what() const noexcept override { return "stopped"; }
};

// From now on every parallel_for() of the process throws WorkStopped before its next item, until
// stop_work(false): how a long computation ends early when the user interrupts the program that it
// is a library of. From any thread.
void stop_work(bool stop);

// Calls body(i) for every i < n, in any order, on parallel_threads() threads. Results are the same
// for any number of threads when body(i) writes only what belongs to i: store by index, fold after.
// An exception stops the loop; of several the one with the lowest index is thrown.
void parallel_for(std::size_t n, const std::function<void(std::size_t)> &body);

// take(i, make(i)) for every i < n in ascending order, where make() runs on all threads and a few
// results at most are held: sums over many items have the same bits for any number of threads.
template <class Make, class Take>
void parallel_in_order(std::size_t n, const Make &make, const Take &take) {
  const std::size_t batch = 4 * parallel_threads();
  for (std::size_t first = 0; first < n; first += batch) {
    std::vector<decltype(make(first))> made(std::min(batch, n - first));
    parallel_for(made.size(), [&](std::size_t k) { made[k] = make(first + k); });
    for (std::size_t k = 0; k < made.size(); ++k)
      take(first + k, std::move(made[k]));
  }
}

} // namespace rim
