/* SPDX-License-Identifier: MIT */
/* The nominal model is predicted from sections built here by hand, against sums written out in the
 * plainest way, and refused in every damaged form. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/rng.h"
#include "image/nominal.h"

enum { D = 3, O = 2, P = 5, K = 3 };
#define SEED 4121u
#define BYTES RIM_NOMINAL_BYTES(D, O, P, 1)

typedef struct section {
  _Alignas(8) uint8_t byte[BYTES + 16u];
  size_t bytes;
} section;

typedef struct plain {
  double centre[D], inverse_scale[D], gate_weight[D];
  double h[P], reach[P], ln_mass[P], c[P][D], variance[P][O], b[P][O], a[P][O][D];
} plain;

static void put_u32(section *s, size_t word, uint32_t v) {
  for (unsigned i = 0; i < 4; ++i) {
    s->byte[4 * word + i] = (uint8_t)(v >> (8 * i));
  }
}

static void put_f32(section *s, size_t word, double v) {
  const float f = (float)v;
  uint32_t bits;
  memcpy(&bits, &f, sizeof bits);
  put_u32(s, word, bits);
}

static double single(double v) { return (double)(float)v; }

static void make_plain(plain *m, uint64_t stream) {
  rim_rng r;
  rimi_rng_seed(&r, SEED, stream);
  for (int i = 0; i < D; ++i) {
    m->centre[i] = single(10.0 * rimi_rng_normal(&r));
    m->inverse_scale[i] = single(0.5 + rimi_rng_uniform(&r));
    m->gate_weight[i] = i == D - 1 ? 0.0 : single(0.5 + rimi_rng_uniform(&r));
  }
  for (int p = 0; p < P; ++p) {
    m->h[p] = single(0.5 + rimi_rng_uniform(&r));
    m->reach[p] = single(1.0 + rimi_rng_uniform(&r));
    m->ln_mass[p] = single(rimi_rng_normal(&r));
    for (int i = 0; i < D; ++i) {
      m->c[p][i] = single(rimi_rng_normal(&r));
    }
    for (int o = 0; o < O; ++o) {
      m->variance[p][o] = single(0.1 + rimi_rng_uniform(&r));
      m->b[p][o] = single(rimi_rng_normal(&r));
      for (int i = 0; i < D; ++i) {
        m->a[p][o][i] = single(rimi_rng_normal(&r));
      }
    }
  }
}

static void make_section(section *s, const plain *m, uint32_t order) {
  const uint32_t header[8] = {RIM_NOMINAL_LAYOUT, D, O, P, K, order, 0, 0};
  size_t at = 0;
  memset(s, 0, sizeof *s);
  for (; at < 8; ++at) {
    put_u32(s, at, header[at]);
  }
  const double *inputs[3] = {m->centre, m->inverse_scale, m->gate_weight};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < D; ++i) {
      put_f32(s, at++, inputs[k][i]);
    }
  }
  for (int p = 0; p < P; ++p) {
    put_f32(s, at++, m->h[p]);
    put_f32(s, at++, m->reach[p]);
    put_f32(s, at++, m->ln_mass[p]);
    put_u32(s, at++, 0);
    for (int i = 0; i < D; ++i) {
      put_f32(s, at++, m->c[p][i]);
    }
    for (int o = 0; o < O; ++o) {
      put_f32(s, at++, m->variance[p][o]);
    }
    for (int o = 0; o < O; ++o) {
      put_f32(s, at++, m->b[p][o]);
    }
    for (int o = 0; order != 0 && o < O; ++o) {
      for (int i = 0; i < D; ++i) {
        put_f32(s, at++, m->a[p][o][i]);
      }
    }
  }
  s->bytes = 4 * at;
}

/* Eq. 4.13 and 4.14 over the K largest weights, by sorting and libm. */
static void predict_plainly(const plain *m, int order, const double *x, double *mean, double *sd,
                            double *extrapolation) {
  double xs[D], logit[P], weight[P], nearest = INFINITY, sum = 0.0;
  int chosen[P] = {0};
  for (int i = 0; i < D; ++i) {
    xs[i] = (x[i] - m->centre[i]) * m->inverse_scale[i];
  }
  for (int p = 0; p < P; ++p) {
    double d2 = 0.0;
    for (int i = 0; i < D; ++i) {
      d2 += pow(m->gate_weight[i] * (xs[i] - m->c[p][i]), 2.0);
    }
    logit[p] = m->ln_mass[p] - d2 / (2.0 * m->h[p] * m->h[p]);
    if (d2 < nearest) {
      nearest = d2;
      *extrapolation = sqrt(d2) / m->reach[p];
    }
  }
  for (int k = 0; k < K; ++k) {
    int best = -1;
    for (int p = 0; p < P; ++p) {
      best = !chosen[p] && (best < 0 || logit[p] > logit[best]) ? p : best;
    }
    chosen[best] = 1;
  }
  for (int p = 0; p < P; ++p) {
    weight[p] = chosen[p] ? exp(logit[p]) : 0.0;
    sum += weight[p];
  }
  for (int o = 0; o < O; ++o) {
    double value[P], mu = 0.0, var = 0.0;
    for (int p = 0; p < P; ++p) {
      value[p] = m->b[p][o];
      for (int i = 0; order != 0 && i < D; ++i) {
        value[p] += m->a[p][o][i] * xs[i];
      }
      mu += weight[p] / sum * value[p];
    }
    for (int p = 0; p < P; ++p) {
      const double spread = order != 0 ? 0.0 : value[p] - mu;
      var += weight[p] / sum * (m->variance[p][o] + spread * spread);
    }
    mean[o] = mu;
    sd[o] = sqrt(var);
  }
}

