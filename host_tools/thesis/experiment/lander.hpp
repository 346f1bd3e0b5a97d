// SPDX-License-Identifier: MIT
// The landing campaign: train on nominal landings, replay fresh nominal and faulty ones, count; and
// the thesis's own procedure (experiment/thesis_lander.hpp) on the same landings.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "train/trainer.hpp"
#include "thesis/shard.hpp"
#include "world/lander.hpp"

namespace rim::experiment {

struct LanderOptions {
  std::uint64_t seed = 101; // training runs 1.. of this seed; fresh runs are of seed + 1
  std::size_t training_runs = 50;
  std::size_t nominal_runs = 200;
  std::size_t fault_runs = 10; // of each of the faults in data/effects
  bool thesis = false;         // also run the thesis's own procedure: about 1 s a run
  TrainOptions train;
};

// The faults that ship in data/effects, in order.
std::vector<world::Effect> lander_faults(const world::LanderParams &params);

// What the monitor made of one landing.
struct LandingResult {
  bool alarmed = false;
  std::uint32_t row = 0; // rows until the alarm
  double t_s = 0.0;      // time of the alarm
  double score = 0.0;    // largest over the run
  std::string channel;   // named first in the alarm
  std::string kind;      // of the leading channel
};
// Replays one log through the flight code.
LandingResult fly(const std::vector<std::uint8_t> &image, const Log &log);

// Units: the nominal landings, then the runs of every fault. Training is done in every shard.
Campaign run_lander_campaign(const LanderOptions &options, const Shard &shard);
// Tables of a complete campaign, with 95 % intervals. DataError when it is of another kind.
void print_lander_campaign(const Campaign &campaign, std::FILE *to);

} // namespace rim::experiment
