// SPDX-License-Identifier: MIT
#include "diagnose/library.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "diagnose/late.hpp"
#include "diagnose/response.hpp"
#include "diagnose/roles.hpp"
#include "stats/robust.hpp"
#include "util/error.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr int kMaxLagRows = 20;
// Mean square in stated sd of a column that is none. Units are free: the square of a place in
// metres may well be 1e-12 of the noise of a force.
constexpr double kNothing = 1e-60;
// Lags of an argument: how many, from so many rows, to this share of a log.
constexpr int kLags = 8;
constexpr double kShortestLag = 2.0, kLongestLag = 0.125;
// Reaches within which a quantity is held: how many, and as shares of its range.
constexpr int kReaches = 9;
constexpr double kLeastReach = 0.01, kMostReach = 0.5;
// The most of its squares that what is held may have in common with the quantity.
constexpr double kMostAlike = 0.9;
// And of what acts gradually with the prediction, beyond which it may be that, which has a lag;
// nats that it then costs more.
constexpr double kIsPrediction = 0.99, kOfPrediction = 20.0;
// The least of them over the noise of a reading, and the correlation of that with the error from
// which the prediction is made of it.
constexpr double kReachOverNoise = 6.0, kInError = 0.1;
// Nats that a form of a velocity costs more where it is not known which one is the channel's own.
constexpr double kNotOwn = 1.5;
// And for the prediction of another outcome as an argument: what acts is what that is made of.
constexpr double kOtherPrediction = 12.0;
// For a reading through a lag where there are commands: those act gradually rather.
constexpr double kNotCommanded = 3.0;
// For the prediction times the reading that it starts from: that is the square of a state, and a
// drag where there is one.
constexpr double kOwnSquare = 20.0;
// Play, as shares of the prediction's range.
constexpr int kPlays = 18;
constexpr double kLeastPlay = 0.002, kMostPlay = 0.6;
// What comes late by a length: by how much of its mean the speed varies at least.
constexpr double kLeastSpeeds = 0.1;
// And a prediction, for what it is multiplied with to be more than that alone.
constexpr double kLeastVaried = 0.03;

bool holds(const std::vector<int> &features, int f) {
  return std::find(features.begin(), features.end(), f) != features.end();
}

bool is_per_second(const std::string &unit) {
  return unit.size() > 2 && unit.compare(unit.size() - 2, 2, "/s") == 0;
}

// Whether what varies so much may be this argument of the form. The zero of a temperature means
// nothing: where it hardly varies beside its mean, it acts by what it departs from that.
bool has_spread(const Form &form, const Argument &argument, const Vector &x) {
  const double mean = x.mean(), sd = std::sqrt((x.array() - mean).square().mean());
  const bool is_about = !form.shape.empty() && form.shape[0].quantiles_of == argument.name;
  return sd >= form.least_spread * std::abs(mean) &&
         (!is_about || sd < form.most_spread * std::abs(mean));
}

// Whether the form multiplies a prediction that hardly varies with a quantity: that is the
// quantity alone, under another name.
bool is_of_constant(const Form &form, const Vector &m) {
  const double mean = m.mean(), sd = std::sqrt((m.array() - mean).square().mean());
  return !form.arguments.empty() && sd < kLeastVaried * std::abs(mean) &&
         std::find(form.per.begin(), form.per.end(), "m") != form.per.end();
}

double squared_correlation(const Vector &a, const Vector &b) {
  const Vector x = a.array() - a.mean(), y = b.array() - b.mean();
  const double both = x.dot(y);
  return both * both / std::max(1e-300, x.squaredNorm() * y.squaredNorm());
}

