/* SPDX-License-Identifier: MIT */
/* CAN frames: what goes in comes out, to the precision that the bytes have, and nothing else does.
 */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "alarm_sample.h"
#include "base/crc.h"
#include "base/ellipsoid.h"
#include "rim/can.h"

#define SAMPLES 500u

static void assert_near(double got, double want, double tolerance) {
  if (!(fabs(got - want) <= tolerance))
    fail_msg("%.9g is not %.9g within %g", got, want, tolerance);
}

static void summary_says_what_the_record_says(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < SAMPLES; ++seed) {
    const rim_alarm a = sample_alarm(seed);
    const uint32_t node = seed % 128u;
    rim_can_frame frame;
    rim_can_summary s;
    assert_int_equal(rim_can_pack_summary(&frame, node, &a), RIM_OK);
    assert_int_equal(frame.id, 0x180u + node);
    assert_int_equal(frame.length, 8);
    assert_int_equal(rim_can_unpack_summary(&s, &frame), RIM_OK);
    assert_int_equal(s.node, node);
    assert_int_equal(s.level, a.level);
    assert_int_equal(s.state, a.state);
    assert_int_equal(s.detector, a.detector);
    assert_int_equal(s.kind, a.kind);
    assert_int_equal(s.flags, a.flags);
    assert_int_equal(s.seq, a.seq & 0xffu);
    assert_int_equal(s.model_id, a.model_id & 0xffu);
    assert_int_equal(s.dims, a.region.dims);
    assert_int_equal(s.observations, a.observations < 65535u ? a.observations : 65535u);
    assert_near(s.ln_anom, a.ln_anom, 0.125);
  }
}

