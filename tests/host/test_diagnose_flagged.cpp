// SPDX-License-Identifier: MIT
// Rows that are no measurements: planted stuck runs and zeros are found to the row; what is merely
// quantised, or at rest, is not touched.
#include "diagnose/flagged.hpp"

#include <cmath>

#include "diagnose_case.hpp"

namespace {

using namespace diagnose_case;
using rim::diagnose::find_flagged;
using rim::diagnose::Flagged;

constexpr std::size_t kRows = 1000;

// Two logs; m swings between -3 and 3 (m/s2), sd 0.2.
Measured moving(std::uint64_t seed, double sd = 0.2) {
  Measured t = table(2, kRows / 2, 0.1, {{"s.speed_mps", "m/s", false, false}});
  Random random(seed);
  for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(kRows); ++i) {
    t.channels[0].m(i) = 3.0 * std::sin(0.05 * static_cast<double>(i));
    t.channels[0].sd(i) = sd;
    t.channels[0].z(i) = t.channels[0].m(i) + sd * random.normal();
  }
  return t;
}

Flagged flagged(const Measured &t) { return find_flagged(t, t.channels[0]); }

void assert_rows(const std::vector<std::uint8_t> &got, const std::vector<std::size_t> &wanted) {
  std::vector<std::uint8_t> expected(got.size(), 0);
  for (const std::size_t i : wanted)
    expected[i] = 1;
  for (std::size_t i = 0; i < got.size(); ++i) {
    if (got[i] != expected[i])
      fail_msg("row %zu is %d instead of %d", i, got[i], expected[i]);
  }
}

void nothing_is_found_in_noise(void **) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Flagged f = flagged(moving(seed));
    if (f.stuck_rows + f.dropout_rows > 0)
      fail_msg("seed %llu: %zu stuck, %zu dropped out", static_cast<unsigned long long>(seed),
               f.stuck_rows, f.dropout_rows);
    assert_near(f.stuck_ln + f.dropout_ln, 0.0, 0.0);
  }
}

// What friction holds at rest, while a little motion is predicted, is not stuck; what does not move
// although much is predicted, is.
void what_stands_is_not_stuck(void **) {
  for (const bool is_held : {true, false}) {
    Measured t = moving(5, 0.02);
    for (Eigen::Index i = 500; i < 520; ++i) {
      const double k = static_cast<double>(i - 500);
      t.channels[0].m(i) = is_held ? 0.12 - 0.01 * k : 1.2 - 0.1 * k;
      t.channels[0].z(i) = 0.0;
    }
    assert_int_equal(flagged(t).stuck_rows > 0 || flagged(t).dropout_rows > 0, !is_held);
  }
}

void planted_runs_are_found_to_the_row(void **) {
  Measured t = moving(3);
  std::vector<std::size_t> wanted;
  for (const std::size_t start : {100, 300, 620}) {
    for (std::size_t k = 1; k <= 12; ++k) { // the first reading of a run is a measurement
      t.channels[0].z(static_cast<Eigen::Index>(start + k)) =
          t.channels[0].z(static_cast<Eigen::Index>(start));
      wanted.push_back(start + k);
    }
  }
  const Flagged f = flagged(t);
  assert_rows(f.stuck, wanted);
  assert_int_equal(f.stuck_rows, 36);
  assert_int_equal(f.dropout_rows, 0);
  assert_true(f.stuck_ln > 100.0);
}

// The end of one log and the beginning of the next are not neighbours.
void a_run_ends_with_its_log(void **) {
  Measured t = moving(4);
  for (std::size_t i = 490; i < 510; ++i)
    t.channels[0].z(static_cast<Eigen::Index>(i)) = 1.25;
  std::vector<std::size_t> wanted;
  for (std::size_t i = 491; i < 510; ++i) {
    if (i != 500)
      wanted.push_back(i);
  }
  assert_rows(flagged(t).stuck, wanted);
}

void planted_zeros_are_found_to_the_row(void **) {
  Measured t = moving(5);
  std::vector<std::size_t> wanted;
  for (std::size_t i = 7; i < kRows; i += 23) {
    if (std::abs(t.channels[0].m(static_cast<Eigen::Index>(i))) > 0.7) {
      t.channels[0].z(static_cast<Eigen::Index>(i)) = 0.0;
      wanted.push_back(i);
    }
  }
  const Flagged f = flagged(t);
  assert_rows(f.dropout, wanted);
  assert_int_equal(f.dropout_rows, wanted.size());
  assert_int_equal(f.stuck_rows, 0);
  assert_true(f.dropout_ln > 100.0);
}

