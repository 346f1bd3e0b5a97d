// SPDX-License-Identifier: MIT
// world/keepaway.hpp - Interception-Keepaway (thesis 3.5.3, p. 40-42): keepers pass a ball within a
// bounded field, takers try to intercept it.
//
// Field: origin at its middle, x along its length. Robots are numbered keepers first. A keeper that
// has the ball holds it for a while, in which takers mark and keepers run free; then it turns and
// kicks. A pass succeeds when the ball touches a keeper before it touches a taker or leaves the
// field. An episode ends when the ball leaves the field or a taker has held it for a while.
//
// The takers of the world have habits: where the context of a pass, seen from one of them, lies in
// a habit's box, that taker starts earlier or later, or moves otherwise, than the model assumes.
// No planner knows the habits.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "world/keepaway_motion.hpp"
#include "world/random.hpp"

namespace rim::world {

constexpr std::size_t kKeepawayFeatures = 5;
constexpr std::size_t kMostTakers = 5;
extern const char *const kKeepawayFeatureNames[kKeepawayFeatures];

// Eq. 3.35: place and velocity of a taker relative to the ball when the pass starts, in the frame
// of its direction: ahead_m, beside_m (left), v_ahead_mps, v_beside_mps, and ball_speed_mps.
using PassContext = std::array<double, kKeepawayFeatures>;

struct TakerHabit {
  std::string name;
  PassContext low{}, high{}; // the box; infinite where the feature does not matter
  double start_s = 0.0;      // from the kick to its start; negative: while the passer still turns
  double accel_factor = 1.0;
  double speed_factor = 1.0;
  bool acts(const PassContext &context) const;
};

struct KeepawayParams { // data/keepaway.toml says where each comes from
  double field_length_m = 6.0;
  double field_width_m = 4.0;
  double keepers = 4.0;
  double takers = 3.0;
  BodySizes sizes;
  MotionLimits limits;
  BallFriction friction;
  double latency_s = 0.1;
  double keeper_latency_s = 0.0;
  double keeper_start_s = -0.2;
  double aim_s = 0.2;
  double hold_min_s = 0.8;
  double hold_max_s = 1.8;
  double kick_min_mps = 3.0;
  double kick_max_mps = 8.0;
  double kick_speeds = 4.0;
  double kick_directions = 48.0;
  double kick_heading_sd_rad = 0.02;
  double kick_speed_sd = 0.03;
  double capture_mps = 4.0;
  double mark_passer_m = 0.5;
  double mark_receiver_m = 0.4;
  double keeper_start_m = 0.5;
  double taker_start_m = 0.6;
  double keeper_apart_m = 1.2;
  double spots = 8.0;
  double held_s = 1.0;
  double loose_s = 4.0;
  double step_s = 0.005;
  double control_s = 0.05;
  double plan_step_s = 0.02;
  double plan_horizon_s = 1.6;
  double time_sd_s = 0.3; // sigma_t of eq. 3.34
  std::vector<TakerHabit> habits;

  std::size_t keeper_count() const { return static_cast<std::size_t>(keepers); }
  std::size_t taker_count() const { return static_cast<std::size_t>(takers); }
};

// Every key must be in base; overlay may hold any part, its habits replace those of base. Throws
// DataError.
KeepawayParams read_keepaway_params(const std::string &base, const std::string &overlay = "");
std::string keepaway_params_toml(const KeepawayParams &params);

// What the planner sees before a pass.
struct KeepawayState {
  std::vector<KeepawayRobot> robots;
  std::size_t holder = 0;
  double time_s = 0.0;
};

// Where the ball will be, at every plan_step_s from now until it leaves the field or the horizon.
struct BallFlight {
  Vec2 from = Vec2::Zero(), forward = Vec2::Zero();
  const double *path_m = nullptr;
  std::size_t count = 0;
  double step_s = 0.0;
  Vec2 at(std::size_t k) const { return from + path_m[k] * forward; }
};

struct Interception {
  double time_s = std::numeric_limits<double>::infinity(); // none in time
  Vec2 at_m = Vec2::Zero();
};

// The first time at which a robot that keeps its velocity for start_s and then accelerates can
// touch the ball (t_i of eq. 3.33). One that the ball runs into touches it whenever it starts.
Interception intercept(const KeepawayRobot &robot, const MotionLimits &limits, double start_s,
                       double reach_m, const BallFlight &flight);

// A pass as planned, and what the nominal model expects of it.
struct PassOption {
  double direction_rad = 0.0, speed_mps = 0.0;
  double keepers_s = 0.0;                               // t_k of eq. 3.33
  std::array<double, kMostTakers> takers_s{};           // t_i of each taker
  std::array<double, kMostTakers> expected{};           // eq. 3.34 with t_i of this taker alone
  std::array<PassContext, kMostTakers> context{};       // chi of each taker
  std::size_t decisive = 0;                             // the taker with the least t_i
  double nominal() const { return expected[decisive]; } // eq. 3.34
};

// All passes that some keeper could receive, in a fixed order.
class KeepawayModel {
public:
  explicit KeepawayModel(const KeepawayParams &params);
  void options(const KeepawayState &now, std::vector<PassOption> &out) const;

private:
  bool evaluate(const KeepawayState &state, std::size_t speed, PassOption &option) const;

