// diagnose/gain.hpp - what an extension is worth on data it was not fitted to.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"
#include "world/predictor.hpp"

namespace rim::diagnose {

// One channel's outcome beside its prediction before and after, for rows that were not fitted.
struct Judged {
  std::vector<double> z, before, after, sd_before, sd_after;
  std::vector<std::uint8_t> inside; // some finding acts
  std::vector<std::size_t> unit;    // rows of one unit are resampled together
};

// Rows of one channel of a table, predicted by `terms`; rows that are no measurements left out.
void append_judged(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                   Judged *judged);
// The same at a horizon: rolled out by the predictor, each step corrected; without one, the mean
// over the horizon, in which what is systematic adds up and noise does not.
void append_horizon(const std::vector<Term> &terms, const Measured &measured, std::size_t channel,
                    double horizon_s, const world::Predictor *predictor,
                    const std::vector<Log> *logs, Judged *judged);

// "all", and where there is any, "inside" and "outside". Bootstrap over units, 400 draws.
std::vector<Gain> summarise(const Judged &judged, const Channel &channel, double horizon_s,
                            const std::string &data, std::uint64_t seed);

} // namespace rim::diagnose
