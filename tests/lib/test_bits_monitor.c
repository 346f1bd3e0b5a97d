/* SPDX-License-Identifier: MIT */
/* A trained monitor keeps its bits (bits.h) from the rows to the judgement: terms of every kind,
 * agreement from every source, angles, gaps, runs that begin late, values that few would expect.
 * How an alarm is described and dated is not held here. */
#include "bits.h"

#include "image/basis.h"
#include "monitor/monitor_private.h"

#include "monitor_bench.h"

enum { IN = 7, FILTERS_OF = IN * TIMES, HEADING = 3, TURNED = 2 /* an angle in radians */ };

static const uint16_t input[IN][2] = {
    {0, BASIS_PLAIN}, {0, BASIS_MAGNITUDE},      {0, BASIS_COSINE}, {3, BASIS_SINE},
    {0, 3},           {0, 3 | BASIS_OF_PRODUCT}, {3, BASIS_COSINE}};
static const uint16_t term_of[][3] = {
    {BASIS_MEAN, 0, 0},    {BASIS_MEAN, 1, 0},     {BASIS_PRODUCT, 1, 3}, {BASIS_ABS, 1, 0},
    {BASIS_DECAY, 0, 1},   {BASIS_INTEGRAL, 0, 0}, {BASIS_INITIAL, 1, 1}, {BASIS_TIME, 0, 0},
    {BASIS_MEAN, 5, 0},    {BASIS_MEAN, 7, 0},     {BASIS_MEAN, 9, 0},    {BASIS_MEAN, 11, 0},
    {BASIS_PRODUCT, 5, 7}, {BASIS_MEAN, 13, 0},    {BASIS_INTEGRAL, 3, 0}};
enum { TERMS_OF = sizeof term_of / sizeof *term_of };

static double number(uint32_t i) {
  rim_rng rng;
  rimi_rng_seed(&rng, SEED, 7000u + i);
  return rimi_rng_normal(&rng);
}

static void rich_basis(bytes *b, uint32_t spread) {
  const uint32_t header[8] = {BASIS_LAYOUT, IN, TIMES, TERMS_OF, MEANS, spread, 0, 0};
  b->size = 0;
  for (size_t i = 0; i < 8; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < 2 * IN; ++i)
    u16(b, input[i / 2][i % 2]);
  f32(b, 1.0);
  f32(b, 0.1);
  for (size_t i = 0; i < 4 * TERMS_OF; ++i)
    u16(b, i % 4 < 3 ? term_of[i / 4][i % 4] : 0);
  for (size_t i = 0; i < 2 * TERMS_OF; ++i)
    f32(b, i < TERMS_OF ? 0.1 : 0.8);
  u16(b, 1);
  u16(b, 0);
  f32(b, 0.05);
  f32(b, 1.5);
  for (size_t o = 0; o < O; ++o)
    f32(b, 0.02);
  for (size_t o = 0; spread > 0 && o < O; ++o)
    f32(b, 0.5);
  for (size_t f = 0; spread > 1 && f < 2 * D; ++f)
    f32(b, f < D ? (f == 0 ? 0.9 : 0.0) : 0.3);
}

static void rich_behaviour(bytes *b) {
  const uint32_t header[4] = {1, TERMS_OF, 2 * O, 0};
  b->size = 0;
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < 2 * O; ++i)
    u32(b, i == 1);
  for (size_t i = 0; i < 2 * O; ++i)
    f32(b, i < O ? 0.01 : -3.0);
  for (uint32_t i = 0; i < 2 * O * TERMS_OF; ++i)
    f32(b, i == 0 ? 2.0 : 0.02 * number(i));
}

/* Outcome 0 by `source`; outcome 1 is the integral of a plain feature, a product, a cosine and a
 * sine. */
static void rich_agreement(bytes *b, agreement_source source) {
  enum { G = 4 };
  const uint32_t header[4] = {3, O, MEANS, G};
  const uint16_t integrand[G][4] = {{AGREEMENT_PLAIN, 1, 0, 0},
                                    {AGREEMENT_PRODUCT, 0, 1, 0},
                                    {AGREEMENT_COSINE, 1, 3, 0},
                                    {AGREEMENT_SINE, 0, 3, 0}};
  b->size = 0;
  for (size_t i = 0; i < 4; ++i)
    u32(b, header[i]);
  for (size_t i = 0; i < O; ++i)
    f32(b, 20.0 - 3.0 * (double)i);
  for (size_t i = 0; i < 4 * G; ++i)
    u16(b, integrand[i / 4][i % 4]);
  for (size_t i = 0; i < 3 * G; ++i)
    f32(b, i < G ? 0.5 + 0.25 * (double)i : 0.3 * (double)(i % 3));
  for (uint32_t o = 0; o < O; ++o) {
    const double head[4] = {o == 0 ? (double)source : AGREEMENT_INTEGRAL, 0.01, o == 1 ? 0.0 : -1.0,
                            0.0};
    for (size_t i = 0; i < 4; ++i)
      f32(b, head[i]);
    for (uint32_t i = 0; i < O * (2 + MEANS); ++i)
      f32(b, 0.2 * number(500 + 20 * o + i));
  }
}

/* Row t of a run in which the heading turns on and on, and what is planted deviates. */
static void rich_row(row *r, uint32_t run, uint32_t t, uint32_t planted) {
  make_row(r, false, run, t, planted == 1 ? 0.5 : 0.0);
  const double turn = 0.03 * (double)t + 0.1 * r->context[0];
  r->context[HEADING] = turn - 2.0 * RIM_PI * rimi_floor((turn + RIM_PI) / (2.0 * RIM_PI));
  if (planted == 2 && t > 300)
    r->context[2] += 0.002 * (double)(t - 300);
  if (planted == 3 && t > 300 && t % 3 != 0)
    r->context[2] = 0.125;
  if (planted == 3 && t % 200 == 150)
    r->context[1] = 50.0; /* out of range */
  r->view.t_s = r->t_s = r->t_s + (t > 500 && planted != 0 ? 11.0 * PERIOD_S : 0.0);
}

