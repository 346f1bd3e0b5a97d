/* SPDX-License-Identifier: MIT */
/* rolled: the states of section BASIS follow the differential equations that their rates say,
 * within their limits; damaged rates are refused. */
#include <math.h>

#include "base/bytes.h"
#include "image/rolled.h"
#include "section_bytes.h"

enum { FEATURES = 2, OUTCOMES = 3, INPUTS = 2, STATES = 2 };
#define TAU_S                                                                                      \
  6.0 /* 1 / 6 as a float ends in bits that are a code of a state: nobody may read them so */
#define DRAG 0.25
#define BLOCK_S 0.0625
#define LIMIT 6.0

/* A temperature (outcome 2) that settles at input 0, and a speed (outcome 0) of either sign that
 * input 1 pushes, against a drag that grows with its square, and the temperature. */
static const uint16_t rate[][4] = {{0, 0, BASIS_PLAIN, BASIS_PLAIN},
                                   {0, BASIS_PLAIN, BASIS_STATE + 0, BASIS_PLAIN},
                                   {1, BASIS_PLAIN, BASIS_PLAIN, 1},
                                   {1, BASIS_STATE + 1, BASIS_PLAIN, BASIS_STATE_MAGNITUDE + 1},
                                   {1, 1, BASIS_STATE + 0, BASIS_PLAIN},
                                   {1, BASIS_PLAIN, BASIS_PLAIN, BASIS_PLAIN}};
enum { RATES = sizeof rate / sizeof *rate };
static const double weight[RATES] = {1.0 / TAU_S, -1.0 / TAU_S, 1.0, -DRAG, 0.03125, -0.125};
enum { FIRST_AT = 32 + 4 * INPUTS + 4, STATE_AT = FIRST_AT + 4 * OUTCOMES };
enum { LIMIT_AT = STATE_AT + 4, RATE_AT = LIMIT_AT + 8 * STATES, WEIGHT_AT = RATE_AT + 8 * RATES };

static bytes section(void) {
  bytes b = {.size = 0};
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, 1, 0, 0, 0, STATES, RATES};
  for (size_t i = 0; i < 8; ++i)
    u32(&b, header[i]);
  for (unsigned i = 0; i < INPUTS; ++i) {
    u16(&b, i);
    u16(&b, BASIS_PLAIN);
  }
  f32(&b, 1.0);
  for (size_t o = 0; o < OUTCOMES; ++o)
    f32(&b, 0.0);
  u16(&b, 2);
  u16(&b, 0);
  for (size_t s = 0; s < STATES; ++s) {
    f32(&b, -LIMIT);
    f32(&b, LIMIT);
  }
  for (size_t i = 0; i < 4 * RATES; ++i)
    u16(&b, rate[i / 4][i % 4]);
  for (size_t q = 0; q < RATES; ++q)
    f32(&b, weight[q]);
  return b;
}

static rim_status status_of(const bytes *b) {
  rim_basis view;
  return rimi_basis_open(&view, b->byte, b->size, FEATURES, OUTCOMES);
}

static void input_at(double t_s, double *u) {
  u[0] = 3.0 + sin(0.3 * t_s);
  u[1] = 1.5 * cos(0.2 * t_s);
}

/* The same equations in steps a thousand times as short. */
static void integrate(double from_s, double to_s, double *z) {
  const double dt = 1e-3 * BLOCK_S;
  const long steps = lround((to_s - from_s) / dt);
  for (long k = 0; k < steps; ++k) {
    double u[INPUTS];
    input_at(from_s + ((double)k + 0.5) * dt, u);
    const double warm = (u[0] - z[0]) / TAU_S;
    const double push = u[1] - DRAG * z[1] * fabs(z[1]) + 0.03125 * u[1] * z[0] - 0.125;
    z[0] += dt * warm;
    z[1] += dt * push;
  }
}

