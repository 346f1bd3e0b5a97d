/* envelope: the section is validated whole, and the best interval is the one that the definition in
 * rim/envelope.h names, found here by plain division over every interval. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rim/envelope.h"
#include "rim/real.h"
#include "rim/rng.h"

enum { C = 3, F = 2, B = 7, LEAST = 4 };
enum { I = RIM_ENVELOPE_INTERVALS(B), BYTES = RIM_ENVELOPE_BYTES(C, F, B) };
enum {
  USUAL_AT = 4 * RIM_ENVELOPE_HEADER_WORDS,
  A_AT = USUAL_AT + 4 * F * I,
  CODE_AT = A_AT + 4 * C
};
#define SEED 811u

typedef struct section {
  _Alignas(8) uint8_t byte[BYTES + 8];
} section;

static void put_u32(section *s, size_t at, uint32_t v) {
  for (int k = 0; k < 4; ++k)
    s->byte[at + (size_t)k] = (uint8_t)(v >> (8 * k));
}
static void put_f32(section *s, size_t at, float f) {
  uint32_t v;
  memcpy(&v, &f, 4);
  put_u32(s, at, v);
}
static void put_usual(section *s, size_t f, size_t i, size_t kind, uint16_t n) {
  const size_t at = USUAL_AT + 2 * (2 * (f * I + i) + kind);
  s->byte[at] = (uint8_t)n;
  s->byte[at + 1] = (uint8_t)(n >> 8);
}
static uint16_t get_usual(const section *s, size_t f, size_t i, size_t kind) {
  const size_t at = USUAL_AT + 2 * (2 * (f * I + i) + kind);
  return (uint16_t)(s->byte[at] | s->byte[at + 1] << 8);
}

/* usual about `typical`, one in eight hypotheses not judged; variances 2^-4 to 2^4. */
static section make_section(rim_rng *rng, uint32_t typical) {
  section s;
  memset(&s, 0, sizeof s);
  const uint32_t header[6] = {RIM_ENVELOPE_LAYOUT, C, F, B, LEAST, 0};
  for (size_t i = 0; i < 6; ++i)
    put_u32(&s, 4 * i, header[i]);
  for (size_t f = 0; f < F; ++f) {
    for (size_t i = 0; i < I; ++i) {
      for (size_t k = 0; k < 2; ++k) {
        const uint32_t n = rim_rng_below(rng, 8) == 0 ? 0 : 1 + rim_rng_below(rng, 2 * typical);
        put_usual(&s, f, i, k, (uint16_t)n);
      }
    }
  }
  for (size_t c = 0; c < C; ++c)
    put_f32(&s, A_AT + 4 * c, (float)(0.2 + 2.0 * rim_rng_uniform(rng)));
  for (size_t i = CODE_AT; i < BYTES; ++i)
    s.byte[i] = (uint8_t)(96u + rim_rng_below(rng, 65));
  return s;
}

static rim_envelope opened(const section *s) {
  rim_envelope e;
  assert_int_equal(rim_envelope_open(&e, s->byte, BYTES), RIM_OK);
  return e;
}

typedef struct data {
  double n[B + 1], s[B + 1];
} data;

/* Bins of 0 to most observations each; residuals of variance 1 about a mean of their own per bin.
 */
static data make_data(rim_rng *rng, uint32_t most) {
  data d = {{0}, {0}};
  for (size_t k = 0; k < B; ++k) {
    const double n = (double)rim_rng_below(rng, most + 1);
    const double mean = rim_rng_normal(rng);
    d.n[k + 1] = d.n[k] + n;
    d.s[k + 1] = d.s[k] + n * mean + rim_sqrt(n) * rim_rng_normal(rng);
  }
  return d;
}

/* ln anom of one hypothesis, as the header comment says it; 0 where it is not judged. */
static double plain(const section *s, const data *d, size_t c, size_t f, size_t i, size_t j,
                    size_t at, int contrast) {
  const double all = d->n[B];
  const double n = d->n[j + 1] - d->n[i];
  const double rest = all - n;
  const double usual = get_usual(s, f, at, (size_t)contrast);
  if (n < LEAST || usual == 0.0 || (contrast && rest < LEAST))
    return 0.0;
  float a;
  memcpy(&a, s->byte + A_AT + 4 * c, 4);
  const double code = s->byte[CODE_AT + 2 * ((c * F + f) * I + at) + (size_t)contrast];
  double var = exp2((code - 128.0) / 8.0);
  double m = (d->s[j + 1] - d->s[i]) / n;
  double inverse = 1.0 / n;
  if (contrast) {
    m -= (d->s[B] - (d->s[j + 1] - d->s[i])) / rest;
    inverse += 1.0 / rest;
  }
  if (inverse > 1.0 / usual)
    var += (double)a * (inverse - 1.0 / usual);
  return m * m / (2.0 * var);
}