static void predicts_as_the_equations_say(void **state) {
  (void)state;
  print_message("seed %u\n", SEED);
  for (uint32_t trial = 0; trial < 400; ++trial) {
    plain m;
    section s;
    rim_nominal model;
    rim_rng r;
    double x[D], mean[O], sd[O], far, mean_plain[O], sd_plain[O], far_plain = 0.0;
    make_plain(&m, trial);
    make_section(&s, &m, trial & 1u);
    assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
    assert_int_equal(s.bytes, RIM_NOMINAL_BYTES(D, O, P, trial & 1u));
    rimi_rng_seed(&r, SEED, 1000u + trial);
    for (int i = 0; i < D; ++i) {
      x[i] = m.centre[i] + 2.0 * rimi_rng_normal(&r) / m.inverse_scale[i];
    }
    assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, &far), RIM_OK);
    predict_plainly(&m, (int)(trial & 1u), x, mean_plain, sd_plain, &far_plain);
    assert_true(fabs(far - far_plain) <= 1e-12 * far_plain);
    for (int o = 0; o < O; ++o) {
      assert_true(fabs(mean[o] - mean_plain[o]) <= 1e-11 * (1.0 + fabs(mean_plain[o])));
      assert_true(fabs(sd[o] - sd_plain[o]) <= 1e-11 * sd_plain[o]);
    }
  }
}

/* Every plain weight underflows there: the prediction must be the nearest prototype's, not 0/0. */
static void far_from_all_the_nearest_speaks(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  double x[D], mean[O], sd[O], far;
  make_plain(&m, 7);
  for (int p = 0; p < P; ++p) {
    m.h[p] = 1.0; /* or the widest would speak, not the nearest */
  }
  make_section(&s, &m, 0);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  for (int i = 0; i < D; ++i) {
    x[i] = m.centre[i];
  }
  x[0] += 1e5 / m.inverse_scale[0];
  int nearest = 0;
  for (int p = 1; p < P; ++p) {
    nearest = m.c[p][0] > m.c[nearest][0] ? p : nearest;
  }
  assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, &far), RIM_OK);
  assert_true(far > 1e3);
  for (int o = 0; o < O; ++o) {
    assert_true(mean[o] == m.b[nearest][o]);
    assert_true(fabs(sd[o] * sd[o] - m.variance[nearest][o]) < 1e-12);
  }
}

