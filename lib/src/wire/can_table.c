/* SPDX-License-Identifier: MIT */
#include "rim/can_table.h"

#include "base/bytes.h"
#include "base/real.h"
#include "rim/image.h"

/* A signal as the table has it. */
typedef struct signal {
  uint16_t value, start, selector_start;
  uint8_t number, motorola, bits, selector_bits, selector_motorola;
  uint32_t selector;
  double scale, offset, low, high;
} signal;

static const uint8_t *frame_at(const rim_can_table *table, size_t index) {
  return table->frame + RIM_CAN_TABLE_FRAME_BYTES * index;
}

static signal signal_at(const rim_can_table *table, size_t index) {
  const uint8_t *at = table->signal + RIM_CAN_TABLE_SIGNAL_BYTES * index;
  const signal s = {.value = rimi_le_u16(at, 0),
                    .number = at[2],
                    .motorola = at[3],
                    .start = rimi_le_u16(at, 2),
                    .bits = at[6],
                    .selector_bits = at[7],
                    .selector_start = rimi_le_u16(at, 4),
                    .selector_motorola = at[10],
                    .selector = rimi_le_u32(at, 3),
                    .scale = rimi_le_f64(at, 2),
                    .offset = rimi_le_f64(at, 3),
                    .low = rimi_le_f64(at, 4),
                    .high = rimi_le_f64(at, 5)};
  return s;
}

/* Whether `bits` bits from `start` lie within `bytes` bytes. Motorola: start is the most
 * significant bit, counted as everywhere 8 * byte + bit; the next one is below it, below bit 0
 * comes bit 7 of the next byte. */
static bool bits_fit(uint32_t start, uint32_t bits, bool motorola, uint32_t bytes) {
  if (bits == 0 || bits > 64 || start >= 8 * bytes)
    return false;
  const uint32_t first = motorola ? start / 8 * 8 + (7 - start % 8) : start;
  return first + bits <= 8 * bytes;
}

/* O(bits), at most 64. */
static uint64_t take_bits(const uint8_t *data, uint32_t start, uint32_t bits, bool motorola) {
  uint64_t raw = 0;
  if (motorola) {
    uint32_t at =
        start / 8 * 8 + (7 - start % 8); /* counted from the most significant bit of all */
    for (uint32_t i = 0; i < bits; i++, at++)
      raw = raw << 1 | ((uint32_t)data[at / 8] >> (7 - at % 8) & 1u);
    return raw;
  }
  for (uint32_t i = bits; i-- > 0;)
    raw = raw << 1 | ((uint32_t)data[(start + i) / 8] >> ((start + i) % 8) & 1u);
  return raw;
}

static double physical(const signal *s, const uint8_t *data) {
  const uint64_t raw = take_bits(data, s->start, s->bits, s->motorola != 0);
  double x = 0.0;
  if (s->number == RIM_CAN_F32) {
    const uint32_t small = (uint32_t)raw;
    float f;
    memcpy(&f, &small, sizeof f);
    x = (double)f;
  } else if (s->number == RIM_CAN_F64) {
    x = rimi_from_bits(raw);
  } else if (s->number == RIM_CAN_SIGNED && (raw >> (s->bits - 1u) & 1u) != 0) {
    /* -(2^bits - raw), without leaving 64 bits. */
    const uint64_t mask = s->bits == 64 ? UINT64_MAX : ((uint64_t)1 << s->bits) - 1u;
    x = -(double)((~raw & mask) + 1u);
  } else {
    x = (double)raw;
  }
  return x * s->scale + s->offset;
}