typedef struct plain_best {
  double ln_anom, second;
  size_t first, last;
  int contrast;
} plain_best;

static plain_best search_plainly(const section *s, const data *d, size_t c, size_t f) {
  plain_best best = {0.0, 0.0, 0, 0, 0};
  size_t at = 0;
  for (size_t i = 0; i < B; ++i) {
    for (size_t j = i; j < B; ++j, ++at) {
      for (int k = 0; k < 2; ++k) {
        const double value = plain(s, d, c, f, i, j, at, k);
        if (value > best.ln_anom) {
          best.second = best.ln_anom;
          best.ln_anom = value;
          best.first = i;
          best.last = j;
          best.contrast = k;
        } else if (value > best.second) {
          best.second = value;
        }
      }
    }
  }
  return best;
}

static void every_truncation_is_refused_and_leaves_the_view(void **state) {
  (void)state;
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 0);
  const section s = make_section(&rng, 20);
  rim_envelope e;
  memset(&e, 0x5a, sizeof e);
  const rim_envelope before = e;
  for (size_t n = 0; n < BYTES; ++n) {
    assert_int_equal(rim_envelope_open(&e, s.byte, n), RIM_E_TRUNCATED);
    assert_memory_equal(&e, &before, sizeof e);
  }
  for (size_t n = BYTES + 1; n <= BYTES + 8; ++n) {
    assert_int_equal(rim_envelope_open(&e, s.byte, n), RIM_E_SIZE);
  }
  assert_int_equal(rim_envelope_open(NULL, s.byte, BYTES), RIM_E_ARGUMENT);
  assert_int_equal(rim_envelope_open(&e, NULL, BYTES), RIM_E_ARGUMENT);
  section moved;
  for (size_t shift = 1; shift < 4; ++shift) {
    memcpy(moved.byte + shift, s.byte, BYTES);
    assert_int_equal(rim_envelope_open(&e, moved.byte + shift, BYTES), RIM_E_ALIGN);
  }
  memcpy(moved.byte + 4, s.byte, BYTES); /* 4 is enough */
  assert_memory_equal(&e, &before, sizeof e);
  assert_int_equal(rim_envelope_open(&e, moved.byte + 4, BYTES), RIM_OK);
}

static void each_rule_of_the_header_is_enforced(void **state) {
  (void)state;
  static const struct {
    size_t word;
    uint32_t value;
    rim_status status;
  } cases[] = {
      {0, 0, RIM_E_VERSION},        {0, RIM_ENVELOPE_LAYOUT + 1, RIM_E_VERSION},
      {1, 0, RIM_E_RANGE},          {1, 129, RIM_E_RANGE},
      {1, UINT32_MAX, RIM_E_RANGE}, {1, C + 1, RIM_E_TRUNCATED},
      {1, C - 1, RIM_E_SIZE},       {2, 0, RIM_E_RANGE},
      {2, 129, RIM_E_RANGE},        {2, 0x80000001u, RIM_E_RANGE},
      {2, F + 1, RIM_E_TRUNCATED},  {2, F - 1, RIM_E_SIZE},
      {3, 0, RIM_E_RANGE},          {3, RIM_ENVELOPE_MAX_BINS + 1, RIM_E_RANGE},
      {3, B + 1, RIM_E_TRUNCATED},  {3, B - 1, RIM_E_SIZE},
      {4, 0, RIM_E_RANGE},          {4, 1, RIM_OK},
      {5, 1, RIM_E_RANGE},
  };
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 1);
  const section good = make_section(&rng, 20);
  rim_envelope e;
  for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
    section s = good;
    put_u32(&s, 4 * cases[i].word, cases[i].value);
    assert_int_equal(rim_envelope_open(&e, s.byte, BYTES), cases[i].status);
  }
  const float bad[] = {0.0f, -0.0f, -1.0f, INFINITY, -INFINITY, NAN};
  for (size_t c = 0; c < C; ++c) {
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
      section s = good;
      put_f32(&s, A_AT + 4 * c, bad[i]);
      assert_int_equal(rim_envelope_open(&e, s.byte, BYTES), RIM_E_DATA);
    }
  }
  assert_int_equal(rim_envelope_open(&e, good.byte, BYTES), RIM_OK);
  assert_true(e.channels == C && e.features == F && e.bins == B && e.least_n == LEAST);
}

