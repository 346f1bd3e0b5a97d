/* SPDX-License-Identifier: MIT */
/* The monitor: missing pointers, images whose sections do not fit, memory whose words were changed;
 * and what an index of the search that a flipped bit spoils looks like. */
#include "monitor_bench.h"

#include <math.h>

#include "image/names.h"
#include "monitor/monitor_private.h"
#include "monitor/work.h"
#include "rim/lcm.h"
#include "search/search_private.h"

static bench b;

static void pointers_are_asked_for(void **state) {
  (void)state;
  size_t size = 7;
  rim_monitor *m = NULL;
  make_bench(&b, true);
  const void *image_bytes = b.blob.byte;
  const size_t n = b.blob.size;
  assert_int_equal(rim_monitor_size(NULL, n, &size), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_size(image_bytes, n, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_init(NULL, b.memory, sizeof b.memory, image_bytes, n),
                   RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_init(&m, NULL, sizeof b.memory, image_bytes, n), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_init(&m, b.memory, sizeof b.memory, NULL, n), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_attach(NULL, b.memory, sizeof b.memory, image_bytes, n),
                   RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_attach(&m, NULL, sizeof b.memory, image_bytes, n), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_attach(&m, b.memory, sizeof b.memory, NULL, n), RIM_E_ARGUMENT);
  assert_true(m == NULL && size == 7);
  row r;
  rim_verdict v;
  make_row(&r, true, 900, 0, 0.0);
  assert_int_equal(rim_monitor_step(NULL, &r.view, &v), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_step(b.monitor, NULL, &v), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_step(b.monitor, &r.view, NULL), RIM_E_ARGUMENT);
  rim_observation bare = r.view;
  bare.outcome = NULL;
  assert_int_equal(rim_monitor_step(b.monitor, &bare, &v), RIM_E_ARGUMENT);
  bare = r.view;
  bare.mean = NULL;
  assert_int_equal(rim_monitor_step(b.monitor, &bare, &v), RIM_E_ARGUMENT);
  bare = r.view;
  bare.sd = NULL;
  assert_int_equal(rim_monitor_step(b.monitor, &bare, &v), RIM_E_ARGUMENT);
  assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK); /* none of it was a row */
  assert_int_equal(rim_monitor_get_health(b.monitor).rows.rows, 1);
  rim_monitor_restart(NULL, 0.0);
  rim_monitor_restart(b.monitor, (double)NAN);
  const rim_interference_health none = {0};
  const rim_interference_health without = rim_interference_get_health(b.monitor);
  const rim_interference_health missing = rim_interference_get_health(NULL);
  assert_memory_equal(&without, &none, sizeof none);
  assert_memory_equal(&missing, &none, sizeof none);
  assert_int_equal(rim_monitor_get_health(b.monitor).rows.rows, 1);
}

static rim_status opened(const recipe *r) {
  static image blob;
  static _Alignas(8) uint8_t memory[1 << 20];
  rim_monitor *m = NULL;
  build(&blob, r);
  const rim_status status = rim_monitor_init(&m, memory, sizeof memory, blob.byte, blob.size);
  assert_true((m != NULL) == (status == RIM_OK));
  return status;
}

static void sections_must_fit(void **state) {
  (void)state;
  recipe r = calibrated[true];
  const float scales[4][2] = {{2.0f, 0.5f}, {1.0f, 0.0f}, {-1.0f, 1.0f}, {1.0f, (float)INFINITY}};
  for (size_t i = 0; i < 4; ++i) {
    r.section[RIM_SECTION_SCALES].size = 0;
    for (size_t k = 0; k < 2; ++k)
      f32(&r.section[RIM_SECTION_SCALES], (double)scales[i][k]);
    assert_int_equal(opened(&r), i == 0 ? RIM_OK : RIM_E_RANGE);
  }
  r.section[RIM_SECTION_SCALES].size = 4;
  assert_true(opened(&r) != RIM_OK);
  r = calibrated[false]; /* a trained image has no such scales */
  for (size_t k = 0; k < 2; ++k)
    f32(&r.section[RIM_SECTION_SCALES], 1.0);
  assert_true(opened(&r) != RIM_OK);
  r = calibrated[false];
  for (size_t k = 0; k < 64; ++k)
    u8(&r.section[RIM_SECTION_LEVEL], 0xff);
  assert_true(opened(&r) != RIM_OK);
  for (uint32_t outcomes = 0; outcomes <= 513; outcomes += 171) {
    r = calibrated[true];
    set_word(&r, RIM_CONFIG_OUTCOMES, outcomes);
    assert_true(opened(&r) != RIM_OK);
  }
}

/* What residuals are multiplied by, and the shift divided by: at half the residuals, a quarter of
 * the evidence for the same shift. */
