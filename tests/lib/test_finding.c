/* SPDX-License-Identifier: MIT */
/* Finding frames: every page comes back as it went, lies where rim/can.h says, and nothing damaged
 * is read. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "base/crc.h"
#include "rim/can.h"

#define SAMPLES 300u

static void check_pages_of_features(const rim_alarm *a, const rim_can_frame *frame) {
  rim_can_finding f;
  for (uint32_t d = 0; d < a->region.dims; ++d) {
    assert_int_equal(rim_can_unpack_finding(&f, &frame[5 + 3 * d]), RIM_OK);
    assert_int_equal(f.page, RIM_CAN_PAGE_FEATURE + 3 * d);
    assert_int_equal(f.index, a->region.feature[d]);
    assert_int_equal(rim_can_unpack_finding(&f, &frame[6 + 3 * d]), RIM_OK);
    assert_int_equal(f.page, RIM_CAN_PAGE_LOWER + 3 * d);
    assert_true(f.value == (double)(float)a->region.lower[d]);
    assert_int_equal(rim_can_unpack_finding(&f, &frame[7 + 3 * d]), RIM_OK);
    assert_int_equal(f.page, RIM_CAN_PAGE_UPPER + 3 * d);
    assert_true(f.value == (double)(float)a->region.upper[d]);
  }
}

static void pages_carry_the_finding(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < SAMPLES; ++seed) {
    const rim_alarm a = sample_alarm(seed);
    rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
    rim_can_finding f[5];
    uint32_t count = 0;
    assert_int_equal(rim_can_pack_finding(frame, &count, 9, &a), RIM_OK);
    assert_int_equal(count, 5 + 3 * a.region.dims);
    for (uint32_t i = 0; i < 5; ++i) {
      assert_int_equal(rim_can_unpack_finding(&f[i], &frame[i]), RIM_OK);
      assert_int_equal(f[i].page, i);
      assert_int_equal(f[i].node, 9);
      assert_int_equal(f[i].seq, a.seq & 255u);
    }
    assert_int_equal(f[0].index, a.channel[0]);
    assert_int_equal(f[0].kind, a.kind);
    assert_int_equal(f[0].dims, a.region.dims);
    assert_int_equal(f[0].channels, a.channels);
    assert_true(fabs(f[0].value / a.p_value - 1.0) < 0.05);
    assert_true(f[1].value == (double)(float)a.shift[0]);
    assert_true(f[2].value == (double)(float)a.shift_sd[0]);
    assert_true(fabs(f[3].value - (a.t_s - a.since_s)) < 5.01e-4);
    assert_true(f[4].value == (double)(float)a.since_sd_s);
    check_pages_of_features(&a, frame);
  }
}

/* Read by the offsets of rim/can.h. The time of day of a computer does not spoil the age. */
static void pages_lie_where_they_are_documented(void **state) {
  (void)state;
  rim_alarm a = sample_alarm(3);
  rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  uint32_t count;
  a.t_s = 1.7e9;
  a.since_s = 1.7e9 - 258.0;
  a.seq = 0x7761;
  a.channel[0] = 0x1234;
  a.kind = RIM_KIND_DRIFT;
  a.channels = 2;
  a.p_value = 0.0625;
  a.shift[0] = -1.5;
  assert_int_equal(rim_can_pack_finding(frame, &count, 127, &a), RIM_OK);
  const uint8_t outcome[7] = {
      0, 0x61, 0x34, 0x12, (uint8_t)(3u | (unsigned)a.region.dims << 3 | 2u << 5), 32, 0};
  const uint8_t shift[7] = {1, 0x61, 0, 0, 0xc0, 0xbf, 0};
  const uint8_t age[7] = {3, 0x61, 0xd0, 0xef, 3, 0, 0}; /* 258000 ms */
  assert_memory_equal(frame[0].data, outcome, 7);
  assert_memory_equal(frame[1].data, shift, 7);
  assert_memory_equal(frame[3].data, age, 7);
  for (uint32_t i = 0; i < count; ++i)
    assert_true(frame[i].id == 0x4ff && frame[i].length == 8 && !frame[i].fd);
}

