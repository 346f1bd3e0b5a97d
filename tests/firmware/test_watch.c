/* SPDX-License-Identifier: MIT */
/* What every framework does with the monitor (integration/watch), in this process: silence where
 * rows come that are all refused, a source that begins again, records in words. */
#include "integration/watch/rim_watch.c"

#include <math.h>
#include <stdio.h>

#include "../lib/monitor_bench.h"

#define BEGIN_S 10.0 /* of the bench's rows */

enum { VALUES = D + 3 * O, MINUTE = (int)(60.0 / PERIOD_S) };

static image blob;
static rim_watch watch;
static _Alignas(8) uint8_t memory[65536];
static struct {
  uint32_t records, stale;
  double stale_s; /* the newest of level STALE */
  uint8_t level;
} heard;

static void hear(void *user, const rim_alarm *record) {
  assert_ptr_equal(user, &heard);
  heard.records++;
  heard.level = record->level;
  if (record->level != RIM_LEVEL_STALE)
    return;
  heard.stale++;
  heard.stale_s = record->t_s;
}

static void begin(void) {
  build(&blob, &calibrated[1]);
  memset(&heard, 0, sizeof heard);
  assert_int_equal(
      rim_watch_open(&watch, memory, sizeof memory, blob.byte, blob.size, hear, &heard), RIM_OK);
  assert_int_equal(watch.values, VALUES);
}

/* Row t of the vehicle at its time and `more_s`; whether it was valid. */
static bool offer(uint32_t t, double more_s) {
  row r;
  double value[VALUES];
  rim_verdict verdict = {0};
  make_row(&r, true, 900, t, 0.0);
  put_values(&r, value);
  assert_int_equal(rim_watch_row(&watch, r.t_s + more_s, value, VALUES, &verdict), RIM_OK);
  return verdict.valid;
}

/* The board's clock, of the same rate as the rows' and from another start. */
static double here_s(uint32_t t) { return 77.0 + PERIOD_S * (double)t; }

static void fly(uint32_t from, uint32_t to, double more_s) {
  for (uint32_t t = from; t < to; ++t) {
    assert_true(offer(t, more_s));
    rim_watch_tick(&watch, here_s(t));
    rim_watch_tick(&watch, here_s(t) + 0.1);
  }
}

typedef enum fault { TOO_SHORT, TOO_OLD, NOT_FINITE, FAULTS } fault;

/* A row that is refused, by a source whose clock says nothing. */
static void offer_bad(fault what) {
  double value[VALUES] = {0};
  rim_verdict verdict = {0};
  if (what == NOT_FINITE)
    value[1] = (double)NAN;
  const rim_status status =
      rim_watch_row(&watch, -5.0, value, VALUES - (what == TOO_SHORT), &verdict);
  assert_int_equal(status, what == TOO_SHORT ? RIM_E_SIZE : RIM_OK);
  assert_false(verdict.valid);
}

/* Rows come at their rate, and all of them are refused: nothing is known of the vehicle, as if none
 * came. It is said once, at the time at which it became so, and the next valid row ends it. */
static void refused_rows_are_silence(void **state) {
  (void)state;
  for (fault what = TOO_SHORT; what < FAULTS; ++what) {
    begin();
    fly(0, 40, 5000.0);
    assert_int_equal(watch.level, RIM_LEVEL_OK);
    const double newest_s = watch.newest_s;
    for (uint32_t t = 40; t < 40 + MINUTE; ++t) {
      offer_bad(what);
      rim_watch_tick(&watch, here_s(t));
      /* The image says 2 s: eight rows. */
      assert_int_equal(watch.level, t <= 39 + 8 ? RIM_LEVEL_OK : RIM_LEVEL_STALE);
    }
    assert_int_equal(watch.reason, RIM_REASON_SILENT);
    assert_true(heard.stale == 1 && heard.records == 1 && heard.stale_s == newest_s + 2.0);
    assert_int_equal(watch.refused, what == TOO_SHORT ? MINUTE : 0);
    fly(40 + MINUTE, 60 + MINUTE, 5000.0);
    assert_true(watch.level == RIM_LEVEL_OK && heard.stale == 1 && heard.level == RIM_LEVEL_OK);
  }
}

/* Without a clock of the board: the time of a row of another length shows the gap. */
static void a_gap_before_a_row_that_is_refused(void **state) {
  (void)state;
  const double value[VALUES] = {0};
  begin();
  for (uint32_t t = 0; t < 40; ++t)
    assert_true(offer(t, 0.0));
  assert_int_equal(rim_watch_row(&watch, watch.newest_s + 1.9, value, 1, NULL), RIM_E_SIZE);
  assert_int_equal(watch.level, RIM_LEVEL_OK);
  assert_int_equal(rim_watch_row(&watch, watch.newest_s + 2.1, value, 1, NULL), RIM_E_SIZE);
  assert_true(watch.level == RIM_LEVEL_STALE && watch.reason == RIM_REASON_SILENT);
  assert_true(heard.stale == 1 && watch.refused == 2);
}

