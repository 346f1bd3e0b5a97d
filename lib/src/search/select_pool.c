/* SPDX-License-Identifier: MIT */
/* Two-dimensional part of the search: the pool of active pairs and their ellipses. */
#include <float.h>
#include <string.h>

#include "base/real.h"
#include "search/select_private.h"

#define MIN_N 3.0f /* observations that an ellipse must hold */
#define LAG 6.0    /* nats behind the best at which an ellipse restarts */
#define CLOSE 15.0 /* nats behind the leader within which a pair is a rival */
/* In units of 1 / SELECT_ONE, as ellipses are. */
#define CENTER_MARGIN 4096 /* centres may lie so far outside the range: its edge cuts regions */
#define MIN_AXIS 246       /* .03 */
#define MAX_AXIS 12288     /* 1.5 */
#define JITTER 50          /* .006: the largest noise in a proposal */

static double unit(rim_select *e) { return (double)rimi_rng_u32(&e->rng) * 0x1p-32; }

/* low <= x < end */
static bool between(int32_t x, int32_t low, int32_t end) {
  return (uint32_t)x - (uint32_t)low < (uint32_t)end - (uint32_t)low;
}

static bool allowed(const ellipse *s) {
  const int32_t end = SELECT_ONE + CENTER_MARGIN;
  return between(s->cx, -CENTER_MARGIN, end) && between(s->cy, -CENTER_MARGIN, end) &&
         between(s->a, MIN_AXIS, MAX_AXIS) && between(s->c, MIN_AXIS, MAX_AXIS) &&
         between(s->b, -MAX_AXIS, MAX_AXIS);
}

typedef struct spans {
  uint8_t low[RIM_SELECT_MAX_GRID], high[RIM_SELECT_MAX_GRID]; /* columns low..high - 1 */
  uint32_t first, last;                                        /* rows first..last - 1 */
} spans;

static uint32_t clamped_cell(double position, double grid) {
  if (!(position > 0.0))
    return 0;
  return (uint32_t)(position < grid ? position : grid);
}

/* Units of a column, of a half width, and of z, which goes from -HEIGHT at the lower end of an
 * ellipse to HEIGHT at the upper. */
#define CELL 65536
#define HALF_CELL 4096
#define HEIGHT 1048576
#define HEIGHT_SHIFT 12u
_Static_assert(HEIGHT >> HEIGHT_SHIFT == SELECT_ROOTS, "span_of_row");

/* An ellipse, row by row of the grid from first to end - 1, in integers. */
typedef struct walk {
  uint32_t first, end;
  int32_t z, to_next; /* of the row whose turn it is */
  int32_t middle, middle_to_next;
  uint32_t half;
} walk;

/* Of an ellipse that is allowed. Then each number fits: |z| <= HEIGHT in each row, |middle| is less
 * than 64 * 3 cells, to_next less than HEIGHT / .24. */
static walk walk_over(const rim_select *e, const ellipse *s) {
  walk w = {.first = 0};
  const double cells = (double)e->grid / SELECT_ONE;
  const double a = (double)s->a * cells;
  const double cy = (double)s->cy * cells - 0.5;
  w.first = clamped_cell(cy + 1.0 - a, (double)e->grid);
  w.end = clamped_cell(cy + 1.0 + a, (double)e->grid);
  if (w.first >= w.end)
    return w;
  const double inverse = 1.0 / a;
  const double z = ((double)w.first - cy) * inverse;
  const double slope = (double)s->b * cells * CELL;
  w.z = (int32_t)(z * HEIGHT);
  w.to_next = (int32_t)(inverse * HEIGHT);
  w.middle = (int32_t)(((double)s->cx * cells + 0.5) * CELL + slope * z);
  w.middle_to_next = (int32_t)(slope * inverse);
  w.half = (uint32_t)((double)s->c * cells * HALF_CELL);
  return w;
}

