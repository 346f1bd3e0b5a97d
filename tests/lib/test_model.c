/* SPDX-License-Identifier: MIT */
/* RIM_MODEL: the names, units and ranges of an image, with the bytes of lcm-gen's encoder. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "rim/lcm.h"
#include "section_bytes.h"

#include <rim_model_t.h>

enum { FEATURES = 14, OUTCOMES = 3, QUANTITIES = FEATURES + OUTCOMES };

static bytes whole;
static rim_image view;
static char name_of[QUANTITIES][100];

static void add_text(bytes *b, const char *text) {
  while (*text != '\0')
    u8(b, (unsigned char)*text++);
}

/* Fourteen features and three outcomes: two parts. One name is longer than its room, one
 * fills it, and leaves none for its end. */
static int set_up(void **state) {
  (void)state;
  static bytes section[3];
  static const uint32_t id[3] = {RIM_SECTION_CONFIG, RIM_SECTION_NAMES, RIM_SECTION_FEATURES};
  memset(section, 0, sizeof section);
  for (uint32_t w = 0; w < RIM_CONFIG_WORDS; ++w)
    u32(&section[0], w == RIM_CONFIG_FEATURES     ? FEATURES
                     : w == RIM_CONFIG_OUTCOMES   ? OUTCOMES
                     : w == RIM_CONFIG_PERIOD_US  ? 50000
                     : w == RIM_CONFIG_BLOCK_ROWS ? 5
                                                  : 0);
  for (uint32_t i = 0; i < QUANTITIES; ++i) {
    snprintf(name_of[i], sizeof name_of[i],
             i == 4   ? "s.%070u_mps"
             : i == 5 ? "s.%058u_mps"
             : i == 6 ? "s.plain%u"
             : i == 7 ? "s.turn%u_radps2"
                      : "s.name%u_mps",
             (unsigned)i);
    add_text(&section[1], name_of[i]);
    add_text(&section[1], "\n");
  }
  for (uint32_t i = 0; i < FEATURES; ++i)
    f32(&section[2], -1.5 * i);
  for (uint32_t i = 0; i < FEATURES; ++i)
    f32(&section[2], 2.5 * (i + 1));
  image_of(&whole, id, section, 3);
  return rim_image_open(&view, whole.byte, whole.size) == RIM_OK ? 0 : -1;
}

/* Of a name without one: none; the longest fills its room but for its end. */
static const char *unit_of(uint32_t i) { return i == 6 ? "" : i == 7 ? "rad/s^2" : "m/s"; }

static void generated(rim_model_t *g, uint32_t first) {
  memset(g, 0, sizeof *g);
  g->model_id = 0x1234567;
  g->features = FEATURES;
  g->outcomes = OUTCOMES;
  g->period_us = 50000;
  g->block_rows = 5;
  g->first = (int32_t)first;
  g->count = first == 0 ? 12 : 5;
  g->flags = 1;
  for (uint32_t i = 0; i < (uint32_t)g->count; ++i) {
    memcpy(g->name[i], name_of[first + i], 63);
    memcpy(g->unit[i], unit_of(first + i), strlen(unit_of(first + i)));
    if (first + i < FEATURES) {
      g->low[i] = -1.5 * (first + i);
      g->high[i] = 2.5 * (first + i + 1);
    }
  }
}

static void parts_equal_the_generated_encoder(void **state) {
  (void)state;
  for (uint32_t first = 0; first < QUANTITIES; first += RIM_MODEL_QUANTITIES) {
    static rim_model_t g;
    static rim_model_message back;
    static uint8_t ours[RIM_LCM_MODEL_SIZE], theirs[RIM_LCM_MODEL_SIZE];
    generated(&g, first);
    assert_int_equal(rim_model_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_MODEL_SIZE);
    assert_int_equal(rim_lcm_pack_model(ours, sizeof ours, &view, first, 1), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
    assert_int_equal(rim_lcm_unpack_model(&back, ours, sizeof ours), RIM_OK);
    assert_int_equal(back.model_id, 0x1234567);
    assert_true(back.features == FEATURES && back.outcomes == OUTCOMES && !back.external);
    assert_true(back.period_us == 50000 && back.block_rows == 5 && back.flags == 1);
    assert_true(back.first == first && back.count == (first == 0 ? 12u : 5u));
    for (uint32_t i = 0; i < back.count; ++i) {
      assert_true(strncmp(back.quantity[i].name, name_of[first + i], 63) == 0);
      assert_string_equal(back.quantity[i].unit, unit_of(first + i));
      assert_true(back.quantity[i].high == (first + i < FEATURES ? 2.5 * (first + i + 1) : 0.0));
    }
  }
}

static void misuse_is_refused(void **state) {
  (void)state;
  uint8_t out[RIM_LCM_MODEL_SIZE];
  rim_image closed;
  memset(&closed, 0, sizeof closed);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out - 1, &view, 0, 0), RIM_E_SIZE);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, QUANTITIES, 0), RIM_E_RANGE);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &closed, 0, 0), RIM_E_ARGUMENT);
  assert_int_equal(rim_lcm_pack_model(NULL, sizeof out, &view, 0, 0), RIM_E_ARGUMENT);
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, NULL, 0, 0), RIM_E_ARGUMENT);
}

