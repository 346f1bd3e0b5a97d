// SPDX-License-Identifier: MIT
// world/random.hpp - random numbers of the worlds: counter-based streams.
//
// A stream is named by (seed, run, purpose); draw i of a stream is a hash of the stream's key and i
// (SplitMix64, Steele et al., OOPSLA 2014). Streams therefore do not depend on how many runs are
// made, in what order or on how many threads, and taking more numbers from one never shifts
// another.
#pragma once

#include <cmath>
#include <cstdint>

namespace rim::world {

class Random {
public:
  Random(std::uint64_t seed, std::uint64_t run, std::uint64_t purpose)
      : state_(mix(mix(mix(seed + kGolden) + run + kGolden) + purpose + kGolden)) {}

  std::uint64_t next() {
    state_ += kGolden;
    return mix(state_);
  }

  // Uniform in (0, 1): 53 bits, never 0 or 1.
  double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }

  double uniform(double low, double high) { return low + (high - low) * uniform(); }

  // Uniform in 0 .. n - 1; n > 0. Bias below n / 2^53.
  std::uint64_t below(std::uint64_t n) {
    return static_cast<std::uint64_t>(uniform() * static_cast<double>(n));
  }

  // Standard normal by Box and Muller; both values of a pair are used.
  double normal() {
    if (has_spare_) {
      has_spare_ = false;
      return spare_;
    }
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    const double angle = 6.283185307179586 * uniform();
    spare_ = radius * std::sin(angle);
    has_spare_ = true;
    return radius * std::cos(angle);
  }

private:
  static constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15U;

  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

} // namespace rim::world
