// SPDX-License-Identifier: MIT
#include "world/golf.hpp"

#include <cmath>
#include <stdexcept>

namespace rim {
namespace {

constexpr double kPi = 3.141592653589793;
constexpr std::uint64_t kBumpStream = 1;
constexpr std::uint64_t kFeatureStream = 2;
constexpr std::uint64_t kShotStream = 3;
constexpr int kMaxDraws = 100000; // far beyond need: some 1 in 3 draws is accepted

using Point = std::array<double, 2>;
using Polygon = std::vector<Point>;

double side(const GolfHalfPlane &plane, const Point &p) {
  return plane.normal_x * p[0] + plane.normal_y * p[1] - plane.offset;
}

// Sutherland and Hodgman, one half plane.
Polygon clip(const Polygon &polygon, const GolfHalfPlane &plane) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i];
    const Point &b = polygon[(i + 1) % polygon.size()];
    const double side_a = side(plane, a);
    const double side_b = side(plane, b);
    if (side_a >= 0.0)
      kept.push_back(a);
    if ((side_a >= 0.0) != (side_b >= 0.0)) {
      const double s = side_a / (side_a - side_b);
      kept.push_back({a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])});
    }
  }
  return kept;
}

double area(const Polygon &polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point &a = polygon[i];
    const Point &b = polygon[(i + 1) % polygon.size()];
    twice += a[0] * b[1] - b[0] * a[1];
  }
  return std::fabs(twice) / 2.0;
}

// The half plane bounded by the line through a and b that contains `inside`.
GolfHalfPlane through(const Point &a, const Point &b, const Point &inside) {
  GolfHalfPlane plane{a[1] - b[1], b[0] - a[0], 0.0};
  const double norm = std::hypot(plane.normal_x, plane.normal_y);
  plane.normal_x /= norm;
  plane.normal_y /= norm;
  plane.offset = plane.normal_x * a[0] + plane.normal_y * a[1];
  if (side(plane, inside) < 0.0) {
    plane = {-plane.normal_x, -plane.normal_y, -plane.offset};
  }
  return plane;
}

struct Limits {
  double distance_min_m, distance_max_m, direction_min_rad, direction_max_rad;
  double subtended_min_rad, subtended_max_rad, tilt_max_rad;
};

Limits limits_of(const GolfParams &p, GolfVariant variant) {
  if (variant == GolfVariant::binary) {
    return {p.binary_min_distance_m,
            p.binary_max_distance_m,
            0.5 * kPi,
            1.5 * kPi,
            p.binary_min_subtended_rad,
            p.binary_max_subtended_rad,
            p.binary_max_tilt_rad};
  }
  const double degree = kPi / 180.0;
  return {p.min_distance_fraction * p.length_m,
          p.max_distance_fraction * p.length_m,
          p.min_direction_deg * degree,
          p.max_direction_deg * degree,
          p.min_subtended_rad,
          p.max_subtended_rad,
          0.0};
}

// Half the length of a bump that subtends phi at distance D, turned by tau from the perpendicular:
// tan phi = 2 D h cos(tau) / (D^2 - h^2), solved for h > 0.
double half_length_m(double distance_m, double subtended_rad, double tilt_rad) {
  const double tan_phi = std::tan(subtended_rad);
  const double cos_tau = std::cos(tilt_rad);
  return distance_m * (std::sqrt(cos_tau * cos_tau + tan_phi * tan_phi) - cos_tau) / tan_phi;
}

GolfBump place_bump(const GolfParams &p, const Limits &limits, world::Random &random) {
  const Point target{p.length_m, p.width_m / 2.0};
  GolfBump bump;
  bump.distance_m = random.uniform(limits.distance_min_m, limits.distance_max_m);
  bump.direction_rad = random.uniform(limits.direction_min_rad, limits.direction_max_rad);
  bump.subtended_rad = random.uniform(limits.subtended_min_rad, limits.subtended_max_rad);
  bump.tilt_rad = random.uniform(-limits.tilt_max_rad, limits.tilt_max_rad);
  const Point out{std::cos(bump.direction_rad), std::sin(bump.direction_rad)};
  bump.centre_m = {target[0] + bump.distance_m * out[0], target[1] + bump.distance_m * out[1]};
  const double half = half_length_m(bump.distance_m, bump.subtended_rad, bump.tilt_rad);
  const double along = bump.direction_rad + kPi / 2.0 - bump.tilt_rad;
  const Point step{half * std::cos(along), half * std::sin(along)};
  bump.ends_m[0] = {bump.centre_m[0] + step[0], bump.centre_m[1] + step[1]};
  bump.ends_m[1] = {bump.centre_m[0] - step[0], bump.centre_m[1] - step[1]};
  const Point beyond{bump.centre_m[0] + bump.distance_m * out[0],
                     bump.centre_m[1] + bump.distance_m * out[1]};
  bump.behind = {through(bump.ends_m[0], bump.ends_m[1], beyond),
                 through(target, bump.ends_m[0], bump.centre_m),
                 through(target, bump.ends_m[1], bump.centre_m)};
  Polygon region{{0.0, 0.0}, {p.length_m, 0.0}, {p.length_m, p.width_m}, {0.0, p.width_m}};
  for (const GolfHalfPlane &plane : bump.behind)
    region = clip(region, plane);
  bump.area_fraction = area(region) / (p.length_m * p.width_m);
  return bump;
}

