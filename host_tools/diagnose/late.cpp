// SPDX-License-Identifier: MIT
#include "diagnose/late.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <unordered_map>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "stats/robust.hpp"
#include "util/error.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr int kSprings = 8;        // that are held, of limits equally spaced
constexpr double kShortGap = 10.0; // median steps: what a straight line still bridges

// Share of its squares that a prediction made of commands leaves beside them; rows looked at.
constexpr double kLeftByCommands = 0.01;
constexpr Index kMostStartRows = 2000;

double shape_value(const std::vector<Parameter> &shape, const std::string &form,
                   const std::string &name) {
  for (const Parameter &p : shape) {
    if (p.name == name)
      return p.value;
  }
  throw DataError(fmt::format("form '{}': parameter '{}' is missing", form, name));
}

// A table's rows in time, and those of them that are wanted: what every delay and lag shares.
class Clock {
public:
  // By the time, or by the way at this speed.
  Clock(const Measured &measured, const Vector *speed)
      : measured_(measured), elapsed_(measured.elapsed_s), all_(measured.rows()) {
    if (speed != nullptr)
      pass(*speed);
    std::iota(all_.begin(), all_.end(), Index{0});
    for (const LogSpan &log : measured.logs)
      longest_.push_back(kShortGap * median_step(log));
  }
  // Of the wanted rows alone, which ascend.
  Vector delayed(const Vector &x, double delay_s, const std::vector<Index> &rows) const;
  Vector through_lag(const Vector &x, double lag_s, const Vector *start,
                     const std::vector<Index> &rows);
  const std::vector<Index> &all() const { return all_; }

private:
  void pass(const Vector &speed);
  double median_step(const LogSpan &log) const;
  void find_steps();

  const Measured &measured_;
  std::vector<double> elapsed_; // seconds, or the way since the log began
  std::vector<Index> all_;
  std::vector<double> longest_; // by log: the longest step that a straight line bridges
  // Steps of time are few different numbers: of each row, which one.
  std::vector<double> steps_;
  std::vector<std::uint32_t> step_of_;
};

void Clock::pass(const Vector &speed) {
  for (const LogSpan &log : measured_.logs) {
    elapsed_[log.first] = 0.0;
    for (std::size_t i = log.first + 1; i < log.first + log.rows; ++i)
      elapsed_[i] = elapsed_[i - 1] + std::abs(speed(static_cast<Index>(i - 1))) *
                                          (measured_.elapsed_s[i] - measured_.elapsed_s[i - 1]);
  }
}

double Clock::median_step(const LogSpan &log) const {
  std::vector<double> steps;
  for (std::size_t i = log.first + 1; i < log.first + log.rows; ++i)
    steps.push_back(elapsed_[i] - elapsed_[i - 1]);
  return median(std::move(steps));
}

Vector Clock::delayed(const Vector &x, double delay_s, const std::vector<Index> &rows) const {
  Vector out(static_cast<Index>(rows.size()));
  Index at = 0;
  for (std::size_t l = 0; l < measured_.logs.size(); ++l) {
    const LogSpan &log = measured_.logs[l];
    const std::size_t end = log.first + log.rows;
    std::size_t from = log.first;
    for (; at < out.size() && rows[static_cast<std::size_t>(at)] < static_cast<Index>(end); ++at) {
      const auto i = static_cast<std::size_t>(rows[static_cast<std::size_t>(at)]);
      const double then = elapsed_[i] - delay_s;
      while (from + 1 < end && elapsed_[from + 1] <= then + 1e-9)
        ++from;
      const auto k = static_cast<Index>(from);
      out(at) = x(k);
      if (from + 1 >= end || then <= elapsed_[from] || i == log.first)
        continue;
      const double step = elapsed_[from + 1] - elapsed_[from];
      if (step <= longest_[l])
        out(at) += (then - elapsed_[from]) / step * (x(k + 1) - x(k));
    }
  }
  return out;
}

