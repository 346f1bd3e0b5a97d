/* SPDX-License-Identifier: MIT */
/* Section INTERFERENCE of any bytes and length: every number is read inside, whatever its check sum
 * comes to. Function by function: the readers are replaced by ones that check where they read and
 * return any number. */
#include "any.h"
#include "base/bytes.h"
#include "base/crc.h"
#include "base/real.h"
#include "interference/detector.h"

uint32_t nondet_uint32(void);
double nondet_double(void);
_Bool nondet_bool(void);

static const uint8_t *section;
static size_t section_bytes;

static void is_inside(const uint8_t *at, size_t bytes) {
  is_inside_of(at, bytes, section, section_bytes);
}
static uint32_t read_u32(const uint8_t *array, size_t i) {
  is_inside(array + 4 * i, 4);
  return nondet_uint32();
}
static double read_f64(const uint8_t *array, size_t i) {
  is_inside(array + 8 * i, 8);
  return nondet_double();
}
static uint32_t crc_of_any(const void *data, size_t bytes) {
  is_inside(data, bytes);
  return nondet_uint32();
}
#define rimi_le_u32 read_u32
#define rimi_le_f64 read_f64
#define rimi_crc32(crc, data, bytes) ((void)(crc), crc_of_any(data, bytes))
#define rimi_is_finite(x) ((void)(x), nondet_bool())
#include "detector.c"
/* Arithmetic on a structure without pointers, by indices below constants; any answer. */
static rim_status check(const rim_interference_model *m) {
  return m != NULL && nondet_bool() ? RIM_OK : RIM_E_DATA;
}

int main(void) {
  uint8_t any[RIM_INTERFERENCE_BYTES + 1];
  rim_interference_model model;
  section = any;
  section_bytes = any_size(sizeof any);
  (void)rimi_interference_open(&model, any, section_bytes);
  return 0;
}
