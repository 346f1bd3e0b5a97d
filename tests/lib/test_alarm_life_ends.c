/* SPDX-License-Identifier: MIT */
/* monitor/alarm_life.c at its ends: times and ratios that are just reached, what an alarm does not
 * name, detectors that there are not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "monitor/alarm_life.h"

static rim_alarm_life life;
static rim_alarm out;

static rim_alarm finding(double ln_anom) {
  rim_alarm a = sample_alarm(6);
  a.ln_anom = ln_anom;
  a.level = RIM_LEVEL_ERROR;
  return a;
}

static bool row(double t_s, const rim_alarm *candidate) {
  rimi_alarm_life_row(&life, t_s);
  rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, t_s, candidate);
  return rimi_alarm_life_next_record(&life, &out);
}

/* An alarm raised at 0 s, with ln anom 20. */
static void raised(double update_ratio, const rim_alarm *first) {
  const rim_alarm_life_config config = {
      .slot = {{.raise_steps = 1, .inhibit_s = 1.0, .update_ratio = update_ratio}},
      .policy = {.stale_s = 20.0}};
  assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
  assert_true(row(0.0, first));
  assert_int_equal(out.state, RIM_ALARM_RAISED);
}

/* Silence is longer than its time, not as long. */
static void silence_is_longer_than_its_time(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0);
  raised(0.25, &a);
  assert_false(rimi_alarm_life_idle(&life, 20.0));
  assert_true(rimi_alarm_life_idle(&life, 20.001));
}

/* Who asks before the first row need not ask on its clock: what lies between is no silence. Where
 * no row comes at all, that is one, and the first row ends it. */
static void the_first_row_ends_no_silence(void **state) {
  (void)state;
  const rim_alarm_life_config config = {.policy = {.stale_s = 20.0}};
  for (int is_late = 0; is_late < 2; ++is_late) {
    assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
    assert_false(rimi_alarm_life_idle(&life, 0.01));
    assert_false(rimi_alarm_life_idle(&life, 20.0));
    assert_int_equal(is_late && rimi_alarm_life_idle(&life, 21.0), is_late);
    rimi_alarm_life_row(&life, 1.7e9);
    assert_int_equal(life.stale_times, is_late);
    assert_int_equal(rimi_alarm_life_next_record(&life, &out), is_late);
    rimi_alarm_life_row(&life, 1.7e9 + 20.001);
    assert_int_equal(life.stale_times, is_late + 1); /* that one was */
  }
}

/* Of either detector, steps on both sides of a silence are not in a row. */
static void silence_breaks_what_each_detector_found(void **state) {
  (void)state;
  for (uint32_t detector = 0; detector < RIM_DETECTORS; ++detector) {
    rim_alarm_life_config config = {.policy = {.stale_s = 20.0}};
    config.slot[0] = config.slot[1] = (rim_alarm_slot_config){.raise_steps = 2};
    assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
    rim_alarm a = finding(20.0);
    a.detector = (uint8_t)detector;
    rimi_alarm_life_row(&life, 0.0);
    rimi_alarm_life_step(&life, detector, 0.0, &a);
    assert_int_equal(life.slot[detector].found, 1);
    rimi_alarm_life_row(&life, 30.0);
    assert_int_equal(life.slot[detector].found, 0);
  }
}

/* An update may leave when its time has just passed, and when ln anom has just moved by its share;
 * what has not moved at all is none. */
static void an_update_that_is_just_one(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0), more = finding(25.0), little = finding(24.9);
  raised(0.25, &a);
  assert_false(row(0.999, &more));
  assert_true(row(1.0, &more));
  assert_int_equal(out.state, RIM_ALARM_UPDATED);
  raised(0.25, &a);
  assert_false(row(5.0, &little));
  raised(0.0, &a);
  assert_false(row(5.0, &a));
  assert_true(row(6.0, &little));
}

/* Between the warning and the alarm the alarm still stands. The same finding may weaken there;
 * another one, or the other direction, would not have raised it. */
static void a_warning_does_not_replace_a_finding(void **state) {
  (void)state;
  rim_alarm a = finding(20.0);
  raised(0.25, &a);
  a.level = RIM_LEVEL_WARN;
  a.ln_anom = 10.0;
  assert_true(row(2.0, &a));
  assert_true(out.ln_anom == 10.0);
  rim_alarm other[3] = {a, a, a};
  other[0].shift[0] = -a.shift[0];
  other[1].channel[0]++;
  other[2].kind = (uint8_t)(a.kind == 0);
  for (int i = 0; i < 3; ++i)
    assert_false(row(4.0 + 2.0 * i, &other[i]));
  for (int i = 0; i < 3; ++i) {
    other[i].level = RIM_LEVEL_ERROR;
    assert_true(row(10.0 + 2.0 * i, &other[i]));
  }
}

/* A shift of zero has no direction: neither it nor one that follows it points the other way. */
static void zero_has_no_direction(void **state) {
  (void)state;
  rim_alarm a = finding(20.0);
  const double shift = a.shift[0];
  a.shift[0] = 0.0;
  raised(0.25, &a);
  assert_false(row(5.0, &a));
  a.shift[0] = shift;
  assert_false(row(10.0, &a));
  a.ln_anom = 40.0;
  assert_true(row(15.0, &a));
}

