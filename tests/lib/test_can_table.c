/* SPDX-License-Identifier: MIT */
/* The table of CAN signals: every bit layout a DBC can say, rows complete when they should be, and
 * no table accepted that would read outside a frame. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "rim/can_table.h"

#define MAX_BYTES 4096

/* A table under construction. */
typedef struct maker {
  uint8_t bytes[MAX_BYTES];
  size_t size;
} maker;

static void put(maker *m, uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i)
    m->bytes[m->size++] = (uint8_t)(value >> (8 * i));
}

static void put_f64(maker *m, double x) {
  uint64_t bits;
  memcpy(&bits, &x, sizeof bits);
  put(m, bits, 8);
}

static void begin(maker *m, unsigned values, unsigned frames, unsigned signals, unsigned trigger,
                  unsigned time) {
  m->size = 0;
  put(m, 1, 4);
  put(m, values, 2);
  put(m, frames, 2);
  put(m, signals, 2);
  put(m, trigger, 2);
  put(m, time, 2);
  put(m, 0, 2);
}

static void frame(maker *m, uint32_t id, unsigned bytes, unsigned fd, unsigned first,
                  unsigned signals) {
  put(m, id, 4);
  put(m, bytes, 1);
  put(m, fd, 1);
  put(m, first, 2);
  put(m, signals, 2);
  put(m, 0, 2);
}

typedef struct layout {
  unsigned value, number, motorola, start, bits;
  unsigned selector_bits, selector_start, selector_motorola, selector;
  double scale, offset, low, high;
} layout;

static void signal(maker *m, const layout *l) {
  put(m, l->value, 2);
  put(m, l->number, 1);
  put(m, l->motorola, 1);
  put(m, l->start, 2);
  put(m, l->bits, 1);
  put(m, l->selector_bits, 1);
  put(m, l->selector_start, 2);
  put(m, l->selector_motorola, 1);
  put(m, 0, 1);
  put(m, l->selector, 4);
  put_f64(m, l->scale);
  put_f64(m, l->offset);
  put_f64(m, l->low);
  put_f64(m, l->high);
}

static layout plain(unsigned value, unsigned start, unsigned bits) {
  const layout l = {
      .value = value, .start = start, .bits = bits, .scale = 1.0, .low = -1e30, .high = 1e30};
  return l;
}

/* Writes a signal as the DBC's text says it: from the most significant bit down, Motorola going to
 * bit 7 of the next byte below bit 0, Intel upwards from the least. */
static void place(uint8_t *data, const layout *l, uint64_t raw) {
  unsigned at = l->start;
  for (unsigned i = 0; i < l->bits; ++i) {
    const unsigned which = l->motorola ? l->bits - 1 - i : i;
    if ((raw >> which & 1u) != 0)
      data[at / 8] |= (uint8_t)(1u << at % 8);
    at = !l->motorola ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
  }
}

static bool fits(const layout *l, unsigned bytes) {
  unsigned at = l->start;
  for (unsigned i = 0; i < l->bits; ++i) {
    if (at >= 8 * bytes)
      return false;
    at = !l->motorola ? at + 1 : at % 8 == 0 ? at + 15 : at - 1;
  }
  return true;
}

static rim_status one_value(const layout *l, unsigned bytes, const uint8_t *data, double *x) {
  static maker m;
  static rim_can_gather gather;
  rim_can_table table;
  begin(&m, 1, 1, 1, RIM_CAN_TABLE_NONE, RIM_CAN_TABLE_NONE);
  frame(&m, 0x123, bytes, bytes > 8, 0, 1);
  signal(&m, l);
  const rim_status status = rim_can_table_open(&table, m.bytes, m.size);
  if (status != RIM_OK)
    return status;
  memset(&gather, 0, sizeof gather);
  rim_can_frame f = {.id = 0x123, .length = (uint8_t)bytes, .fd = bytes > 8};
  memcpy(f.data, data, bytes);
  bool complete = false;
  double row_s = 0.0;
  const rim_status taken = rim_can_gather_frame(&gather, &table, &f, 2.5, 1.0, &complete, &row_s);
  if (taken == RIM_OK) {
    assert_true(complete && row_s == 2.5);
    *x = gather.value[0];
  }
  return taken;
}

