// SPDX-License-Identifier: MIT
// Effects: the file format, what each kind does, and that the shipped twelve are subtle.
#include "check.hpp"
#include "temporary.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/lander.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

namespace {

using namespace rim::world;

constexpr std::uint64_t kSeed = 41;

const LanderParams &params() {
  static const LanderParams p = read_lander_params(rim::data_path("lander.toml"));
  return p;
}

const LanderRun &nominal(std::uint64_t run) {
  static const std::vector<LanderRun> runs = [] {
    std::vector<LanderRun> all;
    for (std::uint64_t k = 0; k < 12; ++k)
      all.push_back(simulate_lander(params(), {}, kSeed, k));
    return all;
  }();
  return runs[run];
}

const std::string kHead = "name = \"n\"\ndescription = \"d\"\n";
const std::string kMass = kHead + "[[term]]\ntarget = \"sensor\"\nsensor = \"s.mass_kg\"\n";

Effect effect_of(const std::string &text) {
  const std::string path = temporary_file(text);
  Effect effect = read_effect(path, params());
  return effect;
}

Effect sensor_effect(const std::string &sensor, const std::string &kind, double size,
                     const std::string &more = "") {
  return effect_of(kHead + "[[term]]\ntarget = \"sensor\"\nsensor = \"" + sensor + "\"\nkind = \"" +
                   kind + "\"\nmultiple = 1.0\ndispersion = " + std::to_string(size) +
                   "\nderivation = \"test\"\n" + more);
}

std::vector<Effect> shipped() {
  std::vector<std::string> paths;
  const std::string folder = std::filesystem::path(rim::data_path("lander.toml")).parent_path();
  for (const auto &entry : std::filesystem::directory_iterator(folder + "/effects")) {
    if (entry.path().extension() == ".toml")
      paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Effect> effects;
  for (const std::string &path : paths)
    effects.push_back(read_effect(path, params()));
  return effects;
}

double quantity(const LanderRun &run, std::size_t k, Quantity q) {
  return run.rows[k].quantity[static_cast<std::size_t>(q)];
}

Eigen::Index column(const char *name) { return static_cast<Eigen::Index>(sensor_index(name)); }

void twelve_ship_at_4_to_8_dispersions(void **) {
  const std::vector<Effect> effects = shipped();
  assert_int_equal(effects.size(), 12);
  bool is_used[16] = {false};
  for (const Effect &effect : effects) {
    assert_true(!effect.name.empty() && !effect.description.empty());
    for (const EffectTerm &term : effect.terms) {
      assert_true(term.multiple >= 4.0 && term.multiple <= 8.0);
      is_used[static_cast<int>(term.kind)] = true;
    }
  }
  for (int kind = 0; kind <= static_cast<int>(EffectKind::misalignment); ++kind)
    assert_true(is_used[kind]);
}

// Other columns, rows before and the truth of the vehicle are untouched by a sensor's fault.
void sensor_effects_touch_their_sensor_only(void **) {
  const LanderRun &healthy = nominal(3);
  for (const Effect &effect : shipped()) {
    if (effect.terms[0].is_physics())
      continue;
    const LanderRun run = simulate_lander(params(), {effect}, kSeed, 3);
    assert_int_equal(run.rows.size(), healthy.rows.size());
    std::size_t acting = 0;
    for (std::size_t k = 0; k < run.rows.size(); ++k) {
      const auto r = static_cast<Eigen::Index>(k);
      for (std::size_t c = 0; c < kSensors; ++c) {
        const auto e = static_cast<Eigen::Index>(c);
        if (c != effect.terms[0].sensor || run.acts[k] == 0)
          assert_true(run.readings(r, e) == healthy.readings(r, e));
      }
      acting += run.acts[k];
    }
    assert_true(acting > 100);
  }
}

// On no row does the fault shift the expected reading by 4 sd of the reading's white noise.
void no_row_gives_a_sensor_fault_away(void **) {
  for (const Effect &effect : shipped()) {
    if (effect.terms[0].is_physics())
      continue;
    const std::size_t sensor = effect.terms[0].sensor;
    const auto c = static_cast<Eigen::Index>(sensor);
    const double noise = params().sensor[sensor].noise_sd;
    for (std::uint64_t k = 0; k < 12; ++k) {
      const LanderRun run = simulate_lander(params(), {effect}, kSeed, k);
      const LanderRun &healthy = nominal(k);
      std::size_t held_from = 0;
      for (std::size_t i = 1; i < run.rows.size(); ++i) {
        const auto r = static_cast<Eigen::Index>(i);
        if (run.acts[i] == 0)
          held_from = i;
        if (run.acts[i] == 0)
          continue;
        double shift = run.readings(r, c) - healthy.readings(r, c);
        if (effect.terms[0].kind == EffectKind::dropout)
          shift = -run.rows[i].sensor[sensor]; // a zero in place of the expected reading
        if (effect.terms[0].kind == EffectKind::stuck)
          shift = run.rows[held_from].sensor[sensor] - run.rows[i].sensor[sensor];
        if (std::fabs(shift) >= 4.0 * noise)
          fail_msg("%s: row %zu: %g is %g sd", effect.name.c_str(), i, shift, shift / noise);
      }
    }
  }
}

// For a given state and command, the physics faults shift what a row shows by under 4 sd of noise.
void no_row_gives_a_physics_fault_away(void **) {
  for (const Effect &effect : shipped()) {
    const EffectTerm &term = effect.terms[0];
    if (!term.is_physics())
      continue;
    double largest = 0.0;
    for (const LanderRow &row : nominal(0).rows) {
      const double mps2 = row.sensor[sensor_index("acceleration_mps2")];
      const double share = term.engine == kEngines ? 1.0 : 0.25;
      const double noise = params().sensor[sensor_index("acceleration_mps2")].noise_sd;
      if (term.kind == EffectKind::misalignment) {
        // Guidance wants the same attitude in the same state: only the push shows, as velocity.
        largest =
            std::fmax(largest, mps2 * term.size() * kLanderStep_s /
                                   params().sensor[sensor_index("velocity_imu_x_mps")].noise_sd);
        continue;
      }
      largest = std::fmax(largest, share * term.size() * mps2 / noise);
      if (term.kind == EffectKind::thrust_loss) {
        const std::size_t chamber = 21 + term.engine;
        largest = std::fmax(largest,
                            term.size() * row.sensor[chamber] / params().sensor[chamber].noise_sd);
      }
    }
    if (largest >= 4.0)
      fail_msg("%s: %g sd on one row", effect.name.c_str(), largest);
  }
}

// The lean that a misalignment leads to is within what nominal runs differ by at the same time.
void the_lean_of_a_misalignment_is_hidden(void **) {
  for (const Effect &effect : shipped()) {
    if (effect.terms[0].kind != EffectKind::misalignment)
      continue;
    const std::size_t pitch = sensor_index("pitch_rad");
    double low = 1e9, high = -1e9;
    for (std::uint64_t k = 0; k < 12; ++k) {
      const double value = nominal(k).rows[7600].sensor[pitch];
      low = std::fmin(low, value);
      high = std::fmax(high, value);
    }
    assert_true(high - low > effect.terms[0].size());
  }
}

// Row-to-row changes of every sensor stay within what nominal rows show, but for their tails.
void changes_from_row_to_row_look_nominal(void **) {
  Eigen::ArrayXd widest = Eigen::ArrayXd::Zero(kSensors);
  const auto change = [](const LanderRun &run) {
    const Eigen::Index n = run.readings.rows();
    return Eigen::ArrayXd((run.readings.bottomRows(n - 1) - run.readings.topRows(n - 1))
                              .cwiseAbs()
                              .colwise()
                              .maxCoeff()
                              .transpose());
  };
  for (std::uint64_t k = 0; k < 12; ++k)
    widest = widest.max(change(nominal(k)));
  for (const Effect &effect : shipped()) {
    for (std::uint64_t k = 0; k < 4; ++k) {
      const LanderRun run = simulate_lander(params(), {effect}, kSeed + 1, k);
      const Eigen::ArrayXd ratio = change(run) / widest;
      Eigen::Index worst = 0;
      // 1.3: the maximum of 12 runs is itself a random number, and noise raised by 57 % in
      // variance (11) reaches 1.25.
      if (ratio.maxCoeff(&worst) >= 1.3)
        fail_msg("%s: %s changes by %g times the nominal", effect.name.c_str(),
                 sensor_names()[static_cast<std::size_t>(worst)].c_str(), ratio.maxCoeff());
    }
  }
}

void bias_gain_drift_coupling_add_what_they_say(void **) {
  const LanderRun &healthy = nominal(2);
  struct Case {
    const char *kind;
    double size;
  };
  for (const Case &test :
       {Case{"bias", 30.0}, Case{"gain", 0.02}, Case{"drift", 0.1}, Case{"cross_coupling", 50.0}}) {
    const LanderRun run =
        simulate_lander(params(), {sensor_effect("mass_kg", test.kind, test.size)}, kSeed, 2);
    const auto c = column("mass_kg");
    for (std::size_t k = 0; k < run.rows.size(); k += 13) {
      const auto r = static_cast<Eigen::Index>(k);
      const double truth = run.rows[k].sensor[static_cast<std::size_t>(c)];
      double expected = test.size;
      if (std::strcmp(test.kind, "gain") == 0)
        expected *= truth;
      if (std::strcmp(test.kind, "drift") == 0)
        expected *= run.rows[k].t_s;
      if (std::strcmp(test.kind, "cross_coupling") == 0)
        expected *= quantity(run, k, Quantity::thrust);
      assert_true(std::fabs(run.readings(r, c) - healthy.readings(r, c) - expected) < 0.11);
      assert_int_equal(run.acts[k], expected != 0.0);
    }
  }
}

void gates_open_where_they_say(void **) {
  const Effect effect =
      sensor_effect("mass_kg", "bias", 30.0,
                    "gate = { altitude_m = [[1000.0, 5000.0], [20000.0, 30000.0]], "
                    "speed_mps = [100.0, 380.0] }\n");
  const LanderRun run = simulate_lander(params(), {effect}, kSeed, 2);
  std::size_t open = 0;
  for (std::size_t k = 0; k < run.rows.size(); ++k) {
    const double h = quantity(run, k, Quantity::altitude_m);
    const double v = quantity(run, k, Quantity::speed_mps);
    const bool is_open = ((h >= 1000.0 && h <= 5000.0) || (h >= 20000.0 && h <= 30000.0)) &&
                         v >= 100.0 && v <= 380.0;
    assert_int_equal(run.acts[k], is_open);
    open += is_open;
  }
  assert_true(open > 200);
}

void noise_raises_the_variance(void **) {
  const Effect effect = sensor_effect("altitude_laser_m", "noise", 3.0);
  const LanderRun run = simulate_lander(params(), {effect}, kSeed, 2);
  const auto c = column("altitude_laser_m");
  double ratio[2] = {0.0, 0.0};
  const LanderRun *pair[2] = {&nominal(2), &run};
  for (int i = 0; i < 2; ++i) {
    for (Eigen::Index k = 1; k < 6000; ++k) {
      const double e1 = pair[i]->readings(k, c) - run.rows[static_cast<std::size_t>(k)].sensor[10];
      const double e0 =
          pair[i]->readings(k - 1, c) - run.rows[static_cast<std::size_t>(k - 1)].sensor[10];
      ratio[i] += (e1 - e0) * (e1 - e0);
    }
  }
  assert_true(std::fabs(ratio[1] / ratio[0] - 4.0) < 0.3);
}

void dropout_reads_zero_at_its_rate(void **) {
  const LanderRun run =
      simulate_lander(params(), {sensor_effect("mass_kg", "dropout", 0.1)}, kSeed, 2);
  double zeros = 0.0;
  for (std::size_t k = 0; k < run.rows.size(); ++k) {
    const double value = run.readings(static_cast<Eigen::Index>(k), column("mass_kg"));
    assert_int_equal(run.acts[k], value == 0.0);
    zeros += value == 0.0;
  }
  const double share = zeros / static_cast<double>(run.rows.size());
  assert_true(std::fabs(share - 0.1) < 5.0 * 0.3 / std::sqrt(8000.0));
}

void stuck_holds_for_its_rows(void **) {
  const Effect effect = sensor_effect("velocity_imu_z_mps", "stuck", 0.2, "hold_rows = 5\n");
  const LanderRun run = simulate_lander(params(), {effect}, kSeed, 2);
  const auto c = column("velocity_imu_z_mps");
  std::size_t length = 0, held = 0;
  for (std::size_t k = 1; k < run.rows.size(); ++k) {
    const auto r = static_cast<Eigen::Index>(k);
    if (run.acts[k] != 0) {
      assert_true(run.readings(r, c) == run.readings(r - 1, c));
      ++length;
      ++held;
    } else {
      assert_true(length == 0 || length == 5);
      length = 0;
    }
  }
  assert_true(std::fabs(static_cast<double>(held) / static_cast<double>(run.rows.size()) - 0.2) <
              0.05);
}

void delay_shows_an_earlier_value(void **) {
  const LanderRun run =
      simulate_lander(params(), {sensor_effect("velocity_imu_z_mps", "delay", 0.25)}, kSeed, 2);
  const auto c = column("velocity_imu_z_mps");
  const LanderRun &healthy = nominal(2);
  for (std::size_t k = 10; k < run.rows.size(); k += 7) {
    const auto r = static_cast<Eigen::Index>(k);
    const double shift = run.rows[k - 5].sensor[5] - run.rows[k].sensor[5];
    assert_true(std::fabs(run.readings(r, c) - healthy.readings(r, c) - shift) < 0.011);
  }
}

// Guidance sees what the physics does: throttle goes up for lost specific impulse, the trim changes
// for one weak or a tilted set of engines, and the vehicle still lands.
void physics_effects_run_through_guidance(void **) {
  const LanderRun &healthy = nominal(2);
  for (const Effect &effect : shipped()) {
    const EffectTerm &term = effect.terms[0];
    if (!term.is_physics())
      continue;
    const LanderRun run = simulate_lander(params(), {effect}, kSeed, 2);
    assert_true(run.touchdown_velocity_mps[2] > -3.0);
    double mean[2][4] = {};
    const LanderRun *pair[2] = {&healthy, &run};
    for (int i = 0; i < 2; ++i) {
      for (std::size_t k = 7200; k < 7800; ++k) {
        for (std::size_t e = 0; e < kEngines; ++e)
          mean[i][e] += pair[i]->rows[k].throttle[e] / 600.0;
      }
    }
    const double all = (mean[1][0] + mean[1][1] + mean[1][2] + mean[1][3]) /
                       (mean[0][0] + mean[0][1] + mean[0][2] + mean[0][3]);
    const double one = mean[1][1] / mean[0][1] / all;
    const double pitch = (mean[1][0] + mean[1][3] - mean[1][1] - mean[1][2]) -
                         (mean[0][0] + mean[0][3] - mean[0][1] - mean[0][2]);
    if (term.kind == EffectKind::isp_loss)
      assert_true(all > 1.004 && all < 1.02);
    if (term.kind == EffectKind::thrust_loss)
      assert_true(one > 1.005 && all > 1.002);
    if (term.kind == EffectKind::misalignment)
      assert_true(std::fabs(pitch) > 0.005);
    for (std::size_t k = 0; k < run.rows.size(); ++k)
      assert_int_equal(run.acts[k], quantity(run, k, Quantity::thrusting) > 0.5);
  }
}

void effects_combine(void **) {
  const Effect mass = sensor_effect("mass_kg", "bias", 30.0);
  const Effect radar = sensor_effect("altitude_radar_m", "bias", 50.0);
  const LanderRun run = simulate_lander(params(), {mass, radar}, kSeed, 2);
  const LanderRun &healthy = nominal(2);
  for (Eigen::Index k = 0; k < run.readings.rows(); k += 50) {
    for (const char *name : {"mass_kg", "altitude_radar_m"}) {
      const double shift = run.readings(k, column(name)) - healthy.readings(k, column(name));
      assert_true(std::fabs(shift - (name[0] == 'm' ? 30.0 : 50.0)) < 0.11);
    }
  }
}

void assert_refused(const std::string &text, const char *words) {
  const std::string path = temporary_file(text);
  std::string message = "(nothing)";
  try {
    read_effect(path, params());
  } catch (const rim::DataError &error) {
    message = error.what();
  }
  if (message.find(path) == std::string::npos || message.find(words) == std::string::npos)
    fail_msg("'%s' gave '%s', wanted '%s'", text.c_str(), message.c_str(), words);
}

void bad_files_are_named(void **) {
  const std::string size = "multiple = 5.0\ndispersion = \"bias_sd\"\n";
  const std::string bias = kMass + "kind = \"bias\"\n";
  assert_refused("name = 3\n" + bias.substr(bias.find("description")) + size, "line 1: key 'name'");
  assert_refused(kHead, "key 'term' is missing");
  assert_refused(kHead + "term = 3\n", "one or more [[term]]");
  assert_refused("x = 1\n" + bias + size, "line 1: unknown key 'x'");
  assert_refused(bias + size + "sise = 3\n", "unknown key 'term.sise'");
  assert_refused(kHead + "[[term]]\ntarget = \"sensor\"\nsensor = \"s.masss\"\nkind = \"bias\"\n" +
                     size,
                 "no sensor 's.masss'");
  assert_refused(kMass + "kind = \"biass\"\n" + size, "no kind 'biass'");
  assert_refused(kMass + "kind = \"thrust_loss\"\n" + size, "acts on the physics");
  assert_refused(kMass + size, "'term.kind' is missing");
  assert_refused(bias + "multiple = \"five\"\ndispersion = 1.0\n",
                 "'term.multiple': must be a number");
  assert_refused(bias + "dispersion = 1.0\n", "'term.multiple' is missing");
  assert_refused(bias + "multiple = 5\ndispersion = 1.0\n", "'term.derivation' is missing");
  assert_refused(bias + "multiple = 5\ndispersion = \"flow_sd\"\n", "'flow_sd' is no dispersion");
  assert_refused(bias + "multiple = 5\ndispersion = -1.0\n", "must be positive");
  assert_refused(bias + size + "gate = { height = [0, 1] }\n", "unknown key 'term.gate.height'");
  assert_refused(bias + size + "gate = { altitude_m = [5, 1] }\n", "low must be below high");
  assert_refused(bias + size + "gate = { altitude_m = 5 }\n", "[low, high]");
  assert_refused(bias + size + "gate = { altitude_m = [1, 2, 3] }\n", "[low, high]");
  assert_refused(bias + size + "gate = { thrusting = 1 }\n", "true or false");
  assert_refused(bias + size + "hold_rows = 4\n", "only stuck has hold_rows");
  assert_refused(bias + size + "engine = 4\n", "only thrust_loss and isp_loss");
  assert_refused(kMass + "kind = \"stuck\"\nhold_rows = 0\n" + size, "whole number");
  assert_refused(kMass + "kind = \"dropout\"\n" + size, "is a share");
  const std::string loss = kHead + "[[term]]\ntarget = \"physics\"\nkind = \"thrust_loss\"\n";
  assert_refused(loss + "engine = 5\nmultiple = 5\ndispersion = \"flow_sd\"\n", "must be 1 to 4");
  assert_refused(loss + "multiple = 5\ndispersion = \"flow_sd\"\n", "'term.engine' is missing");
}

} // namespace

int main() {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(twelve_ship_at_4_to_8_dispersions),
      cmocka_unit_test(sensor_effects_touch_their_sensor_only),
      cmocka_unit_test(no_row_gives_a_sensor_fault_away),
      cmocka_unit_test(no_row_gives_a_physics_fault_away),
      cmocka_unit_test(the_lean_of_a_misalignment_is_hidden),
      cmocka_unit_test(changes_from_row_to_row_look_nominal),
      cmocka_unit_test(bias_gain_drift_coupling_add_what_they_say),
      cmocka_unit_test(gates_open_where_they_say),
      cmocka_unit_test(noise_raises_the_variance),
      cmocka_unit_test(dropout_reads_zero_at_its_rate),
      cmocka_unit_test(stuck_holds_for_its_rows),
      cmocka_unit_test(delay_shows_an_earlier_value),
      cmocka_unit_test(physics_effects_run_through_guidance),
      cmocka_unit_test(effects_combine),
      cmocka_unit_test(bad_files_are_named),
  };
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
