// SPDX-License-Identifier: MIT
// Measured Falcon 9 landings: one flight left out, the others trained on, faults put into the one.
#pragma once

#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "train/trainer.hpp"

namespace rim::experiment {

// A fault of a sensor, put into the file's own fields before the schema reads them, and quantised
// as the sensor is.
struct FalconFault {
  enum class Kind { none, altitude_bias, speed_gain, altitude_stuck };
  Kind kind = Kind::none;
  double size = 0.0;                   // m, share, s
  double from_mps = 0.0, to_mps = 1e9; // speed_gain: band of the true speed
  double at_share = 0.5;               // altitude_stuck: when, as a share of the kept rows' time
  std::string name;
};
std::vector<FalconFault> falcon_faults();

struct FalconOptions {
  std::string data;                 // folder of the logs
  std::vector<std::string> exclude; // missions not used at all
  TrainOptions train;
  // Blocks of which 3 s hold six.
  FalconOptions() { train.blocking.block_s = 0.5; }
};

struct FalconCell {
  bool alarmed = false;
  double t_s = 0.0;    // of the first alarm
  double share = 0.0;  // largest score over the alarm score
  std::string outcome; // named first
};

struct FalconFlight {
  std::string mission;
  std::size_t rows = 0;
  double promised = 1.0;
  std::vector<double> rmse;      // of the model from other sensors, per outcome, runs left out
  std::vector<FalconCell> cells; // per fault
};

struct FalconCampaign {
  std::vector<FalconFault> faults; // the first is none
  std::vector<std::string> outcomes, units;
  std::vector<FalconFlight> flights;
};

// Some seconds. DataError when there is no folder, or it lacks missions.csv or a flight.
FalconCampaign run_falcon(const FalconOptions &options);
void print_falcon(const FalconCampaign &campaign, std::FILE *to);

} // namespace rim::experiment
