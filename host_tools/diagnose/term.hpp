// SPDX-License-Identifier: MIT
// diagnose/term.hpp - one term of an extended model: what is added to the prediction of a channel,
// where.
//
// A mean term adds sum_k size_k basis_k(arguments, shape) to m inside its gate; a variance term
// multiplies the variance by `ratio`; a sensor term (stuck, dropout) says which rows are no
// measurements. Thesis 7.2.5: what is wrong (the form) apart from where (the region, eq. 3.8).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "diagnose/measured.hpp"

namespace rim::diagnose {

// The name by which gates and arguments mean the seconds since a log began.
inline constexpr const char *kTime = "t_s";

// The built-in form of play: the outcome stays until the prediction has moved by it.
inline constexpr const char *kBacklash = "backlash";

// What comes late may be what a dead zone or saturation leaves of the prediction: a delay or lag
// then has a shape parameter kBeyond or kUpTo, the level, and stands beside a term of the form
// kDeadZoneBefore or kSaturationBefore.
inline constexpr const char *kBeyond = "dead_zone", *kDeadZoneBefore = "dead_zone_before";
inline constexpr const char *kUpTo = "saturation", *kSaturationBefore = "saturation_before";

// A coupling whose argument comes through a first-order lag: "u.current~12".
inline constexpr const char *kLaggedCoupling = "coupling_lag";
// Of this form the second size has the sign of the first: less friction near rest would be the
// width over again.
inline constexpr const char *kSmoothStribeck = "stribeck_smooth";
// A form whose argument is what is held of a quantity: "x.stroke_m%0.003".
inline constexpr const char *kHysteresis = "hysteresis";
// The form of a square of a quantity.
inline constexpr const char *kSquare = "square";

// A form that is periodic in time: amplitude * sin(2 pi t / period + phase), t since the log began.
// Of a term that names logs the phase is each log's own, and it is not known in another.
inline constexpr const char *kPeriodicTime = "periodic_time";

// The argument of what comes late by a length instead of a time, as the force of a tyre does: the
// speed at which that length is passed. The form's name then ends in "_length".
inline constexpr const char *kAlong = "along";

// A term acts on a row where it adds at least so many stated sd.
inline constexpr double kActs = 0.1;

// Where a term acts; no features: everywhere. A box, or the ellipsoid (x-u)' A^-1 (x-u) < 1 (eq.
// 3.8, p. 29) inscribed in the box that lower and upper then are. Closed bounds. On an angle
// (Feature::is_angle) lower may exceed upper: the interval then runs through the end of the turn.
struct Gate {
  std::vector<std::string> features;
  std::vector<std::string> units;
  std::vector<double> lower, upper; // in the features' units
  bool is_ellipse = false;
  std::vector<double> center;        // one a feature (of the box: its middle)
  std::vector<double> inverse_shape; // features^2 by rows (of a box: the inscribed ellipsoid's)
  // Of a box: the bound is only the end of the data, and is not applied. Empty: none is.
  std::vector<bool> open_lower{}, open_upper{};

  bool is_open(std::size_t k, bool above) const {
    const std::vector<bool> &open = above ? open_upper : open_lower;
    return k < open.size() && open[k];
  }

