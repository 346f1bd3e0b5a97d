#include "diagnose/library.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/QR>
#include <fmt/format.h>

#include "util/error.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;
constexpr double kPi = 3.141592653589793, kTwoPi = 2.0 * kPi;
constexpr int kMaxLagRows = 20;
// Own velocity: how well its changes must follow the prediction.
constexpr double kLeastOwnCorrelation = 0.3;
// The response polynomial must say nearly all of the prediction, or lagged commands mean nothing.
constexpr double kLeastResponseR2 = 0.98;

bool has_word(const std::string &name, std::initializer_list<const char *> words) {
  for (const char *word : words) {
    if (name.find(word) != std::string::npos)
      return true;
  }
  return false;
}

bool is_velocity(const Feature &f) {
  return f.unit == "m/s" || f.unit == "km/s" || f.unit == "rad/s" || f.unit == "deg/s";
}

double correlation(const std::vector<double> &a, const std::vector<double> &b) {
  const auto n = static_cast<double>(a.size());
  double ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ma += a[i] / n;
    mb += b[i] / n;
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
    ab += (a[i] - ma) * (b[i] - mb);
  }
  return aa > 0.0 && bb > 0.0 ? ab / std::sqrt(aa * bb) : 0.0;
}

// How well the feature's change from row to row follows the channel: the prediction as a rate of
// change, or, in the feature's own unit, as its next value.
double own_correlation(const Measured &measured, const Channel &channel, int feature) {
  const Vector x = measured.x.col(feature);
  const Feature &f = measured.features[static_cast<std::size_t>(feature)];
  std::vector<double> change, rate, step;
  for (const LogSpan &log : measured.logs) {
    for (std::size_t i = log.first; i + 1 < log.first + log.rows; ++i) {
      const auto k = static_cast<Index>(i);
      const double dt = measured.elapsed_s[i + 1] - measured.elapsed_s[i];
      change.push_back((x(k + 1) - x(k)) / dt);
      rate.push_back(channel.m(k));
      step.push_back(channel.m(k) - x(k));
    }
  }
  if (change.size() < 10)
    return 0.0;
  const double follows = correlation(change, rate);
  return f.unit == channel.unit ? std::max(follows, correlation(change, step)) : follows;
}

std::vector<int> own_velocity(const Measured &measured, const Channel &channel) {
  std::vector<int> velocities;
  int best = -1;
  double most = kLeastOwnCorrelation;
  for (int f = 0; f < static_cast<int>(measured.features.size()); ++f) {
    const Feature &feature = measured.features[static_cast<std::size_t>(f)];
    if (!is_velocity(feature) || feature.is_command)
      continue;
    velocities.push_back(f);
    // An acceleration's own velocity is one of the same kind: m/s of m/s2, rad/s of rad/s2.
    if (!channel.unit.empty() && channel.unit.rfind(feature.unit.substr(0, 1), 0) != 0 &&
        channel.unit.rfind(feature.unit, 0) != 0)
      continue;
    const double c = own_correlation(measured, channel, f);
    if (c > most) {
      most = c;
      best = f;
    }
  }
  if (best >= 0)
    return {best};
  // A distance or a temperature has no velocity of its own.
  const bool may_have = channel.unit.empty() || channel.unit.find("/s") != std::string::npos;
  return may_have ? velocities : std::vector<int>{};
}

class Builder {
public:
  Builder(const Measured &measured, const Channel &channel)
      : measured_(measured), channel_(channel) {
    out_.own = own_velocity(measured, channel);
    out_.ln_rows = std::log(static_cast<double>(measured.rows()));
  }
  Library build(const Catalogue &catalogue);

private:
  std::vector<int> features_for(ArgumentRole role) const;
  std::vector<std::vector<int>> assignments(const Form &form) const;
  std::vector<double> grid(const ShapeParameter &p, const Form &form,
                           const std::vector<int> &arguments) const;
  void add_form(const Form &form);
  void add_built_in(const Form &form);
  bool add(Candidate candidate, const Eigen::MatrixXd &columns);
  std::map<std::string, double> response() const;
  std::string unit_of(const Form &form, const std::vector<int> &arguments) const;
  void add_gate(const std::string &name, const std::string &unit, const Vector &x, bool is_turned);
  void add_gates();
  double row_s() const;