static uint32_t column_of(int32_t position, uint32_t grid) {
  if (position <= 0)
    return 0;
  const uint32_t cell = (uint32_t)position / CELL;
  return cell < grid ? cell : grid;
}

/* The columns low..high - 1 of the row whose cell centres lie in the ellipse. */
static inline void span_of_row(const rim_select *e, const walk *w, uint32_t *low, uint32_t *high) {
  const uint32_t height = (uint32_t)(w->z < 0 ? -w->z : w->z);
  const uint32_t root = e->root[(height + (1u << HEIGHT_SHIFT) / 2u) >> HEIGHT_SHIFT];
  const int32_t half = (int32_t)((w->half * root) >> 8);
  *low = column_of(w->middle - half, e->grid);
  *high = column_of(w->middle + half, e->grid);
}
_Static_assert(HALF_CELL *SELECT_ROOT_ONE == CELL << 8, "span_of_row");

static inline void next_row(walk *w) {
  w->z += w->to_next;
  w->middle += w->middle_to_next;
}

/* None of an ellipse that is not allowed, which an upset may have left. */
static void find_spans(const rim_select *e, const ellipse *shape, spans *out) {
  out->first = out->last = 0;
  if (!allowed(shape))
    return;
  walk w = walk_over(e, shape);
  out->first = w.first;
  out->last = w.end;
  for (uint32_t row = w.first; row < w.end; ++row, next_row(&w)) {
    uint32_t low;
    uint32_t high;
    span_of_row(e, &w, &low, &high);
    out->low[row] = (uint8_t)low;
    out->high[row] = (uint8_t)high;
  }
}

static bool cell_in_ellipse(const rim_select *e, const ellipse *shape, uint32_t row,
                            uint32_t column) {
  if (!allowed(shape))
    return false;
  walk w = walk_over(e, shape);
  if (row < w.first || row >= w.end)
    return false;
  w.z += w.to_next * (int32_t)(row - w.first);
  w.middle += w.middle_to_next * (int32_t)(row - w.first);
  uint32_t low;
  uint32_t high;
  span_of_row(e, &w, &low, &high);
  return column >= low && column < high;
}

/* Stage 1: on the grid. Nothing lies in an ellipse that is not allowed, and false is returned. */
static bool evaluate_grid(rim_select *e, uint32_t pair, chain *k) {
  const rim_grid grid = select_grid(e, pair);
  const bool is_allowed = allowed(&k->shape);
  int32_t units = 0;
  uint32_t count = 0;
  if (is_allowed) {
    walk w = walk_over(e, &k->shape);
    const uint32_t *row = grid.cell + (size_t)w.first * (grid.grid + 1u);
    for (uint32_t left = w.end - w.first; left > 0; --left, next_row(&w)) {
      uint32_t low;
      uint32_t high;
      span_of_row(e, &w, &low, &high);
      rimi_grid_span(row, low, high, &units, &count);
      row += grid.grid + 1u;
    }
  }
  k->grid_s = (float)((double)rimi_grid_steps(&grid, units) * SELECT_RESIDUAL_STEP);
  k->grid_n = (float)count;
  k->s = k->grid_s;
  k->n = k->grid_n;
  ++e->effort.moves;
  return is_allowed;
}

static bool cell_inside(const spans *cells, uint32_t row, uint32_t column) {
  return row >= cells->first && row < cells->last && column >= cells->low[row] &&
         column < cells->high[row];
}

static bool unit_point_inside(const ellipse *s, double x, double y) {
  const double v = (y * SELECT_ONE - (double)s->cy) / (double)s->a;
  const double h = (x * SELECT_ONE - (double)s->cx - (double)s->b * v) / (double)s->c;
  return v * v + h * h < 1.0;
}

/* Stage 2 for one point, by its bytes. */
static bool point_inside(const ellipse *s, uint32_t x, uint32_t y) {
  return unit_point_inside(s, ((double)x + 0.5) / 256.0, ((double)y + 0.5) / 256.0);
}