static rim_status check_signal(const rim_can_table *table, const signal *s, uint32_t bytes) {
  if (s->value != RIM_CAN_TABLE_NONE && s->value >= table->values)
    return RIM_E_RANGE;
  if (s->number > RIM_CAN_F64 || s->motorola > 1 || s->selector_motorola > 1 ||
      !bits_fit(s->start, s->bits, s->motorola != 0, bytes))
    return RIM_E_RANGE;
  if ((s->number == RIM_CAN_F32 && s->bits != 32) || (s->number == RIM_CAN_F64 && s->bits != 64))
    return RIM_E_RANGE;
  if (s->selector_bits != 0 &&
      (s->selector_bits > 32 ||
       !bits_fit(s->selector_start, s->selector_bits, s->selector_motorola != 0, bytes)))
    return RIM_E_RANGE;
  if (!rimi_is_finite(s->scale) || !rimi_is_finite(s->offset) || !rimi_is_finite(s->low) ||
      !rimi_is_finite(s->high) || !(rimi_abs(s->scale) > 0.0) || s->low > s->high)
    return RIM_E_DATA;
  return RIM_OK;
}

/* Every value has one signal, or several that a selector tells apart; the time has one. */
static rim_status check_values(const rim_can_table *table) {
  uint32_t times = 0;
  for (size_t i = 0; i < table->signals; ++i) {
    const signal a = signal_at(table, i);
    times += a.value == RIM_CAN_TABLE_NONE ? 1u : 0u;
    if (a.value == RIM_CAN_TABLE_NONE && i != table->time)
      return RIM_E_RANGE;
    for (size_t j = 0; j < i; ++j) {
      const signal b = signal_at(table, j);
      if (a.value == b.value &&
          (a.selector_bits == 0 || b.selector_bits == 0 || a.selector == b.selector))
        return RIM_E_RANGE;
    }
  }
  if (times != (table->time == RIM_CAN_TABLE_NONE ? 0u : 1u))
    return RIM_E_RANGE;
  for (uint16_t v = 0; v < table->values; ++v) {
    bool found = false;
    for (size_t i = 0; i < table->signals && !found; ++i)
      found = signal_at(table, i).value == v;
    if (!found)
      return RIM_E_RANGE;
  }
  return RIM_OK;
}

static rim_status check_frames(const rim_can_table *table) {
  uint32_t next = 0;
  for (size_t i = 0; i < table->frames; ++i) {
    const uint8_t *at = frame_at(table, i);
    const uint32_t id = rimi_le_u32(at, 0), bytes = at[4];
    const uint32_t first = rimi_le_u16(at, 3), count = rimi_le_u16(at, 4);
    const uint32_t largest = (id & RIM_CAN_EXTENDED) != 0 ? 0x1fffffffu : 0x7ffu;
    if ((id & ~RIM_CAN_EXTENDED) > largest || at[5] > 1 || bytes > (at[5] != 0 ? 64u : 8u) ||
        first != next || count == 0 || count > table->signals - next)
      return RIM_E_RANGE;
    next += count;
    for (size_t j = 0; j < i; ++j)
      if (rimi_le_u32(frame_at(table, j), 0) == id)
        return RIM_E_RANGE;
    for (size_t s = first; s < next; ++s) {
      const signal one = signal_at(table, s);
      const rim_status status = check_signal(table, &one, bytes);
      if (status != RIM_OK)
        return status;
    }
  }
  return next == table->signals ? check_values(table) : RIM_E_RANGE;
}

rim_status rim_can_table_open(rim_can_table *table, const void *data, size_t bytes) {
  if (table == NULL || data == NULL)
    return RIM_E_ARGUMENT;
  memset(table, 0, sizeof *table);
  if (bytes < RIM_CAN_TABLE_HEADER_BYTES)
    return RIM_E_TRUNCATED;
  const uint8_t *head = data;
  if (rimi_le_u32(head, 0) != RIM_CAN_TABLE_LAYOUT)
    return RIM_E_VERSION;
  rim_can_table t = {.values = rimi_le_u16(head, 2),
                     .frames = rimi_le_u16(head, 3),
                     .signals = rimi_le_u16(head, 4),
                     .trigger = rimi_le_u16(head, 5),
                     .time = rimi_le_u16(head, 6)};
  const size_t frames = RIM_CAN_TABLE_FRAME_BYTES * (size_t)t.frames;
  const size_t total =
      RIM_CAN_TABLE_HEADER_BYTES + frames + RIM_CAN_TABLE_SIGNAL_BYTES * (size_t)t.signals;
  if (bytes != total)
    return bytes < total ? RIM_E_TRUNCATED : RIM_E_SIZE;
  if (t.values == 0 || t.values > RIM_CAN_TABLE_MAX_VALUES || t.frames == 0 ||
      t.frames > RIM_CAN_TABLE_MAX_FRAMES || t.signals > RIM_CAN_TABLE_MAX_SIGNALS ||
      (t.trigger != RIM_CAN_TABLE_NONE && t.trigger >= t.frames) ||
      (t.time != RIM_CAN_TABLE_NONE && t.time >= t.signals))
    return RIM_E_RANGE;
  t.frame = head + RIM_CAN_TABLE_HEADER_BYTES;
  t.signal = t.frame + frames;
  const rim_status status = check_frames(&t);
  if (status == RIM_OK)
    *table = t;
  return status;
}

