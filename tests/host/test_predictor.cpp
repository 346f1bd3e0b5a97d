// SPDX-License-Identifier: MIT
// Simulations and images that predict measured logs: exact on motion that obeys them, silent where
// they should be, and one step twice is two steps.
#include "check.hpp"
#include "made_vehicle.hpp"
#include "predict/falcon_fall.hpp"
#include "predict/predictor.hpp"
#include "replay/replay.hpp"
#include "temporary.hpp"
#include "toy_log.hpp"
#include "train/trainer.hpp"
#include "util/atomic_file.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/lander.hpp"
#include "world/random.hpp"
#include "world/recording.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

namespace {

using rim::Log;
using rim::world::make_world_predictor;

constexpr std::uint64_t kSeed = 20261122; // of every random number here

Log make_log(const std::vector<std::string> &names) {
  Log log;
  log.path = "made.csv";
  for (const std::string &name : names) {
    rim::Column column{name, rim::unit_of_name(name), rim::Role::context};
    rim::role_of_name(name, column.role);
    log.columns.push_back(column);
  }
  return log;
}

void add_row(Log *log, double t_s, const std::vector<double> &values) {
  const auto rows = log->values.rows();
  log->values.conservativeResize(rows + 1, static_cast<Eigen::Index>(values.size()));
  for (std::size_t i = 0; i < values.size(); ++i)
    log->values(rows, static_cast<Eigen::Index>(i)) = values[i];
  log->t_s.push_back(t_s);
  log->row.push_back(++log->rows_in_file);
}

double at(const Log &log, std::size_t row, const std::string &name) {
  const int column = rim::find_column(log, name);
  if (column < 0)
    fail_msg("no column %s", name.c_str());
  return log.values(static_cast<Eigen::Index>(row), column);
}

Log without_column(const Log &log, const std::string &name) {
  Log less = log;
  const auto gone = static_cast<std::size_t>(rim::find_column(log, name));
  less.columns.erase(less.columns.begin() + static_cast<std::ptrdiff_t>(gone));
  less.values.resize(log.values.rows(), log.values.cols() - 1);
  for (std::size_t c = 0, to = 0; c < log.columns.size(); ++c) {
    if (c != gone)
      less.values.col(static_cast<Eigen::Index>(to++)) =
          log.values.col(static_cast<Eigen::Index>(c));
  }
  return less;
}

Log without_rows(const Log &log, const std::function<bool(double)> &gone) {
  Log less = log;
  less.t_s.clear();
  less.row.clear();
  less.values.resize(0, log.values.cols());
  less.rows_in_file = 0;
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    if (!gone(log.t_s[r])) {
      const auto row = log.values.row(static_cast<Eigen::Index>(r));
      add_row(&less, log.t_s[r], std::vector<double>(row.begin(), row.end()));
    }
  }
  return less;
}

double rms_of(const Log &log, const std::string &name, bool in_sd) {
  double sum = 0.0;
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    const double residual = at(log, r, "z." + name) - at(log, r, "m." + name);
    const double unit = in_sd ? at(log, r, "sd." + name) : 1.0;
    sum += residual * residual / (unit * unit);
  }
  return std::sqrt(sum / static_cast<double>(log.t_s.size()));
}

// A point mass over a sphere, in polar coordinates: not the formula that is tested.
struct Orbit {
  double r = 6371000.0, up = 0.0, level = 0.0;
  void advance(double dt) {
    const auto slope = [](const Orbit &o) {
      const double g = 9.80665 * 6371000.0 * 6371000.0 / (o.r * o.r);
      return Orbit{o.up, o.level * o.level / o.r - g, -o.up * o.level / o.r};
    };
    const Orbit a = slope(*this), m{r + a.r * dt / 2, up + a.up * dt / 2, level + a.level * dt / 2};
    const Orbit b = slope(m);
    r += b.r * dt;
    up += b.up * dt;
    level += b.level * dt;
  }
};

const std::vector<std::string> kFallColumns = {"s.speed_mps", "s.altitude_m", "u.engine_on",
                                               "u.near_event", "x.altitude_step_m"};

