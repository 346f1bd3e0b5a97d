/* SPDX-License-Identifier: MIT */
/* monitor: flight images are refused in every damaged form; of a vehicle small enough to know what
 * should be found exactly that is found (the images and the vehicle: monitor_bench.h). */
#include <math.h>

#include "base/bytes.h"
#include "image/correct.h"
#include "monitor/inspect.h"
#include "monitor_bench.h"

/* ---- memory and images ---- */

static void memory_is_checked_and_not_left(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    const size_t need = size_of(external);
    size_t told = 0;
    rim_monitor *m = NULL;
    assert_int_equal(rim_monitor_size(b.blob.byte, b.blob.size, &told), RIM_OK);
    assert_int_equal(told, need);
    assert_int_equal(rim_monitor_size(NULL, b.blob.size, &told), RIM_E_ARGUMENT);
    assert_int_equal(rim_monitor_init(&m, b.memory, need - 1, b.blob.byte, b.blob.size),
                     RIM_E_SIZE);
    for (size_t shift = 1; shift < 8; ++shift) {
      assert_int_equal(rim_monitor_init(&m, b.memory + shift, need, b.blob.byte, b.blob.size),
                       RIM_E_ALIGN);
    }
    assert_int_equal(rim_monitor_init(NULL, b.memory, need, b.blob.byte, b.blob.size),
                     RIM_E_ARGUMENT);
    assert_int_equal(rim_monitor_init(&m, NULL, need, b.blob.byte, b.blob.size), RIM_E_ARGUMENT);
    assert_int_equal(rim_monitor_init(&m, b.memory, need, NULL, b.blob.size), RIM_E_ARGUMENT);
    assert_null(m);
    memset(b.memory, 0xa5, sizeof b.memory);
    b.monitor = NULL;
    assert_int_equal(rim_monitor_init(&b.monitor, b.memory + 64, need, b.blob.byte, b.blob.size),
                     RIM_OK);
    (void)run_digest(&b, 1, 0, 600, 1.0);
    for (size_t i = 0; i < sizeof b.memory; ++i) {
      if (i < 64 || i >= 64 + need)
        assert_int_equal(b.memory[i], 0xa5);
    }
    row r;
    rim_verdict v;
    make_row(&r, external, 1, 700, 0.0);
    assert_int_equal(rim_monitor_step(NULL, &r.view, &v), RIM_E_ARGUMENT);
    assert_int_equal(rim_monitor_step(b.monitor, NULL, &v), RIM_E_ARGUMENT);
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, NULL), RIM_E_ARGUMENT);
    r.view.context = NULL;
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_E_ARGUMENT);
  }
}

static rim_status init_status(const recipe *r) {
  static bench b;
  build(&b.blob, r);
  memset(b.memory, 0x3c, sizeof b.memory);
  const rim_status status =
      rim_monitor_init(&b.monitor, b.memory, sizeof b.memory, b.blob.byte, b.blob.size);
  for (size_t i = 0; status != RIM_OK && i < sizeof b.memory; ++i)
    assert_int_equal(b.memory[i], 0x3c);
  size_t size = 0;
  assert_int_equal(rim_monitor_size(b.blob.byte, b.blob.size, &size), status);
  return status;
}

static void sections_missing_or_of_another_size_are_refused(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    for (size_t id = 1; id < SECTIONS; ++id) {
      recipe r = calibrated[external];
      bytes *b = &r.section[id];
      if (b->size == 0)
        continue;
      const bool optional = id == RIM_SECTION_NAMES;
      const bool counted = id == RIM_SECTION_THRESHOLD || id == RIM_SECTION_BASIS ||
                           id == RIM_SECTION_BEHAVIOUR || id == RIM_SECTION_AGREEMENT ||
                           id == RIM_SECTION_NOISE;
      const size_t size = b->size;
      b->size = 0;
      assert_int_equal(init_status(&r), optional ? RIM_OK : RIM_E_CONFIG);
      if (id == RIM_SECTION_NAMES)
        continue;
      for (int longer = 0; longer < 2; ++longer) {
        b->size = longer ? size + 1 : size - 1;
        const rim_status status = init_status(&r);
        /* Sections that carry their own counts name the cause. */
        if (counted)
          assert_true(status == RIM_E_TRUNCATED || status == RIM_E_SIZE);
        else
          assert_int_equal(status, RIM_E_CONFIG);
      }
    }
  }
}

