// SPDX-License-Identifier: MIT
#include "world/cobot.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace rim::world {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr double kStandStill_s = 1.5; // at the start of a run
constexpr double kFacing_rad = 0.2;   // turned well enough to drive on
constexpr double kNear_m = 0.06;      // of a node: there
constexpr double kSlow_m = 0.7;       // before a node: slowly
constexpr double kSlow_mps = 0.3;
constexpr double kSlip_mps2 = 8.0; // a collision stops the body, wheels slow down as fast
constexpr double kMoving_mps = 0.01;
constexpr double kTableGap_m = 1e-3; // between the body and a table top put in its way
constexpr double kTableWidth_m = 0.8, kTableLength_m = 1.4, kTableLow_m = 0.70, kTableHigh_m = 0.74;

double wrap(double angle) { return std::remainder(angle, 2.0 * kPi); }

double towards(double v, double target, double up, double down) {
  const bool is_rising = std::fabs(target) > std::fabs(v) && target * v >= 0.0;
  const double most = is_rising ? up : down;
  return v + std::clamp(target - v, -most, most);
}

} // namespace

bool is_interference(CobotEffectKind kind) {
  return kind == CobotEffectKind::collision || kind == CobotEffectKind::hold ||
         kind == CobotEffectKind::stuck || kind == CobotEffectKind::pushed;
}

const char *cobot_effect_name(CobotEffectKind kind) {
  static const char *const names[] = {"encoder", "corridor", "left_turn", "collision",
                                      "hold",    "stuck",    "pushed"};
  return names[static_cast<int>(kind)];
}

Cobot::Cobot(const CobotParams &params, const CobotMap &map, std::vector<CobotEffect> effects,
             std::uint64_t seed, std::uint64_t run)
    : params_(params), map_(map), drive_(seed, run, 1), motion_(seed, run, 2),
      sensor_(seed, run, 3), effect_random_(seed, run, 4), ray_random_(seed, run, 5) {
  if (map.goals.size() < 2)
    throw std::invalid_argument("cobot: the map needs two goals");
  for (int w = 0; w < 4; ++w) {
    const double angle = kPi / 4.0 + w * kPi / 2.0;
    wheels_.sine[w] = std::sin(angle);
    wheels_.cosine[w] = std::cos(angle);
    ticks_[static_cast<std::size_t>(w)] =
        static_cast<std::uint32_t>(sensor_.below(std::uint64_t{1} << 8));
  }
  wheels_.radius_m = params.base_radius_m;
  wheels_.tick_m = params.tick_m;
  wheels_.bits = static_cast<std::uint32_t>(params.counter_bits);
  from_ = drive_.below(map.nodes.size());
  x_m_ = map.nodes[from_][0];
  y_m_ = map.nodes[from_][1];
  phi_ = drive_.uniform(-kPi, kPi);
  wait_until_s_ = kStandStill_s;
  next_slow_s_ = drive_.uniform(5.0, 30.0);
  gain_ = 1.0 + params.run_gain_sd * motion_.normal();
  limits_ = std::max(0.5, 1.0 + params.run_limit_sd * motion_.normal());
  for (const CobotEffect &effect : effects)
    draw(effect);
}

// What a person or an obstacle does differs from case to case.
void Cobot::draw(const CobotEffect &effect) {
  Random &r = effect_random_;
  Active a;
  a.effect = effect;
  a.after_s = r.uniform(2.0, 6.0);
  a.duration_s = r.uniform(1.5, 3.5);
  const double u = r.uniform(), d = r.uniform();
  a.other = r.uniform(0.45, 0.8);
  switch (effect.kind) {
  case CobotEffectKind::collision: // the wheels slip on at a share of their speed
    a.share = 0.35 * u;
    a.decel_mps2 = kSlip_mps2;
    break;
  case CobotEffectKind::hold:
    a.share = 0.05 + 0.3 * u;
    a.decel_mps2 = 2.0 + 3.0 * d;
    break;
  case CobotEffectKind::stuck:
    a.share = 0.1 * u;
    a.decel_mps2 = 2.0 + 2.0 * d;
    break;
  default:
    a.share = 0.25 + 0.25 * u; // pushed: m/s on top
    a.decel_mps2 = 1.0 + d;
  }
  if (effect.after_s >= 0.0)
    a.after_s = effect.after_s;
  if (effect.duration_s >= 0.0)
    a.duration_s = effect.duration_s > 0.0 ? effect.duration_s : 1e9;
  if (effect.share >= 0.0)
    a.share = effect.share;
  effects_.push_back(a);
}

