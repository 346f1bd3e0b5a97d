// SPDX-License-Identifier: MIT
// Is a case fair: strong enough to be found, visited often in every log, and not the same, within
// the noise, as something that has another name.
//
// All in expectation over the noise. With e the effect in sd, a form b explains (b'e)^2 / b'b of
// e'e; half of what it leaves is the ln likelihood by which it falls short. Forms are not equally
// simple: each is charged half ln n a parameter (edges and levels included) and ln of the number of
// its kind, and a rival's margin is what it leaves and the difference of the charges. Without that
// a box would be hidden that any sober analyst calls by a simpler name.
#include <algorithm>
#include <cmath>
#include <functional>

#include "nature.hpp"

namespace nature {

namespace {

constexpr double kLeastMargin = 8.0;         // nats, to the nearest form of another name
constexpr double kLeastLeft = 3.0;           // the same without the charges
constexpr double kLeastMarginUnknown = 20.0; // without the charges, of what no catalogue holds
constexpr double kVaries = 0.4; // a factor of a product: sd over mean; less is a constant, nearly
constexpr double kActs = 0.1;   // sd: rows on which an effect counts

double dot(const Row &a, const Row &b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += a[i] * b[i];
  return sum;
}

// The run logs' rows end to end.
struct Table {
  std::vector<const Row *> x;
  std::vector<std::size_t> log;
  Row t_s, m, other, weight, effect; // weight: 1 / sd as it truly is, in sd; 0: no measurement
  std::vector<char> inside, acts;
};

void append(const Case &c, const Record &r, std::size_t number, const Effect &e, Table &t) {
  const Channel &channel = c.world->channels[e.channel];
  for (std::size_t i = 0; i < r.rows(); ++i) {
    const std::size_t back = static_cast<std::size_t>(e.order);
    const double m = r.m[e.channel][i];
    const bool inside = e.gate.contains(r.x[i]);
    const double own =
        e.kind == Kind::mean && inside
            ? e.size / channel.sd *
                  basis(e, *c.world, r.x[i], r.x[i >= back ? i - back : 0], m, r.t_s[i])
            : 0.0;
    const bool faulty = r.fault[e.channel][i] != 0;
    const double weight = faulty ? 0.0 : 1.0 / std::sqrt(r.ratio[e.channel][i]);
    t.x.push_back(&r.x[i]);
    t.log.push_back(number);
    t.t_s.push_back(r.t_s[i]);
    t.m.push_back(m);
    t.weight.push_back(weight);
    t.effect.push_back(own * weight);
    t.other.push_back((r.effect[e.channel][i] - own) * weight);
    t.inside.push_back(inside ? 1 : 0);
    const bool acts = e.kind == Kind::mean       ? std::abs(own) > kActs
                      : e.kind == Kind::variance ? inside
                                                 : faulty;
    t.acts.push_back(acts ? 1 : 0);
  }
}

void remove_from(Row &v, const Row &direction) {
  const double length = dot(direction, direction);
  const double along = length > 1e-12 ? dot(v, direction) / length : 0.0;
  for (std::size_t i = 0; i < v.size(); ++i)
    v[i] -= along * direction[i];
}

// Every form that has another name than the effect's, on the same channel.
class Rivals {
public:
  Rivals(const Case &c, const Effect &e, const Table &t) : c_(c), e_(e), t_(t), left_(t.effect) {
    remove_from(left_, t.other);
    all_ = 0.5 * dot(left_, left_);
    margin = least_left = all_;
  }
  void search();
  std::string name;
  double margin, least_left; // with and without the charges

private:
  using Form = std::function<double(std::size_t)>;
  void try_form(const std::string &cause, const Form &form, std::size_t gates = 0,
                const Form &second = nullptr);
  void simple();
  void levels();
  void angles();
  void intervals();
  double f(std::size_t feature, std::size_t i) const { return (*t_.x[i])[feature]; }
  bool varies(std::size_t feature) const;
  Row column(const Form &form) const;
  double charge(const std::string &cause, std::size_t gates) const;
  void keep(const std::string &cause, double left, std::size_t gates) {
    least_left = std::min(least_left, left);
    const double gap = left + (charge(cause, gates) - charge(e_.cause, e_.gate.features.size()));
    if (gap < margin) {
      margin = gap;
      name = cause;
    }
  }

