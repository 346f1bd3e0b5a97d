// SPDX-License-Identifier: MIT
#include "diagnose/swing.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>

#include <Eigen/Cholesky>

#include "diagnose/mixed.hpp"
#include "stats/robust.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
using Complex = std::complex<double>;
constexpr double kPi = 3.141592653589793, kEuler = 0.5772156649015329;
// Periods in the longest log: from where on is searched, and the least of what is said to be one.
constexpr double kFirstPeriods = 1.8, kLeastPeriods = 2.4;
constexpr double kMostPerRow = 0.48; // periods: half of one is the most that rows show
// Rows lie on a grid where none is off by more than this share of a row; else the grid is finer.
constexpr double kOffGrid = 0.1, kFiner = 4.0;
constexpr double kOversampled = 4.0;
constexpr double kMostSteps = 524288.0; // of the grid of times
constexpr std::size_t kLeastRows = 12;  // of a log
// Neighbours of a frequency: to this factor of it, at least and at most so many to either side, and
// none of the line itself.
constexpr double kNearFactor = 1.6, kFewest = 10.0, kMost = 60.0, kOfLine = 1.5;
constexpr double kBeside = 7.0;    // and of the nearest ones
constexpr double kFirstNear = 2.0; // periods: what is slower went with the straight line
constexpr double kStandsOut = 2.5; // in ln: what is cut from the neighbours as another line
// Of what stands out most by the grid: the least beside it, and the chance of what is noise.
constexpr double kNearlyMost = 0.25, kMostRough = 0.5;
// A line may hide itself that has at most so many periods and at least this share of the squares.
constexpr double kMostHidden = 30.0, kLeastHidden = 0.02;
constexpr double kIsLine = 1e-3;   // chance that noise has one anywhere
constexpr double kCut = 4.0;       // standard deviations beyond which a value is cut
constexpr double kSingular = 1e-6; // of a sine and a cosine that a log is too short to tell apart
constexpr int kGoldenSteps = 40;
constexpr double kBend = 0.05; // of the width of a line: where its peak's bend is taken

// In place; the number of values is a power of two.
void transform(std::vector<Complex> *values) {
  std::vector<Complex> &x = *values;
  const std::size_t n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n >> 1;
    for (; (j & bit) != 0; bit >>= 1)
      j ^= bit;
    j ^= bit;
    if (i < j)
      std::swap(x[i], x[j]);
  }
  std::vector<Complex> turn(n / 2);
  for (std::size_t k = 0; k < turn.size(); ++k)
    turn[k] = std::polar(1.0, 2.0 * kPi * static_cast<double>(k) / static_cast<double>(n));
  for (std::size_t half = 1; half < n; half *= 2) {
    const std::size_t stride = n / (2 * half);
    for (std::size_t first = 0; first < n; first += 2 * half) {
      for (std::size_t k = 0; k < half; ++k) {
        const Complex odd = x[first + half + k] * turn[k * stride], even = x[first + k];
        x[first + k] = even + odd;
        x[first + half + k] = even - odd;
      }
    }
  }
}

// Weighted sums of one clock at one frequency.
struct Sums {
  double weight = 0.0, value = 0.0;
  Complex of_weight, of_value, of_double; // of e^{iwt} and, of the weights, e^{2iwt}
};

// By how much the half sum of squares falls when a constant becomes a constant and a sinusoid.
double fall_of(const Sums &s) {
  const double c = s.of_weight.real(), d = s.of_weight.imag();
  const double cc = 0.5 * (s.weight + s.of_double.real()) - c * c / s.weight,
               ss = 0.5 * (s.weight - s.of_double.real()) - d * d / s.weight,
               cs = 0.5 * s.of_double.imag() - c * d / s.weight;
  const double yc = s.of_value.real() - s.value * c / s.weight,
               ys = s.of_value.imag() - s.value * d / s.weight;
  const double determinant = cc * ss - cs * cs;
  if (!(determinant > kSingular * s.weight * s.weight))
    return 0.0;
  return 0.5 * (yc * yc * ss + ys * ys * cc - 2.0 * yc * ys * cs) / determinant;
}

