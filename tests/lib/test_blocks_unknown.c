/* SPDX-License-Identifier: MIT */
/* monitor/blocks_unknown.c: an input that is a reading, and is out of range for some blocks. What
 * it went into is not known until it is forgotten; what it moved or summed is not known again. */
#include <math.h>

#include "base/real.h"
#include "image/rolled.h"
#include "monitor/blocks.h"
#include "section_bytes.h"

enum { COMMAND, SUN, SENSOR, D, INPUTS = 5, TIMES = 2, BLOCK = 4, BLOCKS = 12 };
enum { OF_COMMAND, OF_SUN, OF_SIZE, OF_PRODUCT, OF_COMMAND_SIZE };
#define PERIOD_S 0.5
#define SHARE 0.03125
#define OFF 5.0 /* standard deviations of an input that is out of range */

static const uint16_t input[INPUTS][2] = {{COMMAND, BASIS_PLAIN},
                                          {SUN, BASIS_PLAIN},
                                          {SUN, BASIS_MAGNITUDE},
                                          {COMMAND, SUN | BASIS_OF_PRODUCT},
                                          {COMMAND, BASIS_MAGNITUDE}};
#define SLOW(i) (TIMES * (i) + 1)
#define QUICK(i) (TIMES * (i))
static const uint16_t term[][4] = {
    {BASIS_MEAN, SLOW(OF_COMMAND)},
    {BASIS_MEAN, SLOW(OF_SUN)},
    {BASIS_ABS, SLOW(OF_SIZE)},
    {BASIS_SIDE, SLOW(OF_PRODUCT), 0, 0x3fe0},
    {BASIS_MEAN, QUICK(OF_SUN)},
    {BASIS_PRODUCT, SLOW(OF_COMMAND), SLOW(OF_SUN)},
    {BASIS_PRODUCT, SLOW(OF_SUN), SLOW(OF_COMMAND)},
    {BASIS_TRIPLE, SLOW(OF_COMMAND), SLOW(OF_COMMAND), SLOW(OF_SUN)},
    {BASIS_TRIPLE, SLOW(OF_SUN), SLOW(OF_COMMAND), SLOW(OF_COMMAND)},
    {BASIS_TRIPLE, SLOW(OF_COMMAND), SLOW(OF_SUN), SLOW(OF_COMMAND)},
    {BASIS_INTEGRAL, OF_COMMAND},
    {BASIS_INTEGRAL, OF_SUN},
    {BASIS_ROLLED, 0, BASIS_PLAIN, BASIS_PLAIN},
    {BASIS_ROLLED, 0, SLOW(OF_SUN), BASIS_PLAIN},
    {BASIS_MEAN, SLOW(OF_COMMAND_SIZE)},
};
enum { TERMS = sizeof term / sizeof *term };

typedef struct bench {
  bytes basis, outcome_feature, range;
  _Alignas(8) uint8_t memory[4096];
  blocks *b;
} bench;

