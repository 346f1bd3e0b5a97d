/* SPDX-License-Identifier: MIT */
/* A small image is built here byte by byte and refused in every damaged form. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/bytes.h"
#include "base/crc.h"
#include "rim/image.h"

enum { SECTIONS = 3, TABLE = 64, FIRST = TABLE + 16 * SECTIONS, TOTAL = FIRST + 8 + 24 + 16 };
#define ID_A 0x31414141u /* "AAA1" in a hex dump */
#define ID_B 0x31424242u
#define ID_C 0x31434343u

typedef struct image {
  _Alignas(8) uint8_t byte[TOTAL + 64];
} image;

static void put(image *m, size_t offset, uint32_t value) {
  for (size_t i = 0; i < 4; ++i) {
    m->byte[offset + i] = (uint8_t)(value >> (8 * i));
  }
}

/* Sets both check sums, so that a test reaches what lies behind them. */
static void seal(image *m, size_t total) {
  put(m, 28, rimi_crc32(0, m->byte + 64, total - 64));
  put(m, 32, 0);
  put(m, 32, rimi_crc32(0, m->byte, 64));
}

static void entry(image *m, size_t index, uint32_t id, uint32_t offset, uint32_t bytes) {
  put(m, TABLE + 16 * index, id);
  put(m, TABLE + 16 * index + 4, offset);
  put(m, TABLE + 16 * index + 8, bytes);
  put(m, TABLE + 16 * index + 12, 3u + (uint32_t)index);
}

static image make(void) {
  image m;
  memset(&m, 0, sizeof m);
  memcpy(m.byte, RIM_IMAGE_MAGIC, 8);
  put(&m, 8, RIM_IMAGE_ENDIAN_TAG);
  put(&m, 12, RIM_IMAGE_MAJOR | RIM_IMAGE_MINOR << 16);
  put(&m, 16, TOTAL);
  put(&m, 20, 4711);
  put(&m, 24, SECTIONS);
  entry(&m, 0, ID_A, FIRST, 5);
  entry(&m, 1, ID_B, FIRST + 8, 24);
  entry(&m, 2, ID_C, FIRST + 32, 0);
  for (size_t i = 0; i < 5; ++i) {
    m.byte[FIRST + i] = (uint8_t)(0xf1 + i);
  }
  put(&m, FIRST + 8, 0x3f800000);  /* f32 1 */
  put(&m, FIRST + 12, 0xc0490fdb); /* f32 -pi */
  put(&m, FIRST + 16, 0x54442d18); /* f64 pi */
  put(&m, FIRST + 20, 0x400921fb);
  put(&m, FIRST + 24, 0x89abcdef);
  put(&m, FIRST + 28, 0x01234567);
  seal(&m, TOTAL);
  return m;
}

static rim_status opened(const image *m, size_t bytes) {
  rim_image view;
  memset(&view, 0xa5, sizeof view);
  const rim_status status = rim_image_open(&view, m->byte, bytes);
  if (status != RIM_OK) {
    assert_true(view.data == NULL && view.bytes == 0 && view.sections == 0);
    assert_int_equal(rim_image_section(&view, ID_A, NULL, NULL), RIM_E_ARGUMENT);
  }
  return status;
}

