/* channels: rows to blocks to standardised values, by a model small enough to follow by hand. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "rim/channels.h"
#include "rim/real.h"
#include "rim/rng.h"

/* Features: 0 a command, 1 and 2 sensors; outcomes are features 1 and 2. */
enum { D = 3, O = 2, BLOCK = 4 };
enum { MODEL_BYTES = RIM_NOMINAL_BYTES(D, O, 1, 1) };

typedef struct model {
  _Alignas(8) uint8_t bytes[MODEL_BYTES];
  rim_nominal view;
} model;

static void put_f32(uint8_t *bytes, size_t i, float f) {
  uint32_t v;
  memcpy(&v, &f, 4);
  for (int k = 0; k < 4; ++k)
    bytes[4 * i + (size_t)k] = (uint8_t)(v >> (8 * k));
}

/* mean = offset + map x, standard deviation sd; inputs are not scaled. */
static void make_model(model *m, const float map[O][D], const float offset[O], float sd) {
  memset(m, 0, sizeof *m);
  const uint8_t header[6] = {RIM_NOMINAL_LAYOUT, D, O, 1, 1, 1};
  for (size_t i = 0; i < 6; ++i)
    m->bytes[4 * i] = header[i];
  size_t at = RIM_NOMINAL_HEADER_WORDS;
  at += D; /* centre 0 */
  for (int i = 0; i < D; ++i)
    put_f32(m->bytes, at++, 1.0f);
  at += D; /* gate weight 0 */
  put_f32(m->bytes, at++, 1.0f);
  put_f32(m->bytes, at++, 1.0f);
  at += 2 + D;
  for (int o = 0; o < O; ++o)
    put_f32(m->bytes, at++, sd * sd);
  for (int o = 0; o < O; ++o)
    put_f32(m->bytes, at++, offset[o]);
  for (int o = 0; o < O; ++o) {
    for (int i = 0; i < D; ++i)
      put_f32(m->bytes, at++, map[o][i]);
  }
  assert_int_equal(rim_nominal_open(&m->view, m->bytes, MODEL_BYTES), RIM_OK);
}

typedef struct fixture {
  model step, level, increment;
  uint8_t outcome_feature[4];
  uint8_t command[D];
  rim_channels_config config;
  _Alignas(8) uint8_t memory[RIM_CHANNELS_SIZE(D, O, 4) + 8];
  rim_channels *channels;
} fixture;

static void make_fixture(fixture *f) {
  memset(f, 0, sizeof *f);
  const float zero[O] = {0, 0};
  const float own[O][D] = {{0, 1, 0}, {0, 0, 1}};       /* stays as it is */
  const float other[O][D] = {{0, 0, 2}, {0, 0.5f, 0}};  /* first is twice the second */
  const float driven[O][D] = {{3, 0, 0}, {1.5f, 0, 0}}; /* changes with the command */
  make_model(&f->step, own, zero, 0.5f);
  make_model(&f->level, other, zero, 0.25f);
  make_model(&f->increment, driven, zero, 2.0f);
  f->outcome_feature[0] = 1;
  f->outcome_feature[2] = 2;
  f->command[0] = 1;
  f->config.features = D;
  f->config.outcomes = O;
  f->config.block_rows = BLOCK;
  f->config.kinds = 0x0f;
  f->config.period_s = 1.0;
  f->config.step = &f->step.view;
  f->config.level = &f->level.view;
  f->config.increment = &f->increment.view;
  f->config.outcome_feature = f->outcome_feature;
  f->config.command = f->command;
  assert_int_equal(
      rim_channels_init(&f->channels, f->memory, RIM_CHANNELS_SIZE(D, O, 4), &f->config), RIM_OK);
}

static void close_to(double a, double b) {
  assert_true(rim_abs(a - b) <= 1e-12 * (1.0 + rim_abs(b)));
}

