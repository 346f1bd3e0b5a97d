/* SPDX-License-Identifier: MIT */
/* search/select_guard.c: the last index that may be followed holds, the next one does not; how far
 * sums may be off. */
#include "monitor/guard.h"
#include "monitor/monitor_private.h"
#include "search/select_private.h"

#include "monitor_bench.h"

static bench b;

static rim_select *fly(uint32_t rows) {
  make_bench(&b, true);
  for (uint32_t t = 0; t < rows; ++t)
    (void)step(&b, 912, t, 0.0);
  rim_select *const e = b.monitor->select;
  assert_true(rimi_select_indices_hold(e));
  for (uint32_t f = 0; f < e->features; ++f)
    assert_true(rimi_select_bins_hold(e, f));
  return e;
}

/* A number takes the largest value that is allowed, then one more. */
#define ENDS_AT(field, last)                                                                       \
  do {                                                                                             \
    const unsigned was = (field);                                                                  \
    (field) = (uint8_t)(last);                                                                     \
    assert_true(rimi_select_indices_hold(e));                                                      \
    (field) = (uint8_t)((last) + 1u);                                                              \
    assert_false(rimi_select_indices_hold(e));                                                     \
    (field) = (uint8_t)was;                                                                        \
  } while (0)

static void the_ends_of_indices(void **state) {
  (void)state;
  rim_select *const e = fly(200);
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *const p = select_pair(e, i);
    ENDS_AT(p->active, 1u);
    ENDS_AT(p->exact, 1u);
    ENDS_AT(p->x, e->features - 1u);
    ENDS_AT(p->y, e->features - 1u);
    ENDS_AT(p->channel, e->channels - 1u);
    ENDS_AT(p->cursor, e->chains - 1u);
    ENDS_AT(p->which, e->chains - 1u);
  }
  for (uint32_t c = 0; c < e->channels; ++c) {
    slice *const best = select_slice(e, c, select_channel(e, c)->best_feature);
    ENDS_AT(best->first, e->bins - 1u);
    ENDS_AT(best->last, e->bins - 1u);
    ENDS_AT(select_channel(e, c)->best_feature, e->features - 1u);
  }
}

/* Until the first halving, which follows the largest count, none may be missing; then one a bin. */
static void how_many_counts_may_be_missing(void **state) {
  (void)state;
  rim_select *const e = fly(200);
  e->total = RIM_BINS_MAX_COUNT;
  ++e->count;
  assert_false(rimi_select_bins_hold(e, 0));
  e->total = RIM_BINS_MAX_COUNT + 1u;
  assert_true(rimi_select_bins_hold(e, 0));
  e->count += e->bins - 1u;
  assert_true(rimi_select_bins_hold(e, 0));
  ++e->count;
  assert_false(rimi_select_bins_hold(e, 0));
}

/* Until the first halving not at all, in the last channel and feature too; then a step a bin. */
static void how_far_a_sum_may_be_off(void **state) {
  (void)state;
  rim_select *const e = fly(0);
  const double step = 1.0 / 512.0, most = e->bins * step;
  for (uint32_t c = 0; c < e->channels; ++c) {
    for (uint32_t f = 0; f < e->features; ++f) {
      e->total = RIM_BINS_MAX_COUNT;
      select_channel(e, c)->sum = step / 1024.0;
      assert_false(rimi_select_bins_hold(e, f));
      e->total = RIM_BINS_MAX_COUNT + 1u;
      select_channel(e, c)->sum = -most;
      assert_true(rimi_select_bins_hold(e, f));
      select_channel(e, c)->sum = most + step / 1024.0;
      assert_false(rimi_select_bins_hold(e, f));
      select_channel(e, c)->sum = 0.0;
    }
  }
}

/* A slot that is written anew is taken off the sum in progress, and added again, where that has
 * gone through it already: up to the one before its place. */
static void the_sum_in_progress_ends_before_its_place(void **state) {
  (void)state;
  (void)fly(EXTERNAL_RING + 10);
  monitor_guard *const g = &b.monitor->guard;
  const uint32_t slot = rimi_select_next_slot(b.monitor->select);
  for (uint32_t at = slot; at <= slot + 1; ++at) {
    g->ring_at = at;
    g->ring_now = 77;
    assert_true(rimi_guard_before_block(b.monitor));
    assert_int_equal(g->slot, slot);
    assert_int_equal(g->ring_now == 77, at == slot);
    rimi_guard_after_block(b.monitor); /* as it was: nothing was written */
    assert_int_equal(g->ring_now, 77);
  }
}

/* A row looks at the bins of one of so few features, and the next row at those of the next: what a
 * row takes is bounded. */
static void a_row_looks_at_the_bins_of_one_feature(void **state) {
  (void)state;
  const rim_select *const e = fly(200);
  const rim_bins table = select_bins(e);
  b.monitor->guard.next_bins = 0;
  ++table.count[e->bins]; /* of feature 1 */
  assert_true(rimi_guard_scrub(b.monitor));
  assert_int_equal(b.monitor->guard.next_bins, 1);
  assert_false(rimi_guard_scrub(b.monitor));
  assert_int_equal(b.monitor->guard.damaged, RIM_DAMAGE_RUN);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_ends_of_indices),
      cmocka_unit_test(how_many_counts_may_be_missing),
      cmocka_unit_test(how_far_a_sum_may_be_off),
      cmocka_unit_test(the_sum_in_progress_ends_before_its_place),
      cmocka_unit_test(a_row_looks_at_the_bins_of_one_feature),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