/* Where the boundary may cut cells of a row: columns left[0]..left[1] and right[0]..right[1]. */
typedef struct windows {
  int32_t left[2], right[2];
  int32_t low, high; /* the row's own span */
} windows;

static int32_t clamp_column(int32_t column, int32_t columns) {
  return column < 0 ? 0 : column < columns ? column : columns - 1;
}

/* From the spans of the row and its two neighbours; a row next to the ellipse counts as an empty
 * span in the middle of the ellipse's end row. Needs cells->first <= row + 1, row <= cells->last.
 */
static windows windows_of(const spans *cells, int32_t row, int32_t columns) {
  const int32_t first = (int32_t)cells->first;
  const int32_t last = (int32_t)cells->last;
  int32_t low[3];
  int32_t high[3];
  for (int32_t i = 0; i < 3; ++i) {
    const int32_t at = row + i - 1;
    const int32_t near = at < first ? first : at < last ? at : last - 1;
    low[i] = cells->low[near];
    high[i] = cells->high[near];
    if (at != near) {
      low[i] = (low[i] + high[i]) / 2;
      high[i] = low[i];
    }
  }
  windows w = {{low[1], low[1]}, {high[1], high[1]}, low[1], high[1]};
  for (uint32_t i = 0; i < 3; i += 2) {
    if (low[i] < w.left[0])
      w.left[0] = low[i];
    if (low[i] > w.left[1])
      w.left[1] = low[i];
    if (high[i] < w.right[0])
      w.right[0] = high[i];
    if (high[i] > w.right[1])
      w.right[1] = high[i];
  }
  w.left[0] = clamp_column(w.left[0] - 1, columns);
  w.left[1] = clamp_column(w.left[1], columns);
  w.right[0] = clamp_column(w.right[0] - 1, columns);
  w.right[1] = clamp_column(w.right[1], columns);
  return w;
}

/* Adds to a cell's verdict what its points of the ring say of themselves. */
static void correct_cell(const rim_select *e, const pair_state *p, const ellipse *shape,
                         uint32_t newest, bool coarse, int32_t *s, int32_t *n) {
  const ring_column x = select_column(e, p->x);
  const ring_column y = select_column(e, p->y);
  uint32_t left = e->held; /* an upset may close a list to a ring, or lead out of it */
  for (uint32_t next = newest; next - 1u < e->ring && left-- > 0;
       next = *select_link(e, next - 1u)) {
    const bool exact = point_inside(shape, select_byte(&x, next - 1u), select_byte(&y, next - 1u));
    if (exact == coarse)
      continue;
    const int32_t r = select_residual(e, next - 1u)[p->channel];
    *s += exact ? r : -r;
    *n += exact ? 1 : -1;
  }
}

/* Stage 2, for the leader: points of the ring in cells that the boundary may cut count by their own
 * coordinates. */
static void correct_by_ring(const rim_select *e, const pair_state *p, chain *k) {
  spans cells;
  find_spans(e, &k->shape, &cells);
  const int32_t rows = e->grid;
  const int32_t first = (int32_t)cells.first;
  const int32_t last = (int32_t)cells.last;
  int32_t s = 0;
  int32_t n = 0;
  for (int32_t row = first > 0 ? first - 1 : 0; first < last && row <= last && row < rows; ++row) {
    const windows w = windows_of(&cells, row, rows);
    const uint16_t *cell = select_cell(e, (uint32_t)row, 0);
    for (int32_t c = w.left[0]; c <= w.right[1]; ++c) {
      if (c > w.left[1] && c < w.right[0])
        c = w.right[0];
      if (cell[c] != 0) {
        correct_cell(e, p, &k->shape, cell[c], c >= w.low && c < w.high, &s, &n);
      }
    }
  }
  k->s = (float)((double)k->grid_s + (double)s * SELECT_RESIDUAL_STEP);
  k->n = (float)((double)k->grid_n + (double)n);
}