/* Whether rows bring their own predictions. */
static void predictions_of_the_caller_are_said(void **state) {
  (void)state;
  static rim_model_message back;
  uint8_t out[RIM_LCM_MODEL_SIZE];
  const uint8_t *config;
  size_t config_bytes;
  assert_int_equal(rim_image_section(&view, RIM_SECTION_CONFIG, &config, &config_bytes), RIM_OK);
  uint8_t *at = whole.byte + (config - whole.byte) + 4u * RIM_CONFIG_EXTERNAL;
  at[0] = 1;
  assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 6), RIM_OK);
  assert_true(out[36] == 1 && out[37] == 6);
  assert_int_equal(rim_lcm_unpack_model(&back, out, sizeof out), RIM_OK);
  assert_true(back.external && back.flags == 6);
  at[0] = 0;
}

/* An index is a u16: as many features, and as many outcomes, are said, and not one more. */
static void as_many_as_an_index_has(void **state) {
  (void)state;
  const uint32_t most = UINT16_MAX, word[2] = {RIM_CONFIG_FEATURES, RIM_CONFIG_OUTCOMES};
  uint8_t out[RIM_LCM_MODEL_SIZE];
  const uint8_t *config;
  size_t config_bytes;
  assert_int_equal(rim_image_section(&view, RIM_SECTION_CONFIG, &config, &config_bytes), RIM_OK);
  for (size_t i = 0; i < 2; ++i) {
    uint8_t *at = whole.byte + (config - whole.byte) + 4u * word[i]; /* little endian */
    uint8_t before[4];
    memcpy(before, at, sizeof before);
    at[0] = at[1] = UINT8_MAX;
    assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_OK);
    assert_int_equal(out[12 + 4 * i + 2] * 256 + out[12 + 4 * i + 3], most);
    at[0] = at[1] = 0;
    at[2] = 1;
    assert_int_equal(rim_lcm_pack_model(out, sizeof out, &view, 0, 0), RIM_E_RANGE);
    memcpy(at, before, sizeof before);
  }
}

/* As many features and outcomes as there may be are read, and a part behind the last of them. */
static void the_last_part_is_read(void **state) {
  (void)state;
  static rim_model_message back;
  static uint8_t message[RIM_LCM_MODEL_SIZE];
  assert_int_equal(rim_lcm_pack_model(message, sizeof message, &view, 12, 0), RIM_OK);
  message[14] = message[15] = message[18] = message[19] = UINT8_MAX;
  assert_int_equal(rim_lcm_unpack_model(&back, message, sizeof message), RIM_OK);
  assert_true(back.features == UINT16_MAX && back.outcomes == UINT16_MAX);
  const uint32_t all = 2u * UINT16_MAX;
  message[29] = (uint8_t)(all >> 16);
  message[30] = (uint8_t)(all >> 8);
  message[31] = (uint8_t)all;
  message[35] = 0; /* none follows */
  assert_int_equal(rim_lcm_unpack_model(&back, message, sizeof message), RIM_OK);
  assert_true(back.first == all && back.count == 0);
  message[35] = 1;
  assert_int_equal(rim_lcm_unpack_model(&back, message, sizeof message), RIM_E_RANGE);
}

static void wrong_messages_are_refused(void **state) {
  (void)state;
  static rim_model_message back;
  static uint8_t good[RIM_LCM_MODEL_SIZE + 1], bad[RIM_LCM_MODEL_SIZE + 1];
  assert_int_equal(rim_lcm_pack_model(good, sizeof good, &view, 12, 0), RIM_OK);
  for (size_t n = 0; n < RIM_LCM_MODEL_SIZE; ++n)
    assert_int_equal(rim_lcm_unpack_model(&back, good, n), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_model(&back, good, sizeof good), RIM_E_SIZE);
  /* Byte, value, what is said: another type, more outcomes than an index has, parts outside. */
  const struct {
    size_t at;
    uint8_t value;
    rim_status wanted;
  } hit[] = {{0, 0, RIM_E_MAGIC},    {12, 1, RIM_E_RANGE},        {16, 255, RIM_E_RANGE},
             {31, 18, RIM_E_RANGE},  {35, 6, RIM_E_RANGE},        {35, 13, RIM_E_RANGE},
             {32, 128, RIM_E_RANGE}, {38 + 63, 'x', RIM_E_RANGE}, {38 + 768 + 7, 'x', RIM_E_RANGE}};
  for (size_t i = 0; i < sizeof hit / sizeof hit[0]; ++i) {
    memcpy(bad, good, sizeof bad);
    bad[hit[i].at] = hit[i].value;
    assert_int_equal(rim_lcm_unpack_model(&back, bad, RIM_LCM_MODEL_SIZE), hit[i].wanted);
  }
  memcpy(bad, good, sizeof bad);
  memset(bad + RIM_LCM_MODEL_SIZE - 8, 0xff, 8); /* NaN */
  assert_int_equal(rim_lcm_unpack_model(&back, bad, RIM_LCM_MODEL_SIZE), RIM_E_DATA);
  assert_int_equal(rim_lcm_unpack_model(NULL, good, RIM_LCM_MODEL_SIZE), RIM_E_ARGUMENT);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(parts_equal_the_generated_encoder),
      cmocka_unit_test(misuse_is_refused),
      cmocka_unit_test(predictions_of_the_caller_are_said),
      cmocka_unit_test(as_many_as_an_index_has),
      cmocka_unit_test(the_last_part_is_read),
      cmocka_unit_test(wrong_messages_are_refused),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
