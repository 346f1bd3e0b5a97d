/* The life of an alarm: nothing is sent too early, too often, or after it is over. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "rim/alarm.h"

static const rim_alarm_life_config CONFIG = {
    .raise_steps = 3, .clear_steps = 5, .inhibit_s = 1.0, .update_ratio = 0.2, .stale_s = 2.0};

static rim_alarm finding(double ln_anom, rim_level level) {
  rim_alarm a = sample_alarm(6);
  a.ln_anom = ln_anom;
  a.level = (uint8_t)level;
  a.flags = 0;
  a.state = RIM_ALARM_NONE;
  return a;
}

static rim_alarm_life raised(rim_alarm *out) {
  rim_alarm_life life;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  assert_int_equal(rim_alarm_life_init(&life, &CONFIG), RIM_OK);
  assert_false(rim_alarm_life_step(&life, 0.0, &a, out));
  assert_false(rim_alarm_life_step(&life, 0.1, &a, out));
  assert_true(rim_alarm_life_step(&life, 0.2, &a, out));
  return life;
}

static void is_raised_after_so_many_steps_in_a_row(void **state) {
  (void)state;
  rim_alarm out;
  rim_alarm_life life = raised(&out);
  assert_int_equal(out.state, RIM_ALARM_RAISED);
  assert_int_equal(out.level, RIM_LEVEL_ERROR);
  assert_int_equal(out.seq, 1);
  assert_true(out.t_s == 0.2);
  const rim_alarm want = finding(20.0, RIM_LEVEL_ERROR);
  assert_true(out.since_s == want.since_s);
  assert_memory_equal(&out.region, &want.region, sizeof want.region);
  /* Interrupted, the count begins again. */
  assert_int_equal(rim_alarm_life_init(&life, &CONFIG), RIM_OK);
  for (int i = 0; i < 50; i++)
    assert_false(rim_alarm_life_step(&life, 0.1 * i, i % 3 == 2 ? NULL : &want, &out));
}

static void updates_are_inhibited_unless_the_level_rises(void **state) {
  (void)state;
  rim_alarm out;
  rim_alarm_life life = raised(&out);
  rim_alarm a = finding(30.0, RIM_LEVEL_ERROR);
  assert_false(rim_alarm_life_step(&life, 0.3, &a, &out));
  assert_false(rim_alarm_life_step(&life, 1.19, &a, &out));
  assert_true(rim_alarm_life_step(&life, 1.21, &a, &out));
  assert_int_equal(out.state, RIM_ALARM_UPDATED);
  assert_int_equal(out.seq, 2);
  /* Little has moved: no update, however long. */
  a.ln_anom = 33.0;
  assert_false(rim_alarm_life_step(&life, 10.0, &a, &out));
  a.channel[0]++;
  assert_true(rim_alarm_life_step(&life, 10.1, &a, &out));
  a.level = RIM_LEVEL_WARN;
  assert_false(rim_alarm_life_step(&life, 10.2, &a, &out));
  assert_true(rim_alarm_life_step(&life, 11.2, &a, &out));
  assert_int_equal(out.level, RIM_LEVEL_WARN);
  a.level = RIM_LEVEL_ERROR;
  assert_true(rim_alarm_life_step(&life, 11.3, &a, &out)); /* a rise does not wait */
  assert_int_equal(out.seq, 5);
}

static void is_cleared_once_with_the_region_it_had(void **state) {
  (void)state;
  rim_alarm out;
  rim_alarm_life life = raised(&out);
  const rim_alarm ok = finding(1.0, RIM_LEVEL_OK);
  const rim_region region = out.region;
  for (int i = 0; i < 4; i++)
    assert_false(rim_alarm_life_step(&life, 1.0 + i, i % 2 ? NULL : &ok, &out));
  assert_true(rim_alarm_life_step(&life, 5.0, NULL, &out));
  assert_int_equal(out.state, RIM_ALARM_CLEARED);
  assert_int_equal(out.level, RIM_LEVEL_OK);
  assert_memory_equal(&out.region, &region, sizeof region);
  for (int i = 0; i < 20; i++)
    assert_false(rim_alarm_life_step(&life, 6.0 + i, NULL, &out));
  /* It can come again. */
  const rim_alarm a = finding(20.0, RIM_LEVEL_WARN);
  assert_false(rim_alarm_life_step(&life, 30.0, &a, &out));
  assert_false(rim_alarm_life_step(&life, 30.1, &a, &out));
  assert_true(rim_alarm_life_step(&life, 30.2, &a, &out));
  assert_int_equal(out.state, RIM_ALARM_RAISED);
  assert_int_equal(out.seq, 3);
}