/* A point of the ring, as the grid and the ellipses of a pair see it. */
typedef struct point {
  uint32_t x, y; /* bytes */
  uint32_t column, row;
  int32_t residual; /* steps */
} point;

static point point_of(const rim_select *e, const pair_state *p, uint32_t slot) {
  const ring_column x = select_column(e, p->x);
  const ring_column y = select_column(e, p->y);
  point at = {.x = select_byte(&x, slot), .y = select_byte(&y, slot)};
  at.column = (at.x * e->grid) >> 8;
  at.row = (at.y * e->grid) >> 8;
  at.residual = select_residual(e, slot)[p->channel];
  return at;
}

/* What stages 1 and 2 say of one point. */
static void judge_point(const rim_select *e, const pair_state *p, const ellipse *shape,
                        const point *at, bool *coarse, bool *fine) {
  if (!p->exact) {
    *coarse = cell_in_ellipse(e, shape, at->row, at->column);
    *fine = *coarse;
    return;
  }
  const int32_t row = (int32_t)at->row;
  const int32_t column = (int32_t)at->column;
  spans cells;
  find_spans(e, shape, &cells);
  *coarse = cell_inside(&cells, at->row, at->column);
  *fine = *coarse;
  if (cells.first >= cells.last || row + 1 < (int32_t)cells.first || row > (int32_t)cells.last) {
    return;
  }
  const windows w = windows_of(&cells, row, e->grid);
  const bool left = column >= w.left[0] && column <= w.left[1];
  const bool right = column >= w.right[0] && column <= w.right[1];
  if (left || right)
    *fine = point_inside(shape, at->x, at->y);
}

static float ln_anom_of(const rim_select *e, uint32_t channel, float s, float n) {
  if (n < MIN_N)
    return 0.0f;
  const channel_state *state = select_channel(e, channel);
  return (float)select_ln_anom((double)s, (double)n, (double)state->a, (double)state->b);
}

static float ln_anom(const rim_select *e, const pair_state *p, const chain *k) {
  return ln_anom_of(e, p->channel, k->s, k->n);
}

float rimi_select_pair_best(const rim_select *e, pair_state *p, uint32_t *which) {
  if (!p->judged) {
    p->best = -1.0f;
    for (uint32_t k = 0; k < e->chains; ++k) {
      const float value = ln_anom(e, p, &p->chain[k]);
      if (value > p->best) {
        p->best = value;
        p->which = (uint8_t)k;
      }
    }
    p->judged = true;
  }
  if (which != NULL)
    *which = p->which;
  return p->best;
}

static void evaluate(rim_select *e, uint32_t pair, chain *k) {
  const pair_state *p = select_pair(e, pair);
  (void)evaluate_grid(e, pair, k);
  if (p->exact)
    correct_by_ring(e, p, k);
}

static void add_to(float *sum, int32_t steps) {
  *sum = (float)((double)*sum + (double)steps * SELECT_RESIDUAL_STEP);
}

/* Into its cell's list. */
static void link_slot(rim_select *e, const point *at, uint32_t slot) {
  uint16_t *cell = select_cell(e, at->row, at->column);
  *select_link(e, slot) = *cell;
  *cell = (uint16_t)(slot + 1u);
}

/* The observation in this slot is new: the grids and every ellipse that holds it gain it. */
static void pair_observe(rim_select *e, uint32_t pair, uint32_t slot) {
  pair_state *p = select_pair(e, pair);
  const point at = point_of(e, p, slot);
  p->judged = false;
  const rim_grid grid = select_grid(e, pair);
  const int32_t units = rimi_grid_units(&grid, at.residual);
  const int32_t of_grid = rimi_grid_steps(&grid, units);
  const bool halved = rimi_grid_add(&grid, at.row, at.column, units);
  if (p->exact)
    link_slot(e, &at, slot);
  if (halved) { /* and rounded anew */
    rimi_select_pool_refresh(e, pair);
    return;
  }
  for (uint32_t i = 0; i < e->chains; ++i) {
    chain *k = &p->chain[i];
    bool coarse;
    bool fine;
    judge_point(e, p, &k->shape, &at, &coarse, &fine);
    if (coarse) {
      add_to(&k->grid_s, of_grid);
      k->grid_n += 1.0f;
    }
    if (fine)
      k->n += 1.0f;
    add_to(&k->s, (coarse ? of_grid : 0) + (fine == coarse ? 0
                                            : fine         ? at.residual
                                                           : -at.residual));
  }
}

