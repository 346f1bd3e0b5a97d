// SPDX-License-Identifier: MIT
// The forms of the effects, and one log of a world in which they act.
#include <algorithm>
#include <cmath>

#include "nature.hpp"

namespace nature {

namespace {

double sign(double v) { return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0; }

// (truth) of one channel, from its prediction and every effect on it.
double truth_of(const Case &c, std::size_t channel, const Record &log, double m, double t_s) {
  double value = m;
  for (const Effect &e : c.effects) {
    if (e.channel != channel || e.kind != Kind::mean || !e.gate.contains(log.x.back()))
      continue;
    const std::size_t now = log.x.size() - 1, back = static_cast<std::size_t>(e.order);
    const Row &old = log.x[now >= back ? now - back : 0];
    value += e.size * basis(e, *c.world, log.x.back(), old, m, t_s);
  }
  return value;
}

// White noise of sd 1, or what the null says.
class Noise {
public:
  Noise(const Case &c, Random random)
      : kind_(c.noise), parameter_(c.noise_parameter), random_(random), last_(random_.normal()) {}
  double next() {
    const double white = random_.normal();
    if (kind_ == "autocorrelated")
      return last_ = parameter_ * last_ + std::sqrt(1.0 - parameter_ * parameter_) * white;
    if (kind_ == "sd_off")
      return parameter_ * white;
    if (kind_ != "heavy_tailed")
      return white;
    double sum = 0.0;
    for (int i = 0; i < static_cast<int>(parameter_); ++i) {
      const double g = random_.normal();
      sum += g * g;
    }
    return white / std::sqrt(sum / parameter_) * std::sqrt((parameter_ - 2.0) / parameter_);
  }

private:
  std::string kind_;
  double parameter_;
  Random random_;
  double last_;
};

// Runs of rows that are no measurement, so that about `share` of all are.
void add_faults(const Effect &e, Random random, Record &log) {
  const double low = e.kind == Kind::dropout ? 1.0 : 5.0,
               high = e.kind == Kind::dropout ? 5.0 : 40.0;
  const double between = 0.5 * (low + high) * (1.0 - e.share) / e.share;
  Row &z = log.z[e.channel];
  for (std::size_t i = 5;;) {
    i += 2 + static_cast<std::size_t>(between * random.uniform(0.3, 1.7));
    std::size_t length = static_cast<std::size_t>(random.uniform(low, high + 1.0));
    for (; length > 0 && i < z.size(); --length, ++i) {
      z[i] = e.kind == Kind::dropout ? 0.0 : z[i - 1];
      log.fault[e.channel][i] = 1;
    }
    if (i >= z.size())
      return;
  }
}

void measure(const Case &c, std::size_t number, bool with_effects, Record &log) {
  for (std::size_t k = 0; k < c.world->channels.size(); ++k) {
    Noise noise(c, Random(c.seed, number, 1000 * c.attempt + 100 + k));
    const double sd = c.world->channels[k].sd;
    for (std::size_t i = 0; i < log.rows(); ++i) {
      for (const Effect &e : c.effects)
        if (with_effects && e.kind == Kind::variance && e.channel == k && e.gate.contains(log.x[i]))
          log.ratio[k][i] *= e.size;
      double z = log.truth[k][i] + sd * std::sqrt(log.ratio[k][i]) * noise.next();
      if (c.noise == "quantised")
        z = c.noise_parameter * sd * std::round(z / (c.noise_parameter * sd));
      log.z[k][i] = z;
    }
    for (const Effect &e : c.effects)
      if (with_effects && e.channel == k && (e.kind == Kind::dropout || e.kind == Kind::stuck))
        add_faults(e, Random(c.seed, number, 1000 * c.attempt + 200 + k), log);
  }
}

} // namespace

bool Gate::contains(const Row &x) const {
  double distance = 0.0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const double v = x[features[i]];
    if (v < lower[i] || v > upper[i])
      return false;
    const double u = (2.0 * v - lower[i] - upper[i]) / (upper[i] - lower[i]);
    distance += u * u;
  }
  return !ellipse || distance < 1.0;
}

double basis(const Effect &e, const World &world, const Row &x, const Row &old, double m,
             double t_s) {
  const double f = e.first >= 0 ? x[static_cast<std::size_t>(e.first)] : 0.0;
  const double g = e.second >= 0 ? x[static_cast<std::size_t>(e.second)] : 0.0;
  const std::string &name = e.family;
  if (name == "gain")
    return m;
  if (name == "drift")
    return t_s;
  if (name == "coulomb_friction")
    return -sign(f);
  if (name == "viscous_friction" || name == "coupling")
    return name == "coupling" ? f : -f;
  if (name == "quadratic_drag")
    return -f * std::abs(f);
  if (name == "density_drag")
    return -f * std::abs(f) * std::exp(-g / e.shape);
  if (name == "slope")
    return std::sin(f - e.shape);
  if (name == "periodic")
    return std::sin(e.order * f - e.shape);
  if (name == "hinge")
    return std::max(0.0, f - e.shape);
  if (name == "product")
    return f * g;
  if (name == "saturation")
    return std::clamp(m, -e.shape, e.shape) - m;
  if (name == "bump")
    return std::exp(-0.5 * (f - e.shape) * (f - e.shape) / (e.width * e.width));
  if (name == "wiggle") {
    const double u = (f - e.shape) / e.width;
    return std::abs(u) < 1e-9 ? 1.0 : std::sin(u) / u;
  }
  if (name == "delay") {
    Row delayed = x;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (world.features[i].command)
        delayed[i] = old[i];
    return world.predict(e.channel, delayed) - m;
  }
  return 1.0; // bias
}

Record simulate(const Case &c, std::size_t number, bool with_effects) {
  World &world = *c.world;
  const std::size_t runs = c.run_rows.size();
  const std::size_t rows = number < runs ? c.run_rows[number] : c.holdout_rows[number - runs];
  const std::size_t channels = world.channels.size();
  Random random(c.seed, number, 1000 * c.attempt + 1);
  Record log;
  log.m.assign(channels, Row(rows));
  log.truth = log.z = log.effect = log.m;
  log.ratio.assign(channels, Row(rows, 1.0));
  log.fault.assign(channels, std::vector<char>(rows, 0));
  world.start(random, rows);
  for (std::size_t i = 0; i < rows; ++i) {
    world.command(random);
    log.t_s.push_back(static_cast<double>(i) * world.dt_s);
    log.x.push_back(world.observe());
    Row truth(channels);
    for (std::size_t k = 0; k < channels; ++k) {
      const double m = world.predict(k, log.x.back());
      truth[k] = with_effects ? truth_of(c, k, log, m, log.t_s.back()) : m;
      log.m[k][i] = m;
      log.truth[k][i] = truth[k];
      log.effect[k][i] = (truth[k] - m) / world.channels[k].sd;
    }
    world.advance(truth);
  }
  measure(c, number, with_effects, log);
  return log;
}

} // namespace nature