static void numbers_that_do_not_fit_saturate(void **state) {
  (void)state;
  rim_alarm a = sample_alarm(1);
  rim_can_frame frame;
  rim_can_summary s;
  rim_alarm back;
  a.ln_anom = 1e9;
  a.observations = UINT32_MAX;
  a.shift[0] = 1e300;
  a.t_s = 1e9;
  a.since_s = -5.0;
  a.p_value = 0.0;
  assert_int_equal(rim_can_pack_summary(&frame, 0, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_summary(&s, &frame), RIM_OK);
  assert_int_equal(s.observations, 65535);
  assert_near(s.ln_anom, 1023.75, 0.0);
  assert_int_equal(rim_can_pack_detail_fd(&frame, 0, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_OK);
  assert_near(back.t_s, 4294967.294, 1e-6);
  assert_near(back.since_s, 0.0, 0.0);
  assert_near(back.shift[0], 3.4028235e38, 1e32);
  assert_int_equal(back.observations, UINT32_MAX);
  assert_true(back.p_value > 0.0 && back.p_value < 1e-9);
  a.ln_anom = -1.0;
  assert_int_equal(rim_can_pack_summary(&frame, 0, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_summary(&s, &frame), RIM_OK);
  assert_near(s.ln_anom, 0.0, 0.0);
}

static void assert_same_record(const rim_alarm *got, const rim_alarm *want) {
  assert_true(got->t_s == want->t_s && got->since_s == want->since_s);
  assert_int_equal(got->seq, want->seq);
  assert_int_equal(got->model_id, want->model_id);
  assert_int_equal(got->observations, want->observations);
  assert_memory_equal(&got->detector, &want->detector, 1);
  assert_int_equal(got->state, want->state);
  assert_int_equal(got->level, want->level);
  assert_int_equal(got->kind, want->kind);
  assert_int_equal(got->flags, want->flags);
  assert_int_equal(got->channels, want->channels);
  assert_memory_equal(got->channel, want->channel, sizeof got->channel);
  assert_int_equal(got->region.dims, want->region.dims);
  assert_memory_equal(got->region.feature, want->region.feature, sizeof got->region.feature);
  for (int i = 0; i < RIM_ALARM_MAX_CHANNELS; ++i) {
    assert_true(got->shift[i] == (double)(float)want->shift[i]);
    assert_true(got->shift_sd[i] == (double)(float)want->shift_sd[i]);
  }
  for (int i = 0; i < 9; ++i)
    assert_true(got->region.inverse_shape[i] == (double)(float)want->region.inverse_shape[i]);
  for (int i = 0; i < 3; ++i) {
    assert_true(got->region.center[i] == (double)(float)want->region.center[i]);
    assert_true(got->region.lower[i] == (double)(float)want->region.lower[i]);
    assert_true(got->region.upper[i] == (double)(float)want->region.upper[i]);
  }
  assert_true(got->ln_anom == (double)(float)want->ln_anom);
  assert_true(got->threshold == (double)(float)want->threshold);
  assert_true(got->p_value == (double)(float)want->p_value);
  assert_true(got->since_sd_s == (double)(float)want->since_sd_s);
}

static void segments_carry_the_record(void **state) {
  (void)state;
  rim_can_assembly assembly = {.node = 5};
  for (uint32_t seed = 0; seed < SAMPLES; ++seed) {
    const rim_alarm a = sample_alarm(seed);
    rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
    rim_alarm back;
    bool complete = true; /* what was there is gone */
    assert_int_equal(rim_can_pack_detail(frame, 5, &a), RIM_OK);
    for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i) {
      assert_int_equal(rim_can_take_detail(&assembly, &frame[i], &back, &complete), RIM_OK);
      assert_int_equal(complete, i + 1u == RIM_CAN_DETAIL_FRAMES);
    }
    assert_same_record(&back, &a);
  }
  assert_int_equal(assembly.lost, 0);
}

/* Little-endian, as the public description has it. */
static uint64_t whole_at(const uint8_t *bytes, size_t at, size_t count) {
  uint64_t value = 0;
  for (size_t i = count; i-- > 0;)
    value = value << 8 | bytes[at + i];
  return value;
}

static double f32_at(const uint8_t *bytes, size_t at) {
  const uint32_t bits = (uint32_t)whole_at(bytes, at, 4);
  float value;
  memcpy(&value, &bits, sizeof value);
  return (double)value;
}

static double f64_at(const uint8_t *bytes, size_t at) {
  const uint64_t bits = whole_at(bytes, at, 8);
  double value;
  memcpy(&value, &bits, sizeof value);
  return value;
}

static void are_floats(const uint8_t *bytes, size_t at, const double *want, size_t count) {
  for (size_t i = 0; i < count; ++i)
    assert_true(f32_at(bytes, at + 4 * i) == want[i]);
}

/* Every number is one that single precision holds, and no two are the same. */
static rim_alarm distinct_alarm(void) {
  double next = 0.5;
  rim_alarm a;
  memset(&a, 0, sizeof a);
  a.t_s = 1234.0625;
  a.since_s = 1000.125;
  a.seq = 0x01020304u;
  a.model_id = 0x05060708u;
  a.observations = 0x090a0b0cu;
  a.detector = RIM_DETECTOR_INTERFERENCE;
  a.state = RIM_ALARM_UPDATED;
  a.level = RIM_LEVEL_STALE;
  a.kind = RIM_KIND_PUSHED;
  a.flags = RIM_ALARM_FLAG_LATCHED | RIM_ALARM_FLAG_REPLAY;
  a.channels = 4;
  a.region.dims = 3;
  for (size_t i = 0; i < 4; i++, next += 1.0) {
    a.channel[i] = (uint16_t)(0x1100u + i);
    a.shift[i] = next;
    a.shift_sd[i] = next + 100.0;
  }
  for (size_t i = 0; i < 9; i++, next += 1.0)
    a.region.inverse_shape[i] = next + 200.0;
  for (size_t i = 0; i < 3; i++, next += 1.0) {
    a.region.feature[i] = (uint16_t)(0x2200u + i);
    a.region.center[i] = next + 300.0;
    a.region.lower[i] = next + 400.0;
    a.region.upper[i] = next + 500.0;
  }
  a.ln_anom = 601.5;
  a.threshold = 602.5;
  a.p_value = 0.0625;
  a.since_sd_s = 603.5;
  return a;
}

/* Read by the offsets that rim/can.h promises, and by nothing of ours. */
static void the_record_lies_where_it_is_documented(void **state) {
  (void)state;
  const rim_alarm a = distinct_alarm();
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  uint8_t segments[6 + 7 * (RIM_CAN_DETAIL_FRAMES - 1)];
  assert_int_equal(rim_can_pack_detail(frame, 5, &a), RIM_OK);
  /* ISO 15765-2: 12 bits of length in the first frame, then 4 bits of a running index. */
  assert_int_equal(frame[0].data[0] << 8 | frame[0].data[1], 0x1000u + sizeof segments);
  memcpy(segments, frame[0].data + 2, 6);
  for (size_t i = 1; i < RIM_CAN_DETAIL_FRAMES; ++i) {
    assert_int_equal(frame[i].data[0], 0x20u + i % 16u);
    memcpy(segments + 6 + 7 * (i - 1), frame[i].data + 1, 7);
  }
  assert_int_equal(segments[0], 2);
  const uint8_t *record = segments + 1;
  assert_true(f64_at(record, 0) == a.t_s && f64_at(record, 8) == a.since_s);
  assert_int_equal(whole_at(record, 16, 4), a.seq);
  assert_int_equal(whole_at(record, 20, 4), a.model_id);
  assert_int_equal(whole_at(record, 24, 4), a.observations);
  const uint8_t codes[7] = {a.detector, a.state, a.level, a.kind, a.flags, 4, 3};
  assert_memory_equal(record + 28, codes, sizeof codes);
  for (size_t i = 0; i < 4; ++i)
    assert_int_equal(whole_at(record, 35 + 2 * i, 2), a.channel[i]);
  for (size_t i = 0; i < 3; ++i)
    assert_int_equal(whole_at(record, 43 + 2 * i, 2), a.region.feature[i]);
  are_floats(record, 49, a.shift, 4);
  are_floats(record, 65, a.shift_sd, 4);
  are_floats(record, 81, a.region.center, 3);
  are_floats(record, 93, a.region.inverse_shape, 9);
  are_floats(record, 129, a.region.lower, 3);
  are_floats(record, 141, a.region.upper, 3);
  are_floats(record, 153, &a.ln_anom, 1);
  are_floats(record, 157, &a.threshold, 1);
  are_floats(record, 161, &a.p_value, 1);
  are_floats(record, 165, &a.since_sd_s, 1);
  const uint8_t name[2] = {0x85, 0x02}; /* 0x280 + 5 */
  assert_int_equal(whole_at(record, 169, 4), rimi_crc32(rimi_crc32(0, name, 2), segments, 170));
}

static void lost_and_shuffled_segments_are_counted(void **state) {
  (void)state;
  rim_can_assembly assembly = {.node = 5};
  const rim_alarm a = sample_alarm(3);
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  rim_alarm back;
  bool complete;
  assert_int_equal(rim_can_pack_detail(frame, 5, &a), RIM_OK);
  for (uint32_t gap = 0; gap < RIM_CAN_DETAIL_FRAMES; ++gap) {
    for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i) {
      if (i == gap)
        continue;
      rim_can_take_detail(&assembly, &frame[i], &back, &complete);
      assert_false(complete);
    }
  }
  /* Every record but the one without its first segment was begun, and given up once; the last is
   * still under way. */
  assert_int_equal(assembly.lost, RIM_CAN_DETAIL_FRAMES - 2);
  const uint32_t before = assembly.lost;
  rim_can_take_detail(&assembly, &frame[0], &back, &complete);
  assert_int_equal(assembly.lost, before + 1);
  assert_int_equal(rim_can_take_detail(&assembly, &frame[2], &back, &complete), RIM_E_TRUNCATED);
  /* And then a whole one goes through. */
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
    assert_int_equal(rim_can_take_detail(&assembly, &frame[i], &back, &complete), RIM_OK);
  assert_true(complete);
}

static void damaged_segments_are_refused(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(4);
  rim_can_frame whole[RIM_CAN_DETAIL_FRAMES];
  assert_int_equal(rim_can_pack_detail(whole, 5, &a), RIM_OK);
  for (uint32_t bit = 0; bit < (RIM_CAN_DETAIL_SIZE + 4u) * 8u; ++bit) {
    rim_can_assembly assembly = {.node = 5};
    rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
    rim_alarm back;
    bool complete = false;
    memcpy(frame, whole, sizeof frame);
    const uint32_t byte = bit / 8u;
    uint8_t *hit = byte < 6u ? &frame[0].data[2 + byte]
                             : &frame[1u + (byte - 6u) / 7u].data[1u + (byte - 6u) % 7u];
    *hit ^= (uint8_t)(1u << (bit % 8u));
    rim_status status = RIM_OK;
    for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
      status = rim_can_take_detail(&assembly, &frame[i], &back, &complete);
    assert_int_equal(status, RIM_E_CRC);
    assert_false(complete);
    assert_int_equal(assembly.lost, 1);
  }
}

/* Fills the frames of a record of node 5; gives who waits for them. */
static rim_can_assembly pack_from_5(rim_can_frame *frame) {
  const rim_can_assembly assembly = {.node = 5};
  const rim_alarm a = sample_alarm(4);
  assert_int_equal(rim_can_pack_detail(frame, 5, &a), RIM_OK);
  return assembly;
}

static void another_length_or_layout_is_refused(void **state) {
  (void)state;
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], other;
  rim_can_assembly assembly = pack_from_5(frame);
  rim_alarm back;
  bool complete;
  other = frame[0];
  other.data[1]--;
  assert_int_equal(rim_can_take_detail(&assembly, &other, &back, &complete), RIM_E_VERSION);
  assert_int_equal(assembly.next, 0);
  /* A single frame and a flow control are no segments, also in the midst of a record. */
  assert_int_equal(rim_can_take_detail(&assembly, &frame[0], &back, &complete), RIM_OK);
  for (unsigned type = 0; type < 16; ++type) {
    other.data[0] = (uint8_t)(type << 4);
    if (type != 1 && type != 2)
      assert_int_equal(rim_can_take_detail(&assembly, &other, &back, &complete), RIM_E_MAGIC);
  }
  for (uint32_t i = 1; i < RIM_CAN_DETAIL_FRAMES; ++i)
    assert_int_equal(rim_can_take_detail(&assembly, &frame[i], &back, &complete), RIM_OK);
  assert_true(complete);
  /* Another layout, with a check sum that is right. */
  uint8_t record[RIM_CAN_DETAIL_SIZE + 4], name[2] = {0x85, 0x02};
  memcpy(record, assembly.data, sizeof record);
  record[0] = 3;
  const uint32_t crc = rimi_crc32(rimi_crc32(0, name, 2), record, RIM_CAN_DETAIL_SIZE);
  for (unsigned k = 0; k < 4; ++k)
    frame[24].data[4 + k] = (uint8_t)(crc >> (8 * k));
  frame[0].data[2] = 3;
  rim_status status = RIM_OK;
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i)
    status = rim_can_take_detail(&assembly, &frame[i], &back, &complete);
  assert_int_equal(status, RIM_E_VERSION);
  assert_int_equal(assembly.lost, 1);
}

