// SPDX-License-Identifier: MIT
// world/golf.hpp - the golf world (thesis 3.5.1 p37 and 4.2.3 p55): a robot putts towards a hole
// from places spread uniformly over a field; an unperceived bump spoils the shots taken from
// behind it.
//
// Field: origin at the lower left corner, x along its length (6 m), y along its width (4 m); the
// target is the middle of the right side, (6, 2).
//
// Continuous variant (4.2.3): reward r = 1 - 0.5 d / length + N(0, 0.1^2) (eq. 4.8), less 0.2 from
// behind the bump. The bump is perpendicular to the line from the target to its centre, which lies
// at 5-75 % of the field's length in direction 135-235 deg; it subtends pi/8 .. pi/7 at the target.
// Binary variant (3.5.1): success with probability p, with q behind the bump; the bump's centre is
// 0.1-1.5 m from the target in any direction, it subtends pi/16 .. pi/4 and is turned by up to
// 45 deg from the perpendicular (the thesis draws it from "the set of line obstructions" with these
// limits and does not say how far it may be turned).
//
// Bumps are drawn again only when the centre lies outside the field or when the region behind the
// bump holds under 3 % of the field's area (with such a region 30 anomalous shots take over 1000).
// The thesis does not mention the second rule; `min_region_fraction = 0` switches it off.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "world/random.hpp"

namespace rim {

struct GolfShot {
  std::vector<double> x;  // the context, dims values; the place of the shot among them
  double z = 0.0;         // the reward received
  double m = 0.0;         // the reward the robot's own model expects
  double sd = 0.0;        // and its standard deviation
  bool anomalous = false; // truth: taken from behind the bump
};

enum class GolfVariant { continuous, binary };

struct GolfParams {
  double length_m = 6.0;
  double width_m = 4.0;
  double reward_at_target = 1.0;
  double reward_slope = 0.5; // lost over one field length of distance
  double noise_sd = 0.1;
  double shift = -0.2;         // added to the expected reward behind the bump
  double success = 0.8;        // p: binary variant, nominal
  double success_behind = 0.5; // q: binary variant, behind the bump (0.2 and up in the thesis)
  double min_distance_fraction = 0.05; // continuous: bump's centre, of the field's length
  double max_distance_fraction = 0.75;
  double min_direction_deg = 135.0;
  double max_direction_deg = 235.0;
  double min_subtended_rad = 0.39269908169872414; // pi/8
  double max_subtended_rad = 0.44879895051282759; // pi/7
  double binary_min_distance_m = 0.1;
  double binary_max_distance_m = 1.5;
  double binary_min_subtended_rad = 0.19634954084936207; // pi/16
  double binary_max_subtended_rad = 0.78539816339744828; // pi/4
  double binary_max_tilt_rad = 0.78539816339744828;      // pi/4
  double min_region_fraction = 0.03;
};

struct GolfOptions {
  GolfVariant variant = GolfVariant::continuous;
  std::size_t dims = 2;       // at least 2
  bool bump = true;           // false: every shot is nominal
  bool better = false;        // continuous: shots from behind the bump gain what they would lose
                              // (fig. 5.1b: a region to seek, not to avoid)
  std::size_t anomalous = 30; // with a bump: shots from behind it after which the run ends
  std::size_t shots = 1000;   // without a bump: the run's length
  std::size_t max_shots = 0;  // ends a run early whatever happened; 0: no limit
};

// A half plane {p : normal . p >= offset}.
struct GolfHalfPlane {
  double normal_x, normal_y, offset;
};

// The bump of a run. The region behind it is the part of the field in all three half planes.
struct GolfBump {
  std::array<double, 2> centre_m{};
  std::array<std::array<double, 2>, 2> ends_m{};
  double distance_m = 0.0;    // from the target to the centre
  double direction_rad = 0.0; // of the centre, seen from the target
  double subtended_rad = 0.0;
  double tilt_rad = 0.0;
  std::array<GolfHalfPlane, 3> behind{};
  double area_fraction = 0.0; // of the region, of the field's area
};

// One run of the world: the same (params, options, seed, run) give the same shots.
class Golf {
public:
  // Throws std::invalid_argument where dims < 2 or the parameters allow no bump.
  Golf(const GolfParams &params, const GolfOptions &options, std::uint64_t seed,
       std::uint64_t run = 1);

  bool done() const; // the run is over; next() may still be called
  GolfShot next();
  std::vector<GolfShot> all(); // the rest of the run

  const GolfBump &bump() const { return bump_; }
  // Which of the dims hold the place of the shot: x[features()[0]] is x, x[features()[1]] is y.
  std::array<std::size_t, 2> features() const { return features_; }
  bool is_behind(double x_m, double y_m) const;
  double expected(double x_m, double y_m) const;
  std::size_t shots() const { return shots_; }
  std::size_t anomalous() const { return anomalous_; }

private:
  GolfParams params_;
  GolfOptions options_;
  world::Random random_;
  GolfBump bump_;
  std::array<std::size_t, 2> features_{};
  std::size_t shots_ = 0;
  std::size_t anomalous_ = 0;
};

} // namespace rim
