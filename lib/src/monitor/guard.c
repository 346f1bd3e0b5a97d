/* SPDX-License-Identifier: MIT */
#include "monitor/guard.h"

#include "base/crc.h"
#include "monitor/monitor_private.h"

#define HEADER_START UINT32_C(0x52494d31) /* so that memory that is all zero does not hold */
#define AT(field) offsetof(struct rim_monitor, field)

_Static_assert(AT(guard) % 4u == 0 && AT(life) % 4u == 0 && AT(life.slot) % 4u == 0 &&
                   sizeof(rim_alarm) % 4u == 0 && sizeof(rim_alarm_slot) % 4u == 0 &&
                   AT(last.interference) % 4u == 0,
               "summed by words");

static uint32_t sum_between(uint32_t sum, const rim_monitor *m, size_t begin, size_t end) {
  return rimi_word_sum(sum, (const unsigned char *)m + begin, (end - begin) / 4u);
}

/* A record that somebody reads: of an alarm that stands or waits; and the one sent last, also while
 * it is none yet, which rim_monitor_alarms() gives to whoever repeats it. */
static bool is_read(const rim_alarm_life *life, size_t detector) {
  const rim_alarm_slot *slot = &life->slot[detector];
  return slot->stands || slot->due || life->told == detector;
}

/* Leaves out what nobody reads, which is much of the header: other records, the verdict's record,
 * which each row overwrites, and gaps where there were none. */
static uint32_t sum_header(const rim_monitor *m) {
  uint32_t sum = sum_between(HEADER_START, m, AT(life), AT(life.slot));
  for (size_t i = 0; i < RIM_DETECTORS; ++i) {
    const size_t begin = AT(life.slot) + i * sizeof(rim_alarm_slot);
    sum = sum_between(sum, m, begin + (is_read(&m->life, i) ? 0u : sizeof(rim_alarm)),
                      begin + sizeof(rim_alarm_slot));
  }
  const size_t end = m->gaps > 0 ? AT(last.alarm) : AT(gap);
  sum = sum_between(sum, m, AT(life.slot) + RIM_DETECTORS * sizeof m->life.slot[0], end);
  if (m->gaps == 0)
    sum = sum_between(sum, m, AT(gaps), AT(last.alarm));
  return sum_between(sum, m, AT(last.interference), AT(guard));
}

static uint32_t sum_fixed(const rim_monitor *m) {
  return sum_between(HEADER_START, m, 0, AT(life));
}
void rimi_guard_fix(rim_monitor *m) { m->guard.fixed = sum_fixed(m); }

static bool header_is_right(const rim_monitor *m) {
  return sum_fixed(m) == m->guard.fixed && sum_header(m) == m->guard.header;
}

/* The header holds: its pointers can be followed. */
static uint32_t sum_parts(const rim_monitor *m) {
  size_t bytes;
  const void *control = rimi_blocks_control(m->rows, &bytes);
  uint32_t sum = rimi_word_sum(0, control, bytes / 4u);
  control = m->is_trained ? rimi_search_control(m->search, &bytes)
                          : rimi_select_control(m->select, &bytes);
  sum = rimi_word_sum(sum, control, bytes / 4u);
  return m->watch != NULL ? rimi_word_sum(sum, m->watch, sizeof *m->watch / 4u) : sum;
}

/* The parts hold, which say how long it is. */
static uint32_t sum_history(const rim_monitor *m) {
  return m->is_trained ? rimi_blocks_history_sum(m->rows, 0) : 0u;
}

bool rimi_guard_header_holds(const rim_monitor *m) {
  return m->guard.damaged == 0 && (m->guard.busy || header_is_right(m));
}

bool rimi_guard_copy_holds(const rim_monitor *m) {
  return m->guard.damaged == 0 && !m->guard.busy && header_is_right(m);
}

uint8_t rimi_guard_damage(const rim_monitor *m) {
  if (m->guard.damaged != 0)
    return m->guard.damaged;
  return header_is_right(m) ? 0 : (uint8_t)RIM_DAMAGE_CONTROL;
}

bool rimi_guard_enter(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  if (g->damaged != 0)
    return false;
  if (!header_is_right(m) || sum_parts(m) != g->parts)
    g->damaged = RIM_DAMAGE_CONTROL;
  else if (sum_history(m) != g->history)
    g->damaged = RIM_DAMAGE_RUN;
  g->busy = g->damaged == 0;
  return g->damaged == 0;
}

bool rimi_guard_enter_header(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  if (g->damaged == 0 && !header_is_right(m))
    g->damaged = RIM_DAMAGE_CONTROL;
  return g->damaged == 0;
}

bool rimi_guard_parts_hold(const rim_monitor *m) { return sum_parts(m) == m->guard.parts; }
bool rimi_guard_history_holds(const rim_monitor *m) { return sum_history(m) == m->guard.history; }

