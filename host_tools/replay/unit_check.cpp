// SPDX-License-Identifier: MIT
#include "replay/unit_check.hpp"

#include <algorithm>
#include <cmath>

#include "log/units.hpp"

namespace rim {

namespace {

constexpr std::size_t kLeastBlocks = 10;
constexpr double kAlike = 0.1;     // by which a factor may differ from that of a unit
constexpr double kApart = 0.22;    // ln: feet per second and km/h differ by no more than a gain may
constexpr double kLeftOver = 0.10; // share of the readings' squares that the factor may leave
// Of what lies between the beginnings of two scales: how far the mean reading may be from it, and
// how much single blocks may scatter.
constexpr double kNearZero = 0.05, kScatterZero = 0.1;

// The unit beside which readings in `unit` are taken for `factor` times as much; NULL: none.
const char *unit_instead(const std::string &unit, double factor) {
  const Unit *own = find_unit(unit);
  if (own == nullptr)
    return nullptr;
  for (const Unit &other : known_units()) {
    const double ratio = own->value / other.value;
    if (own->kind == std::string(other.kind) && own->zero == other.zero &&
        std::abs(std::log(ratio)) > kApart && std::abs(factor / ratio - 1.0) < kAlike)
      return other.text;
  }
  return nullptr;
}

// Whether a mean and its scatter (sd) are what lies between the beginnings of two scales.
bool is_between(double mean, double scatter, double more) {
  return std::abs(mean - more) < kNearZero * std::abs(more) &&
         scatter < kScatterZero * std::abs(more);
}

} // namespace

void UnitCheck::add(const Eigen::VectorXd &measured, const Eigen::VectorXd &expected) {
  for (std::size_t o = 0; o < sums_.size(); ++o) {
    const double m = measured[static_cast<Eigen::Index>(o)];
    const double e = expected[static_cast<Eigen::Index>(o)];
    sums_[o].readings += m * m;
    sums_[o].products += m * e;
    sums_[o].expected += e * e;
    sums_[o].reading += m;
    sums_[o].expectation += e;
  }
  ++blocks_;
}

std::optional<OtherUnit> UnitCheck::scale_that_begins_elsewhere(std::size_t outcome,
                                                                const std::string &unit) const {
  const Unit *own = find_unit(unit);
  if (own == nullptr)
    return {};
  const Sums &s = sums_[outcome];
  const auto n = static_cast<double>(blocks_);
  for (const Unit &other : known_units()) {
    if (own->kind != std::string(other.kind) || own->zero == other.zero)
      continue;
    const double factor = own->value / other.value, more = (own->zero - other.zero) / other.value;
    const double mean = (s.reading - factor * s.expectation) / n;
    const double square =
        (s.readings - 2.0 * factor * s.products + factor * factor * s.expected) / n;
    if (is_between(mean, std::sqrt(std::max(square - mean * mean, 0.0)), more))
      return OtherUnit{outcome, factor, mean, other.text};
  }
  return {};
}

std::vector<OtherUnit> UnitCheck::found(const Names &names) const {
  std::vector<OtherUnit> others;
  for (std::size_t o = 0; o < sums_.size() && blocks_ >= kLeastBlocks; ++o) {
    const Sums &s = sums_[o];
    const std::string unit = names.outcome(static_cast<std::uint16_t>(o)).unit;
    if (const std::optional<OtherUnit> other = scale_that_begins_elsewhere(o, unit)) {
      others.push_back(*other);
      continue;
    }
    // Of the changes as well: what a first reading in another unit feigns may shift all others.
    const auto n = static_cast<double>(blocks_);
    const double squares[][3] = {{s.readings, s.products, s.expected},
                                 {s.readings - s.reading * s.reading / n,
                                  s.products - s.reading * s.expectation / n,
                                  s.expected - s.expectation * s.expectation / n}};
    for (const auto &[readings, products, expected] : squares) {
      const double factor = products / expected, left = readings - factor * products;
      const char *other = std::isfinite(factor) && left <= kLeftOver * readings
                              ? unit_instead(unit, factor)
                              : nullptr;
      if (other == nullptr)
        continue;
      others.push_back({o, factor, 0.0, other});
      break;
    }
  }
  return others;
}

} // namespace rim