static void refuses_bad_configurations(void **state) {
  (void)state;
  fixture f;
  make_fixture(&f);
  const size_t size = RIM_CHANNELS_SIZE(D, O, 4);
  rim_channels *c = NULL;
  assert_int_equal(rim_channels_init(&c, f.memory, size - 1, &f.config), RIM_E_SIZE);
  assert_int_equal(rim_channels_init(&c, f.memory + 1, size, &f.config), RIM_E_ALIGN);
  assert_int_equal(rim_channels_init(NULL, f.memory, size, &f.config), RIM_E_ARGUMENT);
  rim_channels_config bad = f.config;
  bad.kinds = 0;
  assert_int_equal(rim_channels_init(&c, f.memory, size, &bad), RIM_E_CONFIG);
  bad = f.config;
  bad.level = NULL;
  assert_int_equal(rim_channels_init(&c, f.memory, size, &bad), RIM_E_CONFIG);
  bad = f.config;
  bad.features = D + 1; /* the models have another shape */
  assert_int_equal(rim_channels_init(&c, f.memory, size + 100, &bad), RIM_E_CONFIG);
  bad = f.config;
  bad.block_rows = 0;
  assert_int_equal(rim_channels_init(&c, f.memory, size, &bad), RIM_E_CONFIG);
  assert_null(c);
}

static void stays_within_its_memory(void **state) {
  (void)state;
  fixture f;
  make_fixture(&f);
  const size_t size = RIM_CHANNELS_SIZE(D, O, 4);
  memset(f.memory + size, 0xa5, 8);
  assert_int_equal(rim_channels_init(&f.channels, f.memory, size, &f.config), RIM_OK);
  for (int i = 0; i < 50; ++i) {
    const double x[D] = {0.1, i, 0.5 * i};
    (void)rim_channels_row(f.channels, i, x, NULL, NULL, NULL);
  }
  for (size_t i = 0; i < 8; ++i)
    assert_int_equal(f.memory[size + i], 0xa5);
}

static void values_follow_the_definitions(void **state) {
  (void)state;
  fixture f;
  make_fixture(&f);
  rim_rng rng;
  print_message("seed 3\n");
  rim_rng_seed(&rng, 3, 0);
  double x[3 * BLOCK][D];
  int blocks = 0;
  for (int t = 0; t < 3 * BLOCK; ++t) {
    for (int i = 0; i < D; ++i)
      x[t][i] = rim_rng_normal(&rng);
    const int made = rim_channels_row(f.channels, t, x[t], NULL, NULL, NULL);
    /* The first block has no increment. */
    assert_int_equal(made, t % BLOCK == BLOCK - 1 && t >= BLOCK ? 1 : 0);
    blocks += made;
  }
  assert_int_equal(blocks, 2);
  double now[D] = {0}, before[D] = {0}, sum[O] = {0}, squares[O] = {0};
  for (int t = BLOCK; t < 3 * BLOCK; ++t) {
    for (int i = 0; i < D; ++i)
      (t < 2 * BLOCK ? before : now)[i] += x[t][i] / BLOCK;
  }
  for (int t = 2 * BLOCK; t < 3 * BLOCK; ++t) {
    for (int o = 0; o < O; ++o) {
      const double r = rim_clamp((x[t][o + 1] - x[t - 1][o + 1]) / 0.5, -6.0, 6.0);
      sum[o] += r / BLOCK;
      squares[o] += r * r / BLOCK;
    }
  }
  const double *v = rim_channels_values(f.channels);
  const double u = 0.5 * (before[0] + now[0]);
  close_to(v[0], (now[1] - 2.0 * now[2]) / 0.25);
  close_to(v[1], (now[2] - 0.5 * now[1]) / 0.25);
  close_to(v[2], (now[1] - before[1] - 3.0 * u) / 2.0);
  close_to(v[3], (now[2] - before[2] - 1.5 * u) / 2.0);
  for (int o = 0; o < O; ++o) {
    const double variance = BLOCK * (squares[o] - sum[o] * sum[o]) / (BLOCK - 1);
    close_to(v[4 + o], rim_log(variance));
    close_to(v[6 + o], sum[o]);
    close_to(rim_channels_context(f.channels)[o + 1], now[o + 1]);
  }
  assert_int_equal(rim_channels_kind(f.channels, 5), RIM_KIND_VARIANCE);
  assert_int_equal(rim_channels_kind(f.channels, rim_channels_count(f.channels)), RIM_KIND_SHIFT);
  assert_int_equal(rim_channels_kind(f.channels, UINT16_MAX), RIM_KIND_SHIFT);
  assert_int_equal(rim_channels_outcome(f.channels, 5), 1);
  close_to(rim_channels_unit(f.channels, 0), 0.25);
  close_to(rim_channels_unit(f.channels, 3), 2.0);
  close_to(rim_channels_unit(f.channels, 6), 0.5);
}

