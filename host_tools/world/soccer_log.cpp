// SPDX-License-Identifier: MIT
#include "world/soccer_log.hpp"

#include <algorithm>
#include <cmath>

#include "world/random.hpp"

namespace rim::world {
namespace {

constexpr std::uint64_t kAimStream = 4; // apart from the worlds' own
constexpr double kFelt = 0.1;           // of sd: what counts as a deviation

Log empty_log(const std::vector<std::string> &columns, std::size_t rows) {
  Log log;
  for (const std::string &name : columns)
    log.columns.push_back(column_of(name));
  log.values.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns.size()));
  return log;
}

} // namespace

Recording record_goalie(const GoalieParams &params, GoalieBehaviour behaviour, std::size_t shots,
                        std::uint64_t seed) {
  const Goalie world(params, behaviour), nominal(params, GoalieBehaviour::nominal);
  Recording out;
  out.log = empty_log({"x.ball_m", "u.aim_m", "z.reward_m", "m.reward_m", "sd.reward_m"}, shots);
  Random aims(seed, 1, kAimStream);
  const auto episodes = goalie_episodes(params, shots, seed);
  for (std::size_t k = 0; k < shots; ++k) {
    const GoalieEpisode &e = episodes[k];
    const double aim_m = aims.uniform(-params.goal_half_m, params.goal_half_m);
    const double reward_m = world.reward(e.s_m, aim_m, e.error_rad);
    const double sd_m = world.nominal_sd(e.s_m, aim_m);
    out.log.t_s.push_back(static_cast<double>(k));
    out.log.values.row(static_cast<Eigen::Index>(k)) << e.s_m, aim_m, reward_m,
        world.nominal_mean(e.s_m, aim_m), sd_m;
    const double change_m = reward_m - nominal.reward(e.s_m, aim_m, e.error_rad);
    out.finding.push_back(std::fabs(change_m) > kFelt * sd_m ? 1 : 0);
  }
  number_rows(out.log);
  return out;
}

Recording record_freekick(const FreekickParams &params, Defence defence, std::size_t kicks,
                          std::uint64_t seed) {
  const Freekick world(params, defence);
  Recording out;
  out.log = empty_log({"x.ball_x_m", "x.ball_y_m", "u.plan", "z.goal", "m.goal", "sd.goal"}, kicks);
  const auto episodes = freekick_episodes(params, kicks, seed);
  for (std::size_t k = 0; k < kicks; ++k) {
    const FreekickEpisode &e = episodes[k];
    const auto plan =
        std::min(static_cast<std::size_t>(e.choice * kFreekickPlans), kFreekickPlans - 1);
    const double chance = world.chance(e.ball, plan), own = world.own_estimate(e.ball, plan);
    const double sd = std::sqrt(own * (1.0 - own));
    out.log.t_s.push_back(static_cast<double>(k));
    out.log.values.row(static_cast<Eigen::Index>(k)) << e.ball.x_m, e.ball.y_m,
        static_cast<double>(plan + 1), e.luck < chance ? 1.0 : 0.0, own, sd;
    out.finding.push_back(std::fabs(chance - own) > kFelt * sd ? 1 : 0);
  }
  number_rows(out.log);
  return out;
}

} // namespace rim::world