  const Case &c_;
  const Effect &e_;
  const Table &t_;
  Row left_;
  double all_;
};

Row Rivals::column(const Form &form) const {
  Row b(left_.size());
  for (std::size_t i = 0; i < b.size(); ++i)
    b[i] = form(i) * t_.weight[i];
  remove_from(b, t_.other);
  return b;
}

double Rivals::charge(const std::string &cause, std::size_t gates) const {
  const double one = 0.5 * std::log(static_cast<double>(left_.size()));
  const double features = static_cast<double>(c_.world->features.size());
  const double pairs = 0.5 * features * (features - 1.0);
  double sum = gates == 0   ? one
               : gates == 1 ? 3.0 * one + std::log(features)
                            : 5.0 * one + std::log(pairs);
  if (cause == "slope" || cause == "saturation")
    sum += one;
  if (cause == "periodic")
    sum += one + std::log(10.0);
  if (cause == "hinge")
    sum += one + std::log(features);
  if (cause == "product")
    sum += std::log(pairs);
  if (cause == "delay")
    sum += std::log(12.0);
  return sum;
}

void Rivals::try_form(const std::string &cause, const Form &form, std::size_t gates,
                      const Form &second) {
  if (cause == e_.cause)
    return;
  Row a = column(form);
  const double length = dot(a, a), along = dot(a, left_);
  if (length < 1e-12)
    return;
  double left = all_ - 0.5 * along * along / length;
  if (second) {
    Row b = column(second);
    remove_from(b, a);
    const double size = dot(b, b), share = dot(b, left_);
    left -= size > 1e-12 ? 0.5 * share * share / size : 0.0;
  }
  keep(cause, left, gates);
}

void Rivals::simple() {
  const Channel &channel = c_.world->channels[e_.channel];
  for (const bool gated : {false, true}) {
    if (gated && e_.gate.features.empty())
      break;
    const std::size_t gates = gated ? e_.gate.features.size() : 0;
    const auto in = [this, gated](std::size_t i) { return gated && !t_.inside[i] ? 0.0 : 1.0; };
    try_form("bias", in, gates);
    try_form(
        "gain", [&](std::size_t i) { return in(i)*t_.m[i]; }, gates);
    try_form(
        "drift", [&](std::size_t i) { return in(i)*t_.t_s[i]; }, gates);
    for (std::size_t k = 0; k < c_.world->features.size(); ++k) {
      const bool rate =
          std::count(channel.couplings.begin(), channel.couplings.end(), static_cast<int>(k)) > 0;
      if (c_.world->features[k].command || rate)
        try_form(
            "coupling", [&](std::size_t i) { return in(i)*f(k, i); }, gates);
    }
    if (channel.velocity < 0)
      continue;
    const auto v = [this, &channel](std::size_t i) {
      return f(static_cast<std::size_t>(channel.velocity), i);
    };
    try_form(
        "coulomb_friction", [&](std::size_t i) { return in(i) * (v(i) > 0.0 ? 1.0 : -1.0); },
        gates);
    try_form(
        "viscous_friction", [&](std::size_t i) { return in(i)*v(i); }, gates);
    try_form(
        "quadratic_drag", [&](std::size_t i) { return in(i)*v(i) * std::abs(v(i)); }, gates);
    for (const double scale : {6000.0, 7500.0, 9000.0})
      if (c_.world->altitude >= 0)
        try_form(
            "quadratic_drag",
            [&](std::size_t i) {
              const double h = f(static_cast<std::size_t>(c_.world->altitude), i);
              return in(i)*v(i) * std::abs(v(i)) * std::exp(-h / scale);
            },
            gates);
  }
}

bool Rivals::varies(std::size_t feature) const {
  double sum = 0.0, square = 0.0;
  for (std::size_t i = 0; i < t_.x.size(); ++i) {
    sum += f(feature, i);
    square += f(feature, i) * f(feature, i);
  }
  const double n = static_cast<double>(t_.x.size()), mean = sum / n;
  return !c_.world->features[feature].angle &&
         square / n - mean * mean > kVaries * kVaries * mean * mean;
}

void Rivals::levels() {
  const auto &features = c_.world->features;
  for (std::size_t k = 0; k < features.size(); ++k) {
    if (features[k].angle)
      continue;
    Row sorted;
    for (std::size_t i = 0; i < t_.x.size(); ++i)
      sorted.push_back(f(k, i));
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t q = 0; q < 16; ++q) {
      const double level = sorted[q * sorted.size() / 17];
      try_form("hinge", [&](std::size_t i) { return std::max(0.0, f(k, i) - level); });
      try_form("hinge", [&](std::size_t i) { return std::max(0.0, level - f(k, i)); });
    }
    for (std::size_t j = 0; j < k; ++j)
      if (varies(k) && varies(j))
        try_form("product", [&](std::size_t i) { return f(k, i) * f(j, i); });
  }
  Row size;
  for (const double m : t_.m)
    size.push_back(std::abs(m));
  std::sort(size.begin(), size.end());
  for (std::size_t q = 8; q < 20; ++q) {
    const double level = size[q * size.size() / 20];
    try_form("saturation",
             [&](std::size_t i) { return std::clamp(t_.m[i], -level, level) - t_.m[i]; });
  }
  Effect delay;
  delay.family = "delay";
  delay.channel = e_.channel;
  for (std::size_t d = 1; d <= 12; ++d)
    try_form("delay", [&](std::size_t i) {
      const std::size_t old = i >= d && t_.log[i - d] == t_.log[i] ? i - d : i;
      return basis(delay, *c_.world, *t_.x[i], *t_.x[old], t_.m[i], t_.t_s[i]);
    });
}

void Rivals::angles() {
  for (std::size_t k = 0; k < c_.world->features.size(); ++k)
    for (int n = 1; n <= 6 && c_.world->features[k].angle; ++n)
      try_form(
          n == 1 ? "slope" : "periodic", [&](std::size_t i) { return std::sin(n * f(k, i)); }, 0,
          [&](std::size_t i) { return std::cos(n * f(k, i)); });
}

// A constant in any interval of any feature, edges at 60 quantiles.
void Rivals::intervals() {
  constexpr std::size_t edges = 60;
  std::vector<std::size_t> order(t_.x.size());
  for (std::size_t k = 0; k < c_.world->features.size() && e_.cause != "bias"; ++k) {
    for (std::size_t i = 0; i < order.size(); ++i)
      order[i] = i;
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return f(k, a) < f(k, b) || (f(k, a) <= f(k, b) && a < b);
    });
    Row sum(edges + 1, 0.0), count(edges + 1, 0.0);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const std::size_t bin = i * edges / order.size();
      sum[bin + 1] += left_[order[i]] * t_.weight[order[i]];
      count[bin + 1] += t_.weight[order[i]] * t_.weight[order[i]];
    }
    for (std::size_t b = 1; b <= edges; ++b) {
      sum[b] += sum[b - 1];
      count[b] += count[b - 1];
      for (std::size_t a = 0; a < b; ++a) {
        const double s = sum[b] - sum[a], n = count[b] - count[a];
        keep("bias", all_ - (n > 1e-9 ? 0.5 * s * s / n : 0.0), 1);
      }
    }
  }
}