/* Beyond what was trained by the other inputs: the output's own does not count. */
static void what_lies_beyond_is_told(void **state) {
  (void)state;
  const uint16_t own[O] = {0, 1};
  unsigned told[O][2] = {{0, 0}, {0, 0}};
  rim_rng r;
  rimi_rng_seed(&r, SEED, 99);
  for (uint64_t stream = 0; stream < 40; ++stream) {
    plain m;
    section s;
    rim_nominal model;
    make_plain(&m, stream);
    make_section(&s, &m, 1);
    assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
    double x[D], xs[D];
    bool beyond[O];
    for (int i = 0; i < D; ++i) {
      x[i] = m.centre[i] + 2.0 * rimi_rng_normal(&r) / m.inverse_scale[i];
      xs[i] = (x[i] - m.centre[i]) * m.inverse_scale[i];
    }
    assert_int_equal(rimi_nominal_beyond(&model, x, own, beyond), RIM_OK);
    for (int o = 0; o < O; ++o) {
      double nearest = 1e300, reach = 0.0;
      for (int p = 0; p < P; ++p) {
        double sum = 0.0;
        for (int i = 0; i < D; ++i)
          sum += i == (int)own[o] ? 0.0 : pow(m.gate_weight[i] * (xs[i] - m.c[p][i]), 2.0);
        if (sum < nearest) {
          nearest = sum;
          reach = RIM_NOMINAL_BELIEVED * m.reach[p];
        }
      }
      assert_int_equal(beyond[o], sqrt(nearest) > reach);
      ++told[o][beyond[o]];
    }
    x[0] += 1e6; /* its own reading does not hide an output: the others' are beyond then */
    bool again[O];
    assert_int_equal(rimi_nominal_beyond(&model, x, own, again), RIM_OK);
    assert_true(again[0] == beyond[0] && again[1]);
    x[0] = NAN;
    assert_int_equal(rimi_nominal_beyond(&model, x, own, again), RIM_E_DATA);
    x[0] = m.centre[0];
    const rim_nominal none = {0};
    assert_int_equal(rimi_nominal_beyond(NULL, x, own, again), RIM_E_ARGUMENT);
    assert_int_equal(rimi_nominal_beyond(&none, x, own, again), RIM_E_ARGUMENT);
    assert_int_equal(rimi_nominal_beyond(&model, NULL, own, again), RIM_E_ARGUMENT);
    assert_int_equal(rimi_nominal_beyond(&model, x, NULL, again), RIM_E_ARGUMENT);
    assert_int_equal(rimi_nominal_beyond(&model, x, own, NULL), RIM_E_ARGUMENT);
    const uint16_t first[O] = {0, 0}, damaged[O] = {D, 0xffff}; /* an index that was hit is 0 */
    assert_int_equal(rimi_nominal_beyond(&model, x, first, beyond), RIM_OK);
    assert_int_equal(rimi_nominal_beyond(&model, x, damaged, again), RIM_OK);
    assert_memory_equal(again, beyond, sizeof again);
  }
  for (int o = 0; o < O; ++o)
    assert_true(told[o][0] > 5 && told[o][1] > 5);
}

/* As far as its reach it is still believed, to the last bit. */
static void the_end_of_the_reach_is_within(void **state) {
  (void)state;
  const uint16_t own[O] = {0, 0};
  plain m;
  section s;
  rim_nominal model;
  make_plain(&m, 0);
  for (int i = 0; i < D; ++i) {
    m.centre[i] = 0.0;
    m.inverse_scale[i] = m.gate_weight[i] = 1.0;
    for (int p = 0; p < P; ++p)
      m.c[p][i] = p == 0 ? 0.0 : 1000.0;
  }
  m.reach[0] = 2.0;
  make_section(&s, &m, 1);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  double x[D] = {5.0, 2.0 * RIM_NOMINAL_BELIEVED};
  bool beyond[O];
  assert_int_equal(rimi_nominal_beyond(&model, x, own, beyond), RIM_OK);
  assert_false(beyond[0] || beyond[1]);
  x[1] *= 1.0 + 0x1p-20;
  assert_int_equal(rimi_nominal_beyond(&model, x, own, beyond), RIM_OK);
  assert_true(beyond[0] && beyond[1]);
}