static void every_layout_reads_what_was_written(void **state) {
  (void)state;
  uint32_t random = 11;
  printf("seed %u\n", random);
  unsigned read = 0;
  for (unsigned n = 0; n < 20000; ++n) {
    const unsigned bytes = n % 3 == 0 ? 64 : 1 + sample_next(&random) % 8;
    layout l = plain(0, sample_next(&random) % 520, 1 + sample_next(&random) % 66);
    l.motorola = sample_next(&random) % 2;
    l.number = sample_next(&random) % 2;
    uint8_t data[64];
    for (size_t i = 0; i < sizeof data; ++i)
      data[i] = 0;
    double x = 0.0;
    if (l.bits > 64 || l.start >= 8 * bytes || !fits(&l, bytes)) {
      assert_int_equal(one_value(&l, bytes, data, &x), RIM_E_RANGE);
      continue;
    }
    const uint64_t mask = l.bits == 64 ? UINT64_MAX : ((uint64_t)1 << l.bits) - 1;
    const uint64_t raw = ((uint64_t)sample_next(&random) << 40 ^
                          (uint64_t)sample_next(&random) << 20 ^ sample_next(&random)) &
                         mask;
    place(data, &l, raw);
    l.scale = 0.25;
    l.offset = -3.0;
    const int64_t negative = (int64_t)(raw | ~mask);
    const double number =
        l.number == 1 && (raw >> (l.bits - 1) & 1u) != 0 ? (double)negative : (double)raw;
    assert_int_equal(one_value(&l, bytes, data, &x), RIM_OK);
    assert_true(x == number * 0.25 - 3.0);
    read++;
  }
  assert_true(read > 3000);
}

static void floating_point_travels(void **state) {
  (void)state;
  uint8_t data[8] = {0};
  layout l = plain(0, 0, 32);
  l.number = RIM_CAN_F32;
  const float f = -12.375f;
  uint32_t bits;
  memcpy(&bits, &f, 4);
  place(data, &l, bits);
  double x = 0.0;
  assert_int_equal(one_value(&l, 8, data, &x), RIM_OK);
  assert_true(x == -12.375);
  l.bits = 31;
  assert_int_equal(one_value(&l, 8, data, &x), RIM_E_RANGE);
  l = plain(0, 7, 64);
  l.number = RIM_CAN_F64;
  l.motorola = 1;
  memset(data, 0, sizeof data);
  const double d = 1.0 / 3.0;
  uint64_t wide;
  memcpy(&wide, &d, 8);
  place(data, &l, wide);
  assert_int_equal(one_value(&l, 8, data, &x), RIM_OK);
  assert_true(x == d);
  memset(data, 0xff, sizeof data); /* NaN */
  assert_int_equal(one_value(&l, 8, data, &x), RIM_E_DATA);
}

/* Three frames: 0x10 values 0, 1; 0x20 value 2 by selector 0, value 3 by selector 1; 0x30 the time.
 */
static void three_frames(maker *m, unsigned trigger) {
  begin(m, 4, 3, 5, trigger, 4);
  frame(m, 0x10, 4, 0, 0, 2);
  frame(m, 0x20, 3, 0, 2, 2);
  frame(m, 0x30 | RIM_CAN_EXTENDED, 8, 0, 4, 1);
  layout l = plain(0, 0, 16);
  l.low = 0.0;
  l.high = 1000.0;
  signal(m, &l);
  l = plain(1, 16, 16);
  signal(m, &l);
  for (unsigned i = 0; i < 2; ++i) {
    l = plain(2 + i, 8, 16);
    l.selector_bits = 8;
    l.selector = i;
    signal(m, &l);
  }
  l = plain(RIM_CAN_TABLE_NONE, 0, 32);
  l.scale = 0.001;
  signal(m, &l);
}

typedef struct taker {
  maker m;
  rim_can_table table;
  rim_can_gather gather;
  bool complete;
  double row_s;
} taker;

static rim_status take(taker *t, uint32_t id, uint8_t length, uint64_t data, double t_s) {
  rim_can_frame f = {.id = id, .length = length};
  for (unsigned i = 0; i < 8; ++i)
    f.data[i] = (uint8_t)(data >> (8 * i));
  return rim_can_gather_frame(&t->gather, &t->table, &f, t_s, 1.0, &t->complete, &t->row_s);
}

