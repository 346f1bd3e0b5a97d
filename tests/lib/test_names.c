/* SPDX-License-Identifier: MIT */
/* Names out of an image, and the units that they end in. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "image/names.h"
#include "rim/image.h"
#include "section_bytes.h"

/* An image with this one section. */
static void make_image(bytes *b, uint32_t id, const char *text) {
  static bytes section;
  section.size = strlen(text);
  memcpy(section.byte, text, section.size);
  image_of(b, &id, &section, 1);
}

static void names_come_in_order(void **state) {
  (void)state;
  static bytes b;
  rim_image view;
  const char *text;
  size_t length;
  make_image(&b, RIM_SECTION_NAMES, "u.push\ns.speed_mps\n\ns.speed_mps\ncut");
  assert_int_equal(rim_image_open(&view, b.byte, b.size), RIM_OK);
  const char *const wanted[4] = {"u.push", "s.speed_mps", "", "s.speed_mps"};
  for (uint32_t i = 0; i < 4; ++i) {
    assert_int_equal(rim_image_name(&view, i, &text, &length), RIM_OK);
    assert_int_equal(length, strlen(wanted[i]));
    assert_memory_equal(text, wanted[i], length);
  }
  /* What has no end of line is no name. */
  assert_int_equal(rim_image_name(&view, 4, &text, &length), RIM_E_RANGE);
  assert_null(text);
  assert_int_equal(length, 0);
  assert_int_equal(rim_image_name(&view, UINT32_MAX, &text, &length), RIM_E_RANGE);
}

/* Also the first name may be empty. */
static void the_first_name_may_be_empty(void **state) {
  (void)state;
  static bytes b;
  rim_image view;
  const char *text;
  size_t length = 7;
  make_image(&b, RIM_SECTION_NAMES, "\nsecond\n");
  assert_int_equal(rim_image_open(&view, b.byte, b.size), RIM_OK);
  assert_int_equal(rim_image_name(&view, 0, &text, &length), RIM_OK);
  assert_int_equal(length, 0);
  assert_int_equal(rim_image_name(&view, 1, &text, &length), RIM_OK);
  assert_int_equal(length, 6);
}

/* A line's end right behind the section is none of its names'. */
static void names_end_with_the_section(void **state) {
  (void)state;
  static bytes b;
  rim_image view;
  const char *text;
  size_t length;
  make_image(&b, RIM_SECTION_NAMES, "one\ncut.");
  assert_int_equal(rim_image_open(&view, b.byte, b.size), RIM_OK);
  b.byte[b.size] = '\n';
  assert_int_equal(rim_image_name(&view, 0, &text, &length), RIM_OK);
  assert_int_equal(rim_image_name(&view, 1, &text, &length), RIM_E_RANGE);
}

static void misuse_is_told(void **state) {
  (void)state;
  static bytes b;
  rim_image view;
  const char *text;
  size_t length;
  make_image(&b, RIM_SECTION_CONFIG, "x");
  assert_int_equal(rim_image_open(&view, b.byte, b.size), RIM_OK);
  assert_int_equal(rim_image_name(&view, 0, &text, &length), RIM_E_RANGE);
  assert_int_equal(rim_image_name(&view, 0, NULL, &length), RIM_E_ARGUMENT);
  assert_int_equal(rim_image_name(&view, 0, &text, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rim_image_name(NULL, 0, &text, &length), RIM_E_ARGUMENT);
}

static void check_unit(const char *name, const char *unit) {
  assert_string_equal(rim_unit_of_name(name, strlen(name)), unit);
}

static void units_end_names(void **state) {
  (void)state;
  check_unit("s.speed_mps", "m/s");
  check_unit("speed_mps", "m/s");
  check_unit("v_mps", "m/s");
  check_unit("sd.thrust_kN", "kN");
  check_unit("s.motor_temp_degC", "degC");
  check_unit("s.rate_radps2", "rad/s^2");
  check_unit("u.push", "");
  check_unit("s.m", "");
  check_unit("s._m", ""); /* nothing before the suffix */
  static const char *const roles[] = {"x.", "u.", "s.", "z.", "m.", "sd."};
  for (size_t i = 0; i < sizeof roles / sizeof *roles; ++i) { /* nor is a role a name */
    char name[8];
    snprintf(name, sizeof name, "%s_m", roles[i]);
    check_unit(name, "");
  }
  check_unit("a._m", "m"); /* this is no role */
  check_unit("_m", "");
  check_unit("s.x_", "");
  check_unit("s.x_furlongsss", "");
  check_unit("x_mp", "");
  check_unit("", "");
  check_unit("_", "");
  assert_string_equal(rim_unit_of_name(NULL, 3), "");
  /* The length says where a name ends. */
  assert_string_equal(rim_unit_of_name("s.speed_mps\ns.x_kg", 11), "m/s");
}

static void the_table_is_whole(void **state) {
  (void)state;
  for (size_t i = 0; i < RIMI_UNITS; ++i) {
    const rimi_unit *unit = rimi_unit_at(i);
    char name[24];
    assert_true(unit->suffix[0] != '\0' && unit->text[0] != '\0');
    assert_true(unit->suffix[sizeof unit->suffix - 1] == '\0');
    assert_true(unit->text[sizeof unit->text - 1] == '\0');
    snprintf(name, sizeof name, "s.x_%s", unit->suffix);
    check_unit(name, unit->text);
  }
  assert_null(rimi_unit_at(RIMI_UNITS));
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(names_come_in_order),
      cmocka_unit_test(the_first_name_may_be_empty),
      cmocka_unit_test(names_end_with_the_section),
      cmocka_unit_test(misuse_is_told),
      cmocka_unit_test(units_end_names),
      cmocka_unit_test(the_table_is_whole),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
