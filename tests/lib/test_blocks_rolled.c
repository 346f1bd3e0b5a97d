/* SPDX-License-Identifier: MIT */
/* monitor/blocks.c with a state that is rolled forward: it begins where its sensor is, follows the
 * command from then on and never the sensor, and is as uncertain as the gaps made it. */
#include <math.h>

#include "image/rolled.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { COMMAND = 0, SENSOR = 1, D = 2, BLOCK = 5, TERMS = 2, RATES = 2 };
#define PERIOD_S 0.125 /* times are exact */
#define BLOCK_S (BLOCK * PERIOD_S)
#define LIMIT 50.0

/* It settles at three times the command. */
static const uint16_t rate[RATES][4] = {{0, 0, BASIS_PLAIN, BASIS_PLAIN},
                                        {0, BASIS_PLAIN, BASIS_STATE, BASIS_PLAIN}};
/* A number whose last bits, as a code of a state, would say another state: none may read them. */
#define GAIN (1.5 + 0x8001p-23)
static const double weight[RATES] = {GAIN, -0.5};
static const uint16_t term[TERMS][4] = {{BASIS_ROLLED, 0, BASIS_PLAIN, BASIS_PLAIN},
                                        {BASIS_ROLLED, 0, 0, 0}};

typedef struct bench {
  bytes basis, outcome_feature, range;
  uint8_t role[D];
  _Alignas(8) uint8_t memory[4096];
  blocks *b;
} bench;

/* first_sd > 0: how the first readings of healthy runs differ, about 1. Only the first state has
 * terms and rates. */
static void start_with(bench *s, double first_sd, uint32_t states) {
  memset(s, 0, sizeof *s);
  bytes *b = &s->basis;
  const uint32_t header[8] = {BASIS_LAYOUT, 1, 1, TERMS, 0, first_sd > 0.0 ? 1 : 0, states, RATES};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  u16(b, COMMAND);
  u16(b, BASIS_PLAIN);
  f32(b, 1.0);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(b, i < TERMS ? 0.0 : 0.03125);
  f32(b, 1.0);
  if (first_sd > 0.0)
    f32(b, first_sd);
  for (size_t i = 0; i < (states + 1) / 2; ++i) /* the states' outcome, in pairs */
    u32(b, 0);
  for (size_t i = 0; i < 2 * states; ++i)
    f32(b, i % 2 == 0 ? -LIMIT : LIMIT);
  for (size_t i = 0; i < 4 * RATES; ++i)
    u16(b, rate[i / 4][i % 4]);
  for (size_t q = 0; q < RATES; ++q)
    f32(b, weight[q]);
  u16(&s->outcome_feature, SENSOR);
  for (size_t k = 0; k < 2 * D; ++k)
    f32(&s->range, k < D ? -100.0 : 100.0);
  s->role[COMMAND] = BLOCKS_COMMAND;
  blocks_config config = {.features = D,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .period_s = PERIOD_S,
                          .outcome_feature = s->outcome_feature.byte,
                          .role = s->role,
                          .range = s->range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, b->byte, b->size, D, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&s->b, s->memory, sizeof s->memory, &config), RIM_OK);
}

static void start(bench *s, double first_sd) { start_with(s, first_sd, 1); }

static double command(uint32_t t) { return 2.0 + sin(0.11 * t); }

static double mean_command(uint32_t end) {
  double sum = 0.0;
  for (uint32_t t = end - BLOCK; t < end; ++t)
    sum += command(t) / BLOCK;
  return sum;
}

/* Half a block from the mean of the first two, then block by block. */
static double step(double z, double u, double dt) {
  if (dt > 1.25 * BLOCK_S) /* after a gap, in two */
    return step(step(z, u, 1.25 * BLOCK_S), u, dt - 1.25 * BLOCK_S);
  const double middle = z + 0.5 * dt * (GAIN * u - 0.5 * z);
  return z + dt * (GAIN * u - 0.5 * middle);
}

/* late: by so many periods. */
static bool offer(bench *s, uint32_t t, double late, double reading) {
  const double row[D] = {command(t), reading};
  return rimi_blocks_row(s->b, PERIOD_S * (t + late), row, NULL, NULL, NULL) == BLOCKS_DONE;
}