// 240 s at 30 Hz from 60 km, climbing, over the top and down; `shown`: noise and steps of a
// webcast.
Log fall(bool shown, double speed_mps = 700.0) {
  Log log = make_log(kFallColumns);
  rim::world::Random random(kSeed, 1, 1);
  Orbit orbit{6371000.0 + 60000.0, 0.8 * speed_mps, 0.6 * speed_mps};
  for (int i = 0; i < 7200; ++i) {
    double speed = std::hypot(orbit.up, orbit.level), altitude = orbit.r - 6371000.0;
    if (shown) {
      speed = std::round((speed + 0.13 * random.normal()) * 3.6) / 3.6;
      altitude = std::floor(altitude / 100.0) * 100.0;
    }
    add_row(&log, 100.0 + i / 30.0, {speed, altitude, 0.0, 0.0, shown ? 100.0 : 0.0});
    orbit.advance(1.0 / 30.0);
  }
  return log;
}

void a_fall_is_predicted_exactly(void **) {
  const auto falcon = make_world_predictor("falcon");
  const Log predicted = falcon->predict(fall(false));
  assert_true(predicted.t_s.size() > 225);
  assert_true(rms_of(predicted, "speed_mps", false) < 2e-3);
  for (std::size_t r = 1; r < predicted.t_s.size(); ++r)
    assert_true(std::fabs(predicted.t_s[r] - predicted.t_s[r - 1] - falcon->step_s()) < 1e-9);
}

void a_shown_fall_lies_within_its_sd(void **) {
  const Log predicted = make_world_predictor("falcon")->predict(fall(true));
  assert_true(predicted.t_s.size() > 225);
  const double in_sd = rms_of(predicted, "speed_mps", true);
  print_message("shown fall: residual %.2f sd, %.3f m/s rms\n", in_sd,
                rms_of(predicted, "speed_mps", false));
  assert_true(in_sd > 0.4 && in_sd < 1.6);
  // Near the top a window of 5 s shows hardly a step of the altitude.
  assert_true(rms_of(predicted, "speed_mps", false) < 0.2);
}

void engines_and_events_are_kept_out(void **) {
  Log log = fall(true);
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    const double t = log.t_s[r];
    auto row = log.values.row(static_cast<Eigen::Index>(r));
    row(2) = t >= 150.0 && t < 160.0 ? 1.0 : 0.0;
    row(3) = t >= 148.5 && t < 161.5 ? 1.0 : 0.0;
  }
  const Log some = make_world_predictor("falcon")->predict(log);
  std::size_t before = 0, after = 0;
  for (const double t : some.t_s) {
    assert_true(t + 1.25 < 148.51 || t - 0.25 > 161.49);
    before += t < 148.0 ? 1 : 0;
    after += t > 162.0 ? 1 : 0;
  }
  assert_int_equal(before, 44); // 104 .. 147: the altitude needs most of a window first
  assert_true(after > 170);
  // Without the event column the engines alone keep rows out.
  const Log only = make_world_predictor("falcon")->predict(without_column(log, "u.near_event"));
  assert_int_equal(only.t_s.size(), some.t_s.size() + 2);
}

void gaps_are_kept_out(void **) {
  const Log log = without_rows(fall(true), [](double t) { return t > 200.1 && t < 203.0; });
  const Log some = make_world_predictor("falcon")->predict(log);
  for (const double t : some.t_s)
    assert_true(t < 199.5 || t > 202.5);
  for (std::size_t r = 1; r < some.t_s.size(); ++r) {
    const double steps = some.t_s[r] - some.t_s[r - 1];
    assert_true(std::fabs(steps - std::round(steps)) < 1e-9); // still on the grid
    assert_true(some.row[r] > some.row[r - 1]);
    assert_true(log.t_s[some.row[r] - 1] <= some.t_s[r] + 1e-6);
  }
}

Log drive(double noise_m, double noise_rad);

// The clock is set in the middle of a log: years are passed over at once, and so is the last row.
Log with_clock_set(Log log, double by_s) {
  for (std::size_t r = log.t_s.size() / 2; r < log.t_s.size(); ++r)
    log.t_s[r] += by_s;
  log.t_s.back() = 1e300;
  return log;
}