static void huge_inputs_are_clamped(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  double x[D] = {1e308, -1e308, 1e308};
  double limit[D], mean[O], sd[O], mean_limit[O], sd_limit[O];
  make_plain(&m, 3);
  make_section(&s, &m, 1);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  for (int i = 0; i < D; ++i) {
    limit[i] =
        m.centre[i] + (x[i] > 0 ? 2.0 : -2.0) * RIM_NOMINAL_MAX_STANDARDISED / m.inverse_scale[i];
  }
  assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, NULL), RIM_OK);
  assert_int_equal(rimi_nominal_predict(&model, limit, mean_limit, sd_limit, NULL), RIM_OK);
  for (int o = 0; o < O; ++o) {
    assert_true(isfinite(mean[o]) && isfinite(sd[o]));
    assert_true(mean[o] == mean_limit[o] && sd[o] == sd_limit[o]);
  }
}

/* Of as many inputs as there may be each counts in a map, and none behind them. */
static void the_most_inputs_are_mapped(void **state) {
  (void)state;
  enum { MOST = RIM_NOMINAL_MAX_INPUTS, WORDS = RIM_NOMINAL_BYTES(MOST, 1, 1, 1) / 4 };
  static uint32_t word[WORDS];
  section one;
  put_f32(&one, 0, 1.0);
  for (size_t i = 0; i < WORDS; ++i)
    memcpy(&word[i], one.byte, 4); /* scales, variance, offset and map are 1 */
  const uint32_t header[8] = {RIM_NOMINAL_LAYOUT, MOST, 1, 1, 1, 1, 0, 0};
  for (size_t i = 0; i < 8; ++i)
    put_u32(&one, i, header[i]);
  memcpy(word, one.byte, sizeof header);
  memset(&word[8], 0, 4 * MOST);         /* centres */
  memset(&word[8 + 3 * MOST + 3], 0, 4); /* reserved */
  rim_nominal model;
  double x[MOST], mean, sd;
  assert_int_equal(rimi_nominal_open(&model, (const uint8_t *)word, sizeof word), RIM_OK);
  for (int i = 0; i < MOST; ++i)
    x[i] = (double)i;
  assert_int_equal(rimi_nominal_predict(&model, x, &mean, &sd, NULL), RIM_OK);
  assert_true(mean == 1.0 + MOST * (MOST - 1) / 2.0 && sd == 1.0);
}

/* Of equally near prototypes the first says how far its training reached. */
static void of_equally_near_the_first_says_how_far(void **state) {
  (void)state;
  const uint16_t own[O] = {0, 0};
  plain m;
  section s;
  rim_nominal model;
  double mean[O], sd[O], far;
  bool beyond[O];
  make_plain(&m, 11);
  for (int i = 0; i < D; ++i) {
    m.centre[i] = 0.0;
    m.inverse_scale[i] = m.gate_weight[i] = 1.0;
  }
  for (int p = 0; p < P; ++p) {
    memset(m.c[p], 0, sizeof m.c[p]);
    m.reach[p] = 2.0 + p;
  }
  make_section(&s, &m, 0);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  const double x[D] = {0.0, 1.8, 0.0}; /* beyond what is believed of the first, of 2, alone */
  assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, &far), RIM_OK);
  assert_true(far == 0.9);
  assert_int_equal(rimi_nominal_beyond(&model, x, own, beyond), RIM_OK);
  assert_true(beyond[0] && beyond[1]);
}

/* Two equal prototypes compete for one place: the lower index must win on every target. */
static void ties_go_to_the_lower_index(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  double x[D], mean[O], sd[O];
  make_plain(&m, 11);
  for (int p = 0; p < P; ++p) {
    memcpy(m.c[p], m.c[0], sizeof m.c[0]);
    m.h[p] = 1.0;
    m.ln_mass[p] = 0.0;
  }
  make_section(&s, &m, 0);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  memcpy(x, m.centre, sizeof x);
  assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, NULL), RIM_OK);
  for (int o = 0; o < O; ++o) {
    const double first = (m.b[0][o] + m.b[1][o] + m.b[2][o]) / 3.0;
    assert_true(fabs(mean[o] - first) < 1e-12);
  }
}

