/* Two-dimensional part of the search: the pool of active pairs and their ellipses. */
#include <string.h>

#include "rim/real.h"
#include "select_private.h"

#ifndef P_TAU
#define P_TAU 0
#endif
#define MIN_N 3.0f
#ifndef P_WARM
#define P_WARM 0
#endif
#define CENTER_MARGIN 0.5f
#define MIN_AXIS 0.03f
#define MAX_AXIS 1.0f

static double unit(rim_select *e) { return (double)rim_rng_u32(&e->rng) * 0x1p-32; }

static bool allowed(const ellipse *s) {
  return s->cx > -CENTER_MARGIN && s->cx < 1.0f + CENTER_MARGIN && s->cy > -CENTER_MARGIN &&
         s->cy < 1.0f + CENTER_MARGIN && s->a > MIN_AXIS && s->a < MAX_AXIS && s->c > MIN_AXIS &&
         s->c < MAX_AXIS && s->b > -MAX_AXIS && s->b < MAX_AXIS;
}

typedef struct spans {
  uint8_t low[RIM_SELECT_MAX_GRID], high[RIM_SELECT_MAX_GRID]; /* columns low..high - 1 */
  uint32_t first, last;                                        /* rows first..last - 1 */
} spans;

static uint32_t clamped_cell(double position, double grid) {
  if (!(position > 0.0)) return 0;
  return (uint32_t)(position < grid ? position : grid);
}

/* An ellipse in units of cells, as the row loop wants it. */
typedef struct scaled {
  double cx, cy, b, c, inverse_a;
} scaled;

static scaled scale_to_grid(const rim_select *e, const ellipse *s) {
  const double grid = (double)e->grid;
  return (scaled){(double)s->cx * grid + 0.5, (double)s->cy * grid - 0.5, (double)s->b * grid,
                  (double)s->c * grid, 1.0 / ((double)s->a * grid)};
}

/* The columns low..high - 1 of a row whose cell centres lie in the ellipse. */
static void span_of_row(const rim_select *e, const scaled *s, uint32_t row, uint32_t *low,
                        uint32_t *high) {
  const double z = ((double)row - s->cy) * s->inverse_a;
  const double position = rim_abs(z) * (double)SELECT_ROOTS + 0.5;
  if (!(position < (double)SELECT_ROOTS)) {
    *low = 0;
    *high = 0;
    return;
  }
  const double half = s->c * (double)e->root[(uint32_t)position];
  const double middle = s->cx + s->b * z;
  *low = clamped_cell(middle - half, (double)e->grid);
  *high = clamped_cell(middle + half, (double)e->grid);
}

static void find_spans(const rim_select *e, const ellipse *shape, spans *out) {
  const double grid = (double)e->grid;
  const scaled s = scale_to_grid(e, shape);
  const double a = (double)shape->a * grid;
  out->first = clamped_cell(s.cy + 1.0 - a, grid);
  out->last = clamped_cell(s.cy + 1.0 + a, grid);
  for (uint32_t row = out->first; row < out->last; ++row) {
    uint32_t low;
    uint32_t high;
    span_of_row(e, &s, row, &low, &high);
    out->low[row] = (uint8_t)low;
    out->high[row] = (uint8_t)high;
  }
}

static bool cell_in_ellipse(const rim_select *e, const ellipse *shape, uint32_t row,
                            uint32_t column) {
  const scaled s = scale_to_grid(e, shape);
  uint32_t low;
  uint32_t high;
  span_of_row(e, &s, row, &low, &high);
  return column >= low && column < high;
}

static void sum_grid(const rim_grid *grid, const spans *cells, chain *k) {
  double s = 0.0;
  uint32_t n = 0;
  for (uint32_t row = cells->first; row < cells->last; ++row) {
    const size_t base = (size_t)row * (grid->grid + 1u);
    s += (double)grid->sum[base + cells->high[row]] - (double)grid->sum[base + cells->low[row]];
    n += (uint32_t)grid->count[base + cells->high[row]] - grid->count[base + cells->low[row]];
  }
  k->grid_s = (float)s;
  k->grid_n = (float)n;
}