void a_clock_that_is_set_costs_no_time(void **) {
  constexpr double kYears_s = 1.7e9;
  const Log flight = fall(false);
  const auto steps = make_world_predictor("falcon")->predict(flight).t_s.size();
  const Log some = make_world_predictor("falcon")->predict(with_clock_set(flight, kYears_s));
  // A climb needs most of a window behind it.
  assert_true(some.t_s.size() > steps - 12 && some.t_s.size() < steps);
  assert_true(some.t_s.back() > kYears_s);
  const Log seen = make_world_predictor("unicycle")->predict(
      with_clock_set(drive(0.0005, 0.003), kYears_s));
  assert_int_equal(seen.t_s.size(), 1000); // the windows beside the change end within a gap's half
  assert_true(seen.t_s.back() > kYears_s);
}

// With the outcomes as measured, the next row is the next row; otherwise the speed is carried.
void a_carried_fall_is_a_fall(void **) {
  const auto falcon = make_world_predictor("falcon");
  const Log all = falcon->predict(fall(false));
  const auto rows = static_cast<Eigen::Index>(all.t_s.size());
  Log now = all, next = all;
  now.values = all.values.topRows(rows - 1);
  next.values = all.values.bottomRows(rows - 1);
  const Log measured = next;
  rim::Matrix outcome = now.values.col(rim::find_column(now, "z.speed_mps"));
  assert_true(falcon->advance(now, outcome, &next));
  assert_true((next.values - measured.values).cwiseAbs().maxCoeff() < 1e-9);
  outcome.array() += 5.0;
  assert_true(falcon->advance(now, outcome, &next));
  for (std::size_t r = 0; r < 100; ++r) {
    const double speed = at(measured, r, "s.speed_mps") + 5.0;
    assert_true(std::fabs(at(next, r, "s.speed_mps") - speed) < 1e-9);
    assert_true(at(next, r, "z.speed_mps") == at(measured, r, "z.speed_mps"));
    const double m = rim::world::fall_speed_mps(speed, at(next, r, "s.altitude_m"),
                                                at(next, r, "x.sin_gamma"), falcon->step_s());
    assert_true(std::fabs(at(next, r, "m.speed_mps") - m) < 1e-9);
  }
}

void bad_flights_are_refused(void **) {
  const auto falcon = make_world_predictor("falcon");
  const Log log = fall(true);
  for (const char *name : {"s.speed_mps", "s.altitude_m", "u.engine_on"})
    assert_true(has(refusal([&] { falcon->predict(without_column(log, name)); }),
                    std::string("made.csv: column '") + name + "' is missing"));
  assert_true(falcon->predict(without_column(log, "x.altitude_step_m")).t_s.size() > 225);
  Log burns = log;
  burns.values.col(2).setOnes();
  assert_true(has(refusal([&] { falcon->predict(burns); }), "no second with the engines off"));
  const Log sparse =
      without_rows(log, [](double t) { return std::fabs(std::remainder(t, 2.0)) > 0.01; });
  assert_true(has(refusal([&] { falcon->predict(sparse); }), "one every 1.5 s at least"));
  assert_true(has(refusal([&] { falcon->predict(make_log(kFallColumns)); }), "no second"));
  assert_true(
      has(refusal([] { make_world_predictor("moon"); }), "usage: --world: unknown world 'moon'"));
}

const std::vector<std::string> kDriveColumns = {"x.x_m",       "x.y_m",         "x.theta_rad",
                                                "u.cmd_v_mps", "u.cmd_w_radps", "x.pose_ok"};