// That the sum of so many exponential variates of mean 1 exceeds x.
double p_of_sum(double x, std::size_t count) {
  double term = 1.0, sum = 1.0;
  for (std::size_t k = 1; k < count; ++k) {
    term *= x / static_cast<double>(k);
    sum += term;
  }
  return std::exp(-x) * sum;
}

// Mean and variance of ln of such a sum.
double mean_of_ln(std::size_t count) {
  double mean = -kEuler;
  for (std::size_t k = 1; k < count; ++k)
    mean += 1.0 / static_cast<double>(k);
  return mean;
}

double variance_of_ln(std::size_t count) {
  double variance = kPi * kPi / 6.0;
  for (std::size_t k = 1; k < count; ++k)
    variance -= 1.0 / static_cast<double>(k * k);
  return variance;
}

Parameter parameter(const std::vector<Parameter> &all, const char *name, double otherwise) {
  for (const Parameter &p : all) {
    if (p.name == name)
      return p;
  }
  return {name, otherwise, 0.0, ""};
}

std::size_t log_of(const std::vector<std::string> &paths, const std::string &path) {
  return static_cast<std::size_t>(std::find(paths.begin(), paths.end(), path) - paths.begin());
}

// Less a straight line over the time: a log that ends elsewhere than it began has a long slope in
// its spectrum, by that step alone.
void take_off_trend(const std::vector<double> &t, const std::vector<double> &w,
                    std::vector<double> *v) {
  double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    n += w[i];
    x += w[i] * t[i];
    y += w[i] * (*v)[i];
  }
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double dx = t[i] - x / n;
    xx += w[i] * dx * dx;
    xy += w[i] * dx * ((*v)[i] - y / n);
  }
  for (std::size_t i = 0; i < t.size() && xx > 0.0; ++i)
    (*v)[i] -= y / n + xy / xx * (t[i] - x / n);
}

} // namespace

std::vector<std::string> paths_of(const Measured &measured) {
  std::vector<std::string> paths;
  for (const LogSpan &log : measured.logs) {
    if (std::find(paths.begin(), paths.end(), log.path) == paths.end())
      paths.push_back(log.path);
  }
  return paths;
}

Spectrum::Spectrum(const Measured &measured, const Vector &values, const Vector &weight) {
  add_clocks(measured, values, weight);
  if (clocks_.empty() || !(row_s_ > 0.0) || !(longest_s_ > 0.0))
    return;
  add_falls();
  add_background();
}

// Large values are cut: one outlier has all frequencies.
void Spectrum::add_clocks(const Measured &measured, const Vector &values, const Vector &weight) {
  const std::vector<std::string> paths = paths_of(measured);
  std::vector<Clock> clocks(paths.size());
  std::vector<double> steps, sizes;
  for (Index i = 0; i < values.size(); ++i) {
    if (weight(i) > 0.0)
      sizes.push_back(std::abs(values(i)) * std::sqrt(weight(i)));
  }
  if (sizes.empty())
    return;
  const double most = kCut * 1.4826 * median(std::move(sizes));
  for (const LogSpan &log : measured.logs) {
    Clock &clock = clocks[log_of(paths, log.path)];
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      if (i > log.first)
        steps.push_back(measured.elapsed_s[i] - measured.elapsed_s[i - 1]);
      if (!(weight(k) > 0.0))
        continue;
      const double corner = most > 0.0 ? most / std::sqrt(weight(k)) : 1e300;
      clock.t.push_back(measured.elapsed_s[i]);
      clock.v.push_back(std::clamp(values(k), -corner, corner));
      clock.w.push_back(weight(k));
    }
  }
  if (steps.empty())
    return;
  row_s_ = median(std::move(steps));
  for (Clock &clock : clocks) {
    if (clock.t.size() < kLeastRows)
      continue;
    const auto [first, last] = std::minmax_element(clock.t.begin(), clock.t.end());
    const double begin = *first, span = *last - *first;
    longest_s_ = std::max(longest_s_, span);
    std::for_each(clock.t.begin(), clock.t.end(), [begin](double &t) { t -= begin; });
    take_off_trend(clock.t, clock.w, &clock.v);
    clocks_.push_back(std::move(clock));
  }
}

