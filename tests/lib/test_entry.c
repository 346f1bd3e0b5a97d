/* SPDX-License-Identifier: MIT */
/* Plans and entries: lcm-gen's own bytes; plans that cannot be flown are refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "rim/can.h"

#include <rim_entry_t.h>
#include <rim_plan_t.h>

static rim_plan sample_plan(uint32_t count) {
  uint32_t random = count;
  rim_plan p;
  memset(&p, 0, sizeof p);
  p.t_us = -1234567890123;
  p.sequence = 0x80000000u + count;
  p.count = count;
  for (uint32_t i = 0; i < count; ++i) {
    p.pose[i].after_s = 0.5 * i;
    for (int k = 0; k < 3; ++k)
      p.pose[i].position[k] = sample_between(&random, -100.0, 100.0);
    const double half = sample_between(&random, -1.5, 1.5);
    p.pose[i].orientation[0] = cos(half);
    p.pose[i].orientation[3] = sin(half);
  }
  return p;
}

static void plans_equal_the_generated_encoder(void **state) {
  (void)state;
  static uint8_t ours[RIM_LCM_PLAN_SIZE], theirs[RIM_LCM_PLAN_SIZE];
  for (uint32_t count = 1; count <= RIM_PLAN_MAX_POSES; ++count) {
    const rim_plan p = sample_plan(count);
    static rim_plan_t g;
    memset(&g, 0, sizeof g);
    g.t_us = p.t_us;
    memcpy(&g.sequence, &p.sequence, 4);
    g.count = (int32_t)count;
    for (uint32_t i = 0; i < count; ++i) {
      g.after_s[i] = p.pose[i].after_s;
      memcpy(g.position[i], p.pose[i].position, sizeof g.position[i]);
      memcpy(g.orientation[i], p.pose[i].orientation, sizeof g.orientation[i]);
    }
    assert_int_equal(rim_plan_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_PLAN_SIZE);
    assert_int_equal(rim_lcm_pack_plan(ours, sizeof ours, &p), RIM_OK);
    assert_memory_equal(ours, theirs, sizeof ours);
    rim_plan back;
    assert_int_equal(rim_lcm_unpack_plan(&back, theirs, sizeof theirs), RIM_OK);
    assert_memory_equal(&back, &p, sizeof p);
  }
}

static void an_entry_equals_the_generated_encoder(void **state) {
  (void)state;
  const rim_entry e = {12.5, 3.25, 1, 2, 3, 0xffffffffu, 5, 1};
  const rim_entry_t g = {12.5, 3.25, 1, 2, 3, -1, 5, 1};
  uint8_t ours[RIM_LCM_ENTRY_SIZE], theirs[RIM_LCM_ENTRY_SIZE];
  assert_int_equal(rim_entry_t_encode(theirs, 0, sizeof theirs, &g), RIM_LCM_ENTRY_SIZE);
  assert_int_equal(rim_lcm_pack_entry(ours, sizeof ours, &e), RIM_OK);
  assert_memory_equal(ours, theirs, sizeof ours);
  rim_entry back;
  assert_int_equal(rim_lcm_unpack_entry(&back, ours, sizeof ours), RIM_OK);
  assert_true(back.t_s == e.t_s && back.to_entry_s == e.to_entry_s && back.sequence == 1 &&
              back.alarm_sequence == 2 && back.plan_sequence == 3 && back.pose == 5 &&
              back.model_id == e.model_id && back.flags == 1);
  for (size_t n = 0; n < sizeof ours; ++n)
    assert_int_equal(rim_lcm_unpack_entry(&back, ours, n), RIM_E_TRUNCATED);
}

/* Whichever number of whichever pose it is. */
static void a_wrong_number_anywhere_is_refused(void **state) {
  (void)state;
  static uint8_t bytes[RIM_LCM_PLAN_SIZE];
  rim_plan back;
  for (uint32_t i = 0; i < 3; ++i) {
    for (int k = 0; k < 9; ++k) {
      rim_plan p = sample_plan(3);
      if (k < 3)
        p.pose[i].position[k] = (double)NAN;
      else if (k < 7)
        p.pose[i].orientation[k - 3] = (double)NAN;
      else if (k == 7)
        p.pose[i].after_s = (double)NAN;
      else if (i > 0)
        p.pose[i].after_s = p.pose[i - 1].after_s - 0.001;
      else
        continue;
      assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_OK);
      assert_int_equal(rim_lcm_unpack_plan(&back, bytes, sizeof bytes), RIM_E_DATA);
    }
  }
}

