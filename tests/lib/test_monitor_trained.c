/* SPDX-License-Identifier: MIT */
/* The monitor of a trained image: what is found in a block is described, labelled, sized and dated;
 * nothing is said about the vehicle without evidence (images and vehicle: monitor_bench.h). */
#include "image/correct.h"
#include "monitor/inspect.h"
#include "monitor/monitor_private.h"
#include "monitor_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* What happens to a row of the vehicle from a row on. */
typedef struct fault {
  double shift;      /* of sensor 1, everywhere */
  double ramp;       /* of sensor 1, per row */
  double gain;       /* of sensor 1, share of what it should say */
  double above;      /* of sensor 1 where the command is above 0.4 */
  uint32_t from, to; /* rows; to 0: to the end */
} fault;

static void faulty_row(row *r, uint32_t run, uint32_t t, const fault *f) {
  make_row(r, false, run, t, 0.0);
  r->view.context = r->context;
  if (t < f->from || (f->to > 0 && t >= f->to))
    return;
  r->context[1] += f->shift + f->ramp * (t - f->from) + f->gain * 2.0 * r->context[0] +
                   (r->context[0] > 0.4 ? f->above : 0.0);
}

typedef struct found {
  rim_alarm first, last;
  uint32_t raised, cleared, first_row, cleared_row;
} found;

static found fly(const bench *b, uint32_t run, uint32_t rows, const fault *f) {
  found n;
  memset(&n, 0, sizeof n);
  for (uint32_t t = 0; t < rows; ++t) {
    row r;
    rim_verdict v;
    faulty_row(&r, run, t, f);
    assert_int_equal(rim_monitor_step(b->monitor, &r.view, &v), RIM_OK);
    if (v.alarm.state == RIM_ALARM_NONE)
      continue;
    n.last = v.alarm;
    if (v.alarm.state == RIM_ALARM_RAISED && n.raised++ == 0) {
      n.first = v.alarm;
      n.first_row = t;
    }
    if (v.alarm.state == RIM_ALARM_CLEARED) {
      ++n.cleared;
      n.cleared_row = t;
    }
  }
  return n;
}

static double time_of_row(uint32_t t) { return 10.0 + PERIOD_S * t; }

static void a_shift_is_sized_and_dated(void **state) {
  (void)state;
  uint32_t covered = 0;
  for (uint32_t run = 0; run < 10; ++run) {
    const double sign = run % 2 ? -1.0 : 1.0;
    const fault f = {.shift = sign * 0.2, .from = 400};
    bench b;
    make_bench(&b, false);
    const found n = fly(&b, 500 + run, ROWS, &f);
    assert_int_equal(n.raised, 1);
    const rim_alarm *a = &n.last;
    assert_true(n.first_row > 400 && n.first_row < 600);
    assert_true(a->kind == RIM_KIND_SHIFT && a->channel[0] == 0 && a->region.dims == 0);
    assert_true(a->shift[0] * sign > 0.0 && fabs(a->shift[0] - f.shift) < 3.5 * a->shift_sd[0]);
    covered += fabs(a->shift[0] - f.shift) < 1.96 * a->shift_sd[0];
    assert_true(a->shift_sd[0] > 0.003 && a->shift_sd[0] < 0.03);
    assert_true(fabs(a->since_s - time_of_row(400)) < 5.0 * BLOCK * PERIOD_S);
    assert_true(a->since_sd_s > 0.0 && a->since_sd_s < 5.0 * BLOCK * PERIOD_S);
    assert_true(n.first.since_s <= n.first.t_s);
  }
  assert_true(covered >= 7);
  const fault gross = {.shift = 1.0, .from = 400}; /* dated to its first row */
  bench b;
  make_bench(&b, false);
  assert_true(fabs(fly(&b, 515, 600, &gross).last.since_s - time_of_row(400)) <= PERIOD_S);
}

static void a_drift_and_a_gain_are_told_apart(void **state) {
  (void)state;
  for (int is_gain = 0; is_gain < 2; ++is_gain) {
    for (int sign = -1; sign <= 1; sign += 2) {
      const fault f = {
          .ramp = is_gain ? 0.0 : sign * 0.001, .gain = is_gain ? sign * 0.15 : 0.0, .from = 400};
      bench b;
      make_bench(&b, false);
      const found n = fly(&b, 520, ROWS, &f);
      const rim_alarm *a = &n.last;
      assert_int_equal(n.raised, 1);
      assert_int_equal(a->kind, is_gain ? RIM_KIND_GAIN : RIM_KIND_DRIFT);
      assert_int_equal(a->channel[0], 0);
      assert_true(a->shift[0] * sign > 0.0 && a->shift_sd[0] > 0.0);
      /* A drift: by how much the outcome is off when the record is written. */
      const double truth = is_gain ? f.gain : f.ramp * ((a->t_s - time_of_row(400)) / PERIOD_S);
      assert_true(fabs(a->shift[0] - truth) < 0.2 * fabs(truth));
      assert_true(fabs(a->since_s - time_of_row(400)) < 60 * PERIOD_S);
    }
  }
}