void Clock::find_steps() {
  std::unordered_map<double, std::uint32_t> known;
  step_of_.resize(measured_.rows());
  for (const LogSpan &log : measured_.logs) {
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const double dt = i > log.first ? elapsed_[i] - elapsed_[i - 1] : 0.0;
      const auto [found, is_new] = known.emplace(dt, static_cast<std::uint32_t>(steps_.size()));
      if (is_new)
        steps_.push_back(dt);
      step_of_[i] = found->second;
    }
  }
}

// `start`: where each log begins; its own first value where there is none.
Vector Clock::through_lag(const Vector &x, double lag_s, const Vector *start,
                          const std::vector<Index> &rows) {
  if (step_of_.empty())
    find_steps();
  std::vector<double> share; // of the way that a step goes
  for (const double dt : steps_)
    share.push_back(1.0 - std::exp(-dt / std::max(1e-9, lag_s)));
  Vector out(static_cast<Index>(rows.size()));
  Index at = 0;
  for (const LogSpan &log : measured_.logs) {
    const auto first = static_cast<Index>(log.first), end = first + static_cast<Index>(log.rows);
    double state = start != nullptr ? (*start)(first) : x(first);
    for (Index i = first; i < end; ++i) {
      state += share[step_of_[static_cast<std::size_t>(i)]] * (x(i) - state);
      if (at < out.size() && rows[static_cast<std::size_t>(at)] == i)
        out(at++) = state;
    }
  }
  return out;
}

// Whether the prediction is a sum of commands, in a few thousand rows of all.
bool is_of_commands(const Vector &m, const Measured &measured) {
  const Index stride = 1 + m.size() / kMostStartRows, rows = (m.size() + stride - 1) / stride;
  std::vector<Index> commands;
  for (std::size_t f = 0; f < measured.features.size(); ++f) {
    if (measured.features[f].is_command)
      commands.push_back(static_cast<Index>(f));
  }
  const auto count = static_cast<Index>(commands.size());
  if (count == 0 || rows < 3 * (count + 1))
    return false;
  Eigen::MatrixXd h(rows, count + 1);
  Vector y(rows);
  for (Index i = 0; i < rows; ++i) {
    y(i) = m(i * stride);
    for (Index k = 0; k < count; ++k)
      h(i, k) = measured.x(i * stride, commands[static_cast<std::size_t>(k)]);
  }
  const Eigen::RowVectorXd mean = h.leftCols(count).colwise().mean();
  h.leftCols(count).rowwise() -= mean;
  h.col(count).setOnes();
  Eigen::MatrixXd gram = h.transpose() * h;
  gram.diagonal().array() *= 1.0 + 1e-9;
  gram.diagonal().array() += 1e-300;
  const Vector left = y - h * gram.ldlt().solve(h.transpose() * y);
  return left.squaredNorm() < kLeftByCommands * (y.array() - y.mean()).square().sum();
}

// Where a prediction knows commands alone it cannot know the state that a log begins in: a lag then
// begins at the first reading.
const Vector *start_of(const Term &term, const Measured &measured, const Vector &m) {
  const int c = measured.find_channel(term.channel);
  const bool has_state =
      std::any_of(measured.features.begin(), measured.features.end(),
                  [](const Feature &f) { return !f.is_command && !f.is_prediction; });
  return c < 0 || (has_state && !is_of_commands(m, measured))
             ? nullptr
             : &measured.channels[static_cast<std::size_t>(c)].z;
}

// What follows a motion through play: it stays until one end or the other takes it along. A log
// begins in the middle.
Vector through_play(const Vector &x, const Measured &measured, double play) {
  Vector out(x.size());
  for (const LogSpan &log : measured.logs) {
    double at = x(static_cast<Index>(log.first));
    for (std::size_t i = log.first; i < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      at = std::clamp(at, x(k) - 0.5 * play, x(k) + 0.5 * play);
      out(k) = at;
    }
  }
  return out;
}