static void segments_of_others_change_nothing(void **state) {
  (void)state;
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES], other;
  rim_can_assembly assembly = pack_from_5(frame);
  rim_alarm back;
  bool complete;
  for (uint32_t i = 0; i < RIM_CAN_DETAIL_FRAMES; ++i) {
    other = frame[i];
    other.id++;
    assert_int_equal(rim_can_take_detail(&assembly, &other, &back, &complete), RIM_E_MAGIC);
    other = frame[i];
    other.length = 7;
    assert_int_equal(rim_can_take_detail(&assembly, &other, &back, &complete), RIM_E_SIZE);
    assert_int_equal(rim_can_take_detail(&assembly, &frame[i], &back, &complete), RIM_OK);
  }
  assert_true(complete);
}

static void one_fd_frame_carries_the_box(void **state) {
  (void)state;
  for (uint32_t seed = 0; seed < SAMPLES; ++seed) {
    const rim_alarm a = sample_alarm(seed);
    rim_can_frame frame;
    rim_alarm back;
    assert_int_equal(rim_can_pack_detail_fd(&frame, 9, &a), RIM_OK);
    assert_true(frame.fd && frame.length == 64);
    assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_OK);
    assert_int_equal(back.level, a.level);
    assert_int_equal(back.state, a.state);
    assert_int_equal(back.detector, a.detector);
    assert_int_equal(back.seq, a.seq & 0xffu);
    assert_int_equal(back.kind, a.kind);
    assert_int_equal(back.flags, a.flags);
    assert_int_equal(back.model_id, a.model_id & 0xffffu);
    assert_int_equal(back.observations, a.observations);
    assert_int_equal(back.channels, a.channels < 2 ? a.channels : 2);
    assert_int_equal(back.channel[0], a.channel[0]);
    assert_near(back.t_s, a.t_s, 5.01e-4);
    assert_near(back.since_s, a.since_s, 5.01e-4);
    assert_int_equal(back.channel[1], a.channel[1]);
    assert_near(back.shift[0], a.shift[0], 1e-5);
    assert_near(back.shift_sd[0], a.shift_sd[0], 1e-5);
    for (uint32_t i = 1; i < RIM_ALARM_MAX_CHANNELS; ++i) /* the frame has no room for more */
      assert_true(back.shift[i] == 0.0 && back.shift_sd[i] == 0.0);
    assert_near(back.ln_anom, a.ln_anom, 1.0 / 32.0);
    assert_near(back.p_value / a.p_value, 1.0, 0.05);
    assert_int_equal(back.region.dims, a.region.dims);
    for (uint32_t d = 0; d < a.region.dims; ++d) {
      assert_int_equal(back.region.feature[d], a.region.feature[d]);
      assert_near(back.region.lower[d], a.region.lower[d], 1e-4);
      assert_near(back.region.upper[d], a.region.upper[d], 1e-4);
    }
  }
}

