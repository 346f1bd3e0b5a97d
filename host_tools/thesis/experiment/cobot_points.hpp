// SPDX-License-Identifier: MIT
// thesis/experiment/cobot_points.hpp - drives of the service robot as observations for the region
// search: what table 3.1 and figures 4.10, 4.11 of the thesis are measured on.
//
// Data point. One observation of the motion: the mean over half a second, 10 rows of the 20 Hz log.
// The thesis does not say how long one of its own takes; at half a second an encoder that loses 5 %
// adds .44 nats a point to the measure of eq. 3.7 and a corridor's .62, against 40.2 / 58 = .69 and
// 40.2 / 60 = .67 in table 3.1, so that a point tells no more than one of the thesis's. What is
// counted until the alarm are the points inside the true region (as in fig. 3.3b). A robot that is
// not told to move and has come to rest gives none.
//
// Nominal model. Velocity from the commands in force and the limits of acceleration alone (eq. 4.10
// from the predicted instead of the measured velocity: a shift that lasts does not vanish into its
// own next prediction), turned into the speeds of the four wheels. A wheel's residual is the
// encoder's speed less that.
//
// Channels. A channel is a direction e in the space of the four wheels, what some cause does to
// them: a wheel's speed misjudged by a share (four), all by one share (slower or faster than told),
// a drift sideways, a turn, and the pattern of the four that no motion makes. With S the nominal
// covariance x = e' S^-1 r is the score of that cause in a point and w = e' S^-1 e its variance:
// the sufficient statistics of rim/stats.h, most likely size sum x / sum w. S is taken from 2-s
// means, so that noise that lasts is counted as what it does to a region.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "world/cobot.hpp"

namespace rim {

enum class CobotCase { nominal, encoder, collision, corridor, left_turn };
const char *cobot_case_name(CobotCase which);

constexpr std::size_t kCobotWheels = 4;
constexpr std::size_t kCobotChannels = 8;  // four wheels, all, sideways, turn, inconsistency
constexpr std::size_t kCobotAllWheels = 4; // the last whose cause is a share of the speed
constexpr std::size_t kCobotPointRows = 10;
// Features that tell the speed: the commands, the battery under load, the edge that is followed.
constexpr std::size_t kCobotFirstMotion = 4, kCobotLastMotion = 10;
using CobotWheels = std::array<double, kCobotWheels>;

struct CobotDrive {
  std::size_t dims = 0;               // 7, 15, 30 or 100 (4.2.4)
  std::vector<double> u;              // [n][dims] unit features
  std::vector<CobotWheels> slip;      // residual of each wheel, m/s
  std::vector<CobotWheels> predicted; // speed of each wheel, m/s
  std::vector<bool> is_ramp;          // the prediction changes, or did just before
  std::vector<bool> anomalous;        // truth
  std::size_t size() const { return slip.size(); }
  std::size_t anomalies() const;
};

// A drive of so many seconds; a function of its arguments alone. The effect's free parameters are
// drawn from the seed: the wheel; a corridor that holds 15 to 60 % of the drive, or where there is
// none the one that holds most; the time of the collision, which lasts until the end. Truth: the
// rows on which the effect acts; of the encoder, whose region is the whole domain, every point.
// Throws DataError without data/cobot.toml, UsageError for dims.
CobotDrive drive_cobot(CobotCase which, std::size_t dims, double seconds, std::uint64_t seed);

// Of the experiments: three minutes (4.2.4), and the nominal ones that show what is normal, the
// first of a campaign's seeds.
constexpr double kCobotDrive_s = 180.0;
constexpr std::size_t kCobotNominal = 24;
std::vector<CobotDrive> nominal_drives(std::uint64_t first_seed);

struct CobotScores {
  std::vector<double> x, w; // [n][kCobotChannels]
};

// What nominal drives scatter: S, its growth while the prediction changes, and the variance b of a
// whole drive's offset in each channel.
class CobotScatter {
public:
  // Throws DataError where there is too little driving.
  explicit CobotScatter(const std::vector<CobotDrive> &nominal);

  CobotScores scores(const CobotDrive &drive) const;
  // [n][kCobotChannels]: x / sqrt w, nominal variance 1, less where w is far below its mean;
  // clipped.
  std::vector<double> residuals(const CobotScores &scores) const;
  // [n][kCobotChannels]: what a unit of size adds to a residual before it is clipped.
  std::vector<double> slopes(const CobotScores &scores) const;
  double mean_weight(std::size_t channel) const { return mean_weight_[channel]; }

  // Of the size sum x / sum w over a whole drive, beyond 1 / sum w.
  double size_variance(std::size_t channel) const {
    return offset_variance_[channel] / mean_weight_[channel];
  }

  // Of one wheel's residual in a point, m/s. A wheel that turns slower than that cannot be told
  // from one that stands.
  double wheel_deviation() const { return wheel_deviation_; }

private:
  void measure_offsets(const std::vector<CobotDrive> &nominal);
  double floored(double w, std::size_t channel) const;

  std::array<CobotWheels, kCobotWheels> precision_{};
  std::array<double, kCobotChannels> mean_weight_{};
  std::array<double, kCobotChannels> offset_variance_{};
  double wheel_deviation_ = 0.0;
  double ramp_precision_ = 1.0; // of S^-1 while the prediction changes, a share
};

// [n][3]: forward, sideways and turning velocity less its prediction over its nominal deviation, as
// in the thesis's eq. 3.7 with a diagonal covariance; sd from the same nominal drives.
std::vector<double> thesis_residuals(const CobotDrive &drive, const std::array<double, 3> &sd);
std::array<double, 3> thesis_deviations(const std::vector<CobotDrive> &nominal);

} // namespace rim
