/* SPDX-License-Identifier: MIT */
/* monitor/work.h - the most that one monitor step may do: a bound from the counts in the flight
 * image, whatever the data are.
 *
 * Unit: instructions of a Cortex-M7 with FPU (gcc -O2). What a turn of each loop costs is an upper
 * estimate (src/work.c), the number of turns is derived here; `make size` holds the largest step
 * that was measured to the bound, for three images. On another processor the turns are the same.
 *
 * d features, o outcomes, c channels, r region features, R ring, U budget: words of the image or
 * counts of its sections, so none depends on what is observed. Per step (rim_monitor_step):
 *
 *   row     d values looked at and summed, o outcomes, I inputs through T filters each
 *   block   d features, d^2 in a run's first, o outcomes with a logarithm, P terms; then the search
 *           takes the block in
 *   search  U units of search
 *   judge   c scores, and the record of an alarm
 *   watch   interference: 25 multiply-adds, 10 exponentials, 6 logarithms
 *   guard   the monitor's words summed twice, the image's once: before an alarm, else far fewer
 *
 * With section NOISE (K fields of W raw ones, M means; src/search), one pass is R blocks of K
 * fields; an interval is a pass into 24 bins, 300 intervals of K fields, and a pass to judge the
 * best one exactly:
 *   block   2 o sums of P terms, o^2 (2 + M) weights, both again where commands are not known; the
 *           prediction of section LEVEL; c channels of two exponentials twice, K W multiply-adds
 *           twice, K^2 / 2
 *   search  a unit is the largest of
 *             ready   3 passes with 3 exponentials and K W multiply-adds, 3 R hypotheses judged
 *             renew   3 intervals' work, R hypotheses judged
 *             region  the same, and 225 boxes of 5 x 5 cells
 *   judge   explain: 2 times ready, 5 times what renew does, 8 passes with an exponential;
 *           whose bias it is: 2 times ready and a pass for each outcome that it integrates
 *
 * Without it (search/select.h; B bins, G grid, P pairs, S scans, E edges, M moves), 24 ellipses a
 * pair, H = B (B + 1) / 2 intervals, 136 = 16 * 17 / 2 of 16 conditional bins:
 *   search  U times (rimi_select_work):
 *     scans   min(S, r c) intervals: B prefix sums and H hypotheses; r comparisons each
 *     edges   at most 3 bases: r c comparisons and R points each; E + 25 conditional intervals,
 *             2 E + 25 in the small profile: an edge that comes near is tried in 4 more shears and
 *             its base once more, and features of one word of the ring are read together. Each is
 *             R points, 16 prefix sums, 136 hypotheses; every sixth of them one offer: 1 ellipse,
 *             48 evidences
 *     enter   1 pair in the small profile, else 2: G (G + 1) cells cleared, R points read and put,
 *             G^2 accumulated, 24 ellipses of G rows
 *     moves   M ellipses of G rows, 2 M in the small profile, an exponential; M / 12 + 2 looks at
 *             24 evidences; in the small profile not in a unit in which a pair enters. Otherwise
 *             the leader is corrected by the ring: R points and G^2 cells an ellipse, and when
 *             another pair leads 48 ellipses more
 *     scores  2 (c + 24 P) evidences
 *   block   r features into cells, r c sums; P grids gain a point: G sums, 24 ellipses judge it by
 *           one row (by G rows, and again when it leaves the ring, for a leader corrected by it);
 *           where the units of sums grow, G (G + 1) cells and 24 ellipses
 *   judge   R points looked at for the alarm's begin, 4 outcomes named among c, each with H
 *           hypotheses and 24 P evidences
 * Once in 30000 blocks the tables are halved: r B c sums, P grids of G (G + 1), 24 P ellipses. That
 * step may cost `halving` more. */
#ifndef RIM_WORK_H
#define RIM_WORK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Lengths of the loops. */
typedef struct rim_work_counts {
  uint32_t features, outcomes, channels, region_features, ring, budget, block_rows;
  uint32_t bins, grid, pairs, scans, edges, moves;     /* without section NOISE */
  uint32_t inputs, times, terms, means, rates, fields; /* with it */
  uint32_t integrands;                                 /* of section AGREEMENT */
  uint32_t angles, prototypes, top;                    /* section LEVEL; 0: there is none */
  uint32_t quadratic_inputs, quadratic_terms;          /* section QUADRATIC: terms of all models */
  uint32_t memory_bytes, image_bytes;
  bool trained, external, corrected, watched, small;
} rim_work_counts;

/* Instructions, at most. */
typedef struct rim_work {
  uint32_t row, search, block, judge, guard;
  uint32_t step;    /* the most costly step: the sum of what may come together */
  uint32_t halving; /* more than that, once in 30000 blocks */
} rim_work;

/* Reads the counts of an image, defaults filled in. Errors as rim_monitor_size; *counts unchanged
 * on error. O(image bytes). */
rim_status rimi_work_counts_of(const void *image, size_t image_bytes, rim_work_counts *counts);

/* The bound. Saturates at UINT32_MAX. NULL: nothing happens. O(1). */
void rimi_work_bound(const rim_work_counts *counts, rim_work *work);

#ifdef __cplusplus
}
#endif
#endif