static void a_missing_box_is_computed(void **state) {
  (void)state;
  rim_alarm a = sample_alarm(8), back;
  rim_can_frame frame;
  const uint16_t feature[2] = {3, 4};
  const double lower[2] = {-1.0, 10.0}, upper[2] = {2.0, 14.0};
  assert_int_equal(rimi_region_from_box(&a.region, 2, feature, lower, upper), RIM_OK);
  memset(a.region.lower, 0, sizeof a.region.lower);
  memset(a.region.upper, 0, sizeof a.region.upper);
  assert_int_equal(rim_can_pack_detail_fd(&frame, 1, &a), RIM_OK);
  assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_OK);
  assert_near(back.region.lower[1], 10.0, 1e-5);
  assert_near(back.region.upper[0], 2.0, 1e-5);
  memset(a.region.inverse_shape, 0, sizeof a.region.inverse_shape);
  assert_int_equal(rim_can_pack_detail_fd(&frame, 1, &a), RIM_E_DATA);
}

/* Of a box that has an interior the frame carries one, however narrow or far out it lies. */
static void a_narrow_box_unpacks(void **state) {
  (void)state;
  const double far = (double)FLT_MAX;
  const double middle[] = {1e6, -1.0, 16777216.0, 0.0, 1e-44, 1e-300, far, -far, 1e300};
  for (size_t i = 0; i < 1 + sizeof middle / sizeof middle[0]; ++i) {
    const bool is_given = i > 0;
    const double at = middle[is_given ? i - 1 : 0], half = at == 0.0 ? 1e-60 : 0x1p-40 * fabs(at);
    rim_alarm a = {.region = {.dims = 1, .center = {at}, .inverse_shape = {1.0}}}, back;
    rim_can_frame frame;
    if (is_given) {
      a.region.lower[0] = at - half;
      a.region.upper[0] = at + half;
    } else {
      a.region.inverse_shape[0] = 1.0 / (half * half);
    }
    assert_int_equal(rim_can_pack_detail_fd(&frame, 1, &a), RIM_OK);
    assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_OK);
    const double low = back.region.lower[0], high = back.region.upper[0];
    assert_true(low < high && high - low <= 4e-7 * fabs(low) + 4e-38);
    assert_true(fabs(at) >= far || (low < at && at < high));
  }
}