// 200 s at 50 Hz of arcs; the heading wraps. Commands hold for whole rows.
Log drive(double noise_m, double noise_rad) {
  Log log = make_log(kDriveColumns);
  rim::world::Random random(kSeed, 2, 1);
  double x = 1.0, y = -2.0, theta = 0.3;
  for (int i = 0; i < 10000; ++i) {
    const int leg = i / 150 % 3;
    const double v = 0.06 + 0.02 * leg, w = leg == 1 ? 0.4 : leg == 2 ? -0.2 : 0.0;
    add_row(&log, i / 50.0,
            {x + noise_m * random.normal(), y + noise_m * random.normal(),
             std::remainder(theta + noise_rad * random.normal(), 2.0 * M_PI), v, w, 1.0});
    const double turn = w / 50.0, chord = turn == 0.0 ? 1.0 : std::sin(turn / 2) / (turn / 2);
    x += v / 50.0 * chord * std::cos(theta + turn / 2);
    y += v / 50.0 * chord * std::sin(theta + turn / 2);
    theta += turn;
  }
  return log;
}

void a_drive_is_predicted_exactly(void **) {
  const Log predicted = make_world_predictor("unicycle")->predict(drive(0.0, 0.0));
  assert_int_equal(predicted.t_s.size(), 1000);
  // Windows in which the command changes are not one arc; the others are exact.
  std::size_t exact = 0;
  for (std::size_t r = 0; r < predicted.t_s.size(); ++r) {
    const double forward = at(predicted, r, "z.forward_mps") - at(predicted, r, "m.forward_mps");
    const double turn = at(predicted, r, "z.turn_radps") - at(predicted, r, "m.turn_radps");
    assert_true(std::fabs(forward) < 1e-4 && std::fabs(turn) < 1e-9);
    exact += std::fabs(forward) < 1e-9 ? 1 : 0;
  }
  assert_true(exact > 930);
}

void a_seen_drive_lies_within_its_sd(void **) {
  const Log predicted = make_world_predictor("unicycle")->predict(drive(0.0005, 0.003));
  for (const char *name : {"forward_mps", "turn_radps"}) {
    const double in_sd = rms_of(predicted, name, true);
    print_message("seen drive: %s residual %.2f sd\n", name, in_sd);
    assert_true(in_sd > 0.6 && in_sd < 1.3);
  }
}

void bad_poses_are_kept_out(void **) {
  Log log = drive(0.0005, 0.003);
  for (Eigen::Index r = 1000; r < 1010; ++r) // 20.00 to 20.18 s
    log.values(r, 5) = 0.0;
  for (Eigen::Index r = 2000; r < 2010; ++r) // as far off as they like
    log.values.row(r) << 99.0, 99.0, 3.0, 0.0, 0.0, 0.0;
  log = without_rows(log, [](double t) { return t > 60.05 && t < 60.25; });
  const Log some = make_world_predictor("unicycle")->predict(log);
  assert_int_equal(some.t_s.size(), 1000 - 2 - 2 - 2);
  for (std::size_t r = 0; r < some.t_s.size(); ++r) {
    assert_true(std::fabs(at(some, r, "z.forward_mps")) < 0.2);
    assert_true(std::fabs(some.t_s[r] - log.t_s[some.row[r] - 1]) < 1e-6);
  }
}

void bad_drives_are_refused(void **) {
  const auto unicycle = make_world_predictor("unicycle");
  const Log log = drive(0.0005, 0.003);
  for (const std::string &name : kDriveColumns)
    assert_true(has(refusal([&] { unicycle->predict(without_column(log, name)); }),
                    "column '" + name + "' is missing"));
  const Log brief = without_rows(log, [](double t) { return t > 1.5; });
  assert_true(has(refusal([&] { unicycle->predict(brief); }), "fewer than 10 windows"));
  const Log sparse =
      without_rows(log, [](double t) { return std::fabs(std::remainder(t, 0.2)) > 0.01; });
  assert_true(has(refusal([&] { unicycle->predict(sparse); }), "rows at most 0.1 s apart"));
  assert_true(has(refusal([&] { unicycle->predict(make_log(kDriveColumns)); }), "fewer than"));
}

void commands_come_from_outside(void **) {
  const auto unicycle = make_world_predictor("unicycle");
  const Log predicted = unicycle->predict(drive(0.0, 0.0));
  Log next = predicted;
  const rim::Matrix outcome = rim::Matrix::Constant(predicted.values.rows(), 2, 7.0);
  assert_true(unicycle->advance(predicted, outcome, &next));
  assert_true(next.values == predicted.values);
}

