/* SPDX-License-Identifier: MIT */
#include "rim/plan/gp.h"

#include <string.h>

#include "base/cholesky.h"
#include "base/real.h"
#include "base/usable.h"

#define SQRT_3 0x1.bb67ae8584caap+0
#define SQRT_5 0x1.1e3779b97f4a8p+1
#define JITTER_FIRST 1e-12
#define JITTER_LAST 1e-6
#define FARTHEST 555025.0 /* 745^2: beyond it exp(-r) is 0, and a polynomial times it */
#define LEAST_SCALE 1e-100
#define LARGEST_SCALE 1e100

enum { ARRAYS = 7, BATCH = RIM_GP_BATCH };

struct rim_gp {
  rim_gp_config config;
  rim_gp_counters counters;
  uint32_t n;
  double inverse_length[RIM_GP_MAX_DIMS];
};

_Static_assert(sizeof(struct rim_gp) <= RIM_GP_HEADER_BYTES, "header");
_Static_assert(RIM_GP_HEADER_BYTES % 8 == 0, "arrays of double follow");

/* The arrays behind the header, located in every call: the block may have been moved. */
typedef struct arrays {
  double *x;       /* [n][dims] */
  double *y;       /* [n] */
  double *offset;  /* [n] */
  double *own;     /* [n] noise given with the point */
  double *noise;   /* [n] all of it: the configuration's, its own, jitter */
  double *alpha;   /* [n] K^-1 (y - offset - mean) */
  double *inverse; /* [n] diagonal of K^-1 */
  double *serial;  /* [n] exact: below 2^32 */
  double *scratch; /* [points][BATCH] */
  double *l;       /* packed factor */
} arrays;

static arrays arrays_of(const rim_gp *gp) {
  const size_t points = gp->config.points;
  arrays a;
  a.x = (double *)(void *)((uint8_t *)(uintptr_t)gp + RIM_GP_HEADER_BYTES);
  a.y = a.x + points * gp->config.dims;
  a.offset = a.y + points;
  a.own = a.offset + points;
  a.noise = a.own + points;
  a.alpha = a.noise + points;
  a.inverse = a.alpha + points;
  a.serial = a.inverse + points;
  a.scratch = a.serial + points;
  a.l = a.scratch + points * BATCH;
  return a;
}

static bool is_scale(double v) { return v >= LEAST_SCALE && v <= LARGEST_SCALE; }

/* Fills in defaults and checks. */
static rim_status complete(rim_gp_config *c) {
  if (c->kernel > RIM_GP_MATERN_5_2 || c->dims < 1 || c->dims > RIM_GP_MAX_DIMS || c->points < 1 ||
      c->points > RIM_GP_MAX_POINTS) {
    return RIM_E_CONFIG;
  }
  if (!(rimi_abs(c->signal_var) > 0.0))
    c->signal_var = c->signal_var >= 0.0 ? 1.0 : c->signal_var;
  bool fine = is_usable(c->mean) && is_scale(c->signal_var) && c->noise_var >= 0.0 &&
              c->noise_var <= LARGEST_SCALE;
  for (size_t d = 0; d < c->dims; ++d) {
    if (c->length[d] >= 0.0 && c->length[d] <= 0.0)
      c->length[d] = 1.0;
    fine = fine && is_scale(c->length[d]);
  }
  return fine ? RIM_OK : RIM_E_RANGE;
}

static void set_config(rim_gp *gp, const rim_gp_config *config) {
  gp->config = *config;
  for (size_t d = 0; d < config->dims; ++d)
    gp->inverse_length[d] = 1.0 / config->length[d];
}