// At all frequencies of a grid, by a fast transform of the rows laid on a grid of times.
void Spectrum::add_falls() {
  double off = 0.0;
  for (const Clock &clock : clocks_) {
    for (const double t : clock.t)
      off = std::max(off, std::abs(t / row_s_ - std::round(t / row_s_)));
  }
  const double step = std::max(off < kOffGrid ? row_s_ : row_s_ / kFiner, longest_s_ / kMostSteps);
  const double count = longest_s_ / step + 1.0;
  std::size_t n = 64;
  while (static_cast<double>(n) < kOversampled * count)
    n *= 2;
  step_hz_ = 1.0 / (static_cast<double>(n) * step);
  stride_ = 1.0 / (longest_s_ * step_hz_);
  const auto last =
      static_cast<std::size_t>(std::min(kMostPerRow / row_s_, kMostPerRow / step) / step_hz_);
  falls_.assign(last + 1, 0.0);
  std::vector<Complex> x;
  for (const Clock &clock : clocks_) {
    x.assign(n, Complex());
    Sums sums;
    for (std::size_t i = 0; i < clock.t.size(); ++i) {
      x[static_cast<std::size_t>(std::lround(clock.t[i] / step))] +=
          Complex(clock.w[i] * clock.v[i], clock.w[i]);
      sums.weight += clock.w[i];
      sums.value += clock.w[i] * clock.v[i];
      squares_ += 0.5 * clock.w[i] * clock.v[i] * clock.v[i];
    }
    squares_ -= 0.5 * sums.value * sums.value / sums.weight;
    transform(&x);
    // Two real series were transformed as one: their transforms have opposite symmetries.
    const auto weight_at = [&](std::size_t k) {
      return Complex(0.0, -0.5) * (x[k] - std::conj(x[(n - k) % n]));
    };
    for (std::size_t k = 1; k <= last; ++k) {
      sums.of_value = 0.5 * (x[k] + std::conj(x[n - k]));
      sums.of_weight = weight_at(k);
      sums.of_double = weight_at(2 * k % n);
      falls_[k] += fall_of(sums);
    }
  }
}

double Spectrum::fall(double frequency_hz) const {
  double all = 0.0;
  for (const Clock &clock : clocks_) {
    Sums sums;
    for (std::size_t i = 0; i < clock.t.size(); ++i) {
      const Complex turn = std::polar(1.0, 2.0 * kPi * frequency_hz * clock.t[i]);
      sums.weight += clock.w[i];
      sums.value += clock.w[i] * clock.v[i];
      sums.of_weight += clock.w[i] * turn;
      sums.of_value += clock.w[i] * clock.v[i] * turn;
      sums.of_double += clock.w[i] * turn * turn;
    }
    all += fall_of(sums);
  }
  return all;
}

// ln of the mean fall by a straight line over ln of the frequency, through those nearby.
void Spectrum::add_background() {
  const double lowest = mean_of_ln(clocks_.size()), variance = variance_of_ln(clocks_.size());
  std::vector<double> &ln = ln_;
  ln.assign(1, 0.0);
  for (std::size_t i = 1;; ++i) {
    const auto at = static_cast<std::size_t>(std::lround(static_cast<double>(i) * stride_));
    if (at >= falls_.size())
      break;
    ln.push_back(std::log(std::max(falls_[at], 1e-300)) - lowest);
  }
  ln_smooth_.assign(ln.size(), 0.0);
  sd_.assign(ln.size(), 1e3);
  for (std::size_t i = 1; i < ln.size(); ++i) {
    const auto here = static_cast<double>(i);
    const double low = std::max(
                     {kFirstNear, here - kMost, std::min(here / kNearFactor, here - kFewest)}),
                 high = std::min({static_cast<double>(ln.size() - 1), here + kMost,
                                  std::max(here * kNearFactor, here + kFewest)});
    double mean = 0.0, slope = 0.0;
    for (int pass = 0; pass < 2; ++pass) {
      double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
      for (auto j = static_cast<std::size_t>(std::ceil(low)); j <= static_cast<std::size_t>(high);
           ++j) {
        const double apart = std::abs(static_cast<double>(j) - here);
        if (apart < kOfLine)
          continue;
        const double dx = std::log(static_cast<double>(j) / here);
        const double dy = pass == 0 ? ln[j] : std::min(ln[j], mean + slope * dx + kStandsOut);
        n += 1.0;
        x += dx;
        y += dy;
        xx += dx * dx;
        xy += dx * dy;
      }
      const double spread = n * xx - x * x;
      if (n < 5.0 || !(spread > 0.0))
        break;
      slope = (n * xy - x * y) / spread;
      mean = (y - slope * x) / n;
      ln_smooth_[i] = mean;
      sd_[i] = std::sqrt(variance * xx / spread);
    }
  }
}