  KeepawayParams params_;
  std::vector<double> speeds_;
  std::vector<std::vector<double>> path_m_; // a speed
};

struct PassResult {
  bool success = false;
  bool out = false;                      // left the field untouched
  int touched_by = -1;                   // the robot that touched the ball first
  std::array<bool, kMostTakers> habit{}; // truth: one of its habits acted
};

class Keepaway {
public:
  // Throws std::invalid_argument where the counts are out of range.
  Keepaway(const KeepawayParams &params, std::uint64_t seed, std::uint64_t run = 1);

  // Plays on until a keeper is about to pass; a new episode begins where the last has ended.
  const KeepawayState &ready();
  // The pass of the keeper that ready() named, and what follows until somebody has the ball.
  PassResult pass(const PassOption &option);

  std::size_t episodes() const { return episodes_; }
  const KeepawayState &state() const { return state_; }
  const KeepawayBall &ball() const { return ball_; }
  bool episode_over() const { return over_; }

private:
  struct Player { // how a robot moves during this pass
    MotionLimits limits;
    double start_s = 0.0;
  };
  struct Command {
    bool brake = true;
    Vec2 to = Vec2::Zero();
    double by_s = 0.0; // above 0: be there by then; else stop there
  };
  Vec2 wanted_mps(std::size_t robot) const;

  void begin_episode();
  void assign_marks();
  void choose_spots();
  Vec2 mark_of(std::size_t taker) const;
  void command_marks();
  void command_chase(double since_kick_s);
  BallFlight flight(double to_kick_s);
  int control_steps() const;
  int step(bool loose_ball, double *impact_mps);
  void set_habits(const PassOption &option, PassResult &result);
  void aim(const PassOption &option);
  void fly(PassResult &result);
  bool is_out() const;
  bool captures(int robot, double impact_mps) const;
  bool is_keeper(std::size_t robot) const { return robot < params_.keeper_count(); }

  KeepawayParams params_;
  std::uint64_t seed_, run_;
  KeepawayState state_;
  KeepawayBall ball_;
  std::vector<Player> players_;
  std::vector<Command> commands_;
  std::vector<Vec2> spots_;
  std::vector<std::size_t> marked_; // the keeper a taker marks; the holder: between it and ...
  std::size_t most_open_ = 0;
  std::vector<double> path_m_;
  std::uint64_t episodes_ = 0, passes_ = 0;
  bool over_ = true;
};

// The pass worth most; of equals the one that a keeper has first. nullptr: there is none.
template <class Value>
const PassOption *best_pass(const std::vector<PassOption> &options, const Value &value_of) {
  const PassOption *best = nullptr;
  double most = 0.0;
  for (const PassOption &option : options) {
    const double value = value_of(option);
    if (best == nullptr || value > most ||
        (!(value < most) && option.keepers_s < best->keepers_s)) {
      best = &option;
      most = value;
    }
  }
  return best;
}

// Plays a number of passes. choose(options) returns the pass or nullptr; body(option, result) is
// called after each. Without a pass to choose, the ball is kicked slowly ahead, which is no pass.
template <class Choose, class Body>
void play_passes(const KeepawayModel &model, Keepaway &keepaway, const KeepawayParams &params,
                 std::size_t passes, const Choose &choose, const Body &body) {
  std::vector<PassOption> options;
  for (std::size_t n = 0; n < passes;) {
    const KeepawayState &state = keepaway.ready();
    model.options(state, options);
    PassOption option;
    if (const PassOption *chosen = choose(options)) {
      option = *chosen;
      body(option, keepaway.pass(option));
      ++n;
    } else {
      option.direction_rad = state.robots[state.holder].heading_rad;
      option.speed_mps = params.kick_min_mps;
      keepaway.pass(option);
    }
  }
}

} // namespace rim::world