/* ---- what outlives a repair ---- */

static uint32_t sum_kept(const monitor_kept *k) {
  uint64_t bits = rimi_bits(k->policy.stale_s);
  const uint32_t words[5] = {(uint32_t)bits, (uint32_t)(bits >> 32),
                             (uint32_t)k->policy.latch | (uint32_t)k->policy.replay << 8 |
                                 (uint32_t)k->policy.command_any << 16,
                             k->seq, k->raised};
  return rimi_word_sum(HEADER_START, words, 5);
}

static void keep(rim_monitor *m) {
  const rim_alarm_life *life = &m->life;
  const rim_alarm_policy *p = &life->config.policy;
  monitor_kept *k = &m->guard.kept;
  if (k->seq == life->seq && k->raised == life->raised && k->sum != 0 &&
      rimi_bits(k->policy.stale_s) == rimi_bits(p->stale_s) && k->policy.latch == p->latch &&
      k->policy.replay == p->replay && k->policy.command_any == p->command_any)
    return;
  *k = (monitor_kept){.policy = *p, .seq = life->seq, .raised = life->raised};
  k->sum = sum_kept(k);
}

/* Only one of the two can have been hit. */
monitor_kept rimi_guard_kept(const rim_monitor *m) {
  if (sum_kept(&m->guard.kept) == m->guard.kept.sum)
    return m->guard.kept;
  return (monitor_kept){
      .policy = m->life.config.policy, .seq = m->life.seq, .raised = m->life.raised};
}

void rimi_guard_leave_header(rim_monitor *m) {
  m->guard.busy = false;
  if (m->guard.damaged != 0)
    return;
  keep(m);
  m->guard.header = sum_header(m);
}

void rimi_guard_leave(rim_monitor *m) {
  rimi_guard_leave_header(m);
  if (m->guard.damaged != 0)
    return;
  m->guard.parts = sum_parts(m);
  m->guard.history = sum_history(m);
}

/* ---- the image ---- */

/* Words; slices are of one size, and a part is of whole slices. */
typedef struct image_cuts {
  uint32_t words, slice, part;
} image_cuts;

static image_cuts cut_image(const rim_monitor *m) {
  image_cuts c = {.words = (uint32_t)(m->image.bytes / 4u), .slice = GUARD_NO_RATE};
  const double period_s = 1e-6 * (double)m->words[RIM_CONFIG_PERIOD_US];
  if (period_s > 0.0)
    c.slice = (uint32_t)rimi_clamp((double)c.words * period_s / GUARD_IMAGE_S + 1.0,
                                   (double)GUARD_LEAST, (double)GUARD_MOST);
  c.slice = (c.slice + 7u) & ~UINT32_C(7); /* rimi_word_sum takes eight at once */
  const uint32_t slices = (c.words + c.slice - 1u) / c.slice;
  c.part = (slices + GUARD_PARTS - 1u) / GUARD_PARTS * c.slice;
  return c;
}

/* The part's sum continued by the slice that begins at word `at`, and where that ends. The bytes
 * after the last whole word go in with the last slice. */
static uint32_t sum_slice(const rim_monitor *m, const image_cuts *c, uint32_t *at, uint32_t sum) {
  const uint32_t begin = *at, end = c->words - begin > c->slice ? begin + c->slice : c->words;
  *at = end;
  sum = rimi_word_sum(sum, m->image.data + 4u * (size_t)begin, end - begin);
  return end < c->words ? sum
                        : rimi_byte_sum(sum, m->image.data + 4u * (size_t)end,
                                        m->image.bytes - 4u * (size_t)end);
}

/* The part that begins at word *at, which moves on to its end. */
static uint32_t sum_image_part(const rim_monitor *m, const image_cuts *c, uint32_t *at) {
  const uint32_t end = c->words - *at > c->part ? *at + c->part : c->words;
  uint32_t sum = 0;
  while (*at < end)
    sum = sum_slice(m, c, at, sum);
  return sum;
}

void rimi_guard_accept_image(rim_monitor *m) {
  const image_cuts c = cut_image(m);
  uint32_t at = 0;
  for (uint32_t i = 0; i < GUARD_PARTS; ++i)
    m->guard.image[i] = at < c.words ? sum_image_part(m, &c, &at) : 0u;
  m->guard.image_now = m->guard.image_at = 0;
}

static bool image_holds(const rim_monitor *m) {
  const image_cuts c = cut_image(m);
  uint32_t at = 0;
  bool holds = true;
  for (uint32_t i = 0; i < GUARD_PARTS && at < c.words; ++i)
    holds = sum_image_part(m, &c, &at) == m->guard.image[i] && holds;
  return holds;
}

