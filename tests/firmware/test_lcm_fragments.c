/* SPDX-License-Identifier: MIT */
/* Messages in fragments: in any order, of several senders at once, damaged, lost, never ending. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "transport/lcm_fragments.h"

static lcm_fragments fragments;
static uint32_t lost;
static const char *channel;
static const uint8_t *payload;
static size_t payload_bytes;

static int begin(void **state) {
  (void)state;
  memset(&fragments, 0, sizeof fragments);
  lost = 0;
  return 0;
}

static void put(uint8_t *at, uint32_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i)
    at[i] = (uint8_t)(value >> (8 * (bytes - 1 - i)));
}

/* Byte i of message `sequence`. */
static uint8_t content(uint32_t sequence, size_t i) { return (uint8_t)(7 * i + 31 * sequence); }

/* Fragment `number` of a payload of `total` bytes in pieces of `size`. */
static size_t make(uint8_t *out, uint32_t sequence, uint32_t total, uint32_t size,
                   uint32_t number) {
  static const char name[] = "RIM_PLAN";
  const uint32_t offset = number * size, rest = total - offset, length = rest < size ? rest : size;
  put(out, 0x4c433033u, 4);
  put(out + 4, sequence, 4);
  put(out + 8, total, 4);
  put(out + 12, offset, 4);
  put(out + 16, number, 2);
  put(out + 18, (total + size - 1) / size, 2);
  size_t at = 20;
  if (number == 0) {
    memcpy(out + at, name, sizeof name);
    at += sizeof name;
  }
  for (uint32_t i = 0; i < length; ++i)
    out[at++] = content(sequence, offset + i);
  return at;
}

static lcm_fragments_answer take(uint64_t sender, const uint8_t *datagram, size_t bytes) {
  return lcm_fragments_take(&fragments, sender, datagram, bytes, &channel, &payload, &payload_bytes,
                            &lost);
}

static lcm_fragments_answer give(uint64_t sender, uint32_t sequence, uint32_t total, uint32_t size,
                                 uint32_t number) {
  uint8_t datagram[2000];
  return take(sender, datagram, make(datagram, sequence, total, size, number));
}

static void assert_whole(uint32_t sequence, uint32_t total) {
  assert_string_equal(channel, "RIM_PLAN");
  assert_int_equal(payload_bytes, total);
  for (size_t i = 0; i < total; ++i)
    assert_int_equal(payload[i], content(sequence, i));
}

static void any_order_will_do(void **state) {
  (void)state;
  static const uint32_t order[4][3] = {{0, 1, 2}, {2, 1, 0}, {1, 0, 2}, {2, 0, 1}};
  for (uint32_t k = 0; k < 4; ++k) {
    assert_int_equal(give(9, k, 4120, 1423, order[k][0]), LCM_FRAGMENTS_WAIT);
    assert_int_equal(give(9, k, 4120, 1423, order[k][0]), LCM_FRAGMENTS_WAIT); /* twice is once */
    assert_int_equal(give(9, k, 4120, 1423, order[k][1]), LCM_FRAGMENTS_WAIT);
    assert_int_equal(give(9, k, 4120, 1423, order[k][2]), LCM_FRAGMENTS_COMPLETE);
    assert_whole(k, 4120);
  }
  assert_int_equal(give(9, 50, 100, 100, 0), LCM_FRAGMENTS_COMPLETE); /* one that is all */
  assert_whole(50, 100);
  for (uint32_t i = 0; i + 1 < 64; ++i)
    assert_int_equal(give(9, 51, 8192, 128, i), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(9, 51, 8192, 128, 63), LCM_FRAGMENTS_COMPLETE);
  assert_whole(51, 8192);
  assert_int_equal(lost, 0);
}

static void senders_do_not_mix(void **state) {
  (void)state;
  for (uint32_t i = 0; i < 3; ++i)
    for (uint64_t sender = 1; sender <= LCM_FRAGMENTS_MESSAGES; ++sender)
      assert_int_equal(give(sender, 5, 3000, 1000, i),
                       i < 2 ? LCM_FRAGMENTS_WAIT : LCM_FRAGMENTS_COMPLETE);
  assert_int_equal(lost, 0);
}