void rimi_select_pool_observe(rim_select *e, uint32_t slot) {
  for (uint32_t i = 0; i < e->pairs; ++i) {
    if (select_pair(e, i)->active)
      pair_observe(e, i, slot);
  }
}

/* Takes a slot out of its cell's list; it is the oldest there, hence at the end. */
static void unlink_slot(rim_select *e, uint16_t *from, uint32_t slot) {
  for (uint32_t i = 0; i < e->ring && *from - 1u < e->ring; ++i) {
    if (*from == slot + 1u) {
      *from = *select_link(e, slot);
      return;
    }
    from = select_link(e, *from - 1u);
  }
}

/* The observation in this slot leaves the ring: from now on it counts by its cell. */
void rimi_select_pool_forget(rim_select *e, uint32_t slot) {
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active || !p->exact)
      continue;
    p->judged = false;
    const point at = point_of(e, p, slot);
    unlink_slot(e, select_cell(e, at.row, at.column), slot);
    for (uint32_t j = 0; j < e->chains; ++j) {
      chain *k = &p->chain[j];
      bool coarse;
      bool fine;
      judge_point(e, p, &k->shape, &at, &coarse, &fine);
      if (fine == coarse)
        continue;
      add_to(&k->s, coarse ? at.residual : -at.residual);
      k->n += coarse ? 1.0f : -1.0f;
    }
  }
}

/* Fills the cells' lists for the leader. */
static void link_ring(rim_select *e, const pair_state *p) {
  memset(select_cell(e, 0, 0), 0, 2u * (size_t)e->grid * e->grid);
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const point at = point_of(e, p, slot);
    link_slot(e, &at, slot);
  }
}

/* Of the offered ellipse; two roots, taken once an offer. */
typedef struct axes {
  double a, b, c;
} axes;

static axes axes_of(const select_offer *offer) {
  const double a = rimi_sqrt(offer->shape[2]);
  const double b = offer->shape[1] / a;
  return (axes){a, b, rimi_sqrt(rimi_max(offer->shape[0] - b * b, 1e-9))};
}

/* Beyond 4, which only an upset leaves, and which is not allowed: 4. */
static int32_t narrowed(double x) {
  return x > -4.0 && x < 4.0 ? (int32_t)(x * SELECT_ONE) : 4 * SELECT_ONE;
}

/* An ellipse like the offered one, scattered about it. */
static ellipse scattered(rim_select *e, const select_offer *offer, const axes *like,
                         double scatter) {
  ellipse s;
  s.cx = narrowed(offer->center[0] + scatter * offer->half[0] * (unit(e) - 0.5));
  s.cy = narrowed(offer->center[1] + scatter * offer->half[1] * (unit(e) - 0.5));
  s.c = narrowed(rimi_clamp(like->c * (1.0 + scatter * (unit(e) - 0.5)), 0.04, 1.2));
  s.a = narrowed(rimi_clamp(like->a * (1.0 + scatter * (unit(e) - 0.5)), 0.04, 1.2));
  s.b = narrowed(rimi_clamp(like->b + scatter * like->c * (unit(e) - 0.5), -0.95, 0.95));
  return s;
}