/* moved_by: filter that is a factor of the second state's rate; the first has the command's. */
static void start(bench *s, uint16_t moved_by) {
  static const uint8_t role[D] = {BLOCKS_COMMAND, 0, 0};
  memset(s, 0, sizeof *s);
  bytes *b = &s->basis;
  const uint32_t header[8] = {BASIS_LAYOUT, INPUTS, TIMES, TERMS, 0, 0, 2, 2};
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < 2 * INPUTS; ++i)
    u16(b, input[i / 2][i % 2]);
  f32(b, 1.0);
  f32(b, SHARE);
  for (size_t i = 0; i < 4 * TERMS; ++i)
    u16(b, term[i / 4][i % 4]);
  for (size_t i = 0; i < 2 * TERMS; ++i)
    f32(b, i < TERMS ? 0.0 : 1.0);
  f32(b, 0.0); /* the outcome's first reading */
  for (size_t s2 = 0; s2 < 2; ++s2)
    u16(b, 0);
  for (size_t i = 0; i < 4; ++i)
    f32(b, i % 2 == 0 ? -50.0 : 50.0);
  const uint16_t rate[2][4] = {{0, BASIS_PLAIN, SLOW(OF_COMMAND), BASIS_PLAIN},
                               {1, BASIS_PLAIN, BASIS_STATE, moved_by}};
  for (size_t i = 0; i < 8; ++i)
    u16(b, rate[i / 4][i % 4]);
  f32(b, 0.01);
  f32(b, 0.01);
  u16(&s->outcome_feature, SENSOR);
  for (size_t k = 0; k < 2 * D; ++k)
    f32(&s->range, k < D ? -1.0 : 1.0);
  blocks_config config = {.features = D,
                          .outcomes = 1,
                          .block_rows = BLOCK,
                          .period_s = PERIOD_S,
                          .outcome_feature = s->outcome_feature.byte,
                          .role = role,
                          .range = s->range.byte};
  assert_int_equal(rimi_basis_open(&config.basis, b->byte, b->size, D, 1), RIM_OK);
  assert_int_equal(rimi_blocks_init(&s->b, s->memory, sizeof s->memory, &config), RIM_OK);
}

static void offer_block(bench *s, uint32_t k, double command, double sun) {
  for (uint32_t t = k * BLOCK; t < (k + 1) * BLOCK; ++t) {
    const double row[D] = {command, sun, 0.125 * (t % 3)};
    (void)rimi_blocks_row(s->b, PERIOD_S * t, row, NULL, NULL, NULL);
  }
  assert_int_equal(rimi_blocks_count(s->b), k + 1);
}

/* What is said of every term where the sun's slow mean consists of `part` of what was out of range,
 * and the quick one of `quick`. */
static void assert_said(const bench *s, double part, double quick, bool ever) {
  const double expected[TERMS] = {0.0,  part, part, part, quick, part, part, part,
                                  part, part, 0.0,  ever, 0.0,   part, 0.0};
  assert_int_equal(rimi_blocks_knows_all(s->b), !ever);
  for (size_t i = 0; i < TERMS && ever; ++i) {
    const double said = rimi_blocks_unknown(s->b)[i] / (BASIS_UNKNOWN_SD * OFF);
    if (!(fabs(said - expected[i]) < 1e-4))
      fail_msg("term %zu: %g instead of %g", i, said, expected[i]);
  }
}

/* It is out in `out` blocks from block `from` on: the means hold so much of that. */
static void a_reading_is_forgotten_as_its_means_forget_it(void **state) {
  (void)state;
  for (uint32_t from = 0; from < 4; ++from) {
    for (uint32_t out = 0; out < 4; ++out) {
      bench s;
      start(&s, SLOW(OF_COMMAND));
      uint32_t so_far = 0, ago = 0;
      for (uint32_t k = 0; k < BLOCKS; ++k) {
        const bool is_out = k >= from && k < from + out;
        offer_block(&s, k, 0.5, is_out ? (k % 2 != 0 ? 1e300 : -5.5) : 0.25);
        so_far += is_out;
        ago = is_out ? 0 : ago + 1;
        const bool always = from == 0 && out > 0; /* and before the first row */
        const double since = pow(1.0 - SHARE, BLOCK * (double)ago);
        const double part = always ? since : (1.0 - pow(1.0 - SHARE, BLOCK * so_far)) * since;
        assert_said(&s, so_far > 0 ? part : 0.0, is_out, so_far > 0);
        assert_int_equal(rimi_blocks_out_states(s.b), 0);
      }
    }
  }
}

/* A command may be what no healthy run had. */
static void a_command_is_always_known(void **state) {
  (void)state;
  bench s;
  start(&s, SLOW(OF_SUN));
  for (uint32_t k = 0; k < BLOCKS; ++k) {
    offer_block(&s, k, 1e6, 0.25);
    assert_said(&s, 0.0, 0.0, false);
    assert_int_equal(rimi_blocks_out_states(s.b), 0);
  }
}