static bool cell_inside(const spans *cells, uint32_t row, uint32_t column) {
  return row >= cells->first && row < cells->last && column >= cells->low[row] &&
         column < cells->high[row];
}

static bool point_inside(const ellipse *s, double x, double y) {
  const double v = (y - (double)s->cy) / (double)s->a;
  const double h = (x - (double)s->cx - (double)s->b * v) / (double)s->c;
  return v * v + h * h < 1.0;
}

/* Adds what the ring's points say to what their cells said. */
static void correct_by_ring(const rim_select *e, const pair_state *p, const spans *cells, chain *k) {
  const ellipse *shape = &k->shape;
  const double inverse_a = 1.0 / (double)shape->a;
  const double inverse_c = 1.0 / (double)shape->c;
  const double cx = (double)shape->cx * 256.0 - 0.5;
  const double cy = (double)shape->cy * 256.0 - 0.5;
  const double ia = inverse_a / 256.0;
  const double ic = inverse_c / 256.0;
  const double shear = (double)shape->b * inverse_c;
  double s = 0.0;
  double n = 0.0;
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const uint8_t *row = select_row(e, slot);
    const uint32_t x = row[p->x];
    const uint32_t y = row[p->y];
    const double v = ((double)y - cy) * ia;
    const double h = ((double)x - cx) * ic - shear * v;
    const bool exact = v * v + h * h < 1.0;
    const bool coarse = cell_inside(cells, (y * e->grid) >> 8, (x * e->grid) >> 8);
    if (exact == coarse) continue;
    const double r = (double)select_residual(e, slot)[p->channel] * SELECT_RESIDUAL_STEP;
    s += exact ? r : -r;
    n += exact ? 1.0 : -1.0;
  }
  k->s = (float)((double)k->grid_s + s);
  k->n = (float)((double)k->grid_n + n);
}

static float ln_anom_of(const rim_select *e, uint32_t channel, float s, float n) {
  if (n < MIN_N) return 0.0f;
  const channel_state *state = select_channel(e, channel);
  return (float)select_ln_anom((double)s, (double)n, (double)state->a, (double)state->b);
}

float select_chain_ln_anom(const rim_select *e, const pair_state *p, const chain *k) {
  return ln_anom_of(e, p->channel, k->s, k->n);
}

float select_pair_best(const rim_select *e, const pair_state *p, uint32_t *which) {
  float best = -1.0f;
  for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) {
    const float value = select_chain_ln_anom(e, p, &p->chain[k]);
    if (value > best) {
      best = value;
      if (which != NULL) *which = k;
    }
  }
  return best;
}

/* Stage 1: on the grid. Returns the spans for stage 2. */
static void evaluate_grid(rim_select *e, uint32_t pair, chain *k, spans *cells) {
  const rim_grid grid = select_grid(e, pair);
  find_spans(e, &k->shape, cells);
  sum_grid(&grid, cells, k);
  k->s = k->grid_s;
  k->n = k->grid_n;
  ++e->effort.moves;
}

static void evaluate(rim_select *e, uint32_t pair, chain *k) {
  spans cells;
  const pair_state *p = select_pair(e, pair);
  evaluate_grid(e, pair, k, &cells);
  if (p->exact) correct_by_ring(e, p, &cells, k);
}

static void adjust(chain *k, double r, double n, bool exact, bool coarse) {
  if (coarse) {
    k->grid_s = (float)((double)k->grid_s + r);
    k->grid_n = (float)((double)k->grid_n + n);
  }
  if (exact) {
    k->s = (float)((double)k->s + r);
    k->n = (float)((double)k->n + n);
  }
}

