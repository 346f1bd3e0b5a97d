// SPDX-License-Identifier: MIT
// world/cobot.hpp - the robot world (thesis 3.5.2 p39, 4.2.4 p56, App. C): an omnidirectional
// service robot drives to random offices of one floor, turning in place at nodes and driving along
// the edges of a graph; four wheel encoders, limited acceleration, commands that act after a
// latency.
//
// Frames: the floor's x, y in m, heading phi from x to y; body vx forward, vy to the left, w
// counterclockwise. Wheels at 45, 135, 225, 315 deg (rim_wheels of rim/interference.h).
//
// Interference (App. C): collision (a table top stands in the way of the body, which it stops while
// the wheels below slip on: contact by world/collision.hpp), hold (a person brings it to a
// share of its speed), stuck (one wheel, the others slowed), pushed (faster than commanded). Model
// inaccuracies (3.5.2), while the robot moves: encoder, corridor (encoder wrong in one corridor),
// left_turn (wheels slow while w > 0).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "rim/interference.h"
#include "world/cobot_map.hpp"
#include "world/collision.hpp"
#include "world/random.hpp"

namespace rim::world {

struct CobotParams {
  double period_s = 0.05;
  double period_jitter_s = 0.002; // sd of the time between rows
  double speed_mps = 0.7;
  double door_speed_mps = 0.35;
  double turn_radps = 0.8;
  double accel_mps2 = 1.0;
  double decel_mps2 = 1.2;
  double turn_accel_radps2 = 2.5;
  double latency_s = 0.1;
  double latency_jitter_s = 0.01;   // sd over commands
  double encoder_noise_mps = 0.028; // of the forward velocity
  double floor_noise_mps = 0.008;   // true velocity off the commanded, sd
  double floor_time_s = 0.4;        // and its correlation time
  double run_limit_sd = 0.04;       // of the limits from run to run, share
  double run_gain_sd = 0.004;       // of the speed from run to run, share
  double base_radius_m = 0.2;
  double body_radius_m = 0.3; // the body is an upright cylinder
  double body_height_m = 1.2;
  double tick_m = 1e-4;
  double counter_bits = 16.0;
  double pose_noise_m = 0.02;
  double battery_v = 25.6;
  double battery_drop_vps = 2e-4;
  double ray_view_rad = 4.1887902047863905; // 240 deg
  double ray_range_m = 4.0;
  double ray_noise_m = 0.02;
  double failure = 0.05; // epsilon of 3.5.2: encoder, corridor and left turn
};

enum class CobotEffectKind { encoder, corridor, left_turn, collision, hold, stuck, pushed };
enum class CobotPhase { moving, starting, accelerating }; // in which interference strikes

struct CobotEffect {
  CobotEffectKind kind = CobotEffectKind::hold;
  CobotPhase phase = CobotPhase::moving;
  double after_s = -1.0;    // not before; below 0: drawn, 2 to 6 s
  double duration_s = -1.0; // below 0: drawn, 1.5 to 3.5 s; 0: to the end of the run
  double share = -1.0;      // of the commanded speed that is left; below 0: drawn for the kind
  std::size_t wheel = 0;    // encoder, corridor, stuck
  std::size_t corridor = 0; // of the map
};
bool is_interference(CobotEffectKind kind);
const char *cobot_effect_name(CobotEffectKind kind);

struct CobotInterval {
  double start_s, end_s;
  std::string kind;
};

struct CobotRow {
  double t_s = 0.0;
  std::array<double, 3> command{};  // vx, vy, w as sent now
  std::array<double, 3> in_force{}; // as acting now
  std::array<double, 3> velocity{}; // from the encoders
  std::array<std::uint32_t, 4> ticks{};
  double x_m = 0.0, y_m = 0.0, phi_rad = 0.0; // estimated
  double battery_v = 0.0;
  std::array<double, 3> edge{}; // done m, left m, heading error rad
  std::array<double, 4>
      plane{};       // planes seen, points on the largest, its distance m, its angle rad
  bool acts = false; // truth: an effect acts on this row
};

// One run: the same (params, map, effects, seed, run) give the same rows.
class Cobot {
public:
  Cobot(const CobotParams &params, const CobotMap &map, std::vector<CobotEffect> effects,
        std::uint64_t seed, std::uint64_t run);

  CobotRow next();
  // Range readings at the last row, spread evenly over the view.
  std::vector<double> rays(std::size_t count);
  // Interference so far; the last is cut at the last row where it still acts.
  std::vector<CobotInterval> intervals() const;
  const rim_wheels &wheels() const { return wheels_; }

private:
  struct Active {
    CobotEffect effect;
    double start_s = -1.0, end_s = -1.0, share = 0.0, after_s = 0.0, duration_s = 0.0;
    double decel_mps2 = 0.0, other = 1.0, waver = 0.0;
    TableTop table{}; // collision
  };
  struct Sent {
    double effect_s;
    std::array<double, 3> command;
  };

  void draw(const CobotEffect &effect);
  void navigate();
  void drive_edge();
  void vary_speed();
  void choose_goal();
  void put_in_force();
  void trigger(Active &active);
  bool acts(const Active &active) const;
  void move(double dt_s);
  void apply(Active &active, double dt_s, std::array<double, 3> &target, double &most_down);
  void turn_wheels(double dt_s, CobotRow &row);
  void sense(CobotRow &row);
  bool in_corridor(std::size_t corridor) const;
  bool is_moving() const;
  bool is_blocked(double x_m, double y_m) const;

  CobotParams params_;
  const CobotMap &map_;
  Random drive_, motion_, sensor_, effect_random_, ray_random_;
  std::vector<Active> effects_;
  rim_wheels wheels_{};
  double t_s_ = 0.0, x_m_ = 0.0, y_m_ = 0.0, phi_ = 0.0;
  std::array<double, 3> wheel_v_{}, body_v_{}, command_{}, in_force_{}, floor_{};
  std::array<double, 4> travelled_m_{};
  std::array<std::uint32_t, 4> ticks_{};
  std::vector<Sent> sent_;
  std::vector<std::size_t> path_; // nodes still to be reached
  std::size_t from_ = 0;
  double wait_until_s_ = 0.0, slow_until_s_ = 0.0, slow_mps_ = 0.0, next_slow_s_ = 0.0;
  double gain_ = 1.0, limits_ = 1.0, rise_s_ = -1.0;
  std::array<double, 3> edge_{};
  bool is_driving_ = false, has_started_ = false;
};

} // namespace rim::world