/* A state is, from when a mean moves it of which a hundredth was out of range; not in the first
 * block, after which it only begins. Its rate may name no filter at all. */
static void what_it_moves_is_not_known_again(void **state) {
  (void)state;
  static const uint16_t by[] = {SLOW(OF_SUN),  SLOW(OF_SIZE),    SLOW(OF_PRODUCT),
                                QUICK(OF_SUN), SLOW(OF_COMMAND), SLOW(OF_COMMAND_SIZE),
                                BASIS_PLAIN};
  for (size_t i = 0; i < sizeof by / sizeof *by; ++i) {
    for (uint32_t at = 0; at < 6; at += 5) {
      bench s;
      start(&s, by[i]);
      for (uint32_t k = 0; k < BLOCKS; ++k) {
        offer_block(&s, k, 0.5, k == at ? 1e300 : 0.25);
        const bool quick_is_late = by[i] == QUICK(OF_SUN) && at == 0;
        const bool is_moved = i < 4 && k >= at && k > 0 && !quick_is_late;
        assert_int_equal(rimi_blocks_out_states(s.b), is_moved ? 2 : 0);
      }
    }
  }
}

/* A glitch, one reading far out of range, is as if the one before it had stood; a second one in a
 * block is limited, as is the first reading of all, and a command is what was sent. */
static void a_glitch_is_not_read(void **state) {
  (void)state;
  static const struct {
    uint32_t first, count;
    uint16_t column;
  } of[] = {{BLOCK + 2, 1, SENSOR},
            {BLOCK, 1, SENSOR},
            {BLOCK + 2, 2, SENSOR},
            {0, 1, SENSOR},
            {BLOCK + 2, 1, COMMAND}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    bench glitch, stands;
    start(&glitch, SLOW(OF_COMMAND));
    start(&stands, SLOW(OF_COMMAND));
    double before = 2.0; /* which is the limit */
    for (uint32_t t = 0; t < 2 * BLOCK; ++t) {
      double x[D] = {0.5, 0.25, 0.125 * t}, *changed = &x[of[i].column];
      const bool is_out = t >= of[i].first && t < of[i].first + of[i].count;
      const double good = *changed;
      if (is_out)
        *changed = t == of[i].first && of[i].column == SENSOR ? before : 2.0;
      (void)rimi_blocks_row(stands.b, PERIOD_S * t, x, NULL, NULL, NULL);
      *changed = is_out ? 1e300 : good;
      (void)rimi_blocks_row(glitch.b, PERIOD_S * t, x, NULL, NULL, NULL);
      before = good;
    }
    for (size_t f = 0; f < D; ++f)
      assert_true(rimi_bits(rimi_blocks_context(glitch.b)[f]) ==
                  rimi_bits(rimi_blocks_context(stands.b)[f]));
    assert_int_equal(rimi_blocks_get_health(glitch.b).out_of_range, of[i].count);
  }
}

/* So many blocks that their number no longer fits: as if it had always been so. */
static void counts_end_where_they_are_full(void **state) {
  (void)state;
  bench s;
  start(&s, SLOW(OF_COMMAND));
  offer_block(&s, 0, 0.5, 0.25);
  for (uint32_t k = 1; k < 70000; ++k)
    offer_block(&s, k, 0.5, 1e300);
  assert_said(&s, 1.0, 1.0, true);
  for (uint32_t k = 70000; k < 140000; ++k)
    offer_block(&s, k, 0.5, 0.25);
  assert_said(&s, 0.0, 0.0, true);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_reading_is_forgotten_as_its_means_forget_it),
      cmocka_unit_test(a_command_is_always_known),
      cmocka_unit_test(what_it_moves_is_not_known_again),
      cmocka_unit_test(a_glitch_is_not_read),
      cmocka_unit_test(counts_end_where_they_are_full),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