static void scales_are_used(void **state) {
  (void)state;
  recipe r = calibrated[true];
  double shift[2], ln_anom[2] = {0.0, 0.0};
  for (int scaled = 0; scaled < 2; ++scaled) {
    rim_alarm last = {0};
    if (scaled)
      for (size_t k = 0; k < 2; ++k)
        f32(&r.section[RIM_SECTION_SCALES], 0.5);
    memset(&b, 0, sizeof b);
    b.external = true;
    build(&b.blob, &r);
    start(&b);
    for (uint32_t t = 0; t < 600; ++t) {
      const rim_verdict v = step(&b, 900, t, 3.0);
      ln_anom[scaled] = v.ln_anom;
      if (v.alarm.seq != 0)
        last = v.alarm;
    }
    assert_true(last.seq != 0 && last.channel[0] == 1);
    shift[scaled] = last.shift[0];
  }
  assert_true(rimi_abs(shift[0] - 3.0) < 0.4 && rimi_abs(shift[1] - 3.0) < 0.4);
  assert_true(rimi_abs(ln_anom[1] / ln_anom[0] - 0.25) < 0.05);
}

/* One word of the header after another; each is seen, and no monitor comes of it. */
static void changed_memory_is_not_attached_to(void **state) {
  (void)state;
  rim_monitor *m = NULL;
  for (int external = 0; external < 2; ++external) {
    make_bench(&b, external != 0);
    for (uint32_t t = 0; t < 40; ++t)
      (void)step(&b, 900, t, 0.0);
    rim_monitor *const own = b.monitor;
    uint32_t *const word[] = {&own->magic, &own->library, &own->header_bytes, &own->words[3],
                              &own->life.seq};
    for (size_t i = 0; i < sizeof word / sizeof word[0]; ++i) {
      ++*word[i];
      assert_true(rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size) !=
                  RIM_OK);
      --*word[i];
    }
    own->image.bytes += 8;
    assert_true(rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size) !=
                RIM_OK);
    own->image.bytes -= 8;
    assert_null(m);
    assert_int_equal(rim_monitor_attach(&m, b.memory, sizeof b.memory, b.blob.byte, b.blob.size),
                     RIM_OK);
    m = NULL;
  }
}

static void spoilt_indices_are_seen(void **state) {
  (void)state;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 200; ++t)
    (void)step(&b, 900, t, 0.0);
  rim_search *s = b.monitor->search;
  assert_true(rimi_search_indices_hold(s));
  for (int which = 0; which < 2; ++which) {
    channel_state *of_it = search_state(s, s->channel);
    search_hypothesis *h = which == 0 ? &of_it->time : &of_it->region;
    const search_hypothesis was = *h;
#define SPOILT(field, value)                                                                       \
  do {                                                                                             \
    h->field = (value);                                                                            \
    assert_false(rimi_search_indices_hold(s));                                                     \
    *h = was;                                                                                      \
    assert_true(rimi_search_indices_hold(s));                                                      \
  } while (0)
    SPOILT(family, SEARCH_DURING + 1);
    SPOILT(feature[0], REGION);
    SPOILT(feature[1], REGION);
    SPOILT(first[0], SEARCH_BINS);
    SPOILT(first[1], SEARCH_BINS);
    SPOILT(last[0], SEARCH_BINS);
    SPOILT(last[1], SEARCH_BINS);
  }
  s->top_feature = REGION;
  assert_false(rimi_search_indices_hold(s));
  s->top_feature = REGION - 1;
  assert_true(rimi_search_indices_hold(s));
  s->p_at = 2 * s->config.outcomes;
  assert_false(rimi_search_indices_hold(s));
}

static bool unit_is(const char *name, const char *unit) {
  return strcmp(rim_unit_of_name(name, strlen(name)), unit) == 0;
}

static void units_are_said_by_names(void **state) {
  (void)state;
  assert_string_equal(rim_unit_of_name(NULL, 0), "");
  const char *const prefix[] = {"x.", "u.", "s.", "z.", "m.", "sd.", ""};
  for (size_t i = 0; i < sizeof prefix / sizeof prefix[0]; ++i) {
    char name[40];
    strcpy(name, prefix[i]);
    strcat(name, "speed_mps");
    assert_true(unit_is(name, "m/s"));
    strcpy(name, prefix[i]);
    strcat(name, "_mps"); /* no name before the unit */
    assert_true(unit_is(name, ""));
  }
  assert_true(unit_is("q._mps", "m/s")); /* that is no role */
  assert_true(unit_is("s.speed", "") && unit_is("s.speed_", "") && unit_is("s.speed_no", ""));
  assert_true(unit_is("s.speed_averylongsuffixindeed", "") && unit_is("s", "") &&
              unit_is("s.", ""));
}