/* Two poses at the same time are a turn on the spot; the first may lie in the past. */
static void poses_may_be_at_the_same_time(void **state) {
  (void)state;
  static uint8_t bytes[RIM_LCM_PLAN_SIZE];
  rim_plan p = sample_plan(3), back;
  p.pose[0].after_s = -1.0;
  p.pose[1].after_s = p.pose[2].after_s;
  assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_OK);
  assert_int_equal(rim_lcm_unpack_plan(&back, bytes, sizeof bytes), RIM_OK);
  assert_memory_equal(&back, &p, sizeof p);
}

/* A quaternion's square may be off by a fiftieth, and by no more: at its limits it is refused. */
static void a_quaternion_is_nearly_of_length_1(void **state) {
  (void)state;
  static const struct {
    double w, z, square;
  } limit[2] = {{0x1.8p-7, 0x1.fad1917ed80fap-1, 0.98}, {0x1p-7, 0x1.028a229f0b97dp+0, 1.02}};
  static uint8_t bytes[RIM_LCM_PLAN_SIZE];
  for (int i = 0; i < 2; ++i) {
    assert_true(limit[i].w * limit[i].w + limit[i].z * limit[i].z == limit[i].square);
    for (int within = 0; within < 2; ++within) {
      rim_plan p = sample_plan(1), back;
      p.pose[0].orientation[0] = limit[i].w;
      p.pose[0].orientation[3] = limit[i].z + (within ? i == 0 ? 1e-12 : -1e-12 : 0.0);
      assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_OK);
      assert_int_equal(rim_lcm_unpack_plan(&back, bytes, sizeof bytes),
                       within ? RIM_OK : RIM_E_DATA);
    }
  }
}

/* Inside already: 0 s, which is not the same as never. */
static void an_entry_may_be_now(void **state) {
  (void)state;
  const rim_entry e = {.t_s = 1.0, .to_entry_s = 0.0};
  uint8_t bytes[RIM_LCM_ENTRY_SIZE];
  rim_can_frame f;
  rim_entry back;
  assert_int_equal(rim_lcm_pack_entry(bytes, sizeof bytes, &e), RIM_OK);
  assert_int_equal(rim_lcm_unpack_entry(&back, bytes, sizeof bytes), RIM_OK);
  assert_true(back.to_entry_s == 0.0);
  assert_int_equal(rim_can_pack_entry(&f, 3, &e), RIM_OK);
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_OK);
  assert_true(back.to_entry_s == 0.0);
}

static void plans_that_cannot_be_are_refused(void **state) {
  (void)state;
  static uint8_t bytes[RIM_LCM_PLAN_SIZE + 1];
  rim_plan p = sample_plan(5), back = sample_plan(9);
  const rim_plan before = back;
  assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_OK);
  for (size_t n = 0; n < RIM_LCM_PLAN_SIZE; n += 7)
    assert_int_equal(rim_lcm_unpack_plan(&back, bytes, n), RIM_E_TRUNCATED);
  assert_int_equal(rim_lcm_unpack_plan(&back, bytes, RIM_LCM_PLAN_SIZE + 1), RIM_E_SIZE);
  bytes[0] ^= 1;
  assert_int_equal(rim_lcm_unpack_plan(&back, bytes, RIM_LCM_PLAN_SIZE), RIM_E_MAGIC);
  p.count = 65;
  assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_E_RANGE);
  for (unsigned wrong = 0; wrong < 4; ++wrong) {
    p = sample_plan(5);
    if (wrong == 0)
      p.pose[3].after_s = 0.2; /* before the pose before it */
    if (wrong == 1)
      p.pose[2].position[1] = (double)NAN;
    if (wrong == 2)
      p.pose[4].orientation[0] = 7.0;
    if (wrong == 3)
      p.pose[0].after_s = (double)INFINITY;
    assert_int_equal(rim_lcm_pack_plan(bytes, sizeof bytes, &p), RIM_OK);
    assert_int_equal(rim_lcm_unpack_plan(&back, bytes, RIM_LCM_PLAN_SIZE), RIM_E_DATA);
    assert_memory_equal(&back, &before, sizeof back); /* a plan that is none replaces none */
  }
  rim_entry e = {0.0, -0.5, 0, 0, 0, 0, 0, 0};
  assert_int_equal(rim_lcm_pack_entry(bytes, sizeof bytes, &e), RIM_E_DATA);
}

