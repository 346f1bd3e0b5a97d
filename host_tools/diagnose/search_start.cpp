// SPDX-License-Identifier: MIT
// Predictions that are made of noisy readings: what that alone would feign.
#include "diagnose/search.hpp"

#include <algorithm>
#include <cmath>

#include "diagnose/roles.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
// Noise of the start: lag-1 correlation that tells it, and the least share of squares it explains.
constexpr double kAlternates = -0.15, kLeastStartShare = 0.01;
constexpr int kStartRounds = 2;
// Rows before and after whose mean has little of the noise; share of a level's squares, and of a
// region's rows, that it then leaves at most, where they are those of noise.
constexpr int kNoiseReach = 2;
constexpr double kOfNoise = 0.5, kRegionOfNoise = 0.7;

// Of a column, row by row, the mean of so many rows before and after; its own value near the ends.
Vector mean_of_neighbours(const Vector &x, const Measured &measured, int reach) {
  Vector mean = x;
  for (const LogSpan &log : measured.logs) {
    const auto first = static_cast<Index>(log.first), end = first + static_cast<Index>(log.rows);
    for (Index k = first + reach; k + reach < end; ++k)
      mean(k) = (x.segment(k - reach, 2 * reach + 1).sum() - x(k)) / (2.0 * reach);
  }
  return mean;
}

} // namespace

// Of a prediction that starts from a noisy reading the residual alternates: what this reading was
// off by, the next residual brings back. Innovations e of r(t) = e(t) - theta e(t-1); theta by
// least squares. What the innovation before predicts of the residual is taken off; else every form
// of the state (a gain below one, a hinge) would be claimed for it.
bool ChannelSearch::take_off_start(const Vector &left) {
  double best = left.cwiseAbs2().cwiseProduct(measured_rows_).sum() * (1.0 - kLeastStartShare);
  Vector predicted;
  StartNoise found;
  for (int step = 1; step < 20; ++step) {
    const double theta = 0.05 * step;
    Vector of_before = Vector::Zero(left.size());
    double squares = 0.0, rows = 0.0;
    for (const LogSpan &log : measured_.logs) {
      double before = 0.0;
      for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
        const auto k = static_cast<Index>(i);
        of_before(k) = -theta * before;
        before = measured_rows_(k) > 0.0 ? left(k) + theta * before : 0.0;
        squares += before * before * measured_rows_(k);
        rows += measured_rows_(k);
      }
    }
    if (squares < best) {
      best = squares;
      predicted = of_before;
      // r = e(t+1) - a e(t) + process, a about 1: its covariance at lag 1 is - a var(e).
      found = {theta, std::sqrt(theta * squares / std::max(1.0, rows))};
    }
  }
  if (predicted.size() == 0)
    return false;
  y_ = (channel_.z - channel_.m).cwiseQuotient(channel_.sd) - predicted;
  out_.start = found;
  return true;
}

// What is new in every row of x, beside noise of that kind.
Vector ChannelSearch::whitened(const Vector &x) const {
  Vector e(x.size());
  for (const LogSpan &log : measured_.logs) {
    double before = 0.0;
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      e(k) = measured_rows_(k) > 0.0 ? x(k) + out_.start.theta * before : 0.0;
      before = e(k);
    }
  }
  return e;
}

// What the members leave, their sizes fitted beside noise of that kind: r(t) = e(t) - theta e(t-1)
// and every column are first filtered so that it is white. Plain least squares on what is left of
// the filtered residual would take a slow effect for noise that accumulates.
Vector ChannelSearch::left_beside_start(const Vector &raw) const {
  Vector left = raw;
  std::vector<Member> filtered;
  for (const Member &member : out_.members) {
    if (member.is_fixed) {
      left -= member.h.rowwise().sum();
      continue;
    }
    filtered.push_back(member);
    for (Index c = 0; c < member.h.cols(); ++c)
      filtered.back().h.col(c) = whitened(member.h.col(c));
  }
  const Fit fit = fit_members(whitened(left), filtered, out_.noise);
  Index at = 0;
  for (const Member &member : out_.members) {
    if (member.is_fixed)
      continue;
    left -= member.h * fit.beta.segment(at, member.h.cols());
    at += member.h.cols();
  }
  return left;
}

// The mean of the predictions of so many rows before and after, which comes neither late nor early.
Vector ChannelSearch::with_neighbours(int reach) const {
  const Measured &whole = measured_.whole != nullptr ? *measured_.whole : measured_;
  const int c = whole.find_channel(channel_.name);
  const Vector &m = whole.channels[static_cast<std::size_t>(c)].m;
  const Vector mean = mean_of_neighbours(m, whole, reach);
  return measured_.whole == nullptr ? mean : Vector(mean(measured_.picked));
}

// Whether that mean in the place of a member does as much as the member. Not beside a command that
// comes late in another form: that would do the work of the member.
bool ChannelSearch::does_as_well(std::size_t which, const Vector &mean) const {
  Member rival = out_.members[which];
  rival.is_fixed = false;
  rival.h = (mean - channel_.m).cwiseQuotient(channel_.sd);
  std::vector<Member> instead{rival};
  for (const Member &member : without(which)) {
    if (member.is_given || member.term.form != kLaggedCoupling)
      instead.push_back(member);
  }
  return fit_members(y_, instead, out_.noise).loss <=
         fit_members(y_, out_.members, out_.noise).loss;
}

