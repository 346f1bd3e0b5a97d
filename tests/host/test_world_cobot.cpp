// SPDX-License-Identifier: MIT
// The cobot world: it goes where it is free to, its noise is what is asked, effects act when and
// where they say.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>

#include "check.hpp"
#include "temporary.hpp"
#include "util/data_path.hpp"
#include "util/error.hpp"
#include "world/cobot_log.hpp"

using namespace rim::world;

namespace {

constexpr std::uint64_t kSeed = 71;

struct Floor {
  CobotParams params;
  CobotMap map;
  Floor() { read_cobot(rim::data_path("cobot.toml"), "", &params, &map); }
  Cobot run(std::vector<CobotEffect> effects, std::uint64_t k = 1) const {
    return Cobot(params, map, std::move(effects), kSeed, k);
  }
};

const Floor &the_floor() {
  static const Floor one;
  return one;
}

bool is_refused(const std::function<void()> &work, const std::string &reason) {
  try {
    work();
  } catch (const std::runtime_error &error) {
    if (std::string(error.what()).find(reason) != std::string::npos)
      return true;
    std::printf("'%s' does not say '%s'\n", error.what(), reason.c_str());
  }
  return false;
}

void rays_end_at_walls(void **) {
  CobotMap map;
  map.corridors = {{0, 0, 10, 2}};
  map.doors = {{4, 2, 5, 2.2}};
  map.offices = {{3, 2.2, 7, 6}};
  assert_true(std::fabs(cast_ray(map, 1, 1, 0, 100) - 9) < 1e-6);
  assert_true(std::fabs(cast_ray(map, 1, 1, 3.141592653589793, 100) - 1) < 1e-6);
  assert_true(std::fabs(cast_ray(map, 4.5, 1, 1.5707963267948966, 100) - 5) < 1e-6); // the door
  assert_true(std::fabs(cast_ray(map, 1, 1, 1.5707963267948966, 100) - 1) < 1e-6);
  assert_true(cast_ray(map, 1, 1, 0, 4) == 4.0);
  assert_true(cast_ray(map, -1, 1, 0, 4) == 0.0);
}

void it_drives_where_it_is_free(void **) {
  Cobot cobot = the_floor().run({});
  double driven = 0.0, t_s = 0.0;
  int moving = 0, rows = 0;
  for (int k = 0; k < 40000; ++k) {
    const CobotRow row = cobot.next();
    assert_true(row.t_s > t_s);
    driven += std::fabs(row.velocity[0]) * (row.t_s - t_s);
    t_s = row.t_s;
    moving += row.command[0] > 0.0;
    ++rows;
    if (k % 10 == 0) { // 0.3 m from any wall, less the pose's noise
      const double ahead = cast_ray(the_floor().map, row.x_m, row.y_m, row.phi_rad, 4.0);
      if (ahead < 0.2)
        fail_msg("at %.2f, %.2f", row.x_m, row.y_m);
    }
    assert_false(row.acts);
  }
  assert_true(driven > 200.0);
  assert_true(moving > rows / 3);
}

void noise_is_as_asked(void **) {
  Cobot cobot = the_floor().run({});
  double sum = 0.0, square = 0.0;
  int n = 0, steady = 0;
  for (int k = 0; k < 60000; ++k) {
    const CobotRow row = cobot.next();
    steady = row.in_force[0] == 0.0 && row.in_force[2] == 0.0 ? steady + 1 : 0;
    if (steady < 12)
      continue;
    sum += row.velocity[0];
    square += row.velocity[0] * row.velocity[0];
    ++n;
  }
  assert_true(n > 1000);
  const double sd = std::sqrt(square / n - sum * sum / n / n);
  if (std::fabs(sd - 0.028) > 0.002)
    fail_msg("sd %.4f m/s", sd);
}

// Mean of measured over commanded forward speed at constant speed while `acts` is as asked.
double share_of_speed(const CobotEffect &effect, bool acting) {
  Cobot cobot = the_floor().run({effect});
  double measured = 0.0, commanded = 0.0;
  for (int k = 0; k < 6000; ++k) {
    const CobotRow row = cobot.next();
    if (row.acts != acting || row.in_force[0] != row.command[0] || row.in_force[0] < 0.3)
      continue;
    measured += row.velocity[0];
    commanded += row.in_force[0];
  }
  return measured / commanded;
}

void effects_act(void **) {
  CobotEffect effect;
  effect.kind = CobotEffectKind::encoder;
  assert_true(std::fabs(share_of_speed(effect, true) - (1.0 - 0.05 / 4)) < 0.02);
  effect.kind = CobotEffectKind::hold;
  effect.duration_s = 20.0;
  effect.share = 0.2;
  assert_true(std::fabs(share_of_speed(effect, true) - 0.25) < 0.15);
  assert_true(share_of_speed(effect, false) > 0.85);
  effect.kind = CobotEffectKind::pushed;
  assert_true(share_of_speed(effect, true) > 1.1);
  effect.kind = CobotEffectKind::left_turn;
  Cobot cobot = the_floor().run({effect});
  for (int k = 0; k < 3000; ++k) {
    const CobotRow row = cobot.next();
    assert_int_equal(row.acts, row.in_force[2] > 0.0);
  }
}

void interference_has_its_times(void **) {
  for (int k = 0; k < 30; ++k) {
    CobotEffect effect;
    effect.kind = static_cast<CobotEffectKind>(3 + k % 4);
    effect.phase = static_cast<CobotPhase>(k % 3);
    Cobot cobot = the_floor().run({effect}, 100 + static_cast<std::uint64_t>(k));
    double first = -1.0, last = -1.0;
    for (int i = 0; i < 600; ++i) {
      const CobotRow row = cobot.next();
      if (row.acts && first < 0.0)
        first = row.t_s;
      if (row.acts)
        last = row.t_s;
    }
    const auto intervals = cobot.intervals();
    assert_int_equal(intervals.size(), first < 0.0 ? 0 : 1);
    if (first < 0.0)
      continue;
    assert_true(intervals[0].start_s == first);
    assert_true(intervals[0].end_s >= last && intervals[0].end_s < last + 0.07);
    assert_string_equal(intervals[0].kind.c_str(), cobot_effect_name(effect.kind));
  }
}

void counters_wrap(void **) {
  Cobot cobot = the_floor().run({});
  std::array<std::uint32_t, 4> before{};
  int wraps = 0;
  for (int k = 0; k < 20000; ++k) {
    const CobotRow row = cobot.next();
    for (std::size_t w = 0; w < 4; ++w) {
      assert_true(row.ticks[w] < 65536);
      wraps += row.ticks[w] > 60000 && before[w] < 5000;
    }
    assert_true(std::fabs(row.velocity[0]) < 1.0);
    before = row.ticks;
  }
  assert_true(wraps > 0);
}

void logs_have_their_columns(void **) {
  for (const std::size_t dims : {7u, 15u, 30u, 100u}) {
    Cobot cobot = the_floor().run({});
    const Recording r = record_cobot(cobot, the_floor().params, dims, 50, false);
    assert_int_equal(rim::feature_columns(r.log).size(), dims);
    assert_int_equal(rim::role_columns(r.log, rim::Role::outcome).size(), 3);
    Cobot again = the_floor().run({});
    const Recording other = record_cobot(again, the_floor().params, dims, 50, true);
    assert_int_equal(rim::role_columns(other.log, rim::Role::sensor).size(), 4);
    assert_true(r.log.t_s == other.log.t_s); // the rays take nothing from other streams
  }
  Cobot cobot = the_floor().run({});
  assert_true(is_refused([&] { record_cobot(cobot, the_floor().params, 9, 5, false); }, "dims 7"));
}

void labels_round_trip(void **) {
  const std::string path = temporary_file("");
  write_labels({{"a.csv", {{1.5, 2.5, "hold"}, {4, 5, "stuck"}}}, {"b.csv", {{1, 2, "x"}}}}, path);
  const auto read = read_labels(path);
  assert_int_equal(read.size(), 2);
  assert_int_equal(read[0].intervals.size(), 2);
  assert_true(read[0].intervals[1].end_s == 5.0);
  const std::string head = "log,start_s,end_s,kind\n";
  assert_true(is_refused([&] { read_labels(temporary_file("a,b\n")); }, "first line"));
  assert_true(
      is_refused([&] { read_labels(temporary_file(head + "a,1,2\n")); }, "row 1: 3 columns"));
  assert_true(is_refused([&] { read_labels(temporary_file(head + "a,1,x,h\n")); }, "'end_s'"));
  assert_true(is_refused([&] { read_labels(temporary_file(head + "a,3,2,h\n")); }, "not after"));
}

void effects_are_read(void **) {
  const CobotMap &map = the_floor().map;
  const auto effects = read_cobot_effects(
      temporary_file("[[effect]]\nkind='stuck'\nwheel=3\nphase='starting'\nshare=0.1\n"), map);
  assert_int_equal(effects[0].wheel, 2);
  assert_true(effects[0].phase == CobotPhase::starting);
  for (const char *bad : {"[[effect]]\nkind='x'\n", "[[effect]]\nkind='hold'\nwheel=5\n",
                          "[[effect]]\nshare=1\n", "[[effect]]\nkind='hold'\nshare=-1\n"})
    assert_true(is_refused([&] { read_cobot_effects(temporary_file(bad), map); },
                           temporary_folder().c_str()));
}

} // namespace

int main() {
  std::printf("seed %d\n", static_cast<int>(kSeed));
  const CMUnitTest tests[] = {cmocka_unit_test(rays_end_at_walls),
                              cmocka_unit_test(it_drives_where_it_is_free),
                              cmocka_unit_test(noise_is_as_asked),
                              cmocka_unit_test(effects_act),
                              cmocka_unit_test(interference_has_its_times),
                              cmocka_unit_test(counters_wrap),
                              cmocka_unit_test(logs_have_their_columns),
                              cmocka_unit_test(labels_round_trip),
                              cmocka_unit_test(effects_are_read)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