bool is_allowed(const GolfParams &p, const GolfBump &bump) {
  return bump.centre_m[0] >= 0.0 && bump.centre_m[0] <= p.length_m && bump.centre_m[1] >= 0.0 &&
         bump.centre_m[1] <= p.width_m && bump.area_fraction >= p.min_region_fraction;
}

GolfBump draw_bump(const GolfParams &p, GolfVariant variant, world::Random random) {
  const Limits limits = limits_of(p, variant);
  for (int i = 0; i < kMaxDraws; ++i) {
    const GolfBump bump = place_bump(p, limits, random);
    if (is_allowed(p, bump))
      return bump;
  }
  throw std::invalid_argument("golf: the parameters allow no bump (centre in the field, region of "
                              "at least min_region_fraction)");
}

} // namespace

Golf::Golf(const GolfParams &params, const GolfOptions &options, std::uint64_t seed,
           std::uint64_t run)
    : params_(params), options_(options), random_(seed, run, kShotStream) {
  if (options.dims < 2)
    throw std::invalid_argument("golf: dims must be at least 2");
  world::Random places(seed, run, kFeatureStream);
  features_[0] = places.below(options.dims);
  features_[1] = places.below(options.dims - 1);
  if (features_[1] >= features_[0])
    ++features_[1];
  if (options.bump) {
    bump_ = draw_bump(params, options.variant, world::Random(seed, run, kBumpStream));
  }
}

bool Golf::done() const {
  if (options_.max_shots != 0 && shots_ >= options_.max_shots)
    return true;
  return options_.bump ? anomalous_ >= options_.anomalous : shots_ >= options_.shots;
}

bool Golf::is_behind(double x_m, double y_m) const {
  if (!options_.bump)
    return false;
  for (const GolfHalfPlane &plane : bump_.behind) {
    if (side(plane, {x_m, y_m}) < 0.0)
      return false;
  }
  return true;
}

double Golf::expected(double x_m, double y_m) const {
  if (options_.variant == GolfVariant::binary)
    return params_.success;
  const double distance_m = std::hypot(x_m - params_.length_m, y_m - params_.width_m / 2.0);
  return params_.reward_at_target - params_.reward_slope * distance_m / params_.length_m;
}

GolfShot Golf::next() {
  GolfShot shot;
  const double x_m = random_.uniform(0.0, params_.length_m);
  const double y_m = random_.uniform(0.0, params_.width_m);
  const double luck = random_.normal();
  const double chance = random_.uniform();
  shot.x.resize(options_.dims);
  for (double &value : shot.x)
    value = random_.uniform(-1.0, 1.0);
  shot.x[features_[0]] = x_m;
  shot.x[features_[1]] = y_m;
  shot.anomalous = is_behind(x_m, y_m);
  shot.m = expected(x_m, y_m);
  if (options_.variant == GolfVariant::binary) {
    shot.sd = std::sqrt(shot.m * (1.0 - shot.m));
    shot.z = chance < (shot.anomalous ? params_.success_behind : shot.m) ? 1.0 : 0.0;
  } else {
    shot.sd = params_.noise_sd;
    const double shift = options_.better ? -params_.shift : params_.shift;
    shot.z = shot.m + params_.noise_sd * luck + (shot.anomalous ? shift : 0.0);
  }
  ++shots_;
  if (shot.anomalous)
    ++anomalous_;
  return shot;
}

std::vector<GolfShot> Golf::all() {
  std::vector<GolfShot> shots;
  while (!done())
    shots.push_back(next());
  return shots;
}

} // namespace rim