static void states_follow_their_equations(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(b.size, WEIGHT_AT + 4 * RATES);
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_true(v.states == STATES && v.rates == RATES && rimi_le_u16(v.state, 0) == 2);
  double part[RATES], z[STATES] = {1.0, -2.0}, exact[STATES] = {1.0, -2.0}, u[INPUTS];
  input_at(0.5 * BLOCK_S, u);
  rimi_rolled_begin(&v, u, BLOCK_S, z, part);
  integrate(0.0, 0.5 * BLOCK_S, exact);
  for (uint32_t n = 1; n < 800; ++n) {
    const double t_s = (n + 0.5) * BLOCK_S;
    input_at(t_s, u);
    rimi_rolled_step(&v, u, 0.5, BLOCK_S, BLOCK_S, z, part);
    integrate(t_s - BLOCK_S, t_s, exact);
    for (size_t s = 0; s < STATES; ++s) {
      if (!(fabs(z[s] - exact[s]) < 2e-3))
        fail_msg("block %u, state %zu: %.6f instead of %.6f", n, s, z[s], exact[s]);
    }
  }
  assert_true(exact[1] * exact[1] > 0.5); /* it was not at rest */
}

/* What a short gap left out is integrated in parts, so that a state stays on its equation: one step
 * of two and a half blocks is two of half as much, where the commands stay as they are. */
static void a_long_step_is_two(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  const double u[INPUTS] = {3.0, 1.0}, block[] = {BLOCK_S, 2.0}; /* blocks below and above 1 s */
  for (size_t k = 0; k < 2; ++k) {
    const double long_s = 2.5 * block[k];
    double part[RATES], once[STATES] = {1.0, -2.0}, twice[STATES] = {1.0, -2.0};
    rimi_rolled_begin(&v, u, block[k], once, part);
    rimi_rolled_begin(&v, u, block[k], twice, part);
    const double before = once[0];
    rimi_rolled_step(&v, u, 0.5, long_s, block[k], once, part);
    for (int half = 0; half < 2; ++half)
      rimi_rolled_step(&v, u, 0.5, 0.5 * long_s, block[k], twice, part);
    assert_true(once[0] == twice[0] && once[1] == twice[1] && once[0] > before && once[0] < LIMIT);
  }
}

/* Where rows were missing at its end, a block is longer than the other. Each counts by its share of
 * the time: a state that adds up its input is that sum from middle to middle, to rounding. */
static void a_longer_block_counts_for_more(void **unused) {
  (void)unused;
  bytes rates = {.size = 0}, numbers = {.size = 0};
  const uint16_t sums[4] = {0, 0, BASIS_PLAIN, BASIS_PLAIN};
  for (size_t i = 0; i < 4; ++i)
    u16(&rates, sums[i]);
  f32(&numbers, 0.5);
  f32(&numbers, -100.0);
  f32(&numbers, 100.0);
  const rim_basis v = {.inputs = 1,
                       .times = 1,
                       .states = 1,
                       .rates = 1,
                       .rate = rates.byte,
                       .weight = numbers.byte,
                       .limit = numbers.byte + 4};
  const double before = 3.0, now = -8.0, longer_s = 1.5;
  double part[1], z[1] = {0.0};
  rimi_rolled_begin(&v, &before, 1.0, z, part);
  assert_true(fabs(z[0] - 0.5 * 0.5 * 3.0) < 1e-12);
  rimi_rolled_step(&v, &now, longer_s / (1.0 + longer_s), 0.5 * (1.0 + longer_s), 1.0, z, part);
  assert_true(fabs(z[0] - 0.5 * (3.0 + 0.5 * longer_s * -8.0)) < 1e-12);
}

/* What is not known of a state after missing rows: its input went from one value to another, at a
 * time that is as likely as any other. Two gaps are as independent as their variances. */
static void missing_rows_add_variance(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  const double from[INPUTS] = {3.0, 1.0}, to[INPUTS] = {5.0, -1.0}, state[STATES] = {2.0, 0.5};
  double variance[STATES] = {0.0};
  rimi_rolled_lose(&v, from, from, 4.0, state, variance);
  assert_true(variance[0] == 0.0 && variance[1] == 0.0);
  rimi_rolled_lose(&v, from, to, 4.0, state, variance);
  const double warm = 0.29 * 4.0 * 2.0 / TAU_S, push = 0.29 * 4.0 * -2.0;
  assert_true(fabs(variance[0] - warm * warm) < 1e-6 * warm * warm);
  const double of_product = push * 0.03125 * state[0], both = push * push + of_product * of_product;
  assert_true(fabs(variance[1] - both) < 1e-6 * both);
  rimi_rolled_lose(&v, to, from, 4.0, state, variance);
  assert_true(fabs(variance[1] - 2.0 * both) < 1e-6 * both);
}

