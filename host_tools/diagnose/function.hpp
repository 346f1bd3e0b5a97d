// SPDX-License-Identifier: MIT
// diagnose/function.hpp - the functions of one feature that formulas are made of (expression.hpp).
#pragma once

#include <string>

namespace rim::diagnose {

// A function of one feature x, with a width w where it has one.
enum class Fn {
  one,
  square,
  cube,
  fourth,
  root,
  magnitude,
  signed_square,
  three_halves,
  inverse,
  inverse_square,
  sign,
  decay,
  bell,
  sine,
  cosine,
  step,
  growth,
  peak,
  filling
};
// The plainest first.
inline constexpr Fn kFunctions[] = {Fn::one,    Fn::square,         Fn::magnitude, Fn::inverse,
                                    Fn::root,   Fn::signed_square,  Fn::cube,      Fn::sign,
                                    Fn::decay,  Fn::inverse_square, Fn::sine,      Fn::cosine,
                                    Fn::fourth, Fn::three_halves,   Fn::bell,      Fn::step,
                                    Fn::growth, Fn::peak,           Fn::filling};

// What a feature is: always above none, or of both signs, or an angle.
struct FormulaInput {
  int feature = 0;
  bool is_signed = false;
  bool is_angle = false, turns = false; // it wraps; its sine may act (roles.hpp)
  bool in_degrees = false;              // an angle that is
  bool is_own = false;                  // the channel's own prediction: `m`, moved by a delay
  bool hardly_varies = false;           // beside its mean
  double least = 0.0, scale = 1.0;      // half its smallest value; root of its mean square
};

// Whether it has a width, in the unit of its feature.
bool has_width(Fn fn);
// Nats that it takes to name it.
double cost_of(Fn fn);
// Whether it is defined, and means something, over such a feature.
bool fits(Fn fn, const FormulaInput &in);
// Its value at x, with the width w > 0 where it has one. Finite for a finite x.
double value_of(Fn fn, const FormulaInput &in, double x, double w);
// For muParser: f the placeholder, w the name of the width; harmonic: so often a turn, in place
// of a width, where it is above 0.
std::string text_of(Fn fn, const FormulaInput &in, const std::string &f, const std::string &w,
                    int harmonic);

} // namespace rim::diagnose