void Rivals::search() {
  simple();
  levels();
  angles();
  intervals();
}

// Least ln likelihood ratio: more where there is more to find (edges, features).
double least_llr(const Effect &e) {
  return e.gate.features.empty() ? 30.0 : e.gate.features.size() == 1 ? 35.0 : 45.0;
}

// Every log on its own: the effect acts there, and the gate is entered more than once.
bool visited(const Case &c, const Record &r, const Effect &e, double share) {
  Table t;
  append(c, r, 0, e, t);
  std::size_t acting = 0, entries = 0, inside = 0;
  double square = 0.0;
  for (std::size_t i = 0; i < t.acts.size(); ++i) {
    acting += t.acts[i] ? 1 : 0;
    inside += t.inside[i] ? 1 : 0;
    entries += t.inside[i] && (i == 0 || !t.inside[i - 1]) ? 1 : 0;
    square += t.effect[i] * t.effect[i];
  }
  const double least = std::max(12.0, 0.35 * share * static_cast<double>(r.rows()));
  if (static_cast<double>(acting) < least)
    return false;
  if (e.kind == Kind::mean && 0.5 * square < 5.0)
    return false;
  return e.gate.features.empty() || inside == r.rows() || entries >= 2;
}

// Has an effect driven the vehicle out of its world.
bool sane(const std::vector<Record> &records, const Case &c) {
  for (const Record &r : records)
    for (const Row &x : r.x)
      for (std::size_t k = 0; k < x.size(); ++k)
        if (!std::isfinite(x[k]) ||
            (static_cast<int>(k) == c.world->altitude && (x[k] < 0.0 || x[k] > 62e3)))
          return false;
  return true;
}