/* The observation in this slot is new: the grids and every ellipse that holds it gain it. */
void select_pool_observe(rim_select *e, uint32_t slot) {
  const uint8_t *row = select_row(e, slot);
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active) continue;
    const double r = (double)select_residual(e, slot)[p->channel] * SELECT_RESIDUAL_STEP;
    const uint32_t cell_row = ((uint32_t)row[p->y] * e->grid) >> 8;
    const uint32_t cell_column = ((uint32_t)row[p->x] * e->grid) >> 8;
    const rim_grid grid = select_grid(e, i);
    rim_grid_add(&grid, (uint16_t)cell_row, (uint16_t)cell_column, r);
    for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) {
      chain *one = &p->chain[k];
      const bool coarse = cell_in_ellipse(e, &one->shape, cell_row, cell_column);
      const bool exact = p->exact ? point_inside(&one->shape, ((double)row[p->x] + 0.5) / 256.0,
                                                 ((double)row[p->y] + 0.5) / 256.0)
                                  : coarse;
      adjust(one, r, 1.0, exact, coarse);
    }
  }
}

/* The observation in this slot leaves the ring: from now on it counts by its cell. */
void select_pool_forget(rim_select *e, uint32_t slot) {
  const uint8_t *row = select_row(e, slot);
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active || !p->exact) continue;
    const double r = (double)select_residual(e, slot)[p->channel] * SELECT_RESIDUAL_STEP;
    for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) {
      chain *one = &p->chain[k];
      const bool coarse =
          cell_in_ellipse(e, &one->shape, ((uint32_t)row[p->y] * e->grid) >> 8,
                          ((uint32_t)row[p->x] * e->grid) >> 8);
      const bool exact = point_inside(&one->shape, ((double)row[p->x] + 0.5) / 256.0,
                                      ((double)row[p->y] + 0.5) / 256.0);
      if (exact == coarse) continue;
      one->s = (float)((double)one->s + (coarse ? r : -r));
      one->n += coarse ? 1.0f : -1.0f;
    }
  }
}

/* An ellipse about a box, scattered. */
static ellipse scattered(rim_select *e, const double *low, const double *high, const double *m,
                         double scatter) {
  ellipse s;
  const double half_x = 0.5 * (high[0] - low[0]);
  const double half_y = 0.5 * (high[1] - low[1]);
  s.cx = (float)(low[0] + half_x + scatter * half_x * (unit(e) - 0.5));
  s.cy = (float)(low[1] + half_y + scatter * half_y * (unit(e) - 0.5));
  const double a = rim_sqrt(m[2]);
  const double b = m[1] / a;
  const double c = rim_sqrt(rim_max(m[0] - b * b, 1e-9));
  s.c = (float)rim_clamp(c * (1.0 + scatter * (unit(e) - 0.5)), 0.04, 0.95);
  s.a = (float)rim_clamp(a * (1.0 + scatter * (unit(e) - 0.5)), 0.04, 0.95);
  s.b = (float)rim_clamp(b + scatter * c * (unit(e) - 0.5), -0.95, 0.95);
  return s;
}

static void backfill(rim_select *e, uint32_t pair) {
  const pair_state *p = select_pair(e, pair);
  const rim_grid grid = select_grid(e, pair);
  rim_grid_clear(&grid);
  for (uint32_t slot = 0; slot < e->held; ++slot) {
    const uint8_t *row = select_row(e, slot);
    rim_grid_put(&grid, (uint16_t)(((uint32_t)row[p->y] * e->grid) >> 8),
                 (uint16_t)(((uint32_t)row[p->x] * e->grid) >> 8),
                 (double)select_residual(e, slot)[p->channel] * SELECT_RESIDUAL_STEP);
  }
  rim_grid_accumulate(&grid);
  ++e->effort.backfills;
}

static void refresh(rim_select *e, uint32_t pair, uint8_t exact) {
  pair_state *p = select_pair(e, pair);
  p->exact = exact;
  for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) evaluate(e, pair, &p->chain[k]);
}