static void latches_without_a_clear_count(void **state) {
  (void)state;
  rim_alarm_life life;
  rim_alarm out;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  assert_int_equal(rim_alarm_life_init(&life, NULL), RIM_OK);
  assert_true(rim_alarm_life_step(&life, 0.0, &a, &out)); /* raise_steps 0 is 1 */
  assert_true((out.flags & RIM_ALARM_FLAG_LATCHED) != 0);
  for (int i = 1; i < 1000; i++)
    assert_false(rim_alarm_life_step(&life, i, NULL, &out));
  assert_int_equal(out.state, RIM_ALARM_RAISED);
}

static void goes_stale_once_and_comes_back(void **state) {
  (void)state;
  rim_alarm out;
  rim_alarm_life life = raised(&out);
  assert_false(rim_alarm_life_idle(&life, 2.1, &out));
  assert_true(rim_alarm_life_idle(&life, 2.3, &out));
  assert_int_equal(out.level, RIM_LEVEL_STALE);
  assert_int_equal(out.state, RIM_ALARM_UPDATED);
  assert_false(rim_alarm_life_idle(&life, 9.0, &out));
  /* The input is back, the finding not yet gone: the alarm stands as it stood. */
  assert_true(rim_alarm_life_step(&life, 9.1, NULL, &out));
  assert_int_equal(out.level, RIM_LEVEL_ERROR);
  assert_int_equal(out.state, RIM_ALARM_UPDATED);

  assert_int_equal(rim_alarm_life_init(&life, &CONFIG), RIM_OK);
  assert_false(rim_alarm_life_idle(&life, 100.0, &out)); /* nothing has come yet */
  assert_false(rim_alarm_life_step(&life, 0.0, NULL, &out));
  assert_true(rim_alarm_life_idle(&life, 3.0, &out));
  assert_int_equal(out.state, RIM_ALARM_NONE);
  assert_int_equal(out.level, RIM_LEVEL_STALE);
  assert_true(rim_alarm_life_step(&life, 3.1, NULL, &out));
  assert_int_equal(out.state, RIM_ALARM_NONE);
  assert_int_equal(out.level, RIM_LEVEL_OK);
}

static void steps_across_a_gap_are_not_in_a_row(void **state) {
  (void)state;
  rim_alarm_life life;
  rim_alarm out;
  const rim_alarm a = finding(20.0, RIM_LEVEL_ERROR);
  assert_int_equal(rim_alarm_life_init(&life, &CONFIG), RIM_OK);
  assert_false(rim_alarm_life_step(&life, 0.0, &a, &out));
  assert_false(rim_alarm_life_step(&life, 0.1, &a, &out));
  assert_true(rim_alarm_life_idle(&life, 5.0, &out));
  assert_true(rim_alarm_life_step(&life, 5.1, &a, &out)); /* fresh again, not raised */
  assert_int_equal(out.state, RIM_ALARM_NONE);
  assert_false(rim_alarm_life_step(&life, 5.2, &a, &out));
  assert_true(rim_alarm_life_step(&life, 5.3, &a, &out));
  assert_int_equal(out.state, RIM_ALARM_RAISED);
}

