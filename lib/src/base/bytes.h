/* SPDX-License-Identifier: MIT */
/* base/bytes.h - the only readers and writers of numbers in bytes. Private to the library and its
 * tools.
 *
 * le: little-endian, as flight images, their sections and CAN frames have it; be: big-endian, as
 * LCM has it. They give the same bytes on any host and at any alignment. There is no check of
 * bounds: the caller knows how many bytes there are. */
#ifndef RIM_BASE_BYTES_H
#define RIM_BASE_BYTES_H

#include <stddef.h>
#include <stdint.h>

#include "base/real.h"

#ifndef __BYTE_ORDER__
#error "the compiler must tell the byte order"
#endif

/* Each returns element `index` of an array of little-endian numbers that begins at `array`. */
static inline uint8_t rimi_le_u8(const uint8_t *array, size_t index) { return array[index]; }

static inline uint16_t rimi_le_u16(const uint8_t *array, size_t index) {
  const uint8_t *p = array + 2 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint16_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint16_t)(p[0] | p[1] << 8);
#endif
}

/* An index into `limit` entries: validated when the image was opened, and 0 should memory have been
 * damaged since, until the image's own check finds that. */
static inline uint16_t rimi_le_index(const uint8_t *array, size_t index, size_t limit) {
  const uint16_t value = rimi_le_u16(array, index);
  return value < limit ? value : (uint16_t)0;
}

static inline uint32_t rimi_le_u32(const uint8_t *array, size_t index) {
  const uint8_t *p = array + 4 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint32_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
#endif
}

static inline uint64_t rimi_le_u64(const uint8_t *array, size_t index) {
  const uint8_t *p = array + 8 * index;
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
  uint64_t value;
  RIM_COPY(&value, p, sizeof value);
  return value;
#else
  return (uint64_t)rimi_le_u32(p, 1) << 32 | rimi_le_u32(p, 0);
#endif
}

static inline float rimi_le_f32(const uint8_t *array, size_t index) {
  const uint32_t bits = rimi_le_u32(array, index);
  float value;
  RIM_COPY(&value, &bits, sizeof value);
  return value;
}

static inline double rimi_le_f64(const uint8_t *array, size_t index) {
  return rimi_from_bits(rimi_le_u64(array, index));
}

/* Each writes one little-endian number and returns the place behind it. */
static inline uint8_t *rimi_le_put_u16(uint8_t *at, uint32_t value) {
  at[0] = (uint8_t)(value & 255u);
  at[1] = (uint8_t)(value >> 8 & 255u);
  return at + 2;
}

static inline uint8_t *rimi_le_put_u32(uint8_t *at, uint32_t value) {
  return rimi_le_put_u16(rimi_le_put_u16(at, value), value >> 16);
}

static inline uint8_t *rimi_le_put_u64(uint8_t *at, uint64_t value) {
  return rimi_le_put_u32(rimi_le_put_u32(at, (uint32_t)(value & 0xffffffffu)),
                         (uint32_t)(value >> 32));
}

static inline uint8_t *rimi_le_put_f32(uint8_t *at, float value) {
  uint32_t bits;
  RIM_COPY(&bits, &value, sizeof bits);
  return rimi_le_put_u32(at, bits);
}

static inline uint8_t *rimi_le_put_f64(uint8_t *at, double value) {
  return rimi_le_put_u64(at, rimi_bits(value));
}

/* Each returns the big-endian number that begins at `at`. */
static inline uint16_t rimi_be_u16(const uint8_t *at) {
  return (uint16_t)((uint32_t)at[0] << 8 | at[1]);
}

static inline uint32_t rimi_be_u32(const uint8_t *at) {
  return (uint32_t)rimi_be_u16(at) << 16 | rimi_be_u16(at + 2);
}

static inline uint64_t rimi_be_u64(const uint8_t *at) {
  return (uint64_t)rimi_be_u32(at) << 32 | rimi_be_u32(at + 4);
}

static inline double rimi_be_f64(const uint8_t *at) { return rimi_from_bits(rimi_be_u64(at)); }

/* Each writes one big-endian number and returns the place behind it. */
static inline uint8_t *rimi_be_put_u16(uint8_t *at, uint32_t value) {
  at[0] = (uint8_t)(value >> 8 & 255u);
  at[1] = (uint8_t)(value & 255u);
  return at + 2;
}

static inline uint8_t *rimi_be_put_u32(uint8_t *at, uint32_t value) {
  return rimi_be_put_u16(rimi_be_put_u16(at, value >> 16), value);
}

static inline uint8_t *rimi_be_put_u64(uint8_t *at, uint64_t value) {
  return rimi_be_put_u32(rimi_be_put_u32(at, (uint32_t)(value >> 32)),
                         (uint32_t)(value & 0xffffffffu));
}

static inline uint8_t *rimi_be_put_f64(uint8_t *at, double value) {
  return rimi_be_put_u64(at, rimi_bits(value));
}

#endif