/* The labels of rows, before and after the alarm, are those of the region that was described. */
static void labels_are_where_the_fault_was(void **state) {
  (void)state;
  const fault f = {.above = 0.2, .from = 0};
  bench b;
  make_bench(&b, false);
  uint8_t place[ROWS / BLOCK][REGION];
  double command[ROWS / BLOCK];
  uint32_t taken = 0;
  assert_null(rimi_monitor_place(b.monitor));
  assert_null(rimi_monitor_residuals(b.monitor));
  assert_null(rimi_monitor_residuals(NULL));
  for (uint32_t t = 0; t < ROWS; ++t) {
    row r;
    rim_verdict v;
    faulty_row(&r, 540, t, &f);
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    if (v.blocks == taken)
      continue;
    assert_int_equal(v.blocks, taken + 1);
    memcpy(place[taken], rimi_monitor_place(b.monitor), REGION);
    assert_true(isfinite(rimi_monitor_residuals(b.monitor)[v.channel]));
    command[taken++] = r.context[0];
  }
  const rim_alarm *a = rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM);
  assert_non_null(a);
  assert_true(a->region.dims == 1 && a->region.feature[0] == 0);
  assert_true(fabs(a->region.lower[0] - 0.4) < 0.15 && a->region.upper[0] >= 1.0);
  uint32_t inside = 0, wrong = 0;
  for (uint32_t i = 0; i < taken; ++i) {
    const bool in = rimi_monitor_inside(b.monitor, place[i], i);
    inside += in;
    wrong += in != (command[i] > 0.4);
    const double low = -1.0 + 2.0 * place[i][0] / 256.0, high = low + 2.0 / 256.0;
    assert_int_equal(in, low >= a->region.lower[0] - 1e-12 && high <= a->region.upper[0] + 1e-12);
  }
  assert_true(inside > 60 && inside < 120 && wrong < taken / 20);
  assert_false(rimi_monitor_inside(b.monitor, NULL, 0));
  rim_monitor_reset(b.monitor);
  assert_false(rimi_monitor_inside(b.monitor, place[0], 0));
}

static void an_alarm_is_cleared_after_its_fault(void **state) {
  (void)state;
  recipe r = calibrated[false];
  set_word(&r, RIM_CONFIG_CLEAR, 10);
  bench b;
  memset(&b, 0, sizeof b);
  build(&b.blob, &r);
  start(&b);
  const fault f = {.shift = 0.2, .from = 100, .to = 200};
  const found n = fly(&b, 560, 6000, &f);
  assert_true(n.raised == 1 && n.cleared == 1);
  assert_true(n.cleared_row > 200 && n.cleared_row < 6000);
  assert_int_equal(n.last.state, RIM_ALARM_CLEARED);
  assert_null(rim_monitor_standing(b.monitor, RIM_DETECTOR_RIM));
  assert_int_equal(rim_monitor_alarms(b.monitor).level, RIM_LEVEL_OK);
}

/* A fault that lasts longer than the ring, 1024 rows, does not become what is usual in this run. */
static void a_fault_that_outlasts_the_ring_keeps_its_size(void **state) {
  (void)state;
  for (int sign = -1; sign <= 1; sign += 2) {
    bench b;
    make_bench(&b, false);
    const fault f = {.shift = 0.2 * sign, .from = 400};
    const found n = fly(&b, 570, 8000, &f);
    print_message("raised %u, cleared %u, %.3f +- %.3f since %.1f s\n", n.raised, n.cleared,
                  n.last.shift[0], n.last.shift_sd[0], n.last.since_s);
    assert_true(n.raised == 1 && n.cleared == 0);
    assert_true(fabs(n.last.shift[0] - f.shift) < 3.0 * n.last.shift_sd[0]);
    assert_true(fabs(n.last.since_s - time_of_row(400)) < 4.0 * BLOCK * PERIOD_S);
  }
}