static void words_out_of_range_are_refused(void **state) {
  (void)state;
  static const struct {
    rim_config_word word;
    uint32_t value;
    bool of_both; /* else the trained image does not read it, or its models say more */
  } words[] = {
      {RIM_CONFIG_FEATURES, 0, true},
      {RIM_CONFIG_FEATURES, 129, true},
      {RIM_CONFIG_FEATURES, D + 1, true},
      {RIM_CONFIG_OUTCOMES, 0, true},
      {RIM_CONFIG_OUTCOMES, 129, true},
      {RIM_CONFIG_OUTCOMES, O + 1, false},
      {RIM_CONFIG_SMALL, 2, true},
      {RIM_CONFIG_BLOCK_ROWS, 0, true},
      {RIM_CONFIG_BLOCK_ROWS, 10001, true},
      {RIM_CONFIG_EXTERNAL, 2, true},
      {RIM_CONFIG_REGION_FEATURES, 0, true},
      {RIM_CONFIG_REGION_FEATURES, D + 1, true},
      {RIM_CONFIG_REGION_FEATURES, 1, true},
      {RIM_CONFIG_RING, 7, true},
      {RIM_CONFIG_RING, 15, false},
      {RIM_CONFIG_RING, 4097, true},
      {RIM_CONFIG_RING, 65536u + 64u, true},
      {RIM_CONFIG_BINS, 3, false},
      {RIM_CONFIG_BINS, 33, false},
      {RIM_CONFIG_GRID, 7, false},
      {RIM_CONFIG_GRID, 65, false},
      {RIM_CONFIG_BUDGET, 65, true},
      {RIM_CONFIG_MOVES, 65536u + 20u, true},
  };
  for (size_t i = 0; i < sizeof words / sizeof *words; ++i) {
    for (int external = words[i].of_both ? 0 : 1; external < 2; ++external) {
      recipe r = calibrated[external];
      set_word(&r, words[i].word, words[i].value);
      assert_int_equal(init_status(&r), RIM_E_CONFIG);
    }
  }
  recipe longest = calibrated[true];
  set_word(&longest, RIM_CONFIG_BLOCK_ROWS, 10000);
  assert_int_equal(init_status(&longest), RIM_OK);
}

static void sections_that_do_not_fit_together_are_refused(void **state) {
  (void)state;
  recipe r = calibrated[true];
  r.section[RIM_SECTION_THRESHOLD] = calibrated[false].section[RIM_SECTION_THRESHOLD];
  assert_int_equal(init_status(&r), RIM_E_CONFIG);
  r = calibrated[true]; /* noise alone makes no trained image */
  r.section[RIM_SECTION_NOISE] = calibrated[false].section[RIM_SECTION_NOISE];
  assert_int_equal(init_status(&r), RIM_E_CONFIG);
  r = calibrated[false]; /* an image that predicts must not ask for predictions */
  set_word(&r, RIM_CONFIG_EXTERNAL, 1);
  assert_int_equal(init_status(&r), RIM_E_CONFIG);
  r = calibrated[false];
  put_u32(r.section[RIM_SECTION_NOISE].byte + 4, CHANNELS - 1);
  assert_int_equal(init_status(&r), RIM_E_RANGE);
  r = calibrated[true];
  r.section[RIM_SECTION_REGION].byte[0] = D;
  assert_int_equal(init_status(&r), RIM_E_RANGE);
  r = calibrated[true];
  r.section[RIM_SECTION_REGION].byte[4] = 2; /* feature 2 twice */
  assert_int_equal(init_status(&r), RIM_E_RANGE);
  r = calibrated[true];
  r.section[RIM_SECTION_REGION].byte[2] = O; /* the prediction of an outcome that is not there */
  r.section[RIM_SECTION_REGION].byte[3] = 0;
  assert_int_equal(init_status(&r), RIM_E_RANGE);
  r = calibrated[false];
  r.section[RIM_SECTION_OUTCOMES].byte[0] = D;
  assert_int_equal(init_status(&r), RIM_E_RANGE);
  for (size_t i = 0; i < 4 * D; ++i) { /* no NaN in a range, no infinity, and no range of nothing */
    const uint32_t infinity = i % (2 * D) < D ? 0xff800000u : 0x7f800000u;
    r = calibrated[true];
    put_u32(r.section[RIM_SECTION_FEATURES].byte + 4 * (i % (2 * D)),
            i < 2 * D ? 0x7fc00000u : infinity);
    assert_int_equal(init_status(&r), RIM_E_RANGE);
  }
  r = calibrated[true];
  memcpy(r.section[RIM_SECTION_FEATURES].byte, r.section[RIM_SECTION_FEATURES].byte + 4 * D, 4);
  assert_int_equal(init_status(&r), RIM_E_RANGE);
}