double ln_ratio(const Effect &e, const Table &t) {
  double sum = 0.0;
  if (e.kind == Kind::variance)
    for (const char inside : t.inside)
      sum += inside ? 0.5 * (e.size - 1.0 - std::log(e.size)) : 0.0;
  else // a fault of the sensor: a nat or more a row
    for (const char acts : t.acts)
      sum += acts ? 1.0 : 0.0;
  return sum;
}

} // namespace

Fairness judge(const Case &c, const std::vector<Record> &records, std::size_t k) {
  const Effect &e = c.effects[k];
  Fairness fair;
  if (!sane(records, c)) {
    fair.unfair = "the vehicle leaves its world";
    return fair;
  }
  Table t;
  for (std::size_t i = 0; i < c.run_rows.size(); ++i)
    append(c, records[i], i, e, t);
  const double rows = static_cast<double>(t.acts.size());
  const double acting = static_cast<double>(std::count(t.acts.begin(), t.acts.end(), 1));
  const bool fault = e.kind == Kind::dropout || e.kind == Kind::stuck;
  fair.share = acting / rows;
  fair.llr = ln_ratio(e, t);
  double strength = 1.0;
  Rivals rivals(c, e, t);
  if (e.kind == Kind::mean) {
    strength = acting > 0.0 ? std::sqrt(dot(t.effect, t.effect) / acting) : 0.0;
    fair.llr = rivals.margin;
  }
  if (fair.share < (fault ? 0.015 : 0.05))
    fair.unfair = "acts on too few rows";
  else if (e.family == "saturation" && fair.share > 0.45)
    fair.unfair = "limits more often than not";
  else if (strength < 0.25 || strength > 2.5)
    fair.unfair = "too weak or too strong";
  else if (fair.llr < least_llr(e))
    fair.unfair = "too little evidence";
  for (const Record &r : records)
    if (fair.unfair.empty() && !visited(c, r, e, fair.share))
      fair.unfair = "a log hardly shows it";
  if (!fair.unfair.empty() || e.kind != Kind::mean)
    return fair;
  rivals.search();
  const bool unknown = e.cause == "unknown";
  fair.rival = rivals.name;
  fair.margin = unknown || rivals.least_left < kLeastLeft ? rivals.least_left : rivals.margin;
  if (fair.margin < (unknown ? kLeastMarginUnknown : kLeastMargin))
    fair.unfair = "not to be told from " + fair.rival;
  return fair;
}

} // namespace nature
