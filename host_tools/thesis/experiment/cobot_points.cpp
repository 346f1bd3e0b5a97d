// SPDX-License-Identifier: MIT
#include "thesis/experiment/cobot_points.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/cobot_map.hpp"
#include "world/random.hpp"

namespace rim {
namespace {

using Wheels = CobotWheels;

constexpr double kPi = 3.141592653589793;
constexpr double kLeastWeight = 0.2; // of the mean: a point that tells less counts less
constexpr double kLeastBlocks = 20.0;
constexpr std::size_t kContext = 15; // without rays
constexpr double kSettle_s = 0.3;    // after a change of the predicted velocity
constexpr double kBlock_s = 2.0;     // over which nominal scatter is measured
constexpr double kClip = 20.0;       // standard deviations that one point may count
constexpr double kLeastShare = 0.15, kMostShare = 0.6;

struct Floor {
  world::CobotParams params;
  world::CobotMap map;
  Floor() { world::read_cobot(data_path("cobot.toml"), "", &params, &map); }
};

const Floor &the_floor() {
  static const Floor floor;
  return floor;
}

// Velocity from commands and limits alone.
class Prediction {
public:
  explicit Prediction(const world::CobotParams &p) : p_(p) {}
  void step(const std::array<double, 3> &command, double dt_s) {
    bool changes = false;
    for (std::size_t i = 0; i < 3; ++i) {
      const double change = command[i] - v_[i];
      const bool rises = std::fabs(command[i]) > std::fabs(v_[i]) && command[i] * v_[i] >= 0.0;
      const double limit = i == 2 ? p_.turn_accel_radps2 : (rises ? p_.accel_mps2 : p_.decel_mps2);
      const double most = limit * dt_s;
      changes = changes || std::fabs(change) > most;
      v_[i] += std::clamp(change, -most, most);
    }
    since_change_s_ = changes ? 0.0 : since_change_s_ + dt_s;
  }
  const std::array<double, 3> &v() const { return v_; }
  bool is_ramp() const { return since_change_s_ < kSettle_s; }
  bool is_rest() const { return v_[0] == 0.0 && v_[1] == 0.0 && v_[2] == 0.0; }

private:
  const world::CobotParams &p_;
  std::array<double, 3> v_{};
  double since_change_s_ = 1.0;
};

Wheels wheel_speeds(const rim_wheels &wheels, const std::array<double, 3> &v) {
  Wheels out{};
  for (std::size_t w = 0; w < kCobotWheels; ++w)
    out[w] = -wheels.sine[w] * v[0] + wheels.cosine[w] * v[1] + wheels.radius_m * v[2];
  return out;
}

Wheels slip_of(const world::CobotRow &before, const world::CobotRow &now, const rim_wheels &wheels,
               const Wheels &predicted, double dt_s) {
  Wheels out{};
  const std::uint32_t mask = UINT32_MAX >> (32u - wheels.bits);
  const std::uint32_t half = (mask >> 1u) + 1u;
  for (std::size_t w = 0; w < kCobotWheels; ++w) {
    const std::uint32_t up = (now.ticks[w] - before.ticks[w]) & mask;
    const double ticks = up < half ? static_cast<double>(up)
                                   : static_cast<double>(up) - static_cast<double>(mask) - 1.0;
    out[w] = ticks * wheels.tick_m / dt_s - predicted[w];
  }
  return out;
}

// Commands of either sign: a bin's edge lies at 0, and 1 mm/s is told from 0.
double signed_scale(double x, double fine, double most) {
  const double u = 0.5 + 0.5 * std::asinh(x / fine) / std::asinh(most / fine);
  return std::clamp(u, 0.0, 1.0);
}

void add_context(const world::CobotRow &row, world::Cobot &cobot, std::size_t dims, double seconds,
                 std::vector<double> &u) {
  const auto put = [&u](double x, double low, double high) {
    u.push_back(std::clamp((x - low) / (high - low), 0.0, 1.0));
  };
  put(row.t_s, 0.0, seconds * 1.02);
  put(row.x_m, 0.0, 48.0);
  put(row.y_m, 0.0, 22.4);
  put(row.phi_rad, -kPi, kPi);
  put(row.in_force[0], -0.05, 0.75);
  u.push_back(signed_scale(row.in_force[1], 1e-3, 0.1));
  u.push_back(signed_scale(row.in_force[2], 1e-3, 0.8));
  if (dims < kContext)
    return;
  put(row.battery_v, 25.4, 25.7);
  put(row.edge[0], 0.0, 24.0);
  put(row.edge[1], 0.0, 24.0);
  put(row.edge[2], -kPi, kPi);
  put(row.plane[0], 0.0, 6.0);
  put(row.plane[1], 0.0, 4500.0);
  put(row.plane[2], 0.0, 4.2);
  put(row.plane[3], -0.2, 0.2);
  if (dims > kContext) {
    for (const double ray : cobot.rays(dims - kContext))
      put(ray, 0.0, 4.2);
  }
}

// One of the corridors that hold a fair part of the drive; otherwise the one that holds most.
std::size_t choose_corridor(double seconds, std::uint64_t seed, world::Random &random) {
  const Floor &floor = the_floor();
  world::Cobot cobot(floor.params, floor.map, {}, seed, 1);
  std::vector<double> inside(floor.map.corridors.size(), 0.0);
  double moving = 0.0, t_s = 0.0;
  while (t_s < seconds) {
    const world::CobotRow row = cobot.next();
    t_s = row.t_s;
    if (row.in_force[0] == 0.0 && row.in_force[2] == 0.0)
      continue;
    moving += 1.0;
    for (std::size_t k = 0; k < inside.size(); ++k) {
      const auto &r = floor.map.corridors[k];
      if (row.x_m >= r[0] && row.x_m <= r[2] && row.y_m >= r[1] && row.y_m <= r[3])
        inside[k] += 1.0;
    }
  }
  std::vector<std::size_t> fair;
  std::size_t largest = 0;
  for (std::size_t k = 0; k < inside.size(); ++k) {
    const double share = inside[k] / std::max(1.0, moving);
    if (share >= kLeastShare && share <= kMostShare)
      fair.push_back(k);
    if (inside[k] > inside[largest])
      largest = k;
  }
  return fair.empty() ? largest : fair[random.below(fair.size())];
}

std::vector<world::CobotEffect> effects_of(CobotCase which, double seconds, std::uint64_t seed) {
  if (which == CobotCase::nominal)
    return {};
  world::Random random(seed, 1, 77);
  world::CobotEffect effect;
  effect.wheel = random.below(kCobotWheels);
  switch (which) {
  case CobotCase::encoder:
    effect.kind = world::CobotEffectKind::encoder;
    break;
  case CobotCase::collision:
    effect.kind = world::CobotEffectKind::collision;
    effect.after_s = random.uniform(0.3, 0.8) * seconds;
    effect.duration_s = 0.0; // the robot stays where it is until it is stopped
    break;
  case CobotCase::corridor:
    effect.kind = world::CobotEffectKind::corridor;
    effect.corridor = choose_corridor(seconds, seed, random);
    break;
  default:
    effect.kind = world::CobotEffectKind::left_turn;
  }
  return {effect};
}

} // namespace

const char *cobot_case_name(CobotCase which) {
  static const char *const names[] = {"nominal", "encoder", "collision", "corridor", "left turn"};
  return names[static_cast<int>(which)];
}

std::size_t CobotDrive::anomalies() const {
  return static_cast<std::size_t>(std::count(anomalous.begin(), anomalous.end(), true));
}

std::vector<CobotDrive> nominal_drives(std::uint64_t first_seed) {
  std::vector<CobotDrive> out;
  for (std::size_t i = 0; i < kCobotNominal; ++i)
    out.push_back(drive_cobot(CobotCase::nominal, 7, kCobotDrive_s, first_seed + i));
  return out;
}

CobotDrive drive_cobot(CobotCase which, std::size_t dims, double seconds, std::uint64_t seed) {
  if (dims != 7 && (dims < kContext || dims > 100))
    throw UsageError("cobot: dims 7 or 15 to 100");
  const Floor &floor = the_floor();
  world::Cobot cobot(floor.params, floor.map, effects_of(which, seconds, seed), seed, 1);
  Prediction prediction(floor.params);
  CobotDrive out;
  out.dims = dims;
  Wheels sum{};
  std::size_t rows = 0;
  bool ramp = false;
  world::CobotRow before = cobot.next();
  while (before.t_s < seconds) {
    const world::CobotRow row = cobot.next();
    const double dt_s = row.t_s - before.t_s;
    prediction.step(row.in_force, dt_s);
    const Wheels along = wheel_speeds(cobot.wheels(), prediction.v());
    const Wheels slip = slip_of(before, row, cobot.wheels(), along, dt_s);
    before = row;
    if (prediction.is_rest()) {
      rows = 0;
      sum = {};
      ramp = false;
      continue;
    }
    for (std::size_t w = 0; w < kCobotWheels; ++w)
      sum[w] += slip[w] / kCobotPointRows;
    ramp = ramp || prediction.is_ramp();
    if (++rows < kCobotPointRows)
      continue;
    add_context(row, cobot, dims, seconds, out.u);
    out.slip.push_back(sum);
    out.predicted.push_back(along);
    out.is_ramp.push_back(ramp);
    out.anomalous.push_back(row.acts || which == CobotCase::encoder);
    rows = 0;
    sum = {};
    ramp = false;
  }
  return out;
}

namespace {

// Direction of a channel at a point.
Wheels direction_of(std::size_t channel, const Wheels &predicted) {
  Wheels e{};
  for (std::size_t w = 0; w < kCobotWheels; ++w) {
    const double angle = kPi * (0.25 + 0.5 * static_cast<double>(w));
    if (channel < kCobotWheels)
      e[w] = w == channel ? predicted[w] : 0.0;
    else if (channel == kCobotAllWheels)
      e[w] = predicted[w];
    else if (channel == 5)
      e[w] = std::cos(angle);
    else if (channel == 6)
      e[w] = 1.0;
    else
      e[w] = w % 2 == 0 ? 1.0 : -1.0;
  }
  return e;
}

// Squares of residuals, apart where the prediction changes and where not.
struct Squares {
  double steady = 0.0, steadies = 0.0, ramp = 0.0, ramps = 0.0;
};

Eigen::Matrix4d covariance_of_means(const std::vector<CobotDrive> &nominal, Squares &squares) {
  const auto block =
      static_cast<std::size_t>(kBlock_s / (kCobotPointRows * the_floor().params.period_s));
  Eigen::Matrix4d total = Eigen::Matrix4d::Zero();
  double blocks = 0.0;
  for (const CobotDrive &d : nominal) {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    std::size_t n = 0;
    for (std::size_t i = 0; i < d.size(); ++i) {
      const Eigen::Vector4d r(d.slip[i].data());
      (d.is_ramp[i] ? squares.ramp : squares.steady) += r.squaredNorm();
      (d.is_ramp[i] ? squares.ramps : squares.steadies) += 1.0;
      if (d.is_ramp[i])
        continue;
      sum += r;
      if (++n < block)
        continue;
      total += sum * sum.transpose() / static_cast<double>(block);
      blocks += 1.0;
      sum.setZero();
      n = 0;
    }
  }
  if (blocks < kLeastBlocks || squares.ramps < kLeastBlocks)
    throw DataError("cobot: too little nominal driving to measure its scatter");
  return total / blocks;
}

} // namespace

CobotScatter::CobotScatter(const std::vector<CobotDrive> &nominal) {
  Squares squares;
  const Eigen::Matrix4d precision = covariance_of_means(nominal, squares).inverse();
  wheel_deviation_ =
      std::sqrt(squares.steady / squares.steadies / static_cast<double>(kCobotWheels));
  ramp_precision_ =
      std::min(1.0, squares.steady / squares.steadies / (squares.ramp / squares.ramps));
  for (std::size_t a = 0; a < kCobotWheels; ++a) {
    for (std::size_t b = 0; b < kCobotWheels; ++b)
      precision_[a][b] = precision(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
  }
  double points = 0.0;
  for (const CobotDrive &d : nominal) {
    const CobotScores s = scores(d);
    for (std::size_t k = 0; k < s.w.size(); ++k)
      mean_weight_[k % kCobotChannels] += s.w[k];
    points += static_cast<double>(d.size());
  }
  for (double &w : mean_weight_)
    w /= points;
  measure_offsets(nominal);
}

// The variance of a drive's mean beyond that of so many independent points.
void CobotScatter::measure_offsets(const std::vector<CobotDrive> &nominal) {
  std::array<double, kCobotChannels> excess{};
  for (const CobotDrive &d : nominal) {
    const std::vector<double> r = residuals(scores(d));
    const auto n = static_cast<double>(d.size());
    std::array<double, kCobotChannels> sum{};
    for (std::size_t k = 0; k < r.size(); ++k)
      sum[k % kCobotChannels] += r[k];
    for (std::size_t c = 0; c < kCobotChannels; ++c)
      excess[c] += (sum[c] * sum[c] / n - 1.0) / n;
  }
  for (std::size_t c = 0; c < kCobotChannels; ++c)
    offset_variance_[c] = std::max(0.0, excess[c] / static_cast<double>(nominal.size()));
}

CobotScores CobotScatter::scores(const CobotDrive &drive) const {
  CobotScores out;
  out.x.resize(drive.size() * kCobotChannels);
  out.w.resize(drive.size() * kCobotChannels);
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const double share = drive.is_ramp[i] ? ramp_precision_ : 1.0;
    for (std::size_t c = 0; c < kCobotChannels; ++c) {
      const Wheels e = direction_of(c, drive.predicted[i]);
      double x = 0.0, w = 0.0;
      for (std::size_t a = 0; a < kCobotWheels; ++a) {
        double of_e = 0.0;
        for (std::size_t b = 0; b < kCobotWheels; ++b)
          of_e += precision_[a][b] * e[b];
        x += of_e * drive.slip[i][a];
        w += of_e * e[a];
      }
      out.x[i * kCobotChannels + c] = share * x;
      out.w[i * kCobotChannels + c] = share * w;
    }
  }
  return out;
}

double CobotScatter::floored(double w, std::size_t channel) const {
  return std::max(w, kLeastWeight * mean_weight_[channel]);
}

std::vector<double> CobotScatter::residuals(const CobotScores &scores) const {
  std::vector<double> out(scores.x.size());
  for (std::size_t k = 0; k < out.size(); ++k) {
    const double w = floored(scores.w[k], k % kCobotChannels);
    out[k] = std::clamp(scores.x[k] / std::sqrt(w), -kClip, kClip);
  }
  return out;
}

std::vector<double> CobotScatter::slopes(const CobotScores &scores) const {
  std::vector<double> out(scores.w.size());
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = scores.w[k] / std::sqrt(floored(scores.w[k], k % kCobotChannels));
  return out;
}

namespace {

// Least squares over the four wheels.
std::array<double, 3> body_of(const Wheels &slip) {
  std::array<double, 3> v{};
  for (std::size_t w = 0; w < kCobotWheels; ++w) {
    const double angle = kPi * (0.25 + 0.5 * static_cast<double>(w));
    v[0] -= 0.5 * std::sin(angle) * slip[w];
    v[1] += 0.5 * std::cos(angle) * slip[w];
    v[2] += 0.25 * slip[w] / the_floor().params.base_radius_m;
  }
  return v;
}

} // namespace

std::array<double, 3> thesis_deviations(const std::vector<CobotDrive> &nominal) {
  std::array<double, 3> square{};
  double n = 0.0;
  for (const CobotDrive &d : nominal) {
    for (const Wheels &slip : d.slip) {
      const std::array<double, 3> v = body_of(slip);
      for (std::size_t o = 0; o < 3; ++o)
        square[o] += v[o] * v[o];
      n += 1.0;
    }
  }
  for (double &s : square)
    s = std::sqrt(s / std::max(1.0, n));
  return square;
}

std::vector<double> thesis_residuals(const CobotDrive &drive, const std::array<double, 3> &sd) {
  std::vector<double> out;
  for (const Wheels &slip : drive.slip) {
    const std::array<double, 3> v = body_of(slip);
    for (std::size_t o = 0; o < 3; ++o)
      out.push_back(v[o] / sd[o]);
  }
  return out;
}

} // namespace rim
