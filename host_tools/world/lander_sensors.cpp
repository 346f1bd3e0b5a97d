// SPDX-License-Identifier: MIT
// The sensors of the lander: from the truth of all rows to readings.
#include <cmath>

#include "world/lander.hpp"
#include "world/lander_streams.hpp"

namespace rim::world {
namespace {

// What a sensor keeps for the run.
struct Errors {
  double bias, scale, noise_sd, drift_per_s;
};

Errors draw_errors(const SensorParams &p, std::uint64_t seed, std::uint64_t run,
                   std::size_t sensor) {
  Random random(seed, run, kSensorRunStream + sensor);
  Errors e;
  e.bias = p.bias_sd * random.normal();
  e.scale = p.scale_sd * random.normal();
  e.noise_sd = p.noise_sd * std::fmax(0.0, 1.0 + p.noise_level_sd * random.normal());
  e.drift_per_s = p.drift_sd_per_s * random.normal();
  return e;
}

// Rounds to the resolution. Where 1/resolution is whole, dividing by it gives the shortest decimal.
double quantise(double value, double resolution) {
  const double inverse = std::round(1.0 / resolution);
  const double rounded = std::fabs(inverse * resolution - 1.0) < 1e-9
                             ? std::round(value * inverse) / inverse
                             : std::round(value / resolution) * resolution;
  return rounded + 0.0; // no negative zero
}

double delayed(const std::vector<LanderRow> &rows, std::size_t sensor, std::size_t k,
               double delay_s) {
  const double at = static_cast<double>(k) - delay_s / kLanderStep_s;
  if (at <= 0.0)
    return rows[0].sensor[sensor];
  const auto low = static_cast<std::size_t>(at);
  const double share = at - static_cast<double>(low);
  const double a = rows[low].sensor[sensor];
  return share == 0.0 ? a : a + share * (rows[low + 1].sensor[sensor] - a);
}

// One term at work on one sensor; keeps what it needs from row to row.
class Work {
public:
  Work(const EffectTerm &term, std::uint64_t seed, std::uint64_t run, std::size_t number)
      : term_(term), random_(seed, run, kEffectStream + number) {}

  const EffectTerm &term() const { return term_; }

  // Before the errors of the sensor: delay changes the true value itself.
  double truth(const std::vector<LanderRow> &rows, std::size_t k, double value, bool &acts) const {
    if (term_.kind != EffectKind::delay || !term_.is_open(rows[k].quantity))
      return value;
    acts = true;
    return delayed(rows, term_.sensor, k, term_.size());
  }

  // Added to the reading before it is rounded.
  double added(const LanderRow &row, double value, double noise_sd, bool &acts) {
    const double noise = random_.normal();
    if (!term_.is_open(row.quantity))
      return 0.0;
    double add = 0.0;
    switch (term_.kind) {
    case EffectKind::bias:
      add = term_.size();
      break;
    case EffectKind::gain:
      add = term_.size() * value;
      break;
    case EffectKind::drift:
      if (open_since_s_ < 0.0)
        open_since_s_ = row.t_s;
      add = term_.size() * (row.t_s - open_since_s_);
      break;
    case EffectKind::noise:
      add = noise_sd * std::sqrt(term_.size()) * noise;
      break;
    case EffectKind::cross_coupling:
      add = term_.size() * row.quantity[static_cast<std::size_t>(Quantity::thrust)];
      break;
    default:
      return 0.0;
    }
    acts = acts || add != 0.0;
    return add;
  }

  // After rounding: what replaces the reading.
  double replaced(const LanderRow &row, double reading, bool &acts) {
    if (term_.kind != EffectKind::dropout && term_.kind != EffectKind::stuck)
      return reading;
    const double chance = random_.uniform();
    const bool is_open = term_.is_open(row.quantity);
    if (term_.kind == EffectKind::dropout) {
      if (!is_open || chance >= term_.size())
        return reading;
      acts = true;
      return 0.0;
    }
    if (hold_ > 0 && is_open) {
      --hold_;
      acts = true;
      return held_;
    }
    // Share f of rows held in holds of h rows: a hold begins after a free row with chance
    // f / (h (1 - f)).
    const double share = term_.size();
    const double begin = share / (static_cast<double>(term_.hold_rows) * (1.0 - share));
    hold_ = is_open && chance < begin ? term_.hold_rows : 0;
    held_ = reading;
    return reading;
  }

private:
  const EffectTerm &term_;
  Random random_;
  double open_since_s_ = -1.0;
  std::size_t hold_ = 0;
  double held_ = 0.0;
};

std::vector<Work> works_of(const std::vector<Effect> &effects, std::size_t sensor,
                           std::uint64_t seed, std::uint64_t run) {
  std::vector<Work> works;
  std::size_t number = 0;
  for (const Effect &effect : effects) {
    for (const EffectTerm &term : effect.terms) {
      if (term.sensor == sensor)
        works.emplace_back(term, seed, run, number);
      ++number;
    }
  }
  return works;
}

} // namespace

void read_lander_sensors(const LanderParams &params, const std::vector<Effect> &effects,
                         std::uint64_t seed, std::uint64_t run, LanderRun &result) {
  const std::vector<LanderRow> &rows = result.rows;
  result.acts.assign(rows.size(), 0);
  result.readings.resize(static_cast<Eigen::Index>(rows.size()),
                         static_cast<Eigen::Index>(kSensors));
  for (std::size_t k = 0; k < rows.size(); ++k)
    result.acts[k] = rows[k].acts ? 1 : 0;
  for (std::size_t c = 0; c < kSensors; ++c) {
    const Errors errors = draw_errors(params.sensor[c], seed, run, c);
    Random noise(seed, run, kSensorNoiseStream + c);
    std::vector<Work> works = works_of(effects, c, seed, run);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      bool acts = false;
      double value = rows[k].sensor[c];
      for (const Work &work : works)
        value = work.truth(rows, k, value, acts);
      double reading = value * (1.0 + errors.scale) + errors.bias +
                       errors.drift_per_s * rows[k].t_s + errors.noise_sd * noise.normal();
      for (Work &work : works)
        reading += work.added(rows[k], value, errors.noise_sd, acts);
      reading = quantise(reading, params.sensor[c].resolution);
      for (Work &work : works)
        reading = work.replaced(rows[k], reading, acts);
      result.readings(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(c)) = reading;
      if (acts)
        result.acts[k] = 1;
    }
  }
}

} // namespace rim::world