void Cobot::choose_goal() {
  std::size_t goal = from_;
  while (goal == from_)
    goal = map_.goals[drive_.below(map_.goals.size())];
  path_ = find_path(map_, from_, goal);
}

// People in the way: now and then it drives slowly for a while, or waits.
void Cobot::vary_speed() {
  if (t_s_ < next_slow_s_)
    return;
  slow_until_s_ = t_s_ + drive_.uniform(1.0, 4.0);
  slow_mps_ = drive_.uniform() < 0.3 ? 0.0 : drive_.uniform(0.2, 0.6);
  next_slow_s_ = slow_until_s_ + drive_.uniform(5.0, 30.0);
}

void Cobot::drive_edge() {
  const auto &a = map_.nodes[from_], &b = map_.nodes[path_.front()];
  const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
  const double ex = (b[0] - a[0]) / length, ey = (b[1] - a[1]) / length;
  const double done = (x_m_ - a[0]) * ex + (y_m_ - a[1]) * ey;
  const double aside = -(x_m_ - a[0]) * ey + (y_m_ - a[1]) * ex;
  const double error = wrap(std::atan2(ey, ex) - phi_);
  edge_ = {done, length - done, error};
  command_ = {0.0, 0.0, 0.0};
  if (length - done < kNear_m) {
    from_ = path_.front();
    path_.erase(path_.begin());
    is_driving_ = false;
    if (path_.empty())
      wait_until_s_ = t_s_ + drive_.uniform(2.0, 4.0);
    return;
  }
  if (!is_driving_ && std::fabs(error) > 0.05) { // turn in place
    command_[2] = std::clamp(2.0 * error, -params_.turn_radps, params_.turn_radps);
    return;
  }
  is_driving_ = std::fabs(error) < kFacing_rad;
  const bool is_door =
      std::find(map_.goals.begin(), map_.goals.end(), from_) != map_.goals.end() ||
      std::find(map_.goals.begin(), map_.goals.end(), path_.front()) != map_.goals.end();
  command_[0] = is_door ? params_.door_speed_mps : params_.speed_mps;
  if (length - done < kSlow_m)
    command_[0] = std::min(command_[0], kSlow_mps);
  if (t_s_ < slow_until_s_)
    command_[0] = std::min(command_[0], slow_mps_);
  command_[1] = std::clamp(-0.6 * aside, -0.1, 0.1);
  command_[2] = std::clamp(1.5 * error, -0.4, 0.4);
}

void Cobot::navigate() {
  const double before = command_[0];
  vary_speed();
  if (t_s_ < wait_until_s_) {
    command_ = {0.0, 0.0, 0.0};
    edge_ = {0.0, 0.0, 0.0};
  } else {
    if (path_.empty())
      choose_goal();
    drive_edge();
  }
  if (before <= 0.0 && command_[0] > 0.0)
    rise_s_ = t_s_ + params_.latency_s; // it would begin to move
  sent_.push_back(
      {t_s_ + std::max(0.0, params_.latency_s + params_.latency_jitter_s * motion_.normal()),
       command_});
}

void Cobot::put_in_force() {
  while (!sent_.empty() && sent_.front().effect_s <= t_s_) {
    in_force_ = sent_.front().command;
    sent_.erase(sent_.begin());
  }
}

bool Cobot::in_corridor(std::size_t corridor) const {
  const CobotMap::Rectangle &r = map_.corridors.at(corridor);
  return x_m_ >= r[0] && x_m_ <= r[2] && y_m_ >= r[1] && y_m_ <= r[3];
}

bool Cobot::is_moving() const {
  return std::hypot(body_v_[0], body_v_[1]) > kMoving_mps ||
         std::fabs(body_v_[2]) * params_.base_radius_m > kMoving_mps;
}