static void assert_state(const bench *s, double z, uint32_t end) {
  const double expected[TERMS] = {z, z * z * mean_command(end)};
  for (size_t i = 0; i < TERMS; ++i) {
    const double value = rimi_blocks_terms(s->b)[i] / 0.03125;
    const double most = BASIS_CLIP / 0.03125;
    if (!(fabs(value - fmin(expected[i], most)) < 1e-9 * (1.0 + fabs(expected[i]))))
      fail_msg("term %zu after %u rows: %.9g instead of %.9g", i, end, value, expected[i]);
  }
}

static void a_state_follows_the_commands_alone(void **unused) {
  (void)unused;
  bench s;
  start(&s, 0.0);
  double z = 0.0;
  for (uint32_t t = 0; t < 40 * BLOCK; ++t) {
    const double reading = t < 2 * BLOCK ? 1.0 + 0.1 * t : -70.0; /* then the sensor is broken */
    const bool done = offer(&s, t, 0, reading);
    const uint32_t end = t + 1;
    assert_int_equal(done, end % BLOCK == 0);
    if (!done || end < 2 * BLOCK)
      continue;
    if (end == 2 * BLOCK)
      z = step(1.0 + 0.1 * 4.5, mean_command(end), 0.5 * BLOCK_S);
    else
      z = step(z, 0.5 * (mean_command(end) + mean_command(end - BLOCK)), BLOCK_S);
    assert_state(&s, z, end);
    assert_true(rimi_blocks_knows_all(s.b));
  }
  assert_true(z > 2.0);
}

/* A first reading that is none of a healthy run's is limited, but where the run began before. */
static void a_first_reading_is_limited(void **unused) {
  (void)unused;
  for (int late = 0; late < 2; ++late) {
    bench s;
    start(&s, 0.25);
    if (late)
      rimi_blocks_begin_late(s.b);
    for (uint32_t t = 0; t < 2 * BLOCK; ++t)
      (void)offer(&s, t, 0, 9.0);
    const double first = late ? 9.0 : 1.0 + BASIS_FIRST_LIMIT * 0.25;
    assert_state(&s, step(first, mean_command(2 * BLOCK), 0.5 * BLOCK_S), 2 * BLOCK);
  }
}

/* A step covers a short gap. After a long one the state goes on by what the readings moved, so that
 * it stays as far from them as it was, and follows the commands again. */
static void a_state_goes_on_after_a_gap(void **unused) {
  (void)unused;
  static const double gaps[] = {0.0, 2.0, 7.0, 7.5, 8.0, 40.0}; /* in rows */
  for (size_t k = 0; k < sizeof gaps / sizeof *gaps; ++k) {
    bench s;
    start(&s, 0.0);
    for (uint32_t t = 0; t < 2 * BLOCK; ++t)
      (void)offer(&s, t, 0, 1.0);
    double z = step(1.0, mean_command(2 * BLOCK), 0.5 * BLOCK_S);
    const double elapsed_s = PERIOD_S * (BLOCK + gaps[k]);
    const bool is_long = elapsed_s > ROLLED_LONGEST * BLOCK_S;
    assert_true(is_long == (gaps[k] > 7.5));
    for (uint32_t t = 2 * BLOCK; t < 3 * BLOCK; ++t)
      (void)offer(&s, t, gaps[k], 1.75);
    const double both = 0.5 * (mean_command(3 * BLOCK) + mean_command(2 * BLOCK));
    z = is_long ? z + 0.75 : step(z, both, elapsed_s);
    assert_state(&s, z, 3 * BLOCK);
    assert_true(rimi_blocks_has_resumed(s.b) == is_long);
    for (uint32_t t = 3 * BLOCK; t < 4 * BLOCK; ++t)
      (void)offer(&s, t, gaps[k], -70.0);
    z = step(z, 0.5 * (mean_command(4 * BLOCK) + mean_command(3 * BLOCK)), BLOCK_S);
    assert_state(&s, z, 4 * BLOCK);
    rimi_blocks_reset(s.b);
    assert_false(rimi_blocks_has_resumed(s.b));
  }
}

/* As many states as there may be: the first is what it is alone, also after a gap, and the last,
 * which nothing moves, goes on there by what its own reading moved. */