static uint64_t fly(uint32_t spread, agreement_source source, uint32_t planted) {
  static _Alignas(8) uint8_t memory[RIM_MONITOR_TRAINED_SIZE(D, O, REGION, TRAINED_RING, FILTERS_OF,
                                                             TERMS_OF, FIELDS, MEANS) +
                                    4096];
  static image blob;
  recipe r = calibrated[0];
  uint64_t digest = BITS_START;
  rich_basis(&r.section[RIM_SECTION_BASIS], spread);
  rich_behaviour(&r.section[RIM_SECTION_BEHAVIOUR]);
  rich_agreement(&r.section[RIM_SECTION_AGREEMENT], source);
  r.section[RIM_SECTION_COMMANDS].byte[HEADING] = TURNED;
  put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * HEADING, -RIM_PI);
  put_f32(r.section[RIM_SECTION_FEATURES].byte + 4 * (D + HEADING), RIM_PI);
  put_f32(r.section[RIM_SECTION_THRESHOLD].byte + 16,
          1e6); /* no alarm: what is found is looked at */
  build(&blob, &r);
  rim_monitor *m = NULL;
  assert_int_equal(rim_monitor_init(&m, memory, sizeof memory, blob.byte, blob.size), RIM_OK);
  for (uint32_t t = 0; t < 900; ++t) {
    row now;
    rim_verdict v;
    rich_row(&now, 920 + planted, t, planted);
    assert_int_equal(rim_monitor_step(m, &now.view, &v), RIM_OK);
    take_bits(&digest, (uint64_t)v.reason << 16 | (uint64_t)v.level << 8 | v.valid);
    if (t % BLOCK != BLOCK - 1)
      continue;
    const double of_it[4] = {v.score, v.ln_anom, v.threshold, v.p_value};
    take_reals(&digest, of_it, 4);
    take_bits(&digest, (uint64_t)v.blocks << 32 | v.channel);
    take_reals(&digest, m->residual, CHANNELS);
    take_reals(&digest, rimi_blocks_outcomes(m->rows), O);
    take_reals(&digest, rimi_blocks_means(m->rows), MEANS);
    take_reals(&digest, rimi_blocks_early(m->rows), 4);
    take_reals(&digest, rimi_blocks_late(m->rows), 4);
    take_reals(&digest, rimi_blocks_context(m->rows), D);
    take_real(&digest, rimi_blocks_since_start_s(m->rows));
    take_bits(&digest, rimi_blocks_knows_all(m->rows));
    for (size_t i = 0; i < TERMS_OF && !rimi_blocks_knows_all(m->rows); ++i)
      take_bits(&digest, rimi_blocks_unknown(m->rows)[i]);
  }
  const rim_monitor_health h = rim_monitor_get_health(m);
  take_bits(&digest, (uint64_t)h.partly << 32 | h.rows.gaps);
  for (uint32_t o = 0; o < O; ++o)
    for (uint16_t j = 0; j < O; ++j) {
      const agreement_gain gain =
          rimi_agreement_gain(&m->models.agreement, o, j, (uint16_t)(j + 1));
      take_real(&digest, gain.sum);
      take_real(&digest, gain.of_products);
      take_bits(&digest, gain.mostly);
    }
  return digest;
}

static void a_trained_monitor_keeps_its_bits(void **state) {
  (void)state;
  uint64_t digest = BITS_START;
  for (uint32_t spread = 0; spread < 3; ++spread)
    for (uint32_t planted = 0; planted < 4; ++planted)
      take_bits(&digest,
                fly(spread, planted % 2 == 0 ? AGREEMENT_RESIDUALS : AGREEMENT_FEW, planted));
  bits_are(digest, UINT64_C(0xc9c563107dcf5351));
}

/* Rows with predictions: the judgement, the gaps and who is inside. */
static void rows_with_predictions_keep_their_bits(void **state) {
  (void)state;
  static bench b;
  uint64_t digest = BITS_START;
  for (uint32_t run = 0; run < 3; ++run) {
    make_bench(&b, true);
    for (uint32_t t = 0; t < 700; ++t) {
      if (t % 180 > 150 && run == 1)
        continue; /* a gap */
      const rim_verdict v = step(&b, 930 + run, t, run == 0 ? 0.0 : 1.2);
      const double of_it[4] = {v.score, v.ln_anom, v.threshold, v.p_value};
      take_reals(&digest, of_it, 4);
      take_bits(&digest, (uint64_t)v.blocks << 32 | (uint64_t)v.channel << 8 | v.level);
      const double x[D] = {0.1, 0.2, 100.0 + (double)(t % 200), 0.3};
      take_real(&digest, rim_monitor_membership(b.monitor, x));
    }
    take_bits(&digest, b.monitor->gaps);
    for (uint32_t i = 0; i < b.monitor->gaps; ++i) {
      take_real(&digest, b.monitor->gap[i].before_s);
      take_real(&digest, b.monitor->gap[i].after_s);
      take_bits(&digest, b.monitor->gap[i].index);
    }
  }
  bits_are(digest, UINT64_C(0x407c7d3e53323f16));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_trained_monitor_keeps_its_bits),
      cmocka_unit_test(rows_with_predictions_keep_their_bits),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