/* RIM_MODEL of images that lack what it tells. */
static void a_model_is_told_as_far_as_it_is_known(void **state) {
  (void)state;
  static image blob;
  static uint8_t out[RIM_LCM_MODEL_SIZE];
  static rim_model_message m;
  rim_image view;
  recipe r = calibrated[true];
  build(&blob, &r);
  assert_int_equal(rim_image_open(&view, blob.byte, blob.size), RIM_OK);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, D + O, 0), RIM_E_RANGE);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 1), RIM_OK);
  assert_int_equal(rim_lcm_unpack_model(&m, out, sizeof out), RIM_OK);
  assert_true(m.external && m.flags == 1 && m.count == D + O && m.features == D);
  assert_true(strcmp(m.quantity[0].name, "a") == 0 && m.quantity[2].high == 300.0);
  r.section[RIM_SECTION_NAMES].size = r.section[RIM_SECTION_FEATURES].size = 0;
  set_word(&r, RIM_CONFIG_EXTERNAL, 0);
  build(&blob, &r);
  assert_int_equal(rim_image_open(&view, blob.byte, blob.size), RIM_OK);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_OK);
  assert_int_equal(rim_lcm_unpack_model(&m, out, sizeof out), RIM_OK);
  assert_true(!m.external && m.quantity[0].name[0] == '\0' && m.quantity[2].high == 0.0);
  for (size_t k = 0; k < 4; ++k)
    u8(&r.section[RIM_SECTION_FEATURES], 0);
  build(&blob, &r);
  assert_int_equal(rim_image_open(&view, blob.byte, blob.size), RIM_OK);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_OK);
  assert_int_equal(rim_lcm_unpack_model(&m, out, sizeof out), RIM_OK);
  assert_true(m.quantity[0].high == 0.0); /* a range that does not fit is none */
  const rim_config_word large[2] = {RIM_CONFIG_FEATURES, RIM_CONFIG_OUTCOMES};
  for (size_t i = 0; i < 2; ++i) {
    recipe bad = r;
    set_word(&bad, large[i], UINT16_MAX + 1u);
    build(&blob, &bad);
    assert_int_equal(rim_image_open(&view, blob.byte, blob.size), RIM_OK);
    assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_E_RANGE);
  }
  r.section[RIM_SECTION_CONFIG].size = 8;
  build(&blob, &r);
  assert_int_equal(rim_image_open(&view, blob.byte, blob.size), RIM_OK);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_E_RANGE);
}

/* The bound of an image with one region feature alone: no pair is searched. */
static void one_feature_has_no_pairs(void **state) {
  (void)state;
  static image blob;
  rim_work_counts n;
  recipe r = calibrated[true];
  set_word(&r, RIM_CONFIG_REGION_FEATURES, 1);
  r.section[RIM_SECTION_REGION].size = 4;
  build(&blob, &r);
  assert_int_equal(rimi_work_counts_of(blob.byte, blob.size, &n), RIM_OK);
  assert_true(n.region_features == 1 && n.pairs == 0);
  rim_work one, two;
  rimi_work_bound(&n, &one);
  build(&blob, &calibrated[true]);
  assert_int_equal(rimi_work_counts_of(blob.byte, blob.size, &n), RIM_OK);
  rimi_work_bound(&n, &two);
  assert_true(one.search > 0 && one.search < two.search && one.halving < two.halving);
}

/* The last value of each number of the configuration that is taken, and the next. */
static void the_ends_of_a_configuration(void **state) {
  (void)state;
  static image blob;
  static const struct {
    rim_config_word word;
    uint32_t last;
    bool external;
  } of[] = {{RIM_CONFIG_SMALL, 1, true},           {RIM_CONFIG_SMALL, 1, false},
            {RIM_CONFIG_BLOCK_ROWS, 10000, false}, {RIM_CONFIG_BUDGET, 64, true},
            {RIM_CONFIG_BUDGET, 64, false},        {RIM_CONFIG_PERSISTENCE, UINT16_MAX, false},
            {RIM_CONFIG_CLEAR, UINT16_MAX, false}, {RIM_CONFIG_SCANS, UINT16_MAX, true},
            {RIM_CONFIG_EDGES, UINT16_MAX, true},  {RIM_CONFIG_MOVES, UINT16_MAX, true}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    for (uint32_t more = 0; more < 2; ++more) {
      recipe r = calibrated[of[i].external];
      size_t size = 0;
      set_word(&r, of[i].word, of[i].last + more);
      build(&blob, &r);
      assert_int_equal(rim_monitor_size(blob.byte, blob.size, &size), more ? RIM_E_CONFIG : RIM_OK);
    }
  }
}

/* A region may be of every feature. */
static void every_feature_may_be_a_place(void **state) {
  (void)state;
  static image blob;
  size_t size = 0;
  recipe r = calibrated[true];
  r.section[RIM_SECTION_REGION].size = 0;
  set_word(&r, RIM_CONFIG_REGION_FEATURES, D);
  for (unsigned f = 0; f < D; ++f) {
    u16(&r.section[RIM_SECTION_REGION], f);
    u16(&r.section[RIM_SECTION_REGION], 0xffff);
  }
  build(&blob, &r);
  assert_int_equal(rim_monitor_size(blob.byte, blob.size, &size), RIM_OK);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(pointers_are_asked_for),
      cmocka_unit_test(sections_must_fit),
      cmocka_unit_test(scales_are_used),
      cmocka_unit_test(changed_memory_is_not_attached_to),
      cmocka_unit_test(spoilt_indices_are_seen),
      cmocka_unit_test(units_are_said_by_names),
      cmocka_unit_test(a_model_is_told_as_far_as_it_is_known),
      cmocka_unit_test(one_feature_has_no_pairs),
      cmocka_unit_test(the_ends_of_a_configuration),
      cmocka_unit_test(every_feature_may_be_a_place),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