Log landing(const std::string &effect) {
  const auto params = rim::world::read_lander_params(rim::data_path("lander.toml"));
  std::vector<rim::world::Effect> effects;
  if (!effect.empty())
    effects.push_back(rim::world::read_effect(rim::data_path("effects/" + effect), params));
  const rim::world::LanderRun run = rim::world::simulate_lander(params, effects, kSeed, 1);
  Log log = make_log(rim::world::lander_columns());
  const auto rows = static_cast<Eigen::Index>(run.rows.size());
  log.values.resize(rows, static_cast<Eigen::Index>(log.columns.size()));
  for (std::size_t r = 0; r < run.rows.size(); ++r) {
    const auto i = static_cast<Eigen::Index>(r);
    for (std::size_t e = 0; e < rim::world::kEngines; ++e)
      log.values(i, static_cast<Eigen::Index>(e)) = run.rows[r].throttle[e];
    log.values.row(i).tail(rim::world::kSensors) = run.readings.row(i);
    log.t_s.push_back(run.rows[r].t_s);
    log.row.push_back(static_cast<std::uint32_t>(r + 1));
  }
  log.rows_in_file = static_cast<std::uint32_t>(rows);
  return log;
}

// Mean of (z - m) / sd where the engines thrust.
double thrusting_mean(const Log &log, const std::string &name) {
  double sum = 0.0, n = 0.0;
  for (std::size_t r = 0; r < log.t_s.size(); ++r) {
    if (at(log, r, "x.thrust") > 0.02) {
      sum += (at(log, r, "z." + name) - at(log, r, "m." + name)) / at(log, r, "sd." + name);
      n += 1.0;
    }
  }
  return sum / n;
}

void a_landing_lies_within_its_sd(void **) {
  const auto lander = make_world_predictor("lander");
  const Log predicted = lander->predict(landing(""));
  assert_true(predicted.t_s.size() > 8000);
  for (const char *name :
       {"position_x_m", "position_z_m", "velocity_imu_x_mps", "velocity_doppler_z_mps",
        "rate_x_radps", "rate_z_radps", "acceleration_mps2", "gravity_mps2", "mass_kg",
        "tank_pressure_kPa", "chamber_pressure_1_kPa", "altitude_radar_m"}) {
    const double in_sd = rms_of(predicted, name, true);
    print_message("landing: %-24s %.2f sd\n", name, in_sd);
    assert_true(in_sd > 0.8 && in_sd < 1.6); // a run's own biases are in no sd
  }
}

void what_hits_a_landing_shows(void **) {
  const auto lander = make_world_predictor("lander");
  const Log well = lander->predict(landing(""));
  const Log weak = lander->predict(landing("05_specific_impulse_loss.toml"));
  const Log late = lander->predict(landing("07_velocity_delay.toml"));
  const auto change = [&well](const Log &log, const char *name) {
    return thrusting_mean(log, name) - thrusting_mean(well, name);
  };
  assert_true(change(weak, "acceleration_mps2") < -0.5);
  assert_true(change(weak, "velocity_doppler_z_mps") < -0.2);
  assert_true(std::fabs(change(weak, "chamber_pressure_1_kPa")) < 0.1);
  // Late against the other instrument, in both.
  assert_true(change(late, "velocity_imu_x_mps") > 0.5);
  assert_true(change(late, "velocity_doppler_x_mps") < -0.5);
  assert_true(std::fabs(change(late, "velocity_imu_z_mps")) < 0.1);
}