static void bad_rows_are_counted_and_change_nothing(void **state) {
  (void)state;
  fixture a, b;
  make_fixture(&a);
  make_fixture(&b);
  a.config.period_s = b.config.period_s = 0.0; /* no gaps in this test */
  const size_t size = RIM_CHANNELS_SIZE(D, O, 4);
  assert_int_equal(rim_channels_init(&a.channels, a.memory, size, &a.config), RIM_OK);
  assert_int_equal(rim_channels_init(&b.channels, b.memory, size, &b.config), RIM_OK);
  const double nan = rim_from_bits(UINT64_C(0x7ff8000000000000));
  const double infinity = rim_from_bits(UINT64_C(0x7ff0000000000000));
  for (int t = 0; t < 4 * BLOCK; ++t) {
    const double x[D] = {0.1 * t, t * t, 1.0 - t};
    const double bad[D] = {0.0, t % 2 ? nan : infinity, 0.0};
    assert_int_equal(rim_channels_row(a.channels, t + 0.5, bad, NULL, NULL, NULL), RIM_E_DATA);
    if (t > 0) {
      assert_int_equal(rim_channels_row(a.channels, t - 1, x, NULL, NULL, NULL), RIM_E_DATA);
    }
    assert_int_equal(rim_channels_row(a.channels, nan, x, NULL, NULL, NULL), RIM_E_DATA);
    const int made = rim_channels_row(a.channels, t, x, NULL, NULL, NULL);
    assert_int_equal(made, rim_channels_row(b.channels, t, x, NULL, NULL, NULL));
    if (made) {
      assert_memory_equal(rim_channels_values(a.channels), rim_channels_values(b.channels),
                          8 * sizeof(double));
    }
  }
  const rim_channels_health *h = rim_channels_get_health(a.channels);
  assert_int_equal(h->not_finite, 8 * BLOCK);
  assert_int_equal(h->time_back, 4 * BLOCK - 1);
  assert_int_equal(h->rows_used, 4 * BLOCK);
  assert_int_equal(h->rows, 16 * BLOCK - 1);
}

static void a_long_gap_begins_the_block_anew(void **state) {
  (void)state;
  fixture f;
  make_fixture(&f);
  const double x[D] = {0, 1, 1};
  double t = 0;
  for (int i = 0; i < 2 * BLOCK - 1; ++i) {
    assert_int_equal(rim_channels_row(f.channels, t, x, NULL, NULL, NULL), 0);
    t += 1.0;
  }
  t += 10.0;
  for (int i = 0; i < 2 * BLOCK; ++i) {
    /* Two whole blocks are needed again: one to compare with, one to judge. */
    assert_int_equal(rim_channels_row(f.channels, t, x, NULL, NULL, NULL), i == 2 * BLOCK - 1);
    t += 1.0;
  }
  assert_int_equal(rim_channels_get_health(f.channels)->gaps, 1);
}

static void external_predictions_give_a_value_a_row(void **state) {
  (void)state;
  fixture f;
  make_fixture(&f);
  rim_channels_config config = {
      .features = D, .outcomes = O, .block_rows = 1, .kinds = 1, .external = true};
  const size_t size = RIM_CHANNELS_SIZE(D, O, 1);
  assert_int_equal(rim_channels_init(&f.channels, f.memory, size, &config), RIM_OK);
  const double x[D] = {1, 2, 3}, z[O] = {5, 7}, m[O] = {4, 9}, sd[O] = {0.5, 4}, bad[O] = {0.5, 0};
  assert_int_equal(rim_channels_row(f.channels, 0, x, z, m, sd), 1);
  close_to(rim_channels_values(f.channels)[0], 2.0);
  close_to(rim_channels_values(f.channels)[1], -0.5);
  close_to(rim_channels_unit(f.channels, 1), 4.0);
  assert_int_equal(rim_channels_row(f.channels, 1, x, z, m, bad), RIM_E_DATA);
  assert_int_equal(rim_channels_row(f.channels, 1, x, NULL, m, sd), RIM_E_ARGUMENT);
  config.block_rows = 2;
  assert_int_equal(rim_channels_init(&f.channels, f.memory, size, &config), RIM_E_CONFIG);
}