/* Features are all different: a frame that names one twice would not unpack. */
static void a_feature_named_twice_is_refused(void **state) {
  (void)state;
  rim_can_frame frame;
  rim_alarm a = {.region = {.dims = 2, .feature = {0xffff, 0xfffe}, .upper = {1.0, 1.0}}};
  assert_int_equal(rim_can_pack_detail_fd(&frame, 1, &a), RIM_OK);
  a.region.feature[1] = 0xffff;
  assert_int_equal(rim_can_pack_detail_fd(&frame, 1, &a), RIM_E_RANGE);
}

static void every_flipped_bit_is_seen(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(11);
  rim_can_frame summary, fd;
  rim_can_summary s;
  rim_alarm back;
  assert_int_equal(rim_can_pack_summary(&summary, 6, &a), RIM_OK);
  assert_int_equal(rim_can_pack_detail_fd(&fd, 6, &a), RIM_OK);
  for (uint32_t bit = 0; bit < 64; ++bit) {
    rim_can_frame frame = summary;
    frame.data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
    assert_int_equal(rim_can_unpack_summary(&s, &frame), RIM_E_CRC);
  }
  for (uint32_t bit = 0; bit < 512; ++bit) {
    rim_can_frame frame = fd;
    frame.data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
    assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_E_CRC);
  }
  summary.id++; /* another node's */
  assert_int_equal(rim_can_unpack_summary(&s, &summary), RIM_E_CRC);
  summary.id = 0x17f;
  assert_int_equal(rim_can_unpack_summary(&s, &summary), RIM_E_MAGIC);
  summary.id = 0x200;
  assert_int_equal(rim_can_unpack_summary(&s, &summary), RIM_E_MAGIC);
  fd.length = 48;
  assert_int_equal(rim_can_unpack_detail_fd(&back, &fd), RIM_E_SIZE);
}

