// SPDX-License-Identifier: MIT
// Fits the compressed kernel model of eq. 4.13 and 4.14 (p. 63) with a local-linear map per
// prototype.
//
// Prototypes are k-means centres of the standardised inputs, gates the largest few Gaussian
// weights, maps weighted ridge regressions shrunk to one global map. Everything a map needs is in
// Gram matrices kept per run, so that the model without a run is an exact downdate and every choice
// (ridge, bandwidth, number of prototypes) is made by cross-validation over whole runs: rows of one
// run share its biases, and a row-wise split would learn them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "log/log.hpp"

namespace rim {

// A model in double precision; nominal_section() writes it for flight. Gate values are exactly
// representable in single precision, so that flight and ground open the same gates.
struct NominalModel {
  std::uint32_t order = 1;                            // 0: prototypes average; 1: local-linear maps
  std::uint32_t top = 4;                              // prototypes that speak in one context
  Eigen::VectorXd centre, inverse_scale, gate_weight; // inputs
  Matrix prototypes;                                  // P x inputs, standardised
  Eigen::VectorXd bandwidth, reach, ln_mass;          // P
  Matrix variance;                                    // P x outputs
  Matrix offset;                                      // P x outputs, outcome's unit
  std::vector<Matrix> maps; // P of outputs x inputs, outcome's unit per standardised input; order 1
};

struct FitOptions {
  std::vector<std::uint32_t> prototypes{8, 16, 24}; // candidates, ascending, each 1..64
  std::vector<double> bandwidth{0.5, 0.75, 1.0}; // candidates, times a prototype's own rms radius
  std::vector<double> ridge{1e-2, 1e-1, 1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6}; // candidates, in rows
  std::uint32_t top = 4;                                                    // 1..8
  std::vector<int> exclude; // per output: input whose coefficient is zero, -1 none; empty: none
  std::vector<double> gate_weight; // per input, >= 0; empty: 1 each
  std::vector<double> input_error; // per input: sd of its reading's own error; empty: white_noise()
  double focus = 0.5;              // 0..1: share of prototypes placed by where one map errs most
  double prefer_fewer = 0.01;      // a larger model must lower the error by this fraction
  std::size_t search_rows = 60000; // rows used to choose prototypes and bandwidth
  std::uint64_t seed = 1;
};

struct FitCandidate {
  std::uint32_t prototypes = 0;
  double bandwidth = 0.0;
  double error = 0.0; // geometric mean over outputs of rmse / sd of the output, left-one-run-out
};

struct FitResult {
  NominalModel model;                   // of all runs
  std::vector<FitCandidate> candidates; // all that were tried
  FitCandidate chosen;
  std::vector<double> ridge, ridge_global; // chosen, per output
  std::vector<double> rmse;                // per output, left-one-run-out, all rows
  Matrix mean, sd; // rows x outputs: each run predicted by the model fitted without it
  // rows x outputs: 1 where rimi_nominal_beyond() by what the other runs reach; without
  // FitOptions::exclude: 0.
  Matrix beyond;
};

// Rows of a run are contiguous in run[]. At least two runs, every value finite; throws DataError.
// Cost about rows * top * (inputs + outputs)^2 / 2 multiply-adds plus the candidates on
// search_rows.
FitResult fit_nominal(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
                      const FitOptions &options);

// The model's section of the flight image (layout in rim/nominal.h), in single precision.
std::vector<std::uint8_t> nominal_section(const NominalModel &model);

// The model in double precision on one context: what flight computes, before its rounding.
void predict(const NominalModel &model, const double *x, double *mean, double *sd,
             double *extrapolation);

// White noise of one reading per column: second differences of a smooth signal hold 6 variances of
// the noise and hardly any of the signal. Their median, so that jumps do not count.
std::vector<double> white_noise(const Matrix &series, const std::vector<std::uint32_t> &run);

// Predictions of the flight code on many contexts (rows x inputs).
struct Prediction {
  Matrix mean, sd;
  std::vector<double> extrapolation;
};
Prediction predict_flight(const std::vector<std::uint8_t> &section, const Matrix &x);

} // namespace rim