static void bad_clocks_neither_alarm_nor_silence(void **state) {
  (void)state;
  rim_alarm out;
  rim_alarm_life life = raised(&out);
  rim_alarm a = finding(40.0, RIM_LEVEL_ERROR);
  rim_alarm before;
  memcpy(&before, &out, sizeof out);
  assert_false(rim_alarm_life_step(&life, (double)NAN, &a, &out));
  assert_false(rim_alarm_life_idle(&life, (double)INFINITY, &out));
  assert_memory_equal(&out, &before, sizeof out);
  assert_int_equal(life.bad_time, 2);
  /* Back by a day: the inhibition must not last a day. */
  assert_true(rim_alarm_life_step(&life, -86400.0, &a, &out));
  assert_int_equal(out.state, RIM_ALARM_UPDATED);
}

static void misuse_is_refused(void **state) {
  (void)state;
  rim_alarm_life life, before;
  rim_alarm out;
  memset(&life, 0x11, sizeof life);
  memcpy(&before, &life, sizeof life);
  rim_alarm_life_config bad = CONFIG;
  assert_int_equal(rim_alarm_life_init(NULL, &CONFIG), RIM_E_ARGUMENT);
  bad.inhibit_s = -1.0;
  assert_int_equal(rim_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  bad = CONFIG;
  bad.stale_s = (double)NAN;
  assert_int_equal(rim_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  bad = CONFIG;
  bad.update_ratio = (double)INFINITY;
  assert_int_equal(rim_alarm_life_init(&life, &bad), RIM_E_CONFIG);
  assert_memory_equal(&life, &before, sizeof life);
  assert_false(rim_alarm_life_step(NULL, 0.0, NULL, &out));
  assert_int_equal(rim_alarm_life_init(&life, &CONFIG), RIM_OK);
  assert_false(rim_alarm_life_step(&life, 0.0, NULL, NULL));
  assert_false(rim_alarm_life_idle(NULL, 0.0, &out));
}

/* Whatever the findings: raised and cleared alternate, sequence numbers have no gap. */
static void any_history_is_well_formed(void **state) {
  (void)state;
  uint32_t random = 20240229u;
  print_message("seed %u\n", (unsigned)random);
  for (int run = 0; run < 200; run++) {
    const rim_alarm_life_config config = {.raise_steps = sample_next(&random) % 4u,
                                          .clear_steps = 1u + sample_next(&random) % 4u,
                                          .inhibit_s = sample_between(&random, 0.0, 2.0),
                                          .update_ratio = 0.1,
                                          .stale_s = 1.5};
    rim_alarm_life life;
    rim_alarm out;
    bool active = false;
    uint32_t seq = 0;
    double now_s = 0.0;
    assert_int_equal(rim_alarm_life_init(&life, &config), RIM_OK);
    for (int i = 0; i < 300; i++) {
      const rim_alarm a = finding(sample_between(&random, 10.0, 40.0),
                                  sample_next(&random) % 2u ? RIM_LEVEL_ERROR : RIM_LEVEL_WARN);
      now_s += sample_between(&random, 0.0, 1.0);
      const uint32_t what = sample_next(&random) % 8u;
      const bool sent = what == 0 ? rim_alarm_life_idle(&life, now_s + 1.0, &out)
                                  : rim_alarm_life_step(&life, now_s, what < 4 ? NULL : &a, &out);
      if (!sent)
        continue;
      assert_int_equal(out.seq, ++seq);
      assert_true(out.state != RIM_ALARM_RAISED || !active);
      assert_true((out.state != RIM_ALARM_UPDATED && out.state != RIM_ALARM_CLEARED) || active);
      assert_true(out.state != RIM_ALARM_NONE || !active);
      active = out.state == RIM_ALARM_RAISED || out.state == RIM_ALARM_UPDATED;
    }
    assert_true(seq > 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(is_raised_after_so_many_steps_in_a_row),
      cmocka_unit_test(updates_are_inhibited_unless_the_level_rises),
      cmocka_unit_test(is_cleared_once_with_the_region_it_had),
      cmocka_unit_test(latches_without_a_clear_count),
      cmocka_unit_test(goes_stale_once_and_comes_back),
      cmocka_unit_test(steps_across_a_gap_are_not_in_a_row),
      cmocka_unit_test(bad_clocks_neither_alarm_nor_silence),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(any_history_is_well_formed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
