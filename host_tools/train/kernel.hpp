// SPDX-License-Identifier: MIT
// The thesis's own nominal model: kernel-weighted mean and variance of the next state, eq. 4.13
// and 4.14 (p. 63), plain over many training rows and compressed to prototypes, to compare with
// fit.hpp.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "log/log.hpp"
#include "train/fit.hpp"

namespace rim {

// Gaussian kernel over the nearest rows of the standardised inputs. The sum of eq. 4.13 is cut
// after the nearest `neighbours` rows: what lies beyond them weighs less than each of those.
class PlainKernel {
public:
  static constexpr std::uint32_t no_run = std::numeric_limits<std::uint32_t>::max();

  // Keeps every n-th row, so that about most_rows stay.
  PlainKernel(const Matrix &x, const Matrix &y, const std::vector<std::uint32_t> &run,
              std::size_t most_rows, std::size_t neighbours);
  ~PlainKernel();
  PlainKernel(PlainKernel &&) noexcept;
  PlainKernel &operator=(PlainKernel &&) noexcept;

  // Median distance of a sample of rows to the nearest row of another run: the unit of bandwidth.
  double spacing() const;

  // Mean and variance of the outcomes in context x by the rows of all runs but one, one pair for
  // each bandwidth (standardised distance); mean and variance are bandwidths x outputs.
  void predict(const double *x, std::uint32_t without_run, const std::vector<double> &bandwidth,
               Matrix &mean, Matrix &variance) const;

private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

struct KernelOptions {
  std::size_t train_rows = 60000;
  std::size_t query_rows = 2000; // on which the errors are measured, each without its own run
  std::size_t neighbours = 64;
  std::uint32_t prototypes = 64;                     // of the compressed average, 1..64
  std::vector<double> bandwidth{0.25, 0.5, 1, 2, 4}; // candidates; times spacing, or rms radius
  std::uint64_t seed = 1;
};

// Root mean square errors per outcome in its own unit, each row predicted without its run.
struct KernelReport {
  double bandwidth = 0.0;           // of the plain kernel, standardised distance
  double prototype_bandwidth = 0.0; // of the compressed one
  std::vector<double> white;        // sd of the white noise of one reading, from second differences
  std::vector<double> kernel;       // eq. 4.13, plain
  std::vector<double> prototypes;   // eq. 4.13, compressed to prototypes
  std::vector<double> local;        // local-linear maps, in double precision
  std::vector<double> rounding;     // rms difference that single precision in flight makes to them
  NominalModel compressed;          // order 0, all runs
};

// `local` is what fit_nominal() returned for the same rows; once its mean has been dropped its
// error over all rows is reported instead. A few seconds.
KernelReport compare_kernels(const Matrix &x, const Matrix &y,
                             const std::vector<std::uint32_t> &run, const FitResult &local,
                             const KernelOptions &options);

} // namespace rim