// A response to commands, and what of it is the same whatever comes late.
class LateResponse {
public:
  LateResponse(const Term &term, const Measured &measured, const std::vector<Index> &rows);
  // The response at commands that act late, less it at those of now. late(x): a command's column at
  // the wanted rows.
  template <class Late> Vector column(Late late) const;

private:
  struct Input {
    Vector whole; // of a command: in all rows
    Vector now;   // in those that are wanted
  };
  struct Product {
    double coefficient = 0.0;
    std::vector<const Input *> factors;
  };
  struct Curve {
    const Ridge *ridge = nullptr;
    std::vector<std::pair<double, const Input *>> summands;
  };
  const Input *input(const std::string &name);

  const Measured &measured_;
  const std::vector<Index> &rows_;
  std::map<std::string, Input> inputs_;
  std::vector<Product> products_;
  std::vector<Curve> curves_;
};

LateResponse::LateResponse(const Term &term, const Measured &measured,
                           const std::vector<Index> &rows)
    : measured_(measured), rows_(rows) {
  for (const auto &[name, coefficient] : term.response) {
    Product product{coefficient, {}};
    std::size_t at = 0;
    while (at <= name.size()) {
      const std::size_t end = std::min(name.find('*', at), name.size());
      product.factors.push_back(input(name.substr(at, end - at)));
      at = end + 1;
    }
    products_.push_back(std::move(product));
  }
  for (const Ridge &ridge : term.ridges) {
    Curve curve{&ridge, {}};
    for (const auto &[name, weight] : ridge.weights)
      curve.summands.emplace_back(weight, input(name));
    curves_.push_back(std::move(curve));
  }
}

const LateResponse::Input *LateResponse::input(const std::string &name) {
  const auto found = inputs_.find(name);
  if (found != inputs_.end())
    return &found->second;
  Input input;
  input.whole = feature_column(measured_, name);
  input.now = input.whole(rows_);
  const int f = measured_.find_feature(name);
  if (f < 0 || !measured_.features[static_cast<std::size_t>(f)].is_command)
    input.whole.resize(0);
  return &inputs_.emplace(name, std::move(input)).first->second;
}

template <class Late> Vector LateResponse::column(Late late) const {
  std::map<const Input *, Vector> later;
  for (const auto &[name, input] : inputs_) {
    if (input.whole.size() > 0)
      later.emplace(&input, late(input.whole));
  }
  const auto then_of = [&later](const Input *input) -> const Vector & {
    const auto found = later.find(input);
    return found != later.end() ? found->second : input->now;
  };
  Vector out = Vector::Zero(static_cast<Index>(rows_.size()));
  for (const Product &product : products_) {
    Vector now = Vector::Constant(out.size(), product.coefficient), then = now;
    for (const Input *factor : product.factors) {
      now.array() *= factor->now.array();
      then.array() *= then_of(factor).array();
    }
    out += then - now;
  }
  for (const Curve &curve : curves_) {
    Vector now = Vector::Zero(out.size()), then = now;
    for (const auto &[weight, summand] : curve.summands) {
      now += weight * summand->now;
      then += weight * then_of(summand);
    }
    out += ridge_values(*curve.ridge, then) - ridge_values(*curve.ridge, now);
  }
  return out;
}