/* What came and went is told with its end, cleared, and does not hide what comes after. */
static void what_ended_is_told_and_let_go(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  uint32_t first = 7, end = 7;
  assert_int_equal(rim_monitor_ended(b.monitor, &first, &end), 0);
  assert_int_equal(rim_monitor_ended(NULL, NULL, NULL), 0);
  uint32_t raised = 0, cleared = 0;
  for (uint32_t t = 0; t < 2200; ++t) { /* a healthy run is 1200 rows: quiet for 600 of them */
    const bool is_off = (t >= 300 && t < 500) || (t >= 1200 && t < 1400);
    const fault f = {.shift = t < 600 ? 0.3 : -0.3, .to = is_off ? 0 : 1};
    row r;
    rim_verdict v;
    faulty_row(&r, 565, t, &f);
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    raised += v.alarm.state == RIM_ALARM_RAISED;
    cleared += v.alarm.state == RIM_ALARM_CLEARED;
    if (v.alarm.state == RIM_ALARM_RAISED)
      assert_true(is_off && v.alarm.shift[0] * f.shift > 0.0);
    if (v.alarm.state != RIM_ALARM_CLEARED)
      continue;
    assert_int_equal(rim_monitor_ended(b.monitor, &first, &end), cleared);
    const uint32_t from = cleared == 1 ? 300 : 1200;
    assert_true(abs((int)((first + 1) * BLOCK) - (int)from) < 4 * BLOCK);
    assert_true(abs((int)((end + 1) * BLOCK) - (int)(from + 200)) < 4 * BLOCK);
    assert_true(t >= from + 800 && t < from + 900);
  }
  assert_true(raised == 2 && cleared == 2);
  assert_int_equal(rim_monitor_alarms(b.monitor).level, RIM_LEVEL_OK);
  rim_monitor_reset(b.monitor);
  assert_int_equal(rim_monitor_ended(b.monitor, NULL, NULL), 0);
}

/* ---- evidence ---- */

static void nothing_is_healthy_without_blocks(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 100; ++t) {
    const rim_verdict v = step(&b, 570, t, 0.0);
    const uint32_t ended = (t + 1) / BLOCK, judged = ended > 0 ? ended - 1 : 0;
    assert_int_equal(v.step, t + 1);
    assert_int_equal(v.blocks, judged);
    assert_int_equal(v.reason,
                     judged < RIM_MONITOR_LEAST_BLOCKS ? RIM_REASON_TOO_FEW : RIM_REASON_NONE);
    assert_int_equal(rim_monitor_get_health(b.monitor).blocks, judged);
  }
}

static void rows_at_another_rate_are_not_judged(void **state) {
  (void)state;
  static const double factor[] = {0.2, 0.5, 2.0, 10.0};
  for (size_t i = 0; i < sizeof factor / sizeof *factor; ++i) {
    bench b;
    make_bench(&b, false);
    rim_verdict v = {0};
    for (uint32_t t = 0; t < 300; ++t) {
      row r;
      make_row(&r, false, 580, t, 100.0); /* a gross fault, at a rate that says nothing */
      r.view.t_s = 10.0 + factor[i] * PERIOD_S * t;
      assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
      if (t > 60)
        assert_true(v.reason == RIM_REASON_RATE && v.level == RIM_LEVEL_STALE);
      if (v.reason == RIM_REASON_NONE)
        assert_true(v.blocks >= RIM_MONITOR_LEAST_BLOCKS);
    }
    const rim_monitor_health h = rim_monitor_get_health(b.monitor);
    assert_true(h.rows.wrong_rate > 200 && h.blocks < RIM_MONITOR_LEAST_BLOCKS && h.alarms == 0);
    assert_true(fabs(h.period_s / PERIOD_S - factor[i]) < 0.05 * factor[i]);
  }
}

static void a_value_out_of_range_is_named_in_its_row(void **state) {
  (void)state;
  static const double value[] = {7.0, -7.0, 1e300};
  for (size_t i = 0; i < sizeof value / sizeof *value; ++i) {
    bench b;
    make_bench(&b, false);
    for (uint32_t t = 0; t < 120; ++t) {
      row r;
      rim_verdict v;
      make_row(&r, false, 590, t, 0.0);
      const bool out = t == 77 || t == 79;
      if (out)
        r.context[1] = value[i];
      assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
      assert_int_equal(v.reason == RIM_REASON_OUT_OF_RANGE, out);
      assert_int_equal(v.level == RIM_LEVEL_OUT_OF_RANGE, out && v.level != RIM_LEVEL_ERROR);
      assert_int_equal(v.out_feature, out ? 1 : 0xffff);
      assert_true(!out || v.out_value == value[i]);
      assert_true(isfinite(v.score) && isfinite(v.ln_anom));
    }
    rim_monitor_health h = rim_monitor_get_health(b.monitor);
    assert_true(h.rows.out_of_range == 2 && h.out_feature == 1 && h.out_value == value[i]);
    assert_true(h.out_t_s == time_of_row(77));
    rim_monitor_restart(b.monitor, time_of_row(120)); /* which forgets it */
    h = rim_monitor_get_health(b.monitor);
    assert_true(h.out_feature == 0xffff && h.out_value == 0.0 && h.out_t_s == 0.0);
  }
}

/* ---- training and the caller's own predictions together ---- */

