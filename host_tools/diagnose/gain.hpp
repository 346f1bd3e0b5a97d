// SPDX-License-Identifier: MIT
// diagnose/gain.hpp - what an extension is worth on data it was not fitted to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"

namespace rim::diagnose {

// One channel's outcome beside its prediction before and after, for rows that were not fitted.
struct Judged {
  std::vector<double> z, before, after, sd_before, sd_after;
  std::vector<std::uint8_t> inside;  // some finding acts
  std::vector<std::uint8_t> flagged; // no measurement: stuck or dropped out
  std::vector<std::size_t> unit;     // rows of one unit are resampled together
};

// Rows of one channel of a table, predicted by `terms`; those that are no measurements marked.
void append_judged(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                   Judged *judged);
// Whether some term adds more than .1 sd, or changes the scatter, on each row.
std::vector<std::uint8_t> acting(const std::vector<Term> &terms, const Measured &measured,
                                 const Channel &channel);
// Means over windows of the horizon, in which what is systematic adds up and noise does not: for
// predictions that nothing rolls out (diagnose/rollout.hpp where something does).
void append_means(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                  double horizon_s, Judged *judged);

// "all", and where there is any, "inside" and "outside", without rows that are no measurements;
// where there are such, "with flagged" counts them too. Bootstrap over units, 400 draws.
std::vector<Gain> summarise(const Judged &judged, const Channel &channel, double horizon_s,
                            const std::string &data, std::uint64_t seed);

} // namespace rim::diagnose
