// SPDX-License-Identifier: MIT
#include "replay/unit_check.hpp"

#include <cmath>

#include "log/units.hpp"

namespace rim {

namespace {

constexpr std::size_t kLeastBlocks = 10;
constexpr double kAlike = 0.1;     // by which a factor may differ from that of a unit
constexpr double kApart = 0.22;    // ln: feet per second and km/h differ by no more than a gain may
constexpr double kLeftOver = 0.10; // share of the readings' squares that the factor may leave

// The unit beside which readings in `unit` are taken for `factor` times as much; NULL: none.
const char *unit_instead(const std::string &unit, double factor) {
  const Unit *own = find_unit(unit);
  if (own == nullptr)
    return nullptr;
  for (const Unit &other : known_units()) {
    const double ratio = own->value / other.value;
    if (own->kind == std::string(other.kind) && std::abs(std::log(ratio)) > kApart &&
        std::abs(factor / ratio - 1.0) < kAlike)
      return other.text;
  }
  return nullptr;
}

} // namespace

void UnitCheck::add(const Eigen::VectorXd &measured, const Eigen::VectorXd &expected) {
  for (std::size_t o = 0; o < sums_.size(); ++o) {
    const double m = measured[static_cast<Eigen::Index>(o)];
    const double e = expected[static_cast<Eigen::Index>(o)];
    sums_[o].readings += m * m;
    sums_[o].products += m * e;
    sums_[o].expected += e * e;
  }
  ++blocks_;
}

std::vector<OtherUnit> UnitCheck::found(const Names &names) const {
  std::vector<OtherUnit> others;
  for (std::size_t o = 0; o < sums_.size() && blocks_ >= kLeastBlocks; ++o) {
    const Sums &s = sums_[o];
    const double factor = s.products / s.expected;
    const double left = s.readings - factor * s.products;
    if (!std::isfinite(factor) || !(left <= kLeftOver * s.readings))
      continue;
    const char *other = unit_instead(names.outcome(static_cast<std::uint16_t>(o)).unit, factor);
    if (other != nullptr)
      others.push_back({o, factor, other});
  }
  return others;
}

} // namespace rim