rim_status rim_gp_init(rim_gp **gp, void *memory, size_t bytes, const rim_gp_config *config) {
  if (gp == NULL || memory == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  rim_gp_config c = *config;
  const rim_status status = complete(&c);
  if (status != RIM_OK)
    return status;
  if (bytes < RIM_GP_SIZE(c.dims, c.points))
    return RIM_E_SIZE;
  memset(memory, 0, RIM_GP_SIZE(c.dims, c.points));
  *gp = memory;
  set_config(*gp, &c);
  return RIM_OK;
}

void rim_gp_reset(rim_gp *gp) {
  gp->n = 0;
  memset(&gp->counters, 0, sizeof gp->counters);
}

uint32_t rim_gp_points(const rim_gp *gp) { return gp->n; }
uint32_t rim_gp_capacity(const rim_gp *gp) { return gp->config.points; }
rim_gp_config rim_gp_get_config(const rim_gp *gp) { return gp->config; }
rim_gp_counters rim_gp_get_counters(const rim_gp *gp) { return gp->counters; }

static double distance2(const rim_gp *gp, const double *a, const double *b) {
  double sum = 0.0;
  for (size_t d = 0; d < gp->config.dims; ++d) {
    const double step = (a[d] - b[d]) * gp->inverse_length[d];
    sum += step * step;
  }
  return sum;
}

/* sqrt(v) within 4 ULP, 0 below 1e-300: Newton steps as in real.c without its exact last one, which
 * would take longer than the rest of a kernel. v up to 1e300. */
static double root(double v) {
  if (!(v > 1e-300))
    return 0.0;
  const double half = 0.5 * v;
  double inverse = rimi_from_bits(UINT64_C(0x5fe6eb50c7b537a9) - (rimi_bits(v) >> 1));
  for (int i = 0; i < 4; ++i)
    inverse = inverse * (1.5 - half * inverse * inverse);
  return v * inverse;
}

/* k(r), 1 at r = 0. */
static double correlation(uint8_t kernel, double r2) {
  if (kernel == RIM_GP_SQUARED_EXPONENTIAL)
    return rimi_exp(-0.5 * r2);
  if (!(r2 < FARTHEST))
    return 0.0;
  const double a = (kernel == RIM_GP_MATERN_3_2 ? SQRT_3 : SQRT_5) * root(r2);
  const double polynomial = kernel == RIM_GP_MATERN_3_2 ? 1.0 + a : 1.0 + a + a * a / 3.0;
  return polynomial * rimi_exp(-a);
}

/* -dk / d(r^2 / 2): times step_d^2 it is the derivative of k by ln length_d. */
static double correlation_slope(uint8_t kernel, double r2) {
  if (kernel == RIM_GP_SQUARED_EXPONENTIAL)
    return rimi_exp(-0.5 * r2);
  if (!(r2 < FARTHEST))
    return 0.0;
  const double a = (kernel == RIM_GP_MATERN_3_2 ? SQRT_3 : SQRT_5) * root(r2);
  const double factor = kernel == RIM_GP_MATERN_3_2 ? 3.0 : 5.0 / 3.0 * (1.0 + a);
  return factor * rimi_exp(-a);
}

/* b := L^-T b by rows of L, which lie together in memory. */
static void backward(uint32_t n, const double *l, double *restrict b) {
  for (uint32_t i = n; i-- > 0;) {
    const double *restrict row = l + packed_row(i);
    const double value = b[i] / row[i];
    b[i] = value;
    for (uint32_t k = 0; k < i; ++k)
      b[k] -= row[k] * value;
  }
}

static void solve_alpha(rim_gp *gp) {
  const arrays a = arrays_of(gp);
  for (uint32_t i = 0; i < gp->n; ++i)
    a.alpha[i] = a.y[i] - a.offset[i] - gp->config.mean;
  cholesky_forward(gp->n, a.l, a.alpha);
  backward(gp->n, a.l, a.alpha);
}

/* Writes row i of the factor, the point's whole noise and what changes in the diagonal of K^-1;
 * false, with nothing but scratch changed, where no jitter is enough. */
static bool append_row(rim_gp *gp, uint32_t i) {
  const rim_gp_config *c = &gp->config;
  const arrays a = arrays_of(gp);
  double *v = a.scratch;
  double *u = a.scratch + c->points;
  for (uint32_t j = 0; j < i; ++j) {
    v[j] = c->signal_var * correlation(c->kernel, distance2(gp, a.x + (size_t)i * c->dims,
                                                            a.x + (size_t)j * c->dims));
  }
  cholesky_forward(i, a.l, v);
  double explained = 0.0;
  for (uint32_t j = 0; j < i; ++j)
    explained += v[j] * v[j];
  const double noise = c->noise_var + a.own[i];
  double jitter = 0.0, pivot = c->signal_var + noise - explained;
  bool fine = pivot > CHOLESKY_MIN_PIVOT * (c->signal_var + noise);
  for (double step = JITTER_FIRST; !fine && step <= 1.5 * JITTER_LAST; step *= 10.0) {
    jitter = step * c->signal_var;
    pivot = c->signal_var + (noise + jitter) - explained;
    fine = pivot > CHOLESKY_MIN_PIVOT * (c->signal_var + (noise + jitter));
  }
  if (!fine)
    return false;
  if (jitter > 0.0)
    count(&gp->counters.jittered);
  a.noise[i] = noise + jitter;
  double *row = a.l + packed_row(i);
  memcpy(row, v, i * sizeof *row);
  row[i] = rimi_sqrt(pivot);
  /* Block inverse: K^-1 grows by u u^T / pivot, u = K^-1 k, and by the corner 1 / pivot. */
  memcpy(u, v, i * sizeof *u);
  backward(i, a.l, u);
  for (uint32_t j = 0; j < i; ++j)
    a.inverse[j] += u[j] * u[j] / pivot;
  a.inverse[i] = 1.0 / pivot;
  return true;
}

/* column := K^-1 e_index. */
static void inverse_column(const rim_gp *gp, uint32_t index, double *column) {
  const arrays a = arrays_of(gp);
  for (uint32_t i = 0; i < gp->n; ++i)
    column[i] = i == index ? 1.0 : 0.0;
  cholesky_forward(gp->n, a.l, column);
  backward(gp->n, a.l, column);
}

/* Moves the entries behind index one place up. */
static void close_gap(double *v, uint32_t index, uint32_t n, size_t width) {
  memmove(v + index * width, v + (index + 1) * width, (n - index - 1) * width * sizeof *v);
}

/* Removes a row and column of the factor: the rows behind lose column `index`, w, and their block
 * L3 becomes that of L3 L3^T + w w^T (Golub and Van Loan, 6.5.4). Never singular. */
static void delete_row(double *l, uint32_t n, uint32_t index, double *w) {
  for (uint32_t i = index + 1; i < n; ++i) {
    const double *from = l + packed_row(i);
    double *to = l + packed_row(i - 1);
    w[i - 1] = from[index];
    memmove(to, from, index * sizeof *to);
    memmove(to + index, from + index + 1, (i - index) * sizeof *to);
  }
  for (uint32_t k = index; k + 1 < n; ++k) {
    double *diagonal = l + packed_row(k) + k;
    const double root = rimi_sqrt(*diagonal * *diagonal + w[k] * w[k]);
    const double c = root / *diagonal, s = w[k] / *diagonal;
    *diagonal = root;
    for (uint32_t i = k + 1; i + 1 < n; ++i) {
      double *element = l + packed_row(i) + k;
      *element = (*element + s * w[i]) / c;
      w[i] = c * w[i] - s * *element;
    }
  }
}

static void remove_point(rim_gp *gp, uint32_t index) {
  const arrays a = arrays_of(gp);
  const uint32_t n = gp->n;
  double *column = a.scratch;
  inverse_column(gp, index, column);
  for (uint32_t i = 0; i < n; ++i) {
    if (i != index)
      a.inverse[i] -= column[i] * column[i] / column[index];
  }
  delete_row(a.l, n, index, a.scratch + gp->config.points);
  double *const vectors[ARRAYS] = {a.y, a.offset, a.own, a.noise, a.alpha, a.inverse, a.serial};
  for (size_t v = 0; v < ARRAYS; ++v)
    close_gap(vectors[v], index, n, 1);
  close_gap(a.x, index, n, gp->config.dims);
  --gp->n;
}

rim_status rim_gp_remove(rim_gp *gp, uint32_t index) {
  if (gp == NULL)
    return RIM_E_ARGUMENT;
  if (index >= gp->n)
    return RIM_E_RANGE;
  remove_point(gp, index);
  solve_alpha(gp);
  return RIM_OK;
}

uint32_t rim_gp_least_informative(const rim_gp *gp) {
  const arrays a = arrays_of(gp);
  /* s^2 / noise = 1 / (inverse noise) - 1: least where the product is largest. Without noise all
   * would be alike; the floor then ranks them by s^2. */
  const double floor_noise = JITTER_FIRST * gp->config.signal_var;
  uint32_t least = 0;
  double most = -1.0;
  for (uint32_t i = 0; i < gp->n; ++i) {
    const double product = a.inverse[i] * rimi_max(a.noise[i], floor_noise);
    if (product > most) {
      most = product;
      least = i;
    }
  }
  return least;
}

/* Updates of the diagonal of K^-1 lose a little precision each; one element an addition is
 * computed afresh, so that none is older than n additions. */
static void refresh_inverse(rim_gp *gp) {
  const arrays a = arrays_of(gp);
  const uint32_t index = gp->counters.added % gp->n;
  inverse_column(gp, index, a.scratch);
  a.inverse[index] = a.scratch[index];
}

rim_status rim_gp_add(rim_gp *gp, const double *x, double y, double noise, double offset) {
  if (gp == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  const size_t dims = gp->config.dims;
  if (!all_usable(x, dims) || !is_usable(y) || !is_usable(offset) ||
      !(noise >= 0.0 && noise <= LARGEST_SCALE)) {
    count(&gp->counters.refused);
    return RIM_E_DATA;
  }
  const bool full = gp->n == gp->config.points;
  if (full) {
    remove_point(gp, rim_gp_least_informative(gp));
    count(&gp->counters.removed);
  }
  const arrays a = arrays_of(gp);
  const uint32_t i = gp->n;
  memcpy(a.x + i * dims, x, dims * sizeof *x);
  a.y[i] = y;
  a.offset[i] = offset;
  a.own[i] = noise;
  a.serial[i] = (double)gp->counters.added;
  const bool fine = append_row(gp, i);
  if (fine) {
    gp->n = i + 1;
    count(&gp->counters.added);
    if (full)
      refresh_inverse(gp);
  } else {
    count(&gp->counters.singular);
  }
  solve_alpha(gp);
  return fine ? RIM_OK : RIM_E_SINGULAR;
}

rim_status rim_gp_get_point(const rim_gp *gp, uint32_t index, rim_gp_point *point) {
  if (gp == NULL || point == NULL)
    return RIM_E_ARGUMENT;
  if (index >= gp->n)
    return RIM_E_RANGE;
  const arrays a = arrays_of(gp);
  *point = (rim_gp_point){.x = a.x + (size_t)index * gp->config.dims,
                          .y = a.y[index],
                          .offset = a.offset[index],
                          .noise = a.noise[index],
                          .serial = (uint32_t)a.serial[index]};
  return RIM_OK;
}

rim_status rim_gp_set_offset(rim_gp *gp, uint32_t index, double offset) {
  if (gp == NULL)
    return RIM_E_ARGUMENT;
  if (index >= gp->n)
    return RIM_E_RANGE;
  if (!is_usable(offset))
    return RIM_E_DATA;
  arrays_of(gp).offset[index] = offset;
  return RIM_OK;
}

void rim_gp_refresh(rim_gp *gp) { solve_alpha(gp); }

/* Two doubles side by side where GNU C and the processor have them, else one: lane by lane the same
 * operations, so the same bits. Memory is aligned to 8. */
#if defined(__GNUC__) && (defined(__SSE2__) || defined(__aarch64__))
typedef double lanes __attribute__((vector_size(16), aligned(8), may_alias));
static inline lanes in_all(double v) { return (lanes){v, v}; }
#else
typedef double lanes;
static inline lanes in_all(double v) { return v; }
#endif
enum { WIDTH = BATCH * sizeof(double) / sizeof(lanes) };

/* b := L^-1 b for four lanes of columns, b[row][WIDTH]: each column's sums in the order of
 * cholesky_forward. Four sums in registers hide the latency of an addition. */
static void forward_four(uint32_t n, const double *l, lanes *b) {
  for (uint32_t i = 0; i < n; ++i) {
    const double *row = l + packed_row(i);
    lanes *out = b + (size_t)i * WIDTH;
    lanes s0 = out[0], s1 = out[1], s2 = out[2], s3 = out[3];
    const lanes *in = b;
    for (uint32_t k = 0; k < i; ++k, in += WIDTH) {
      const lanes f = in_all(row[k]);
      s0 -= f * in[0];
      s1 -= f * in[1];
      s2 -= f * in[2];
      s3 -= f * in[3];
    }
    const lanes d = in_all(row[i]);
    out[0] = s0 / d;
    out[1] = s1 / d;
    out[2] = s2 / d;
    out[3] = s3 / d;
  }
}

/* b := L^-1 b for BATCH columns, b[row][BATCH]. */
static void forward_batch(uint32_t n, const double *l, double *b) {
  for (size_t first = 0; first < WIDTH; first += 4)
    forward_four(n, l, (lanes *)(void *)b + first);
}

_Static_assert(WIDTH % 4 == 0, "forward_four");

/* Up to BATCH contexts; columns beyond `width` are zero. */
static void predict_batch(rim_gp *gp, const double *x, uint32_t width, double *mean, double *var) {
  const rim_gp_config *c = &gp->config;
  const arrays a = arrays_of(gp);
  double sum[BATCH] = {0}, explained[BATCH] = {0};
  for (uint32_t i = 0; i < gp->n; ++i) {
    double *row = a.scratch + (size_t)i * BATCH;
    const double *point = a.x + (size_t)i * c->dims;
    for (uint32_t b = 0; b < BATCH; ++b)
      row[b] = 0.0;
    for (uint32_t b = 0; b < width; ++b) {
      row[b] =
          c->signal_var * correlation(c->kernel, distance2(gp, x + (size_t)b * c->dims, point));
      sum[b] += row[b] * a.alpha[i];
    }
  }
  for (uint32_t b = 0; mean != NULL && b < width; ++b)
    mean[b] = c->mean + sum[b];
  if (var == NULL)
    return;
  forward_batch(gp->n, a.l, a.scratch);
  for (uint32_t i = 0; i < gp->n; ++i) {
    const double *row = a.scratch + (size_t)i * BATCH;
    for (uint32_t b = 0; b < BATCH; ++b)
      explained[b] += row[b] * row[b];
  }
  for (uint32_t b = 0; b < width; ++b)
    var[b] = rimi_max(c->signal_var - explained[b], 0.0);
}

rim_status rim_gp_predict_many(rim_gp *gp, const double *x, uint32_t n, double *mean, double *var) {
  if (gp == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  const size_t dims = gp->config.dims;
  if (!all_usable(x, n * dims))
    return RIM_E_DATA;
  for (uint32_t first = 0; first < n; first += BATCH) {
    const uint32_t width = n - first < BATCH ? n - first : BATCH;
    predict_batch(gp, x + first * dims, width, mean == NULL ? NULL : mean + first,
                  var == NULL ? NULL : var + first);
  }
  return RIM_OK;
}

rim_status rim_gp_predict(rim_gp *gp, const double *x, double *mean, double *var) {
  if (gp == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  if (!all_usable(x, gp->config.dims))
    return RIM_E_DATA;
  if (var == NULL || gp->n == 0) {
    predict_batch(gp, x, 1, mean, var);
    return RIM_OK;
  }
  const rim_gp_config *c = &gp->config;
  const arrays a = arrays_of(gp);
  double sum = 0.0, explained = 0.0;
  for (uint32_t i = 0; i < gp->n; ++i) {
    const double r2 = distance2(gp, x, a.x + (size_t)i * c->dims);
    a.scratch[i] = c->signal_var * correlation(c->kernel, r2);
    sum += a.scratch[i] * a.alpha[i];
  }
  cholesky_forward(gp->n, a.l, a.scratch);
  for (uint32_t i = 0; i < gp->n; ++i)
    explained += a.scratch[i] * a.scratch[i];
  if (mean != NULL)
    *mean = c->mean + sum;
  *var = rimi_max(c->signal_var - explained, 0.0);
  return RIM_OK;
}

double rim_gp_log_likelihood(const rim_gp *gp) {
  const arrays a = arrays_of(gp);
  double fit = 0.0, log_pivots = 0.0;
  for (uint32_t i = 0; i < gp->n; ++i) {
    fit += (a.y[i] - a.offset[i] - gp->config.mean) * a.alpha[i];
    log_pivots += rimi_log(a.l[packed_row(i) + i]);
  }
  return -0.5 * fit - log_pivots - (double)gp->n * rimi_log(RIM_SQRT_2PI);
}

void rim_gp_log_likelihood_gradient(rim_gp *gp, double *gradient) {
  const rim_gp_config *c = &gp->config;
  const arrays a = arrays_of(gp);
  double *column = a.scratch;
  memset(gradient, 0, RIM_GP_PARAMETERS(c->dims) * sizeof *gradient);
  for (uint32_t i = 0; i < gp->n; ++i) {
    /* 1/2 tr((alpha alpha^T - K^-1) dK), the pairs j < i counted twice */
    inverse_column(gp, i, column);
    const double *xi = a.x + (size_t)i * c->dims;
    for (uint32_t j = 0; j < i; ++j) {
      const double *xj = a.x + (size_t)j * c->dims;
      const double weight = c->signal_var * (a.alpha[i] * a.alpha[j] - column[j]);
      const double r2 = distance2(gp, xi, xj);
      gradient[0] += weight * correlation(c->kernel, r2);
      const double slope = weight * correlation_slope(c->kernel, r2);
      for (size_t d = 0; d < c->dims; ++d) {
        const double step = (xi[d] - xj[d]) * gp->inverse_length[d];
        if (!(slope >= 0.0 && slope <= 0.0))
          gradient[2 + d] += slope * (step * step);
      }
    }
    const double weight = 0.5 * (a.alpha[i] * a.alpha[i] - column[i]);
    gradient[0] += c->signal_var * weight;
    gradient[1] += c->noise_var * weight;
  }
}

static bool factor(rim_gp *gp) {
  for (uint32_t i = 0; i < gp->n; ++i) {
    if (!append_row(gp, i))
      return false;
  }
  return true;
}

rim_status rim_gp_set_config(rim_gp *gp, const rim_gp_config *config) {
  if (gp == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  rim_gp_config c = *config;
  const rim_status status = complete(&c);
  if (status != RIM_OK)
    return status;
  if (c.dims != gp->config.dims || c.points != gp->config.points)
    return RIM_E_CONFIG;
  const rim_gp_config before = gp->config;
  const uint32_t jittered = gp->counters.jittered;
  set_config(gp, &c);
  const bool fine = factor(gp);
  if (!fine) {
    set_config(gp, &before);
    (void)factor(gp);
    count(&gp->counters.singular);
    gp->counters.jittered = jittered;
  }
  solve_alpha(gp);
  return fine ? RIM_OK : RIM_E_SINGULAR;
}