static void a_frame_says_the_time(void **state) {
  (void)state;
  rim_can_frame f;
  rim_entry e = {1.0, 12.34, 0x101, 0x202, 0x303, 0x404, 0, 1};
  assert_int_equal(rim_can_pack_entry(&f, 3, &e), RIM_OK);
  assert_int_equal(f.id, 0x383);
  assert_int_equal(f.data[0] | f.data[1] << 8, 1234);
  assert_true(f.data[2] == 1 && f.data[3] == 2 && f.data[4] == 3 && f.data[5] == 4 &&
              f.data[6] == 1);
  e.to_entry_s = 1e9;
  assert_int_equal(rim_can_pack_entry(&f, 3, &e), RIM_OK);
  assert_int_equal(f.data[0] | f.data[1] << 8, 65534);
  e.to_entry_s = RIM_ENTRY_NEVER;
  assert_int_equal(rim_can_pack_entry(&f, 3, &e), RIM_OK);
  assert_int_equal(f.data[0] | f.data[1] << 8, 65535);
  assert_int_equal(rim_can_pack_entry(&f, 128, &e), RIM_E_RANGE);
}

static void a_frame_reads_back(void **state) {
  (void)state;
  rim_can_frame f;
  rim_entry e = {1.0, 12.34, 0x101, 0x202, 0x303, 0x404, 7, RIM_ALARM_FLAG_REPLAY}, back;
  assert_int_equal(rim_can_pack_entry(&f, 127, &e), RIM_OK);
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_OK);
  assert_float_equal(back.to_entry_s, 12.34, 1e-9);
  assert_true(back.sequence == 1 && back.alarm_sequence == 2 && back.plan_sequence == 3 &&
              back.model_id == 4 && back.flags == RIM_ALARM_FLAG_REPLAY && back.pose == 0);
  for (unsigned i = 0; i < 8; ++i) {
    rim_can_frame hurt = f;
    hurt.data[i] ^= 0x10u;
    assert_int_equal(rim_can_unpack_entry(&back, &hurt), RIM_E_CRC);
  }
  f.length = 7;
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_E_TRUNCATED);
  f.length = 9;
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_E_SIZE);
  f.length = 8;
  f.id = RIM_CAN_ENTRY_ID + 128;
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_E_MAGIC);
  f.id = RIM_CAN_ENTRY_ID - 1;
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_E_MAGIC);
  assert_int_equal(rim_can_unpack_entry(NULL, &f), RIM_E_ARGUMENT);
  e.to_entry_s = RIM_ENTRY_NEVER;
  assert_int_equal(rim_can_pack_entry(&f, 0, &e), RIM_OK);
  assert_int_equal(rim_can_unpack_entry(&back, &f), RIM_OK);
  assert_true(back.to_entry_s == RIM_ENTRY_NEVER);
}

/* Another type is told from one that was cut, however long it is. */
static void a_short_message_of_another_type_is_told(void **state) {
  (void)state;
  const uint8_t other[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  rim_entry out;
  assert_int_equal(rim_lcm_unpack_entry(&out, other, sizeof other), RIM_E_MAGIC);
  assert_int_equal(rim_lcm_unpack_entry(&out, other, 7), RIM_E_TRUNCATED);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_short_message_of_another_type_is_told),
      cmocka_unit_test(plans_equal_the_generated_encoder),
      cmocka_unit_test(an_entry_equals_the_generated_encoder),
      cmocka_unit_test(a_wrong_number_anywhere_is_refused),
      cmocka_unit_test(poses_may_be_at_the_same_time),
      cmocka_unit_test(a_quaternion_is_nearly_of_length_1),
      cmocka_unit_test(an_entry_may_be_now),
      cmocka_unit_test(plans_that_cannot_be_are_refused),
      cmocka_unit_test(a_frame_says_the_time),
      cmocka_unit_test(a_frame_reads_back),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