static void the_most_states_are_as_one(void **unused) {
  (void)unused;
  bench one, all;
  start(&one, 0.0);
  start_with(&all, 0.0, BASIS_MAX_STATES);
  uint8_t *second = all.basis.byte + 32 + 4 + 4 + 8; /* of the terms */
  put_u16(second + 2, BASIS_MAX_STATES - 1);
  put_u16(second + 4, BASIS_PLAIN); /* no product */
  put_u16(second + 6, BASIS_PLAIN);
  const double slope = 0.03125, first = 1.0 + slope * (2 * BLOCK - 1) / 2.0;
  for (uint32_t t = 0; t < 8 * BLOCK; ++t) {
    const double late = t < 4 * BLOCK ? 0.0 : 40.0, reading = 1.0 + slope * t;
    const bool done = offer(&one, t, late, reading);
    assert_int_equal(offer(&all, t, late, reading), done);
    if (!done || t < 2 * BLOCK)
      continue;
    const double last = late > 0.0 ? first + slope * BLOCK : first;
    assert_true(rimi_blocks_terms(all.b)[0] == rimi_blocks_terms(one.b)[0]);
    assert_true(fabs(rimi_blocks_terms(all.b)[1] / 0.03125 - last) < 1e-12);
  }
  assert_true(rimi_blocks_has_resumed(all.b));
}

/* A state that begins at a reading out of range, in either of the first two blocks, is told:
 * beyond the range and twice its width, on either side. All three are of one sensor. */
static void a_state_that_begins_out_of_range_is_told(void **unused) {
  (void)unused;
  for (uint32_t k = 0; k < 16; ++k) {
    bench s;
    start_with(&s, 0.0, 3);
    const double reading = ((k & 1u) != 0 ? -1.0 : 1.0) * ((k & 2u) != 0 ? 499.0 : 501.0);
    const uint32_t at = k >> 2; /* the block in which it is */
    for (uint32_t t = 0; t < 4 * BLOCK; ++t)
      (void)offer(&s, t, 0, t / BLOCK == at ? reading : 1.0);
    const bool is_told = at < 2 && (k & 2u) == 0;
    assert_int_equal(rimi_blocks_out_states(s.b), is_told ? 7 : 0);
    assert_int_equal(rimi_blocks_knows_all(s.b), !is_told && (at < 3 || (k & 2u) != 0));
    rimi_blocks_reset(s.b);
    assert_int_equal(rimi_blocks_out_states(s.b), 0);
  }
}

/* Where rows bring predictions, no outcome is a feature, and none is out of range. */
static void a_state_of_no_feature_is_never_out_of_range(void **unused) {
  (void)unused;
  bench s;
  start(&s, 0.0);
  blocks_config config = {.features = D,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .external = true,
                          .period_s = PERIOD_S,
                          .role = s.role,
                          .range = s.range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, s.basis.byte, s.basis.size, D, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&s.b, s.memory, sizeof s.memory, &config), RIM_OK);
  const double row[D] = {200.0, 200.0}, outcome = 200.0, mean = 0.0, sd = 1.0;
  for (uint32_t t = 0; t < 2 * BLOCK; ++t)
    (void)rimi_blocks_row(s.b, PERIOD_S * t, row, &outcome, &mean, &sd);
  assert_int_equal(rimi_blocks_count(s.b), 2);
  assert_int_equal(rimi_blocks_out_states(s.b), 0);
}

/* An upset made an operation what none is: its term says nothing, and the other what it did. */
static void an_operation_that_is_none(void **unused) {
  (void)unused;
  bench s;
  start(&s, 0.0);
  put_u16(s.basis.byte + 32 + 4 + 4, BASIS_SIDE + 1);
  for (uint32_t t = 0; t < 2 * BLOCK; ++t)
    (void)offer(&s, t, 0, 1.0);
  const double z = step(1.0, mean_command(2 * BLOCK), 0.5 * BLOCK_S);
  assert_true(rimi_blocks_terms(s.b)[0] == 0.0);
  assert_true(fabs(rimi_blocks_terms(s.b)[1] / 0.03125 - z * z * mean_command(2 * BLOCK)) < 1e-9);
  for (uint32_t t = 2 * BLOCK; t < 3 * BLOCK; ++t)
    (void)offer(&s, t, 40, 1.0);
  assert_false(rimi_blocks_knows_all(s.b));
  assert_true(rimi_blocks_unknown(s.b)[0] == 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_state_follows_the_commands_alone),
                                     cmocka_unit_test(a_first_reading_is_limited),
                                     cmocka_unit_test(a_state_goes_on_after_a_gap),
                                     cmocka_unit_test(the_most_states_are_as_one),
                                     cmocka_unit_test(a_state_that_begins_out_of_range_is_told),
                                     cmocka_unit_test(a_state_of_no_feature_is_never_out_of_range),
                                     cmocka_unit_test(an_operation_that_is_none)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