static void a_code_stands_for_its_power_of_two(void **state) {
  (void)state;
  for (int code = 0; code < 256; ++code) {
    const double exact = exp2((code - 128) / 8.0);
    const double ulp = nextafter(exact, INFINITY) - exact;
    assert_true(fabs(rim_envelope_variance((uint8_t)code) - exact) <= ulp);
  }
  assert_true(rim_envelope_variance(128) == 1.0 && rim_envelope_variance(0) == 0x1p-16);
}

static void the_best_is_the_one_that_the_definition_names(void **state) {
  (void)state;
  print_message("seed %u\n", SEED);
  unsigned contrasts = 0, partial = 0, none = 0;
  for (uint32_t trial = 0; trial < 3000; ++trial) {
    rim_rng rng;
    rim_rng_seed(&rng, SEED, 100 + trial);
    const section s = make_section(&rng, trial % 3 == 0 ? 200 : 12);
    const rim_envelope e = opened(&s);
    const data d = make_data(&rng, trial % 5 == 0 ? 2 : 15);
    for (uint32_t c = 0; c < C; ++c) {
      for (uint32_t f = 0; f < F; ++f) {
        const plain_best p = search_plainly(&s, &d, c, f);
        const rim_envelope_found found = rim_envelope_best(&e, c, f, d.n, d.s);
        assert_true(fabs(found.ln_anom - p.ln_anom) <= 1e-12 * p.ln_anom);
        none += p.ln_anom == 0.0;
        if (p.ln_anom - p.second <= 1e-12 * p.ln_anom)
          continue; /* a tie but for rounding */
        assert_int_equal(found.first, p.first);
        assert_int_equal(found.last, p.last);
        assert_int_equal(found.contrast, p.contrast);
        contrasts += p.contrast ? 1 : 0;
        partial += trial % 3 == 0;
      }
    }
  }
  assert_true(contrasts > 1000 && partial > 1000 && none > 100); /* all cases were met */
}

/* Of the n, level alone or contrast alone is judged. */
static section judge_only(const section *s, size_t kind) {
  section out = *s;
  for (size_t f = 0; f < F; ++f) {
    for (size_t i = 0; i < I; ++i)
      put_usual(&out, f, i, 1 - kind, 0);
  }
  return out;
}

static void contrast_is_blind_to_a_common_offset(void **state) {
  (void)state;
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 2);
  unsigned moved = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const section any = make_section(&rng, 20);
    const section contrast = judge_only(&any, 1), level = judge_only(&any, 0);
    const rim_envelope e = opened(&contrast), l = opened(&level);
    const data d = make_data(&rng, 12);
    data shifted = d;
    for (size_t k = 0; k <= B; ++k)
      shifted.s[k] += 37.5 * d.n[k];
    const rim_envelope_found a = rim_envelope_best(&e, 0, 0, d.n, d.s);
    const rim_envelope_found b = rim_envelope_best(&e, 0, 0, shifted.n, shifted.s);
    assert_true(fabs(a.ln_anom - b.ln_anom) <= 1e-9 * a.ln_anom);
    assert_true(a.first == b.first && a.last == b.last && a.contrast == b.contrast);
    moved += rim_envelope_best(&l, 0, 0, shifted.n, shifted.s).ln_anom >
             10.0 * rim_envelope_best(&l, 0, 0, d.n, d.s).ln_anom;
  }
  assert_true(moved > 190); /* level is not */
}

