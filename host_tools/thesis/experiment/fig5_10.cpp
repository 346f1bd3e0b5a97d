// SPDX-License-Identifier: MIT
#include "thesis/experiment/fig5_10.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "plan/planner.hpp"
#include "thesis/experiment/plan_figure.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "util/table.hpp"

namespace rim {
namespace {

constexpr const char *kKind = "fig5.10";
constexpr std::size_t kActions = 51; // aims along the goal line, posts included
constexpr std::size_t kWindow = 10;  // of the moving averages
constexpr double kAttained = 0.8;
constexpr std::size_t kFirstRuns = 40; // of the comparisons of late rewards
constexpr GoalieBehaviour kGoalies[] = {GoalieBehaviour::region, GoalieBehaviour::obstructed,
                                        GoalieBehaviour::overshoot};
constexpr std::size_t kGoalieCount = 3;
const char *const kPolicyNames[] = {"GP-UCB", "RIM-UCB", "RIM+GP-UCB"};

PlannerConfig planner_config(const GoalieParams &world, const GoaliePolicy &policy,
                             GoaliePolicyKind kind, std::size_t shots, std::uint64_t seed) {
  PlannerConfig c;
  c.state = {{world.ball_min_m, world.ball_max_m, 0}};
  c.action = {{-world.goal_half_m, world.goal_half_m, kActions}};
  rim_bandit_config &b = c.bandit;
  b.policy = kind == GoaliePolicyKind::gp    ? RIM_BANDIT_GP_UCB
             : kind == GoaliePolicyKind::rim ? RIM_BANDIT_RIM_UCB
                                             : RIM_BANDIT_RIM_GP_UCB;
  b.beta = policy.beta;
  b.schedule = RIM_BANDIT_BETA_DECAY;
  b.power = policy.power;
  b.smooth_var = policy.smooth_m * policy.smooth_m;
  b.unseen_var = policy.unseen_m * policy.unseen_m;
  b.gain = policy.gain;
  b.seed = seed;
  b.slices = static_cast<std::uint16_t>(policy.slices);
  b.gp.kernel = policy.kernel;
  b.gp.points = static_cast<std::uint16_t>(std::clamp<std::size_t>(shots, 8, RIM_GP_MAX_POINTS));
  b.gp.signal_var = policy.signal_m * policy.signal_m;
  b.gp.noise_var = policy.noise_m * policy.noise_m; // the nominal variance where that is larger
  b.gp.length[0] = policy.length_s_m;
  b.gp.length[1] = policy.length_a_m;
  b.extent.points = b.gp.points;
  b.extent.rims = static_cast<std::uint8_t>(policy.rims);
  b.extent.set = policy.set;
  b.extent.shape = policy.shape;
  b.extent.temper = policy.temper;
  b.extent.least_axis[0] = policy.least_s_m / (world.ball_max_m - world.ball_min_m);
  b.extent.most_axis[1] = policy.most_a_m / (2.0 * world.goal_half_m);
  b.extent.threshold = policy.threshold;
  b.extent.min_points = policy.min_points;
  b.extent.lambdas = static_cast<std::uint8_t>(policy.lambdas);
  b.extent.lambda_min = policy.lambda_min;
  b.extent.lambda_max = policy.lambda_max;
  b.extent.seed = seed;
  return c;
}

double action_at(const GoalieParams &p, std::size_t i) {
  return p.goal_half_m * (2.0 * static_cast<double>(i) / (kActions - 1) - 1.0);
}

// What the nominal model's favourite brings and what the best action would.
void add_bounds(const Goalie &world, double s_m, GoalieRun &run) {
  double favourite = -INFINITY, favourite_brings = 0.0, best = -INFINITY;
  for (std::size_t i = 0; i < kActions; ++i) {
    const double a_m = action_at(world.params(), i);
    const double brings = world.expected(s_m, a_m);
    best = std::max(best, brings);
    // The nominal reward is symmetric: of two favourites the mean of both counts.
    const double promise = world.nominal_mean(s_m, std::fabs(a_m));
    if (promise > favourite) {
      favourite = promise;
      favourite_brings = 0.5 * (brings + world.expected(s_m, -a_m));
    }
  }
  run.nominal.push_back(favourite_brings);
  run.best.push_back(best);
}

nlohmann::json policy_json(const GoaliePolicy &p) {
  return {{"beta", p.beta},
          {"power", p.power},
          {"signal_m", p.signal_m},
          {"noise_m", p.noise_m},
          {"length_s_m", p.length_s_m},
          {"length_a_m", p.length_a_m},
          {"kernel", p.kernel},
          {"set", p.set},
          {"shape", p.shape},
          {"threshold", p.threshold},
          {"lambda_min", p.lambda_min},
          {"lambda_max", p.lambda_max},
          {"temper", p.temper},
          {"least_s_m", p.least_s_m},
          {"most_a_m", p.most_a_m},
          {"smooth_m", p.smooth_m},
          {"unseen_m", p.unseen_m},
          {"gain", p.gain},
          {"min_points", p.min_points},
          {"rims", p.rims},
          {"slices", p.slices},
          {"lambdas", p.lambdas}};
}

using Runs = std::vector<GoalieRun>;

Runs runs_of(const Campaign &campaign, std::size_t goalie, std::size_t policy) {
  const std::size_t runs = campaign.config.at("runs");
  Runs out(runs);
  for (std::size_t i = 0; i < runs; ++i) {
    const nlohmann::json &unit = campaign.units.at((goalie * kGoaliePolicies + policy) * runs + i);
    out[i].reward = unit.at("reward").get<std::vector<double>>();
    out[i].expected = unit.at("expected").get<std::vector<double>>();
    out[i].nominal = unit.at("nominal").get<std::vector<double>>();
    out[i].best = unit.at("best").get<std::vector<double>>();
  }
  return out;
}

// Mean observed reward over the second half: shots 51 to 100 of 100.
std::vector<double> late_rewards(const Runs &runs) {
  std::vector<double> out;
  for (const GoalieRun &run : runs) {
    const std::size_t first = run.reward.size() / 2;
    double sum = 0.0;
    for (std::size_t t = first; t < run.reward.size(); ++t)
      sum += run.reward[t];
    out.push_back(sum / static_cast<double>(run.reward.size() - first));
  }
  return out;
}

// The first shot at which the runs' moving average over kWindow shots has 80 % of the attainable
// gain; one more than there are shots where it never has.
double shots_until(const Runs &runs, const std::vector<std::size_t> &pick) {
  const std::size_t shots = runs.front().reward.size();
  std::vector<double> gained(shots + 1, 0.0), attainable(shots + 1, 0.0);
  for (std::size_t t = 0; t < shots; ++t) {
    gained[t + 1] = gained[t];
    attainable[t + 1] = attainable[t];
    for (const std::size_t i : pick) {
      gained[t + 1] += runs[i].expected[t] - runs[i].nominal[t];
      attainable[t + 1] += runs[i].best[t] - runs[i].nominal[t];
    }
  }
  for (std::size_t t = kWindow; t <= shots; ++t) {
    if (gained[t] - gained[t - kWindow] >= kAttained * (attainable[t] - attainable[t - kWindow]))
      return static_cast<double>(t);
  }
  return static_cast<double>(shots + 1);
}

Bootstrapped difference(const std::vector<double> &a, const std::vector<double> &b,
                        std::size_t runs) {
  std::vector<double> d(std::min(runs, a.size()));
  for (std::size_t i = 0; i < d.size(); ++i)
    d[i] = a[i] - b[i];
  return bootstrap_mean(d);
}

// Of the first runs, and of all that there are.
std::string differences_text(const std::vector<double> &a, const std::vector<double> &b) {
  std::string text = fmt::format("first {} runs {} m", std::min(kFirstRuns, a.size()),
                                 interval_text(difference(a, b, kFirstRuns), 4));
  if (a.size() > kFirstRuns)
    text += fmt::format(", all {}", interval_text(difference(a, b, a.size()), 4));
  return text;
}

void print_comparison(std::size_t goalie, const std::array<Runs, kGoaliePolicies> &runs) {
  const auto gp = late_rewards(runs[0]), rim = late_rewards(runs[1]), both = late_rewards(runs[2]);
  if (kGoalies[goalie] == GoalieBehaviour::region) {
    std::printf("region: RIM+GP-UCB less GP-UCB, late shots: %s\n",
                differences_text(both, gp).c_str());
    const std::size_t n = gp.size();
    const Bootstrapped ratio = bootstrap(n, [&runs](const std::vector<std::size_t> &pick) {
      return shots_until(runs[1], pick) / shots_until(runs[0], pick);
    });
    // Where a policy never gets there the ratio is one of run lengths and says nothing.
    std::vector<std::size_t> every(n);
    for (std::size_t i = 0; i < n; ++i)
      every[i] = i;
    const double limit = static_cast<double>(runs[0].front().reward.size());
    const bool is_reached = shots_until(runs[1], every) <= limit;
    std::printf("region: shots until 80 %%, RIM-UCB over GP-UCB: %s\n",
                is_reached ? interval_text(ratio, 2).c_str() : "RIM-UCB never gets there");
    return;
  }
  const double mean_gp = bootstrap_mean(gp).value, mean_rim = bootstrap_mean(rim).value;
  const bool gp_better = mean_gp >= mean_rim;
  const std::vector<double> &better = gp_better ? gp : rim;
  std::printf("%s: RIM+GP-UCB less the better of the others (%s): %s\n",
              goalie_name(kGoalies[goalie]), kPolicyNames[gp_better ? 0 : 1],
              differences_text(both, better).c_str());
}

PlanPanel panel_of(std::size_t goalie, const std::array<Runs, kGoaliePolicies> &runs) {
  PlanPanel panel{fmt::format("{} goalie", goalie_name(kGoalies[goalie])),
                  "shots",
                  fmt::format("reward (m), mean of {} shots", kWindow),
                  {}};
  for (std::size_t p = 0; p < kGoaliePolicies; ++p) {
    std::vector<std::vector<double>> rewards;
    for (const GoalieRun &run : runs[p])
      rewards.push_back(run.reward);
    panel.curves.push_back(curve_of(kPolicyNames[p], rewards, kWindow));
  }
  return panel;
}

void add_rows(Table &table, std::size_t goalie, const std::array<Runs, kGoaliePolicies> &runs) {
  double nominal = 0.0, best = 0.0;
  for (const GoalieRun &run : runs[0]) {
    for (std::size_t t = run.best.size() / 2; t < run.best.size(); ++t) {
      nominal += run.nominal[t];
      best += run.best[t];
    }
  }
  const GoalieRun &one = runs[0].front();
  const double count =
      static_cast<double>(runs[0].size() * (one.best.size() - one.best.size() / 2));
  for (std::size_t p = 0; p < kGoaliePolicies; ++p) {
    const Bootstrapped until = bootstrap(runs[p].size(), [&](const std::vector<std::size_t> &pick) {
      return shots_until(runs[p], pick);
    });
    const bool is_reached = until.value <= static_cast<double>(one.reward.size());
    table.add({goalie_name(kGoalies[goalie]), kPolicyNames[p],
               interval_text(bootstrap_mean(late_rewards(runs[p])), 4),
               fmt::format("{:.4f}", nominal / count), fmt::format("{:.4f}", best / count),
               is_reached ? interval_text(until, 0) : "never"});
  }
}

} // namespace

GoaliePolicy default_goalie_policy(GoaliePolicyKind kind) {
  GoaliePolicy p;
  if (kind == GoaliePolicyKind::gp) {
    p.beta = 100.0;
    p.length_s_m = 1.5;
    return p;
  }
  p.min_points = 1.0;
  if (kind == GoaliePolicyKind::rim) {
    p.beta = 6.0;
    p.power = 1.5;
    p.signal_m = 0.9;
    p.length_s_m = 1.2;
    p.length_a_m = 0.17;
    p.kernel = RIM_GP_SQUARED_EXPONENTIAL;
    p.threshold = 3.0;
    p.smooth_m = 0.04;
    p.least_s_m = 1.0;
    p.most_a_m = 0.3;
    p.lambdas = 16;
    p.slices = 27;
    return p;
  }
  p.beta = 3.0;
  p.noise_m = 0.01;
  p.length_s_m = 1.5;
  p.length_a_m = 0.21;
  p.threshold = 3.0;
  p.smooth_m = 0.06;
  p.unseen_m = 1.1;
  p.gain = 5.0;
  p.lambdas = 12;
  p.slices = 18;
  return p;
}

GoalieRun run_goalie(const Goalie &world, const GoaliePolicy &policy, GoaliePolicyKind kind,
                     std::size_t shots, std::uint64_t seed) {
  Planner planner(planner_config(world.params(), policy, kind, shots, seed));
  GoalieRun run;
  PlanRequest request;
  request.state.resize(1);
  request.nominal.resize(kActions);
  request.var.resize(kActions);
  for (const GoalieEpisode &episode : goalie_episodes(world.params(), shots, seed)) {
    request.state[0] = episode.s_m;
    for (std::size_t i = 0; i < kActions; ++i) {
      const double a_m = action_at(world.params(), i);
      request.nominal[i] = world.nominal_mean(episode.s_m, a_m);
      const double sd = world.nominal_sd(episode.s_m, a_m);
      request.var[i] = sd * sd;
    }
    const PlanAnswer answer = *planner.choose(request);
    const double a_m = answer.action[0];
    run.reward.push_back(world.reward(episode.s_m, a_m, episode.error_rad));
    run.expected.push_back(world.expected(episode.s_m, a_m));
    add_bounds(world, episode.s_m, run);
    planner.observe(answer, run.reward.back());
  }
  return run;
}

Campaign run_fig5_10(const Fig510 &experiment, const Shard &shard) {
  Campaign campaign;
  campaign.kind = kKind;
  const GoalieParams params = read_goalie_params(data_path("goalie.toml"));
  campaign.config = {{"runs", experiment.runs},
                     {"shots", experiment.shots},
                     {"seed", experiment.seed},
                     {"policies", nlohmann::json::array()}};
  for (const GoaliePolicy &policy : experiment.policies)
    campaign.config["policies"].push_back(policy_json(policy));
  campaign.total = kGoalieCount * kGoaliePolicies * experiment.runs;
  compute_units(&campaign, shard, kKind, [&](std::uint64_t unit) {
    const std::size_t run = unit % experiment.runs;
    const std::size_t policy = unit / experiment.runs % kGoaliePolicies;
    const Goalie world(params, kGoalies[unit / experiment.runs / kGoaliePolicies]);
    const GoalieRun r =
        run_goalie(world, experiment.policies[policy], static_cast<GoaliePolicyKind>(policy),
                   experiment.shots, experiment.seed + run);
    return nlohmann::json{
        {"reward", r.reward}, {"expected", r.expected}, {"nominal", r.nominal}, {"best", r.best}};
  });
  return campaign;
}

void print_fig5_10(const Campaign &campaign, const std::string &plot) {
  require_whole(campaign, kKind);
  const std::size_t runs = campaign.config.at("runs"), shots = campaign.config.at("shots");
  const std::uint64_t seed = campaign.config.at("seed");
  std::printf(
      "fig. 5.10: %zu runs of seeds %llu-%llu, %zu shots each; late shots: %zu-%zu; run i of every "
      "policy sees the same states and noise, so differences are paired\n",
      runs, static_cast<unsigned long long>(seed), static_cast<unsigned long long>(seed + runs - 1),
      shots, shots / 2 + 1, shots);
  Table table({{"goalie", ""},
               {"policy", ""},
               {"late reward", "m, 95 %"},
               {"nominal", "m"},
               {"best", "m"},
               {"80 % of gain", "shots, 95 %"}});
  std::array<std::array<Runs, kGoaliePolicies>, kGoalieCount> all;
  std::vector<PlanPanel> panels;
  for (std::size_t g = 0; g < kGoalieCount; ++g) {
    for (std::size_t p = 0; p < kGoaliePolicies; ++p)
      all[g][p] = runs_of(campaign, g, p);
    add_rows(table, g, all[g]);
    panels.push_back(panel_of(g, all[g]));
  }
  table.print();
  for (std::size_t g = 0; g < kGoalieCount; ++g)
    print_comparison(g, all[g]);
  std::printf(
      "the thesis, 10 runs: region: RIM-UCB first, then RIM+GP-UCB, GP-UCB last; obstructed "
      "and overshoot: no difference beyond the intervals (p. 82-83)\n");
  if (!plot.empty())
    plot_panels(panels, plot);
}

} // namespace rim