  bool everywhere() const { return features.empty(); }
};

enum class TermKind { mean, variance, stuck, dropout };

struct Parameter {
  std::string name; // "size", "level", "delay"
  double value = 0.0;
  double stderror = 0.0; // 0: not fitted
  std::string unit;      // "1/m"; empty: none
  // Where it differs between the logs: its spread between them, and each log's own. The value is
  // then the mean, the standard error that of the mean.
  double between_logs_sd = 0.0;
  std::vector<double> per_log{};
  double new_log = 0.0; // what a log that was not fitted is predicted with: at most the mean
  // What it would be without the terms that refine the same law; 0: there are none.
  double unrefined = 0.0;
  // Of a friction that bends with the speed: what it is near rest; 0: it does not.
  double near_rest = 0.0;
};

// A curve over a weighted sum of features: piecewise linear, going on straight beyond its ends.
struct Ridge {
  std::map<std::string, double> weights; // feature name -> weight
  std::vector<double> knots, values;     // of the sum; knots equally spaced
};

struct Term {
  std::string channel; // Channel::name
  std::string cause;   // the name claimed: "quadratic_drag", "unknown"
  std::string form;    // the catalogue's form, or "table" for the smooth correction of `unknown`
  TermKind kind = TermKind::mean;
  // Expressions over the placeholders, `m` (the prediction), `t` (seconds since the log began) and
  // the shape parameters: "v*abs(v)". Empty for the built-in forms table, delay, backlash, stuck,
  // dropout.
  std::vector<std::string> basis;
  // Placeholder -> feature name; of a delay or lag "s": the reading that the prediction starts
  // from, where it is the change within a row that comes late.
  std::map<std::string, std::string> arguments;
  std::vector<Parameter> sizes; // one a basis; variance: "ratio"
  std::vector<Parameter> shape; // level of a hinge, scale height, delay ...
  // table: piecewise linear in one argument, constant beyond the ends.
  std::vector<double> knots, values;
  // delay: the prediction as a polynomial of commands and state, product name ("u.a", "u.a*s.b")
  // -> coefficient. The term adds response(u(t - delay)) - response(u(t)).
  std::map<std::string, double> response;
  std::vector<Ridge> ridges; // more of the response: limits of command and state
  Gate gate;
  std::vector<std::string> logs; // paths of those in which it acts; empty: in all
  // Bounding box of the fitted rows, in features of which they cover only a small part. Outside it
  // the term is zero. The box is not part of the claim.
  Gate support;
};

// The column of a feature, or of kTime; "u.speed_mps@0.2": of 0.2 s ago in the same log;
// "u.speed_mps~0.2": through a first-order lag of 0.2 s; "u.speed_mps@0.2~0.1": the one and then
// the other; "x.stroke_m%0.003": what many small springs keep of it that slip when they are drawn
// by 0.003 or less. DataError when there is none.
Vector feature_column(const Measured &measured, const std::string &name);

// 1 where the row lies in the gate, else 0. DataError when a feature is not in the table.
Vector gate_mask(const Gate &gate, const Measured &measured);

// 1 where the row's log is one of the term's, else 0.
Vector log_mask(const Term &term, const Measured &measured);

// The curve at the sums s.
Vector ridge_values(const Ridge &ridge, const Vector &s);

// basis functions of a mean term, rows x max(1, basis.size()), without gate or size; of table,
// delay and fixed forms the one column that is added. `m` is the prediction that the expressions
// see. DataError: an argument is not in the table, an expression does not parse.
Eigen::MatrixXd basis_columns(const Term &term, const Measured &measured, const Vector &m);

// "u.speed_mps" of "u.speed_mps@0.2", "u.speed_mps~0.2" or "u.speed_mps%0.2"; other names as they
// are.
std::string base_feature(const std::string &name);
// "0.2 s ago lagged by 0.1 s" of "u.speed_mps@0.2~0.1", "held within 0.2" of "u.speed_mps%0.2";
// empty of a feature as it is.
std::string late_text(const std::string &name);
// Whether a form is one of the late commands, which the program computes instead of an expression:
// "delay", "delay_reading", "lag", "lag_command" or "lag_delay"; "delay_length" or "lag_length".
bool is_late_form(const std::string &form);
// Whether the program computes a form instead of an expression: those, and "backlash".
bool has_no_expression(const std::string &form);
// Whether what follows the term sees its effect as part of the prediction.
bool moves_prediction(const Term &term);
// Whether a shape parameter is the level of what stands before what comes late.
bool is_level_before(const Parameter &p);
// Whether a resistance has a second size, by which it is more in one direction than in the other.
bool is_by_direction(const Term &term);
// That of the term, or none.
const Parameter *level_before(const Term &term);
// What a dead zone or saturation of this level leaves of x; all of it where there is no level.
Vector after_level(const Vector &x, const Parameter *level);
// A delay, a lag or play: what the term adds depends on the predictions before.
bool remembers(const Term &term);

// Whether it is periodic in time.
bool is_swing(const Term &term);

// Whether it is a level of the prediction, at which that ends or begins: saturation, a dead zone.
bool is_level(const Term &term);

// What the term adds to m, in the channel's unit; zero for other kinds.
Vector mean_effect(const Term &term, const Measured &measured, const Vector &m);

// What the term adds beside `terms`, of which it may be one: a delay or lag acts on m, the others
// on the prediction that the channel's delays and lags make (extended_prediction). Zero for other
// kinds.
Vector effect_beside(const Term &term, const std::vector<Term> &terms, const Channel &channel,
                     const Measured &measured);

// "-0.0021 * v * |v|, v = speed": sizes put in, arguments by their plain names.
std::string expression_text(const Term &term);
// "altitude 12.1 to 38.4 km and speed ...": empty when everywhere.
std::string gate_text(const Gate &gate);

// The channel's prediction with all its terms: m plus every mean term, sd times the root of every
// variance ratio, and wider by what a size that differs between logs may differ by, and by what
// swings where its phase is not known. A delay or lag comes first, and the others see the
// prediction that it makes as `m`. Terms of other channels are ignored.
struct Prediction {
  Vector m, sd;
};
Prediction extended_prediction(const std::vector<Term> &terms, const Channel &channel,
                               const Measured &measured);

} // namespace rim::diagnose