/* The largest sum of absolute residuals in a row of the grid, in steps. */
static uint32_t largest_row(const rim_select *e, const pair_state *p) {
  uint32_t steps[RIM_SELECT_MAX_GRID] = {0};
  uint32_t largest = 0;
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const point at = point_of(e, p, slot);
    steps[at.row] += (uint32_t)(at.residual < 0 ? -at.residual : at.residual);
    if (steps[at.row] > largest)
      largest = steps[at.row];
  }
  return largest;
}

static void backfill(rim_select *e, uint32_t pair) {
  const pair_state *p = select_pair(e, pair);
  const rim_grid grid = select_grid(e, pair);
  rimi_grid_clear(&grid, largest_row(e, p));
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const point at = point_of(e, p, slot);
    rimi_grid_put(&grid, at.row, at.column, rimi_grid_units(&grid, at.residual));
  }
  rimi_grid_accumulate(&grid);
  ++e->effort.backfills;
}

static void refresh(rim_select *e, uint32_t pair, uint8_t exact) {
  pair_state *p = select_pair(e, pair);
  p->exact = exact;
  p->judged = false;
  if (exact)
    link_ring(e, p);
  for (uint32_t k = 0; k < e->chains; ++k)
    evaluate(e, pair, &p->chain[k]);
}

void rimi_select_pool_refresh(rim_select *e, uint32_t pair) {
  refresh(e, pair, select_pair(e, pair)->exact);
}

/* Chain 0 starts from the offer itself; it only ever climbs. */
static void activate(rim_select *e, uint32_t pair, const select_offer *offer) {
  pair_state *p = select_pair(e, pair);
  memset(p, 0, e->pair_bytes);
  p->x = offer->x;
  p->y = offer->y;
  p->channel = offer->channel;
  p->active = 1;
  p->h3 = (float)offer->h3;
  backfill(e, pair);
  const axes like = axes_of(offer);
  for (uint32_t k = 0; k < e->chains; ++k)
    p->chain[k].shape = scattered(e, offer, &like, k == 0 ? 0.0 : 1.0);
  refresh(e, pair, 0);
}

/* A new offer for a pair that is active: it replaces the worst ellipse if it beats it. */
static void seed_chain(rim_select *e, uint32_t pair, const select_offer *offer) {
  pair_state *p = select_pair(e, pair);
  uint32_t worst = 0;
  for (uint32_t k = 1; k < e->chains; ++k) {
    if (ln_anom(e, p, &p->chain[k]) < ln_anom(e, p, &p->chain[worst]))
      worst = k;
  }
  chain fresh;
  const axes like = axes_of(offer);
  fresh.shape = scattered(e, offer, &like, 0.5);
  evaluate(e, pair, &fresh);
  if (ln_anom(e, p, &fresh) > ln_anom(e, p, &p->chain[worst]))
    p->chain[worst] = fresh;
  p->judged = false;
}

static double priority_of(const rim_select *e, const pair_state *p, double value) {
  return select_priority(select_channel(e, p->channel), value);
}

double rimi_select_pool_bar(const rim_select *e, uint32_t *weakest) {
  double bar = DBL_MAX;
  uint32_t which = e->pairs;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    const pair_state *p = select_pair(e, i);
    const double value = p->active ? priority_of(e, p, (double)p->h3) : -DBL_MAX;
    if (i == e->leader || value >= bar)
      continue;
    bar = value;
    which = i;
  }
  if (weakest != NULL)
    *weakest = which;
  return bar;
}

static double offer_priority(const rim_select *e, const select_offer *offer) {
  return select_priority(select_channel(e, offer->channel), offer->h3);
}

/* Returns whether the pair has taken the place of the weakest. */
static bool enter(rim_select *e, const select_offer *offer) {
  uint32_t weakest;
  const double bar = rimi_select_pool_bar(e, &weakest);
  if (weakest == e->pairs || offer_priority(e, offer) <= bar)
    return false;
  activate(e, weakest, offer);
  return true;
}

/* A pair is judged by its latest H3 and not by its best ellipse, which would favour those that were
 * searched for long; only the leader is safe. */