static void every_flipped_bit_is_refused(void **state) {
  (void)state;
  static bench b;
  make_bench(&b, true);
  rim_monitor *m = NULL;
  for (size_t bit = 0; bit < 8 * b.blob.size; ++bit) {
    b.blob.byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
    assert_int_not_equal(rim_monitor_init(&m, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                         RIM_OK);
    b.blob.byte[bit / 8] ^= (uint8_t)(1u << bit % 8);
  }
  for (size_t size = 0; size < b.blob.size; ++size) {
    assert_int_not_equal(rim_monitor_init(&m, b.memory, EXTERNAL_SIZE, b.blob.byte, size), RIM_OK);
  }
  assert_null(m);
}

/* ---- what is found ---- */

typedef struct tally {
  uint32_t raised, updated, cleared;
  rim_alarm first, latest;
} tally;

static tally watch(const bench *b, uint32_t run, uint32_t from, uint32_t to, double shift) {
  tally n;
  memset(&n, 0, sizeof n);
  for (uint32_t t = from; t < to; ++t) {
    const rim_verdict v = step(b, run, t, shift);
    if (v.alarm.state == RIM_ALARM_NONE)
      continue;
    if (v.alarm.state == RIM_ALARM_RAISED && n.raised == 0)
      n.first = v.alarm;
    n.latest = v.alarm;
    n.raised += v.alarm.state == RIM_ALARM_RAISED;
    n.updated += v.alarm.state == RIM_ALARM_UPDATED;
    n.cleared += v.alarm.state == RIM_ALARM_CLEARED;
    assert_true(v.alarm.t_s == v.t_s && v.alarm.since_s <= v.t_s);
    assert_true(v.alarm.p_value >= 0.5 * (1.0 - 1e-12)); /* one maximum: 1/2 at best */
  }
  return n;
}

static void nothing_is_found_where_nothing_is(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    for (uint32_t run = 0; run < NULL_RUNS; ++run) { /* the runs that set the threshold */
      start(&b);
      const tally n = watch(&b, 100 + run, 0, ROWS, 0.0);
      assert_int_equal(n.raised + n.updated + n.cleared, 0);
      assert_int_equal(rim_monitor_get_health(b.monitor).alarms, 0);
    }
  }
}

/* Share of the shifted stretch of a feature that the box of the alarm covers, and what sticks out
 * of it. */
static double cover(const rim_alarm *a, uint16_t feature, double low, double high, double *excess) {
  for (size_t i = 0; i < a->region.dims; ++i) {
    if (a->region.feature[i] != feature)
      continue;
    const double from = rimi_max(low, a->region.lower[i]);
    const double to = rimi_min(high, a->region.upper[i]);
    *excess = (a->region.upper[i] - a->region.lower[i] - (to - from)) / (high - low);
    return (to - from) / (high - low);
  }
  *excess = 1e9;
  return 1.0;
}