/* A monitor whose image is trained on rows with the caller's own predictions. */
static void start_with_predictions(bench *b) {
  recipe r = calibrated[false];
  set_word(&r, RIM_CONFIG_EXTERNAL, 1);
  r.section[RIM_SECTION_BEHAVIOUR].size = r.section[RIM_SECTION_OUTCOMES].size = 0;
  bytes *noise = &r.section[RIM_SECTION_NOISE];
  for (size_t c = 0; c < 2 * O; ++c) { /* residuals in the caller's sd: four rows of 1 make 0.5 */
    const size_t words = NOISE_CHANNEL_WORDS + FIELDS * (1 + RAW) + FAMILIES;
    uint8_t *channel = noise->byte + 4 * (NOISE_HEADER_WORDS + c * words);
    put_f32(channel + 12, 0.5);
  }
  memset(b, 0, sizeof *b);
  b->external = true;
  build(&b->blob, &r);
  start(b);
}

static void make_row_with_predictions(row *now, uint32_t run, uint32_t t) {
  make_row(now, true, run, t, 0.0);
  now->context[1] = now->context[2] = 0.0; /* within this image's ranges */
}

/* The caller predicts readings and not how they scatter: block after block, scatter is what was
 * measured, whatever the block before was expected to be. */
static void nothing_is_predicted_of_scatter_beside_own_predictions(void **state) {
  (void)state;
  bench b;
  start_with_predictions(&b);
  for (uint32_t t = 0; t < 20 * BLOCK; ++t) {
    row now;
    rim_verdict v;
    make_row_with_predictions(&now, 601, t);
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
    if (t % BLOCK != BLOCK - 1)
      continue;
    for (size_t o = 0; o < O; ++o) /* and of the readings what the caller said */
      assert_true(b.monitor->predicted[o] == rimi_blocks_predicted(b.monitor->rows)[o]);
    const double *scatter = rimi_monitor_residuals(b.monitor) + RIM_CHANNEL_SCATTER * O;
    for (size_t o = 0; o < O; ++o)
      assert_true(scatter[o] == rimi_blocks_scatter(b.monitor->rows)[o]);
  }
}

/* Predictions whose sum over a block is no number any more: the block is refused, and that is
 * counted; the next one is taken. */
static void a_block_that_overflows_is_refused(void **state) {
  (void)state;
  bench b;
  start_with_predictions(&b);
  for (uint32_t t = 0; t < 10 * BLOCK; ++t) {
    row now;
    rim_verdict v;
    make_row_with_predictions(&now, 602, t);
    if (t / BLOCK == 5)
      now.mean[0] = now.outcome[0] = 1e308;
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
    assert_int_equal(rim_monitor_get_health(b.monitor).rows.refused, t + 1 >= 6 * BLOCK ? 1 : 0);
  }
  assert_int_equal(rim_monitor_get_health(b.monitor).blocks, 9);
}

static void rows_with_predictions_can_be_trained(void **state) {
  (void)state;
  bench b;
  start_with_predictions(&b);
  found n;
  memset(&n, 0, sizeof n);
  for (uint32_t t = 0; t < ROWS; ++t) {
    row now;
    rim_verdict v;
    make_row_with_predictions(&now, 600, t);
    now.outcome[1] += t >= 600 ? 0.4 : 0.0;
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
    if (v.alarm.state == RIM_ALARM_RAISED)
      ++n.raised;
    if (v.alarm.state != RIM_ALARM_NONE)
      n.last = v.alarm;
  }
  assert_int_equal(n.raised, 1);
  assert_true(n.last.channel[0] == 1 && n.last.kind == RIM_KIND_SHIFT);
  assert_true(fabs(n.last.shift[0] - 0.4) < 4.0 * n.last.shift_sd[0]); /* in the outcome's unit */
  assert_true(n.last.shift_sd[0] > 0.01 && n.last.shift_sd[0] < 0.1);
  assert_true(fabs(n.last.since_s - time_of_row(600)) < 8.0 * BLOCK * PERIOD_S);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_shift_is_sized_and_dated),
      cmocka_unit_test(a_drift_and_a_gain_are_told_apart),
      cmocka_unit_test(labels_are_where_the_fault_was),
      cmocka_unit_test(an_alarm_is_cleared_after_its_fault),
      cmocka_unit_test(a_fault_that_outlasts_the_ring_keeps_its_size),
      cmocka_unit_test(what_ended_is_told_and_let_go),
      cmocka_unit_test(nothing_is_healthy_without_blocks),
      cmocka_unit_test(rows_at_another_rate_are_not_judged),
      cmocka_unit_test(a_value_out_of_range_is_named_in_its_row),
      cmocka_unit_test(nothing_is_predicted_of_scatter_beside_own_predictions),
      cmocka_unit_test(a_block_that_overflows_is_refused),
      cmocka_unit_test(rows_with_predictions_can_be_trained),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
