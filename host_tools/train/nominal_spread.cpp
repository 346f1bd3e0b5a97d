#include "train/nominal_spread.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "rim/envelope.h"
#include "train/image_writer.hpp"
#include "util/parallel_for.hpp"

namespace rim {

namespace {

constexpr std::size_t kBatch = 16;   // blocks whose mean tells the autocorrelation
constexpr double kLeastShare = 0.6;  // of the runs must have visited an interval
constexpr std::size_t kMoments = 24; // of a run at which its intervals are looked at

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

std::size_t longest(const std::vector<BinnedRun> &runs) {
  Eigen::Index rows = 0;
  for (const BinnedRun &run : runs)
    rows = std::max(rows, run.value.rows());
  return static_cast<std::size_t>(rows);
}

// Sums of one feature's bins over a run so far.
struct Running {
  explicit Running(std::size_t bins, Eigen::Index channels)
      : n(bins, 0.0), sum(Matrix::Zero(static_cast<Eigen::Index>(bins), channels)) {}

  void add(const BinnedRun &run, std::size_t block, std::size_t bin) {
    n[bin] += 1.0;
    sum.row(static_cast<Eigen::Index>(bin)) += run.value.row(static_cast<Eigen::Index>(block));
  }

  // Calls judge(slot, effective number, mean row) for every interval that holds enough: slot even
  // the level, odd the contrast with the rest.
  template <class Judge> void intervals(double least, const Judge &judge) const {
    const Eigen::RowVectorXd all = sum.colwise().sum();
    double all_n = 0.0;
    for (const double v : n)
      all_n += v;
    std::size_t slot = 0;
    for (std::size_t i = 0; i < n.size(); ++i) {
      Eigen::RowVectorXd s = Eigen::RowVectorXd::Zero(all.size());
      double inside = 0.0;
      for (std::size_t j = i; j < n.size(); ++j, slot += 2) {
        s += sum.row(static_cast<Eigen::Index>(j));
        inside += n[j];
        if (inside < least)
          continue;
        judge(slot, inside, s / inside);
        const double rest = all_n - inside;
        if (rest < least)
          continue;
        judge(slot + 1, inside * rest / all_n, s / inside - (all - s) / rest);
      }
    }
  }