static void a_shifted_region_is_found_once(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    for (int sign = -1; sign <= 1; sign += 2) {
      bench b;
      make_bench(&b, external);
      const double shift = sign * (external ? 0.8 : 0.15);
      const double in[D] = {external ? 0.0 : 0.8, 0.0, external ? 175.0 : 0.0};
      const double out[D] = {external ? 0.0 : -0.8, 0.0, external ? 275.0 : 0.0};
      assert_true(rim_monitor_membership(b.monitor, in) == 0.0);
      const tally n = watch(&b, 3, 0, ROWS, shift);
      assert_int_equal(n.raised, 1);
      assert_int_equal(n.cleared, 0);
      assert_int_equal(rim_monitor_get_health(b.monitor).alarms, 1);
      const rim_alarm *a = &n.latest;
      assert_int_equal(a->level, RIM_LEVEL_ERROR);
      assert_int_equal(a->kind, RIM_KIND_SHIFT);
      assert_int_equal(a->detector, RIM_DETECTOR_RIM);
      assert_int_equal(a->channel[0], external ? 1 : 0);
      assert_int_equal(a->model_id, rimi_le_u32(b.blob.byte, 5));
      assert_true(a->ln_anom >= a->threshold);
      assert_true(a->shift[0] * sign > 0.0);
      assert_true(rimi_abs(a->shift[0] - shift) <= 4.0 * a->shift_sd[0]);
      assert_true(a->shift_sd[0] < 0.25 * rimi_abs(shift));
      double excess = 0.0;
      const double covered =
          external ? cover(a, 2, 150.0, 200.0, &excess) : cover(a, 0, 0.4, 1.0, &excess);
      assert_true(covered > 0.8 && excess < 0.4);
      assert_true(a->observations > 20);
      assert_true(rim_monitor_membership(b.monitor, in) > 0.9);
      assert_true(rim_monitor_membership(b.monitor, out) < 0.1);
    }
  }
}

/* The stretch in which make_row shifts an outcome, corrected for. */
static void put_correct_of(bytes *b, bool external, double shift, uint32_t kinds) {
  rim_correct_region region = {.is_box = true, .confidence = 1.0};
  region.region.dims = 1;
  region.region.feature[0] = external ? 2 : 0;
  region.region.lower[0] = external ? 150.0 : 0.4;
  region.region.upper[0] = external ? 200.0 : 1.0;
  const double shifts[O] = {external ? 0.0 : shift, external ? shift : 0.0};
  const rim_correct_model m = {.features = D,
                               .outcomes = O,
                               .regions = 1,
                               .kinds = kinds,
                               .region = &region,
                               .shift = shifts};
  b->size = RIM_CORRECT_BYTES(O, 1);
  assert_int_equal(rimi_correct_pack(&m, b->byte, b->size), RIM_OK);
}

static void put_correct(bytes *b, bool external, double shift) {
  put_correct_of(b, external, shift, 1u << RIM_KIND_SHIFT);
}

/* The fault of the test above, once the image carries its correction; the opposite correction makes
 * it worse, and a vehicle without the fault does not fit the correction. */
static void a_corrected_model_is_silent(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    const double shift = external ? 0.8 : 0.15;
    recipe r = calibrated[external];
    put_correct(&r.section[RIM_SECTION_CORRECT], external, shift);
    build(&b.blob, &r);
    start(&b);
    assert_int_equal(watch(&b, 3, 0, ROWS, shift).raised, 0);
    start(&b);
    const tally other = watch(&b, 3, 0, ROWS, 0.0);
    assert_int_equal(other.raised, 1);
    assert_true(other.latest.shift[0] < 0.0);
    put_correct(&r.section[RIM_SECTION_CORRECT], external, -shift);
    build(&b.blob, &r);
    start(&b);
    const tally twice = watch(&b, 3, 0, ROWS, shift);
    assert_int_equal(twice.raised, 1);
    assert_true(rimi_abs(twice.latest.shift[0] - 2.0 * shift) <= 4.0 * twice.latest.shift_sd[0]);
  }
}

/* A correction of kinds that are none of a mean leaves every mean as it is. */
static void a_correction_of_another_kind_changes_no_mean(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    uint64_t digest[2];
    for (uint32_t i = 0; i < 2; ++i) {
      bench b;
      make_bench(&b, external);
      recipe r = calibrated[external];
      if (i == 1)
        put_correct_of(&r.section[RIM_SECTION_CORRECT], external, 5.0, 1u << RIM_KIND_VARIANCE);
      build(&b.blob, &r);
      start(&b);
      digest[i] = RIM_DIGEST_START;
      for (uint32_t t = 0; t < 200; ++t) {
        const rim_verdict v = step(&b, 3, t, 0.0);
        digest[i] = rim_verdict_digest(digest[i], &v);
      }
    }
    assert_true(digest[0] == digest[1]);
  }
}