uint32_t rim_can_table_id(const rim_can_table *table, uint16_t index) {
  return table != NULL && index < table->frames ? rimi_le_u32(frame_at(table, index), 0) : 0;
}

static void keep(rim_can_gather *gather, const signal *s, double x, double t_s) {
  if (s->value == RIM_CAN_TABLE_NONE) {
    gather->time_s = x;
    gather->has_time = true;
    return;
  }
  if (!gather->fresh[s->value])
    gather->waiting--;
  gather->value[s->value] = x;
  gather->value_s[s->value] = t_s;
  gather->has[s->value] = gather->fresh[s->value] = true;
}

static rim_status take_signals(rim_can_gather *gather, const rim_can_table *table,
                               const uint8_t *entry, const uint8_t *data, double t_s) {
  const uint32_t first = rimi_le_u16(entry, 3), end = first + rimi_le_u16(entry, 4);
  rim_status status = RIM_OK;
  for (uint32_t i = first; i < end; ++i) {
    const signal s = signal_at(table, i);
    if (s.selector_bits != 0 &&
        take_bits(data, s.selector_start, s.selector_bits, s.selector_motorola != 0) != s.selector)
      continue;
    const double x = physical(&s, data);
    if (!rimi_is_finite(x) || x < s.low || x > s.high)
      status = RIM_E_DATA;
    else
      keep(gather, &s, x, t_s);
  }
  return status;
}

/* Whether every value has come, and not too long ago. */
static bool is_whole(const rim_can_gather *gather, const rim_can_table *table, double t_s,
                     double age_s) {
  for (size_t v = 0; v < table->values; ++v)
    if (!gather->has[v] || t_s - gather->value_s[v] > age_s)
      return false;
  return table->time == RIM_CAN_TABLE_NONE || gather->has_time;
}

static void begin_row(rim_can_gather *gather, const rim_can_table *table) {
  gather->waiting = table->values;
  for (size_t v = 0; v < table->values; ++v)
    gather->fresh[v] = false;
}

rim_status rim_can_gather_frame(rim_can_gather *gather, const rim_can_table *table,
                                const rim_can_frame *frame, double t_s, double age_s,
                                bool *complete, double *row_s) {
  if (gather == NULL || table == NULL || frame == NULL || complete == NULL || row_s == NULL)
    return RIM_E_ARGUMENT;
  *complete = false;
  uint16_t index = 0;
  while (index < table->frames && rim_can_table_id(table, index) != frame->id)
    index++;
  if (index == table->frames)
    return RIM_E_MAGIC;
  const uint8_t *entry = frame_at(table, index);
  if (frame->length != entry[4] || frame->fd != (entry[5] != 0))
    return RIM_E_SIZE;
  if (!gather->started)
    begin_row(gather, table);
  gather->started = true;
  const rim_status status = take_signals(gather, table, entry, frame->data, t_s);
  const bool triggered = table->trigger != RIM_CAN_TABLE_NONE;
  if (triggered ? index != table->trigger : gather->waiting != 0)
    return status;
  begin_row(gather, table);
  if (!is_whole(gather, table, t_s, age_s))
    return status != RIM_OK ? status : RIM_E_TRUNCATED;
  *row_s = table->time == RIM_CAN_TABLE_NONE ? t_s : gather->time_s;
  *complete = true;
  return status;
}