static void a_row_is_complete_when_the_trigger_comes(void **state) {
  (void)state;
  static taker t;
  const uint32_t time_id = 0x30 | RIM_CAN_EXTENDED;
  memset(&t, 0, sizeof t);
  three_frames(&t.m, 2);
  assert_int_equal(rim_can_table_open(&t.table, t.m.bytes, t.m.size), RIM_OK);
  assert_int_equal(take(&t, time_id, 8, 500, 0.1), RIM_E_TRUNCATED);
  assert_int_equal(take(&t, 0x10, 4, 7 | 9 << 16, 0.25), RIM_OK);
  assert_int_equal(take(&t, 0x20, 3, 0 | 11 << 8, 0.3), RIM_OK);
  assert_int_equal(take(&t, time_id, 8, 1500, 0.4), RIM_E_TRUNCATED); /* value 3 never came */
  assert_int_equal(take(&t, 0x20, 3, 1 | 13 << 8, 0.5), RIM_OK);
  assert_false(t.complete);
  assert_int_equal(take(&t, time_id, 8, 2500, 0.6), RIM_OK);
  assert_true(t.complete && t.row_s == 2.5);
  assert_true(t.gather.value[0] == 7.0 && t.gather.value[1] == 9.0 && t.gather.value[2] == 11.0 &&
              t.gather.value[3] == 13.0);
  assert_int_equal(take(&t, time_id, 8, 3500, 1.25), RIM_OK); /* 1 s: still young enough */
  assert_true(t.complete);
  assert_int_equal(take(&t, time_id, 8, 4500, 1.3), RIM_E_TRUNCATED); /* and now it is not */
  assert_false(t.complete);
  /* What is refused, and what it leaves alone. */
  assert_int_equal(take(&t, 0x30, 8, 0, 1.3), RIM_E_MAGIC); /* 11 bits are another identifier */
  assert_int_equal(take(&t, 0x10, 3, 0, 1.3), RIM_E_SIZE);
  assert_int_equal(take(&t, 0x10, 5, 0, 1.3), RIM_E_SIZE);
  assert_int_equal(take(&t, 0x10, 4, 1001 | 21 << 16, 1.3), RIM_E_DATA);
  assert_true(t.gather.value[0] == 7.0 && t.gather.value[1] == 21.0);
  for (unsigned end = 0; end < 2; ++end) { /* both ends of the range belong to it */
    assert_int_equal(take(&t, 0x10, 4, 1000 * end | 21 << 16, 1.3), RIM_OK);
    assert_true(t.gather.value[0] == 1000.0 * end);
  }
  rim_can_frame fd = {.id = 0x10, .length = 4, .fd = true};
  assert_int_equal(rim_can_gather_frame(&t.gather, &t.table, &fd, 1.3, 1.0, &t.complete, &t.row_s),
                   RIM_E_SIZE);
}

static void without_a_trigger_a_row_needs_every_value_anew(void **state) {
  (void)state;
  static taker t;
  memset(&t, 0, sizeof t);
  three_frames(&t.m, RIM_CAN_TABLE_NONE);
  assert_int_equal(rim_can_table_open(&t.table, t.m.bytes, t.m.size), RIM_OK);
  unsigned rows = 0;
  for (unsigned i = 0; i < 10; ++i) {
    const double t_s = 0.1 * i;
    assert_int_equal(take(&t, 0x30 | RIM_CAN_EXTENDED, 8, 100 * i, t_s), RIM_OK);
    assert_int_equal(take(&t, 0x20, 3, 0 | i << 8, t_s), RIM_OK);
    assert_int_equal(take(&t, 0x10, 4, i, t_s), RIM_OK);
    assert_false(t.complete);
    if (i == 4)
      continue; /* lost: the row of 4 becomes that of 5 */
    assert_int_equal(take(&t, 0x20, 3, 1 | i << 8, t_s), RIM_OK);
    assert_true(t.complete && t.gather.value[0] == (double)i && t.gather.value[3] == (double)i);
    assert_true(fabs(t.row_s - t_s) < 1e-12);
    rows++;
  }
  assert_int_equal(rows, 9);
}

/* No byte of a table may be changed so that it is accepted and then reads outside: the sanitizers
 * watch, and what is accepted is used. */
