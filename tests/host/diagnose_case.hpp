// SPDX-License-Identifier: MIT
// Small tables for the tests of rim diagnose: logs of equal length, features drawn or computed row
// by row, one channel whose prediction and stated sd are given.
#pragma once

#include <cstdio>
#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "base/rng.h"
#include "check.hpp"
#include "diagnose/measured.hpp"

namespace diagnose_case {

using rim::diagnose::Channel;
using rim::diagnose::Feature;
using rim::diagnose::Measured;
using rim::diagnose::Vector;

class Random {
public:
  explicit Random(std::uint64_t seed) { rimi_rng_seed(&rng_, seed, 5); }
  double normal() { return rimi_rng_normal(&rng_); }
  double uniform() { return rimi_rng_uniform(&rng_); }

private:
  rim_rng rng_;
};

// `logs` logs of `rows` rows, dt seconds apart; features and one channel of zeros with sd 1.
inline Measured table(std::size_t logs, std::size_t rows, double dt,
                      const std::vector<Feature> &features, const std::string &channel = "a_mps2",
                      const std::string &unit = "m/s2") {
  Measured out;
  for (std::size_t l = 0; l < logs; ++l) {
    out.logs.push_back(
        {"log" + std::to_string(l + 1), l * rows, rows, static_cast<std::uint32_t>(rows)});
    for (std::size_t i = 0; i < rows; ++i) {
      out.t_s.push_back(100.0 + dt * static_cast<double>(i));
      out.elapsed_s.push_back(dt * static_cast<double>(i));
      out.row.push_back(static_cast<std::uint32_t>(i + 1));
    }
  }
  const auto n = static_cast<Eigen::Index>(logs * rows);
  out.features = features;
  out.x = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(features.size()));
  Channel c;
  c.name = channel;
  c.unit = unit;
  c.z = c.m = Vector::Zero(n);
  c.sd = Vector::Ones(n);
  out.channels.push_back(c);
  return out;
}

// DataError whose text contains every part.
inline void assert_refused(const std::function<void()> &body,
                           const std::vector<std::string> &parts) {
  try {
    body();
  } catch (const rim::DataError &error) {
    for (const std::string &part : parts) {
      if (std::strstr(error.what(), part.c_str()) == nullptr)
        fail_msg("'%s' does not contain '%s'", error.what(), part.c_str());
    }
    return;
  }
  fail_msg("nothing was thrown; expected '%s'", parts.empty() ? "" : parts[0].c_str());
}

inline void assert_near(double got, double wanted, double tolerance) {
  if (!(got >= wanted - tolerance && got <= wanted + tolerance))
    fail_msg("%.12g is not within %g of %.12g", got, tolerance, wanted);
}

inline void assert_values(const Vector &got, const std::vector<double> &wanted,
                          double tolerance = 1e-12) {
  assert_int_equal(got.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i)
    assert_near(got(static_cast<Eigen::Index>(i)), wanted[i], tolerance);
}

} // namespace diagnose_case