static void bad_input_changes_nothing(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  rim_nominal unopened;
  const double bad[3] = {NAN, INFINITY, -INFINITY};
  double x[D] = {0}, mean[O] = {5.0, 6.0}, sd[O] = {7.0, 8.0}, far = 9.0;
  make_plain(&m, 2);
  make_section(&s, &m, 1);
  memset(&unopened, 0, sizeof unopened);
  assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  for (int i = 0; i < D; ++i) {
    for (int b = 0; b < 3; ++b) {
      memset(x, 0, sizeof x);
      x[i] = bad[b];
      assert_int_equal(rimi_nominal_predict(&model, x, mean, sd, &far), RIM_E_DATA);
    }
  }
  memset(x, 0, sizeof x);
  assert_int_equal(rimi_nominal_predict(NULL, x, mean, sd, &far), RIM_E_ARGUMENT);
  assert_int_equal(rimi_nominal_predict(&unopened, x, mean, sd, &far), RIM_E_ARGUMENT);
  assert_int_equal(rimi_nominal_predict(&model, NULL, mean, sd, &far), RIM_E_ARGUMENT);
  assert_int_equal(rimi_nominal_predict(&model, x, NULL, sd, &far), RIM_E_ARGUMENT);
  assert_int_equal(rimi_nominal_predict(&model, x, mean, NULL, &far), RIM_E_ARGUMENT);
  assert_true(mean[0] == 5.0 && mean[1] == 6.0 && sd[0] == 7.0 && sd[1] == 8.0 && far == 9.0);
}

static rim_status open_with_word(size_t word, uint32_t value, uint32_t order) {
  plain m;
  section s;
  rim_nominal model;
  rim_nominal before;
  make_plain(&m, 5);
  make_section(&s, &m, order);
  put_u32(&s, word, value);
  memset(&model, 0x5a, sizeof model);
  before = model;
  const rim_status status = rimi_nominal_open(&model, s.byte, s.bytes);
  if (status != RIM_OK) {
    assert_memory_equal(&model, &before, sizeof model);
  }
  return status;
}

/* Each count at either end of what is allowed, the others 1; every number 1. */
static void the_least_and_the_most_are_accepted(void **state) {
  (void)state;
  const uint32_t most[4] = {RIM_NOMINAL_MAX_INPUTS, RIM_NOMINAL_MAX_OUTPUTS,
                            RIM_NOMINAL_MAX_PROTOTYPES, RIM_NOMINAL_MAX_TOP};
  static _Alignas(8) uint8_t byte[16384];
  for (size_t k = 0; k < 5; ++k) {
    uint32_t n[4] = {1, 1, 1, 1};
    section header;
    rim_nominal model;
    if (k < 4)
      n[k] = most[k];
    if (k == 3)
      n[2] = most[3]; /* no more at the top than there are */
    const size_t bytes = RIM_NOMINAL_BYTES(n[0], n[1], n[2], 0);
    assert_true(bytes <= sizeof byte);
    put_f32(&header, 1, 1.0);
    put_u32(&header, 0, RIM_NOMINAL_LAYOUT);
    for (size_t at = 0; at < bytes; at += 4)
      memcpy(byte + at, header.byte + 4, 4);
    const uint32_t word[8] = {RIM_NOMINAL_LAYOUT, n[0], n[1], n[2], n[3], 0, 0, 0};
    for (size_t i = 0; i < 8; ++i)
      put_u32(&header, i, word[i]);
    memcpy(byte, header.byte, 32);
    const size_t first = 32 + 12u * n[0], stride = 4u * RIM_NOMINAL_STRIDE(n[0], n[1], 0);
    for (size_t p = 0; p < n[2]; ++p)
      memset(byte + first + p * stride + 12, 0, 4); /* reserved */
    assert_int_equal(rimi_nominal_open(&model, byte, bytes), RIM_OK);
    assert_true(model.inputs == n[0] && model.outputs == n[1] && model.prototypes == n[2] &&
                model.top == n[3]);
    assert_int_equal(rimi_nominal_open(&model, byte, bytes - 1), RIM_E_TRUNCATED);
  }
}

