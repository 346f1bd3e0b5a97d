// SPDX-License-Identifier: MIT
#include "diagnose/term.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>

#include <fmt/format.h>
#include <muParser.h>

#include "diagnose/late.hpp"
#include "diagnose/swing.hpp"
#include "util/error.hpp"

namespace rim::diagnose {

namespace {

using Index = Eigen::Index;

// Of a feature's name, before a number: seconds ago, a lag, a reach.
constexpr const char *kMarks = "@~%";

Vector time_column(const Measured &measured) {
  return Eigen::Map<const Vector>(measured.elapsed_s.data(),
                                  static_cast<Index>(measured.elapsed_s.size()));
}

std::string strip(const std::string &name) {
  if (name == kTime)
    return "elapsed time";
  const std::string bare = plain_name(base_feature(name));
  const bool says_so = bare.rfind("cmd", 0) == 0 || bare.rfind("command", 0) == 0;
  if (name.rfind("m.", 0) == 0)
    return "predicted " + bare;
  const std::string late = late_text(name);
  if (late.empty())
    return name.rfind("u.", 0) == 0 && !says_so ? "commanded " + bare : bare;
  return bare + " " + late;
}

// Four significant digits; no exponent below ten million.
std::string number_text(double value) {
  const double size = std::abs(value);
  if (size < 1e4 || size >= 1e7)
    return fmt::format("{:.4g}", value);
  const double unit = std::pow(10.0, std::floor(std::log10(size)) - 3.0);
  return fmt::format("{:.0f}", std::round(value / unit) * unit);
}

double shape_of(const Term &term, const std::string &name) {
  for (const Parameter &p : term.shape) {
    if (p.name == name)
      return p.value;
  }
  throw DataError(fmt::format("form '{}': parameter '{}' is missing", term.form, name));
}

// Without a response: the prediction itself is what comes late.
bool is_bare(const Term &term) { return term.response.empty() && term.ridges.empty(); }

Vector table_column(const Term &term, const Measured &measured) {
  if (term.arguments.empty() || term.knots.size() < 2 || term.knots.size() != term.values.size())
    throw DataError("form 'table': needs an argument, and as many values as knots, at least two");
  const Vector x = feature_column(measured, term.arguments.begin()->second);
  Vector out(x.size());
  for (Index i = 0; i < x.size(); ++i) {
    const auto above = std::upper_bound(term.knots.begin(), term.knots.end(), x(i));
    if (above == term.knots.begin()) {
      out(i) = term.values.front();
    } else if (above == term.knots.end()) {
      out(i) = term.values.back();
    } else {
      const auto k = static_cast<std::size_t>(above - term.knots.begin());
      const double share = (x(i) - term.knots[k - 1]) / (term.knots[k] - term.knots[k - 1]);
      out(i) = term.values[k - 1] + share * (term.values[k] - term.values[k - 1]);
    }
  }
  return out;
}

Vector evaluate(const std::string &expression, const Term &term, const Measured &measured,
                const Vector &m) {
  // Row by row: muParser's bulk mode starts threads of its own, which stand in each other's way.
  std::vector<Vector> columns{m, time_column(measured)};
  std::vector<std::string> names{"m", "t"};
  for (const auto &[name, feature] : term.arguments) {
    names.push_back(name);
    columns.push_back(feature_column(measured, feature));
  }
  std::vector<double> now(columns.size(), 0.0);
  mu::Parser parser;
  Vector out(m.size());
  try {
    for (std::size_t k = 0; k < now.size(); ++k)
      parser.DefineVar(names[k], &now[k]);
    for (const Parameter &p : term.shape)
      parser.DefineConst(p.name, p.value);
    parser.SetExpr(expression);
    for (Index i = 0; i < m.size(); ++i) {
      for (std::size_t k = 0; k < now.size(); ++k)
        now[k] = columns[k](i);
      out(i) = parser.Eval();
    }
  } catch (const mu::Parser::exception_type &e) {
    throw DataError(
        fmt::format("form '{}': expression '{}': {}", term.form, expression, e.GetMsg()));
  }
  if (!out.allFinite())
    throw DataError(
        fmt::format("form '{}': expression '{}' is not finite everywhere", term.form, expression));
  return out;
}

// The name of an argument within the term's expression: with its unit where another argument would
// have the same one, as the angle and the speed of one joint.
std::string argument_text(const std::string &feature, const Term &term) {
  std::string name = strip(feature);
  const bool is_twice =
      std::any_of(term.arguments.begin(), term.arguments.end(), [&](const auto &other) {
        return other.second != feature && strip(other.second) == name;
      });
  const std::size_t prefix = feature.find('.');
  if (is_twice && late_text(feature).empty() && prefix == 1)
    name = (feature[0] == 'u'   ? "commanded "
            : feature[0] == 'm' ? "predicted "
                                : "") +
           feature.substr(prefix + 1);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

// Expression with arguments and shape parameters replaced by what they stand for.
std::string substituted(const std::string &expression, const Term &term) {
  std::string out;
  for (std::size_t i = 0; i < expression.size();) {
    if (std::isalpha(static_cast<unsigned char>(expression[i])) == 0 && expression[i] != '_') {
      out += expression[i++];
      continue;
    }
    std::size_t end = i;
    while (
        end < expression.size() &&
        (std::isalnum(static_cast<unsigned char>(expression[end])) != 0 || expression[end] == '_'))
      ++end;
    const std::string word = expression.substr(i, end - i);
    i = end;
    const auto argument = term.arguments.find(word);
    const auto is_it = [&word](const Parameter &p) { return p.name == word; };
    const auto parameter = std::find_if(term.shape.begin(), term.shape.end(), is_it);
    if (argument != term.arguments.end()) {
      out += argument_text(argument->second, term);
    } else if (parameter != term.shape.end()) {
      out += number_text(parameter->value);
    } else {
      out += word == "m" ? "prediction" : word == "_pi" ? "pi" : word;
    }
  }
  return out;
}

} // namespace

Vector feature_column(const Measured &measured, const std::string &name) {
  if (name == kTime)
    return time_column(measured);
  const int exact = measured.find_feature(name);
  if (exact >= 0)
    return measured.x.col(exact);
  if (measured.whole != nullptr)
    return feature_column(*measured.whole, name)(measured.picked);
  const int f = measured.find_feature(base_feature(name));
  if (f < 0)
    throw DataError("there is no feature '" + base_feature(name) + "' in the logs");
  Vector x = measured.x.col(f);
  const char *at = name.c_str() + base_feature(name).size();
  while (*at != '\0') {
    char *end = nullptr;
    const double number = std::strtod(at + 1, &end);
    if (std::string(kMarks).find(*at) == std::string::npos || end == at + 1 || !(number >= 0.0))
      throw DataError("feature '" + name +
                      "': what follows @ or ~ must be seconds, and what follows % a reach");
    x = *at == '@'   ? delayed(x, measured, number)
        : *at == '~' ? through_lag(x, measured, number)
                     : held_within(x, measured, number);
    at = end;
  }
  return x;
}

std::string late_text(const std::string &name) {
  std::string text;
  for (std::size_t at = base_feature(name).size(); at < name.size();) {
    const std::size_t end = std::min(name.find_first_of(kMarks, at + 1), name.size());
    const std::string number = name.substr(at + 1, end - at - 1);
    text += (text.empty() ? "" : " ") + (name[at] == '@'   ? number + " s ago"
                                         : name[at] == '~' ? "lagged by " + number + " s"
                                                           : "held within " + number);
    at = end;
  }
  return text;
}

std::string base_feature(const std::string &name) {
  return name.substr(0, name.find_first_of(kMarks));
}

bool is_late_form(const std::string &form) {
  static const std::set<std::string> late{"delay",       "delay_reading", "delay_length", "lag",
                                          "lag_command", "lag_delay",     "lag_length"};
  return late.count(form) > 0;
}

bool has_no_expression(const std::string &form) {
  return is_late_form(form) || form == kBacklash || form == kPeriodicTime;
}

namespace {

bool stands_before(const Term &term) {
  return term.form == kDeadZoneBefore || term.form == kSaturationBefore;
}

// What comes late, and by how much: a time, or a length at a speed.
std::string late_text_of(const Term &term) {
  const Parameter *level = level_before(term);
  const std::string what =
      !is_bare(term) ? "the command"
      : level != nullptr
          ? "what the " + std::string(level->name == kUpTo ? "saturation" : "dead zone") + " leaves"
      : term.arguments.count("s") > 0 ? "the predicted change"
                                      : "the prediction";
  const auto shape = [&term](const char *name) {
    return std::find_if(term.shape.begin(), term.shape.end(),
                        [name](const Parameter &p) { return p.name == name; });
  };
  const bool is_delay = term.form.rfind("delay", 0) == 0;
  const Parameter &by =
      *shape(is_delay ? "delay" : "lag"); // reading a term checks that it is there
  const auto along = term.arguments.find(kAlong);
  const std::string length =
      along == term.arguments.end()
          ? ""
          : fmt::format("{:.3g}{} at {}", by.value, by.unit.empty() ? "" : " " + by.unit,
                        strip(along->second));
  if (is_delay)
    return length.empty() ? fmt::format("{} of {:.3g} s ago in place of now's", what, by.value)
                          : what + " of " + length + " before, in place of now's";
  const auto before = shape("delay");
  const double delay = before != term.shape.end() ? before->value : 0.0;
  const std::string ago = delay > 0.0 ? fmt::format(" of {:.3g} s ago", delay) : "";
  return what + ago + " through a first-order lag " +
         (length.empty() ? fmt::format("of {:.3g} s", by.value) : "over " + length);
}

} // namespace

bool moves_prediction(const Term &term) {
  return term.kind == TermKind::mean &&
         (stands_before(term) || (term.basis.empty() && is_late_form(term.form)));
}

bool is_by_direction(const Term &term) {
  static const std::string kEnd = "_by_direction";
  return term.basis.size() == 2 && term.form.size() > kEnd.size() &&
         term.form.compare(term.form.size() - kEnd.size(), kEnd.size(), kEnd) == 0;
}

bool is_level_before(const Parameter &p) { return p.name == kBeyond || p.name == kUpTo; }

const Parameter *level_before(const Term &term) {
  const auto found = std::find_if(term.shape.begin(), term.shape.end(), is_level_before);
  return is_late_form(term.form) && found != term.shape.end() ? &*found : nullptr;
}

Vector after_level(const Vector &x, const Parameter *level) {
  if (level == nullptr)
    return x;
  const Vector within = x.cwiseMax(-level->value).cwiseMin(level->value);
  return level->name == kUpTo ? within : Vector(x - within);
}

bool remembers(const Term &term) {
  return term.form == kBacklash || (moves_prediction(term) && !stands_before(term));
}

bool is_swing(const Term &term) { return term.form == kPeriodicTime; }

bool is_level(const Term &term) { return term.cause == "saturation" || term.cause == "dead_zone"; }

Vector ridge_values(const Ridge &ridge, const Vector &s) {
  const auto last = ridge.knots.size() - 1;
  const double step = (ridge.knots[last] - ridge.knots[0]) / static_cast<double>(last);
  Vector out(s.size());
  for (Index i = 0; i < s.size(); ++i) {
    const double at = (s(i) - ridge.knots[0]) / step;
    const auto k =
        static_cast<std::size_t>(std::clamp(std::floor(at), 0.0, static_cast<double>(last) - 1.0));
    out(i) =
        ridge.values[k] + (at - static_cast<double>(k)) * (ridge.values[k + 1] - ridge.values[k]);
  }
  return out;
}

Vector gate_mask(const Gate &gate, const Measured &measured) {
  Vector inside = Vector::Ones(static_cast<Index>(measured.rows()));
  const std::size_t d = gate.features.size();
  if (d == 0)
    return inside;
  if (gate.is_ellipse) {
    Eigen::MatrixXd x(inside.size(), static_cast<Index>(d));
    for (std::size_t k = 0; k < d; ++k)
      x.col(static_cast<Index>(k)) =
          feature_column(measured, gate.features[k]).array() - gate.center[k];
    const Eigen::Map<const Matrix> a(gate.inverse_shape.data(), static_cast<Index>(d),
                                     static_cast<Index>(d));
    return ((x * a).cwiseProduct(x).rowwise().sum().array() < 1.0).cast<double>();
  }
  for (std::size_t k = 0; k < d; ++k) {
    const Vector x = feature_column(measured, gate.features[k]);
    for (Index i = 0; i < x.size(); ++i) {
      const bool is_above = gate.is_open(k, false) || x(i) >= gate.lower[k],
                 is_below = gate.is_open(k, true) || x(i) <= gate.upper[k];
      const bool wraps = gate.lower[k] > gate.upper[k];
      if (wraps ? !(is_above || is_below) : !(is_above && is_below))
        inside(i) = 0.0;
    }
  }
  return inside;
}

Eigen::MatrixXd basis_columns(const Term &term, const Measured &measured, const Vector &m) {
  if (term.form == "table")
    return table_column(term, measured);
  if (term.basis.empty()) {
    if (remembers(term))
      return late_columns(term, {term.shape}, measured, m);
    if (is_swing(term))
      return swing_column(term, measured);
    throw DataError(fmt::format("form '{}' has no expression", term.form));
  }
  Eigen::MatrixXd columns(m.size(), static_cast<Index>(term.basis.size()));
  for (std::size_t k = 0; k < term.basis.size(); ++k)
    columns.col(static_cast<Index>(k)) = evaluate(term.basis[k], term, measured, m);
  return columns;
}

Vector log_mask(const Term &term, const Measured &measured) {
  Vector mask = Vector::Ones(static_cast<Index>(measured.rows()));
  for (const LogSpan &log : measured.logs) {
    if (!term.logs.empty() &&
        std::find(term.logs.begin(), term.logs.end(), log.path) == term.logs.end())
      mask.segment(static_cast<Index>(log.first), static_cast<Index>(log.rows)).setZero();
  }
  return mask;
}

Vector mean_effect(const Term &term, const Measured &measured, const Vector &m) {
  if (term.kind != TermKind::mean)
    return Vector::Zero(m.size());
  const Eigen::MatrixXd columns = basis_columns(term, measured, m);
  Vector effect = Vector::Zero(m.size());
  for (Index k = 0; k < columns.cols(); ++k) {
    const auto at = static_cast<std::size_t>(k);
    effect += (at < term.sizes.size() ? term.sizes[at].value : 1.0) * columns.col(k);
  }
  effect = effect.cwiseProduct(gate_mask(term.gate, measured));
  if (!term.logs.empty())
    effect = effect.cwiseProduct(log_mask(term, measured));
  return term.support.everywhere() ? effect
                                   : effect.cwiseProduct(gate_mask(term.support, measured));
}

std::string expression_text(const Term &term) {
  switch (term.kind) {
  case TermKind::stuck:
    return "the reading repeats itself";
  case TermKind::dropout:
    return "the reading is exactly 0";
  case TermKind::variance:
    return fmt::format("{:.3g} * variance", term.sizes.empty() ? 1.0 : term.sizes[0].value);
  case TermKind::mean:
    break;
  }
  if (term.form == "table")
    return "table of " + std::to_string(term.knots.size()) + " values over " +
           strip(term.arguments.begin()->second);
  if (remembers(term) && term.form != kBacklash)
    return late_text_of(term);
  if (is_swing(term))
    return fmt::format("{} * sin(2*pi*t/{} + phase)",
                       number_text(term.sizes.empty() ? 1.0 : term.sizes[0].value),
                       number_text(shape_of(term, "period")));
  if (term.form == kBacklash)
    return fmt::format("the prediction through play of {:.3g}", shape_of(term, "play"));
  std::string text;
  for (std::size_t k = 0; k < term.basis.size(); ++k) {
    const double size = k < term.sizes.size() ? term.sizes[k].value : 1.0;
    const std::string factor = substituted(term.basis[k], term);
    if (k > 0)
      text += size < 0.0 ? " - " : " + ";
    text += number_text(k > 0 ? std::abs(size) : size);
    if (factor != "1")
      text +=
          " * " + (term.basis[k].find_first_of("+-", 1) == std::string::npos || factor.back() == ')'
                       ? factor
                       : "(" + factor + ")");
  }
  return text;
}

namespace {

// "12.1 to 38.4 m"; "above 12.1 m (seen to 38.4)" where the end of the data is no edge.
std::string bounds_text(const Gate &gate, std::size_t k) {
  const std::string unit =
      k < gate.units.size() && !gate.units[k].empty() ? " " + gate.units[k] : "";
  const std::string low = number_text(gate.lower[k]), high = number_text(gate.upper[k]);
  const bool is_low = !gate.is_open(k, false) && std::isfinite(gate.lower[k]),
             is_high = !gate.is_open(k, true) && std::isfinite(gate.upper[k]);
  if (gate.lower[k] > gate.upper[k])
    return "above " + low + " or below " + high + unit;
  if (is_low && is_high)
    return low + " to " + high + unit;
  if (is_low)
    return "above " + low + unit + (std::isfinite(gate.upper[k]) ? " (seen to " + high + ")" : "");
  if (is_high)
    return "below " + high + unit +
           (std::isfinite(gate.lower[k]) ? " (seen from " + low + ")" : "");
  return "anywhere";
}

} // namespace

std::string gate_text(const Gate &gate) {
  std::string text;
  for (std::size_t k = 0; k < gate.features.size(); ++k) {
    if (k > 0)
      text += k + 1 == gate.features.size() ? " and " : ", ";
    text += strip(gate.features[k]) + " " + bounds_text(gate, k);
  }
  return gate.is_ellipse && gate.features.size() > 1 ? "the ellipse " + text : text;
}

namespace {

// The prediction that the channel's delays and lags make.
Vector moved_prediction(const std::vector<Term> &terms, const Channel &channel,
                        const Measured &measured) {
  Vector m = channel.m;
  for (const Term &term : terms) {
    if (term.channel == channel.name && moves_prediction(term))
      m += mean_effect(term, measured, channel.m);
  }
  return m;
}

} // namespace

Vector effect_beside(const Term &term, const std::vector<Term> &terms, const Channel &channel,
                     const Measured &measured) {
  return mean_effect(term, measured,
                     moves_prediction(term) ? channel.m
                                            : moved_prediction(terms, channel, measured));
}

Prediction extended_prediction(const std::vector<Term> &terms, const Channel &channel,
                               const Measured &measured) {
  Prediction out{moved_prediction(terms, channel, measured), channel.sd};
  const Vector seen = out.m;
  for (const Term &term : terms) {
    if (term.channel != channel.name)
      continue;
    if (is_swing(term) && !term.sizes.empty()) {
      out.m += mean_effect(term, measured, seen);
      const Parameter &size = term.sizes[0];
      const double mean_square =
          0.5 * (size.value * size.value + size.between_logs_sd * size.between_logs_sd);
      out.sd =
          (out.sd.array().square() + mean_square * (1.0 - log_mask(term, measured).array())).sqrt();
    } else if (term.kind == TermKind::mean && !moves_prediction(term)) {
      const Vector effect = mean_effect(term, measured, seen);
      if (term.sizes.empty() || term.sizes[0].per_log.empty()) {
        out.m += effect;
        continue;
      }
      // A log that was not fitted has a size of its own: it is as wide as these differ.
      const Parameter &size = term.sizes[0];
      const double whole = std::copysign(std::max(1e-300, std::abs(size.value)), size.value);
      const double off = size.value - size.new_log;
      const double wide = std::hypot(size.between_logs_sd, size.stderror, off) / whole;
      out.m += size.new_log / whole * effect;
      out.sd = (out.sd.array().square() + (wide * effect.array()).square()).sqrt();
    }
    if (term.kind == TermKind::variance && !term.sizes.empty()) {
      const double factor = std::sqrt(std::max(1e-6, term.sizes[0].value)) - 1.0;
      out.sd.array() *= 1.0 + factor * gate_mask(term.gate, measured).array();
    }
  }
  return out;
}

} // namespace rim::diagnose
