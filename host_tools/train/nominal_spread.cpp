#include "train/nominal_spread.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rim/envelope.h"
#include "train/image_writer.hpp"
#include "util/parallel_for.hpp"

namespace rim {

namespace {

constexpr std::size_t kBatch = 16;       // blocks whose mean tells the autocorrelation
constexpr std::uint32_t kLeastRuns = 10; // runs that must have visited an interval

// Variance of one value about its run's mean, as it acts in means of many: kBatch times the
// variance of means of kBatch neighbours, which holds their autocorrelation.
std::vector<double> within_run_variance(const std::vector<BinnedRun> &runs) {
  const Eigen::Index channels = runs.front().value.cols();
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(channels);
  double count = 0.0;
  for (const BinnedRun &run : runs) {
    const Eigen::RowVectorXd mean = run.value.colwise().mean();
    const Eigen::Index batch = std::min<Eigen::Index>(kBatch, run.value.rows());
    for (Eigen::Index at = 0; at + batch <= run.value.rows(); at += batch) {
      const Eigen::RowVectorXd d = run.value.middleRows(at, batch).colwise().mean() - mean;
      sum += static_cast<double>(batch) * d.array().square().matrix().transpose();
      count += 1.0;
    }
  }
  std::vector<double> a(static_cast<std::size_t>(channels));
  for (std::size_t c = 0; c < a.size(); ++c) {
    a[c] = std::max(1e-3, sum[static_cast<Eigen::Index>(c)] / std::max(1.0, count));
  }
  return a;
}

std::uint8_t code_of(double variance) {
  const double code = std::round(128.0 + 8.0 * std::log2(variance));
  return static_cast<std::uint8_t>(std::clamp(code, 0.0, 255.0));
}

} // namespace

NominalSpread::NominalSpread(const std::vector<BinnedRun> &runs, std::size_t features,
                             std::size_t bins, std::uint32_t least_n, std::vector<double> quantum)
    : features_(features), bins_(bins), intervals_(RIM_ENVELOPE_INTERVALS(bins)),
      least_n_(least_n), runs_(runs.size()), quantum_(std::move(quantum)) {
  channels_ = static_cast<std::size_t>(runs.front().value.cols());
  within_ = within_run_variance(runs);
  for (std::size_t c = 0; c < channels_; ++c) { // so that it holds for intervals still filling
    within_[c] = std::max(within_[c], quantum_[c] * quantum_[c] / static_cast<double>(least_n));
  }
  parallel_for(runs.size(), [&](std::size_t r) { runs_[r] = run_of(runs[r]); });
  square_.assign(channels_ * features_ * intervals_ * 2, 0.0);
  usual_.assign(features_ * intervals_ * 2, 0.0);
  judged_.assign(usual_.size(), 0);
  for (const Run &run : runs_) {
    for (std::size_t i = 0; i < square_.size(); ++i)
      square_[i] += static_cast<double>(run.square[i]);
    for (std::size_t i = 0; i < usual_.size(); ++i) {
      usual_[i] += static_cast<double>(run.usual[i]);
      judged_[i] += run.usual[i] > 0.0F ? 1 : 0;
    }
  }
}

NominalSpread::Run NominalSpread::run_of(const BinnedRun &run) const {
  Run out;
  out.square.assign(channels_ * features_ * intervals_ * 2, 0.0F);
  out.usual.assign(features_ * intervals_ * 2, 0.0F);
  const auto blocks = static_cast<std::size_t>(run.value.rows());
  const double all_n = static_cast<double>(blocks);
  const Eigen::RowVectorXd all_s = run.value.colwise().sum();
  for (std::size_t f = 0; f < features_; ++f) {
    Matrix sum = Matrix::Zero(static_cast<Eigen::Index>(bins_ + 1), run.value.cols());
    std::vector<double> n(bins_ + 1, 0.0);
    for (std::size_t t = 0; t < blocks; ++t) {
      const std::size_t k = run.bin[t * features_ + f] + std::size_t{1};
      sum.row(static_cast<Eigen::Index>(k)) += run.value.row(static_cast<Eigen::Index>(t));
      n[k] += 1.0;
    }
    for (std::size_t k = 1; k <= bins_; ++k) {
      sum.row(static_cast<Eigen::Index>(k)) += sum.row(static_cast<Eigen::Index>(k - 1));
      n[k] += n[k - 1];
    }
    std::size_t at = 0;
    for (std::size_t i = 0; i < bins_; ++i) {
      for (std::size_t j = i; j < bins_; ++j, ++at) {
        const double inside = n[j + 1] - n[i];
        const double rest = all_n - inside;
        if (inside < least_n_)
          continue;
        const Eigen::RowVectorXd s =
            sum.row(static_cast<Eigen::Index>(j + 1)) - sum.row(static_cast<Eigen::Index>(i));
        const std::size_t level = 2 * (f * intervals_ + at);
        out.usual[level] = static_cast<float>(inside);
        if (rest >= least_n_)
          out.usual[level + 1] = static_cast<float>(inside * rest / all_n);
        for (std::size_t c = 0; c < channels_; ++c) {
          const auto column = static_cast<Eigen::Index>(c);
          const double mean = s[column] / inside;
          const std::size_t to = 2 * ((c * features_ + f) * intervals_ + at);
          out.square[to] = static_cast<float>(mean * mean);
          if (rest < least_n_)
            continue;
          const double d = mean - (all_s[column] - s[column]) / rest;
          out.square[to + 1] = static_cast<float>(d * d);
        }
      }
    }
  }
  return out;
}

std::vector<std::uint8_t> NominalSpread::section(int left_out) const {
  const Run *without = left_out < 0 ? nullptr : &runs_[static_cast<std::size_t>(left_out)];
  SectionBytes bytes;
  for (const std::size_t word : {std::size_t{RIM_ENVELOPE_LAYOUT}, channels_, features_, bins_,
                                 std::size_t{least_n_}, std::size_t{0}}) {
    bytes.u32(static_cast<std::uint32_t>(word));
  }
  const auto least_runs =
      std::min<std::uint32_t>(kLeastRuns, static_cast<std::uint32_t>(runs_.size()) / 2 + 1);
  std::vector<double> count(usual_.size()), usual(usual_.size());
  for (std::size_t i = 0; i < usual_.size(); ++i) {
    const bool other = without != nullptr && without->usual[i] > 0.0F;
    count[i] = judged_[i] - (other ? 1.0 : 0.0);
    const double sum = usual_[i] - (other ? static_cast<double>(without->usual[i]) : 0.0);
    usual[i] = count[i] >= least_runs ? std::max(1.0, sum / count[i]) : 0.0;
    bytes.u16(static_cast<std::uint16_t>(std::min(65535.0, std::round(usual[i]))));
  }
  for (const double a : within_)
    bytes.f32(static_cast<float>(a));
  for (std::size_t c = 0; c < channels_; ++c) {
    for (std::size_t i = 0; i < usual.size(); ++i) {
      const std::size_t at = c * usual.size() + i;
      const double sum =
          square_[at] - (without != nullptr ? static_cast<double>(without->square[at]) : 0.0);
      // Few runs can agree by chance: never below half of what the noise within a run makes.
      const double least = usual[i] > 0.0 ? 0.5 * within_[c] / usual[i] : 1.0;
      const double step = usual[i] > 0.0 ? quantum_[c] / usual[i] : 0.0;
      const double spread = count[i] > 0.0 ? sum / count[i] : 1.0;
      bytes.u8(code_of(std::max(least, spread + step * step)));
    }
  }
  return bytes.bytes();
}

} // namespace rim
