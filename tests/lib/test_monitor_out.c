/* SPDX-License-Identifier: MIT */
/* A trained monitor one of whose readings is out of range for a while: of that reading it goes on
 * to speak, of what is held against it it says nothing in those blocks. */
#define BENCH_OUTCOMES 4
#include "describe_bench.h"

enum { HELD = 1, OUT = 2, OTHER = 3, FREE = 3, FROM = 20, TO = 24, END = 30, RUN = 931 };

/* What outcome HELD is held against: `source`, with a weight of outcome j, of an integrand that
 * reads `feature`, or of INTO the outcome j. The others: nothing but their own commands. */
static recipe held(agreement_source source, uint32_t j, double weight, uint32_t feature) {
  recipe r = without_integrals();
  bytes *to = &r.section[RIM_SECTION_AGREEMENT];
  to->size = 0;
  const uint32_t header[4] = {3, O, MEANS, 1};
  for (size_t i = 0; i < 4; ++i)
    u32(to, header[i]);
  for (size_t i = 0; i < O; ++i)
    f32(to, 20.0);
  const uint16_t of[4] = {AGREEMENT_PLAIN, (uint16_t)feature, (uint16_t)feature, 0};
  for (size_t i = 0; i < 4; ++i)
    u16(to, of[i]);
  const double numbers[3] = {1.0, 1.0, 0.0};
  for (size_t i = 0; i < 3; ++i)
    f32(to, numbers[i]);
  const bool is_sum = source == AGREEMENT_INTEGRAL || source == AGREEMENT_INTO;
  for (uint32_t o = 0; o < O; ++o) {
    f32(to, o == HELD ? source : AGREEMENT_RESIDUALS);
    f32(to, o == HELD && source == AGREEMENT_INTO ? j : 0.0);
    f32(to, -1.0);
    f32(to, 0.0);
    for (uint32_t i = 0; i < O * (2 + MEANS); ++i)
      f32(to, o == HELD && i == (is_sum ? 0 : j) ? weight : 0.0);
  }
  return r;
}

/* How many of the blocks in which the reading of a feature is out of range a channel knows, of
 * FROM to TO; in all others it knows everything. */
static uint32_t known_blocks(const recipe *r, uint32_t out_feature, uint32_t channel) {
  uint32_t known = 0;
  from(r, false);
  m->guard.busy = false;
  for (uint32_t t = 0; t < END * BLOCK; ++t) {
    row now;
    rim_verdict v;
    make_row(&now, false, RUN, t, 0.0);
    const bool is_out = t / BLOCK >= FROM && t / BLOCK < TO;
    if (is_out)
      now.context[out_feature] = 1e3;
    assert_int_equal(rim_monitor_step(m, &now.view, &v), RIM_OK);
    if (t % BLOCK != BLOCK - 1 || m->search->held == 0)
      continue;
    const bool is_known =
        search_is_known(m->search, channel, search_slot(m->search, m->search->held - 1u));
    assert_true(is_known || is_out);
    known += is_known && is_out;
  }
  return known;
}

static void what_is_held_against_a_reading_says_nothing(void **state) {
  (void)state;
  enum { ALL = TO - FROM };
  const struct {
    agreement_source source;
    uint32_t j;
    double weight;
    uint32_t integrand, out_feature, known;
  } cases[] = {
      {AGREEMENT_RESIDUALS, OUT, 0.5, FREE, sensor(OUT), 0},
      {AGREEMENT_RESIDUALS, OUT, 0.0, FREE, sensor(OUT), ALL},
      {AGREEMENT_RESIDUALS, OUT, 0.5, FREE, sensor(OTHER), ALL},
      {AGREEMENT_RESIDUALS, OUT, 0.5, FREE, FREE, ALL},
      {AGREEMENT_FEW, OUT, 0.5, FREE, sensor(OUT), 0},
      {AGREEMENT_FEW, OUT, -0.5, FREE, sensor(OUT), 0},
      {AGREEMENT_FEW, OUT, 0.0, FREE, sensor(OUT), ALL},
      {AGREEMENT_FEW, OUT, 0.5, FREE, sensor(OTHER), ALL},
      {AGREEMENT_FEW, OUT, 0.5, FREE, FREE, ALL}, /* is no outcome */
      {AGREEMENT_FEW, OUT, 0.5, FREE, sensor(HELD), ALL},
      {AGREEMENT_INTEGRAL, OUT, 0.5, sensor(OUT), sensor(OUT), 0},
      {AGREEMENT_INTEGRAL, OUT, 0.5, sensor(OUT), sensor(OTHER), ALL},
      {AGREEMENT_INTEGRAL, OUT, 0.5, FREE, FREE, 0},
      {AGREEMENT_INTEGRAL, OUT, 0.5, FREE, sensor(HELD), ALL}, /* itself: that is to be said */
      {AGREEMENT_INTO, OUT, 0.5, sensor(HELD), sensor(OUT), 0},
      {AGREEMENT_INTO, OUT, 0.5, sensor(HELD), sensor(HELD), ALL},
      {AGREEMENT_INTO, OUT, 0.5, sensor(HELD), sensor(OTHER), ALL},
  };
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
    const recipe r = held(cases[i].source, cases[i].j, cases[i].weight, cases[i].integrand);
    const uint32_t known = known_blocks(&r, cases[i].out_feature, AGREEMENT + HELD);
    if (known != cases[i].known)
      fail_msg("case %zu: %u blocks are known, not %u", i, known, cases[i].known);
    for (uint32_t o = 0; o < O; ++o) { /* every behaviour is, and what is held against nothing */
      assert_int_equal(known_blocks(&r, cases[i].out_feature, o), ALL);
      for (uint32_t kind = RIM_CHANNEL_SCATTER; kind <= RIM_CHANNEL_REPEAT; ++kind) /* its own */
        assert_int_equal(known_blocks(&r, cases[i].out_feature, kind * O + o),
                         cases[i].out_feature == sensor(o) ? 0 : ALL);
      if (o != HELD)
        assert_int_equal(known_blocks(&r, cases[i].out_feature, AGREEMENT + o), ALL);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(what_is_held_against_a_reading_says_nothing)};
  return cmocka_run_group_tests(tests, set_up_trained, NULL);
}