/* Two runs under the same commands that begin apart come together as far as the states forget, and
 * are never farther apart than is said. The temperature forgets as fast as it settles, whatever the
 * speed does; the speed forgets by its drag, of either sign, but for what the temperature adds. */
static void an_error_is_forgotten_as_states_forget(void **unused) {
  (void)unused;
  enum { BLOCKS = 400 };
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  for (int sign = -1; sign <= 1; sign += 2) {
    double part[RATES], other_part[RATES], u[INPUTS];
    double z[STATES] = {1.0, 2.0 * sign}, other[STATES] = {1.01, 2.0 * sign + 0.02};
    double variance[STATES] = {0.01 * 0.01, 0.02 * 0.02}, kept[STATES] = {1.0, 1.0};
    input_at(0.5 * BLOCK_S, u);
    rimi_rolled_begin(&v, u, BLOCK_S, z, part);
    rimi_rolled_begin(&v, u, BLOCK_S, other, other_part);
    for (uint32_t n = 1; n <= BLOCKS; ++n) {
      input_at((n + 0.5) * BLOCK_S, u);
      rimi_rolled_step(&v, u, 0.5, BLOCK_S, BLOCK_S, z, part);
      rimi_rolled_step(&v, u, 0.5, BLOCK_S, BLOCK_S, other, other_part);
      rimi_rolled_forget(&v, part, z, BLOCK_S, variance, kept);
      for (size_t s = 0; s < STATES; ++s)
        assert_true(fabs(other[s] - z[s]) < 1.02 * sqrt(variance[s]));
      const double left = exp(-(double)n * BLOCK_S / TAU_S);
      assert_true(fabs(kept[0] - left) < 0.03 * left);
      assert_true(fabs(sqrt(variance[0]) - 0.01 * kept[0]) < 1e-9);
    }
    assert_true(kept[1] < 1e-3 && kept[1] > 0.0);
    assert_true(sqrt(variance[1]) < 0.002 && sqrt(variance[1]) > 0.02 * kept[1]);
  }
}

/* What only adds up is never forgotten, and what grows is no more than not known. */
static void a_sum_forgets_nothing(void **unused) {
  (void)unused;
  bytes b = section();
  for (size_t q = 0; q < RATES; ++q)
    put_f32(b.byte + WEIGHT_AT + 4 * q, q == 3 ? 4.0 : 0.0); /* the drag pushes */
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  double part[RATES] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  double z[STATES] = {1.0, 3.0}, variance[STATES] = {4.0, 1.0}, kept[STATES] = {0.5, 0.5};
  rimi_rolled_forget(&v, part, z, 0.25, variance, kept);
  assert_true(variance[0] == 4.0 && kept[0] == 0.5);
  assert_true(variance[1] == 49.0 && kept[1] == 1.0); /* 2 weight z, a quarter of a second */
  for (int n = 0; n < 1000; ++n)
    rimi_rolled_forget(&v, part, z, 0.25, variance, kept);
  assert_true(variance[1] == 1e100 && kept[1] == 1.0);
}

/* As many states as there may be: each decays by itself, from another height, and of the two kinds
 * of factors either names each of them. */