void rimi_select_pool_offer(rim_select *e, const select_offer *offer) {
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active || p->x != offer->x || p->y != offer->y || p->channel != offer->channel)
      continue;
    p->h3 = (float)offer->h3;
    if (i != e->leader || offer->h3 > (double)rimi_select_pair_best(e, p, NULL) - LAG) {
      seed_chain(e, i, offer);
    }
    return;
  }
  if (e->small) {
    if (!e->waits || offer_priority(e, offer) > offer_priority(e, &e->waiting))
      e->waiting = *offer;
    e->waits = true;
  } else if (e->entered < ENTRIES_A_UNIT && enter(e, offer)) {
    ++e->entered;
  }
}

void rimi_select_pool_enter(rim_select *e) {
  if (e->waits && enter(e, &e->waiting))
    ++e->entered;
  e->waits = false;
}

/* Two others than k, different, by twelve bits of chance: each pair as probable as any other within
 * an eighth. */
static void draw_two(const rim_select *e, uint32_t k, uint32_t chance, uint32_t *first,
                     uint32_t *second) {
  const uint32_t others = e->chains - 2u;
  const uint32_t which = (chance * (others + 1u) * others) >> 12;
  uint32_t i = which / others;
  uint32_t j = which % others;
  if (i >= k)
    ++i;
  if (j >= (i < k ? i : k))
    ++j;
  if (j >= (i < k ? k : i))
    ++j;
  *first = i;
  *second = j;
}

/* x + gain (to - from) + noise: gain in 1 / 32768, at most 1, six bits of `noise` from `shift` on.
 * Modulo 2^32, so that an upset does no harm; exact for ellipses that are allowed. */
static int32_t stepped(int32_t x, uint32_t gain, int32_t to, int32_t from, uint32_t noise,
                       uint32_t shift) {
  const uint32_t step = (gain * ((uint32_t)to - (uint32_t)from) + 0x80000000u) >> 15;
  const uint32_t jitter = (((noise >> shift) & 63u) * 2u * JITTER) >> 6;
  return (int32_t)((uint32_t)x + step + jitter - (0x10000u + JITTER));
}

/* Differential evolution: a step along the difference of two others, which has by itself the size
 * and the direction of the cloud; a whole step now and then, to change between modes. */
static ellipse proposed(rim_select *e, const pair_state *p, uint32_t k) {
  uint32_t i;
  uint32_t j;
  const uint32_t word = rimi_rng_u32(&e->rng);
  draw_two(e, k, word & 0xfffu, &i, &j);
  /* .05 to .8 */
  const uint32_t gain = (word & 0xf000u) == 0 ? 32768u : 1638u + (word >> 16) * 3u / 8u;
  const ellipse *from = &p->chain[i].shape;
  const ellipse *to = &p->chain[j].shape;
  const uint32_t noise = rimi_rng_u32(&e->rng);
  const ellipse *s = &p->chain[k].shape;
  return (ellipse){
      .cx = stepped(s->cx, gain, to->cx, from->cx, noise, 0),
      .cy = stepped(s->cy, gain, to->cy, from->cy, noise, 6),
      .a = stepped(s->a, gain, to->a, from->a, noise, 12),
      .b = stepped(s->b, gain, to->b, from->b, noise, 18),
      .c = stepped(s->c, gain, to->c, from->c, noise, 24),
  };
}

static bool accepted(rim_select *e, double gained) {
  if (gained >= 0.0)
    return true;
  return gained > -30.0 && unit(e) < rimi_exp(gained);
}

/* Metropolis in two stages (delayed acceptance): the grid's verdict first, the ring's only for
 * those that pass. Chain 0 climbs only, and so do all pairs but the leader: they race for the lead.
 */
