/* SPDX-License-Identifier: MIT */
/* A monitor in memory, with an image and with rows that end with their last byte, which the address
 * sanitizer watches; and an array of it that does not reach into the next. */
#include "monitor/monitor_private.h"

#include "monitor_bench.h"

#include <stdlib.h>

enum { FLIGHT = 360 };

typedef struct exact {
  uint8_t *image, *memory;
  double *context, *outcome, *mean, *sd;
} exact;

static double *doubles(size_t n) {
  double *made = malloc(n * sizeof *made);
  assert_non_null(made);
  return made;
}

static void begin(exact *e, bool external, rim_monitor **m) {
  static bench b;
  make_bench(&b, external);
  size_t size = 0;
  assert_int_equal(rim_monitor_size(b.blob.byte, b.blob.size, &size), RIM_OK);
  e->image = malloc(b.blob.size);
  e->memory = malloc(size);
  assert_true(e->image != NULL && e->memory != NULL);
  memcpy(e->image, b.blob.byte, b.blob.size);
  e->context = doubles(D);
  e->outcome = doubles(O);
  e->mean = doubles(O);
  e->sd = doubles(O);
  assert_int_equal(rim_monitor_init(m, e->memory, size - 1, e->image, b.blob.size), RIM_E_SIZE);
  assert_int_equal(rim_monitor_init(m, e->memory, size, e->image, b.blob.size), RIM_OK);
}

static void end(exact *e) {
  free(e->image);
  free(e->memory);
  free(e->context);
  free(e->outcome);
  free(e->mean);
  free(e->sd);
}

static void memory_image_and_rows_are_not_left(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    exact e;
    rim_monitor *m = NULL;
    uint32_t raised = 0;
    begin(&e, external, &m);
    for (uint32_t t = 0; t < FLIGHT; ++t) {
      row r;
      rim_verdict v;
      make_row(&r, external, 905, t, t > 100 ? 2.0 : 0.0);
      memcpy(e.context, r.context, sizeof r.context);
      memcpy(e.outcome, r.outcome, sizeof r.outcome);
      memcpy(e.mean, r.mean, sizeof r.mean);
      memcpy(e.sd, r.sd, sizeof r.sd);
      const rim_observation view = {r.t_s, e.context, e.outcome, e.mean, e.sd};
      assert_int_equal(rim_monitor_step(m, &view, &v), RIM_OK);
      raised += v.alarm.state == RIM_ALARM_RAISED;
    }
    assert_true(raised > 0);
    rim_monitor_restart(m, 1e4);
    rim_monitor_reset(m);
    end(&e);
  }
}

/* Behind a block's place lies what is not known of its channels. That is found first, and here all
 * is known. */
static void a_place_has_as_many_bytes_as_features(void **state) {
  (void)state;
  static bench b;
  make_bench(&b, false);
  rim_monitor *const m = b.monitor;
  assert_ptr_equal(m->place + REGION, m->unknown);
  for (uint32_t t = 0; t < 100; ++t) {
    (void)step(&b, 905, t, 0.0);
    for (size_t i = 0; m->has_place && i < CHANNELS; ++i)
      assert_int_equal(m->place[REGION + i], 0);
  }
  assert_true(m->has_place);
}

/* The newest gaps are kept, as many as there is room for, in their order. */
static void the_newest_gaps_are_kept(void **state) {
  (void)state;
  enum { BEFORE = 20, EACH = 2, LOST = 3, GAPS = MONITOR_GAPS + LOST };
  static bench b;
  make_bench(&b, true);
  rim_monitor *const m = b.monitor;
  double t_s = 0.0;
  for (uint32_t i = 0; i < BEFORE + EACH * GAPS; ++i) {
    row r;
    rim_verdict v;
    make_row(&r, true, 901, i, 0.0);
    t_s += i >= BEFORE && (i - BEFORE) % EACH == 0 ? 60.0 : PERIOD_S;
    r.view.t_s = t_s;
    assert_int_equal(rim_monitor_step(m, &r.view, &v), RIM_OK);
  }
  assert_int_equal(m->gaps, MONITOR_GAPS);
  for (uint32_t k = 0; k < MONITOR_GAPS; ++k) {
    assert_int_equal(m->gap[k].index, BEFORE + EACH * (k + LOST));
    assert_true(rimi_abs(m->gap[k].after_s - m->gap[k].before_s - 60.0) < 1e-9);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(memory_image_and_rows_are_not_left),
      cmocka_unit_test(a_place_has_as_many_bytes_as_features),
      cmocka_unit_test(the_newest_gaps_are_kept),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