double Spectrum::ln_background(double at) const {
  const auto i = static_cast<std::size_t>(
      std::clamp(std::floor(at), 1.0, std::max(1.0, static_cast<double>(ln_smooth_.size()) - 2.0)));
  if (i + 1 >= ln_smooth_.size())
    return ln_smooth_.back();
  const double share = std::clamp(at - static_cast<double>(i), 0.0, 1.0);
  return (1.0 - share) * ln_smooth_[i] + share * ln_smooth_[i + 1];
}

// That noise takes off as much at this frequency; what is taken for its mean there is uncertain.
double Spectrum::p_at(double fall, double at) const {
  const auto i = static_cast<std::size_t>(
      std::clamp(std::lround(at), 1L, static_cast<long>(ln_smooth_.size()) - 1L));
  return p_of(fall / std::exp(ln_background(at)), sd_[i]);
}

double Spectrum::p_of(double ratio, double sd_of_ln) const {
  double p = 0.0, all = 0.0;
  for (int k = -8; k <= 8; ++k) {
    const double z = 0.5 * k, weight = std::exp(-0.5 * z * z);
    p += weight * p_of_sum(ratio * std::exp(sd_of_ln * z), clocks_.size());
    all += weight;
  }
  return p / all;
}

// How often noise crosses a height grows with its root (Baluev, MNRAS 385, 1279, 2008).
double Spectrum::p_of_any(double p_of_one, double ratio) const {
  const double tried = static_cast<double>(falls_.size()) / stride_;
  return std::min(1.0, tried * std::sqrt(std::max(1.0, ratio)) * p_of_one);
}

// The top of the line within which a frequency lies.
double Spectrum::peak_near(double frequency_hz) const {
  const double ratio = 0.5 * (std::sqrt(5.0) - 1.0), half = 0.5 / longest_s_;
  double low = frequency_hz - half, high = frequency_hz + half;
  double a = high - ratio * (high - low), b = low + ratio * (high - low);
  double of_a = fall(a), of_b = fall(b);
  for (int step = 0; step < kGoldenSteps && high - low > 1e-5 / longest_s_; ++step) {
    if (of_a > of_b) {
      high = b;
      b = a;
      of_b = of_a;
      a = high - ratio * (high - low);
      of_a = fall(a);
    } else {
      low = a;
      a = b;
      of_a = of_b;
      b = low + ratio * (high - low);
      of_b = fall(b);
    }
  }
  return 0.5 * (low + high);
}

// The same of the nearest frequencies alone, on the level: a resonance that noise excites has a
// peak that is wider than a line.
double Spectrum::p_beside(double fall, double at, double *ln_mean) const {
  double n = 0.0, sum = 0.0;
  for (double apart = -kBeside; apart <= kBeside; apart += 1.0) {
    const double j = std::round(at) + apart;
    if (std::abs(j - at) < kOfLine || j < kFirstNear || j >= static_cast<double>(ln_.size()))
      continue;
    n += 1.0;
    sum += ln_[static_cast<std::size_t>(j)];
  }
  if (at < kBeside + kFirstNear || n < kBeside)
    return 0.0;
  *ln_mean = sum / n;
  return p_of(fall / std::exp(*ln_mean), std::sqrt(variance_of_ln(clocks_.size()) / n));
}

