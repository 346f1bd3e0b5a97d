// How far the mean of each channel strays over nominal runs, by interval: section ENVELOPE.
//
// The spread of an interval is that at the moment of a run when it is largest. A monitor judges
// runs that still go on: "the rest of the run" is then only what came before, and a contrast that
// cancels over a whole run (a middle against both ends) has not cancelled yet.
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

// What every interval shows in every run, from which the envelope of all runs, or of all but one,
// is made. Memory: 4 bytes x channels x features x intervals x 2 x runs; time: as much work for
// each of kMoments moments.
class NominalSpread {
public:
  // quantum, per channel: the step in which the sum over an interval can change (0: none). A mean
  // is never judged finer than one quantum in the interval's sum: rare counts have a heavier tail
  // than the Gaussian that their variance suggests.
  NominalSpread(const std::vector<BinnedRun> &runs, std::size_t features, std::size_t bins,
                std::uint32_t least_n, std::vector<double> quantum);

  // The section's bytes without run `left_out` (its index), or of all runs with -1.
  std::vector<std::uint8_t> section(int left_out) const;

private:
  struct Moments;
  std::uint32_t least_runs() const;
  void count_feature(const std::vector<BinnedRun> &runs, std::size_t feature);
  std::vector<std::uint16_t> largest_moments(const Moments &moments) const;
  template <class Look>
  void for_moments(const BinnedRun &run, std::size_t feature, std::size_t moments,
                   const Look &look) const;
  void measure_feature(const std::vector<BinnedRun> &runs, std::size_t feature);
  Moments moments_of(const std::vector<BinnedRun> &runs, std::size_t feature) const;
  std::size_t at(std::size_t channel, std::size_t feature, std::size_t slot) const {
    return (channel * features_ + feature) * slots_ + slot;
  }

  std::size_t features_, bins_, slots_, channels_ = 0,
                                        runs_; // slots: intervals x {level, contrast}
  std::uint32_t least_n_;
  std::size_t step_ = 1;          // blocks between moments
  std::vector<double> within_;    // a, per channel
  std::vector<double> quantum_;   // per channel
  std::vector<float> usual_;      // [features][slots]: mean over runs that judge it at their end
  std::vector<float> square_;     // [runs][channels][features][slots] at the largest moment
  std::vector<std::uint8_t> has_; // same shape: the run judges the slot at that moment
};

} // namespace rim
#endif
