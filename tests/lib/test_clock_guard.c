/* SPDX-License-Identifier: MIT */
/* Which times are believed: a clock that jumps, goes back, runs on, or begins anew. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rim/monitor.h"

static const rim_clock_guard_config CONFIG = {.max_jump_s = 10.0, .resync_rows = 5};

static rim_clock_answer take(rim_clock_guard *guard, double t_s, double here_s) {
  return rim_clock_guard_take(guard, &CONFIG, t_s, here_s, 1e9);
}

static rim_clock_guard at_100_s(void) {
  rim_clock_guard guard;
  memset(&guard, 0, sizeof guard);
  assert_int_equal(take(&guard, 100.0, 1.0), RIM_CLOCK_BELIEVED); /* the first one */
  return guard;
}

static void times_must_increase(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  assert_int_equal(take(&guard, 100.0, 1.1), RIM_CLOCK_BACK);
  assert_int_equal(take(&guard, 99.9, 1.2), RIM_CLOCK_BACK);
  assert_int_equal(take(&guard, 100.1, 1.3), RIM_CLOCK_BELIEVED);
}

/* A datagram that comes twice is not another clock, however few rows would be enough of one, and
 * between the rows of another clock it counts neither for nor against it. */
static void a_repeated_time_is_no_other_clock(void **state) {
  (void)state;
  for (uint32_t rows = 0; rows < 3; ++rows) {
    const rim_clock_guard_config config = {.max_jump_s = 1.0, .resync_rows = rows};
    rim_clock_guard guard;
    memset(&guard, 0, sizeof guard);
    const double at[] = {10.0, 10.05, 10.05, 10.05, 10.1};
    for (size_t i = 0; i < sizeof at / sizeof at[0]; ++i)
      assert_int_equal(rim_clock_guard_take(&guard, &config, at[i], at[i], 0.0),
                       i == 2 || i == 3 ? RIM_CLOCK_BACK : RIM_CLOCK_BELIEVED);
    for (uint32_t i = 1; i < rows; ++i) {
      assert_int_equal(rim_clock_guard_take(&guard, &config, 5.0 + i, 10.2, 0.0), RIM_CLOCK_BACK);
      assert_int_equal(rim_clock_guard_take(&guard, &config, 10.1, 10.2, 0.0), RIM_CLOCK_BACK);
    }
    assert_int_equal(rim_clock_guard_take(&guard, &config, 5.0 + rows, 10.3, 0.0),
                     RIM_CLOCK_RESTARTED);
  }
}

static void a_jump_ahead_is_not_believed(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  assert_int_equal(take(&guard, 110.2, 1.1), RIM_CLOCK_FUTURE); /* 10 s, and .1 s passed */
  assert_int_equal(take(&guard, 110.1, 1.1), RIM_CLOCK_BELIEVED);
  assert_int_equal(take(&guard, 1e12, 1.2), RIM_CLOCK_FUTURE);
  assert_int_equal(take(&guard, 110.2, 1.2), RIM_CLOCK_BELIEVED); /* it did no harm */
}

static void silence_explains_a_jump(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  assert_int_equal(take(&guard, 3700.0, 3601.0), RIM_CLOCK_BELIEVED);
  /* A steady clock that went back, as after a restart of the computer, explains nothing. */
  assert_int_equal(take(&guard, 3711.0, 1.0), RIM_CLOCK_FUTURE);
  assert_int_equal(take(&guard, 3709.0, 1.0), RIM_CLOCK_BELIEVED);
}

static void another_clock_is_believed_when_it_goes_on(void **state) {
  (void)state;
  rim_clock_guard back = at_100_s(), ahead = at_100_s();
  for (int i = 1; i <= 5; ++i) {
    assert_int_equal(take(&back, 5.0 + i, 1.0 + i), i < 5 ? RIM_CLOCK_BACK : RIM_CLOCK_RESTARTED);
    assert_int_equal(take(&ahead, 5000.0 + i, 1.0 + i),
                     i < 5 ? RIM_CLOCK_FUTURE : RIM_CLOCK_BELIEVED);
  }
  assert_int_equal(take(&back, 10.5, 7.0), RIM_CLOCK_BELIEVED);
  assert_int_equal(take(&ahead, 5006.0, 7.0), RIM_CLOCK_BELIEVED);
}

static void refused_times_that_do_not_agree_are_never_believed(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  for (int i = 0; i < 100; ++i) /* each far from the one before */
    assert_int_equal(take(&guard, i % 2 ? 1200.0 : 200.0, 1.0), RIM_CLOCK_FUTURE);
  /* A good one in between begins the count anew. */
  for (int i = 1; i <= 4; ++i)
    assert_int_equal(take(&guard, 5.0 + i, 1.0), RIM_CLOCK_BACK);
  assert_int_equal(take(&guard, 101.0, 1.0), RIM_CLOCK_BELIEVED);
  for (int i = 5; i <= 8; ++i)
    assert_int_equal(take(&guard, 5.0 + i, 1.0), RIM_CLOCK_BACK);
}

static void the_clock_of_the_day_is_compared_when_asked(void **state) {
  (void)state;
  rim_clock_guard guard;
  rim_clock_guard_config config = CONFIG;
  config.max_skew_s = 100.0;
  memset(&guard, 0, sizeof guard);
  assert_int_equal(rim_clock_guard_take(&guard, &config, 1101.0, 0.0, 1000.0), RIM_CLOCK_FUTURE);
  assert_int_equal(rim_clock_guard_take(&guard, &config, 899.0, 0.0, 1000.0), RIM_CLOCK_BACK);
  assert_false(guard.started); /* nor does it count towards another clock */
  assert_int_equal(rim_clock_guard_take(&guard, &config, 1099.0, 0.0, 1000.0), RIM_CLOCK_BELIEVED);
}