// Less the mean and the line of every clock: a line has some of its squares at all frequencies, and
// the fewer periods a log has the more of them hide it.
Spectrum Spectrum::without(double frequency_hz) const {
  Spectrum less = *this;
  for (Clock &clock : less.clocks_) {
    Eigen::Matrix3d gram = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    const auto columns = [frequency_hz](double t) {
      const double angle = 2.0 * kPi * frequency_hz * t;
      return Eigen::Vector3d(1.0, std::sin(angle), std::cos(angle));
    };
    for (std::size_t i = 0; i < clock.t.size(); ++i) {
      const Eigen::Vector3d x = columns(clock.t[i]);
      gram += clock.w[i] * x * x.transpose();
      right += clock.w[i] * clock.v[i] * x;
    }
    gram.diagonal() *= 1.0 + 1e-9;
    const Eigen::Vector3d size = gram.ldlt().solve(right);
    for (std::size_t i = 0; i < clock.t.size(); ++i)
      clock.v[i] -= size.dot(columns(clock.t[i]));
  }
  less.squares_ = 0.0;
  less.add_falls();
  less.add_background();
  return less;
}

Swing Spectrum::near(double frequency_hz) const {
  Swing swing;
  if (ln_smooth_.size() < 2)
    return swing;
  const double top = peak_near(frequency_hz), at = top * longest_s_;
  if (!(at >= kLeastPeriods) || top >= static_cast<double>(falls_.size()) * step_hz_)
    return swing;
  swing.frequency_hz = top;
  swing.fall = fall(top);
  const Spectrum less = without(top);
  const double ln_mean = less.ln_background(at);
  double ln_beside = ln_mean;
  const double p = std::max(less.p_at(swing.fall, at), less.p_beside(swing.fall, at, &ln_beside));
  swing.background = std::exp(std::max(ln_mean, ln_beside));
  swing.frequencies = static_cast<double>(falls_.size()) / stride_;
  const double bend = kBend / longest_s_;
  const double second = (2.0 * swing.fall - fall(top - bend) - fall(top + bend)) / (bend * bend);
  if (!(second > 0.0)) // no top: the end of what was looked at
    return Swing{};
  swing.stderror_hz = std::sqrt(swing.background / second);
  swing.p_value = p_of_any(p, swing.fall / swing.background);
  return swing;
}

double Spectrum::line_share(double frequency_hz) const {
  if (ln_smooth_.size() < 2 || !(squares_ > 0.0))
    return 0.0;
  const double half = 0.5 * stride_, at = frequency_hz / step_hz_;
  const auto first = static_cast<std::size_t>(std::max(1.0, std::floor(at - half))),
             last = std::min(falls_.size() - 2, static_cast<std::size_t>(std::ceil(at + half)));
  std::size_t best = 0;
  for (std::size_t k = first; k <= last; ++k) {
    if (falls_[k] >= falls_[k - 1] && falls_[k] >= falls_[k + 1] && falls_[k] > falls_[best])
      best = k;
  }
  if (best == 0)
    return 0.0;
  const double where = static_cast<double>(best) / stride_;
  const double ratio = falls_[best] / std::exp(ln_background(where));
  return p_of_any(p_at(falls_[best], where), ratio) < kIsLine ? falls_[best] / squares_ : 0.0;
}

