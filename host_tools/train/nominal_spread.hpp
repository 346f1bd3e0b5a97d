// How far the mean of each channel strays over nominal runs, by interval: section ENVELOPE.
#ifndef RIM_TRAIN_NOMINAL_SPREAD_HPP
#define RIM_TRAIN_NOMINAL_SPREAD_HPP

#include <cstdint>
#include <vector>

#include "log/log.hpp"

namespace rim {

// One run as the search sees it: bin of every region feature and standardised value of every
// channel.
struct BinnedRun {
  std::vector<std::uint8_t> bin; // blocks x features
  Matrix value;                  // blocks x channels
};

// Sums over runs of what every interval shows, from which the envelope of all runs, or of all but
// one, is made. Memory: 4 bytes x channels x features x intervals x 2 x (runs + 1).
class NominalSpread {
public:
  // quantum, per channel: the step in which the sum over an interval can change (0: none). A mean is
  // never judged finer than one quantum in the interval's sum: rare counts have a heavier tail than
  // the Gaussian that their variance suggests.
  NominalSpread(const std::vector<BinnedRun> &runs, std::size_t features, std::size_t bins,
                std::uint32_t least_n, std::vector<double> quantum);

  // The section's bytes without run `left_out` (its index), or of all runs with -1.
  std::vector<std::uint8_t> section(int left_out) const;

private:
  struct Run {
    std::vector<float> square; // [channels][features][intervals][2]; 0 where not judged
    std::vector<float> usual;  // [features][intervals][2]; 0 where not judged
  };
  Run run_of(const BinnedRun &run) const;

  std::size_t features_, bins_, channels_ = 0, intervals_;
  std::uint32_t least_n_;
  std::vector<Run> runs_;
  std::vector<double> square_, usual_; // sums over runs
  std::vector<std::uint32_t> judged_;  // runs that judged [features][intervals][2]
  std::vector<double> within_;         // a, per channel
  std::vector<double> quantum_;
};

} // namespace rim
#endif