/* A section that is damaged, or of another shape, is no image. */
static void a_correction_that_does_not_fit_is_refused(void **state) {
  (void)state;
  bench b;
  make_bench(&b, true);
  recipe r = calibrated[1];
  bytes *section = &r.section[RIM_SECTION_CORRECT];
  put_correct(section, true, 0.8);
  section->byte[section->size - 1] ^= 1;
  build(&b.blob, &r);
  rim_monitor *monitor = NULL;
  assert_int_equal(rim_monitor_init(&monitor, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_CRC);
  const rim_correct_model m = {.features = D + 1, .outcomes = O, .kinds = 1};
  section->size = RIM_CORRECT_BYTES(O, 0);
  assert_int_equal(rimi_correct_pack(&m, section->byte, section->size), RIM_OK);
  build(&b.blob, &r);
  assert_int_equal(rim_monitor_init(&monitor, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_CONFIG);
  assert_null(monitor);
}

static void a_fault_in_scatter_and_a_stuck_reading_are_named(void **state) {
  (void)state;
  for (int stuck = 0; stuck < 2; ++stuck) {
    bench b;
    make_bench(&b, false);
    rim_alarm first = {0};
    uint32_t raised = 0;
    row r;
    rim_verdict v;
    for (uint32_t t = 0; t < ROWS; ++t) {
      make_row(&r, false, 9, t, 0.0);
      /* The second sensor has a third of its noise, or the first one reads 0. */
      if (stuck && t > 400)
        r.context[1] = 0.0;
      if (!stuck && t > 400)
        r.context[2] /= 3.0;
      assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
      if (v.alarm.state != RIM_ALARM_RAISED)
        continue;
      if (raised++ == 0)
        first = v.alarm;
    }
    assert_int_equal(raised, 1);
    assert_int_equal(first.channel[0], stuck ? 0 : 1);
    if (!stuck) {
      assert_int_equal(first.kind, RIM_KIND_VARIANCE);
      assert_true(first.shift[0] > 0.05 && first.shift[0] < 0.5); /* of variances: 1/9 */
    }
    assert_true(first.t_s > 10.0 + 400 * PERIOD_S);
  }
}

static void an_alarm_persists_first_and_is_not_repeated_too_often(void **state) {
  (void)state;
  bench b;
  recipe r = calibrated[true];
  set_word(&r, RIM_CONFIG_CLEAR, 4);
  memset(&b, 0, sizeof b);
  b.external = true;
  build(&b.blob, &r);
  start(&b);
  const rim_threshold *threshold = rimi_monitor_threshold(b.monitor);
  uint32_t above = 0, below = 0, records = 0, cleared = 0;
  double last_s = -1e9;
  bool active = false;
  for (uint32_t t = 0; t < 2 * ROWS; ++t) { /* the other way in the second half: all is undone */
    const rim_verdict v = step(&b, 4, t, t < ROWS / 2 ? 0.8 : -0.8);
    above = v.score >= threshold->alarm_score ? above + 1 : 0;
    below = v.score < threshold->warn_score ? below + 1 : 0;
    if (v.alarm.state == RIM_ALARM_NONE) {
      assert_false(!active && above >= 3);
      assert_false(active && below >= 4);
      assert_int_equal(v.level, active                             ? RIM_LEVEL_ERROR
                                : v.score >= threshold->warn_score ? RIM_LEVEL_WARN
                                                                   : RIM_LEVEL_OK);
      continue;
    }
    assert_int_equal(v.alarm.seq, ++records);
    assert_int_equal(v.alarm.flags & RIM_ALARM_FLAG_LATCHED, 0);
    if (v.alarm.state == RIM_ALARM_RAISED) {
      assert_true(!active && above == 3);
      active = true;
    } else if (v.alarm.state == RIM_ALARM_UPDATED) {
      assert_true(active && v.t_s - last_s >= 10.0);
    } else {
      const double anywhere[D] = {0.0, 0.0, 175.0};
      assert_true(active && below == 4);
      assert_true(rim_monitor_membership(b.monitor, anywhere) == 0.0);
      active = false;
      ++cleared;
    }
    last_s = v.t_s;
  }
  assert_true(cleared == 1 && active); /* and found again, the other way */
}

/* ---- bad input ---- */

static void bad_rows_leave_no_trace(void **state) {
  (void)state;
  const double nan = rimi_from_bits(UINT64_C(0x7ff8000000000000));
  const double infinity = rimi_from_bits(UINT64_C(0x7ff0000000000000));
  for (int external = 0; external < 2; ++external) {
    bench clean, dirty;
    make_bench(&clean, external);
    make_bench(&dirty, external);
    const double shift = external ? 0.8 : 0.15;
    uint32_t not_finite = 0, back = 0;
    for (uint32_t t = 0; t < ROWS; ++t) {
      row r;
      rim_verdict v;
      for (uint32_t kind = 0; kind < 6; ++kind) {
        if ((t * 7 + kind * 3) % 5 != 0 || (kind == 5 && !external))
          continue;
        make_row(&r, external, 5, t, shift);
        r.view.t_s -= 0.1;
        if (kind == 0)
          r.context[1] = nan;
        if (kind == 1)
          r.context[0] = infinity;
        if (kind == 2)
          r.view.t_s = -infinity;
        if (kind == 3)
          r.view.t_s = t == 0 ? nan : r.t_s - PERIOD_S; /* a repetition */
        if (kind == 4)
          r.view.t_s = t == 0 ? nan : r.t_s - 5.0;
        if (kind == 5)
          r.sd[1] = t % 2 ? 0.0 : nan;
        assert_int_equal(rim_monitor_step(dirty.monitor, &r.view, &v), RIM_OK);
        assert_false(v.valid);
        assert_int_equal(v.alarm.state, RIM_ALARM_NONE);
        if ((kind == 3 || kind == 4) && t > 0)
          ++back;
        else
          ++not_finite;
      }
      const rim_verdict a = step(&clean, 5, t, shift), d = step(&dirty, 5, t, shift);
      assert_true(a.valid && d.valid);
      assert_true(rim_verdict_digest(0, &a) == rim_verdict_digest(0, &d));
    }
    const rim_monitor_health h = rim_monitor_get_health(dirty.monitor);
    assert_int_equal(h.rows.not_finite, not_finite);
    assert_int_equal(h.rows.time_back, back);
    assert_int_equal(h.rows.rows, ROWS + back + not_finite);
    assert_int_equal(h.rows.rows_used, ROWS);
    assert_int_equal(h.alarms, 1);
    assert_true(not_finite > 100 && back > 100);
  }
}

static void a_gap_begins_the_block_anew(void **state) {
  (void)state;
  bench b;
  make_bench(&b, false);
  for (uint32_t t = 0; t < 3 * BLOCK + 2; ++t)
    (void)step(&b, 6, t, 0.0);
  rim_verdict v = {0};
  for (uint32_t t = 100; t < 100 + BLOCK; ++t) {
    v = step(&b, 6, t, 0.0);
    /* The run's first block is for its first readings; not two rows of before and two of after. */
    assert_int_equal(v.blocks, t == 99 + BLOCK ? 3 : 2);
  }
  assert_int_equal(rim_monitor_get_health(b.monitor).rows.gaps, 1);
}

static void silence_is_stale_not_healthy(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    uint32_t t = 0;
    for (uint32_t silence = 1; silence < 4; ++silence) {
      for (uint32_t i = 0; i < 20; ++i, ++t)
        assert_int_not_equal(step(&b, 7, t, 0.0).level, RIM_LEVEL_STALE);
      for (uint32_t i = 1; i < 40; ++i, ++t) {
        row r;
        rim_verdict v;
        make_row(&r, external, 7, t, 0.0);
        r.context[0] = rimi_from_bits(UINT64_C(0x7ff8000000000000));
        assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
        assert_false(v.valid);
        assert_int_equal(v.level == RIM_LEVEL_STALE, PERIOD_S * i > 2.0);
      }
      assert_int_equal(rim_monitor_get_health(b.monitor).stale, silence);
      assert_true(rim_monitor_get_health(b.monitor).last_valid_s == 10.0 + PERIOD_S * (t - 40));
    }
  }
}

/* ---- the same again ---- */

static void reset_is_a_fresh_start(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench fresh, used;
    make_bench(&fresh, external);
    make_bench(&used, external);
    (void)run_digest(&used, 1, 100, 777, 1.0);
    rim_monitor_reset(used.monitor);
    for (uint32_t t = 0; t < ROWS; ++t) { /* time begins anew too */
      const rim_verdict a = step(&fresh, 2, t, 0.8), d = step(&used, 2, t, 0.8);
      assert_true(rim_verdict_digest(0, &a) == rim_verdict_digest(0, &d));
    }
  }
}

