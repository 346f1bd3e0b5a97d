/* The panel with two alarms at once: that of the regions and that of motion interference. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rimd/panel.h"

static panel p;
static rim_alarm out;
static const panel_config plain = {false, false}, latching = {true, false};

static bool hear(const panel_config *config, double t_s, rim_detector detector,
                 rim_alarm_state state) {
  rim_verdict v;
  memset(&v, 0, sizeof v);
  v.t_s = t_s;
  v.valid = true;
  v.level = RIM_LEVEL_ERROR;
  v.alarm.t_s = t_s;
  v.alarm.detector = (uint8_t)detector;
  v.alarm.state = (uint8_t)state;
  v.alarm.level = state == RIM_ALARM_CLEARED ? RIM_LEVEL_OK : RIM_LEVEL_ERROR;
  v.alarm.region.dims = detector == RIM_DETECTOR_RIM ? 2 : 0;
  memset(&out, 0, sizeof out);
  return panel_step(&p, config, &v, &out);
}

static void is(rim_detector detector, rim_alarm_state state, uint32_t seq) {
  assert_int_equal(out.detector, detector);
  assert_int_equal(out.state, state);
  assert_int_equal(out.seq, seq);
}

static void one_over_leaves_the_other(void **unused) {
  (void)unused;
  for (int first = 0; first < 2; ++first) {
    const rim_detector a = first ? RIM_DETECTOR_INTERFERENCE : RIM_DETECTOR_RIM;
    const rim_detector b = first ? RIM_DETECTOR_RIM : RIM_DETECTOR_INTERFERENCE;
    memset(&p, 0, sizeof p);
    assert_true(hear(&plain, 1.0, a, RIM_ALARM_RAISED));
    is(a, RIM_ALARM_RAISED, 1);
    assert_true(hear(&plain, 2.0, b, RIM_ALARM_RAISED));
    is(b, RIM_ALARM_RAISED, 2);
    assert_non_null(panel_region(&p));
    assert_int_equal(panel_region(&p)->region.dims, 2);
    assert_true(hear(&plain, 3.0, b, RIM_ALARM_CLEARED));
    is(b, RIM_ALARM_CLEARED, 3);
    assert_int_equal(out.level, RIM_LEVEL_OK);
    assert_int_equal(panel_level(&p), RIM_LEVEL_ERROR);
    assert_int_equal(p.newest.detector, a); /* what the summary repeats */
    assert_int_equal(p.newest.state, RIM_ALARM_RAISED);
    assert_true(hear(&plain, 4.0, a, RIM_ALARM_UPDATED));
    is(a, RIM_ALARM_UPDATED, 4); /* not raised anew */
    assert_true(hear(&plain, 5.0, a, RIM_ALARM_CLEARED));
    is(a, RIM_ALARM_CLEARED, 5);
    assert_false(p.stands);
    assert_null(panel_region(&p));
    assert_false(hear(&plain, 6.0, a, RIM_ALARM_CLEARED));
  }
}

static void the_older_may_be_over_first(void **unused) {
  (void)unused;
  memset(&p, 0, sizeof p);
  assert_true(hear(&plain, 1.0, RIM_DETECTOR_RIM, RIM_ALARM_RAISED));
  assert_true(hear(&plain, 2.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_RAISED));
  assert_true(hear(&plain, 3.0, RIM_DETECTOR_RIM, RIM_ALARM_CLEARED));
  is(RIM_DETECTOR_RIM, RIM_ALARM_CLEARED, 3);
  assert_true(p.stands);
  assert_null(panel_region(&p)); /* nothing to look ahead for */
  assert_true(hear(&plain, 4.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED));
  is(RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED, 4);
  assert_false(p.stands);
}

static void what_stands_last_is_latched(void **unused) {
  (void)unused;
  memset(&p, 0, sizeof p);
  assert_true(hear(&latching, 1.0, RIM_DETECTOR_RIM, RIM_ALARM_RAISED));
  assert_true(hear(&latching, 2.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_RAISED));
  assert_true(hear(&latching, 3.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED));
  is(RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED, 3);
  assert_true(hear(&latching, 4.0, RIM_DETECTOR_RIM, RIM_ALARM_CLEARED));
  is(RIM_DETECTOR_RIM, RIM_ALARM_UPDATED, 4);
  assert_true((out.flags & RIM_ALARM_FLAG_LATCHED) != 0 && p.stands && p.is_over);
  assert_non_null(panel_region(&p)); /* latched: it still counts */
  assert_true(hear(&latching, 5.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_RAISED));
  assert_true(hear(&latching, 6.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED));
  is(RIM_DETECTOR_INTERFERENCE, RIM_ALARM_UPDATED, 6); /* latched in its turn */
}

static void forgetting_forgets_both(void **unused) {
  (void)unused;
  memset(&p, 0, sizeof p);
  assert_true(hear(&plain, 1.0, RIM_DETECTOR_RIM, RIM_ALARM_RAISED));
  assert_true(hear(&plain, 2.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_RAISED));
  assert_true(panel_forgotten(&p, &plain, 3.0, &out));
  assert_int_equal(out.state, RIM_ALARM_CLEARED);
  assert_false(p.stands);
  assert_true(hear(&plain, 4.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_RAISED));
  assert_true(hear(&plain, 5.0, RIM_DETECTOR_INTERFERENCE, RIM_ALARM_CLEARED));
  assert_false(p.stands); /* nothing old comes to the front */
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(one_over_leaves_the_other),
      cmocka_unit_test(the_older_may_be_over_first),
      cmocka_unit_test(what_stands_last_is_latched),
      cmocka_unit_test(forgetting_forgets_both),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