static void move_chain(rim_select *e, uint32_t pair, uint32_t k) {
  pair_state *p = select_pair(e, pair);
  chain *old = &p->chain[k];
  chain fresh;
  fresh.shape = proposed(e, p, k);
  if (!evaluate_grid(e, pair, &fresh))
    return;
  const double coarse = (double)ln_anom_of(e, p->channel, fresh.grid_s, fresh.grid_n) -
                        (double)ln_anom_of(e, p->channel, old->grid_s, old->grid_n);
  const bool climbs = k == 0;
  if (!p->exact) {
    if (climbs || pair != e->leader ? coarse > 0.0 : accepted(e, coarse))
      *old = fresh;
    return;
  }
  if (climbs ? coarse < -3.0 : !accepted(e, coarse))
    return;
  correct_by_ring(e, p, &fresh);
  const double fine = (double)ln_anom(e, p, &fresh) - (double)ln_anom(e, p, old);
  if (climbs ? fine > 0.0 : accepted(e, fine - coarse))
    *old = fresh;
}

/* An ellipse that lags far behind the best has lost its way: it restarts from another's place. */
static void regroup(rim_select *e, pair_state *p) {
  uint32_t worst = 1;
  float low = ln_anom(e, p, &p->chain[worst]);
  float high = low;
  for (uint32_t k = 2; k < e->chains; ++k) {
    const float value = ln_anom(e, p, &p->chain[k]);
    if (value < low) {
      low = value;
      worst = k;
    }
    if (value > high)
      high = value;
  }
  if ((double)high - (double)low < LAG)
    return;
  const uint32_t other = rimi_rng_below(&e->rng, e->chains);
  if (ln_anom(e, p, &p->chain[other]) > low)
    p->chain[worst] = p->chain[other];
}

static void move_pair(rim_select *e, uint32_t pair, uint32_t moves) {
  pair_state *p = select_pair(e, pair);
  p->judged = false;
  for (uint32_t i = 0; i < moves; ++i) {
    if (i % 12u == 0)
      regroup(e, p);
    move_chain(e, pair, p->cursor);
    p->cursor = (uint16_t)(p->cursor + 1u == e->chains ? 0u : p->cursor + 1u);
  }
}

static bool is_rival(const rim_select *e, pair_state *p, double bar) {
  return priority_of(e, p, (double)rimi_select_pair_best(e, p, NULL)) > bar ||
         priority_of(e, p, (double)p->h3) > bar;
}

/* The leader gets 3/4 of the moves, 5/6 where nobody is close; the rest goes to one rival in turn.
 */
void rimi_select_pool_move(rim_select *e, uint32_t budget) {
  if (e->leader >= e->pairs)
    return;
  pair_state *leader = select_pair(e, e->leader);
  const double bar = priority_of(e, leader, (double)rimi_select_pair_best(e, leader, NULL) - CLOSE);
  uint32_t others = 0;
  uint32_t rivals = 0;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active)
      continue;
    const uint8_t exact = i == e->leader && !e->small ? 1 : 0;
    if (p->exact != exact)
      refresh(e, i, exact);
    if (i == e->leader)
      continue;
    ++others;
    if (is_rival(e, p, bar))
      ++rivals;
  }
  const uint32_t share = others == 0 ? budget : rivals > 0 ? budget * 3u / 4u : budget * 5u / 6u;
  move_pair(e, e->leader, share);
  if (others == 0)
    return;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    e->turn = (uint16_t)(e->turn + 1u >= e->pairs ? 0u : e->turn + 1u);
    pair_state *p = select_pair(e, e->turn);
    if (e->turn == e->leader || !p->active)
      continue;
    if (rivals == 0 || is_rival(e, p, bar))
      break;
  }
  if (e->turn != e->leader)
    move_pair(e, e->turn, budget - share);
}

double rimi_select_pair_membership(const rim_select *e, const pair_state *p, double x, double y) {
  double inside = 0.0;
  for (uint32_t k = 1; k < e->chains; ++k) {
    if (unit_point_inside(&p->chain[k].shape, x, y))
      inside += 1.0;
  }
  return inside / (double)(e->chains - 1u);
}