static void damaged_tables_are_refused_or_harmless(void **state) {
  (void)state;
  static taker t;
  uint32_t random = 3;
  printf("seed %u\n", random);
  unsigned refused = 0;
  maker good;
  three_frames(&good, 2);
  for (size_t n = 0; n < good.size; ++n)
    assert_int_not_equal(rim_can_table_open(&t.table, good.bytes, n), RIM_OK);
  assert_int_equal(rim_can_table_open(&t.table, good.bytes, good.size + 1), RIM_E_SIZE);
  for (unsigned n = 0; n < 100000; ++n) {
    memset(&t.gather, 0, sizeof t.gather);
    t.m = good;
    for (unsigned k = 0; k < 1 + n % 3; ++k)
      t.m.bytes[sample_next(&random) % good.size] = (uint8_t)sample_next(&random);
    uint8_t *exact = malloc(t.m.size);
    memcpy(exact, t.m.bytes, t.m.size);
    if (rim_can_table_open(&t.table, exact, t.m.size) != RIM_OK) {
      refused++;
    } else {
      for (uint16_t i = 0; i < t.table.frames; ++i)
        for (uint8_t length = 0; length <= 8; ++length)
          (void)take(&t, rim_can_table_id(&t.table, i), length, UINT64_MAX / 3, 0.0);
    }
    free(exact);
  }
  printf("%u refused\n", refused);
  assert_in_range(refused, 10000, 99000); /* most bytes belong to scales and limits */
}

static void times_and_triggers(void **state) {
  (void)state;
  static maker m;
  rim_can_table table;
  layout l;
  begin(&m, 2, 1, 2, RIM_CAN_TABLE_NONE, 1); /* a time that is a value as well */
  frame(&m, 1, 8, 0, 0, 2);
  l = plain(0, 0, 8);
  signal(&m, &l);
  l = plain(1, 8, 8);
  signal(&m, &l);
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  for (unsigned trigger = 0; trigger < 3; ++trigger) { /* the frames are 0 alone */
    begin(&m, 1, 1, 1, trigger, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 1);
    l = plain(0, 0, 8);
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size),
                     trigger == 0 ? RIM_OK : RIM_E_RANGE);
  }
  static const uint32_t ids[] = {0x7ff, 0x800, RIM_CAN_EXTENDED | 0x1fffffffu,
                                 RIM_CAN_EXTENDED | 0x20000000u};
  for (size_t i = 0; i < sizeof ids / sizeof *ids; ++i) { /* the largest of 11 and of 29 bits */
    begin(&m, 1, 1, 1, 0, RIM_CAN_TABLE_NONE);
    frame(&m, ids[i], 8, 0, 0, 1);
    l = plain(0, 0, 8);
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size),
                     i % 2 == 0 ? RIM_OK : RIM_E_RANGE);
  }
  for (unsigned motorola = 0; motorola < 3; ++motorola) { /* of the selector */
    begin(&m, 1, 1, 1, 0, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 1);
    l = plain(0, 0, 8);
    l.selector_bits = 8;
    l.selector_start = 15;
    l.selector_motorola = motorola;
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size),
                     motorola < 2 ? RIM_OK : RIM_E_RANGE);
    l.selector_bits = 8; /* in the last byte, from its first bit or from its last */
    l.selector_start = motorola == 2 ? 63 : 56;
    l.selector_motorola = motorola > 0;
    begin(&m, 1, 1, 1, 0, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 1);
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size),
                     motorola == 1 ? RIM_E_RANGE : RIM_OK);
  }
}

static void contradictions_are_refused(void **state) {
  (void)state;
  maker m;
  rim_can_table table;
  layout l = plain(0, 0, 8);
  begin(&m, 2, 1, 2, 0, RIM_CAN_TABLE_NONE); /* value 0 twice, value 1 never */
  frame(&m, 1, 8, 0, 0, 2);
  signal(&m, &l);
  l.start = 8;
  signal(&m, &l);
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  begin(&m, 2, 1, 3, 0, RIM_CAN_TABLE_NONE); /* value 0 once, value 1 twice */
  frame(&m, 1, 8, 0, 0, 3);
  for (unsigned i = 0; i < 3; ++i) {
    const layout each = plain(i > 0, 8u * i, 8);
    signal(&m, &each);
  }
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  begin(&m, 2, 1, 1, 0, RIM_CAN_TABLE_NONE);
  frame(&m, 1, 8, 0, 0, 1);
  signal(&m, &l);
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  begin(&m, 1, 2, 2, 0, RIM_CAN_TABLE_NONE); /* an identifier twice */
  frame(&m, 1, 8, 0, 0, 1);
  frame(&m, 1, 8, 0, 1, 1);
  l.selector_bits = 8;
  signal(&m, &l);
  l.selector = 1;
  signal(&m, &l);
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  for (int which = 0; which < 2; which++) { /* a value twice, and only one by a selector */
    begin(&m, 1, 1, 2, 0, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 2);
    for (int i = 0; i < 2; i++) {
      l = plain(0, 0, 8);
      l.selector_start = 8;
      l.selector_bits = i == which ? 8 : 0;
      l.selector = (uint32_t)i;
      signal(&m, &l);
    }
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  }
  l = plain(0, 0, 8);
  const double wrong[][4] = {
      {0, 0, -1, 1}, {(double)NAN, 0, -1, 1}, {1, (double)INFINITY, -1, 1}, {1, 0, 1, -1}};
  for (size_t i = 0; i < 4; ++i) {
    l.scale = wrong[i][0];
    l.offset = wrong[i][1];
    l.low = wrong[i][2];
    l.high = wrong[i][3];
    double x;
    assert_int_equal(one_value(&l, 8, (const uint8_t[8]){0}, &x), RIM_E_DATA);
  }
  m.bytes[0] = 2;
  const rim_can_table none = {0};
  memset(&table, 0xa5, sizeof table); /* what was there is gone */
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_VERSION);
  assert_memory_equal(&table, &none, sizeof table);
  assert_int_equal(rim_can_table_open(NULL, m.bytes, m.size), RIM_E_ARGUMENT);
}