void Cobot::trigger(Active &a) {
  if (!is_interference(a.effect.kind) || a.start_s >= 0.0 || t_s_ < a.after_s)
    return;
  const double since = t_s_ - rise_s_;
  const bool is_forward = in_force_[0] > 0.25 && rise_s_ >= 0.0;
  const bool is_time = a.effect.phase == CobotPhase::starting       ? since < 2.0 * params_.period_s
                       : a.effect.phase == CobotPhase::accelerating ? since > 0.2 && since < 0.5
                                                                    : since > 1.5;
  // A blow from a lasting speed needs the speed.
  if (is_forward && is_time &&
      (a.effect.phase != CobotPhase::moving || wheel_v_[0] > 0.9 * in_force_[0])) {
    a.start_s = t_s_;
    a.end_s = t_s_ + a.duration_s;
    const double ahead_m = params_.body_radius_m + kTableGap_m + 0.5 * kTableWidth_m;
    a.table = {x_m_ + ahead_m * std::cos(phi_),
               y_m_ + ahead_m * std::sin(phi_),
               phi_,
               0.5 * kTableWidth_m,
               0.5 * kTableLength_m,
               kTableLow_m,
               kTableHigh_m};
  }
}

bool Cobot::acts(const Active &a) const {
  switch (a.effect.kind) {
  case CobotEffectKind::encoder:
    return t_s_ >= std::max(0.0, a.effect.after_s) && is_moving();
  case CobotEffectKind::corridor:
    return in_corridor(a.effect.corridor) && is_moving();
  case CobotEffectKind::left_turn:
    return in_force_[2] > 0.0;
  default:
    return a.start_s >= 0.0 && t_s_ >= a.start_s && t_s_ < a.end_s;
  }
}

// What an acting effect makes of the wheels' target; most_down: how fast they are slowed.
void Cobot::apply(Active &a, double dt_s, std::array<double, 3> &target, double &most_down) {
  a.waver += -a.waver * dt_s / 0.3 + 0.08 * std::sqrt(2.0 * dt_s / 0.3) * motion_.normal();
  switch (a.effect.kind) {
  case CobotEffectKind::collision:
  case CobotEffectKind::hold:
    target[0] *= std::max(0.0, a.share * (1.0 + a.waver));
    target[2] *= 0.3;
    most_down = a.decel_mps2;
    break;
  case CobotEffectKind::stuck:
    for (double &v : target)
      v *= std::max(0.0, a.other * (1.0 + a.waver));
    most_down = a.decel_mps2;
    break;
  case CobotEffectKind::pushed:
    target[0] += a.share * (1.0 + a.waver);
    break;
  case CobotEffectKind::left_turn:
    for (double &v : target)
      v *= 1.0 - params_.failure;
    break;
  default:
    break;
  }
}

// Whether the body would stand in a table top at this place.
bool Cobot::is_blocked(double x_m, double y_m) const {
  const UprightCylinder body{x_m, y_m, params_.body_radius_m, params_.body_height_m};
  return std::any_of(effects_.begin(), effects_.end(), [&](const Active &a) {
    return a.effect.kind == CobotEffectKind::collision && acts(a) && touches(body, a.table);
  });
}

void Cobot::move(double dt_s) {
  std::array<double, 3> target = in_force_;
  for (double &v : target)
    v *= gain_;
  double down = limits_ * params_.decel_mps2, up = limits_ * params_.accel_mps2;
  for (Active &a : effects_) {
    trigger(a);
    if (!acts(a))
      continue;
    apply(a, dt_s, target, down);
    if (a.effect.kind == CobotEffectKind::pushed)
      up += a.decel_mps2;
  }
  for (std::size_t i = 0; i < 2; ++i)
    wheel_v_[i] = towards(wheel_v_[i], target[i], up * dt_s, down * dt_s);
  const double turn = limits_ * params_.turn_accel_radps2 * dt_s;
  wheel_v_[2] = towards(wheel_v_[2], target[2], turn, turn);
  const double keep = std::exp(-dt_s / params_.floor_time_s);
  const double kick = params_.floor_noise_mps * std::sqrt(1.0 - keep * keep);
  for (std::size_t i = 0; i < 3; ++i) {
    const double moving = std::fabs(wheel_v_[0]) + std::fabs(wheel_v_[2]) > 0.02 ? 1.0 : 0.0;
    floor_[i] = keep * floor_[i] + kick * moving * motion_.normal();
    body_v_[i] = wheel_v_[i];
  }
  const double c = std::cos(phi_), s = std::sin(phi_);
  const double x_m = x_m_ + (c * body_v_[0] - s * body_v_[1]) * dt_s;
  const double y_m = y_m_ + (s * body_v_[0] + c * body_v_[1]) * dt_s;
  if (is_blocked(x_m, y_m)) {
    body_v_[0] = body_v_[1] = 0.0;
  } else {
    x_m_ = x_m;
    y_m_ = y_m;
  }
  phi_ = wrap(phi_ + body_v_[2] * dt_s);
}

