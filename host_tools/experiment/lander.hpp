// The landing campaign: train on nominal landings, replay fresh nominal and faulty ones, count.
#ifndef RIM_EXPERIMENT_LANDER_HPP
#define RIM_EXPERIMENT_LANDER_HPP

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "train/trainer.hpp"
#include "world/lander.hpp"

namespace rim::experiment {

struct LanderOptions {
  std::uint64_t seed = 1;         // training runs 1.. of this seed; fresh runs are of seed + 1
  std::size_t training_runs = 50;
  std::size_t nominal_runs = 200;
  std::size_t fault_runs = 10;
  TrainOptions train;
};

// What the monitor made of one landing.
struct LandingResult {
  bool alarmed = false;
  double row = 0.0;         // rows until the alarm (rows in all when none)
  double t_s = 0.0;         // time of the alarm
  double score = 0.0;       // largest score over the run
  std::string channel;      // named first in the alarm
  std::string kind;         // of the leading channel
  bool sensor_named = false; // first named channel is the one the effect hits
};

struct FaultSummary {
  std::string name;
  std::string sensor; // column that the effect hits; empty: physics
  std::vector<LandingResult> runs;
  std::size_t found() const;
};

// The twelve faults that ship in data/effects, in order.
std::vector<world::Effect> lander_faults(const world::LanderParams &params);

// Log of one landing of the world, nominal without effects.
Log lander_log(const world::LanderParams &params, const std::vector<world::Effect> &effects,
               std::uint64_t seed, std::uint64_t run);

// Replays one log through the flight code.
LandingResult fly(const std::vector<std::uint8_t> &image, const Log &log, const std::string &sensor);

struct LanderCampaign {
  Training training;
  std::vector<LandingResult> nominal;
  std::vector<FaultSummary> faults;
  double seconds_training = 0.0;
};
LanderCampaign run_lander_campaign(const LanderOptions &options);
void print_lander_campaign(const LanderCampaign &campaign, const LanderOptions &options,
                           std::FILE *to);

} // namespace rim::experiment
#endif