/* A clock of the board that wraps or is put back loses what passed in that tick, and no more. */
static void a_clock_that_wraps(void **state) {
  (void)state;
  begin();
  double here = 4294967.0; /* of 32 bits, in ms */
  assert_true(offer(0, 0.0));
  rim_watch_tick(&watch, here);
  for (int i = 0; i < 3; ++i)
    rim_watch_tick(&watch, here += 0.25);
  for (here = 0.0; here < 1.2; here += 0.25)
    rim_watch_tick(&watch, here);
  assert_int_equal(watch.level, RIM_LEVEL_OK);
  rim_watch_tick(&watch, (double)NAN);
  for (int i = 0; i < 5; ++i)
    rim_watch_tick(&watch, here += 0.25);
  assert_true(watch.level == RIM_LEVEL_STALE && heard.stale == 1);
}

/* Nothing comes from the start on: STALE is told. What the board's clock had then is no time of the
 * rows: where the first one comes in time, its own makes no gap, whatever it is. */
static void before_the_first_row(void **state) {
  (void)state;
  begin();
  rim_watch_tick(&watch, 10.0);
  rim_watch_tick(&watch, 11.9);
  assert_int_equal(heard.records, 0);
  rim_watch_tick(&watch, 12.2);
  assert_true(heard.stale == 1 && watch.level == RIM_LEVEL_STALE);
  begin();
  for (uint32_t t = 0; t < 40; ++t)
    assert_true(offer(t, 5000.0));
  const uint64_t digest = watch.digest;
  begin();
  rim_watch_tick(&watch, 10.0);
  rim_watch_tick(&watch, 10.5);
  fly(0, 40, 5000.0);
  assert_true(heard.records == 0 && watch.level == RIM_LEVEL_OK && watch.digest == digest);
}

/* The source's clock began again: told so, its rows are used at once. Without a valid row the
 * silence goes on. */
static void a_source_that_begins_again(void **state) {
  (void)state;
  begin();
  fly(0, 40, 5000.0);
  assert_false(offer(0, 0.0));
  rim_watch_tick(&watch, here_s(40));
  rim_watch_restart(&watch, (double)INFINITY);
  assert_false(offer(1, 0.0));
  rim_watch_restart(&watch, BEGIN_S);
  assert_true(watch.newest_s == BEGIN_S && watch.level == RIM_LEVEL_OK);
  assert_true(offer(2, 0.0));
  rim_watch_tick(&watch, here_s(42));
  rim_watch_restart(&watch, BEGIN_S);
  for (uint32_t t = 43; t < 42 + 9; ++t)
    rim_watch_tick(&watch, here_s(t));
  assert_int_equal(watch.level, RIM_LEVEL_OK);
  rim_watch_tick(&watch, here_s(42 + 9));
  assert_int_equal(watch.level, RIM_LEVEL_STALE);
  rim_watch_restart(&watch, BEGIN_S);
  assert_int_equal(watch.level, RIM_LEVEL_STALE);
  assert_true(offer(2, 0.0));
  assert_true(watch.level == RIM_LEVEL_OK && heard.stale == 1);
}

/* A record's numbers in words: every double comes to an end, also what is no number. */
static void numbers_in_words(void **state) {
  (void)state;
  static const struct {
    double shift, sd;
    const char *words;
  } number[] = {
      {0.5, 0.25, "+0.5000 (sd 0.2500)"},
      {-123456.0, 0.0, "-1.2346e+05 (sd 0.0000)"},
      {1.7e308, 1.5e-300, "+1.7000e+308 (sd 1.5000e-300)"},
      {9.99996e7, -1e-300, "+1.0000e+08 (sd -1.0000e-300)"},
      {(double)INFINITY, (double)INFINITY, "+inf (sd inf)"},
      {-(double)INFINITY, (double)NAN, "-inf (sd nan)"},
      {(double)NAN, 0.001, "nan (sd 0.0010)"},
  };
  char words[120], wanted[120];
  begin();
  for (size_t i = 0; i < sizeof number / sizeof number[0]; ++i) {
    rim_alarm record = {.state = RIM_ALARM_RAISED, .level = RIM_LEVEL_ERROR, .channels = 1};
    record.kind = RIM_KIND_VARIANCE; /* without a unit */
    record.shift[0] = number[i].shift;
    record.shift_sd[0] = number[i].sd;
    record.since_s = 1.5;
    assert_true(rim_watch_words(&watch, &record, words, sizeof words) > 0);
    (void)snprintf(wanted, sizeof wanted, "%s since 1.5000 s", number[i].words);
    const char *got = strstr(words, wanted);
    if (got == NULL || strlen(got) != strlen(wanted))
      fail_msg("'%s' does not end in '%s'", words, wanted);
  }
}

static void what_is_closed(void **state) {
  (void)state;
  memset(&watch, 0, sizeof watch);
  rim_watch_tick(&watch, 1.0);
  rim_watch_tick(NULL, 1.0);
  rim_watch_idle(NULL, 1.0);
  rim_watch_restart(&watch, 1.0);
  rim_watch_restart(NULL, 1.0);
  assert_int_equal(rim_watch_row(&watch, 0.0, (const double[1]){0}, 1, NULL), RIM_E_ARGUMENT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(refused_rows_are_silence),
      cmocka_unit_test(a_gap_before_a_row_that_is_refused),
      cmocka_unit_test(a_clock_that_wraps),
      cmocka_unit_test(before_the_first_row),
      cmocka_unit_test(a_source_that_begins_again),
      cmocka_unit_test(numbers_in_words),
      cmocka_unit_test(what_is_closed),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