static void residuals_scale_by_their_square(void **state) {
  (void)state;
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 3);
  for (int trial = 0; trial < 200; ++trial) {
    const section any = make_section(&rng, 20);
    const data d = make_data(&rng, 12);
    data twice = d, mirrored = d;
    for (size_t k = 0; k <= B; ++k) {
      twice.s[k] *= 2.0;
      mirrored.s[k] *= -1.0;
    }
    section wide = any; /* 4 times the variance for twice the mean: the same odds */
    for (size_t i = CODE_AT; i < BYTES; ++i)
      wide.byte[i] = (uint8_t)(wide.byte[i] + 16);
    for (size_t c = 0; c < C; ++c) {
      float a;
      memcpy(&a, any.byte + A_AT + 4 * c, 4);
      put_f32(&wide, A_AT + 4 * c, 4.0f * a);
    }
    for (size_t kind = 0; kind < 2; ++kind) {
      const section s = judge_only(&any, kind), w = judge_only(&wide, kind);
      const rim_envelope e = opened(&s), v = opened(&w);
      const rim_envelope_found one = rim_envelope_best(&e, 1, 1, d.n, d.s);
      const rim_envelope_found four = rim_envelope_best(&e, 1, 1, twice.n, twice.s);
      const rim_envelope_found minus = rim_envelope_best(&e, 1, 1, mirrored.n, mirrored.s);
      const rim_envelope_found same = rim_envelope_best(&v, 1, 1, twice.n, twice.s);
      assert_true(four.ln_anom == 4.0 * one.ln_anom); /* powers of two: exact */
      assert_true(minus.ln_anom == one.ln_anom && same.ln_anom == one.ln_anom);
      assert_true(four.first == one.first && minus.last == one.last && same.first == one.first);
    }
  }
}

static void too_few_inside_or_outside_never_win(void **state) {
  (void)state;
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 4);
  section s = make_section(&rng, 20);
  for (size_t i = 0; i < I; ++i) {
    put_usual(&s, 0, i, 0, 1);
    put_usual(&s, 0, i, 1, 1);
  }
  const section contrast = judge_only(&s, 1);
  const rim_envelope e = opened(&s), only_contrast = opened(&contrast);
  /* All in bin 2, one short of enough, and as anomalous as can be. */
  data d = {{0}, {0}};
  for (size_t k = 3; k <= B; ++k) {
    d.n[k] = LEAST - 1;
    d.s[k] = 1e3;
  }
  assert_true(rim_envelope_best(&e, 0, 0, d.n, d.s).ln_anom == 0.0);
  for (size_t k = 3; k <= B; ++k)
    d.n[k] = LEAST;
  assert_true(rim_envelope_best(&e, 0, 0, d.n, d.s).ln_anom > 0.0);
  /* Enough inside: but a contrast needs a rest. */
  assert_true(rim_envelope_best(&only_contrast, 0, 0, d.n, d.s).ln_anom == 0.0);
  d.n[B] += LEAST - 1;
  assert_true(rim_envelope_best(&only_contrast, 0, 0, d.n, d.s).ln_anom == 0.0);
  d.n[B] += 1;
  const rim_envelope_found found = rim_envelope_best(&only_contrast, 0, 0, d.n, d.s);
  assert_true(found.ln_anom > 0.0 && found.contrast);
}

static void what_training_did_not_judge_never_wins(void **state) {
  (void)state;
  rim_rng rng;
  rim_rng_seed(&rng, SEED, 5);
  for (int trial = 0; trial < 200; ++trial) {
    section s = make_section(&rng, 20);
    for (size_t f = 0; f < F; ++f) {
      for (size_t i = 0; i < I; ++i) {
        put_usual(&s, f, i, 0, 0);
        put_usual(&s, f, i, 1, 0);
      }
    }
    const data d = make_data(&rng, 15);
    rim_envelope e = opened(&s);
    assert_true(rim_envelope_best(&e, 2, 1, d.n, d.s).ln_anom == 0.0);
    put_usual(&s, 1, 8, 0, 10); /* bins 1..2 */
    e = opened(&s);
    const rim_envelope_found found = rim_envelope_best(&e, 2, 1, d.n, d.s);
    if (d.n[3] - d.n[1] >= LEAST) {
      assert_true(found.ln_anom > 0.0 && found.first == 1 && found.last == 2 && !found.contrast);
    } else {
      assert_true(found.ln_anom == 0.0);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(every_truncation_is_refused_and_leaves_the_view),
      cmocka_unit_test(each_rule_of_the_header_is_enforced),
      cmocka_unit_test(a_code_stands_for_its_power_of_two),
      cmocka_unit_test(the_best_is_the_one_that_the_definition_names),
      cmocka_unit_test(contrast_is_blind_to_a_common_offset),
      cmocka_unit_test(residuals_scale_by_their_square),
      cmocka_unit_test(too_few_inside_or_outside_never_win),
      cmocka_unit_test(what_training_did_not_judge_never_wins),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