/* A signal of a value that is not there, a range of one number, and a header alone. */
static void what_is_just_allowed_and_what_is_not(void **state) {
  (void)state;
  static maker m;
  rim_can_table table;
  begin(&m, 1, 1, 2, 0, RIM_CAN_TABLE_NONE);
  frame(&m, 1, 8, 0, 0, 2);
  for (unsigned i = 0; i < 2; ++i) {
    const layout each = plain(i, 8u * i, 8);
    signal(&m, &each);
  }
  assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  layout l = plain(1, 0, 8);
  for (unsigned i = 0; i < 2; ++i) { /* of two values one has no signal, the first or the last */
    begin(&m, 2, 1, 1, 0, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 1);
    l.value = i;
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_RANGE);
  }
  l = plain(0, 0, 8);
  l.low = l.high = 5.0;
  double x = 0.0;
  assert_int_equal(one_value(&l, 8, (const uint8_t[8]){5}, &x), RIM_OK);
  assert_true(x == 5.0);
  assert_int_equal(one_value(&l, 8, (const uint8_t[8]){6}, &x), RIM_E_DATA);
  m.bytes[0] = 2; /* another layout is told by the header */
  assert_int_equal(rim_can_table_open(&table, m.bytes, RIM_CAN_TABLE_HEADER_BYTES), RIM_E_VERSION);
}

/* Whichever of a signal's four numbers is none, the table is refused, and not what it reads. */
static void numbers_that_are_none_are_refused(void **state) {
  (void)state;
  static maker m;
  rim_can_table table;
  const double none[3] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
  for (unsigned i = 0; i < 12; ++i) {
    layout l = plain(0, 0, 8);
    double *const number[4] = {&l.scale, &l.offset, &l.low, &l.high};
    *number[i % 4] = none[i / 4];
    begin(&m, 1, 1, 1, 0, RIM_CAN_TABLE_NONE);
    frame(&m, 1, 8, 0, 0, 1);
    signal(&m, &l);
    assert_int_equal(rim_can_table_open(&table, m.bytes, m.size), RIM_E_DATA);
  }
}

/* As many frames and as many values, one in each of some bytes, as there may be; and one more. */
static void so_many_frames_and_values_and_no_more(void **state) {
  (void)state;
  static uint8_t bytes[65536];
  for (unsigned k = 0; k < 4; ++k) {
    const unsigned frames = RIM_CAN_TABLE_MAX_FRAMES + (k == 1);
    const unsigned values = k == 3 ? RIM_CAN_TABLE_MAX_VALUES + 1 : k == 2 ? 256 : frames;
    static taker t;
    memset(&t, 0, sizeof t);
    begin(&t.m, values, frames, values, RIM_CAN_TABLE_NONE, RIM_CAN_TABLE_NONE);
    unsigned first = 0;
    for (unsigned f = 0; f < frames; ++f) {
      const unsigned count = (f + 1) * values / frames - first;
      frame(&t.m, f, 8, 0, first, count);
      first += count;
    }
    memcpy(bytes, t.m.bytes, t.m.size);
    size_t size = t.m.size;
    for (unsigned v = 0, f = 0, at = 0; v < values; ++v, ++at) {
      if (v == (f + 1) * values / frames) {
        ++f;
        at = 0;
      }
      const layout l = plain(v, 8 * at, 8);
      t.m.size = 0;
      signal(&t.m, &l);
      memcpy(bytes + size, t.m.bytes, t.m.size);
      size += t.m.size;
    }
    const rim_status expected = k % 2 == 0 ? RIM_OK : RIM_E_RANGE;
    assert_int_equal(rim_can_table_open(&t.table, bytes, size), expected);
    for (unsigned f = 0; f < frames && expected == RIM_OK; ++f) {
      assert_int_equal(take(&t, f, 8, 0x08070605u, 0.1), RIM_OK);
      assert_int_equal(t.complete, f + 1 == frames);
    }
    if (expected == RIM_OK)
      assert_true(t.gather.value[values - 1] == (k == 0 ? 5.0 : 8.0));
  }
}