/* A sender with a right check sum and a wrong content. */
static void right_sums_do_not_excuse_wrong_contents(void **state) {
  (void)state;
  const rim_alarm a = sample_alarm(12);
  rim_can_frame fd;
  rim_alarm back;
  assert_int_equal(rim_can_pack_detail_fd(&fd, 6, &a), RIM_OK);
  fd.data[16] |= 0x1cu; /* seven channels */
  const uint8_t id[2] = {(uint8_t)fd.id, (uint8_t)(fd.id >> 8)};
  fd.data[63] = rimi_crc8(rimi_crc8(0, id, 2), fd.data, 63);
  assert_int_equal(rim_can_unpack_detail_fd(&back, &fd), RIM_E_RANGE);
  rim_can_frame summary;
  rim_can_summary s;
  assert_int_equal(rim_can_pack_summary(&summary, 6, &a), RIM_OK);
  summary.data[0] |= 0xe0u; /* kind 7 */
  const uint8_t summary_id[2] = {(uint8_t)summary.id, (uint8_t)(summary.id >> 8)};
  summary.data[7] = rimi_crc8(rimi_crc8(0, summary_id, 2), summary.data, 7);
  assert_int_equal(rim_can_unpack_summary(&s, &summary), RIM_E_RANGE);
  assert_int_equal(rim_can_pack_detail_fd(&fd, 6, &a), RIM_OK);
  memset(fd.data + 28, 0xff, 4); /* NaN */
  fd.data[63] = rimi_crc8(rimi_crc8(0, id, 2), fd.data, 63);
  assert_int_equal(rim_can_unpack_detail_fd(&back, &fd), RIM_E_DATA);
}