static void activate(rim_select *e, uint32_t pair, uint16_t x, uint16_t y, uint16_t channel,
                     const double *low, const double *high, const double *m) {
  pair_state *p = select_pair(e, pair);
  memset(p, 0, sizeof *p);
  p->x = x;
  p->y = y;
  p->channel = channel;
  p->active = 1;
  backfill(e, pair);
  for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) {
    p->chain[k].shape = scattered(e, low, high, m, k == 0 ? 0.0 : 1.0);
  }
  refresh(e, pair, 0);
}

/* A new rectangle for a pair that is active: it replaces the worst ellipse if it beats it. */
static void seed_chain(rim_select *e, uint32_t pair, const double *low, const double *high,
                       const double *m) {
  pair_state *p = select_pair(e, pair);
  uint32_t worst = 0;
  float value = 3e38f;
  for (uint32_t k = 0; k < RIM_SELECT_CHAINS; ++k) {
    const float f = select_chain_ln_anom(e, p, &p->chain[k]);
    if (f < value) {
      value = f;
      worst = k;
    }
  }
  chain fresh;
  fresh.shape = scattered(e, low, high, m, 0.5);
  evaluate(e, pair, &fresh);
  if (select_chain_ln_anom(e, p, &fresh) > value) p->chain[worst] = fresh;
}

/* H3 that a pair must beat to enter the pool. */
double select_pool_bar(const rim_select *e, uint32_t *weakest) {
  double bar = 1e300;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    const pair_state *p = select_pair(e, i);
    if (!p->active) {
      *weakest = i;
      return -1e300;
    }
    if (i != e->leader && (double)p->h3 < bar) {
      bar = (double)p->h3;
      *weakest = i;
    }
  }
  return bar;
}

void select_pool_offer(rim_select *e, uint16_t x, uint16_t y, uint16_t channel, const double *low,
                       const double *high, double h3, double sxx, double sxy, double syy) {
  const double m[3] = {sxx, sxy, syy};
  const channel_state *state = select_channel(e, channel);
  const double value = h3 * (double)state->scale - (double)state->offset;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (p->active && p->x == x && p->y == y && p->channel == channel) {
      p->h3 = (float)value;
      if (i != e->leader || h3 > (double)select_pair_best(e, p, NULL) - 6.0) seed_chain(e, i, low, high, m);
      return;
    }
  }
  uint32_t weakest = e->pairs;
  if (value <= select_pool_bar(e, &weakest) || weakest == e->pairs) return;
  activate(e, weakest, x, y, channel, low, high, m);
  select_pair(e, weakest)->h3 = (float)value;
}

/* Differential evolution: a step along the difference of two others, a little noise. */
static ellipse proposed(rim_select *e, const pair_state *p, uint32_t k) {
  uint32_t i = rim_rng_below(&e->rng, RIM_SELECT_CHAINS - 1u);
  uint32_t j = rim_rng_below(&e->rng, RIM_SELECT_CHAINS - 2u);
  if (i >= k) ++i;
  const uint32_t lower = i < k ? i : k;
  const uint32_t upper = i < k ? k : i;
  if (j >= lower) ++j;
  if (j >= upper) ++j;
  const uint32_t word = rim_rng_u32(&e->rng);
  const double gain = (word & 0xf000u) == 0 ? 1.0 : 0.05 + 0.75 * (double)(word >> 16) * 0x1p-16;
  const ellipse *from = &p->chain[i].shape;
  const ellipse *to = &p->chain[j].shape;
  ellipse s = p->chain[k].shape;
  const uint32_t noise = rim_rng_u32(&e->rng);
  const double amplitude = 0.012;
#define NOISE(shift) (amplitude * ((double)((noise >> (shift)) & 63u) / 63.0 - 0.5))
  s.cx = (float)((double)s.cx + gain * ((double)to->cx - (double)from->cx) + NOISE(0));
  s.cy = (float)((double)s.cy + gain * ((double)to->cy - (double)from->cy) + NOISE(6));
  s.a = (float)((double)s.a + gain * ((double)to->a - (double)from->a) + NOISE(12));
  s.b = (float)((double)s.b + gain * ((double)to->b - (double)from->b) + NOISE(18));
  s.c = (float)((double)s.c + gain * ((double)to->c - (double)from->c) + NOISE(24));
#undef NOISE
  return s;
}