class Builder {
public:
  Builder(const Measured &measured, const Channel &channel, const Catalogue &catalogue,
          bool may_delay)
      : measured_(measured), channel_(channel), catalogue_(catalogue), may_delay_(may_delay),
        velocities_(velocities(measured)) {
    state_ = own_state(measured, channel);
    has_start_ = state_ >= 0 && starts_from(measured, channel, state_);
    has_command_ = std::any_of(measured.features.begin(), measured.features.end(),
                               [](const Feature &f) { return f.is_command; });
    out_.own = own_velocity(measured, channel);
    out_.time_share = channel.run.cols() > 0 ? 1.0 : kTimeShare;
    out_.ln_rows = std::log(static_cast<double>(measured.rows()));
  }
  Library build();

private:
  std::vector<int> features_for(ArgumentRole role) const;
  bool is_alike(int f, int g) const;
  bool may_be_held(int f) const;
  std::vector<std::vector<int>> assignments(const Form &form) const;
  std::vector<double> grid(const ShapeParameter &p, const Form &form,
                           const std::vector<int> &arguments) const;
  std::string shape_unit(const Form &form, std::size_t which,
                         const std::vector<int> &arguments) const;
  std::vector<std::vector<double>> grids(const Form &form, const std::vector<int> &arguments) const;
  void set_shape(const Form &form, const std::vector<int> &arguments,
                 const std::vector<std::vector<double>> &values,
                 const std::array<std::size_t, 2> &at, Candidate *c) const;
  double argument_cost(const Form &form, std::size_t assignments) const;
  double other_predictions(const std::vector<int> &arguments) const;
  Candidate candidate_of(const Form &form) const;
  void add_form(const Form &form);
  void add_built_in(const Form &form);
  void add_sets();
  bool add(Candidate candidate, const Eigen::MatrixXd &columns);
  std::string unit_of(const Form &form, const std::vector<int> &arguments) const;
  void add_gate(const std::string &name, const std::string &unit, const Vector &x, double turn);
  void add_gates();
  double row_s() const;
  std::vector<std::vector<Parameter>> late_grid(const std::string &form) const;
  void add_late(const Form &form, const std::vector<std::vector<Parameter>> &grid,
                Candidate candidate);
  void add_by_length(const Form &form, const Candidate &candidate);
  void add_lagged(const Form &form);
  struct Jitter {
    double sd = 0.0;
    bool is_in_error = false;
  };
  Jitter jitter_of(int feature) const;
  void add_held(const Form &form);
  void add_marked(const Form &form, const std::vector<int> &argument, char mark, double least,
                  double most, int count, Candidate candidate);

  const Measured &measured_;
  const Channel &channel_;
  const Catalogue &catalogue_;
  bool may_delay_;
  std::vector<int> velocities_;
  int state_ = -1;         // own_state()
  bool has_start_ = false; // the prediction starts from it
  bool has_command_ = false;
  Response response_;
  Library out_;
  std::vector<Vector> columns_;
};

// A reading that a row starts from tells itself the way it came; a velocity has none.
bool Builder::may_be_held(int f) const {
  const Feature &feature = measured_.features[static_cast<std::size_t>(f)];
  return may_delay_ && !has_start_ && !feature.is_angle && !is_per_second(feature.unit) &&
         !holds(velocities_, f) && (!feature.is_prediction || feature.name == "m." + channel_.name);
}

std::vector<int> Builder::features_for(ArgumentRole role) const {
  std::vector<int> all, chosen, headings;
  for (int f = 0; f < static_cast<int>(measured_.features.size()); ++f) {
    const Feature &feature = measured_.features[static_cast<std::size_t>(f)];
    const Vector x = measured_.x.col(f);
    const bool is_own = out_.own.size() == 1 && out_.own[0] == f;
    bool fits = false;
    switch (role) {
    case ArgumentRole::any:
      fits = true;
      break;
    case ArgumentRole::other:
    case ArgumentRole::alike:
      fits = !is_own && feature.name != "m." + channel_.name; // that is a gain
      break;
    case ArgumentRole::velocity:
      fits = holds(velocities_, f);
      break;
    case ArgumentRole::signed_: {
      const double low = x.minCoeff(), high = x.maxCoeff();
      fits = low < -0.1 * high && high > -0.1 * low;
      break;
    }
    case ArgumentRole::command:
      fits = feature.is_command;
      break;
    case ArgumentRole::angle:
    case ArgumentRole::heading:
      fits = turns(feature, x);
      if (role == ArgumentRole::heading && fits &&
          has_word(feature.name, {"heading", "yaw", "theta", "psi"}))
        headings.push_back(f);
      break;
    case ArgumentRole::altitude:
      fits = is_altitude(feature, x);
      break;
    case ArgumentRole::state:
    case ArgumentRole::own_state:
      fits = f == state_ && (role == ArgumentRole::state || holds(out_.own, f));
      break;
    case ArgumentRole::lagged:
      fits = may_delay_ && !has_start_ && !is_own && !feature.is_prediction;
      break;
    case ArgumentRole::held:
      fits = may_be_held(f);
      break;
    case ArgumentRole::stream:
      fits = !out_.own.empty() && !is_own &&
             is_stream(feature, measured_.features[static_cast<std::size_t>(out_.own[0])]);
      break;
    case ArgumentRole::own:
      break;
    }
    if (fits)
      chosen.push_back(f);
  }
  return role == ArgumentRole::own ? out_.own : headings.empty() ? chosen : headings;
}