void a_carried_landing_goes_on(void **) {
  const auto lander = make_world_predictor("lander");
  const Log all = lander->predict(landing(""));
  const Eigen::Index rows = all.values.rows() - 20; // a second is 20 rows
  Log now = all, next = all;
  now.values = all.values.topRows(rows);
  next.values = all.values.bottomRows(rows);
  const Log measured = next;
  std::vector<int> outcomes = rim::role_columns(all, rim::Role::outcome);
  rim::Matrix outcome(rows, static_cast<Eigen::Index>(outcomes.size()));
  for (std::size_t o = 0; o < outcomes.size(); ++o)
    outcome.col(static_cast<Eigen::Index>(o)) = now.values.col(outcomes[o]);
  assert_true(lander->advance(now, outcome, &next));
  assert_true((next.values - measured.values).cwiseAbs().maxCoeff() < 1e-6);
  // 1 m/s up in both velocities: a metre higher a second later, and still 1 m/s faster.
  for (std::size_t o = 0; o < outcomes.size(); ++o) {
    const std::string &name = all.columns[static_cast<std::size_t>(outcomes[o])].name;
    if (name.rfind("z.velocity", 0) == 0 && name.find("_z_") != std::string::npos)
      outcome.col(static_cast<Eigen::Index>(o)).array() += 1.0;
  }
  next = measured;
  assert_true(lander->advance(now, outcome, &next));
  for (std::size_t r = 0; r < 8000; r += 500) {
    const auto grown = [&](const char *name) { return at(next, r, name) - at(measured, r, name); };
    assert_true(std::fabs(grown("m.position_z_m") - 1.0) < 1e-6);
    assert_true(std::fabs(grown("m.altitude_laser_m") - 1.0) < 0.05);
    assert_true(std::fabs(grown("m.velocity_imu_z_mps") - 1.0) < 1e-6);
    assert_true(std::fabs(grown("s.velocity_doppler_z_mps") - 1.0) < 1e-6);
    assert_true(std::fabs(grown("m.position_x_m")) < 1e-6);
  }
}

// Readings of the mass that dropped out: nothing is divided by them.
void a_landing_without_its_mass_is_predicted(void **) {
  const auto lander = make_world_predictor("lander");
  Log log = without_rows(landing(""), [](double t) { return t > 60.0; });
  const std::size_t rows = lander->predict(log).t_s.size();
  const int mass = rim::find_column(log, "s.mass_kg");
  log.values(0, mass) = log.values(400, mass) = 0.0;
  const Log once = lander->predict(log);
  assert_true(once.t_s.size() >= rows - 1 && once.values.allFinite());
  log.values.col(mass).segment(500, 100).setZero(); // 5 s
  const Log long_gone = lander->predict(log);
  assert_true(long_gone.t_s.size() > rows - 110 && long_gone.t_s.size() < rows - 70);
  assert_true(long_gone.values.allFinite());
  log.values.col(mass).setZero();
  assert_true(has(refusal([&] { lander->predict(log); }),
                  "column 's.mass_kg' is never above"));
}

void bad_landings_are_refused(void **) {
  const auto lander = make_world_predictor("lander");
  const Log log = without_rows(landing(""), [](double t) { return t > 20.0; });
  assert_true(has(refusal([&] { lander->predict(without_column(log, "s.mass_kg")); }),
                  "column 's.mass_kg' is missing"));
  const Log holed = without_rows(log, [](double t) { return t > 9.99 && t < 10.51; });
  const Log some = lander->predict(holed);
  for (const double t : some.t_s)
    assert_true(t + 1.5 < 9.99 || t > 10.5);
  const Log brief = without_rows(log, [](double t) { return t > 1.0; });
  assert_true(has(refusal([&] { lander->predict(brief); }), "no row has others"));
}

std::string image_file(const std::vector<std::uint8_t> &bytes, const char *name) {
  const std::string path = temporary_folder() / name;
  rim::AtomicFile file(path);
  file.write(std::string(bytes.begin(), bytes.end()));
  file.commit();
  return path;
}