// The one that stands out most by the grid, and the largest where it may hide itself: exact times
// are looked at only where they may matter.
Swing Spectrum::strongest() const {
  if (ln_smooth_.size() < 2)
    return {};
  double least = 1.0, most_ratio = 0.0;
  std::size_t best = 0, largest = 0;
  for (auto k = static_cast<std::size_t>(kFirstPeriods * stride_) + 1; k + 1 < falls_.size(); ++k) {
    if (falls_[k] < falls_[k - 1] || falls_[k] < falls_[k + 1])
      continue;
    largest = largest == 0 || falls_[k] > falls_[largest] ? k : largest;
    const double at = static_cast<double>(k) / stride_;
    const double ratio = falls_[k] / std::exp(ln_background(at));
    if (ratio < kNearlyMost * most_ratio)
      continue;
    most_ratio = std::max(ratio, most_ratio);
    if (const double p = p_at(falls_[k], at); p < least) {
      least = p;
      best = k;
    }
  }
  Swing swing;
  const bool may_hide = static_cast<double>(largest) < kMostHidden * stride_ &&
                        falls_[largest] > kLeastHidden * squares_;
  if (best != 0 && p_of_any(least, most_ratio) < kMostRough)
    swing = near(static_cast<double>(best) * step_hz_);
  if (largest != 0 && largest != best && may_hide) {
    const Swing hidden = near(static_cast<double>(largest) * step_hz_);
    if (hidden.frequency_hz > 0.0 &&
        (!(swing.frequency_hz > 0.0) || hidden.p_value < swing.p_value))
      swing = hidden;
  }
  return swing;
}

Eigen::MatrixXd swing_columns(const Term &term, const Measured &measured) {
  const double period = parameter(term.shape, "period", 1.0).value;
  const auto pairs = std::max<std::size_t>(1, term.logs.size());
  Eigen::MatrixXd columns =
      Eigen::MatrixXd::Zero(static_cast<Index>(measured.rows()), static_cast<Index>(2 * pairs));
  for (const LogSpan &log : measured.logs) {
    const std::size_t pair = term.logs.empty() ? 0 : log_of(term.logs, log.path);
    if (pair == pairs)
      continue;
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const double angle = 2.0 * kPi * measured.elapsed_s[i] / period;
      columns(static_cast<Index>(i), static_cast<Index>(2 * pair)) = std::sin(angle);
      columns(static_cast<Index>(i), static_cast<Index>(2 * pair + 1)) = std::cos(angle);
    }
  }
  return columns;
}

Vector swing_column(const Term &term, const Measured &measured) {
  const Eigen::MatrixXd columns = swing_columns(term, measured);
  const Parameter phase = parameter(term.shape, "phase", 0.0),
                  size = parameter(term.sizes, "amplitude", 1.0);
  Vector out = Vector::Zero(columns.rows());
  for (Index k = 0; k + 1 < columns.cols(); k += 2) {
    const auto log = static_cast<std::size_t>(k / 2);
    const double at = log < phase.per_log.size() ? phase.per_log[log] : phase.value;
    const double share =
        log < size.per_log.size() && size.value > 0.0 ? size.per_log[log] / size.value : 1.0;
    out += share * (std::cos(at) * columns.col(k) + std::sin(at) * columns.col(k + 1));
  }
  return out;
}

void set_swing(const Vector &sizes, const Eigen::MatrixXd &covariance, double background,
               Term *term) {
  std::vector<double> amplitudes, errors, phases, of_phases;
  for (Index k = 0; k + 1 < sizes.size(); k += 2) {
    const double amplitude = std::hypot(sizes(k), sizes(k + 1));
    const double variance = 0.5 * background * (covariance(k, k) + covariance(k + 1, k + 1));
    amplitudes.push_back(amplitude);
    errors.push_back(std::sqrt(std::max(0.0, variance)));
    phases.push_back(std::atan2(sizes(k + 1), sizes(k)));
    of_phases.push_back(errors.back() / std::max(1e-300, amplitude));
  }
  Parameter &amplitude = term->sizes.at(0), &phase = term->shape.at(1);
  amplitude.value = amplitudes[0];
  amplitude.stderror = errors[0];
  phase.value = phases[0];
  phase.stderror = of_phases[0];
  if (amplitudes.size() < 2)
    return;
  const MixedSize mixed = mixed_size(amplitudes, errors);
  amplitude.value = mixed.mean;
  amplitude.stderror = mixed.stderror;
  amplitude.between_logs_sd = mixed.between_sd;
  amplitude.per_log = amplitudes;
  phase.per_log = phases;
}

} // namespace rim::diagnose