static void damaged_headers_are_refused(void **state) {
  (void)state;
  assert_int_equal(open_with_word(0, RIM_NOMINAL_LAYOUT + 1u, 1), RIM_E_VERSION);
  const uint32_t beyond[8] = {0,
                              RIM_NOMINAL_MAX_INPUTS + 1u,
                              RIM_NOMINAL_MAX_OUTPUTS + 1u,
                              RIM_NOMINAL_MAX_PROTOTYPES + 1u,
                              RIM_NOMINAL_MAX_TOP + 1u,
                              2,
                              1,
                              1};
  for (size_t word = 1; word < 8; ++word) {
    assert_int_equal(open_with_word(word, beyond[word], 1), RIM_E_RANGE);
    assert_int_equal(open_with_word(word, UINT32_MAX, 1), RIM_E_RANGE);
  }
  for (size_t word = 1; word < 5; ++word) {
    assert_int_equal(open_with_word(word, 0, 1), RIM_E_RANGE);
  }
  assert_int_equal(open_with_word(4, P + 1u, 1), RIM_E_RANGE);
  assert_int_equal(open_with_word(1, D + 1u, 1), RIM_E_TRUNCATED);
  assert_int_equal(open_with_word(3, P - 1u, 1), RIM_E_SIZE);
}

static void values_that_break_the_arithmetic_are_refused(void **state) {
  (void)state;
  const uint32_t nan_bits = 0x7fc00000u, inf_bits = 0x7f800000u, minus_one = 0xbf800000u;
  const size_t first = RIM_NOMINAL_HEADER_WORDS;
  const size_t stride = RIM_NOMINAL_STRIDE(D, O, 1);
  for (size_t word = first; word < BYTES / 4u; ++word) {
    const size_t in = word < first + 3u * D ? 0 : (word - first - 3u * D) % stride;
    const int is_prototype = word >= first + 3u * D;
    const int is_scale = !is_prototype && word >= first + D && word < first + 2u * D;
    const int is_gate = !is_prototype && word >= first + 2u * D;
    const int is_width = is_prototype && in < 2;
    const int is_reserved = is_prototype && in == 3;
    const int is_variance = is_prototype && in >= 4u + D && in < 4u + D + O;
    const int positive = is_scale || is_width || is_variance;
    assert_int_equal(open_with_word(word, nan_bits, 1), RIM_E_DATA);
    assert_int_equal(open_with_word(word, inf_bits, 1), RIM_E_DATA);
    assert_int_equal(open_with_word(word, 0, 1), positive ? RIM_E_DATA : RIM_OK);
    assert_int_equal(open_with_word(word, minus_one, 1),
                     positive || is_gate || is_reserved ? RIM_E_DATA : RIM_OK);
  }
}

/* What the first word says is looked at where the header is whole, and not before. */
static void a_header_alone_says_its_layout(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  make_plain(&m, 6);
  make_section(&s, &m, 0);
  put_u32(&s, 0, RIM_NOMINAL_LAYOUT + 1u);
  const size_t header = 4 * RIM_NOMINAL_HEADER_WORDS;
  assert_int_equal(rimi_nominal_open(&model, s.byte, header), RIM_E_VERSION);
  assert_int_equal(rimi_nominal_open(&model, s.byte, header - 1), RIM_E_TRUNCATED);
}

static void any_other_length_is_refused(void **state) {
  (void)state;
  for (uint32_t order = 0; order < 2; ++order) {
    plain m;
    section s;
    rim_nominal model;
    make_plain(&m, 6);
    make_section(&s, &m, order);
    for (size_t bytes = 0; bytes < s.bytes; ++bytes) {
      assert_int_equal(rimi_nominal_open(&model, s.byte, bytes), RIM_E_TRUNCATED);
    }
    assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes + 1), RIM_E_SIZE);
    assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
  }
}

