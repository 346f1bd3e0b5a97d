// SPDX-License-Identifier: MIT
// The golf world: geometry of the bump, the rewards, the streams.
#include "check.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/golf.hpp"
#include "world/golf_params.hpp"

#include <cmath>
#include <stdexcept>

namespace {

using rim::Golf;
using rim::GolfOptions;
using rim::GolfParams;
using rim::GolfShot;
using rim::GolfVariant;

constexpr double kPi = 3.141592653589793;

double angle_at_target(const std::array<double, 2> &a, const std::array<double, 2> &b) {
  const double ax = a[0] - 6.0, ay = a[1] - 2.0, bx = b[0] - 6.0, by = b[1] - 2.0;
  return std::atan2(std::fabs(ax * by - ay * bx), ax * bx + ay * by);
}

void same_seed_same_shots(void **) {
  GolfOptions options;
  options.dims = 10;
  Golf a({}, options, 3, 7), b({}, options, 3, 7), other({}, options, 3, 8);
  const auto shots_a = a.all(), shots_b = b.all(), shots_other = other.all();
  assert_int_equal(shots_a.size(), shots_b.size());
  for (std::size_t i = 0; i < shots_a.size(); ++i) {
    assert_true(shots_a[i].z == shots_b[i].z);
    assert_true(shots_a[i].x == shots_b[i].x);
  }
  assert_true(shots_a[0].z != shots_other[0].z);
}

void bump_obeys_its_limits(void **) {
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const Golf golf({}, {}, seed);
    const rim::GolfBump &bump = golf.bump();
    const double x = bump.centre_m[0], y = bump.centre_m[1];
    assert_true(x >= 0.0 && x <= 6.0 && y >= 0.0 && y <= 4.0);
    const double distance = std::hypot(x - 6.0, y - 2.0);
    assert_true(distance >= 0.05 * 6.0 - 1e-12 && distance <= 0.75 * 6.0 + 1e-12);
    double direction = std::atan2(y - 2.0, x - 6.0);
    if (direction < 0.0)
      direction += 2.0 * kPi;
    assert_true(direction >= 135.0 * kPi / 180.0 - 1e-9 && direction <= 235.0 * kPi / 180.0 + 1e-9);
    const double subtended = angle_at_target(bump.ends_m[0], bump.ends_m[1]);
    assert_true(std::fabs(subtended - bump.subtended_rad) < 1e-9);
    assert_true(subtended >= kPi / 8.0 - 1e-9 && subtended <= kPi / 7.0 + 1e-9);
    const double dot = (bump.ends_m[0][0] - bump.ends_m[1][0]) * (x - 6.0) +
                       (bump.ends_m[0][1] - bump.ends_m[1][1]) * (y - 2.0);
    assert_true(std::fabs(dot) < 1e-9);
    assert_true(bump.area_fraction >= 0.03);
  }
}

void binary_bump_obeys_its_limits(void **) {
  GolfOptions options;
  options.variant = GolfVariant::binary;
  bool is_turned = false;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const Golf golf({}, options, seed);
    const rim::GolfBump &bump = golf.bump();
    const double distance = std::hypot(bump.centre_m[0] - 6.0, bump.centre_m[1] - 2.0);
    assert_true(distance >= 0.1 - 1e-12 && distance <= 1.5 + 1e-12);
    const double subtended = angle_at_target(bump.ends_m[0], bump.ends_m[1]);
    assert_true(std::fabs(subtended - bump.subtended_rad) < 1e-9);
    assert_true(subtended >= kPi / 16.0 - 1e-9 && subtended <= kPi / 4.0 + 1e-9);
    is_turned = is_turned || std::fabs(bump.tilt_rad) > 0.5;
  }
  assert_true(is_turned);
}

// Behind: the line from the shot to the target crosses the bump.
bool crosses(const rim::GolfBump &bump, double x, double y) {
  const auto cross = [](double ax, double ay, double bx, double by) { return ax * by - ay * bx; };
  const double x0 = bump.ends_m[0][0], y0 = bump.ends_m[0][1];
  const double x1 = bump.ends_m[1][0], y1 = bump.ends_m[1][1];
  const double s0 = cross(6.0 - x, 2.0 - y, x0 - x, y0 - y);
  const double s1 = cross(6.0 - x, 2.0 - y, x1 - x, y1 - y);
  const double t0 = cross(x1 - x0, y1 - y0, x - x0, y - y0);
  const double t1 = cross(x1 - x0, y1 - y0, 6.0 - x0, 2.0 - y0);
  return s0 * s1 < 0.0 && t0 * t1 < 0.0;
}

void region_is_where_the_line_crosses(void **) {
  for (const GolfVariant variant : {GolfVariant::continuous, GolfVariant::binary}) {
    GolfOptions options;
    options.variant = variant;
    options.anomalous = 200;
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      Golf golf({}, options, seed);
      for (const GolfShot &shot : golf.all()) {
        const double x = shot.x[golf.features()[0]], y = shot.x[golf.features()[1]];
        assert_true(shot.anomalous == crosses(golf.bump(), x, y));
      }
      const double share = 200.0 / static_cast<double>(golf.shots());
      const double area = golf.bump().area_fraction;
      assert_true(std::fabs(share - area) < 5.0 * area / std::sqrt(200.0));
    }
  }
}