void Cobot::turn_wheels(double dt_s, CobotRow &row) {
  const double noise = params_.encoder_noise_mps * std::sqrt(2.0); // of one wheel
  const std::array<std::uint32_t, 4> before = ticks_;
  for (std::size_t w = 0; w < 4; ++w) {
    double speed = -wheels_.sine[w] * (wheel_v_[0] + floor_[0]) +
                   wheels_.cosine[w] * (wheel_v_[1] + floor_[1]) +
                   wheels_.radius_m * (wheel_v_[2] + floor_[2]);
    for (const Active &a : effects_) {
      if (!acts(a))
        continue;
      row.acts = true;
      if (a.effect.wheel != w)
        continue;
      if (a.effect.kind == CobotEffectKind::encoder || a.effect.kind == CobotEffectKind::corridor)
        speed *= 1.0 - params_.failure;
      if (a.effect.kind == CobotEffectKind::stuck)
        speed *= a.share;
    }
    travelled_m_[w] += (speed + noise * sensor_.normal()) * dt_s;
    const double ticks = std::floor(travelled_m_[w] / params_.tick_m);
    travelled_m_[w] -= ticks * params_.tick_m;
    const std::uint32_t mask = UINT32_MAX >> (32u - wheels_.bits);
    ticks_[w] = (ticks_[w] + static_cast<std::uint32_t>(static_cast<std::int32_t>(ticks))) & mask;
  }
  double velocity[3] = {0.0, 0.0, 0.0};
  if (has_started_)
    rimi_wheels_velocity(&wheels_, before.data(), ticks_.data(), dt_s, velocity);
  std::copy(velocity, velocity + 3, row.velocity.begin());
  row.ticks = ticks_;
}

void Cobot::sense(CobotRow &row) {
  row.t_s = t_s_;
  row.command = command_;
  row.in_force = in_force_;
  row.x_m = x_m_ + params_.pose_noise_m * sensor_.normal();
  row.y_m = y_m_ + params_.pose_noise_m * sensor_.normal();
  row.phi_rad = wrap(phi_ + 0.5 * params_.pose_noise_m * sensor_.normal());
  row.battery_v = params_.battery_v - params_.battery_drop_vps * t_s_ -
                  0.05 * std::fabs(wheel_v_[0]) + 0.02 * sensor_.normal();
  row.edge = edge_;
  const double ahead_m = cast_ray(map_, x_m_, y_m_, phi_, params_.ray_range_m);
  row.plane = {2.0 + std::floor(3.0 * sensor_.uniform()),
               4000.0 / (1.0 + ahead_m) + 50.0 * sensor_.normal(),
               ahead_m + params_.ray_noise_m * sensor_.normal(), 0.05 * sensor_.normal()};
}

CobotRow Cobot::next() {
  CobotRow row;
  const double jitter = std::clamp(params_.period_jitter_s * motion_.normal(),
                                   -0.4 * params_.period_s, 0.4 * params_.period_s);
  const double dt_s = params_.period_s + jitter;
  t_s_ += dt_s;
  put_in_force();
  move(dt_s);
  turn_wheels(dt_s, row);
  has_started_ = true;
  navigate();
  sense(row);
  return row;
}

std::vector<double> Cobot::rays(std::size_t count) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double part = count > 1 ? static_cast<double>(i) / static_cast<double>(count - 1) : 0.5;
    const double angle = phi_ + params_.ray_view_rad * (part - 0.5);
    out[i] = cast_ray(map_, x_m_, y_m_, angle, params_.ray_range_m) +
             params_.ray_noise_m * ray_random_.normal();
  }
  return out;
}

std::vector<CobotInterval> Cobot::intervals() const {
  std::vector<CobotInterval> out;
  for (const Active &a : effects_) {
    if (is_interference(a.effect.kind) && a.start_s >= 0.0)
      out.push_back({a.start_s, std::min(a.end_s, t_s_), cobot_effect_name(a.effect.kind)});
  }
  std::sort(out.begin(), out.end(),
            [](const CobotInterval &x, const CobotInterval &y) { return x.start_s < y.start_s; });
  return out;
}

} // namespace rim::world
