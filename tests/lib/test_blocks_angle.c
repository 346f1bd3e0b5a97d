/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c: an angle that is counted on by whole turns is named as out of range, and says
 * the same direction. */
#include <math.h>

#include "monitor/blocks.h"
#include "section_bytes.h"

enum { D = 1, BLOCK = 8, ROWS = 400 };
#define PERIOD_S 0.25

typedef struct bench {
  bytes outcome_feature, range;
  _Alignas(8) uint8_t memory[1024];
  blocks *b;
} bench;

static void start(bench *s) {
  static const uint8_t role[D] = {BLOCKS_ANGLE_DEG};
  memset(s, 0, sizeof *s);
  u16(&s->outcome_feature, 0);
  f32(&s->range, -185.0);
  f32(&s->range, 185.0);
  const blocks_config config = {.features = D,
                                .outcomes = 1,
                                .block_rows = BLOCK,
                                .period_s = PERIOD_S,
                                .outcome_feature = s->outcome_feature.byte,
                                .role = role,
                                .range = s->range.byte};
  assert_int_equal(rimi_blocks_init(&s->b, s->memory, sizeof s->memory, &config), RIM_OK);
}

/* Through north and south, in eighths of a degree, which sums of turns keep. */
static double heading_at(uint32_t t) {
  const double turned = 3.125 * t + floor(40.0 * sin(0.1 * t)) / 8.0;
  return turned - 360.0 * floor(turned / 360.0 + 0.5);
}

static bool close(double a, double b) { return fabs(a - b) < 1e-9; }

static void a_counted_angle_is_its_direction(void **state) {
  (void)state;
  static const double turns[] = {2.0, -3.0, 1000.0};
  for (size_t i = 0; i < sizeof turns / sizeof *turns; ++i) {
    static bench a, b;
    start(&a);
    start(&b);
    for (uint32_t t = 0; t < ROWS; ++t) {
      const double as_trained[D] = {heading_at(t)}, counted[D] = {heading_at(t) + 360.0 * turns[i]};
      const blocks_result made = rimi_blocks_row(a.b, PERIOD_S * t, as_trained, NULL, NULL, NULL);
      assert_int_equal(rimi_blocks_row(b.b, PERIOD_S * t, counted, NULL, NULL, NULL), made);
      double value = 0.0;
      assert_int_equal(rimi_blocks_out_of_range(a.b, &value), BLOCKS_NO_FEATURE);
      assert_int_equal(rimi_blocks_out_of_range(b.b, &value), 0);
      assert_true(value == counted[0]);
      if (made != BLOCKS_DONE)
        continue;
      assert_true(close(rimi_blocks_context(b.b)[0], rimi_blocks_context(a.b)[0]));
      assert_true(close(rimi_blocks_scatter(b.b)[0], rimi_blocks_scatter(a.b)[0]));
      assert_true(close(rimi_blocks_repeats(b.b)[0], rimi_blocks_repeats(a.b)[0]));
    }
    assert_int_equal(rimi_blocks_get_health(b.b).out_of_range, ROWS);
  }
}

/* One that is larger than any count of turns says no direction. */
static void a_huge_angle_is_limited(void **state) {
  (void)state;
  static bench s;
  start(&s);
  const double huge[D] = {1e300};
  for (uint32_t t = 0; t < BLOCK; ++t)
    (void)rimi_blocks_row(s.b, PERIOD_S * t, huge, NULL, NULL, NULL);
  assert_true(rimi_blocks_repeats(s.b)[0] == (BLOCK - 1.0) / BLOCK);
  assert_int_equal(rimi_blocks_get_health(s.b).out_of_range, BLOCK);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_counted_angle_is_its_direction),
                                     cmocka_unit_test(a_huge_angle_is_limited)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