/* One outcome's prediction is 1 higher where feature 2 is above 0, by each kind of model. */
static void corrections_are_added_to_the_kinds_they_name(void **state) {
  (void)state;
  _Alignas(8) uint8_t section[RIM_CORRECT_BYTES(O, 1)];
  rim_correct_region region = {.is_box = true, .confidence = 1.0};
  region.region.dims = 1;
  region.region.feature[0] = 2;
  region.region.upper[0] = 100.0;
  const double shift[O] = {0.0, 1.0};
  double value[2][5][4 * O]; /* [without, with][mask's bit][channel]; the fifth: external */
  for (unsigned bit = 0; bit < 5; ++bit) {
    const bool is_external = bit == 4;
    const rim_correct_model m = {.features = D,
                                 .outcomes = O,
                                 .regions = 1,
                                 .kinds = is_external ? 1u : 1u << bit,
                                 .region = &region,
                                 .shift = shift};
    rim_correct view;
    assert_int_equal(rim_correct_pack(&m, section, sizeof section), RIM_OK);
    assert_int_equal(rim_correct_open(&view, section, sizeof section), RIM_OK);
    for (int with = 0; with < 2; ++with) {
      fixture f;
      make_fixture(&f);
      rim_channels_config config = {
          .features = D, .outcomes = O, .block_rows = 1, .kinds = 1, .external = true};
      if (!is_external)
        config = f.config;
      config.correct = with ? &view : NULL;
      const size_t size = RIM_CHANNELS_SIZE(D, O, is_external ? 1 : 4);
      assert_int_equal(rim_channels_init(&f.channels, f.memory, size, &config), RIM_OK);
      const double m0[O] = {0, 0}, sd[O] = {2, 2};
      for (int i = 0; i < 2 * BLOCK; ++i) {
        const double x[D] = {1, 2, 1.2 + 0.1 * (i % 3)}, z[O] = {2, x[2]};
        assert_true(rim_channels_row(f.channels, i, x, z, m0, sd) >= 0);
      }
      memcpy(value[with][bit], rim_channels_values(f.channels),
             (is_external ? O : 4 * O) * sizeof(double));
    }
  }
  for (size_t c = 0; c < 4 * O; ++c) {
    const bool second = c % O == 1;
    const size_t kind = c / O; /* SHIFT, INCREMENT, VARIANCE, STEP: sd .25, 2, -, .5 */
    close_to(value[1][0][c], value[0][0][c] - (second && kind == 0 ? 4.0 : 0.0));
    close_to(value[1][1][c], value[0][1][c] - (second && kind == 1 ? 0.5 : 0.0));
    close_to(value[1][2][c], value[0][2][c]); /* VARIANCE has no prediction of its own */
    close_to(value[1][3][c], value[0][3][c] - (second && kind == 3 ? 2.0 : 0.0));
  }
  close_to(value[1][4][0], value[0][4][0]);
  close_to(value[1][4][1], value[0][4][1] - 0.5);
  fixture f;
  make_fixture(&f);
  const rim_correct closed = {0};
  f.config.correct = &closed;
  assert_int_equal(rim_channels_init(&f.channels, f.memory, RIM_CHANNELS_SIZE(D, O, 4), &f.config),
                   RIM_E_CONFIG);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(refuses_bad_configurations),
      cmocka_unit_test(stays_within_its_memory),
      cmocka_unit_test(values_follow_the_definitions),
      cmocka_unit_test(bad_rows_are_counted_and_change_nothing),
      cmocka_unit_test(a_long_gap_begins_the_block_anew),
      cmocka_unit_test(external_predictions_give_a_value_a_row),
      cmocka_unit_test(corrections_are_added_to_the_kinds_they_name),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