static void damage_and_misuse_are_refused(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(5);
  rim_alarm bad = a;
  rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  rim_can_finding f;
  uint32_t count = 77;
  assert_int_equal(rim_can_pack_finding(frame, &count, 9, &a), RIM_OK);
  for (uint32_t bit = 0; bit < 64; ++bit) {
    rim_can_frame hit = frame[1];
    hit.data[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_equal(rim_can_unpack_finding(&f, &hit), RIM_E_CRC);
  }
  rim_can_frame other = frame[0];
  other.length = 7;
  assert_int_equal(rim_can_unpack_finding(&f, &other), RIM_E_SIZE);
  other = frame[0];
  other.id = RIM_CAN_FINDING_ID + 128;
  assert_int_equal(rim_can_unpack_finding(&f, &other), RIM_E_MAGIC);
  other.id = RIM_CAN_FINDING_ID + 10; /* the check sum is another node's */
  assert_int_equal(rim_can_unpack_finding(&f, &other), RIM_E_CRC);
  assert_int_equal(rim_can_unpack_finding(NULL, frame), RIM_E_ARGUMENT);
  assert_int_equal(rim_can_unpack_finding(&f, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rim_can_pack_finding(frame, NULL, 9, &a), RIM_E_ARGUMENT);
  assert_int_equal(rim_can_pack_finding(frame, &count, 128, &a), RIM_E_RANGE);
  bad.shift[0] = (double)NAN;
  count = 77;
  assert_int_equal(rim_can_pack_finding(frame, &count, 9, &bad), RIM_E_DATA);
  assert_int_equal(count, 77);
}

/* Without an outcome there is no index of one. */
static void an_alarm_may_name_no_outcome(void **state) {
  (void)state;
  rim_alarm a = sample_alarm(5);
  rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  rim_can_finding f;
  uint32_t count = 0;
  a.channels = 0;
  a.channel[0] = 0x1234;
  assert_int_equal(rim_can_pack_finding(frame, &count, 9, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_finding(&f, &frame[0]), RIM_OK);
  assert_true(f.channels == 0 && f.index == 0);
}

/* The last page is read, the one behind it is not. */
static void pages_end(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(5);
  rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  rim_can_finding f;
  uint32_t count = 0;
  assert_int_equal(rim_can_pack_finding(frame, &count, 9, &a), RIM_OK);
  const uint32_t id_now = RIM_CAN_FINDING_ID + 9u;
  const uint8_t id[2] = {(uint8_t)id_now, (uint8_t)(id_now >> 8)};
  for (uint32_t page = RIM_CAN_FINDING_FRAMES - 1u; page <= RIM_CAN_FINDING_FRAMES; ++page) {
    frame[1].data[0] = (uint8_t)page;
    frame[1].data[7] = rimi_crc8(rimi_crc8(0, id, 2), frame[1].data, 7);
    assert_int_equal(rim_can_unpack_finding(&f, &frame[1]),
                     page < RIM_CAN_FINDING_FRAMES ? RIM_OK : RIM_E_RANGE);
  }
}

/* Of every kind and number of outcomes that three bits hold, with a check sum that is right. */
static void what_no_alarm_has_is_refused(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(5);
  rim_can_frame frame[RIM_CAN_FINDING_FRAMES];
  uint32_t count = 0;
  assert_int_equal(rim_can_pack_finding(frame, &count, 9, &a), RIM_OK);
  const uint32_t id_now = RIM_CAN_FINDING_ID + 9u;
  const uint8_t id[2] = {(uint8_t)id_now, (uint8_t)(id_now >> 8)};
  for (uint32_t kind = 0; kind < 8; ++kind) {
    for (uint32_t channels = 0; channels < 8; ++channels) {
      frame[0].data[4] = (uint8_t)(kind | channels << 5);
      frame[0].data[7] = rimi_crc8(rimi_crc8(0, id, 2), frame[0].data, 7);
      rim_can_finding f;
      const bool fine = kind <= RIM_KIND_PUSHED && channels <= RIM_ALARM_MAX_CHANNELS;
      assert_int_equal(rim_can_unpack_finding(&f, &frame[0]), fine ? RIM_OK : RIM_E_RANGE);
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(an_alarm_may_name_no_outcome),
      cmocka_unit_test(pages_end),
      cmocka_unit_test(what_no_alarm_has_is_refused),
      cmocka_unit_test(pages_carry_the_finding),
      cmocka_unit_test(pages_lie_where_they_are_documented),
      cmocka_unit_test(damage_and_misuse_are_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