static bool accepted(rim_select *e, double gained) {
  if (gained >= 0.0) return true;
  return gained > -30.0 && unit(e) < rim_exp(gained);
}

static void move_chain(rim_select *e, uint32_t pair, uint32_t k) {
  pair_state *p = select_pair(e, pair);
  chain *old = &p->chain[k];
  chain fresh;
  fresh.shape = proposed(e, p, k);
  if (!allowed(&fresh.shape)) return;
  spans cells;
  evaluate_grid(e, pair, &fresh, &cells);
  const double coarse = (double)ln_anom_of(e, p->channel, fresh.grid_s, fresh.grid_n) -
                        (double)ln_anom_of(e, p->channel, old->grid_s, old->grid_n);
  const bool greedy = k == 0;
  if (!p->exact) {
    if (coarse > 0.0 || (P_WARM && !greedy && accepted(e, coarse))) *old = fresh;
    return;
  }
  if (greedy ? coarse < -3.0 : !accepted(e, coarse)) return;
  correct_by_ring(e, p, &cells, &fresh);
  const double fine = (double)select_chain_ln_anom(e, p, &fresh) -
                      (double)select_chain_ln_anom(e, p, old);
  if (greedy ? fine > 0.0 : accepted(e, fine - coarse)) *old = fresh;
}

#ifndef P_LAG
#define P_LAG 6.0
#endif
/* An ellipse that lags far behind the best has lost its way: it restarts from another's place. */
static void regroup(rim_select *e, pair_state *p) {
  uint32_t worst = 0;
  float low = 3e38f;
  float high = 0.0f;
  for (uint32_t k = 1; k < RIM_SELECT_CHAINS; ++k) {
    const float value = select_chain_ln_anom(e, p, &p->chain[k]);
    if (value < low) {
      low = value;
      worst = k;
    }
    if (value > high) high = value;
  }
  if ((double)high - (double)low < P_LAG) return;
  const uint32_t other = rim_rng_below(&e->rng, RIM_SELECT_CHAINS);
  if (select_chain_ln_anom(e, p, &p->chain[other]) > low) p->chain[worst] = p->chain[other];
}

static void move_pair(rim_select *e, uint32_t pair, uint32_t moves) {
  pair_state *p = select_pair(e, pair);
  regroup(e, p);
  if (moves > 24) regroup(e, p);
  for (uint32_t i = 0; i < moves; ++i) {
    move_chain(e, pair, p->cursor);
    p->cursor = (uint16_t)(p->cursor + 1u == RIM_SELECT_CHAINS ? 0u : p->cursor + 1u);
  }
}

#ifndef P_EXACT
#define P_EXACT 1
#endif
#ifndef P_LEAD
#define P_LEAD 36
#endif
void select_pool_move(rim_select *e, uint32_t budget) {
  uint32_t others = 0;
  for (uint32_t i = 0; i < e->pairs; ++i) {
    pair_state *p = select_pair(e, i);
    if (!p->active) continue;
    const uint8_t exact = (P_EXACT && i == e->leader) ? 1 : 0;
    if (p->exact != exact) refresh(e, i, exact);
    if (i != e->leader) ++others;
  }
  if (e->leader >= e->pairs) return;
  const uint32_t share = others > 0 ? budget * P_LEAD / 48u : budget;
  move_pair(e, e->leader, share);
  if (others == 0) return;
  do {
    e->turn = (uint16_t)(e->turn + 1u >= e->pairs ? 0u : e->turn + 1u);
  } while (e->turn == e->leader || !select_pair(e, e->turn)->active);
  move_pair(e, e->turn, budget - share);
}
