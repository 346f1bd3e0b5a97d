/* SPDX-License-Identifier: MIT */
/* What rimd publishes of the monitor's own counts never falls: not when the rows' clock begins
 * again, not when the monitor is built anew, not in what a restart goes on with. Without a bus. */
#include "rimd/rimd.h"

#include "../lib/monitor_bench.h"

enum { VALUES = D + 3 * O };

static rimd d;
static image blob;
static _Alignas(8) uint8_t memory[65536];
static uint64_t woke_ns;

static void begin(void) {
  memset(&d, 0, sizeof d);
  build(&blob, &calibrated[1]);
  woke_ns = rimd_now_ns();
  d.valid_ns = woke_ns;
  d.next_health_ns = d.next_state_ns = UINT64_MAX;
  d.config.input_can = true; /* gaps are the monitor's */
  d.image = blob.byte;
  d.image_bytes = blob.size;
  d.memory = memory;
  d.memory_bytes = sizeof memory;
  d.features = D;
  d.outcomes = O;
  d.values = VALUES;
  d.external = true;
  d.guard_config = (rim_clock_guard_config){.max_jump_s = 1e6, .resync_rows = 1};
  d.policy.stale_s = 2.0;
  assert_int_equal(rim_image_open(&d.view, blob.byte, blob.size), RIM_OK);
  assert_int_equal(rim_monitor_init(&d.monitor, memory, sizeof memory, blob.byte, blob.size),
                   RIM_OK);
  assert_int_equal(rim_monitor_set_policy(d.monitor, &d.policy), RIM_OK);
}

static void send(uint32_t t) {
  row r;
  double value[VALUES];
  make_row(&r, true, 900, t, 0.0);
  put_values(&r, value);
  woke_ns += 1000;
  rimd_row(&d, r.t_s, value, VALUES, woke_ns);
}

/* Twenty rows from t on; where it says so, one is missing in the middle, or three seconds. */
static uint32_t fly(uint32_t t, bool gap, bool silence) {
  for (uint32_t i = 0; i < 20; ++i) {
    t += i == 10 ? (gap ? 1u : 0u) + (silence ? 12u : 0u) : 0u;
    send(t++);
  }
  return t;
}

static void assert_counts(uint32_t gaps, uint32_t stale) {
  for (int twice = 0; twice < 2; ++twice) { /* what was taken over is not taken over again */
    rimd_collect_counts(&d);
    assert_int_equal(d.kept.counters.gaps, gaps);
    assert_int_equal(d.kept.counters.stale, stale);
  }
}

static void a_clock_that_begins_again(void **state) {
  (void)state;
  begin();
  uint32_t t = fly(0, true, false);
  t = fly(t, false, true);
  assert_counts(2, 1);
  (void)fly(t, true, false); /* not taken over before the clock begins again */
  t = fly(0, false, false);
  assert_int_equal(d.kept.counters.clock_resets, 1);
  assert_counts(3, 1);
  t = fly(t, false, true);
  assert_counts(4, 2);
  (void)fly(t, true, false);
  assert_counts(5, 2);
}

/* Counts of a damaged monitor are not believed, and those of the next one begin again. */
static void a_monitor_that_is_built_anew(void **state) {
  (void)state;
  for (int silent = 0; silent < 2; ++silent) {
    begin();
    d.config.on_damage_silent = silent != 0;
    uint32_t t = fly(0, true, false);
    t = fly(t, false, true);
    t = fly(t, true, false);
    assert_counts(3, 1);
    memory[160] ^= 64u;
    (void)rimd_tick(&d, woke_ns);
    assert_true(d.was_damaged && d.is_damaged == (silent != 0));
    assert_counts(3, 1);
    t = fly(t, true, false);
    t = fly(t, false, true);
    assert_counts(silent ? 3 : 5, silent ? 1 : 2);
  }
}

/* A restart has the monitor and what was taken over of it from one file. */
static void a_restart(void **state) {
  (void)state;
  static _Alignas(8) uint8_t copy[sizeof memory];
  begin();
  uint32_t t = fly(0, true, true);
  assert_counts(1, 1);
  t = fly(t, true, false); /* in the monitor, and not yet taken over */
  const rimd_kept kept = d.kept;
  memcpy(copy, memory, sizeof copy);
  begin();
  d.kept = kept;
  memcpy(memory, copy, sizeof memory);
  assert_int_equal(rim_monitor_attach(&d.monitor, memory, sizeof memory, blob.byte, blob.size),
                   RIM_OK);
  assert_counts(2, 1);
  (void)fly(t, true, false);
  assert_counts(3, 1);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_clock_that_begins_again),
      cmocka_unit_test(a_monitor_that_is_built_anew),
      cmocka_unit_test(a_restart),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