// Whether one of the two less the other is a quantity of its own.
bool Builder::is_alike(int f, int g) const {
  const Feature &a = measured_.features[static_cast<std::size_t>(f)],
                &b = measured_.features[static_cast<std::size_t>(g)];
  return !a.unit.empty() && a.unit == b.unit && !a.is_prediction && !b.is_prediction &&
         !a.is_angle && !b.is_angle;
}

std::vector<std::vector<int>> Builder::assignments(const Form &form) const {
  if (form.is_of_command && has_start_)
    return {};
  std::vector<std::vector<int>> out{{}};
  for (const Argument &argument : form.arguments) {
    std::vector<std::vector<int>> longer;
    for (const std::vector<int> &so_far : out) {
      for (const int f : features_for(argument.role)) {
        if (!so_far.empty() && (form.is_unordered ? f <= so_far[0] : f == so_far[0]))
          continue;
        // With the channel's own prediction that is a gain that depends on the other.
        if (form.arguments.size() > 1 &&
            measured_.features[static_cast<std::size_t>(f)].name == "m." + channel_.name)
          continue;
        if (!has_spread(form, argument, measured_.x.col(f)) ||
            (argument.role == ArgumentRole::alike && !is_alike(so_far[0], f)))
          continue;
        longer.push_back(so_far);
        longer.back().push_back(f);
      }
    }
    out = std::move(longer);
  }
  return out;
}

// Values of the parameter to try, in the unit of the features they meet.
std::vector<double> Builder::grid(const ShapeParameter &p, const Form &form,
                                  const std::vector<int> &arguments) const {
  std::vector<double> out = p.values;
  if (!p.share_of.empty()) {
    for (std::size_t k = 0; k < arguments.size(); ++k) {
      const double scale =
          channel_.m.norm() / std::max(1e-300, measured_.x.col(arguments[k]).norm());
      if (form.arguments[k].name == p.share_of)
        std::for_each(out.begin(), out.end(), [scale](double &v) { v *= scale; });
    }
    return out;
  }
  if (p.quantiles_of.empty()) {
    for (std::size_t k = 0; k < arguments.size(); ++k) {
      const Feature &f = measured_.features[static_cast<std::size_t>(arguments[k])];
      if (p.unit == "m" && f.unit == "km" && form.arguments[k].role == ArgumentRole::altitude)
        std::for_each(out.begin(), out.end(), [](double &v) { v *= 1e-3; });
    }
    return out;
  }
  const bool is_magnitude = p.quantiles_of.rfind("abs(", 0) == 0;
  const std::string of =
      is_magnitude ? p.quantiles_of.substr(4, p.quantiles_of.size() - 5) : p.quantiles_of;
  Vector x = of == "t" ? feature_column(measured_, kTime) : channel_.m;
  for (std::size_t k = 0; k < form.arguments.size(); ++k) {
    if (form.arguments[k].name == of)
      x = measured_.x.col(arguments[k]);
  }
  if (is_magnitude)
    x = x.cwiseAbs().eval();
  const double most = p.most_of_rms * std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
  std::sort(x.data(), x.data() + x.size());
  for (int i = 0; i < p.count; ++i) {
    // Of a magnitude more finely near none: how slow is rest?
    const double step = static_cast<double>(i) / std::max(1, p.count - 1);
    const double share =
        p.low_share + (p.high_share - p.low_share) * (is_magnitude ? step * step : step);
    const double quantile = x(static_cast<Index>(share * static_cast<double>(x.size() - 1)));
    const double level = std::min(quantile, most); // what never rests has one such width
    // A width of nothing is none: of a magnitude that is mostly zero.
    const bool may_be_none = p.low_share <= 0.0 && i == 0;
    if ((out.empty() || level > out.back()) && !(is_magnitude && level <= 0.0 && !may_be_none))
      out.push_back(level);
  }
  return out;
}

std::string Builder::unit_of(const Form &form, const std::vector<int> &arguments) const {
  std::string under;
  for (const std::string &name : form.per) {
    std::string unit = name == "m" ? channel_.unit : name == "t" ? "s" : "";
    for (std::size_t k = 0; k < form.arguments.size(); ++k) {
      if (form.arguments[k].name == name)
        unit = measured_.features[static_cast<std::size_t>(arguments[k])].unit;
    }
    if (unit.find('/') != std::string::npos)
      unit = "(" + unit + ")";
    if (!unit.empty())
      under += (under.empty() ? "" : " ") + unit;
  }
  if (form.per.size() == 1 && form.per[0] == "m")
    return "";
  return under.empty() ? channel_.unit
                       : (channel_.unit.empty() ? "1" : channel_.unit) + " per " + under;
}