static void every_state_may_be_a_factor(void **unused) {
  (void)unused;
  enum { ALL = BASIS_MAX_STATES };
  const unsigned kind[] = {BASIS_STATE, BASIS_STATE_MAGNITUDE};
  for (size_t k = 0; k < 2; ++k) {
    bytes rates = {.size = 0}, numbers = {.size = 0};
    for (unsigned s = 0; s < ALL; ++s) {
      u16(&rates, s);
      u16(&rates, BASIS_PLAIN);
      u16(&rates, kind[k] + s);
      u16(&rates, BASIS_PLAIN);
      f32(&numbers, -0.5);
    }
    const size_t limit_at = numbers.size;
    for (unsigned s = 0; s < 2 * ALL; ++s)
      f32(&numbers, s % 2 == 0 ? -100.0 : 100.0);
    const rim_basis v = {.states = ALL,
                         .rates = ALL,
                         .rate = rates.byte,
                         .weight = numbers.byte,
                         .limit = numbers.byte + limit_at};
    double z[ALL], part[ALL];
    for (unsigned s = 0; s < ALL; ++s)
      z[s] = 1.0 + s;
    rimi_rolled_begin(&v, NULL, 1.0, z, part);
    rimi_rolled_step(&v, NULL, 0.5, 1.0, 1.0, z, part);
    for (unsigned s = 0; s < ALL; ++s) /* by the midpoint rule, of half a block and a whole one */
      assert_true(fabs(z[s] - (1.0 + s) * (1.0 - 0.25 + 0.03125) * (1.0 - 0.5 + 0.125)) < 1e-12);
  }
}

/* After a gap one step goes no farther than ROLLED_LONGEST; no state leaves its limits. */
static void gaps_and_limits_hold(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  const double u[INPUTS] = {3.0, 1.0}, huge[INPUTS] = {-1e9, 1e9};
  double part[RATES], z[STATES] = {1.0, 0.0}, two[STATES] = {1.0, 0.0}, other[RATES];
  rimi_rolled_begin(&v, u, BLOCK_S, z, part);
  rimi_rolled_begin(&v, u, BLOCK_S, two, other);
  rimi_rolled_step(&v, u, 0.5, 1e6, BLOCK_S, z, part);
  rimi_rolled_step(&v, u, 0.5, ROLLED_LONGEST * BLOCK_S, BLOCK_S, two, other);
  assert_true(z[0] == two[0] && z[1] == two[1] && z[0] > 1.0);
  for (size_t k = 0; k < 3; ++k)
    rimi_rolled_step(&v, huge, 0.5, BLOCK_S, BLOCK_S, z, part);
  assert_true(z[0] == -LIMIT && z[1] == LIMIT);
  const double without_end[INPUTS] = {3.0, 1e308}; /* its products are infinite, and no number */
  rimi_rolled_step(&v, without_end, 0.5, BLOCK_S, BLOCK_S, z, part);
  rimi_rolled_step(&v, without_end, 0.5, BLOCK_S, BLOCK_S, z, part);
  assert_true(z[0] >= -LIMIT && z[0] <= LIMIT && z[1] >= -LIMIT && z[1] <= LIMIT);
}

/* After a longer gap states go on from where the readings moved them, within the limits, and the
 * next step knows the commands of both blocks. */
static void states_resume_after_a_gap(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  const double u[INPUTS] = {3.0, 1.0}, later[INPUTS] = {-2.0, 0.5};
  double part[RATES], expected[RATES], z[STATES] = {1.0, 0.0}, unmoved[STATES] = {0.0, 0.0};
  rimi_rolled_begin(&v, u, BLOCK_S, z, part);
  const double from[STATES] = {z[0], z[1]}, moved[STATES] = {0.75, -0.5};
  rimi_rolled_resume(&v, later, moved, z, part);
  for (size_t s = 0; s < STATES; ++s)
    assert_true(z[s] == from[s] + moved[s]);
  rimi_rolled_begin(&v, later, BLOCK_S, unmoved, expected);
  assert_memory_equal(part, expected, sizeof part);
  const double far[STATES] = {1e9, -1e9};
  rimi_rolled_resume(&v, later, far, z, part);
  assert_true(z[0] == LIMIT && z[1] == -LIMIT);
}

/* Counts that an upset made smaller after the section was read: what they do not hold is taken from
 * the first place, and nothing is read beyond. */
