/* rim/work.h - the most that one monitor step may do: a bound from the counts in the flight image,
 * whatever the data are.
 *
 * Unit: instructions of a Cortex-M7 with FPU (gcc -O2). What a turn of each loop costs is an upper
 * estimate (src/work.c), the number of turns is derived here; `make size` holds the largest step
 * that was measured to the bound, for three images. On another processor the turns are the same.
 *
 * d features, o outcomes, c = o kinds channels, r region features, R ring, B bins, G grid, P pairs,
 * S scans, E edges, M moves, U budget; of a model K prototypes of which t are averaged. All are
 * words of the image, so none depends on what is observed. 24 ellipses a pair, below 48 edges 12,
 * H = B (B + 1) / 2 intervals, 136 = 16 * 17 / 2 of 16 conditional bins. Per step (monitor.c,
 * rim_monitor_step):
 *
 *   row     d values are looked at and summed; o residuals; with VARIANCE or STEP one prediction:
 *           d standardised, K distances of d, t kept of them, t exponentials, o outcomes of t maps
 *           of d and a root; with a correction 8 regions of 3 features and o shifts
 *   search  U times (select.c, rim_select_work):
 *     scans   min(S, r c) intervals: B prefix sums and H hypotheses, with an envelope two each;
 *             r comparisons where the best one fell
 *     edges   at most 3 bases: r c comparisons and R points each; E + 4 conditional intervals,
 *             for an edge that comes near is tried in 4 more shears: R points, 16 prefix sums, 136
 *             hypotheses; every fifth of them one offer: 1 ellipse, 48 evidences
 *     enter   1 pair (2 from 48 edges on): G (G + 1) cells cleared, R points put, G^2 accumulated,
 *             24 ellipses of G rows
 *     moves   M ellipses of G rows, an exponential; M / 12 + 2 looks at 24 evidences; below 48
 *             edges not in a unit in which a pair enters. From 48 edges on the leader is corrected
 *             by the ring: R points and G^2 cells an ellipse, and when another pair leads 48
 *             ellipses more
 *     scores  2 (c + 24 P) evidences
 *   block   two predictions as above and o logarithms (none where rows bring their own); r features
 *           into cells, r c sums; P grids gain a point: G sums, 24 ellipses judge it by one row (by
 *           G rows, and again when it leaves the ring, for a leader corrected by the ring)
 *   judge   c scores; while an alarm stands: R points looked at for its begin, 2 channels named
 *           among c, each with H hypotheses and 24 P evidences
 *   watch   interference: 25 multiply-adds, 10 exponentials, 6 logarithms
 *
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

typedef struct rim_work_model {
  uint32_t prototypes, top; /* 0: there is no such model */
} rim_work_model;

/* Lengths of the loops. */
typedef struct rim_work_counts {
  uint32_t features, outcomes, channels, region_features;
  uint32_t ring, bins, grid, pairs; /* pairs 0: intervals alone */
  uint32_t scans, edges, moves, budget;
  uint32_t block_rows;
  rim_work_model step, level, increment;
  bool external, envelope, corrected, watched;
} rim_work_counts;

/* Instructions, at most. */
typedef struct rim_work {
  uint32_t row, search, block, judge;
  uint32_t step;    /* the most costly step: the sum of what may come together */
  uint32_t halving; /* more than that, once in 30000 blocks */
} rim_work;

/* Reads the counts of an image, defaults filled in. Errors as rim_monitor_size; *counts unchanged
 * on error. O(image bytes). */
rim_status rim_work_counts_of(const void *image, size_t image_bytes, rim_work_counts *counts);

/* The bound. Saturates at UINT32_MAX. NULL: nothing happens. O(1). */
void rim_work_bound(const rim_work_counts *counts, rim_work *work);

#ifdef __cplusplus
}
#endif
#endif