/* A table of one frame with one signal. */
static rim_status one_frame(uint32_t id, unsigned bytes, unsigned fd) {
  maker m;
  rim_can_table table;
  const layout l = plain(0, 0, 8);
  begin(&m, 1, 1, 1, 0, RIM_CAN_TABLE_NONE);
  frame(&m, id, bytes, fd, 0, 1);
  signal(&m, &l);
  return rim_can_table_open(&table, m.bytes, m.size);
}

/* Identifiers of 11 bits, or of 29 with the flag; 8 bytes, or 64 of CAN FD, which is 0 or 1. */
static void frames_are_those_of_can(void **state) {
  (void)state;
  assert_int_equal(one_frame(0x7ff, 8, 0), RIM_OK);
  assert_int_equal(one_frame(0x800, 8, 0), RIM_E_RANGE);
  assert_int_equal(one_frame(RIM_CAN_EXTENDED | 0x1fffffffu, 8, 0), RIM_OK);
  assert_int_equal(one_frame(RIM_CAN_EXTENDED | 0x20000000u, 8, 0), RIM_E_RANGE);
  assert_int_equal(one_frame(1, 9, 0), RIM_E_RANGE);
  assert_int_equal(one_frame(1, 64, 1), RIM_OK);
  assert_int_equal(one_frame(1, 65, 1), RIM_E_RANGE);
  assert_int_equal(one_frame(1, 8, 2), RIM_E_RANGE);
}

/* One value by so many signals that a selector tells apart. */
static rim_status many_signals(uint32_t signals) {
  static uint8_t bytes[RIM_CAN_TABLE_HEADER_BYTES + RIM_CAN_TABLE_FRAME_BYTES +
                       RIM_CAN_TABLE_SIGNAL_BYTES * (RIM_CAN_TABLE_MAX_SIGNALS + 1)];
  maker m;
  rim_can_table table;
  layout l = plain(0, 32, 8);
  begin(&m, 1, 1, signals, 0, RIM_CAN_TABLE_NONE);
  frame(&m, 1, 8, 0, 0, signals);
  memcpy(bytes, m.bytes, m.size);
  size_t size = m.size;
  l.selector_bits = 32;
  for (l.selector = 0; l.selector < signals; l.selector++) {
    m.size = 0;
    signal(&m, &l);
    memcpy(bytes + size, m.bytes, m.size);
    size += m.size;
  }
  return rim_can_table_open(&table, bytes, size);
}

static void so_many_signals_and_no_more(void **state) {
  (void)state;
  assert_int_equal(rim_can_table_id(NULL, 0), 0);
  assert_int_equal(many_signals(RIM_CAN_TABLE_MAX_SIGNALS), RIM_OK);
  assert_int_equal(many_signals(RIM_CAN_TABLE_MAX_SIGNALS + 1), RIM_E_RANGE);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(times_and_triggers),
      cmocka_unit_test(every_layout_reads_what_was_written),
      cmocka_unit_test(floating_point_travels),
      cmocka_unit_test(a_row_is_complete_when_the_trigger_comes),
      cmocka_unit_test(without_a_trigger_a_row_needs_every_value_anew),
      cmocka_unit_test(damaged_tables_are_refused_or_harmless),
      cmocka_unit_test(contradictions_are_refused),
      cmocka_unit_test(what_is_just_allowed_and_what_is_not),
      cmocka_unit_test(numbers_that_are_none_are_refused),
      cmocka_unit_test(so_many_frames_and_values_and_no_more),
      cmocka_unit_test(frames_are_those_of_can),
      cmocka_unit_test(so_many_signals_and_no_more),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
