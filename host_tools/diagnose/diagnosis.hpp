// SPDX-License-Identifier: MIT
// diagnose/diagnosis.hpp - what a diagnosis says: findings, the gain, and how sure it is.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "diagnose/term.hpp"

namespace rim::diagnose {

// The next cause's BIC must be at least so much worse for the claimed one to be told from it: odds
// of 20 to 1.
inline constexpr double kSeparableBic = 6.0;

// Another cause for the same rows.
struct Alternative {
  std::string cause;
  std::string expression;
  double delta_bic = 0.0;  // BIC of the alternative less BIC of what is claimed, joint model: >= 0
                           // says the claim is better
  double heldout_r2 = 0.0; // share of the residual's weighted sum of squares, on held-out blocks
};

// The range of a term's argument in the rows that it was learnt from, and in the held-out ones.
struct Learnt {
  std::string feature, unit;
  double low = 0.0, high = 0.0;
  double beyond = 0.0;            // share of the held-out rows outside: the law is extrapolated
  double least = 0.0, most = 0.0; // of the held-out rows
};

struct Finding {
  int number = 0; // from 1, in the order of the likelihood lost without it: labels.csv
  Term term;
  std::string sentence;
  double inside_fraction = 1.0; // of the rows
  double ln_anom = 0.0;         // ln likelihood ratio of the joint model with and without it,
                                // corrected for autocorrelation
  double p_value = 1.0;         // of the whole search, from the simulated null
  double heldout_r2 = 0.0;
  std::vector<Alternative> alternatives; // best first
  bool separable = true;
  std::vector<std::uint8_t> acts; // per row: the effect exceeds .1 sd (or the row is flagged)
  std::vector<Learnt> learnt;     // of a law that goes on beyond; empty: it does not
  int harmonic = 0;               // of what swings: of another finding; 0: it is none
  bool given = false;             // it came with --extension and was not searched for
};

// Where residuals shift together, whatever the cause (DMAPS, Alg. 3, p. 33): each row in one region
// at most.
struct ResidualRegion {
  std::string channel;
  Gate gate;             // an ellipsoid over at most three features
  double shift_sd = 0.0; // most likely shift, in stated sd
  double ln_anom = 0.0;  // of its own rows, corrected for autocorrelation and scale
  std::size_t rows = 0;
};

struct Interval95 {
  double low = 0.0, high = 0.0;
};

// One channel over one set of rows and one horizon, before and after the extension.
struct Gain {
  std::string channel, unit;
  std::string where;      // "all", "inside", "outside" the findings' regions
  double horizon_s = 0.0; // 0: one step
  std::string data;       // "held-out logs" or "cross-validated"
  std::size_t rows = 0;
  double rmse_before = 0.0, rmse_after = 0.0;
  double nll_before = 0.0, nll_after = 0.0; // mean, nats a row
  double mpa_before = 0.0, mpa_after = 0.0; // eq. 3.38, p. 44: mean predicted density
  double ratio = 1.0;                       // rmse_after / rmse_before
  Interval95 ratio_ci95, nll_gain_ci95;     // resampling whole logs, or blocks where logs are few
  bool worse = false; // ratio more than 2 % above 1; or more than .5 %, and its interval above 1
};

// Whether data that the extension was not fitted to is predicted better with it.
inline bool is_borne_out(const Gain &gain) {
  return gain.ratio_ci95.low < 1.0 && gain.ratio <= 1.0;
}

struct ChannelState {
  std::string channel;
  Vector m_after, sd_after;     // over the whole table
  double autocorrelation = 0.0; // lag 1, of what remains
  double scale = 1.0;           // estimated sd over stated sd, of what remains
  double threshold = 0.0;       // a claim's least score
  std::size_t rows_flagged = 0; // stuck or dropped out
};

struct Diagnosis {
  std::vector<Finding> findings;
  std::vector<Finding> unconfirmed;    // seen, and not claimed: the sentence says why
  std::size_t doubts = 0; // of the unconfirmed: those that leave open whether the simulation holds
  std::vector<ResidualRegion> regions; // before any term is added; of channels with findings
  std::vector<Gain> gains;
  std::vector<ChannelState> channels;
  std::vector<std::string> notes; // what the reader must know: sd estimated, a feature constant ...
  std::string sentence;           // the whole in a sentence or two
  std::string command;            // how to make it again
  std::string model;              // "the logs' own predictions", "world falcon", "image x.rim"
  std::uint64_t seed = 1;
  // Nothing was found beside what came with --extension.
  bool adequate() const {
    return std::all_of(findings.begin(), findings.end(), [](const Finding &f) { return f.given; });
  }
};

} // namespace rim::diagnose
