// SPDX-License-Identifier: MIT
// stats/conformal.hpp - the rank that a promise about the next run needs.
#pragma once

#include <cmath>
#include <cstddef>

namespace rim {

// The rank, from 1 in ascending order, of the largest score among `runs` exchangeable runs that a
// further run exceeds with a probability of at most `rate`: ceil((runs + 1)(1 - rate)). Above
// `runs` where so few runs cannot promise the rate.
inline std::size_t conformal_rank(std::size_t runs, double rate) {
  const double rank = std::ceil((static_cast<double>(runs) + 1.0) * (1.0 - rate) - 1e-9);
  return rank < 1.0 ? 1 : static_cast<std::size_t>(rank);
}

// The rate that a rank among `runs` promises.
inline double conformal_rate(std::size_t runs, std::size_t rank) {
  const double n = static_cast<double>(runs) + 1.0;
  return (n - static_cast<double>(rank)) / n;
}

} // namespace rim