/* As many prototypes speak as may, of nine eight, whether the heaviest come last or first. All lie
 * at 0, and the n-th heaviest has weight and offset 10 - n. The lightest is left out: the mean is
 * (4 + 9 + ... + 81) / 44 = 284 / 44, the variance 1 + (8 + 27 + ... + 729) / 44 - mean^2. */
static void the_heaviest_eight_of_nine_speak(void **state) {
  (void)state;
  enum { NINE = 9, BYTES_OF_NINE = RIM_NOMINAL_BYTES(1, 1, NINE, 0) };
  for (int heaviest_first = 0; heaviest_first < 2; ++heaviest_first) {
    section s = {.bytes = BYTES_OF_NINE};
    const uint32_t header[8] = {RIM_NOMINAL_LAYOUT, 1, 1, NINE, RIM_NOMINAL_MAX_TOP, 0, 0, 0};
    size_t at = 0;
    for (; at < 8; ++at)
      put_u32(&s, at, header[at]);
    const double input[3] = {0.0, 1.0, 1.0}; /* centre, inverse scale, gate's weight */
    for (int i = 0; i < 3; ++i)
      put_f32(&s, at++, input[i]);
    for (int p = 0; p < NINE; ++p) {
      const double weight = heaviest_first ? NINE - p : p + 1.0;
      /* bandwidth, reach, ln mass, 0, centre, variance, offset */
      const double of_p[7] = {1.0, 1.0, log(weight), 0.0, 0.0, 1.0, weight};
      for (int i = 0; i < 7; ++i)
        put_f32(&s, at++, of_p[i]);
    }
    rim_nominal model;
    double x = 0.0, mean, sd, far;
    assert_int_equal(4 * at, BYTES_OF_NINE);
    assert_int_equal(rimi_nominal_open(&model, s.byte, s.bytes), RIM_OK);
    assert_int_equal(rimi_nominal_predict(&model, &x, &mean, &sd, &far), RIM_OK);
    const double expected = 284.0 / 44.0;
    assert_true(fabs(mean - expected) < 1e-6);
    assert_true(fabs(sd * sd - (1.0 + 46.0 - expected * expected)) < 1e-5);
  }
}

static void misuse_is_refused(void **state) {
  (void)state;
  plain m;
  section s;
  rim_nominal model;
  make_plain(&m, 6);
  make_section(&s, &m, 1);
  assert_int_equal(rimi_nominal_open(NULL, s.byte, s.bytes), RIM_E_ARGUMENT);
  assert_int_equal(rimi_nominal_open(&model, NULL, s.bytes), RIM_E_ARGUMENT);
  for (size_t shift = 1; shift < 4; ++shift) {
    assert_int_equal(rimi_nominal_open(&model, s.byte + shift, s.bytes), RIM_E_ALIGN);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(predicts_as_the_equations_say),
      cmocka_unit_test(far_from_all_the_nearest_speaks),
      cmocka_unit_test(what_lies_beyond_is_told),
      cmocka_unit_test(the_end_of_the_reach_is_within),
      cmocka_unit_test(huge_inputs_are_clamped),
      cmocka_unit_test(the_most_inputs_are_mapped),
      cmocka_unit_test(of_equally_near_the_first_says_how_far),
      cmocka_unit_test(ties_go_to_the_lower_index),
      cmocka_unit_test(bad_input_changes_nothing),
      cmocka_unit_test(the_least_and_the_most_are_accepted),
      cmocka_unit_test(damaged_headers_are_refused),
      cmocka_unit_test(values_that_break_the_arithmetic_are_refused),
      cmocka_unit_test(a_header_alone_says_its_layout),
      cmocka_unit_test(any_other_length_is_refused),
      cmocka_unit_test(the_heaviest_eight_of_nine_speak),
      cmocka_unit_test(misuse_is_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
