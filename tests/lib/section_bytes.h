/* SPDX-License-Identifier: MIT */
/* Bytes of flight images and of their sections, written one after another. */
#ifndef SECTION_BYTES_H
#define SECTION_BYTES_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/crc.h"
#include "rim/image.h"

#ifndef SECTION_BYTES
#define SECTION_BYTES 5120 /* of the longest section */
#endif

typedef struct bytes {
  _Alignas(8) uint8_t byte[SECTION_BYTES];
  size_t size;
} bytes;

static inline void u8(bytes *b, unsigned v) {
  assert_true(b->size < sizeof b->byte);
  b->byte[b->size++] = (uint8_t)v;
}
static inline void u16(bytes *b, unsigned v) {
  u8(b, v & 255u);
  u8(b, v >> 8);
}
static inline void u32(bytes *b, uint32_t v) {
  u16(b, v & 0xffffu);
  u16(b, v >> 16);
}
static inline void f32(bytes *b, double v) {
  const float f = (float)v;
  uint32_t bits;
  memcpy(&bits, &f, 4);
  u32(b, bits);
}
static inline void put_u32(uint8_t *at, uint32_t v) {
  for (int k = 0; k < 4; ++k)
    at[k] = (uint8_t)(v >> (8 * k));
}
static inline void put_u16(uint8_t *at, unsigned v) {
  at[0] = (uint8_t)(v & 255u);
  at[1] = (uint8_t)(v >> 8);
}
static inline void put_f32(uint8_t *at, double v) {
  const float f = (float)v;
  uint32_t bits;
  memcpy(&bits, &f, 4);
  put_u32(at, bits);
}

/* The section opens, whatever comes behind it; a shorter one is refused as truncated, one longer by
 * a byte with `longer`. */
static inline void only_the_whole_opens(rim_status (*open)(const bytes *section), const bytes *good,
                                        rim_status longer) {
  bytes b = *good;
  memset(b.byte + b.size, 0xff, sizeof b.byte - b.size); /* no numbers, and no counts */
  assert_int_equal(open(&b), RIM_OK);
  for (b.size = 0; b.size < good->size; ++b.size)
    assert_int_equal(open(&b), RIM_E_TRUNCATED);
  u8(&b, 0);
  assert_int_equal(open(&b), longer);
}

/* An image of these sections alone: it opens, but no monitor flies it. */
static inline void image_of(bytes *b, const uint32_t *id, const bytes *section, uint32_t count) {
  uint32_t total = 64u + 16u * count;
  memset(b, 0, sizeof *b);
  memcpy(b->byte, RIM_IMAGE_MAGIC, 8);
  put_u32(b->byte + 8, RIM_IMAGE_ENDIAN_TAG);
  put_u16(b->byte + 12, RIM_IMAGE_MAJOR);
  put_u32(b->byte + 20, 0x1234567);
  put_u32(b->byte + 24, count);
  for (uint32_t i = 0; i < count; ++i) {
    const uint32_t size = (uint32_t)section[i].size;
    put_u32(b->byte + 64 + 16 * i, id[i]);
    put_u32(b->byte + 68 + 16 * i, total);
    put_u32(b->byte + 72 + 16 * i, size);
    memcpy(b->byte + total, section[i].byte, size);
    total += (size + 7u) / 8u * 8u;
    assert_true(total <= sizeof b->byte);
  }
  put_u32(b->byte + 16, total);
  put_u32(b->byte + 28, rimi_crc32(0, b->byte + 64, total - 64));
  put_u32(b->byte + 32, rimi_crc32(0, b->byte, 64));
  b->size = total;
}

#endif