// Of a delay or lag of the prediction, or of the change within a row where it starts from a reading
// `s`: that is what is known, and what comes late is what it adds; and of play. At the rows wanted.
Eigen::MatrixXd columns_at(const Term &term, const std::vector<std::vector<Parameter>> &shapes,
                           const Measured &measured, const Vector &m,
                           const std::vector<Index> *wanted) {
  const auto along = term.arguments.find(kAlong);
  const Vector speed =
      along != term.arguments.end() ? feature_column(measured, along->second) : Vector();
  Clock clock(measured, speed.size() > 0 ? &speed : nullptr);
  const std::vector<Index> &rows = wanted != nullptr ? *wanted : clock.all();
  Eigen::MatrixXd out(static_cast<Index>(rows.size()), static_cast<Index>(shapes.size()));
  const bool is_play = term.form == kBacklash, has_lag = term.form.rfind("lag", 0) == 0,
             has_delay = !has_lag || term.form == "lag_delay" || term.form == "lag_length",
             is_bare = term.response.empty() && term.ridges.empty();
  const auto state = term.arguments.find("s");
  const bool is_change = is_bare && !is_play && state != term.arguments.end();
  const Vector whole = is_change ? Vector(m - feature_column(measured, state->second)) : m;
  const Vector *start = is_bare && !is_change ? start_of(term, measured, m) : nullptr;
  const LateResponse response(term, measured, rows);
  double known_s = -1.0, known_level = 0.0; // of `before`, x in all rows, delayed
  Vector before;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const auto of = [&](const char *name) { return shape_value(shapes[k], term.form, name); };
    const auto found = std::find_if(shapes[k].begin(), shapes[k].end(), is_level_before);
    const Parameter *before_it = is_bare && found != shapes[k].end() ? &*found : nullptr;
    const double level = before_it != nullptr ? before_it->value : 0.0;
    const Vector x = after_level(whole, before_it);
    Vector column;
    if (is_play) {
      column = through_play(m, measured, of("play"))(rows) - m(rows);
    } else if (!is_bare) {
      column = response.column([&](const Vector &u) -> Vector {
        return has_lag ? clock.through_lag(u, of("lag"), nullptr, rows)
                       : clock.delayed(u, of("delay"), rows);
      });
    } else if (!has_lag) {
      column = clock.delayed(x, of("delay"), rows) - x(rows);
    } else {
      if (has_delay && (of("delay") != known_s || level != known_level)) {
        known_s = of("delay");
        known_level = level;
        before = along != term.arguments.end()
                     ? delayed(x, measured, known_s) // a lag over a length
                     : clock.delayed(x, known_s, clock.all());
      }
      column = clock.through_lag(has_delay ? before : x, of("lag"), start, rows) - x(rows);
    }
    out.col(static_cast<Index>(k)) = column;
  }
  return out;
}

} // namespace

Vector delayed(const Vector &x, const Measured &measured, double delay_s) {
  const Clock clock(measured, nullptr);
  return clock.delayed(x, delay_s, clock.all());
}

Vector through_lag(const Vector &x, const Measured &measured, double lag_s) {
  Clock clock(measured, nullptr);
  return clock.through_lag(x, lag_s, nullptr, clock.all());
}

Vector held_within(const Vector &x, const Measured &measured, double reach) {
  Vector out = Vector::Zero(x.size());
  for (const LogSpan &log : measured.logs) {
    double drawn[kSprings] = {};
    for (std::size_t i = log.first + 1; i < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      double sum = 0.0;
      for (int spring = 0; spring < kSprings; ++spring) {
        const double limit = reach * (spring + 1) / kSprings;
        drawn[spring] = std::clamp(drawn[spring] + x(k) - x(k - 1), -limit, limit);
        sum += drawn[spring];
      }
      out(k) = sum / kSprings;
    }
  }
  return out;
}

Eigen::MatrixXd late_columns(const Term &term, const std::vector<std::vector<Parameter>> &shapes,
                             const Measured &measured, const Vector &m) {
  if (measured.whole == nullptr)
    return columns_at(term, shapes, measured, m, nullptr);
  const Measured &whole = *measured.whole;
  const int c = whole.find_channel(term.channel);
  if (c < 0)
    throw DataError("there is no channel '" + term.channel + "' in the logs");
  return columns_at(term, shapes, whole, whole.channels[static_cast<std::size_t>(c)].m,
                    &measured.picked);
}

} // namespace rim::diagnose
