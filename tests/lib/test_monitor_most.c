/* SPDX-License-Identifier: MIT */
/* A trained monitor of as many features and outcomes as there may be: the last outcome is watched
 * as the first, and nothing is written behind it. */
#include "rim/monitor.h"

#define BENCH_OUTCOMES RIM_MONITOR_MAX_OUTCOMES
#define BENCH_FEATURES RIM_MONITOR_MAX_FEATURES
#define SECTION_BYTES 200000 /* agreement: outcomes by outcomes */
#define BENCH_IMAGE 400000

#include "monitor/monitor_private.h"

#include "monitor_bench.h"

enum { LAST = O - 1 };

static bench b;
static recipe most;

/* Section LEVEL is asked about the first outcome and the last one. */
static void begin(void) {
  trained_recipe(&most);
  put_level(&most.section[RIM_SECTION_LEVEL], D, O);
  for (size_t o = 0; o < O; o += LAST)
    put_f32(most.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * o * (4 + O * (2 + MEANS)),
            AGREEMENT_LEVEL);
  memset(&b, 0, sizeof b);
  build(&b.blob, &most);
  start(&b);
}

/* All sensors are so many units of the level's away from what it was trained on, together. */
static void fly(uint32_t from, uint32_t to, double far) {
  for (uint32_t t = from * BLOCK; t < to * BLOCK; ++t) {
    row r;
    rim_verdict v;
    make_row(&r, false, 930, t, 0.0);
    for (size_t i = 0; i < D; ++i)
      r.context[i] = far / rimi_sqrt(D);
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    assert_true(v.level == RIM_LEVEL_OK || v.level == RIM_LEVEL_STALE);
  }
}

static void the_last_outcome_is_watched_as_the_first(void **state) {
  (void)state;
  begin();
  const rim_monitor *m = b.monitor;
  assert_int_equal(m->channel_count, RIM_MONITOR_KINDS * O);
  const bool *unknown = m->unknown + RIM_CHANNEL_AGREEMENT * O;
  const double *residual = m->residual + RIM_CHANNEL_AGREEMENT * O;
  fly(0, 20, 0.5);
  for (size_t o = 0; o < O; o += LAST) /* the reading less what the level says */
    assert_true(rimi_abs(residual[o] - (0.5 / rimi_sqrt(D) - 0.125)) < 1e-6);
  fly(20, 40, 2.0); /* of which section LEVEL says nothing */
  for (size_t o = 0; o < O; ++o)
    assert_int_equal(unknown[o], o == 0 || o == LAST);
  assert_int_equal(rim_monitor_get_health(b.monitor).damage, 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_last_outcome_is_watched_as_the_first),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
