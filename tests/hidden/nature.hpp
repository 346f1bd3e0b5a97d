// SPDX-License-Identifier: MIT
// tests/hidden/nature.hpp - nature: vehicles that do not quite do what their simulation says.
//
// A case is a world (robot or lander), the logs of some runs with the simulation's one-step
// predictions beside what was measured, and none, one or two effects that the simulation does not
// know. Everything follows from a seed. Effects are stated in standard deviations (sd) of the
// measurement.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "world/random.hpp"

namespace nature {

using rim::world::Random;
using Row = std::vector<double>; // one value a feature, or a channel

struct Feature {
  std::string name; // as in the log: "s.speed_mps"
  bool command = false;
  bool angle = false;  // wrapped to (-pi, pi]
  bool region = false; // regions in two features are made of these
};

struct Channel {
  std::string name;           // "accel_mps2"
  double sd = 1.0;            // as stated in the log
  int velocity = -1;          // the feature that this channel accelerates; -1: none
  int command = -1;           // the command that drives it; -1: none
  bool tilts = false;         // gravity on a tilted floor shows here
  std::vector<int> couplings; // features of other axes, and other axes' commands
  bool logged = false;
};

// A smooth quantity with nothing to do with anything.
struct Wave {
  double middle = 0.0, slope = 0.0;
  std::array<double, 3> amplitude{}, rate{}, phase{};
  double at(double t_s) const;
  // Around `middle`, within about `span`, three periods between log_s / 7 and log_s / 2.
  static Wave draw(Random &random, double middle, double span, double log_s);
};

class World {
public:
  virtual ~World() = default;
  std::string name;
  double dt_s = 0.1;
  std::vector<Feature> features;
  std::vector<Channel> channels;
  int altitude = -1, heading = -1; // features; -1: the world has none

  // A new log of about so many rows.
  virtual void start(Random &random, std::size_t rows) = 0;
  // The commands of the present row, from state and time.
  virtual void command(Random &random) = 0;
  // The row as logged, in the order of `features`.
  virtual Row observe() const = 0;
  // The simulation: mean of a channel from the logged row alone.
  virtual double predict(std::size_t channel, const Row &x) const = 0;
  // Goes on by dt_s with what truly happened in each channel.
  virtual void advance(const Row &truth) = 0;
};

std::unique_ptr<World> draw_robot(Random &random);
std::unique_ptr<World> draw_lander(Random &random);
double wrapped(double angle_rad); // (-pi, pi]

// Where an effect acts; no feature: everywhere.
struct Gate {
  std::vector<std::size_t> features;
  std::vector<double> lower, upper;
  bool ellipse = false; // inscribed in the box
  bool contains(const Row &x) const;
};

enum class Kind { mean, variance, dropout, stuck };

struct Effect {
  std::string family; // one of families()
  std::string cause;  // what a diagnosis should call it
  Kind kind = Kind::mean;
  std::size_t channel = 0;
  Gate gate;
  double size = 1.0;           // of the basis, in the channel's unit; variance: the ratio
  int first = -1, second = -1; // features of the form
  double shape = 0.0;          // level, phase, scale height in m, centre
  double width = 0.0;          // of a bump or wiggle
  int order = 0;               // harmonic; delay in rows
  double share = 0.0;          // dropout, stuck: share of the rows
  double strength = 0.0;       // rms in sd where it acts
};

struct Case {
  std::uint64_t seed = 0;
  std::string family; // what was drawn: a family, "two", or the name of a null
  std::uint64_t attempt = 0;
  std::unique_ptr<World> world;
  std::vector<Effect> effects;
  std::string noise = "white";
  double noise_parameter = 0.0; // AR coefficient, step in sd, degrees of freedom, sd factor
  std::vector<std::size_t> run_rows, holdout_rows;
  std::size_t logs() const { return run_rows.size() + holdout_rows.size(); }
};

struct Record { // one log
  std::vector<double> t_s;
  std::vector<Row> x;
  std::vector<Row> m, truth, z;         // [channel][row]
  std::vector<Row> effect;              // [channel][row]: (truth - m) / sd
  std::vector<Row> ratio;               // [channel][row]: of the variance
  std::vector<std::vector<char>> fault; // [channel][row]: the value is no measurement
  std::size_t rows() const { return t_s.size(); }
};

// nature_effect.cpp
// The value that `size` multiplies, without the gate. `old` is the row whose commands act in a
// delay.
double basis(const Effect &effect, const World &world, const Row &x, const Row &old, double m,
             double t_s);
Record simulate(const Case &c, std::size_t log, bool with_effects);

// nature_draw.cpp
struct Family {
  const char *name, *cause, *what;
};
const std::vector<Family> &families(); // effects
const std::vector<Family> &nulls();
// A family's name, a null's name, "null", "two", "any" or "each". std::runtime_error: unknown, or
// no fair case within 4000 attempts.
Case draw_case(std::uint64_t seed, const std::string &family, std::vector<Record> &records);

// nature_fair.cpp
struct Fairness {
  double llr = 0.0;    // ln likelihood ratio, in expectation, of the true form against nothing
  std::string rival;   // the cause of another name that comes nearest
  double margin = 0.0; // by how much it falls short of the truth, in expectation
  double share = 0.0;  // of rows on which the effect acts
  std::string unfair;  // why not; empty: fair
};
// Of effect number `k`, over the run logs.
Fairness judge(const Case &c, const std::vector<Record> &records, std::size_t k);

// nature_write.cpp
void write_logs(const Case &c, const std::vector<Record> &records, const std::string &folder);
void write_truth(const Case &c, const std::vector<Record> &records, const std::string &path);

} // namespace nature