bool Builder::add(Candidate candidate, const Eigen::MatrixXd &columns) {
  for (Index k = 0; k < columns.cols(); ++k) {
    const Vector scaled = columns.col(k).cwiseQuotient(channel_.sd);
    if (!scaled.allFinite() || scaled.squaredNorm() < kNothing * static_cast<double>(scaled.size()))
      return false;
  }
  candidate.column = static_cast<int>(columns_.size());
  candidate.columns = static_cast<int>(columns.cols());
  for (Index k = 0; k < columns.cols(); ++k)
    columns_.push_back(columns.col(k).cwiseQuotient(channel_.sd));
  out_.candidates.push_back(std::move(candidate));
  return true;
}

// Unit of the shape parameter: its own, or that of what its grid is made of.
std::string Builder::shape_unit(const Form &form, std::size_t which,
                                const std::vector<int> &arguments) const {
  const ShapeParameter &p = form.shape[which];
  if (!p.share_of.empty() && arguments.size() == 1) {
    const std::string &of = measured_.features[static_cast<std::size_t>(arguments[0])].unit;
    return of.empty() ? channel_.unit
                      : (channel_.unit.empty() ? "1" : channel_.unit) + " per (" + of + ")";
  }
  std::string unit = p.unit == "1" ? "" : p.unit;
  if (unit.empty() && (p.quantiles_of == "m" || p.quantiles_of == "abs(m)"))
    unit = channel_.unit;
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const std::string &name = form.arguments[k].name;
    if (name == p.quantiles_of || "abs(" + name + ")" == p.quantiles_of ||
        (p.unit == "m" && form.arguments[k].role == ArgumentRole::altitude))
      unit = measured_.features[static_cast<std::size_t>(arguments[k])].unit;
  }
  return unit;
}

// Nats for the choice of arguments, beside those of the form itself.
double Builder::argument_cost(const Form &form, std::size_t assignments) const {
  double cost = form.cost + std::log(std::max<double>(1.0, static_cast<double>(assignments)));
  const bool has_own = std::any_of(form.arguments.begin(), form.arguments.end(),
                                   [](const Argument &a) { return a.role == ArgumentRole::own; });
  if (has_own && out_.own.size() > 1)
    cost += kNotOwn;
  const auto better = std::find_if(catalogue_.forms.begin(), catalogue_.forms.end(),
                                   [&form](const Form &f) { return f.form == form.better; });
  if (better != catalogue_.forms.end() && !this->assignments(*better).empty())
    cost += form.worse_by;
  return cost;
}

double Builder::other_predictions(const std::vector<int> &arguments) const {
  return static_cast<double>(std::count_if(arguments.begin(), arguments.end(), [this](int f) {
    const Feature &feature = measured_.features[static_cast<std::size_t>(f)];
    return feature.is_prediction && feature.name != "m." + channel_.name;
  }));
}

// Of one group at most one is taken: two levels of a hinge are two things, two widths of a friction
// are one, and so are two magnitudes by which a share falls.
std::string group_of(const Form &form, const Term &term) {
  const bool has_levels =
      !form.shape.empty() && form.shape[0].quantiles_of.rfind("abs(", 0) == std::string::npos;
  // What is limited above may have another limit below.
  std::string group = form.is_fixed && has_levels ? form.form
                      : form.is_physical || form.is_fixed || form.cause == "drift"
                          ? form.cause
                          : form.form + (has_levels ? std::to_string(term.shape[0].value) : "");
  for (const auto &[name, feature] : term.arguments) {
    if (!(form.is_physical && name != "v" && name != "w" && term.arguments.count("v") > 0))
      group += " " + feature;
  }
  return group;
}

// Without its arguments.
Candidate Builder::candidate_of(const Form &form) const {
  Candidate candidate;
  candidate.is_fixed = form.is_fixed;
  candidate.is_positive = form.is_positive;
  candidate.is_physical = form.is_physical;
  candidate.size_names = form.size_names;
  candidate.gate = form.gate;
  candidate.term.channel = channel_.name;
  candidate.term.cause = form.cause;
  candidate.term.form = form.form;
  candidate.term.basis = form.basis;
  return candidate;
}