// Whether a lag, delay or play of the prediction only smooths it. The prediction is then made of
// noisy readings.
bool ChannelSearch::smooths_prediction() const {
  const auto late = std::find_if(out_.members.begin(), out_.members.end(), [](const Member &m) {
    return !m.is_given && remembers(m.term) && m.term.response.empty() && m.term.ridges.empty() &&
           m.term.arguments.empty();
  });
  if (late == out_.members.end())
    return false;
  // Beside a command a lag may smooth over more rows than the two neighbours do.
  const auto which = static_cast<std::size_t>(late - out_.members.begin());
  return does_as_well(which, with_neighbours(1)) ||
         does_as_well(which, with_neighbours(kNoiseReach));
}

// Whether a level is what noisy readings make of an end that the motion itself has (a speed that is
// held at its limit): beyond it the prediction goes by its noise alone, which its neighbours do not
// share, and their mean does as much.
bool ChannelSearch::is_level_of_noise() const {
  const auto spread = [this](const Vector &x) {
    const Vector w = measured_rows_ / std::max(1.0, measured_rows_.sum());
    return w.dot(x.cwiseAbs2()) - std::pow(w.dot(x), 2.0);
  };
  for (std::size_t j = 0; j < out_.members.size(); ++j) {
    const Member &member = out_.members[j];
    if (member.is_given || !is_level(member.term) || !member.term.gate.everywhere())
      continue;
    const Vector mean = with_neighbours(kNoiseReach),
                 smooth = basis_columns(member.term, measured_, mean).col(0),
                 rough = basis_columns(member.term, measured_, channel_.m).col(0);
    if (spread(smooth) < kOfNoise * spread(rough) && does_as_well(j, with_neighbours(1)))
      return true;
  }
  return false;
}

// Whether most of a region's rows are in it by the noise of its features alone: those before and
// after are not.
bool ChannelSearch::is_region_of_noise(const Gate &gate) const {
  const Measured &whole = measured_.whole != nullptr ? *measured_.whole : measured_;
  Measured smooth = whole;
  for (const std::string &name : gate.features) {
    const int f = whole.find_feature(name);
    if (f < 0 || whole.features[static_cast<std::size_t>(f)].is_angle)
      return false;
    smooth.x.col(f) = mean_of_neighbours(whole.x.col(f), whole, kNoiseReach);
  }
  const Vector rough = gate_mask(gate, whole);
  return rough.dot(gate_mask(gate, smooth)) < kRegionOfNoise * rough.sum();
}

// Of a prediction that is made of noisy readings, what is claimed of such a region alone: where the
// reading is low by chance, so is the prediction.
void ChannelSearch::drop_regions_of_noise() {
  for (std::size_t j = out_.members.size(); out_.is_noisy_prediction && j-- > 0;) {
    const Member &member = out_.members[j];
    if (!member.is_given && !member.term.gate.everywhere() &&
        is_region_of_noise(member.term.gate) && does_as_well(j, with_neighbours(1)))
      set_aside(j, "only the noise of the readings reaches its region");
  }
}

double ChannelSearch::alternation(const Vector &left) const {
  return noise_state(left, measured_rows_, measured_, 0.0, 0.0, least_noise(channel_))
      .autocorrelation;
}

// The search, and again with the noise of the start taken off where there is such.
void ChannelSearch::find_beside_start(const std::vector<Term> &given) {
  Allowed allowed;
  find_members(allowed);
  for (bool *what : {&allowed.late, &allowed.levels}) {
    if (what == &allowed.late ? !smooths_prediction() : !is_level_of_noise())
      continue;
    *what = false;
    prepare(given);
    find_members(allowed);
    out_.is_noisy_prediction = true;
  }
  const bool is_noisy = out_.is_noisy_prediction;
  if (library_.own.size() != 1 && own_state(measured_, channel_) < 0)
    return;
  const Vector raw = y_;
  // A lag of a prediction that starts from a noisy reading filters that noise: what alternates is
  // seen without it.
  const bool is_late = own_state(measured_, channel_) >= 0 &&
                       std::any_of(out_.members.begin(), out_.members.end(), [](const Member &m) {
                         return !m.is_given && moves_prediction(m.term);
                       });
  const ChannelFindings late = out_;
  if (is_late) {
    prepare(given);
    find_members({false, allowed.levels});
  }
  for (int round = 0; round < kStartRounds; ++round) {
    // What swings within a few rows alternates too.
    const bool is_plain = round == 0 && swings_.empty() && alternation(raw) < kAlternates;
    const Vector left = is_plain ? raw : left_beside_start(raw);
    if (alternation(left) >= kAlternates || !take_off_start(left)) {
      if (is_late && round == 0) {
        out_ = late;
        allowed_ = allowed;
        scanner_ = std::make_unique<Scanner>(library_, out_.noise.weight);
      }
      return;
    }
    const StartNoise start = out_.start;
    prepare(given);
    out_.start = start;
    out_.is_noisy_prediction = is_noisy;
    find_members(allowed);
  }
  const StartNoise start = out_.start;
  if (!take_off_start(left_beside_start(raw)))
    out_.start = start;
  out_.fit = fit_members(y_, out_.members, out_.noise);
  estimate_noise();
}

} // namespace rim::diagnose
