// SPDX-License-Identifier: MIT
// util/parallel_for.hpp - a loop over independent items on a fixed number of threads.
#pragma once

#include <cstddef>
#include <functional>

namespace rim {

// What set_parallel_threads() said, else $RIM_THREADS (1..64), else two.
std::size_t parallel_threads();
// From 1 to 64; 0 takes it back. Not while a loop runs.
void set_parallel_threads(std::size_t threads);

// Calls body(i) for every i < n, in any order, on parallel_threads() threads. Results are the same
// for any number of threads when body(i) writes only what belongs to i: store by index, fold after.
// An exception stops the loop; of several the one with the lowest index is thrown.
void parallel_for(std::size_t n, const std::function<void(std::size_t)> &body);

} // namespace rim