void Builder::add_form(const Form &form) {
  if (is_of_constant(form, channel_.m))
    return;
  const Candidate candidate = candidate_of(form);
  const double sizes =
      form.is_fixed ? 0.0 : static_cast<double>(std::max<std::size_t>(1, form.basis.size()));
  const std::vector<std::vector<int>> all = assignments(form);
  const double cost = 0.5 * (sizes + (form.shape.size() > 1 ? 1.0 : 0.0)) * out_.ln_rows +
                      argument_cost(form, all.size());
  for (const std::vector<int> &arguments : all) {
    Candidate c = candidate;
    for (std::size_t k = 0; k < arguments.size(); ++k)
      bind(form.arguments[k], measured_.features[static_cast<std::size_t>(arguments[k])], &c.term);
    double of_arguments = kOtherPrediction * other_predictions(arguments);
    if (form.cause == "product" && form.arguments.size() == 1 && has_start_ &&
        arguments[0] == state_)
      of_arguments += kOwnSquare;
    const std::vector<std::vector<double>> values = grids(form, arguments);
    for (std::size_t v = 0; v < values[0].size(); ++v) {
      for (std::size_t w = 0; w < values[1].size(); ++w) {
        const bool is_usual = !form.shape.empty() && form.shape[0].first_is_usual && v == 0;
        const auto tried = static_cast<double>(values[0].size() * values[1].size());
        c.penalty = cost + of_arguments + (is_usual ? 0.0 : std::log(tried));
        set_shape(form, arguments, values, {v, w}, &c);
        c.group = group_of(form, c.term);
        if (add(c, basis_columns(c.term, measured_, channel_.m)))
          out_.size_units.push_back(unit_of(form, arguments));
      }
    }
  }
}

// What each of two shape parameters is tried at; one value, which means nothing, of one that there
// is not.
std::vector<std::vector<double>> Builder::grids(const Form &form,
                                                const std::vector<int> &arguments) const {
  std::vector<std::vector<double>> out(2, {0.0});
  for (std::size_t k = 0; k < form.shape.size(); ++k)
    out[k] = grid(form.shape[k], form, arguments);
  return out;
}

// The shape at these places of the grids, and where each parameter may be refined. Whole numbers
// without a unit (harmonics) are not refined, nor is what is usual, nor what has one value.
void Builder::set_shape(const Form &form, const std::vector<int> &arguments,
                        const std::vector<std::vector<double>> &values,
                        const std::array<std::size_t, 2> &at, Candidate *c) const {
  c->term.shape.clear();
  c->shape_range.clear();
  bool is_refined = true;
  for (std::size_t k = 0; k < form.shape.size(); ++k) {
    const ShapeParameter &p = form.shape[k];
    const std::vector<double> &of = values[k];
    c->term.shape.push_back({p.name, of[at[k]], 0.0, shape_unit(form, k, arguments)});
    is_refined = is_refined && p.unit != "1" && !p.first_is_usual && of.size() > 1;
    if (is_refined)
      c->shape_range.emplace_back(of[at[k] > 0 ? at[k] - 1 : at[k]],
                                  of[std::min(at[k] + 1, of.size() - 1)]);
  }
}

// The argument through lags of two rows to an eighth of the shortest log.
void Builder::add_lagged(const Form &form) {
  const Measured &all = measured_.whole != nullptr ? *measured_.whole : measured_;
  double longest = 1e300;
  for (const LogSpan &log : all.logs)
    longest = std::min(longest, kLongestLag * all.elapsed_s[log.first + log.rows - 1]);
  const double shortest = kShortestLag * row_s();
  if (longest <= 2.0 * shortest)
    return;
  const std::vector<std::vector<int>> arguments = assignments(form);
  Candidate c = candidate_of(form);
  c.penalty = 0.5 * out_.ln_rows + argument_cost(form, arguments.size()) +
              std::log(static_cast<double>(kLags));
  for (const std::vector<int> &argument : arguments) {
    const bool is_command = measured_.features[static_cast<std::size_t>(argument[0])].is_command;
    Candidate of_it = c;
    of_it.penalty += has_command_ && !is_command ? kNotCommanded : 0.0;
    if (squared_correlation(measured_.x.col(argument[0]), channel_.m) > kIsPrediction)
      of_it.penalty += kOfPrediction;
    add_marked(form, argument, '~', shortest, longest, kLags, of_it);
  }
}

