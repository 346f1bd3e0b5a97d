// SPDX-License-Identifier: MIT
// Drives as data points, and the detection on them: what is counted as what.
#include "check.hpp"
#include "thesis/experiment/alarm_score.hpp"
#include "thesis/experiment/cobot_watch.hpp"
#include "thesis/experiment/precision_recall.hpp"
#include "util/error.hpp"
#include "world/random.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace {

using namespace rim;

constexpr double kSeconds = 120.0;

const CobotScatter &scatter() {
  static const CobotScatter it = [] {
    std::vector<CobotDrive> nominal;
    for (std::uint64_t i = 0; i < 8; ++i)
      nominal.push_back(drive_cobot(CobotCase::nominal, 7, kSeconds, 92000 + i));
    return CobotScatter(nominal);
  }();
  return it;
}

void a_drive_is_its_seed(void **) {
  const CobotDrive a = drive_cobot(CobotCase::corridor, 15, kSeconds, 92010);
  const CobotDrive b = drive_cobot(CobotCase::corridor, 15, kSeconds, 92010);
  assert_true(a.u == b.u && a.slip == b.slip && a.anomalous == b.anomalous);
  assert_int_equal(a.u.size(), 15 * a.size());
  for (const double u : a.u)
    assert_true(u >= 0.0 && u <= 1.0);
  assert_true(a.anomalies() > a.size() / 10 && a.anomalies() < a.size());
  const CobotDrive more = drive_cobot(CobotCase::corridor, 100, kSeconds, 92010);
  assert_true(more.slip == a.slip); // the same drive, more is said of it
  const CobotDrive null = drive_cobot(CobotCase::nominal, 7, kSeconds, 92010);
  assert_int_equal(null.anomalies(), 0);
  const CobotDrive all = drive_cobot(CobotCase::encoder, 7, kSeconds, 92010);
  assert_int_equal(all.anomalies(), all.size());
}

void bad_dims_are_refused(void **) {
  for (const std::size_t dims : {std::size_t{8}, std::size_t{101}}) {
    bool refused = false;
    try {
      (void)drive_cobot(CobotCase::nominal, dims, 1.0, 1);
    } catch (const UsageError &) {
      refused = true;
    }
    assert_true(refused);
  }
  bool refused = false;
  try {
    const CobotScatter none({drive_cobot(CobotCase::nominal, 7, 5.0, 92000)});
  } catch (const DataError &) {
    refused = true;
  }
  assert_true(refused);
}

// Nominal variance 1, and a size that is what was done: 5 % of a wheel.
void scores_are_sufficient_statistics(void **) {
  const CobotDrive null = drive_cobot(CobotCase::nominal, 7, 400.0, 92020);
  const std::vector<double> r = scatter().residuals(scatter().scores(null));
  for (std::size_t c = 0; c < kCobotChannels; ++c) {
    double square = 0.0;
    for (std::size_t i = c; i < r.size(); i += kCobotChannels)
      square += r[i] * r[i] / static_cast<double>(null.size());
    if (square < 0.3 || square > 1.3)
      fail_msg("channel %zu: variance %.3f", c, square);
  }
  const CobotDrive drive = drive_cobot(CobotCase::encoder, 7, 400.0, 92020);
  const CobotScores s = scatter().scores(drive);
  double size = 0.0;
  for (std::size_t c = 0; c < kCobotWheels; ++c) {
    double x = 0.0, w = 0.0;
    for (std::size_t i = c; i < s.x.size(); i += kCobotChannels) {
      x += s.x[i];
      w += s.w[i];
    }
    size = std::min(size, x / w);
  }
  if (std::fabs(size + 0.05) > 0.01)
    fail_msg("size %.4f", size);
}

// A gain of the drive's own is a share of the speed: it shows in proportion to the slope.
void innovations_forget_a_gain(void **) {
  world::Random random(92030, 1, 1);
  std::array<double, kCobotChannels> var{};
  var[4] = 0.1;
  std::vector<double> r, slopes;
  for (std::size_t i = 0; i < 500; ++i) {
    for (std::size_t c = 0; c < kCobotChannels; ++c) {
      slopes.push_back(i % 4 < 2 ? 0.5 : 1.5);
      r.push_back(random.normal() + (c == 4 ? 0.6 * slopes.back() : 0.0));
    }
  }
  const std::vector<double> out = innovations(r, slopes, var);
  std::array<double, 2> before{}, after{};
  double square = 0.0, other = 0.0;
  for (std::size_t k = 2000; k < r.size(); ++k) {
    if (k % kCobotChannels == 4) {
      const std::size_t is_fast = slopes[k] > 1.0 ? 1 : 0;
      before[is_fast] += r[k] / 125.0;
      after[is_fast] += out[k] / 125.0;
      square += out[k] * out[k] / 250.0;
    } else {
      other = std::max(other, std::fabs(out[k] - r[k]));
    }
  }
  assert_true(before[1] > before[0] + 0.3);
  assert_true(std::fabs(after[0]) < 0.25 && std::fabs(after[1]) < 0.25);
  assert_true(square > 0.75 && square < 1.3);
  assert_true(other == 0.0); // no variance, no gain
}

