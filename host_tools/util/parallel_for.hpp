// SPDX-License-Identifier: MIT
// util/parallel_for.hpp - a loop over independent items on a fixed number of threads.
#pragma once

#include <cstddef>
#include <functional>

namespace rim {

// Two, or $RIM_THREADS (1..64).
std::size_t parallel_threads();

// Calls body(i) for every i < n, in any order, on parallel_threads() threads. Results are the same
// for any number of threads when body(i) writes only what belongs to i: store by index, fold after.
// An exception stops the loop; of several the one with the lowest index is thrown.
void parallel_for(std::size_t n, const std::function<void(std::size_t)> &body);

} // namespace rim
