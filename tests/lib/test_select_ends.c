/* SPDX-License-Identifier: MIT */
/* The selection of rows with predictions (search/select*.c) in memory that was changed: no index is
 * followed that leads out of it. */
#include <math.h>

#include "monitor/guard.h"
#include "monitor/monitor_private.h"
#include "search/select_private.h"

#include "monitor_bench.h"

static bench b;

/* An index of the search is looked at before it is followed. */
static void an_index_is_looked_at_each_row(void **state) {
  (void)state;
  make_bench(&b, true);
  for (uint32_t t = 0; t < 200; ++t)
    (void)step(&b, 912, t, 0.0);
  select_pair(b.monitor->select, 0)->x = REGION;
  assert_int_equal(step(&b, 912, 200, 0.0).level, RIM_LEVEL_INTEGRITY);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, RIM_DAMAGE_RUN);
}

/* The sum of what is worked out once covers all of it. */
static void every_root_is_summed(void **state) {
  (void)state;
  make_bench(&b, true);
  rim_select *e = b.monitor->select;
  const uint32_t sum = rimi_select_tables_sum(e);
  for (size_t k = 0; k < sizeof e->root / sizeof *e->root; ++k) {
    const uint16_t was = e->root[k];
    e->root[k] = (uint16_t)(was + 1u);
    assert_int_not_equal(rimi_select_tables_sum(e), sum);
    e->root[k] = was;
  }
  assert_int_equal(rimi_select_tables_sum(e), sum);
}

/* So many features' bins are gone through in a row, and no more: work.h counts them. */
static void bins_are_gone_through_in_turn(void **state) {
  (void)state;
  make_bench(&b, true);
  const uint32_t features = b.monitor->words[RIM_CONFIG_REGION_FEATURES];
  for (uint32_t t = 0; t < 2 * features; ++t) {
    const uint32_t next = b.monitor->guard.next_bins;
    (void)step(&b, 913, t, 0.0);
    assert_int_equal(b.monitor->guard.next_bins % features,
                     (next + features / 16u + 1u) % features);
  }
}

/* A reset leaves the counters of the sweep, and what is known of a channel, as at the start. */
static void a_reset_begins_its_sweeps_anew(void **state) {
  (void)state;
  make_bench(&b, true);
  rim_select *e = b.monitor->select;
  const uint32_t sweeps = e->sweeps;
  static channel_state before[8], after[8];
  const size_t of_channels = e->channels * sizeof *before;
  assert_true(of_channels <= sizeof before);
  memcpy(before, select_channel(e, 0), of_channels);
  for (uint32_t t = 0; t < 200; ++t)
    (void)step(&b, 912, t, 0.0);
  assert_int_not_equal(e->sweeps, sweeps);
  select_channel(e, 1)->best_interval = 1e6f;
  e->leader = 0;
  rimi_select_reset(e);
  assert_int_equal(e->leader, e->pairs);
  assert_int_equal(e->sweeps, sweeps);
  memcpy(after, select_channel(e, 0), of_channels);
  for (uint32_t c = 0; c < e->channels; ++c)
    after[c].offset = before[c].offset; /* of the run: the caller's */
  assert_memory_equal(after, before, of_channels);
}

/* Every field of a pair, and every one of a channel's slice. */
static void every_index_of_a_selection(void **state) {
  (void)state;
  make_bench(&b, true);
  for (uint32_t t = 0; t < 200; ++t)
    (void)step(&b, 912, t, 0.0);
  rim_select *e = b.monitor->select;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    const pair_state was = *p;
    assert_true(rimi_select_indices_hold(e));
#define SPOILT(field, value)                                                                       \
  do {                                                                                             \
    p->field = value;                                                                              \
    assert_false(rimi_select_indices_hold(e));                                                     \
    *p = was;                                                                                      \
  } while (0)
    SPOILT(active, 2);
    SPOILT(exact, 2);
    SPOILT(x, REGION);
    SPOILT(y, REGION);
    SPOILT(channel, O);
    SPOILT(cursor, (uint8_t)e->chains);
    SPOILT(which, (uint8_t)e->chains);
#undef SPOILT
  }
  assert_true(rimi_select_indices_hold(e));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_index_is_looked_at_each_row),
      cmocka_unit_test(every_index_of_a_selection),
      cmocka_unit_test(every_root_is_summed),
      cmocka_unit_test(bins_are_gone_through_in_turn),
      cmocka_unit_test(a_reset_begins_its_sweeps_anew),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