// What of a feature changes from row to row without lasting, and whether what is wrong with the
// prediction goes with it.
Builder::Jitter Builder::jitter_of(int feature) const {
  const Measured &all = measured_.whole != nullptr ? *measured_.whole : measured_;
  const Channel &channel = all.channels[static_cast<std::size_t>(all.find_channel(channel_.name))];
  const Vector x = feature_column(all, measured_.features[static_cast<std::size_t>(feature)].name),
               wrong = (channel.z - channel.m).cwiseQuotient(channel.sd);
  double squares = 0.0, next = 0.0, both = 0.0, wrongs = 0.0, before = 0.0, rows = 0.0;
  for (const LogSpan &log : all.logs) {
    for (std::size_t i = log.first + 1; i + 1 < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      const double bend = x(k - 1) - 2.0 * x(k) + x(k + 1),
                   of_wrong = wrong(k - 1) - 2.0 * wrong(k) + wrong(k + 1);
      next += i > log.first + 1 ? bend * before : 0.0;
      squares += bend * bend;
      both += bend * of_wrong;
      wrongs += of_wrong * of_wrong;
      before = bend;
      rows += 1.0;
    }
  }
  Jitter out;
  if (next >= 0.0 || rows < 1.0) // bends that last are motion
    return out;
  out.sd = std::sqrt(squares / (6.0 * rows)); // a white reading bends by root 6 of its own
  out.is_in_error = std::abs(both) > kInError * std::sqrt(squares * wrongs);
  return out;
}

// What is held of the argument, within shares of its range. The noise of a reading that the
// prediction is made of would be held too, and mend the prediction.
void Builder::add_held(const Form &form) {
  std::vector<std::vector<int>> arguments;
  std::vector<double> least;
  for (const std::vector<int> &argument : assignments(form)) {
    const Jitter jitter = jitter_of(argument[0]);
    if (jitter.is_in_error)
      continue;
    arguments.push_back(argument);
    least.push_back(kReachOverNoise * jitter.sd);
  }
  Candidate c = candidate_of(form);
  c.penalty = out_.ln_rows + argument_cost(form, arguments.size()) +
              std::log(static_cast<double>(kReaches));
  for (std::size_t k = 0; k < arguments.size(); ++k) {
    const Vector x = measured_.x.col(arguments[k][0]);
    const double range = x.maxCoeff() - x.minCoeff(),
                 first = std::max(kLeastReach * range, least[k]);
    if (first < 0.5 * kMostReach * range)
      add_marked(form, arguments[k], '%', first, kMostReach * range, kReaches, c);
  }
}

// The argument with a mark and a number (term.hpp), of `count` numbers on a geometric grid.
void Builder::add_marked(const Form &form, const std::vector<int> &argument, char mark,
                         double least, double most, int count, Candidate c) {
  const std::string &name = measured_.features[static_cast<std::size_t>(argument[0])].name;
  c.group = form.form + " " + name;
  for (int k = 0; k < count; ++k) {
    const double number = least * std::pow(most / least, k / (count - 1.0));
    c.term.arguments[form.arguments[0].name] = fmt::format("{}{}{:.4g}", name, mark, number);
    if (mark == '%' &&
        squared_correlation(feature_column(measured_, c.term.arguments.begin()->second),
                            measured_.x.col(argument[0])) > kMostAlike)
      continue; // springs that hardly slip are a coupling
    if (add(c, basis_columns(c.term, measured_, channel_.m)))
      out_.size_units.push_back(unit_of(form, argument));
  }
}

double Builder::row_s() const {
  std::vector<double> steps;
  const Measured &all = measured_.whole != nullptr ? *measured_.whole : measured_;
  for (const LogSpan &log : all.logs) {
    for (std::size_t i = log.first; i + 1 < log.first + log.rows; ++i)
      steps.push_back(all.elapsed_s[i + 1] - all.elapsed_s[i]);
  }
  if (steps.empty())
    return 1.0;
  return median(std::move(steps));
}