static void a_copy_goes_on_bit_for_bit(void **state) {
  (void)state;
  for (int external = 0; external < 2; ++external) {
    bench whole, first, second;
    make_bench(&whole, external);
    make_bench(&first, external);
    memset(&second, 0, sizeof second);
    second.external = external;
    const double shift = external ? 0.8 : 0.15;
    (void)run_digest(&whole, 3, 0, 501, shift); /* in the middle of a block */
    (void)run_digest(&first, 3, 0, 501, shift);
    const size_t size = size_of(external);
    memcpy(second.memory, first.memory, size);
    second.blob = first.blob;
    memset(&first, 0xee, sizeof first); /* nothing of the original may be needed */
    rim_monitor *m = NULL;
    assert_int_equal(
        rim_monitor_attach(&m, second.memory, size - 1, second.blob.byte, second.blob.size),
        RIM_E_SIZE);
    assert_int_equal(rim_monitor_attach(&second.monitor, second.memory, size, second.blob.byte,
                                        second.blob.size),
                     RIM_OK);
    assert_true(run_digest(&whole, 3, 501, ROWS, shift) ==
                run_digest(&second, 3, 501, ROWS, shift));
    const double in[D] = {0.8, 0.0, 175.0};
    assert_true(rim_monitor_membership(whole.monitor, in) ==
                rim_monitor_membership(second.monitor, in));
    assert_int_equal(rim_monitor_get_health(second.monitor).rows.rows, ROWS);
  }
}