  const Measured &measured_;
  const Channel &channel_;
  Library out_;
  std::vector<Vector> columns_;
};

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
      fits = !is_own;
      break;
    case ArgumentRole::velocity:
      fits = is_velocity(feature);
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
      fits = feature.is_angle;
      break;
    case ArgumentRole::heading:
      fits = feature.is_angle;
      if (fits && has_word(feature.name, {"heading", "yaw", "theta", "psi"}))
        headings.push_back(f);
      break;
    case ArgumentRole::altitude:
      fits = (feature.unit == "m" || feature.unit == "km") &&
             has_word(feature.name, {"altitude", "height"});
      break;
    case ArgumentRole::own:
      break;
    }
    if (fits)
      chosen.push_back(f);
  }
  if (role == ArgumentRole::own)
    return out_.own;
  return headings.empty() ? chosen : headings;
}

std::vector<std::vector<int>> Builder::assignments(const Form &form) const {
  std::vector<std::vector<int>> out{{}};
  for (const Argument &argument : form.arguments) {
    std::vector<std::vector<int>> longer;
    for (const std::vector<int> &so_far : out) {
      for (const int f : features_for(argument.role)) {
        if (!so_far.empty() && (form.is_unordered ? f <= so_far[0] : f == so_far[0]))
          continue;
        const Vector x = measured_.x.col(f);
        const double mean = x.mean();
        if (std::sqrt((x.array() - mean).square().mean()) < form.least_spread * std::abs(mean))
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
  if (p.quantiles_of.empty()) {
    for (std::size_t k = 0; k < arguments.size(); ++k) {
      const Feature &f = measured_.features[static_cast<std::size_t>(arguments[k])];
      if (p.unit == "m" && f.unit == "km" && form.arguments[k].role == ArgumentRole::altitude)
        std::for_each(out.begin(), out.end(), [](double &v) { v *= 1e-3; });
    }
    return out;
  }
  Vector x = channel_.m;
  if (p.quantiles_of == "abs(m)")
    x = channel_.m.cwiseAbs();
  for (std::size_t k = 0; k < form.arguments.size(); ++k) {
    if (form.arguments[k].name == p.quantiles_of)
      x = measured_.x.col(arguments[k]);
  }
  std::sort(x.data(), x.data() + x.size());
  for (int i = 0; i < p.count; ++i) {
    const double share = p.low_share + (p.high_share - p.low_share) * i / std::max(1, p.count - 1);
    const double level = x(static_cast<Index>(share * static_cast<double>(x.size() - 1)));
    if (out.empty() || level > out.back())
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
    if (!scaled.allFinite() || scaled.squaredNorm() < 1e-18 * static_cast<double>(scaled.size()))
      return false;
  }
  candidate.column = static_cast<int>(columns_.size());
  candidate.columns = static_cast<int>(columns.cols());
  for (Index k = 0; k < columns.cols(); ++k)
    columns_.push_back(columns.col(k).cwiseQuotient(channel_.sd));
  out_.candidates.push_back(std::move(candidate));
  return true;
}

void Builder::add_form(const Form &form) {
  Candidate candidate;
  candidate.is_fixed = form.is_fixed;
  candidate.is_positive = form.is_positive;
  candidate.gate = form.gate;
  candidate.term.channel = channel_.name;
  candidate.term.cause = form.cause;
  candidate.term.form = form.form;
  candidate.term.basis = form.basis;
  std::vector<Candidate> made;
  std::vector<std::vector<int>> made_arguments;
  for (const std::vector<int> &arguments : assignments(form)) {
    Candidate c = candidate;
    for (std::size_t k = 0; k < arguments.size(); ++k)
      c.term.arguments[form.arguments[k].name] =
          measured_.features[static_cast<std::size_t>(arguments[k])].name;
    std::vector<double> values{0.0};
    if (!form.shape.empty())
      values = grid(form.shape[0], form, arguments);
    for (std::size_t v = 0; v < values.size(); ++v) {
      const double value = values[v];
      if (!form.shape.empty()) {
        const ShapeParameter &p = form.shape[0];
        std::string unit = p.unit == "1" ? "" : p.unit;
        if (unit.empty() && p.quantiles_of.find('m') != std::string::npos)
          unit = channel_.unit;
        for (std::size_t k = 0; k < arguments.size(); ++k) {
          if (form.arguments[k].name == p.quantiles_of ||
              (p.unit == "m" && form.arguments[k].role == ArgumentRole::altitude))
            unit = measured_.features[static_cast<std::size_t>(arguments[k])].unit;
        }
        c.term.shape = {{p.name, value, 0.0, unit}};
        // Whole numbers without a unit (harmonics) are not refined.
        if (p.unit != "1") {
          c.shape_low = values[v > 0 ? v - 1 : v];
          c.shape_high = values[std::min(v + 1, values.size() - 1)];
        }
      }
      made.push_back(c);
      made_arguments.push_back(arguments);
    }
  }
  const double ln_alternatives = std::log(std::max<double>(1.0, static_cast<double>(made.size())));
  const double sizes =
      form.is_fixed ? 0.0 : static_cast<double>(std::max<std::size_t>(1, form.basis.size()));
  for (std::size_t i = 0; i < made.size(); ++i) {
    made[i].penalty = 0.5 * sizes * out_.ln_rows + ln_alternatives + form.cost;
    if (add(made[i], basis_columns(made[i].term, measured_, channel_.m)))
      out_.size_units.push_back(unit_of(form, made_arguments[i]));
  }
}

double Builder::row_s() const {
  std::vector<double> steps;
  for (const LogSpan &log : measured_.logs) {
    for (std::size_t i = log.first; i + 1 < log.first + log.rows; ++i)
      steps.push_back(measured_.elapsed_s[i + 1] - measured_.elapsed_s[i]);
  }
  if (steps.empty())
    return 1.0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// The prediction as a polynomial in which each product has a command: m regressed on features,
// squares of commands and products of a command with a feature. Empty when that says too little.
std::map<std::string, double> Builder::response() const {
  struct Product {
    std::string name;
    bool has_command;
  };
  std::vector<Product> products{{"", false}};
  std::vector<Vector> columns{Vector::Ones(channel_.m.size())};
  const int features = static_cast<int>(measured_.features.size());
  bool any_command = false;
  for (int f = 0; f < features; ++f) {
    const Feature &feature = measured_.features[static_cast<std::size_t>(f)];
    products.push_back({feature.name, feature.is_command});
    columns.push_back(measured_.x.col(f));
    any_command = any_command || feature.is_command;
    for (int other = 0; feature.is_command && other < features; ++other) {
      const Feature &second = measured_.features[static_cast<std::size_t>(other)];
      if (second.is_command && other < f)
        continue;
      products.push_back({feature.name + "*" + second.name, true});
      columns.push_back(measured_.x.col(f).cwiseProduct(measured_.x.col(other)));
    }
  }
  std::map<std::string, double> out;
  const auto p = static_cast<Index>(columns.size());
  if (!any_command || channel_.m.size() < 3 * p)
    return out;
  Eigen::MatrixXd gram(p, p);
  Vector scale(p), right(p);
  for (Index k = 0; k < p; ++k) {
    Vector &column = columns[static_cast<std::size_t>(k)];
    scale(k) = std::max(1e-300, column.norm());
    column /= scale(k);
  }
  for (Index k = 0; k < p; ++k) {
    for (Index l = 0; l <= k; ++l)
      gram(k, l) = gram(l, k) =
          columns[static_cast<std::size_t>(k)].dot(columns[static_cast<std::size_t>(l)]);
    right(k) = columns[static_cast<std::size_t>(k)].dot(channel_.m);
  }
  gram.diagonal().array() += 1e-9;
  const Vector beta = gram.ldlt().solve(right);
  Vector fit = Vector::Zero(channel_.m.size());
  for (Index k = 0; k < p; ++k)
    fit += beta(k) * columns[static_cast<std::size_t>(k)];
  const double total = (channel_.m.array() - channel_.m.mean()).square().sum();
  if (!(total > 0.0) || (channel_.m - fit).squaredNorm() > (1.0 - kLeastResponseR2) * total)
    return out;
  for (Index k = 0; k < p; ++k) {
    const Product &product = products[static_cast<std::size_t>(k)];
    if (product.has_command)
      out[product.name] = beta(k) / scale(k);
  }
  return out;
}

void Builder::add_built_in(const Form &form) {
  Candidate candidate;
  candidate.is_fixed = true;
  candidate.term.channel = channel_.name;
  candidate.term.cause = form.cause;
  candidate.term.form = form.form;
  const double row = row_s();
  std::vector<double> values;
  if (form.form == "lag") {
    values = {0.5 * row, row, 2 * row, 3 * row, 5 * row, 8 * row, 13 * row, 20 * row, 40 * row};
  } else {
    for (int k = 1; k <= kMaxLagRows; ++k)
      values.push_back(k * row);
    if (form.form == "delay") {
      candidate.term.response = response();
      if (candidate.term.response.empty())
        return;
    }
  }
  candidate.penalty = std::log(static_cast<double>(values.size())) + 0.5 * out_.ln_rows + form.cost;
  for (std::size_t v = 0; v < values.size(); ++v) {
    const double value = values[v];
    candidate.shape_low = v > 0 ? values[v - 1] : 0.5 * value;
    candidate.shape_high = values[std::min(v + 1, values.size() - 1)];
    candidate.term.shape = {{form.form == "lag" ? "lag" : "delay", value, 0.0, "s"}};
    if (add(candidate, basis_columns(candidate.term, measured_, channel_.m)))
      out_.size_units.push_back("");
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
                       bool is_turned) {
  GateFeature gate;
  gate.name = name;
  gate.unit = unit;
  gate.is_turned = is_turned;
  gate.x = x;
  if (is_turned)
    gate.x = x.unaryExpr([](double a) { return a < 0.0 ? a + kTwoPi : a; });
  cut(gate.x, kFineBins, &gate.fine, &gate.fine_edge);
  cut(gate.x, kCoarseBins, &gate.coarse, &gate.coarse_edge);
  if (gate.fine_bins() >= 2)
    out_.gates.push_back(std::move(gate));
}

void Builder::add_gates() {
  for (std::size_t f = 0; f < measured_.features.size(); ++f) {
    const Feature &feature = measured_.features[f];
    const Vector x = measured_.x.col(static_cast<Index>(f));
    add_gate(feature.name, feature.unit, x, false);
    if (feature.is_angle && x.minCoeff() < 0.0 && x.minCoeff() >= -kPi - 0.01)
      add_gate(feature.name, feature.unit, x, true);
  }
  add_gate(kTime, "s", feature_column(measured_, kTime), false);
}

Library Builder::build(const Catalogue &catalogue) {
  for (const Form &form : catalogue.forms) {
    if (form.kind != TermKind::mean)
      continue;
    if (form.basis.empty())
      add_built_in(form);
    else
      add_form(form);
  }
  out_.g.resize(channel_.m.size(), static_cast<Index>(columns_.size()));
  for (std::size_t k = 0; k < columns_.size(); ++k)
    out_.g.col(static_cast<Index>(k)) = columns_[k];
  add_gates();
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

Library make_library(const Measured &measured, const Channel &channel, const Catalogue &catalogue) {
  return Builder(measured, channel).build(catalogue);
}

void add_bounds(const GateFeature &feature, double lower, double upper, Gate *gate) {
  if (feature.is_turned) {
    if (lower > kPi) {
      lower -= kTwoPi;
      upper -= kTwoPi;
    } else if (upper > kPi) {
      upper -= kTwoPi; // below lower: the interval runs through pi
    }
  }
  gate->features.push_back(feature.name);
  gate->units.push_back(feature.unit);
  gate->lower.push_back(lower);
  gate->upper.push_back(upper);
}

} // namespace rim::diagnose