// Delays of whole rows, lags on a geometric grid; both together on a coarse one.
std::vector<std::vector<Parameter>> Builder::late_grid(const std::string &form) const {
  const double row = row_s();
  std::vector<std::vector<Parameter>> out;
  const auto lag = [row](int k) {
    return Parameter{"lag", 0.5 * row * std::pow(80.0, k / 13.0), 0.0, "s"};
  };
  if (form == kBacklash) {
    const double range = channel_.m.maxCoeff() - channel_.m.minCoeff();
    for (int k = 0; k < kPlays; ++k)
      out.push_back(
          {{"play", kLeastPlay * range * std::pow(kMostPlay / kLeastPlay, k / (kPlays - 1.0)), 0.0,
            channel_.unit}});
  } else if (form == "lag_delay") {
    for (const double rows : {1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0})
      for (int k = 0; k < 14; ++k)
        out.push_back({lag(k), {"delay", rows * row, 0.0, "s"}});
  } else if (form == "lag_length") { // what a row's command does is seen at its end, or at once
    for (const double rows : {0.0, 1.0})
      for (int k = 0; k < 14; ++k)
        out.push_back({lag(k), {"delay", rows * row, 0.0, "s"}});
  } else if (form == "lag" || form == "lag_command") {
    for (int k = 0; k < 14; ++k)
      out.push_back({lag(k)});
  } else {
    for (int k = 1; k <= kMaxLagRows; ++k)
      out.push_back({{"delay", k * row, 0.0, "s"}});
  }
  return out;
}

// The grid of times at the mean speed is one of lengths.
void Builder::add_by_length(const Form &form, const Candidate &candidate) {
  for (const std::vector<int> &argument : assignments(form)) {
    const Feature &feature = measured_.features[static_cast<std::size_t>(argument[0])];
    const Vector speed = measured_.x.col(argument[0]).cwiseAbs();
    const double mean = speed.mean(), sd = std::sqrt((speed.array() - mean).square().mean());
    const std::string &unit = feature.unit;
    const bool is_per_s = is_per_second(unit);
    if (has_start_ || feature.is_prediction || !(is_per_s || unit.empty()) ||
        !(sd > kLeastSpeeds * mean))
      continue;
    Candidate c = candidate;
    c.term.arguments[form.arguments[0].name] = feature.name;
    std::vector<std::vector<Parameter>> grid = late_grid(form.form);
    for (std::vector<Parameter> &shape : grid) {
      shape[0].value *= mean;
      shape[0].unit = is_per_s ? unit.substr(0, unit.size() - 2) : "";
    }
    add_late(form, grid, c);
  }
}

void Builder::add_built_in(const Form &form) {
  Candidate candidate = candidate_of(form);
  candidate.is_fixed = true;
  candidate.group = "late";
  if (!form.arguments.empty()) {
    add_by_length(form, candidate);
    return;
  }
  if (form.form == "delay" || form.form == "lag_command") {
    if (!response_.is_tried)
      response_ = fit_response(measured_, channel_);
    if (!response_.is_known)
      return;
    candidate.term.response = response_.products;
    candidate.term.ridges = response_.ridges;
  }
  if (has_start_ && form.form == kBacklash)
    return;
  if (has_start_ && candidate.term.response.empty() && candidate.term.ridges.empty())
    candidate.term.arguments["s"] = measured_.features[static_cast<std::size_t>(state_)].name;
  add_late(form, late_grid(form.form), std::move(candidate));
}

void Builder::add_late(const Form &form, const std::vector<std::vector<Parameter>> &grid,
                       Candidate candidate) {
  candidate.penalty = std::log(static_cast<double>(grid.size())) + 0.5 * out_.ln_rows + form.cost;
  const Eigen::MatrixXd columns = late_columns(candidate.term, grid, measured_, channel_.m);
  for (std::size_t k = 0; k < grid.size(); ++k) {
    candidate.term.shape = grid[k];
    candidate.shape_range.clear();
    for (const Parameter &p : grid[k])
      candidate.shape_range.emplace_back(0.6 * p.value, 1.5 * p.value);
    if (add(candidate, columns.col(static_cast<Index>(k))))
      out_.size_units.push_back("");
  }
}

// Every way to take one candidate of each form of a set, over the same velocity, with one shape
// free: that of the first form; the others take their first.
void Builder::add_sets() {
  const auto &all = out_.candidates;
  for (const std::vector<std::string> &forms : catalogue_.sets) {
    for (std::size_t first = 0; first < all.size(); ++first) {
      if (all[first].term.form != forms[0])
        continue;
      std::vector<int> set{static_cast<int>(first)};
      for (std::size_t k = 1; k < forms.size(); ++k) {
        const auto fits = [&](const Candidate &c) {
          const auto mine = c.term.arguments.find("v"), of_it = all[first].term.arguments.find("v");
          return c.term.form == forms[k] &&
                 (mine == c.term.arguments.end() || of_it == all[first].term.arguments.end() ||
                  mine->second == of_it->second);
        };
        const auto found = std::find_if(all.begin(), all.end(), fits);
        if (found == all.end())
          break;
        set.push_back(static_cast<int>(found - all.begin()));
      }
      if (set.size() == forms.size())
        out_.sets.push_back(set);
    }
  }
}

