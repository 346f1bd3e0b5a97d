// SPDX-License-Identifier: MIT
// rim plan: states and rewards on stdin or LCM, actions on stdout: a planner's partner process.
#include "bus/lcm_bus.hpp"
#include "cli/arguments.hpp"
#include "cli/command.hpp"
#include "plan/session.hpp"
#include "util/error.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iostream>
#include <map>

namespace {

using rim::PlanAxis;
using rim::PlannerConfig;
using rim::PlanSession;

volatile std::sig_atomic_t stopped = 0;
void stop(int) { stopped = 1; }

const std::map<std::string, std::uint8_t> kPolicies = {{"gp", RIM_BANDIT_GP_UCB},
                                                       {"rim", RIM_BANDIT_RIM_UCB},
                                                       {"rim+gp", RIM_BANDIT_RIM_GP_UCB},
                                                       {"bank", RIM_BANDIT_BANK}};
const std::map<std::string, std::uint8_t> kKernels = {{"se", RIM_GP_SQUARED_EXPONENTIAL},
                                                      {"matern32", RIM_GP_MATERN_3_2},
                                                      {"matern52", RIM_GP_MATERN_5_2}};
const std::map<std::string, std::uint8_t> kSchedules = {{"constant", RIM_BANDIT_BETA_CONSTANT},
                                                        {"log", RIM_BANDIT_BETA_LOG},
                                                        {"decay", RIM_BANDIT_BETA_DECAY}};
const std::map<std::string, std::uint8_t> kRisks = {{"neutral", RIM_BANDIT_NEUTRAL},
                                                    {"mean-sd", RIM_BANDIT_MEAN_SD},
                                                    {"bounded", RIM_BANDIT_BOUNDED},
                                                    {"probability", RIM_BANDIT_PROBABILITY}};

const std::map<std::string, std::uint8_t> kSets = {{"volume", RIM_EXTENT_BY_VOLUME},
                                                   {"sampled", RIM_EXTENT_SAMPLED}};
const std::map<std::string, std::uint8_t> kShapes = {{"ellipsoid", RIM_EXTENT_ELLIPSOID},
                                                     {"box", RIM_EXTENT_BOX}};

PlanAxis axis_of(const std::string &text, bool counted) {
  PlanAxis axis;
  char rest = 0;
  const int found =
      counted ? std::sscanf(text.c_str(), "%lf:%lf:%u%c", &axis.low, &axis.high, &axis.count, &rest)
              : std::sscanf(text.c_str(), "%lf:%lf%c", &axis.low, &axis.high, &rest);
  if (found != (counted ? 3 : 2) || !std::isfinite(axis.low) || !std::isfinite(axis.high))
    throw rim::UsageError(
        fmt::format("'{}' is not {}", text, counted ? "LOW:HIGH:COUNT" : "LOW:HIGH"));
  return axis;
}

struct Options {
  std::vector<std::string> state, action;
  std::vector<double> length;
  std::string policy = "rim+gp", kernel = "matern52", schedule = "constant", risk = "neutral",
              set = "sampled", shape = "ellipsoid";
  double beta = 2.0, power = 1.0, signal_sd = 1.0, noise_sd = 0.1, aversion = 0.0, level = 0.0,
         bound = 0.95, smooth_sd = 0.0, unseen_sd = 0.0, gain = 0.0;
  unsigned plans = 0, features = 0, points = 256;
  std::uint64_t seed = 1;
  std::string lcm;
  double seconds = 0.0;
};

const char *const kFooter =
    "Each line of stdin is a state, a reward or an experience from before, as JSON or CSV:\n"
    "  {\"id\": 7, \"state\": [0.4], \"nominal\": [...], \"var\": [...], \"allowed\": [...]}\n"
    "  {\"id\": 7, \"actions\": [[0.4, 0.1], [0.4, 0.2]]}     features of state and action\n"
    "  {\"id\": 7, \"reward\": 0.3}                           without id: of the last answer\n"
    "  {\"x\": [0.4, 0.1], \"reward\": 0.3}                   also nominal, var, plan\n"
    "  state,0.4\n"
    "  reward,0.3\n"
    "Each state is answered at once by one JSON line; action null: none is allowed. A line that\n"
    "cannot be used is reported on stderr, counted and skipped; the exit status is 3 if none "
    "could\n"
    "be used.\n\n"
    "Examples: from a bus, on which the robot sends RIM_OBSERVATION, and from a pipe\n"
    "  rim plan --state 0:1 --action -1:1:21 --lcm 'udpm://239.255.76.67:7667?ttl=0'\n"
    "  printf 'state,0.4\\nreward,0.9\\nstate,0.5\\n' | rim plan --state 0:1 --action -1:1:21";

void declare_run(rim::cli::Arguments &app, Options &o) {
  app.add_option("--points", o.points, "number of experiences kept, 8 to 512 (default 256)");
  app.add_option("--seed", o.seed,
                 "seed of the region search and of draws among equal actions (default 1)");
  app.add_option(
         "--lcm", o.lcm,
         "LCM URL: read states from RIM_OBSERVATION instead of stdin. A message holds the\n"
         "numbers of the state, then the reward of the previous answer (NaN or absent: none)")
      ->type_name("URL");
  app.add_option("--seconds", o.seconds, "LCM: end after this many seconds (0: never)")
      ->check(rim::cli::non_negative_number());
}

void declare(rim::cli::Arguments &app, Options &o) {
  app.add_option("--policy", o.policy, "gp, rim, rim+gp (default) or bank")
      ->check(rim::cli::is_member(kPolicies));
  app.add_option("--state", o.state, "LOW:HIGH of one number of the state; give it once per number")
      ->type_name("RANGE");
  app.add_option("--action", o.action,
                 "LOW:HIGH:COUNT of one number of the action; give it once per number")
      ->type_name("GRID");
  app.add_option("--plans", o.plans, "bank: number of plans to choose from");
  app.add_option("--features", o.features,
                 "numbers per action, when the actions come with every state (without --state\n"
                 "and --action)");
  app.add_option("--kernel", o.kernel, "se, matern32 or matern52 (default)")
      ->check(rim::cli::is_member(kKernels));
  app.add_option("--length", o.length,
                 "length scale of the kernel, once per number (default: a fifth of its range)")
      ->check(rim::cli::positive_number());
  app.add_option("--signal-sd", o.signal_sd,
                 "prior sd of the deviation from the nominal reward (default 1)")
      ->check(rim::cli::non_negative_number());
  app.add_option("--noise-sd", o.noise_sd, "observation noise sd of a reward (default 0.1)")
      ->check(rim::cli::non_negative_number());
  app.add_option("--beta", o.beta,
                 "weight of the uncertainty in the choice; 0 explores nothing (default 2)");
  app.add_option("--schedule", o.schedule, "how beta changes: constant (default), log or decay")
      ->check(rim::cli::is_member(kSchedules));
  app.add_option("--power", o.power,
                 "decay: beta is divided by the number of the choice to this power (default 1)");
  app.add_option("--risk", o.risk, "neutral (default), mean-sd, bounded or probability")
      ->check(rim::cli::is_member(kRisks));
  app.add_option("--aversion", o.aversion, "mean-sd: number of standard deviations to subtract");
  app.add_option("--level", o.level, "bounded, probability: the reward to exceed");
  app.add_option("--bound", o.bound,
                 "bounded: least probability of exceeding --level (default 0.95)");
  app.add_option("--extent", o.set,
                 "rim, rim+gp: how the candidate regions are drawn: sampled (default) by their\n"
                 "likelihood, or by volume")
      ->check(rim::cli::is_member(kSets));
  app.add_option("--shape", o.shape,
                 "rim, rim+gp: ellipsoid (default) or box, which may be sheared")
      ->check(rim::cli::is_member(kShapes));
  app.add_option("--smooth-sd", o.smooth_sd,
                 "rim, rim+gp: sd of deviations too small to make a region")
      ->check(rim::cli::non_negative_number());
  app.add_option("--unseen-sd", o.unseen_sd,
                 "rim+gp: prior sd of the deviation in a region that has not been visited")
      ->check(rim::cli::non_negative_number());
  app.add_option(
      "--gain", o.gain,
      "rim+gp: least improvement of the log likelihood (in nats) by which regions must beat\n"
      "the Gaussian process alone (default 0)");
  declare_run(app, o);
  app.footer(kFooter);
}

// One for every number of a state and an action; a bank's plans have none of their own.
void set_lengths(const Options &o, PlannerConfig *c) {
  const std::size_t actions = o.policy == "bank" ? 0 : c->action.size();
  const std::size_t wanted = c->features > 0 ? c->features : c->state.size() + actions;
  if (!o.length.empty() && o.length.size() != wanted)
    throw rim::UsageError(
        fmt::format("--length: {} given, {} needed, one per number", o.length.size(), wanted));
  for (std::size_t d = 0; d < o.length.size() && d < RIM_GP_MAX_DIMS; ++d)
    c->bandit.gp.length[d] = o.length[d];
}

PlannerConfig config_of(const Options &o) {
  PlannerConfig c;
  for (const std::string &text : o.state)
    c.state.push_back(axis_of(text, false));
  for (const std::string &text : o.action)
    c.action.push_back(axis_of(text, true));
  c.features = o.features;
  if (o.features > 0 && !(o.state.empty() && o.action.empty()))
    throw rim::UsageError("--features goes without --state and --action");
  if (o.points < 8 || o.points > RIM_GP_MAX_POINTS)
    throw rim::UsageError(fmt::format("--points: 8 to {}", RIM_GP_MAX_POINTS));
  if ((o.policy == "bank") != (o.plans > 0) || o.plans > RIM_BANDIT_MAX_PLANS)
    throw rim::UsageError(fmt::format("--policy bank goes with --plans 1 to {}, no other does",
                                      RIM_BANDIT_MAX_PLANS));
  rim_bandit_config &b = c.bandit;
  b.policy = kPolicies.at(o.policy);
  b.schedule = kSchedules.at(o.schedule);
  b.risk = kRisks.at(o.risk);
  b.plans = static_cast<std::uint8_t>(o.plans);
  b.beta = o.beta;
  b.power = o.power;
  b.aversion = o.aversion;
  b.level = o.level;
  b.bound = o.bound;
  b.smooth_var = o.smooth_sd * o.smooth_sd;
  b.unseen_var = o.unseen_sd * o.unseen_sd;
  b.gain = o.gain;
  b.seed = b.extent.seed = o.seed;
  b.extent.set = kSets.at(o.set);
  b.extent.shape = kShapes.at(o.shape);
  b.gp.kernel = kKernels.at(o.kernel);
  b.gp.points = b.extent.points = static_cast<std::uint16_t>(o.points);
  b.gp.signal_var = o.signal_sd * o.signal_sd;
  b.gp.noise_var = o.noise_sd * o.noise_sd;
  set_lengths(o, &c);
  return c;
}

void listen(PlanSession &session, const Options &options) {
  using Clock = std::chrono::steady_clock;
  rim::LcmBus bus(options.lcm);
  bus.on_observation = [&](const rim_observation_message &message) { session.take(message); };
  std::signal(SIGINT, stop);
  std::signal(SIGTERM, stop);
  const auto start = Clock::now();
  const std::chrono::duration<double> limit(options.seconds);
  while (stopped == 0 && !bus.ended() &&
         (!(options.seconds > 0.0) || Clock::now() - start < limit))
    bus.receive(100);
}

void read_lines(PlanSession &session) {
  std::string text;
  for (unsigned long long row = 1; std::getline(std::cin, text); ++row) {
    if (!text.empty() && text.back() == '\r')
      text.pop_back();
    if (text.find_first_not_of(" \t") != std::string::npos)
      session.take(text, row);
  }
  if (std::cin.bad())
    throw rim::DataError("stdin: read failed");
}

int cmd_plan(int argc, char **argv) {
  Options options;
  rim::cli::Arguments app{
      "Choose actions while parts of the model are uncertain, by upper confidence bounds "
      "with Gaussian processes and regions of inaccurate modeling.",
      "rim plan"};
  declare(app, options);
  if (!app.parse(argc, argv))
    return rim::EXIT_FINE;
  PlanSession session(config_of(options));
  if (options.lcm.empty())
    read_lines(session);
  else
    listen(session, options);
  session.finish();
  return rim::EXIT_FINE;
}

} // namespace

RIM_COMMAND(plan, "choose actions under model uncertainty: states in, actions out", cmd_plan)