// Block by block, what the commands alone let the sensors read.
void an_image_predicts_blocks_from_the_commands(void **) {
  std::vector<Log> logs;
  for (std::uint64_t seed = 1; seed <= 12; ++seed)
    logs.push_back(made_vehicle(seed));
  const rim::FlightPlan plan = rim::train(logs, rim::TrainOptions{}).plan;
  const std::string path = image_file(rim::make_image(plan), "made.rim");
  const auto image = rim::world::make_image_predictor(path);
  const double block_s = 0.1 * plan.block_rows;
  assert_true(std::fabs(image->step_s() - block_s) < 1e-9);
  const Log fresh = made_vehicle(40);
  const Log predicted = image->predict(fresh);
  // Models may need the first readings: two blocks.
  assert_int_equal(predicted.t_s.size(), fresh.t_s.size() / plan.block_rows - 1);
  for (const char *name : {"lag_m", "product_m", "state_m"}) {
    const double in_sd = rms_of(predicted, name, true);
    print_message("image: %s residual %.2f sd\n", name, in_sd);
    // sd is that of the noise from block to block; what a run keeps of its own comes on top.
    assert_true(in_sd > 0.7 && in_sd < 4.0);
  }
  double mean = 0.0;
  const std::size_t last = 2 * plan.block_rows; // rows of the first block that is predicted
  for (std::size_t r = plan.block_rows; r < last; ++r)
    mean += at(fresh, r, "s.lag_m") / plan.block_rows;
  assert_true(std::fabs(at(predicted, 0, "z.lag_m") - mean) < 1e-12);
  assert_true(std::fabs(predicted.t_s[0] - fresh.t_s[last - 1]) < 1e-12);
  // The sensors do not enter: without their deviation the prediction is the same.
  Log off = fresh;
  off.values.col(rim::find_column(off, "s.lag_m")).tail(1200).array() += 0.3;
  const Log other = image->predict(off);
  const std::size_t late = predicted.t_s.size() - 1;
  assert_true(at(other, late, "m.lag_m") == at(predicted, late, "m.lag_m"));
  assert_true(std::fabs(at(other, late, "z.lag_m") - at(predicted, late, "z.lag_m") - 0.3) < 1e-9);
  // What was predicted for later does not depend on the outcomes: nothing is carried.
  Log next = predicted;
  assert_false(image->advance(predicted, rim::Matrix::Zero(predicted.values.rows(), 5), &next));
  assert_true(next.values == predicted.values);
  assert_true(has(refusal([&] { image->predict(without_column(fresh, "u.a")); }),
                  "made40: column 'u.a' is missing"));
  const Log sparse = without_rows(fresh, [](double t) { return std::lround(t / 0.1) % 6 != 1; });
  assert_true(has(refusal([&] { image->predict(sparse); }), "made40: no 10 rows"));
}

void images_without_a_model_are_refused(void **) {
  std::vector<Log> logs;
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    logs.push_back(toy_external(seed, 300, 0.0));
  const std::string path =
      image_file(rim::external_image(logs, 40, rim::CalibrationOptions{}).image, "own.rim");
  assert_true(
      has(refusal([&] { rim::world::make_image_predictor(path); }), "no model of the outcomes"));
  assert_true(has(refusal([] { rim::world::make_image_predictor("/nowhere.rim"); }), "nowhere"));
}

} // namespace

int main() {
  print_message("seed %llu\n", static_cast<unsigned long long>(kSeed));
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_fall_is_predicted_exactly),
      cmocka_unit_test(a_shown_fall_lies_within_its_sd),
      cmocka_unit_test(engines_and_events_are_kept_out),
      cmocka_unit_test(gaps_are_kept_out),
      cmocka_unit_test(a_clock_that_is_set_costs_no_time),
      cmocka_unit_test(a_carried_fall_is_a_fall),
      cmocka_unit_test(bad_flights_are_refused),
      cmocka_unit_test(a_drive_is_predicted_exactly),
      cmocka_unit_test(a_seen_drive_lies_within_its_sd),
      cmocka_unit_test(bad_poses_are_kept_out),
      cmocka_unit_test(bad_drives_are_refused),
      cmocka_unit_test(commands_come_from_outside),
      cmocka_unit_test(a_landing_lies_within_its_sd),
      cmocka_unit_test(what_hits_a_landing_shows),
      cmocka_unit_test(a_carried_landing_goes_on),
      cmocka_unit_test(a_landing_without_its_mass_is_predicted),
      cmocka_unit_test(bad_landings_are_refused),
      cmocka_unit_test(an_image_predicts_blocks_from_the_commands),
      cmocka_unit_test(images_without_a_model_are_refused),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