void the_left_turn_is_explained(void **) {
  const CobotDrive drive = drive_cobot(CobotCase::left_turn, 7, 300.0, 92040);
  const CobotRegion region = explain_cobot(drive, scatter(), 1);
  assert_int_equal(region.channel, 4); // all wheels
  assert_int_equal(region.region.dims, 1);
  assert_int_equal(region.region.feature[0], 6); // the commanded turn
  const PrecisionRecall pr = compare_points(region.inside, drive.anomalous);
  assert_true(pr.precision > 0.9 && pr.recall > 0.7);
  const std::vector<double> score = watch_cobot(drive, scatter(), 1);
  assert_int_equal(score.size(), drive.size());
  const CobotDrive null = drive_cobot(CobotCase::nominal, 7, 300.0, 92040);
  const std::vector<double> quiet = watch_cobot(null, scatter(), 1);
  assert_true(*std::max_element(score.begin(), score.end()) >
              2.0 * *std::max_element(quiet.begin(), quiet.end()));
}

// Told to wait, it still gets corrections of millimetres a second.
std::vector<std::size_t> standing_points(const CobotDrive &drive) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    double most = 0.0;
    for (const double v : drive.predicted[i])
      most = std::max(most, std::fabs(v));
    if (most < 0.005)
      out.push_back(i);
  }
  return out;
}

void a_standing_robot_is_not_in_the_corridor(void **) {
  const CobotDrive drive = drive_cobot(CobotCase::corridor, 7, 300.0, 92050);
  const CobotRegion region = explain_cobot(drive, scatter(), 1);
  assert_int_equal(region.region.dims, 1);
  const PrecisionRecall pr = compare_points(region.inside, drive.anomalous);
  if (pr.precision < 0.95 || pr.recall < 0.9)
    fail_msg("precision %.3f, recall %.3f", pr.precision, pr.recall);
  std::size_t among = 0; // between members
  for (const std::size_t i : standing_points(drive)) {
    assert_false(region.inside[i] || drive.anomalous[i]);
    among += i > 0 && i + 1 < drive.size() && (region.inside[i - 1] || region.inside[i + 1]);
  }
  assert_true(among > 0);
  const CobotDrive all = drive_cobot(CobotCase::encoder, 7, 300.0, 92020);
  const CobotRegion everywhere = explain_cobot(all, scatter(), 1);
  assert_int_equal(everywhere.region.dims, 0);
  const std::vector<std::size_t> standing = standing_points(all);
  assert_false(standing.empty());
  for (const std::size_t i : standing)
    assert_true(everywhere.inside[i]); // the whole domain
}

void what_is_counted(void **) {
  const std::vector<bool> truth = {false, true, false, true, true};
  const PrecisionRecall pr = compare_points({true, true, false, true, false}, truth);
  assert_true(std::fabs(pr.precision - 2.0 / 3.0) < 1e-12 &&
              std::fabs(pr.recall - 2.0 / 3.0) < 1e-12);
  assert_true(std::fabs(pr.f1 - 2.0 / 3.0) < 1e-12);
  assert_true(compare_points(std::vector<bool>(5), truth).f1 == 0.0);
  std::vector<double> maxima;
  for (int i = 1; i <= 39; ++i)
    maxima.push_back(40.0 - i);
  assert_true(run_level_threshold(maxima, 0.05) == 38.0);
  assert_true(std::isinf(run_level_threshold({1.0, 2.0}, 0.05)));
  const nlohmann::json records = score_records({1.0, 3.0, 2.0, 3.0, 4.0}, truth);
  assert_int_equal(records.size(), 3); // 1, 3, 4 with 0, 1 and 3 anomalous points
  assert_true(points_to_alarm(records, 0.5).found && points_to_alarm(records, 0.5).points == 0.0);
  assert_true(points_to_alarm(records, 1.0).points == 1.0);
  assert_true(points_to_alarm(records, 3.0).points == 3.0);
  assert_false(points_to_alarm(records, 4.0).found);
}

} // namespace

int main() {
  std::printf("seeds 92000-92050\n");
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_drive_is_its_seed),
      cmocka_unit_test(bad_dims_are_refused),
      cmocka_unit_test(scores_are_sufficient_statistics),
      cmocka_unit_test(innovations_forget_a_gain),
      cmocka_unit_test(the_left_turn_is_explained),
      cmocka_unit_test(a_standing_robot_is_not_in_the_corridor),
      cmocka_unit_test(what_is_counted),
  };
  return cmocka_run_group_tests_name("experiment_cobot", tests, nullptr, nullptr);
}