static void wrong_records_are_not_sent(void **state) {
  (void)state;
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  rim_alarm a = sample_alarm(2);
  memset(frame, 0x55, sizeof frame);
  assert_int_equal(rim_can_pack_summary(NULL, 1, &a), RIM_E_ARGUMENT);
  assert_int_equal(rim_can_pack_summary(frame, 1, NULL), RIM_E_ARGUMENT);
  assert_int_equal(rim_can_pack_detail(frame, 128, &a), RIM_E_RANGE);
  a.channels = RIM_ALARM_MAX_CHANNELS + 1;
  assert_int_equal(rim_can_pack_detail(frame, 1, &a), RIM_E_RANGE);
  a = sample_alarm(2);
  a.region.dims = RIM_REGION_MAX_DIMS + 1;
  assert_int_equal(rim_can_pack_detail_fd(frame, 1, &a), RIM_E_RANGE);
  a = sample_alarm(2);
  a.ln_anom = (double)NAN;
  assert_int_equal(rim_can_pack_summary(frame, 1, &a), RIM_E_DATA);
  for (size_t i = 0; i < sizeof frame; ++i)
    assert_int_equal(((const uint8_t *)frame)[i], 0x55);
}

/* The last node that may be is heard, and what an assembly can no longer count is given up. */
static void the_last_node_and_segment(void **state) {
  (void)state;
  rim_can_assembly assembly = {.node = RIM_CAN_MAX_NODE};
  const rim_alarm a = sample_alarm(3);
  rim_can_frame frame[RIM_CAN_DETAIL_FRAMES];
  rim_alarm back;
  bool complete = false;
  assert_int_equal(rim_can_pack_detail(frame, RIM_CAN_MAX_NODE, &a), RIM_OK);
  assert_int_equal(rim_can_take_detail(&assembly, &frame[0], &back, &complete), RIM_OK);
  assembly.next = RIM_CAN_DETAIL_FRAMES; /* memory that was hit */
  frame[1].data[0] = (uint8_t)((frame[1].data[0] & 0xf0u) | (RIM_CAN_DETAIL_FRAMES & 15u));
  assert_int_equal(rim_can_take_detail(&assembly, &frame[1], &back, &complete), RIM_E_TRUNCATED);
  assert_true(assembly.next == 0 && assembly.lost == 1 && !complete);
}

/* Outcomes and features that an alarm does not name are 0 in its frame, and so they are read. */
static void a_frame_has_what_is_named_alone(void **state) {
  (void)state;
  for (uint8_t named = 0; named < 3; ++named) {
    rim_alarm a = sample_alarm(3), back;
    rim_can_frame frame;
    a.channels = a.region.dims = named;
    for (uint16_t i = 0; i < 3; ++i) {
      a.channel[i] = (uint16_t)(0x101u + i);
      a.region.feature[i] = (uint16_t)(0x201u + i);
      a.region.lower[i] = -1.0;
      a.region.upper[i] = 1.0;
    }
    assert_int_equal(rim_can_pack_detail_fd(&frame, 9, &a), RIM_OK);
    for (uint32_t i = 0; i < 2; ++i)
      assert_int_equal(whole_at(frame.data, 18 + 2 * i, 2), i < named ? 0x101u + i : 0u);
    for (uint32_t i = 0; i < 3; ++i)
      assert_int_equal(whole_at(frame.data, 22 + 2 * i, 2), i < named ? 0x201u + i : 0u);
    assert_int_equal(rim_can_unpack_detail_fd(&back, &frame), RIM_OK);
    assert_int_equal(back.channel[2], 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_last_node_and_segment),
      cmocka_unit_test(a_frame_has_what_is_named_alone),
      cmocka_unit_test(summary_says_what_the_record_says),
      cmocka_unit_test(numbers_that_do_not_fit_saturate),
      cmocka_unit_test(segments_carry_the_record),
      cmocka_unit_test(the_record_lies_where_it_is_documented),
      cmocka_unit_test(lost_and_shuffled_segments_are_counted),
      cmocka_unit_test(damaged_segments_are_refused),
      cmocka_unit_test(another_length_or_layout_is_refused),
      cmocka_unit_test(segments_of_others_change_nothing),
      cmocka_unit_test(a_narrow_box_unpacks),
      cmocka_unit_test(a_feature_named_twice_is_refused),
      cmocka_unit_test(one_fd_frame_carries_the_box),
      cmocka_unit_test(a_missing_box_is_computed),
      cmocka_unit_test(every_flipped_bit_is_seen),
      cmocka_unit_test(right_sums_do_not_excuse_wrong_contents),
      cmocka_unit_test(wrong_records_are_not_sent),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