/* Without an outcome there is none that could be another. */
static void what_is_not_named_makes_no_other_alarm(void **state) {
  (void)state;
  rim_alarm a = finding(20.0), b;
  a.channels = 0;
  b = a;
  b.channel[0] ^= 1u;
  raised(0.25, &a);
  assert_false(row(5.0, &b));
  b.channels = 1;
  assert_true(row(6.0, &b));
}

/* The step that raises is told before; a detector that there is not raises nothing. */
static void what_would_raise(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0);
  const rim_alarm_life_config config = {.slot = {{.raise_steps = 3}, {.raise_steps = 1}}};
  assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
  for (int i = 0; i < 3; ++i) {
    assert_int_equal(rimi_alarm_life_would_raise(&life, RIM_DETECTOR_RIM, &a), i == 2);
    assert_int_equal(row(0.1 * i, &a), i == 2);
  }
  assert_true(rimi_alarm_life_would_raise(&life, RIM_DETECTOR_INTERFERENCE, &a));
  assert_false(rimi_alarm_life_would_raise(&life, (rim_detector)RIM_DETECTORS, &a));
}

/* The number of an alarm that was cleared names none that was raised since and is not told yet; 0
 * names all that stand where the policy says so. */
static void an_alarm_without_a_number_is_not_named(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0);
  rim_alarm_life_config config = {.slot = {{.raise_steps = 1, .clear_steps = 1}}};
  for (uint32_t how = 0; how < 3; ++how) { /* after its CLEARED; as the first one; with any */
    config.policy.command_any = how == 2;
    assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
    if (how == 0)
      assert_true(row(1.0, &a) && row(2.0, NULL) && out.state == RIM_ALARM_CLEARED);
    const uint32_t seq = life.seq;
    rimi_alarm_life_row(&life, 3.0);
    rimi_alarm_life_step(&life, RIM_DETECTOR_RIM, 3.0, &a);
    const rim_alarm_life before = life;
    rim_command command = {.sequence = seq, .command = RIM_COMMAND_CLEAR};
    uint32_t forget = 1;
    assert_int_equal(rimi_alarm_life_command(&life, &command, 8, &forget),
                     how == 2 ? RIM_OK : RIM_E_DATA);
    assert_int_equal(forget, how == 2);
    if (how == 2)
      continue;
    assert_memory_equal(&life, &before, sizeof life);
    assert_true(rimi_alarm_life_next_record(&life, &out) && out.state == RIM_ALARM_RAISED);
    command.sequence = out.seq;
    assert_int_equal(rimi_alarm_life_command(&life, &command, 8, &forget), RIM_OK);
    assert_int_equal(forget, 1);
  }
}

/* A restart ends what stands, and leaves what is counted. */
static void a_restart_leaves_what_is_counted(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0);
  raised(0.25, &a);
  life.empty_s = 7.0;
  life.stale_times = 9;
  const rim_alarm_life before = life;
  rimi_alarm_life_restart(&life, 100.0);
  assert_true(life.empty_s == 7.0 && life.stale_times == 9 && life.row_s == 100.0);
  assert_true(life.seq == before.seq && life.raised == before.raised);
  assert_true(rimi_alarm_life_next_record(&life, &out));
  assert_int_equal(out.state, RIM_ALARM_CLEARED);
}

/* Of two records that wait the older leaves first, also where tickets begin anew. */
static void the_older_record_leaves_first(void **state) {
  (void)state;
  const rim_alarm a = finding(20.0);
  static const uint32_t ticket[][2] = {
      {5, 6}, {5, 9}, {5, 1000}, {9, 5}, {UINT32_MAX - 1u, 3}, {3, UINT32_MAX - 1u}};
  for (size_t i = 0; i < sizeof ticket / sizeof *ticket; ++i) {
    const rim_alarm_life_config config = {.slot = {{.raise_steps = 1}, {.raise_steps = 1}}};
    assert_int_equal(rimi_alarm_life_init(&life, &config), RIM_OK);
    rimi_alarm_life_row(&life, 0.0);
    for (unsigned detector = 0; detector < RIM_DETECTORS; ++detector) {
      rimi_alarm_life_step(&life, (rim_detector)detector, 0.0, &a);
      assert_true(life.slot[detector].due);
      life.slot[detector].ticket = ticket[i][detector];
    }
    const bool is_second = i == 3 || i == 5;
    assert_true(rimi_alarm_life_next_record(&life, &out));
    assert_int_equal(out.detector, is_second ? 1 : 0);
    assert_true(rimi_alarm_life_next_record(&life, &out));
    assert_int_equal(out.detector, is_second ? 0 : 1);
    assert_false(rimi_alarm_life_next_record(&life, &out));
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(silence_is_longer_than_its_time),
      cmocka_unit_test(the_first_row_ends_no_silence),
      cmocka_unit_test(silence_breaks_what_each_detector_found),
      cmocka_unit_test(an_update_that_is_just_one),
      cmocka_unit_test(a_warning_does_not_replace_a_finding),
      cmocka_unit_test(zero_has_no_direction),
      cmocka_unit_test(what_is_not_named_makes_no_other_alarm),
      cmocka_unit_test(what_would_raise),
      cmocka_unit_test(an_alarm_without_a_number_is_not_named),
      cmocka_unit_test(the_older_record_leaves_first),
      cmocka_unit_test(a_restart_leaves_what_is_counted),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
