// SPDX-License-Identifier: MIT
#include "diagnose/function.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace rim::diagnose {

bool has_width(Fn fn) {
  return fn == Fn::decay || fn == Fn::bell || fn == Fn::sine || fn == Fn::cosine ||
         fn == Fn::step || fn == Fn::growth || fn == Fn::peak || fn == Fn::filling;
}

double cost_of(Fn fn) {
  switch (fn) {
  case Fn::one:
    return 0.0;
  case Fn::square:
  case Fn::magnitude:
  case Fn::inverse:
  case Fn::root:
    return 1.0;
  case Fn::cube:
  case Fn::signed_square:
  case Fn::sign:
  case Fn::inverse_square:
  case Fn::decay:
    return 1.5;
  default:
    return 2.5;
  }
}

bool fits(Fn fn, const FormulaInput &in) {
  if (in.is_angle)
    return fn == Fn::sine || fn == Fn::cosine;
  switch (fn) {
  case Fn::inverse:
  case Fn::inverse_square:
    return !in.is_signed && in.least > 0.0;
  case Fn::magnitude:
  case Fn::signed_square:
  case Fn::sign:
  case Fn::step:
    return in.is_signed;
  default:
    return true;
  }
}

double value_of(Fn fn, const FormulaInput &in, double x, double w) {
  const double size = std::abs(x);
  switch (fn) {
  case Fn::one:
    return x;
  case Fn::square:
    return x * x;
  case Fn::cube:
    return x * x * x;
  case Fn::fourth:
    return x * x * x * x;
  case Fn::root:
    return in.is_signed ? std::copysign(std::sqrt(size), x) : std::sqrt(size);
  case Fn::magnitude:
    return size;
  case Fn::signed_square:
    return x * size;
  case Fn::three_halves:
    return in.is_signed ? x * std::sqrt(size) : size * std::sqrt(size);
  case Fn::inverse:
    return 1.0 / std::max(x, in.least);
  case Fn::inverse_square:
    return 1.0 / std::pow(std::max(x, in.least), 2.0);
  case Fn::sign:
    return (x > 0.0) - (x < 0.0);
  case Fn::decay:
    return std::exp(-size / w);
  case Fn::bell:
    return std::exp(-(x / w) * (x / w));
  case Fn::sine:
    return std::sin(x / w);
  case Fn::cosine:
    return std::cos(x / w);
  case Fn::step:
    return std::tanh(x / w);
  case Fn::growth:
    return std::exp(std::clamp(x / w, -50.0, 50.0));
  case Fn::
      peak: // rises, is largest at w and falls again: eddy currents, a tyre, a motor that slips
    return x * w / (x * x + w * w);
  case Fn::filling: // grows ever less, and is half of its most at w: growth on a substrate
    return x / (size + w);
  }
  return 0.0;
}

std::string text_of(Fn fn, const FormulaInput &in, const std::string &f, const std::string &w,
                    int harmonic) {
  if (harmonic > 0)
    return (fn == Fn::sine ? "sin(" : "cos(") + (harmonic > 1 ? fmt::format("{}*", harmonic) : "") +
           f + (in.in_degrees ? "*_pi/180)" : ")");
  const std::string least = fmt::format("{:.6g}", in.least);
  switch (fn) {
  case Fn::one:
    return f;
  case Fn::square:
    return f + "^2";
  case Fn::cube:
    return f + "^3";
  case Fn::fourth:
    return f + "^4";
  case Fn::root:
    return in.is_signed ? "sign(" + f + ")*sqrt(abs(" + f + "))" : "sqrt(abs(" + f + "))";
  case Fn::magnitude:
    return "abs(" + f + ")";
  case Fn::signed_square:
    return f + "*abs(" + f + ")";
  case Fn::three_halves:
    return in.is_signed ? f + "*sqrt(abs(" + f + "))" : "abs(" + f + ")^1.5";
  case Fn::inverse:
    return "1/max(" + f + "," + least + ")";
  case Fn::inverse_square:
    return "1/max(" + f + "," + least + ")^2";
  case Fn::sign:
    return "sign(" + f + ")";
  case Fn::decay:
    return "exp(-abs(" + f + ")/" + w + ")";
  case Fn::bell:
    return "exp(-(" + f + "/" + w + ")^2)";
  case Fn::sine:
    return "sin(" + f + "/" + w + ")";
  case Fn::cosine:
    return "cos(" + f + "/" + w + ")";
  case Fn::step:
    return "tanh(" + f + "/" + w + ")";
  case Fn::growth:
    return "exp(max(-50,min(50," + f + "/" + w + ")))";
  case Fn::peak:
    return f + "*" + w + "/(" + f + "^2+" + w + "^2)";
  case Fn::filling:
    return f + "/(abs(" + f + ")+" + w + ")";
  }
  return f;
}

} // namespace rim::diagnose
