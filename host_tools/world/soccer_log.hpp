// SPDX-License-Identifier: MIT
// world/soccer_log.hpp - what shots and free kicks taken at random leave behind, and the parameters
// of both worlds as files.
#pragma once

#include "world/freekick.hpp"
#include "world/goalie.hpp"
#include "world/recording.hpp"

#include <cstdint>
#include <string>

namespace rim::world {

// x.ball_m u.aim_m z.reward_m m.reward_m sd.reward_m, a shot a second, aims uniform on the goal
// line; m and sd are the shooting robot's own model (eq. 5.17, 5.20). Finding: the goalie's
// behaviour changed the reward by more than a tenth of sd.
Recording record_goalie(const GoalieParams &params, GoalieBehaviour behaviour, std::size_t shots,
                        std::uint64_t seed);

// x.ball_x_m x.ball_y_m u.plan (1..6) z.goal (0 or 1) m.goal sd.goal, a kick a second, plans drawn
// at random; m is Freekick::own_estimate, sd that of a goal or none. Finding: the true chance is
// off from m by more than a tenth of sd.
Recording record_freekick(const FreekickParams &params, Defence defence, std::size_t kicks,
                          std::uint64_t seed);

} // namespace rim::world
