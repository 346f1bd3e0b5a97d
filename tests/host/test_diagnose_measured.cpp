// SPDX-License-Identifier: MIT
// Logs put together as one table: what is a channel, a feature, an angle, a constant; an sd that is
// not stated; what is refused, with its place.
#include "diagnose/measured.hpp"

#include "diagnose_case.hpp"
#include "log/log.hpp"

namespace {

using namespace diagnose_case;
using rim::Role;

// Rows of s.place_m, u.push, x.heading_rad, z/m/sd.force_N.
rim::Log log(const std::string &path, std::size_t rows, double start_s = 7.0) {
  rim::Log out;
  out.path = path;
  out.columns = {{"s.place_m", "m", Role::sensor},
                 {"u.push", "", Role::command},
                 {"x.heading_rad", "rad", Role::context},
                 {"x.level", "", Role::context},
                 {"z.force_N", "N", Role::outcome},
                 {"m.force_N", "N", Role::mean},
                 {"sd.force_N", "N", Role::sd}};
  out.values.resize(static_cast<Eigen::Index>(rows), 7);
  for (std::size_t i = 0; i < rows; ++i) {
    const double k = static_cast<double>(i);
    out.values.row(static_cast<Eigen::Index>(i)) << k, -k, std::remainder(0.4 * k, 2.0 * M_PI), 3.0,
        2.0 * k, 2.0 * k + (i % 2 == 0 ? 0.5 : -0.5), 0.25;
    out.t_s.push_back(start_s + 0.1 * k);
    out.row.push_back(static_cast<std::uint32_t>(i + 2)); // the file's first row was skipped
  }
  out.rows_in_file = static_cast<std::uint32_t>(rows + 1);
  return out;
}

rim::Log without(rim::Log log, int column) {
  log.columns.erase(log.columns.begin() + column);
  rim::Matrix values(log.values.rows(), log.values.cols() - 1);
  values << log.values.leftCols(column), log.values.rightCols(log.values.cols() - column - 1);
  log.values = values;
  return log;
}

void logs_become_one_table(void **) {
  std::vector<std::string> constant;
  const Measured t = rim::diagnose::make_measured({log("a", 40), log("b", 30, 50.0)},
                                                  rim::diagnose::Constants::leave_out, &constant);
  assert_int_equal(t.rows(), 70);
  assert_int_equal(t.logs.size(), 2);
  assert_int_equal(t.logs[1].first, 40);
  assert_int_equal(t.logs[1].rows, 30);
  assert_int_equal(t.logs[1].rows_in_file, 31);
  assert_near(t.t_s[40], 50.0, 0.0);
  assert_near(t.elapsed_s[40], 0.0, 0.0);
  assert_near(t.elapsed_s[43], 0.3, 1e-12);
  assert_int_equal(t.row[40], 2);
  assert_int_equal(t.channels.size(), 1);
  assert_string_equal(t.channels[0].name.c_str(), "force_N");
  assert_string_equal(t.channels[0].unit.c_str(), "N");
  assert_false(t.channels[0].sd_estimated);
  assert_near(t.channels[0].z(43), 6.0, 0.0);
  assert_near(t.channels[0].sd(43), 0.25, 0.0);
  assert_near(t.x(43, t.find_feature("s.place_m")), 3.0, 0.0);
  assert_int_equal(t.find_channel("force_N"), 0);
  assert_int_equal(t.find_channel("z.force_N"), -1);
  assert_int_equal(t.find_feature("x.level"), -1); // it never changes
  assert_int_equal(constant.size(), 1);
  assert_string_equal(constant[0].c_str(), "x.level");
}

void features_know_what_they_are(void **) {
  const Measured t = rim::diagnose::make_measured({log("a", 40)});
  const auto &push = t.features[static_cast<std::size_t>(t.find_feature("u.push"))];
  const auto &heading = t.features[static_cast<std::size_t>(t.find_feature("x.heading_rad"))];
  const auto &place = t.features[static_cast<std::size_t>(t.find_feature("s.place_m"))];
  assert_true(push.is_command && !push.is_angle);
  assert_true(heading.is_angle && !heading.is_command);
  assert_true(!place.is_angle && !place.is_command);
  rim::Log compass = log("a", 40);
  compass.columns[2] = {"x.heading_deg", "deg", Role::context};
  for (Eigen::Index i = 0; i < 40; ++i)
    compass.values(i, 2) = std::fmod(25.0 * static_cast<double>(i), 360.0);
  const Measured c = rim::diagnose::make_measured({compass});
  assert_true(c.features[static_cast<std::size_t>(c.find_feature("x.heading_deg"))].is_angle);
  // radians that stay within a part of a turn, or run through several, do not wrap
  for (const double rate : {0.05, 0.4}) {
    rim::Log straight = log("a", 40);
    for (Eigen::Index i = 0; i < 40; ++i)
      straight.values(i, 2) = rate * static_cast<double>(i);
    const Measured s = rim::diagnose::make_measured({straight});
    assert_false(s.features[static_cast<std::size_t>(s.find_feature("x.heading_rad"))].is_angle);
  }
}

void an_sd_that_is_not_stated_is_the_residuals(void **) {
  rim::Log one = without(log("a", 41), 6);
  for (Eigen::Index i = 0; i < 41; ++i) // residuals 0, 0.1 ... 4: half of them within 1 of 2
    one.values(i, 5) = one.values(i, 4) - 0.1 * static_cast<double>(i);
  one.values(40, 5) -= 1e6; // an outlier moves nothing
  const Measured t = rim::diagnose::make_measured({one});
  assert_true(t.channels[0].sd_estimated);
  assert_near(t.channels[0].sd(0), 1.4826, 1e-9);
  assert_near(t.channels[0].sd(0), t.channels[0].sd(39), 0.0);
}

void what_is_wrong_is_refused_with_its_place(void **) {
  const auto refuse = [](const std::vector<rim::Log> &logs, const std::vector<std::string> &parts) {
    assert_refused([&] { (void)rim::diagnose::make_measured(logs); }, parts);
  };
  refuse({}, {"no log given"});
  refuse({log("a.csv", 0)}, {"a.csv: ", "no row"});
  for (const double sd : {0.0, -0.25}) {
    rim::Log bad = log("b.csv", 20);
    bad.values(4, 6) = sd;
    refuse({log("a.csv", 20), bad}, {"b.csv:row 6: column 'sd.force_N': ", "above 0"});
  }
  rim::Log plain = without(without(without(log("a.csv", 20), 6), 5), 4);
  refuse({plain}, {"a.csv: no z. column", "m. columns", "--world NAME", "--model IMAGE"});
  refuse({log("a.csv", 20), without(log("b.csv", 20), 0)},
         {"b.csv: column 's.place_m' is missing"});
  refuse({without(log("a.csv", 20), 0), log("b.csv", 20)},
         {"a.csv: column 's.place_m' is missing"});
  rim::Log equal = without(log("a.csv", 20), 6);
  equal.values.col(5) = equal.values.col(4);
  refuse({equal}, {"a.csv: column 'z.force_N'", "no standard deviation"});
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(logs_become_one_table),
      cmocka_unit_test(features_know_what_they_are),
      cmocka_unit_test(an_sd_that_is_not_stated_is_the_residuals),
      cmocka_unit_test(what_is_wrong_is_refused_with_its_place),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