  std::vector<double> n;
  Matrix sum;
};

} // namespace

NominalSpread::NominalSpread(const std::vector<BinnedRun> &runs, std::size_t features,
                             std::size_t bins, std::uint32_t least_n, std::vector<double> quantum)
    : features_(features), bins_(bins), slots_(2 * RIM_ENVELOPE_INTERVALS(bins)),
      channels_(static_cast<std::size_t>(runs.front().value.cols())), runs_(runs.size()),
      least_n_(least_n), within_(within_run_variance(runs)), quantum_(std::move(quantum)) {
  for (std::size_t c = 0; c < channels_; ++c) { // so that it holds for intervals still filling
    within_[c] = std::max(within_[c], quantum_[c] * quantum_[c] / static_cast<double>(least_n));
  }
  step_ = std::max<std::size_t>(least_n, (longest(runs) + kMoments - 1) / kMoments);
  usual_.assign(features_ * slots_, 0.0F);
  square_.assign(runs_ * channels_ * features_ * slots_, 0.0F);
  has_.assign(square_.size(), 0);
  parallel_for(features_, [&](std::size_t f) { measure_feature(runs, f); });
}

// For every moment, slot and channel: the sum over runs of the squared mean less what the noise
// within a run adds while the interval still fills, and how many runs judged.
struct NominalSpread::Moments {
  std::size_t count = 0;
  std::vector<double> square;        // [moment][slots][channels]
  std::vector<double> most;          // the same of the run that shows most
  std::vector<std::uint16_t> judged; // [moment][slots]
};

namespace {

// Noise that the variance of the whole interval does not hold yet.
double filling(double a, double n, double usual) {
  return n < usual ? a * (1.0 / n - 1.0 / usual) : 0.0;
}

} // namespace

// Calls look(moment, sums so far) every step_ blocks of a run and at its end, the last moment.
template <class Look>
void NominalSpread::for_moments(const BinnedRun &run, std::size_t f, std::size_t moments,
                                const Look &look) const {
  const auto blocks = static_cast<std::size_t>(run.value.rows());
  Running so_far(bins_, run.value.cols());
  for (std::size_t t = 0; t < blocks; ++t) {
    so_far.add(run, t, run.bin[t * features_ + f]);
    const bool end = t + 1 == blocks;
    if ((t + 1) % step_ == 0 || end)
      look(end ? moments - 1 : (t + 1) / step_ - 1, so_far);
  }
}

NominalSpread::Moments NominalSpread::moments_of(const std::vector<BinnedRun> &runs,
                                                 std::size_t f) const {
  Moments m;
  m.count = longest(runs) / step_ + 1;
  m.square.assign(m.count * slots_ * channels_, 0.0);
  m.most = m.square;
  m.judged.assign(m.count * slots_, 0);
  for (const BinnedRun &run : runs) {
    for_moments(run, f, m.count, [&](std::size_t moment, const Running &so_far) {
      so_far.intervals(least_n_, [&](std::size_t slot, double n, const Eigen::RowVectorXd &mean) {
        const double usual = static_cast<double>(usual_[f * slots_ + slot]);
        if (!(usual > 0.0))
          return;
        ++m.judged[moment * slots_ + slot];
        const std::size_t to = (moment * slots_ + slot) * channels_;
        for (std::size_t c = 0; c < channels_; ++c) {
          const double v = mean[static_cast<Eigen::Index>(c)];
          const double square = v * v - filling(within_[c], n, usual);
          m.square[to + c] += square;
          m.most[to + c] = std::max(m.most[to + c], square);
        }
      });
    });
  }
  return m;
}

std::uint32_t NominalSpread::least_runs() const {
  return static_cast<std::uint32_t>(std::ceil(kLeastShare * static_cast<double>(runs_)));
}

// What the intervals of a feature hold at the end of a run: mean over the runs that judge them.
void NominalSpread::count_feature(const std::vector<BinnedRun> &runs, std::size_t f) {
  std::vector<std::uint32_t> judge(slots_, 0);
  float *usual = &usual_[f * slots_];
  for (const BinnedRun &run : runs) {
    Running whole(bins_, 0);
    for (std::size_t t = 0; t < static_cast<std::size_t>(run.value.rows()); ++t) {
      whole.n[run.bin[t * features_ + f]] += 1.0;
    }
    whole.intervals(least_n_, [&](std::size_t slot, double n, const Eigen::RowVectorXd &) {
      usual[slot] += static_cast<float>(n);
      ++judge[slot];
    });
  }
  for (std::size_t slot = 0; slot < slots_; ++slot) {
    usual[slot] =
        judge[slot] >= least_runs() ? usual[slot] / static_cast<float>(judge[slot]) : 0.0F;
  }
}

// The moment at which a slot of a channel strays most, [slots][channels]. Without the run that
// shows most there: no run chooses the moment at which it is judged.
std::vector<std::uint16_t> NominalSpread::largest_moments(const Moments &m) const {
  std::vector<std::uint16_t> largest(slots_ * channels_, static_cast<std::uint16_t>(m.count - 1));
  for (std::size_t i = 0; i < largest.size(); ++i) {
    double most = -1.0;
    for (std::size_t moment = 0; moment < m.count; ++moment) {
      const std::uint16_t judged = m.judged[moment * slots_ + i / channels_];
      if (judged < least_runs() || judged < 2)
        continue;
      const std::size_t from = moment * slots_ * channels_ + i;
      const double v = (m.square[from] - m.most[from]) / (judged - 1.0);
      if (v <= most)
        continue;
      most = v;
      largest[i] = static_cast<std::uint16_t>(moment);
    }
  }
  return largest;
}

void NominalSpread::measure_feature(const std::vector<BinnedRun> &runs, std::size_t f) {
  count_feature(runs, f);
  const Moments m = moments_of(runs, f);
  const std::vector<std::uint16_t> largest = largest_moments(m);
  for (std::size_t r = 0; r < runs.size(); ++r) { // every run's own share of that moment
    for_moments(runs[r], f, m.count, [&](std::size_t moment, const Running &so_far) {
      so_far.intervals(least_n_, [&](std::size_t slot, double n, const Eigen::RowVectorXd &mean) {
        const double usual = static_cast<double>(usual_[f * slots_ + slot]);
        if (!(usual > 0.0))
          return;
        for (std::size_t c = 0; c < channels_; ++c) {
          if (largest[slot * channels_ + c] != moment)
            continue;
          const std::size_t to = r * channels_ * features_ * slots_ + at(c, f, slot);
          const double v = mean[static_cast<Eigen::Index>(c)];
          square_[to] = static_cast<float>(v * v - filling(within_[c], n, usual));
          has_[to] = 1;
        }
      });
    });
  }
}

std::vector<std::uint8_t> NominalSpread::section(int left_out) const {
  SectionBytes bytes;
  for (const std::size_t word : {std::size_t{RIM_ENVELOPE_LAYOUT}, channels_, features_, bins_,
                                 std::size_t{least_n_}, std::size_t{0}}) {
    bytes.u32(static_cast<std::uint32_t>(word));
  }
  for (const float usual : usual_) {
    bytes.u16(static_cast<std::uint16_t>(std::min(65535.0F, std::round(std::max(usual, 0.0F)))));
  }
  for (const double a : within_)
    bytes.f32(static_cast<float>(a));
  const std::size_t size = channels_ * features_ * slots_;
  std::vector<double> sum(size, 0.0), count(size, 0.0);
  for (std::size_t r = 0; r < runs_; ++r) {
    if (static_cast<int>(r) == left_out)
      continue;
    for (std::size_t i = 0; i < size; ++i) {
      sum[i] += static_cast<double>(square_[r * size + i]);
      count[i] += has_[r * size + i];
    }
  }
  for (std::size_t c = 0; c < channels_; ++c) {
    for (std::size_t i = 0; i < features_ * slots_; ++i) {
      const double usual = static_cast<double>(usual_[i]);
      const std::size_t from = c * features_ * slots_ + i;
      // Few runs can agree by chance: never below half of what the noise within a run makes.
      const double least = usual > 0.0 ? 0.5 * within_[c] / usual : 1.0;
      const double step = usual > 0.0 ? quantum_[c] / usual : 0.0;
      const double spread = count[from] > 0.0 ? sum[from] / count[from] : 1.0;
      bytes.u8(code_of(std::max(least, spread + step * step)));
    }
  }
  return bytes.bytes();
}

} // namespace rim