/* Each limit is itself allowed. */
static void the_limits_themselves_are_believed(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  assert_int_equal(take(&guard, 110.0, 1.0), RIM_CLOCK_BELIEVED); /* no time passed here */
  rim_clock_guard_config config = CONFIG;
  config.max_skew_s = 100.0;
  for (int late = 0; late < 2; ++late) {
    memset(&guard, 0, sizeof guard);
    assert_int_equal(rim_clock_guard_take(&guard, &config, late ? 900.0 : 1100.0, 0.0, 1000.0),
                     RIM_CLOCK_BELIEVED);
  }
}

static void misuse_is_refused(void **state) {
  (void)state;
  rim_clock_guard guard = at_100_s();
  const rim_clock_guard before = guard;
  assert_int_equal(rim_clock_guard_take(NULL, &CONFIG, 1.0, 0.0, 0.0), RIM_CLOCK_FUTURE);
  assert_int_equal(rim_clock_guard_take(&guard, NULL, 1.0, 0.0, 0.0), RIM_CLOCK_FUTURE);
  assert_int_equal(take(&guard, (double)NAN, 2.0), RIM_CLOCK_FUTURE);
  assert_int_equal(take(&guard, -(double)INFINITY, 2.0), RIM_CLOCK_FUTURE);
  assert_memory_equal(&guard, &before, sizeof guard);
}

/* Rows at 20 Hz, as rimd judges them by default: five periods ahead. */
static const rim_clock_guard_config FLIGHT = {.max_jump_s = 0.25, .resync_rows = 100};

/* One wrong time stamp, near or far, ahead or back, costs no true row. */
static void one_wrong_time_displaces_no_true_row(void **state) {
  (void)state;
  const double off[] = {59.0, 1.0, 0.4, -0.4, -59.0, -1e9, 1e9};
  for (size_t k = 0; k < sizeof off / sizeof off[0]; ++k) {
    rim_clock_guard guard;
    memset(&guard, 0, sizeof guard);
    for (int i = 1; i <= 1000; ++i) {
      const double t_s = 0.05 * i;
      assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, t_s, t_s, 0.0), RIM_CLOCK_BELIEVED);
      if (i % 90 == 0)
        assert_int_not_equal(rim_clock_guard_take(&guard, &FLIGHT, t_s + off[k], t_s, 0.0),
                             RIM_CLOCK_BELIEVED);
    }
    assert_true(guard.last_s == 0.05 * 1000);
  }
}

/* As many wrong rows as one likes, one witness short of the number, and nothing is forgotten. */
static void witnesses_are_counted_between_true_rows(void **state) {
  (void)state;
  rim_clock_guard guard;
  memset(&guard, 0, sizeof guard);
  for (int i = 1; i <= 50; ++i) {
    const double t_s = 1000.0 + 0.05 * i, far_s = i % 2 ? 2000.0 : 10.0;
    assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, t_s, t_s, 0.0), RIM_CLOCK_BELIEVED);
    for (int k = 0; k < 99; ++k)
      assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, far_s + 0.05 * k, t_s, 0.0),
                       i % 2 ? RIM_CLOCK_FUTURE : RIM_CLOCK_BACK);
  }
}

/* After a silence a wrong time can still be ahead of the true one by the jump alone. */
static void silence_explains_no_more_than_itself(void **state) {
  (void)state;
  rim_clock_guard guard;
  memset(&guard, 0, sizeof guard);
  assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 100.0, 50.0, 0.0), RIM_CLOCK_BELIEVED);
  assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 159.0, 80.0, 0.0), RIM_CLOCK_FUTURE);
  assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 130.6, 80.0, 0.0), RIM_CLOCK_FUTURE);
  assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 130.0, 80.0, 0.0), RIM_CLOCK_BELIEVED);
}

/* Witnesses that come late are witnesses too: lost rows are explained by their silence. */
static void witnesses_may_be_apart_by_the_time_that_passed(void **state) {
  (void)state;
  rim_clock_guard guard;
  memset(&guard, 0, sizeof guard);
  assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 500.0, 1.0, 0.0), RIM_CLOCK_BELIEVED);
  for (int i = 1; i <= 100; ++i)
    assert_int_equal(rim_clock_guard_take(&guard, &FLIGHT, 3.0 * i, 1.0 + 3.0 * i, 0.0),
                     i < 100 ? RIM_CLOCK_BACK : RIM_CLOCK_RESTARTED);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(times_must_increase),
      cmocka_unit_test(a_repeated_time_is_no_other_clock),
      cmocka_unit_test(a_jump_ahead_is_not_believed),
      cmocka_unit_test(silence_explains_a_jump),
      cmocka_unit_test(another_clock_is_believed_when_it_goes_on),
      cmocka_unit_test(refused_times_that_do_not_agree_are_never_believed),
      cmocka_unit_test(the_clock_of_the_day_is_compared_when_asked),
      cmocka_unit_test(one_wrong_time_displaces_no_true_row),
      cmocka_unit_test(witnesses_are_counted_between_true_rows),
      cmocka_unit_test(silence_explains_no_more_than_itself),
      cmocka_unit_test(witnesses_may_be_apart_by_the_time_that_passed),
      cmocka_unit_test(the_limits_themselves_are_believed),
      cmocka_unit_test(misuse_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
