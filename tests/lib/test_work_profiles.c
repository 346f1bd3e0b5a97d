/* SPDX-License-Identifier: MIT */
/* The static bounds of profiles that are flown, number by number. Whoever chose a processor and a
 * period did so by them: a release that changes one has to say so, and this test is where it shows.
 * That they are bounds at all is held by test_work.c and `make size`. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "monitor/work.h"

/* Own predictions: counts that all differ. */
#define ROWS                                                                                       \
  .features = 7, .outcomes = 3, .channels = 3, .region_features = 6, .ring = 250, .bins = 17,      \
  .grid = 31, .pairs = 5, .scans = 4, .edges = 12, .moves = 26, .budget = 2, .block_rows = 1,      \
  .external = true, .memory_bytes = 61440, .image_bytes = 2048

/* A trained image. */
#define TRAINED                                                                                    \
  .features = 29, .outcomes = 25, .channels = 100, .region_features = 11, .ring = 192,             \
  .budget = 3, .block_rows = 35, .inputs = 14, .times = 9, .terms = 213, .means = 8, .fields = 4,  \
  .trained = true, .memory_bytes = 204800, .image_bytes = 90112

static const struct {
  const char *name;
  rim_work_counts counts;
  rim_work bound;
} profiles[] = {
    {"rows, small", {ROWS, .small = true}, {3900, 2227166, 666132, 86224, 124928, 3108350, 629832}},
    {"rows", {ROWS}, {3900, 5971996, 1602180, 86224, 124928, 7789228, 1359600}},
    {"rows, corrected and watched",
     {ROWS, .small = true, .corrected = true, .watched = true},
     {12252, 2227166, 666132, 86224, 124928, 3116702, 629832}},
    {"trained", {TRAINED}, {20640, 4601712, 1821398, 58564116, 499712, 65507578, 0}},
    {"trained, with all there may be",
     {TRAINED, .integrands = 3, .angles = 1, .prototypes = 40, .top = 4, .rates = 12,
      .corrected = true, .watched = true},
     {31360, 4601712, 2564818, 91250028, 499712, 98947630, 0}},
    {"trained, many integrands",
     {TRAINED, .integrands = 60},
     {56640, 4601712, 1821398, 91250028, 499712, 98229490, 0}},
    {"trained, own predictions",
     {TRAINED, .external = true, .corrected = true},
     {23240, 4601712, 845040, 58564116, 499712, 64533820, 0}},
};

static void bounds_are_those_that_computers_were_chosen_by(void **state) {
  (void)state;
  for (size_t i = 0; i < sizeof profiles / sizeof *profiles; ++i) {
    const rim_work *b = &profiles[i].bound;
    rim_work w;
    rimi_work_bound(&profiles[i].counts, &w);
    if (w.row != b->row || w.search != b->search || w.block != b->block || w.judge != b->judge ||
        w.guard != b->guard || w.step != b->step || w.halving != b->halving)
      fail_msg("%s: {%u, %u, %u, %u, %u, %u, %u}", profiles[i].name, w.row, w.search, w.block,
               w.judge, w.guard, w.step, w.halving);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(bounds_are_those_that_computers_were_chosen_by)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
