/* SPDX-License-Identifier: MIT */
/* The monitor over rows with the caller's own predictions: what it hands to its search. */
#include <math.h>

#include "monitor/monitor_private.h"
#include "search/select_private.h"

#include "monitor_bench.h"

/* Channels of different scales and offsets: the search goes where the thresholds look. */
static void a_search_ranks_channels_as_its_thresholds_do(void **state) {
  (void)state;
  recipe r = calibrated[true];
  bytes *threshold = &r.section[RIM_SECTION_THRESHOLD];
  for (size_t c = 0; c < O; ++c) {
    put_f32(threshold->byte + threshold->size - 8 * O + 4 * c, 3.0 + (double)c);
    put_f32(threshold->byte + threshold->size - 4 * O + 4 * c, c == 0 ? 0.5 : 4.0);
  }
  bench b;
  memset(&b, 0, sizeof b);
  b.external = true;
  build(&b.blob, &r);
  start(&b);
  for (uint16_t c = 0; c < O; ++c) {
    for (double ln_anom = 0.0; ln_anom < 40.0; ln_anom += 8.0) {
      const double rank = select_priority(select_channel(b.monitor->select, c), ln_anom);
      const double score = rimi_threshold_score(&b.monitor->models.threshold, c, ln_anom, 100);
      assert_true(fabs(rank - score) < 1e-5);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_search_ranks_channels_as_its_thresholds_do),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