static void sections_are_found(void **state) {
  (void)state;
  const image m = make();
  rim_image view;
  const uint8_t *data;
  size_t size;
  assert_int_equal(rim_image_open(&view, m.byte, sizeof m.byte), RIM_OK); /* more memory is fine */
  assert_int_equal(rim_image_open(&view, m.byte, TOTAL), RIM_OK);
  assert_true(view.bytes == TOTAL && view.model_id == 4711 && view.sections == 3);
  assert_true(view.major == RIM_IMAGE_MAJOR && view.minor == RIM_IMAGE_MINOR);
  assert_int_equal(rim_image_section(&view, ID_A, &data, &size), RIM_OK);
  assert_true(data == m.byte + FIRST && size == 5 && rimi_le_u8(data, 4) == 0xf5);
  assert_int_equal(rim_image_section(&view, ID_C, &data, &size), RIM_OK);
  assert_true(size == 0);
  assert_int_equal(rim_image_section(&view, ID_B, NULL, NULL), RIM_OK);
  /* What lies behind the table is no entry of it. */
  assert_int_equal(rim_image_section(&view, rimi_le_u32(m.byte, FIRST / 4), NULL, NULL),
                   RIM_E_RANGE);
  assert_int_equal(rim_image_section(&view, 1, &data, &size), RIM_E_RANGE);
  assert_true(data == NULL && size == 0);
  assert_int_equal(rim_image_section(NULL, ID_A, &data, &size), RIM_E_ARGUMENT);
}

static void numbers_are_little_endian(void **state) {
  (void)state;
  const image m = make();
  const uint8_t *b = m.byte + FIRST + 8;
  assert_true(rimi_le_f32(b, 0) == 1.0f && rimi_le_f32(b, 1) == -0x1.921fb6p+1f);
  assert_true(rimi_le_f64(b, 1) == 0x1.921fb54442d18p+1);
  assert_true(rimi_le_u64(b, 2) == UINT64_C(0x0123456789abcdef));
  assert_int_equal(rimi_le_u32(b, 4), 0x89abcdef);
  assert_int_equal(rimi_le_u16(b, 8), 0xcdef);
  assert_int_equal(rimi_le_u8(b, 16), 0xef);
  assert_int_equal(rimi_le_u32(b + 17, 0), 0x6789abcd); /* at any alignment */
}

static void every_flipped_bit_is_refused(void **state) {
  (void)state;
  image m = make();
  for (size_t bit = 0; bit < 8 * TOTAL; ++bit) {
    m.byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_not_equal(opened(&m, TOTAL), RIM_OK);
    m.byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
  }
  assert_int_equal(opened(&m, TOTAL), RIM_OK);
}

static void every_truncation_is_refused(void **state) {
  (void)state;
  const image m = make();
  for (size_t bytes = 0; bytes < TOTAL; ++bytes) {
    assert_int_equal(opened(&m, bytes), RIM_E_TRUNCATED);
  }
  image shorter = make();
  for (uint32_t total = 0; total < FIRST; ++total) { /* sealed, but too short for its own table */
    put(&shorter, 16, total);
    seal(&shorter, total < 64 ? 64 : total);
    assert_int_equal(opened(&shorter, TOTAL), RIM_E_TRUNCATED);
  }
}

static void header_causes(void **state) {
  (void)state;
  rim_image view;
  image m = make();
  assert_int_equal(rim_image_open(NULL, m.byte, TOTAL), RIM_E_ARGUMENT);
  assert_int_equal(rim_image_open(&view, NULL, TOTAL), RIM_E_ARGUMENT);
  for (size_t shift = 1; shift < 8; ++shift) {
    memmove(m.byte + shift, m.byte + shift - 1, TOTAL);
    assert_int_equal(rim_image_open(&view, m.byte + shift, TOTAL), RIM_E_ALIGN);
  }
  m = make();
  m.byte[6] = '\n'; /* as a transfer in text mode would */
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_MAGIC);
  m = make();
  put(&m, 8, 0x01020305);
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_MAGIC);
  m = make();
  put(&m, 12, RIM_IMAGE_MAJOR + 1);
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_VERSION);
  m = make();
  put(&m, 12, RIM_IMAGE_MAJOR | (RIM_IMAGE_MINOR + 1) << 16); /* a newer minor one is read */
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_OK);
  m = make();
  put(&m, 60, 1);
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_DATA);
}