static void scrub_image(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  const image_cuts c = cut_image(m);
  uint32_t at = g->image_at;
  if (at >= c.words || at % c.slice != 0) { /* what this function leaves is neither */
    g->damaged |= RIM_DAMAGE_IMAGE;
    return;
  }
  const uint32_t part = at / c.part;
  const uint32_t sum = sum_slice(m, &c, &at, at % c.part == 0 ? 0u : g->image_now);
  const bool ends = at >= c.words || at % c.part == 0;
  if (ends && sum != g->image[part])
    g->damaged |= RIM_DAMAGE_IMAGE;
  g->image_now = sum;
  g->image_at = at < c.words ? at : 0u;
}

/* ---- what was observed ---- */

static uint32_t held(const rim_monitor *m) {
  return m->is_trained ? rimi_search_held(m->search) : rimi_select_held(m->select);
}

/* Of what a slot of the ring holds; 0 where it holds nothing yet. */
static uint32_t sum_slot(const rim_monitor *m, uint32_t slot) {
  if (slot >= held(m))
    return 0;
  return m->is_trained ? rimi_search_slot_sum(m->search, slot)
                       : rimi_select_slot_sum(m->select, slot);
}

static uint32_t sum_effects(const rim_monitor *m) {
  if (!m->is_trained)
    return rimi_select_tables_sum(m->select);
  return rimi_upper_sum(rimi_search_effects_sum(m->search), m->agreement_state,
                        AGREEMENT_STATE * (size_t)m->words[RIM_CONFIG_OUTCOMES] +
                            2u * (size_t)m->models.quadratic.inputs);
}

static uint32_t sum_ring(const rim_monitor *m) {
  uint32_t sum = 0;
  for (uint32_t slot = 0; slot < held(m); ++slot)
    sum += sum_slot(m, slot);
  return sum;
}

static void scrub_ring(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  const uint32_t count = held(m);
  const uint32_t slots = m->is_trained ? GUARD_SLOTS : GUARD_FEW_SLOTS;
  for (uint32_t i = 0; i < slots && g->ring_at < count; ++i, ++g->ring_at)
    g->ring_now += sum_slot(m, g->ring_at);
  if (g->ring_at < count)
    return;
  if (g->ring_now != g->ring)
    g->damaged |= RIM_DAMAGE_RUN;
  g->ring_now = g->ring_at = 0;
}

/* Bins of different features hold the same observations. */
static void scrub_bins(rim_monitor *m) {
  const uint32_t features = m->words[RIM_CONFIG_REGION_FEATURES];
  const uint32_t number = features / 16u + 1u;
  if (!rimi_select_indices_hold(m->select))
    m->guard.damaged |= RIM_DAMAGE_RUN;
  for (uint32_t i = 0; i < number; ++i) {
    const uint32_t feature = m->guard.next_bins < features ? m->guard.next_bins : 0u;
    if (!rimi_select_bins_hold(m->select, feature))
      m->guard.damaged |= RIM_DAMAGE_RUN;
    m->guard.next_bins = feature + 1u;
  }
}

bool rimi_guard_scrub(rim_monitor *m) {
  scrub_image(m);
  scrub_ring(m);
  if (!m->is_trained)
    scrub_bins(m);
  else if (!rimi_search_indices_hold(m->search))
    m->guard.damaged |= RIM_DAMAGE_RUN;
  return m->guard.damaged == 0;
}

static uint32_t next_slot(const rim_monitor *m) {
  return m->is_trained ? rimi_search_next_slot(m->search) : rimi_select_next_slot(m->select);
}

bool rimi_guard_before_block(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  if (m->is_trained && sum_effects(m) != g->effects) {
    g->damaged |= RIM_DAMAGE_RUN;
    return false;
  }
  g->slot = next_slot(m);
  const uint32_t sum = sum_slot(m, g->slot);
  g->ring -= sum;
  if (g->slot < g->ring_at)
    g->ring_now -= sum;
  return true;
}

void rimi_guard_after_block(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  const uint32_t sum = sum_slot(m, g->slot);
  g->ring += sum;
  if (g->slot < g->ring_at)
    g->ring_now += sum;
  if (m->is_trained)
    g->effects = sum_effects(m);
}

bool rimi_guard_all(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  if (!image_holds(m))
    g->damaged |= RIM_DAMAGE_IMAGE;
  if (sum_ring(m) != g->ring || sum_effects(m) != g->effects)
    g->damaged |= RIM_DAMAGE_RUN;
  for (uint32_t f = 0; !m->is_trained && f < m->words[RIM_CONFIG_REGION_FEATURES]; ++f)
    if (!rimi_select_bins_hold(m->select, f))
      g->damaged |= RIM_DAMAGE_RUN;
  return g->damaged == 0;
}

void rimi_guard_renew(rim_monitor *m) {
  monitor_guard *g = &m->guard;
  g->ring = sum_ring(m);
  g->ring_now = g->ring_at = 0;
  g->effects = sum_effects(m);
}