void quantised_readings_are_measurements(void **) {
  for (const double step : {0.02, 0.1, 0.2, 0.5}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      Measured t = moving(seed);
      for (double &z : t.channels[0].z)
        z = step * std::round(z / step);
      const Flagged f = flagged(t);
      if (f.stuck_rows + f.dropout_rows > 0)
        fail_msg("step %g, seed %llu: %zu stuck, %zu dropped out", step,
                 static_cast<unsigned long long>(seed), f.stuck_rows, f.dropout_rows);
    }
  }
}

// Noise that lasts holds a coarse reading for many rows while little is predicted; a reading that
// stays while much is predicted is stuck, however coarse.
void a_coarse_reading_of_what_hardly_moves_is_not_stuck(void **) {
  for (const bool is_stuck : {false, true}) {
    Measured t = moving(9, 0.1);
    Random random(10);
    double lasting = 0.0;
    for (Eigen::Index i = 0; i < t.channels[0].z.size(); ++i) {
      lasting = 0.9 * lasting + 0.04 * random.normal();
      t.channels[0].m(i) = 3.0 * std::sin(0.01 * static_cast<double>(i));
      t.channels[0].z(i) = 0.25 * std::round((t.channels[0].m(i) + lasting) / 0.25);
    }
    if (is_stuck)
      t.channels[0].z.segment(200, 100).setConstant(t.channels[0].z(200));
    assert_int_equal(flagged(t).stuck_rows > 0, is_stuck);
  }
}

// Where a coarse reading falls within one step, its error is by where in the step that is.
void one_step_of_a_coarse_reading_is_known(void **) {
  Measured t = moving(13, 0.1);
  for (double &z : t.channels[0].z)
    z = 0.5 * std::round(z / 0.5);
  const auto inside = [&t](double reach) -> rim::diagnose::Vector {
    return (t.channels[0].m.array().abs() < reach).cast<double>();
  };
  assert_true(rim::diagnose::is_of_one_step(t.channels[0], inside(0.2)));
  assert_false(rim::diagnose::is_of_one_step(t.channels[0], inside(0.6)));
}

// A robot at rest: nothing is commanded, nothing is predicted, exactly zero is measured.
void at_rest_is_no_fault(void **) {
  Measured t = moving(6);
  for (Eigen::Index i = 0; i < 150; ++i)
    t.channels[0].z(i) = t.channels[0].m(i) = 0.0;
  for (Eigen::Index i = 600; i < 640; ++i)
    t.channels[0].z(i) = t.channels[0].m(i) = 0.0;
  const Flagged f = flagged(t);
  assert_int_equal(f.dropout_rows, 0);
  assert_int_equal(f.stuck_rows, 0);
}

// The same reading while the same is predicted is what a steady state shows.
void a_steady_prediction_is_no_witness(void **) {
  Measured t = moving(7);
  for (Eigen::Index i = 200; i < 260; ++i) {
    t.channels[0].m(i) = 2.0;
    t.channels[0].z(i) = 2.0;
  }
  assert_int_equal(flagged(t).stuck_rows, 0);
}

void constant_readings_do_not_divide_by_zero(void **) {
  Measured t = moving(8);
  t.channels[0].z.setConstant(1.0);
  const Flagged f = flagged(t);
  assert_true(std::isfinite(f.stuck_ln) && std::isfinite(f.dropout_ln));
}

// A coarse reading of what hardly moves is zero now and then by rounding; stated four times too
// wide, and predicted by something noisier, it is no dropout for that.
void zeros_by_rounding_are_no_dropout(void **) {
  Measured t = moving(11, 0.8);
  Random random(12);
  for (Eigen::Index i = 0; i < t.channels[0].z.size(); ++i) {
    t.channels[0].m(i) = 0.8 * random.normal();
    t.channels[0].z(i) = 0.1 * std::round(1.5 * random.normal());
  }
  assert_true((t.channels[0].z.array() == 0.0).count() > 100);
  assert_int_equal(flagged(t).dropout_rows, 0);
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(zeros_by_rounding_are_no_dropout),
      cmocka_unit_test(nothing_is_found_in_noise),
      cmocka_unit_test(planted_runs_are_found_to_the_row),
      cmocka_unit_test(a_run_ends_with_its_log),
      cmocka_unit_test(planted_zeros_are_found_to_the_row),
      cmocka_unit_test(quantised_readings_are_measurements),
      cmocka_unit_test(a_coarse_reading_of_what_hardly_moves_is_not_stuck),
      cmocka_unit_test(one_step_of_a_coarse_reading_is_known),
      cmocka_unit_test(at_rest_is_no_fault),
      cmocka_unit_test(what_stands_is_not_stuck),
      cmocka_unit_test(a_steady_prediction_is_no_witness),
      cmocka_unit_test(constant_readings_do_not_divide_by_zero),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