static void attach_refuses_what_is_not_its_own(void **state) {
  (void)state;
  bench b, other;
  make_bench(&b, true);
  rim_monitor *m = NULL;
  memset(&other, 0, sizeof other);
  assert_int_equal(rim_monitor_attach(&m, other.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_DATA);
  recipe r = calibrated[true];
  set_word(&r, RIM_CONFIG_SEED, 6); /* same sizes, another content */
  build(&other.blob, &r);
  assert_int_equal(
      rim_monitor_attach(&m, b.memory, EXTERNAL_SIZE, other.blob.byte, other.blob.size),
      RIM_E_DATA);
  r = calibrated[true];
  r.section[RIM_SECTION_NAMES].byte[0] = 'z'; /* only the model id tells */
  build(&other.blob, &r);
  memcpy(other.memory, b.memory, sizeof other.memory);
  assert_int_equal(
      rim_monitor_attach(&m, b.memory, EXTERNAL_SIZE, other.blob.byte, other.blob.size),
      RIM_E_DATA);
  assert_memory_equal(b.memory, other.memory, sizeof other.memory); /* still the first image's */
  assert_int_equal(rim_monitor_attach(&m, b.memory + 4, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_ALIGN);
  assert_int_equal(rim_monitor_attach(NULL, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_ARGUMENT);
  for (uint32_t word = 0; word < 3;
       ++word) { /* magic, version of the library, size of its header */
    uint32_t *field = (uint32_t *)(void *)(b.memory + 4u * (size_t)word);
    *field ^= 0x10u;
    assert_int_equal(rim_monitor_attach(&m, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                     RIM_E_DATA);
    *field ^= 0x10u;
  }
  b.blob.byte[100] ^= 1;
  assert_int_equal(rim_monitor_attach(&m, b.memory, EXTERNAL_SIZE, b.blob.byte, b.blob.size),
                   RIM_E_CRC);
  assert_null(m);
}

/* The onset of what is found after a pause lies after the pause. */
static void a_pause_does_not_move_the_onset(void **state) {
  (void)state;
  enum { BEFORE = 150, AFTER = 400 };
  const double pause_s = 3000.0;
  bench b;
  make_bench(&b, true);
  double begin_s = 0.0, since_s = 0.0;
  for (uint32_t t = 0; t < BEFORE + AFTER && since_s <= 0.0; ++t) {
    row r;
    make_row(&r, true, 5, t, 0.0);
    if (t >= BEFORE) {
      r.t_s += pause_s;
      r.outcome[1] += 1.5;
    }
    r.context[2] = t < BEFORE ? 250.0 : 160.0 + 0.1 * (double)(t % 300u);
    r.view.t_s = r.t_s;
    begin_s = t == BEFORE ? r.t_s : begin_s;
    rim_verdict v;
    assert_int_equal(rim_monitor_step(b.monitor, &r.view, &v), RIM_OK);
    if (v.alarm.state == RIM_ALARM_RAISED) {
      assert_int_equal(v.alarm.region.dims, 1);
      since_s = v.alarm.since_s;
    }
  }
  assert_true(since_s > 0.0);
  assert_true(fabs(since_s - begin_s) < 20.0 * PERIOD_S);
}

static void instances_do_not_interfere(void **state) {
  (void)state;
  bench a, b, alone;
  make_bench(&a, true);
  make_bench(&b, false);
  make_bench(&alone, true);
  uint64_t digest = RIM_DIGEST_START, digest_b = RIM_DIGEST_START;
  for (uint32_t t = 0; t < 600; ++t) {
    rim_verdict v = step(&a, 3, t, 0.8);
    digest = rim_verdict_digest(digest, &v);
    v = step(&b, 4, t, 0.15);
    digest_b = rim_verdict_digest(digest_b, &v);
  }
  assert_true(digest == run_digest(&alone, 3, 0, 600, 0.8));
  make_bench(&alone, false);
  assert_true(digest_b == run_digest(&alone, 4, 0, 600, 0.15));
}

/* Made by this very function: both images, calibrated by the null runs above, over run 42 with a
 * shift from row 300 on. Whoever changes what is decided changes these, and says so; nobody else
 * may. The same on x86-64 with gcc 12 at -O0, -O2, -O3 and clang 14 at -O2. */
static void verdicts_have_not_changed(void **state) {
  (void)state;
  static const uint64_t expected[2] = {UINT64_C(0x7505c57da11dcd19),
                                       UINT64_C(0x39312b76534271e9)}; /* trained, external */
  bool failed = false;
  for (int external = 0; external < 2; ++external) {
    bench b;
    make_bench(&b, external);
    uint64_t digest = RIM_DIGEST_START;
    uint32_t raised = 0;
    for (uint32_t t = 0; t < ROWS; ++t) {
      const rim_verdict v = step(&b, 42, t, t < 300 ? 0.0 : external ? 0.8 : 0.15);
      digest = rim_verdict_digest(digest, &v);
      raised += v.alarm.state == RIM_ALARM_RAISED;
    }
    assert_int_equal(raised, 1);
    print_message("digest %016llx\n", (unsigned long long)digest);
    if (digest != expected[external])
      failed = true;
  }
  assert_false(failed);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(memory_is_checked_and_not_left),
      cmocka_unit_test(sections_missing_or_of_another_size_are_refused),
      cmocka_unit_test(words_out_of_range_are_refused),
      cmocka_unit_test(sections_that_do_not_fit_together_are_refused),
      cmocka_unit_test(every_flipped_bit_is_refused),
      cmocka_unit_test(nothing_is_found_where_nothing_is),
      cmocka_unit_test(a_shifted_region_is_found_once),
      cmocka_unit_test(a_corrected_model_is_silent),
      cmocka_unit_test(a_correction_of_another_kind_changes_no_mean),
      cmocka_unit_test(a_correction_that_does_not_fit_is_refused),
      cmocka_unit_test(a_fault_in_scatter_and_a_stuck_reading_are_named),
      cmocka_unit_test(an_alarm_persists_first_and_is_not_repeated_too_often),
      cmocka_unit_test(bad_rows_leave_no_trace),
      cmocka_unit_test(a_gap_begins_the_block_anew),
      cmocka_unit_test(silence_is_stale_not_healthy),
      cmocka_unit_test(reset_is_a_fresh_start),
      cmocka_unit_test(a_copy_goes_on_bit_for_bit),
      cmocka_unit_test(attach_refuses_what_is_not_its_own),
      cmocka_unit_test(a_pause_does_not_move_the_onset),
      cmocka_unit_test(instances_do_not_interfere),
      cmocka_unit_test(verdicts_have_not_changed),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
