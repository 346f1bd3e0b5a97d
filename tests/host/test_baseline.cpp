// SPDX-License-Identifier: MIT
// The detectors of table 6.1 where the right answer is known.
#include "check.hpp"
#include "thesis/baseline/baseline.hpp"
#include "world/random.hpp"

#include <cmath>
#include <cstdio>

namespace {

using rim::BaselineData;
using rim::BaselineResult;

bool is_near(double a, double b) { return std::fabs(a - b) < 1e-12; }

// One feature or two, one channel.
struct Case {
  std::vector<double> u, r;
  std::size_t dims;
  BaselineData data() const { return {r.size(), dims, 1, u.data(), r.data(), {{0, dims - 1}}}; }
};

Case series(const std::vector<double> &r) { return {std::vector<double>(r.size(), 0.5), r, 1}; }

void sprt_by_hand(void **) {
  const Case c = series({0.0, 2.0, 2.0, -4.0, 0.0});
  const BaselineResult s = rim::detect_sprt(c.data());
  // + side: -.5, 1, 2.5, -2, -2.5; - side: -.5, -3 restarts, -2.5, 1, .5
  const double expected[] = {0.0, 1.0, 2.5, 1.0, 0.5};
  for (std::size_t i = 0; i < 5; ++i)
    assert_true(is_near(s.score[i], expected[i]));
  const bool inside[] = {true, true, true, false, false};
  for (std::size_t i = 0; i < 5; ++i)
    assert_int_equal(s.inside[i], inside[i]);
}

void cusum_by_hand(void **) {
  const Case c = series({0.0, 2.0, 2.0, -4.0, 0.0});
  const BaselineResult s = rim::detect_cusum(c.data());
  const double expected[] = {0.0, 1.5, 3.0, 3.5, 3.0}; // the last two on the negative side
  for (std::size_t i = 0; i < 5; ++i)
    assert_true(is_near(s.score[i], expected[i]));
  for (std::size_t i = 0; i < 5; ++i)
    assert_int_equal(s.inside[i], i == 3);
}

void glrt_by_hand(void **) {
  const Case c = series({0.0, 2.0, 2.0, -1.0});
  const BaselineResult s = rim::detect_glrt(c.data());
  assert_true(is_near(s.score[1], 2.0));
  assert_true(is_near(s.score[2], 4.0)); // 4^2 / (2 2)
  assert_true(is_near(s.score[3], 1.5)); // 3^2 / (2 3)
  for (std::size_t i = 0; i < 4; ++i)
    assert_int_equal(s.inside[i], i == 1 || i == 2);
}

void outliers_are_single_points(void **) {
  rim::world::Random random(62, 1, 1);
  Case c{{}, {}, 2};
  for (int i = 0; i < 200; ++i) {
    c.u.push_back(random.uniform());
    c.u.push_back(random.uniform());
    c.r.push_back(0.5 * random.normal());
  }
  c.r[150] = 12.0;
  for (const auto detect : {rim::detect_spatial_outlier, rim::detect_context_outlier}) {
    const BaselineResult s = detect(c.data());
    assert_true(s.is_pointwise);
    for (std::size_t i = 0; i < 200; ++i)
      assert_true(i == 150 || s.score[i] < s.score[150]);
  }
  // Eight neighbours of residual 1 and a point of 4: 3 sd less the scatter of their mean.
  Case near{std::vector<double>(9, 0.5), std::vector<double>(9, 1.0), 1};
  near.r[8] = 4.0;
  assert_true(
      is_near(rim::detect_context_outlier(near.data()).score[8], 3.0 / std::sqrt(1.0 + 1.0 / 8.0)));
}

// A grid; residual 2 within .25 of a corner, 0 elsewhere: the circle is found exactly.
void the_scan_finds_the_circle(void **) {
  Case c{{}, {}, 2};
  std::vector<bool> truth;
  double n = 0.0;
  for (int i = 0; i < 11; ++i) {
    for (int j = 0; j < 11; ++j) {
      c.u.push_back(i / 10.0);
      c.u.push_back(j / 10.0);
      truth.push_back(std::hypot(i / 10.0, j / 10.0) < 0.25);
      c.r.push_back(truth.back() ? 2.0 : 0.0);
      n += truth.back() ? 1.0 : 0.0;
    }
  }
  const BaselineResult s = rim::detect_spatial_scan(c.data());
  assert_true(s.inside == truth);
  assert_true(is_near(s.score.back(), 4.0 * n * n / (2.0 * n)));
}

// Among 20 neighbours the best subset is that of the large residuals, wherever they are.
void the_subset_scan_takes_the_best_subset(void **) {
  Case c{{}, {}, 1};
  for (int i = 0; i < 20; ++i) {
    c.u.push_back(i / 20.0);
    c.r.push_back(i % 4 == 1 ? -3.0 : 1.0);
  }
  const BaselineResult s = rim::detect_subset_scan(c.data());
  for (std::size_t i = 0; i < 20; ++i)
    assert_int_equal(s.inside[i], i % 4 == 1);
  assert_true(is_near(s.score.back(), 15.0 * 15.0 / (2.0 * 5.0)));
  assert_true(s.score[8] == 0.0); // not looked at before the tenth
}

} // namespace

int main() {
  std::printf("seed 62\n");
  const CMUnitTest tests[] = {
      cmocka_unit_test(sprt_by_hand),
      cmocka_unit_test(cusum_by_hand),
      cmocka_unit_test(glrt_by_hand),
      cmocka_unit_test(outliers_are_single_points),
      cmocka_unit_test(the_scan_finds_the_circle),
      cmocka_unit_test(the_subset_scan_takes_the_best_subset),
  };
  return cmocka_run_group_tests_name("baseline", tests, nullptr, nullptr);
}