static void swapped_bytes_are_named(void **state) {
  (void)state;
  image m = make();
  for (size_t word = 2; word < 16; ++word) {
    put(&m, 4 * word, rimi_le_u32(m.byte, word)); /* what big-endian numbers read as: */
    for (size_t i = 0; i < 2; ++i) {
      const uint8_t byte = m.byte[4 * word + i];
      m.byte[4 * word + i] = m.byte[4 * word + 3 - i];
      m.byte[4 * word + 3 - i] = byte;
    }
  }
  assert_int_equal(opened(&m, TOTAL), RIM_E_ENDIAN);
}

static void bad_tables_are_refused(void **state) {
  (void)state;
  static const struct {
    uint32_t id, offset, bytes;
    rim_status status;
  } cases[] = {
      {ID_B, FIRST + 32, 16, RIM_OK},             /* up to the last byte */
      {ID_B, TOTAL, 0, RIM_OK},                   /* empty, at the end */
      {ID_B, FIRST + 9, 8, RIM_E_ALIGN},          /* misaligned */
      {ID_B, FIRST + 12, 8, RIM_E_ALIGN},         /* on 4 */
      {ID_B, FIRST, 24, RIM_E_RANGE},             /* over A */
      {ID_B, TABLE, 8, RIM_E_RANGE},              /* in the table */
      {ID_B, 0, 8, RIM_E_RANGE},                  /* in the header */
      {ID_B, FIRST + 32, 17, RIM_E_RANGE},        /* a byte too far */
      {ID_B, TOTAL + 8, 0, RIM_E_RANGE},          /* begins outside */
      {ID_B, FIRST + 8, 0xffffffff, RIM_E_RANGE}, /* wraps */
      {ID_B, 0xfffffff8, 16, RIM_E_RANGE},        /* wraps */
      {ID_A, FIRST + 8, 24, RIM_E_DATA},          /* id twice */
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; ++i) {
    image m = make();
    entry(&m, 1, cases[i].id, cases[i].offset, cases[i].bytes);
    seal(&m, TOTAL);
    assert_int_equal(opened(&m, TOTAL), cases[i].status);
  }
}

/* Whichever of the entries it is. */
static void a_bad_entry_at_any_place_is_refused(void **state) {
  (void)state;
  static const uint32_t id[SECTIONS] = {ID_A, ID_B, ID_C};
  for (size_t index = 0; index < SECTIONS; ++index) {
    image m = make();
    entry(&m, index, id[index], FIRST + 1, 0);
    seal(&m, TOTAL);
    assert_int_equal(opened(&m, TOTAL), RIM_E_ALIGN);
    entry(&m, index, id[index], TOTAL + 8, 0);
    seal(&m, TOTAL);
    assert_int_equal(opened(&m, TOTAL), RIM_E_RANGE);
    entry(&m, index, id[index], FIRST + 32, 17);
    seal(&m, TOTAL);
    assert_int_equal(opened(&m, TOTAL), RIM_E_RANGE);
  }
}

static void section_counts(void **state) {
  (void)state;
  image m = make();
  put(&m, 24, 0);
  put(&m, 16, 64);
  seal(&m, 64);
  assert_int_equal(opened(&m, 64), RIM_OK); /* an image without sections */
  put(&m, 24, RIM_IMAGE_MAX_SECTIONS); /* as many may be, but there is no room for their table */
  seal(&m, 64);
  assert_int_equal(opened(&m, 64), RIM_E_TRUNCATED);
  m = make();
  put(&m, 24, RIM_IMAGE_MAX_SECTIONS + 1);
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_RANGE);
  put(&m, 24, 0xffffffff);
  seal(&m, TOTAL);
  assert_int_equal(opened(&m, TOTAL), RIM_E_RANGE);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(sections_are_found),
      cmocka_unit_test(numbers_are_little_endian),
      cmocka_unit_test(every_flipped_bit_is_refused),
      cmocka_unit_test(every_truncation_is_refused),
      cmocka_unit_test(header_causes),
      cmocka_unit_test(swapped_bytes_are_named),
      cmocka_unit_test(bad_tables_are_refused),
      cmocka_unit_test(a_bad_entry_at_any_place_is_refused),
      cmocka_unit_test(section_counts),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