void cut(const Vector &x, int bins, std::vector<std::uint8_t> *bin, std::vector<double> *edge) {
  Vector sorted = x;
  std::sort(sorted.data(), sorted.data() + sorted.size());
  const Index n = sorted.size();
  edge->assign(1, sorted(0));
  for (int k = 1; k < bins; ++k) {
    const Index at = n * k / bins;
    // Between the two different values nearest to the quantile.
    const double *above = std::upper_bound(sorted.data(), sorted.data() + n, sorted(at - 1));
    if (above == sorted.data() + n)
      break;
    const double middle = 0.5 * (sorted(at - 1) + *above);
    if (middle > edge->back())
      edge->push_back(middle);
  }
  edge->push_back(sorted(n - 1));
  bin->resize(static_cast<std::size_t>(n));
  for (Index i = 0; i < n; ++i) {
    const auto inner = std::upper_bound(edge->begin() + 1, edge->end() - 1, x(i));
    (*bin)[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(inner - (edge->begin() + 1));
  }
}

void Builder::add_gate(const std::string &name, const std::string &unit, const Vector &x,
                       double turn) {
  GateFeature gate;
  gate.name = name;
  gate.unit = unit;
  gate.is_turned = turn > 0.0;
  gate.turn = turn;
  gate.cut = x.minCoeff() < 0.0 ? -0.5 * turn : 0.0;
  const double middle = gate.cut + 0.5 * turn;
  gate.x = x.unaryExpr([turn, middle](double a) { return a < middle ? a + turn : a; });
  cut(gate.x, kFineBins, &gate.fine, &gate.fine_edge);
  cut(gate.x, kCoarseBins, &gate.coarse, &gate.coarse_edge);
  if (gate.fine_bins() >= 2)
    out_.gates.push_back(std::move(gate));
}

void Builder::add_gates() {
  for (std::size_t f = 0; f < measured_.features.size(); ++f) {
    const Feature &feature = measured_.features[f];
    const Vector x = measured_.x.col(static_cast<Index>(f));
    add_gate(feature.name, feature.unit, x, 0.0);
    if (const double turn = turn_in(feature.unit);
        feature.is_angle && x.minCoeff() >= -0.502 * turn && x.maxCoeff() <= 1.002 * turn)
      add_gate(feature.name, feature.unit, x, turn);
  }
  add_gate(kTime, "s", feature_column(measured_, kTime), 0.0);
}

Library Builder::build() {
  for (const Form &form : catalogue_.forms) {
    if (form.kind != TermKind::mean || form.form == kPeriodicTime) // ChannelSearch::find_swings
      continue;
    if (form.arguments.size() == 1 && form.arguments[0].role == ArgumentRole::lagged)
      add_lagged(form);
    else if (form.arguments.size() == 1 && form.arguments[0].role == ArgumentRole::held)
      add_held(form);
    else if (!form.basis.empty())
      add_form(form);
    else if (may_delay_)
      add_built_in(form);
  }
  out_.g.resize(channel_.m.size(), static_cast<Index>(columns_.size()));
  for (std::size_t k = 0; k < columns_.size(); ++k)
    out_.g.col(static_cast<Index>(k)) = columns_[k];
  add_gates();
  add_sets();
  return std::move(out_);
}

} // namespace

double Library::gate_penalty(std::size_t features) const {
  if (features == 0)
    return 0.0;
  const auto f = static_cast<double>(gates.size());
  const double intervals = kFineBins * (kFineBins + 1) / 2.0;
  const double boxes = std::pow(kCoarseBins * (kCoarseBins + 1) / 2.0, 2.0);
  return features == 1 ? std::log(f * intervals) : std::log(0.5 * f * (f - 1.0) * boxes);
}

Library make_library(const Measured &measured, const Channel &channel, const Catalogue &catalogue,
                     bool may_delay) {
  return Builder(measured, channel, catalogue, may_delay).build();
}

void add_bounds(const GateFeature &feature, double lower, double upper, Gate *gate) {
  if (feature.is_turned) {
    const double end = feature.cut + feature.turn;
    if (lower > end)
      lower -= feature.turn;
    if (upper > end)
      upper -= feature.turn; // below lower: the interval runs through the cut
  }
  gate->features.push_back(feature.name);
  gate->units.push_back(feature.unit);
  gate->lower.push_back(lower);
  gate->upper.push_back(upper);
}

} // namespace rim::diagnose