static void what_never_ends_makes_room(void **state) {
  (void)state;
  for (uint64_t sender = 1; sender <= LCM_FRAGMENTS_MESSAGES; ++sender)
    assert_int_equal(give(sender, 1, 3000, 1000, 0), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(1, 1, 3000, 1000, 1), LCM_FRAGMENTS_WAIT); /* the first is fresh again */
  assert_int_equal(give(77, 1, 3000, 1000, 0), LCM_FRAGMENTS_WAIT);
  assert_int_equal(lost, 1);
  assert_int_equal(give(1, 1, 3000, 1000, 2), LCM_FRAGMENTS_COMPLETE);
  assert_int_equal(give(2, 1, 3000, 1000, 1), LCM_FRAGMENTS_WAIT); /* was the oldest: begins anew */
  assert_int_equal(give(2, 1, 3000, 1000, 2), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(77, 1, 3000, 1000, 1), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(77, 1, 3000, 1000, 2), LCM_FRAGMENTS_COMPLETE);
  assert_whole(1, 3000);
}

static void refuses(const uint8_t *datagram, size_t bytes) {
  assert_int_equal(take(3, datagram, bytes), LCM_FRAGMENTS_REFUSED);
}

static void wrong_ones_are_refused(void **state) {
  (void)state;
  uint8_t d[2000];
  const size_t bytes = make(d, 1, 3000, 1000, 0);
  for (size_t n = 0; n < 20 + 9; ++n)
    refuses(d, n); /* cut within the header or the channel's name */
  static const struct {
    unsigned at, bytes;
    uint32_t value;
  } wrong[] = {{8, 4, 0},     {8, 4, 8193},        {8, 4, UINT32_MAX}, {8, 4, 999}, {12, 4, 3001},
               {12, 4, 2001}, {12, 4, UINT32_MAX}, {18, 2, 0},         {18, 2, 65}, {18, 2, 65535}};
  for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; ++i) {
    (void)make(d, 1, 3000, 1000, 0);
    put(d + wrong[i].at, wrong[i].value, wrong[i].bytes);
    refuses(d, bytes);
  }
  (void)make(d, 1, 3000, 1000, 0);
  d[20] = 0; /* a channel without a name */
  refuses(d, bytes);
  memset(d + 20, 'x', 64); /* and one without an end */
  refuses(d, 20 + 64);
  const size_t second = make(d, 1, 3000, 1000, 1);
  put(d + 16, 3, 2); /* number 3 of 3 */
  refuses(d, second);
  assert_int_equal(lost, 0);
}

static void fragments_at_odds_are_forgotten(void **state) {
  (void)state;
  assert_int_equal(give(3, 1, 3000, 1000, 0), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(3, 1, 2900, 1000, 1), LCM_FRAGMENTS_REFUSED); /* another length */
  assert_int_equal(give(3, 1, 3000, 1000, 1), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(3, 1, 3000, 1000, 2), LCM_FRAGMENTS_WAIT);
  assert_int_equal(give(3, 1, 3000, 1000, 0), LCM_FRAGMENTS_COMPLETE);
  uint8_t d[2000];
  assert_int_equal(give(3, 2, 2000, 1000, 0), LCM_FRAGMENTS_WAIT);
  const size_t bytes = make(d, 2, 2000, 1000, 1);
  assert_int_equal(take(3, d, bytes - 1), LCM_FRAGMENTS_REFUSED); /* all there, and a byte short */
}

/* The lengths add up, but 500 bytes come twice and the last 500 never. */
static void a_hole_is_not_filled_with_zeros(void **state) {
  (void)state;
  uint8_t d[2000];
  assert_int_equal(give(3, 1, 2000, 1000, 0), LCM_FRAGMENTS_WAIT);
  const size_t bytes = make(d, 1, 2000, 1000, 1);
  put(d + 12, 500, 4);
  assert_int_equal(take(3, d, bytes), LCM_FRAGMENTS_REFUSED);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test_setup(any_order_will_do, begin),
      cmocka_unit_test_setup(senders_do_not_mix, begin),
      cmocka_unit_test_setup(what_never_ends_makes_room, begin),
      cmocka_unit_test_setup(wrong_ones_are_refused, begin),
      cmocka_unit_test_setup(fragments_at_odds_are_forgotten, begin),
      cmocka_unit_test_setup(a_hole_is_not_filled_with_zeros, begin),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