static void smaller_counts_stay_inside(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis whole;
  assert_int_equal(rimi_basis_open(&whole, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  rim_basis v = whole;
  v.inputs = 1;
  const double one[1] = {1.5}, twice[INPUTS] = {1.5, 1.5};
  double z[STATES] = {1.0, -2.0}, same[STATES] = {1.0, -2.0}, part[RATES];
  rimi_rolled_begin(&v, one, BLOCK_S, z, part);
  rimi_rolled_begin(&whole, twice, BLOCK_S, same, part);
  assert_memory_equal(z, same, sizeof z);
  v.inputs = 0; /* no filters: each counts as 1 */
  const double ones[INPUTS] = {1.0, 1.0};
  rimi_rolled_begin(&v, NULL, BLOCK_S, z, part);
  rimi_rolled_begin(&whole, ones, BLOCK_S, same, part);
  assert_memory_equal(z, same, sizeof z);
  v = whole;
  v.times = 2; /* that many filters of each input: their first are those that are named */
  const double four[2 * INPUTS] = {3.0, 0.5, 7.0, 9.0};
  rimi_rolled_begin(&v, four, BLOCK_S, z, part);
  rimi_rolled_begin(&whole, four, BLOCK_S, same, part);
  assert_memory_equal(z, same, sizeof z);
  v = whole;
  v.states = 1;
  double first = 1.0;
  rimi_rolled_begin(&v, ones, BLOCK_S, &first, part);
  assert_true(rimi_is_finite(first) && fabs(first) <= LIMIT);
  v.states = 0;
  assert_true(rimi_rolled_term(&v, 0, ones, NULL) == 0.0);
  v = whole;
  v.times = 2;
  bytes last = {.size = 0}; /* a term of the last of the filters */
  u16(&last, BASIS_ROLLED);
  u16(&last, 1);
  u16(&last, 2 * INPUTS - 1);
  u16(&last, BASIS_PLAIN);
  v.term = last.byte;
  assert_true(rimi_rolled_term(&v, 0, four, z) == z[1] * four[2 * INPUTS - 1]);
}

/* A term that was hit: an index that is just too large is none, and nothing is read there. */
static void an_index_that_was_hit_is_plain(void **unused) {
  (void)unused;
  const bytes b = section();
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  static const uint16_t code[][2] = {
      {BASIS_PLAIN, STATES}, {BASIS_PLAIN, BASIS_HINGE + BASIS_HINGES}, {INPUTS, BASIS_PLAIN}};
  const double u[INPUTS + 1] = {0.5, -2.0, 77.0}, z[STATES + 1] = {4.0, 3.0, 77.0};
  for (size_t i = 0; i < sizeof code / sizeof *code; ++i) {
    bytes term = {.size = 0};
    u16(&term, BASIS_ROLLED);
    u16(&term, 1);
    u16(&term, code[i][0]);
    u16(&term, code[i][1]);
    v.term = term.byte;
    assert_true(rimi_rolled_term(&v, 0, u, z) == 3.0);
  }
}

static void damaged_rates_are_refused(void **unused) {
  (void)unused;
  const bytes good = section();
  only_the_whole_opens(status_of, &good, RIM_E_SIZE);
  static const struct {
    size_t at;
    unsigned value;
  } bad[] = {{STATE_AT, OUTCOMES},
             {STATE_AT + 2, 0xffff},
             {RATE_AT, STATES},
             {RATE_AT + 2, INPUTS},
             {RATE_AT + 4, BASIS_STATE - 1},
             {RATE_AT + 6, BASIS_STATE + STATES},
             {RATE_AT + 8 * (RATES - 1) + 6, BASIS_STATE_MAGNITUDE + STATES},
             {RATE_AT + 8 * (RATES - 1) + 4, BASIS_PLAIN - 1}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    bytes b = good;
    put_u16(b.byte + bad[i].at, bad[i].value);
    assert_int_equal(status_of(&b), RIM_E_RANGE);
  }
  bytes b = good;
  put_f32(b.byte + LIMIT_AT, LIMIT); /* a state that may not move */
  assert_int_equal(status_of(&b), RIM_OK);
  put_f32(b.byte + LIMIT_AT, 2.0 * LIMIT); /* the lowest above the highest */
  assert_int_equal(status_of(&b), RIM_E_RANGE);
  static const size_t number[] = {LIMIT_AT, LIMIT_AT + 8 * STATES - 4, WEIGHT_AT,
                                  WEIGHT_AT + 4 * (RATES - 1)};
  for (size_t i = 0; i < sizeof number / sizeof *number; ++i) {
    b = good;
    put_f32(b.byte + number[i], NAN);
    assert_int_equal(status_of(&b), RIM_E_DATA);
  }
  b = good;
  put_u32(b.byte + 24, BASIS_MAX_STATES + 1);
  assert_int_equal(status_of(&b), RIM_E_RANGE);
  b = good;
  put_u32(b.byte + 28, BASIS_MAX_RATES + 1);
  assert_int_equal(status_of(&b), RIM_E_RANGE);
}

/* What a term is of two states and an input. */
static void terms_are_products_and_hinges(void **unused) {
  (void)unused;
  static const uint16_t term[][4] = {{BASIS_ROLLED, 1, BASIS_PLAIN, BASIS_PLAIN},
                                     {BASIS_ROLLED, 1, 0, BASIS_PLAIN},
                                     {BASIS_ROLLED, 1, 1, 0},
                                     {BASIS_ROLLED, 0, BASIS_PLAIN, BASIS_HINGE + 32},
                                     {BASIS_ROLLED, 0, 1, BASIS_HINGE + 48},
                                     {BASIS_ROLLED, 1, BASIS_PLAIN, BASIS_HINGE}};
  enum { TERMS = sizeof term / sizeof *term, TERM_AT = FIRST_AT };
  const bytes without = section();
  bytes b = {.size = 0};
  for (size_t i = 0; i < TERM_AT; ++i)
    u8(&b, without.byte[i]);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(&b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(&b, i < TERMS ? 0.0 : 1.0);
  for (size_t i = TERM_AT; i < without.size; ++i)
    u8(&b, without.byte[i]);
  put_u32(b.byte + 12, TERMS);
  rim_basis v;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  const double u[INPUTS] = {0.5, -2.0}, z[STATES] = {4.0, 3.0};
  /* A hinge at 32 of 64 is at 0, at 48 at half of the limit, at 0 at the lowest value. */
  const double expected[TERMS] = {3.0, 1.5, -24.0, 4.0, -2.0 * (4.0 - 0.5 * LIMIT), 3.0 + LIMIT};
  for (size_t i = 0; i < TERMS; ++i)
    assert_true(rimi_rolled_term(&v, i, u, z) == expected[i]);
  const double low[STATES] = {-1.0, 0.0};
  assert_true(rimi_rolled_term(&v, 3, u, low) == 0.0);
  static const struct {
    size_t at;
    unsigned value;
  } bad[] = {{2, STATES},         {4, INPUTS},          {6, STATES},
             {2 * 8 + 6, STATES}, {6, BASIS_HINGE - 1}, {6, BASIS_HINGE + BASIS_HINGES}};
  for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
    bytes damaged = b;
    put_u16(damaged.byte + TERM_AT + bad[i].at, bad[i].value);
    assert_int_equal(status_of(&damaged), RIM_E_RANGE);
  }
}

/* Outcome 2 by its own state, outcome 0 by its own, whose rates need the other: bits of the two.
 * Outcome 1 by an input alone. */
static void what_a_prediction_depends_on(void **unused) {
  (void)unused;
  static const uint16_t term[3][4] = {{BASIS_ROLLED, 0, BASIS_PLAIN, BASIS_PLAIN},
                                      {BASIS_ROLLED, 1, BASIS_PLAIN, BASIS_PLAIN},
                                      {BASIS_MEAN, 1, 0, 1}};
  const bytes without = section();
  bytes b = {.size = 0}, behaviour = {.size = 0};
  for (size_t i = 0; i < FIRST_AT; ++i)
    u8(&b, without.byte[i]);
  for (size_t i = 0; i < 12; ++i)
    u16(&b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 6; ++i)
    f32(&b, i < 3 ? 0.0 : 1.0);
  for (size_t i = FIRST_AT; i < without.size; ++i)
    u8(&b, without.byte[i]);
  put_u32(b.byte + 12, 3);
  const uint32_t header[4] = {1, 3, 2 * OUTCOMES, 0};
  for (size_t i = 0; i < 4; ++i)
    u32(&behaviour, header[i]);
  for (size_t t = 0; t < 2 * OUTCOMES; ++t)
    u32(&behaviour, 0);
  for (size_t t = 0; t < 2 * OUTCOMES; ++t)
    f32(&behaviour, 0.0);
  for (size_t i = 0; i < 2 * 3 * OUTCOMES; ++i) /* outcome 0: state 1; 1: input; 2: state 0 */
    f32(&behaviour, i == 1 ? 0.5 : i == 5 ? 1.0 : i == 6 ? -2.0 : 0.0);
  rim_basis v;
  rim_behaviour m;
  assert_int_equal(rimi_basis_open(&v, b.byte, b.size, FEATURES, OUTCOMES), RIM_OK);
  assert_int_equal(rimi_behaviour_open(&m, behaviour.byte, behaviour.size, 3, OUTCOMES), RIM_OK);
  assert_int_equal(rimi_rolled_states(&v, &m, 0), 3);
  assert_int_equal(rimi_rolled_states(&v, &m, 1), 0);
  assert_int_equal(rimi_rolled_states(&v, &m, 2), 1);
  assert_int_equal(rimi_rolled_states(&v, &m, 2 * OUTCOMES), 0);
  /* A single state is one; and the first factor of the first rate counts as the others do. */
  rim_basis single = v;
  single.states = 1;
  assert_int_equal(rimi_rolled_states(&single, &m, 2), 1);
  put_u16(b.byte + (v.rate - b.byte) + 2, BASIS_STATE + 1u);
  assert_int_equal(rimi_rolled_states(&v, &m, 2), 3);
  put_u16(b.byte + (v.rate - b.byte) + 2, 0);
  assert_int_equal(rimi_rolled_states(&v, &m, 2), 1);
  /* Behind the terms, the rates and the outcomes lies what may look like more of them. */
  put_u32(b.byte + FIRST_AT + 8 * 3, 0x00010000u | BASIS_ROLLED);
  assert_int_equal(rimi_rolled_states(&v, &m, 1), 0);
  uint8_t *const rates = b.byte + (v.rate - b.byte), *const weights = b.byte + (v.weight - b.byte);
  put_u32(weights, 0x3e2a0000u); /* of state 0, */
  put_u32(weights + 4, 0xbe2a0000u | (BASIS_STATE + 1u));
  assert_int_equal(rimi_rolled_states(&v, &m, 2), 1);
  put_f32(behaviour.byte + behaviour.size, 1.0);
  m.targets = 2 * OUTCOMES;
  put_f32(behaviour.byte + behaviour.size + 4, 1.0);
  assert_int_equal(rimi_rolled_states(&v, &m, 2 * OUTCOMES), 0);
  rim_basis fewer = v;
  fewer.rates = 3; /* the fourth is none, whatever it begins with */
  put_u16(rates + 8 * 3, BASIS_STATE);
  assert_int_equal(rimi_rolled_states(&fewer, &m, 0), 2);
  put_u16(rates + 8 * 3, 1);
  /* An index that was hit is no state. */
  put_u16(b.byte + (v.term - b.byte) + 10, (uint16_t)v.states);
  assert_int_equal(rimi_rolled_states(&v, &m, 0), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(states_follow_their_equations),
                                     cmocka_unit_test(a_long_step_is_two),
                                     cmocka_unit_test(a_longer_block_counts_for_more),
                                     cmocka_unit_test(missing_rows_add_variance),
                                     cmocka_unit_test(an_error_is_forgotten_as_states_forget),
                                     cmocka_unit_test(a_sum_forgets_nothing),
                                     cmocka_unit_test(every_state_may_be_a_factor),
                                     cmocka_unit_test(states_resume_after_a_gap),
                                     cmocka_unit_test(gaps_and_limits_hold),
                                     cmocka_unit_test(smaller_counts_stay_inside),
                                     cmocka_unit_test(an_index_that_was_hit_is_plain),
                                     cmocka_unit_test(damaged_rates_are_refused),
                                     cmocka_unit_test(terms_are_products_and_hinges),
                                     cmocka_unit_test(what_a_prediction_depends_on)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