void rewards_are_those_of_the_thesis(void **) {
  GolfOptions options;
  options.anomalous = 5000;
  Golf golf({}, options, 11);
  double sum[2] = {0, 0}, square[2] = {0, 0}, n[2] = {0, 0};
  for (const GolfShot &shot : golf.all()) {
    const double x = shot.x[golf.features()[0]], y = shot.x[golf.features()[1]];
    assert_true(std::fabs(shot.m - (1.0 - 0.5 * std::hypot(x - 6.0, y - 2.0) / 6.0)) < 1e-12);
    assert_true(shot.sd == 0.1);
    const double r = (shot.z - shot.m) / shot.sd;
    sum[shot.anomalous] += r;
    square[shot.anomalous] += r * r;
    n[shot.anomalous] += 1.0;
  }
  for (int i = 0; i < 2; ++i) {
    const double mean = sum[i] / n[i];
    assert_true(std::fabs(mean - (i == 1 ? -2.0 : 0.0)) < 5.0 / std::sqrt(n[i]));
    assert_true(std::fabs(square[i] / n[i] - mean * mean - 1.0) < 5.0 * std::sqrt(2.0 / n[i]));
  }
}

void binary_rewards_have_their_rates(void **) {
  GolfParams params;
  params.success_behind = 0.2;
  GolfOptions options;
  options.variant = GolfVariant::binary;
  options.anomalous = 2000;
  Golf golf(params, options, 5);
  double hits[2] = {0, 0}, n[2] = {0, 0};
  for (const GolfShot &shot : golf.all()) {
    assert_true(shot.z == 0.0 || shot.z == 1.0);
    assert_true(shot.m == 0.8);
    assert_true(std::fabs(shot.sd - 0.4) < 1e-12);
    hits[shot.anomalous] += shot.z;
    n[shot.anomalous] += 1.0;
  }
  assert_true(std::fabs(hits[0] / n[0] - 0.8) < 5.0 * 0.4 / std::sqrt(n[0]));
  assert_true(std::fabs(hits[1] / n[1] - 0.2) < 5.0 * 0.4 / std::sqrt(n[1]));
}

void other_dimensions_are_uniform(void **) {
  GolfOptions options;
  options.dims = 100;
  bool moved = false;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Golf golf({}, options, seed);
    const auto features = golf.features();
    assert_true(features[0] != features[1] && features[0] < 100 && features[1] < 100);
    moved = moved || features[0] > 10;
    double sum = 0.0, n = 0.0;
    for (const GolfShot &shot : golf.all()) {
      assert_int_equal(shot.x.size(), 100);
      for (std::size_t i = 0; i < 100; ++i) {
        if (i == features[0] || i == features[1])
          continue;
        assert_true(shot.x[i] > -1.0 && shot.x[i] < 1.0);
        sum += shot.x[i];
        n += 1.0;
      }
    }
    assert_true(std::fabs(sum / n) < 5.0 / std::sqrt(3.0 * n));
  }
  assert_true(moved);
}

void runs_end_where_they_should(void **) {
  GolfOptions options;
  options.anomalous = 30;
  Golf golf({}, options, 1);
  const auto shots = golf.all();
  assert_true(shots.back().anomalous);
  assert_int_equal(golf.anomalous(), 30);
  options.bump = false;
  options.shots = 123;
  Golf healthy({}, options, 1);
  for (const GolfShot &shot : healthy.all())
    assert_false(shot.anomalous);
  assert_int_equal(healthy.shots(), 123);
  options.max_shots = 50;
  Golf limited({}, options, 1);
  assert_int_equal(limited.all().size(), 50);
}

void misuse_is_refused(void **) {
  GolfOptions options;
  options.dims = 1;
  int caught = 0;
  try {
    Golf golf({}, options, 1);
  } catch (const std::invalid_argument &) {
    ++caught;
  }
  GolfParams params;
  params.min_region_fraction = 0.99;
  try {
    Golf golf(params, {}, 1);
  } catch (const std::invalid_argument &) {
    ++caught;
  }
  assert_int_equal(caught, 2);
}

// The same shots, but what the bump took it gives.
void better_region_mirrors_the_shift(void **) {
  GolfOptions options;
  Golf worse({}, options, 5);
  options.better = true;
  Golf better({}, options, 5);
  const auto a = worse.all(), b = better.all();
  assert_int_equal(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    assert_true(a[i].x == b[i].x && a[i].m == b[i].m && a[i].anomalous == b[i].anomalous);
    assert_true(std::fabs(b[i].z - a[i].z - (a[i].anomalous ? 0.4 : 0.0)) < 1e-12);
  }
}

// The file says the same as the defaults that the experiments use.
void file_equals_defaults(void **) {
  const GolfParams file = rim::world::read_golf_params(rim::data_path("golf.toml"));
  assert_string_equal(rim::world::golf_params_toml(file).c_str(),
                      rim::world::golf_params_toml(GolfParams{}).c_str());
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(same_seed_same_shots),
      cmocka_unit_test(bump_obeys_its_limits),
      cmocka_unit_test(binary_bump_obeys_its_limits),
      cmocka_unit_test(region_is_where_the_line_crosses),
      cmocka_unit_test(rewards_are_those_of_the_thesis),
      cmocka_unit_test(binary_rewards_have_their_rates),
      cmocka_unit_test(other_dimensions_are_uniform),
      cmocka_unit_test(runs_end_where_they_should),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(better_region_mirrors_the_shift),
      cmocka_unit_test(file_equals_defaults),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
