/* SPDX-License-Identifier: MIT */
/* From a flight image to a monitor in the caller's memory: everything is read and checked first. */
#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "monitor/monitor_private.h"
#include "rim/version.h"

#define MONITOR_MAGIC 0x52494d4eu /* "RIMN": memory that holds a monitor of this layout */

/* RIM_MONITOR_SIZE spells out what the search needs, so that rim/monitor.h does not include it. */
#define SIZE_IS_ENOUGH(d, o, r, ring, bins, grid, pairs)                                           \
  (RIM_MONITOR_SIZE(d, o, r, ring, bins, grid, pairs) >=                                           \
       RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(d, o, 0, 0) + 8u * (o) + 8u * (r) +        \
           RIM_SELECT_SIZE(r, o, ring, bins, grid, pairs) &&                                       \
   RIM_MONITOR_SIZE(d, o, r, ring, bins, grid, pairs) <=                                           \
       RIM_MONITOR_HEADER_BYTES + RIM_MONITOR_ROWS_SIZE(d, o, 0, 0) + 8u * (o) + 8u * (r) + 512u + \
           RIM_SELECT_SIZE(r, o, ring, bins, grid, pairs))
_Static_assert((RIM_MONITOR_KINDS + 1u) * RIM_MONITOR_MAX_OUTCOMES <= SEARCH_MAX_CHANNELS &&
                   RIM_MONITOR_MAX_OUTCOMES <= RIM_SELECT_MAX_CHANNELS,
               "either search has a channel for each kind of each outcome");
_Static_assert(SIZE_IS_ENOUGH(1, 1, 1, 17, 5, 9, 1), "smallest");
_Static_assert(SIZE_IS_ENOUGH(29, 25, 12, 512, 16, 32, 6), "landing");
_Static_assert(SIZE_IS_ENOUGH(128, 128, 127, 4095, 31, 63, 16), "largest");

static bool find(const monitor_plan *p, rim_section id, const uint8_t **data, size_t *bytes) {
  return rim_image_section(&p->image, (uint32_t)id, data, bytes) == RIM_OK;
}

/* A section that must have exactly these bytes; NULL when it is absent or has not. */
static const uint8_t *exact_section(const monitor_plan *p, rim_section id, size_t expected) {
  const uint8_t *data;
  size_t bytes;
  return find(p, id, &data, &bytes) && bytes == expected ? data : NULL;
}

static rim_status read_words(monitor_plan *p) {
  const uint8_t *data = exact_section(p, RIM_SECTION_CONFIG, 4u * RIM_CONFIG_WORDS);
  if (data == NULL)
    return RIM_E_CONFIG;
  for (size_t i = 0; i < RIM_CONFIG_WORDS; ++i)
    p->words[i] = rimi_le_u32(data, i);
  const uint32_t *w = p->words;
  if (w[RIM_CONFIG_FEATURES] == 0 || w[RIM_CONFIG_FEATURES] > RIM_MONITOR_MAX_FEATURES ||
      w[RIM_CONFIG_OUTCOMES] == 0 || w[RIM_CONFIG_OUTCOMES] > RIM_MONITOR_MAX_OUTCOMES ||
      w[RIM_CONFIG_SMALL] > 1 || w[RIM_CONFIG_BLOCK_ROWS] == 0 ||
      w[RIM_CONFIG_BLOCK_ROWS] > 10000 || w[RIM_CONFIG_REGION_FEATURES] == 0 ||
      w[RIM_CONFIG_REGION_FEATURES] > w[RIM_CONFIG_FEATURES] || w[RIM_CONFIG_EXTERNAL] > 1 ||
      w[RIM_CONFIG_BUDGET] > 64)
    return RIM_E_CONFIG;
  for (size_t i = RIM_CONFIG_RING; i <= RIM_CONFIG_MOVES; ++i) {
    const bool is_count = i != RIM_CONFIG_INHIBIT_MS && i != RIM_CONFIG_SEED;
    if (is_count && w[i] > UINT16_MAX)
      return RIM_E_CONFIG;
  }
  return RIM_OK;
}

/* Optional, and only for residuals of the caller's own predictions. */
static rim_status open_scales(monitor_plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (!find(p, RIM_SECTION_SCALES, &data, &bytes))
    return RIM_OK;
  if (p->is_trained || bytes != 4u * (size_t)p->words[RIM_CONFIG_OUTCOMES])
    return RIM_E_CONFIG;
  for (size_t o = 0; o < p->words[RIM_CONFIG_OUTCOMES]; ++o) {
    const double scale = (double)rimi_le_f32(data, o);
    if (!rimi_is_finite(scale) || !(scale > 0.0))
      return RIM_E_RANGE;
  }
  p->scales = data;
  return RIM_OK;
}

static rim_status check_range(const monitor_plan *p) {
  const size_t features = p->words[RIM_CONFIG_FEATURES];
  for (size_t f = 0; f < features; ++f) {
    const double low = (double)rimi_le_f32(p->range, f);
    const double high = (double)rimi_le_f32(p->range, features + f);
    if (!rimi_is_finite(low) || !rimi_is_finite(high) || !(high > low))
      return RIM_E_RANGE;
  }
  return RIM_OK;
}

static rim_status check_region(const monitor_plan *p) {
  const size_t count = p->words[RIM_CONFIG_REGION_FEATURES];
  for (size_t i = 0; i < count; ++i) {
    const uint16_t f = rimi_le_u16(p->region, 2 * i), o = rimi_le_u16(p->region, 2 * i + 1);
    if (f >= p->words[RIM_CONFIG_FEATURES] ||
        (o >= p->words[RIM_CONFIG_OUTCOMES] && o != MONITOR_NO_OUTCOME))
      return RIM_E_RANGE;
    for (size_t j = 0; j < i; ++j) {
      if (rimi_le_u16(p->region, 2 * j) == f)
        return RIM_E_RANGE;
    }
  }
  return RIM_OK;
}

static rim_status open_tables(monitor_plan *p) {
  const size_t features = p->words[RIM_CONFIG_FEATURES];
  const size_t outcomes = p->words[RIM_CONFIG_OUTCOMES];
  p->range = exact_section(p, RIM_SECTION_FEATURES, 8u * features);
  p->region =
      exact_section(p, RIM_SECTION_REGION, 4u * (size_t)p->words[RIM_CONFIG_REGION_FEATURES]);
  p->rows.role = exact_section(p, RIM_SECTION_COMMANDS, features);
  if (p->range == NULL || p->region == NULL || p->rows.role == NULL)
    return RIM_E_CONFIG;
  p->rows.range = p->range;
  if (p->words[RIM_CONFIG_EXTERNAL] == 0) {
    p->rows.outcome_feature = exact_section(p, RIM_SECTION_OUTCOMES, 2u * outcomes);
    if (p->rows.outcome_feature == NULL)
      return RIM_E_CONFIG;
    for (size_t o = 0; o < outcomes; ++o) {
      if (rimi_le_u16(p->rows.outcome_feature, o) >= features)
        return RIM_E_RANGE;
    }
  }
  const rim_status status = check_range(p);
  return status == RIM_OK ? check_region(p) : status;
}

/* Whether a model is of this image's features and outcomes. */
static rim_status fits(const monitor_plan *p, uint32_t features, uint32_t outcomes) {
  return features == p->words[RIM_CONFIG_FEATURES] && outcomes == p->words[RIM_CONFIG_OUTCOMES]
             ? RIM_OK
             : RIM_E_CONFIG;
}

/* Every outcome whose agreement is by section QUADRATIC has its model there. */
static rim_status open_quadratic(monitor_plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (!find(p, RIM_SECTION_QUADRATIC, &data, &bytes))
    return RIM_OK;
  const uint32_t outcomes = p->words[RIM_CONFIG_OUTCOMES];
  const uint32_t inputs =
      rimi_level_inputs(p->rows.role, p->words[RIM_CONFIG_FEATURES], NULL, NULL);
  const rim_status status =
      rimi_quadratic_open(&p->models.quadratic, data, bytes, inputs, outcomes);
  for (uint32_t o = 0; status == RIM_OK && o < outcomes; ++o) {
    if (rimi_agreement_source(&p->models.agreement, o) == AGREEMENT_QUADRATIC &&
        !rimi_quadratic_has(&p->models.quadratic, RIM_QUADRATIC_AGREES, o))
      return RIM_E_CONFIG;
  }
  return status;
}

/* Channels of steps need models of steps. */
static rim_status check_steps(const monitor_plan *p) {
  const bool has_channels = p->channel_count > RIM_MONITOR_KINDS * p->words[RIM_CONFIG_OUTCOMES];
  return has_channels == rimi_quadratic_has_steps(&p->models.quadratic) ? RIM_OK : RIM_E_CONFIG;
}

static rim_status open_level(monitor_plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (!find(p, RIM_SECTION_LEVEL, &data, &bytes))
    return RIM_OK;
  const rim_status status = rimi_nominal_open(&p->models.level, data, bytes);
  if (status != RIM_OK)
    return status;
  const uint32_t inputs =
      rimi_level_inputs(p->rows.role, p->words[RIM_CONFIG_FEATURES], NULL, NULL);
  return p->models.level.inputs == inputs &&
                 p->models.level.outputs == p->words[RIM_CONFIG_OUTCOMES]
             ? RIM_OK
             : RIM_E_CONFIG;
}

/* The models and the noise of a trained image; without NOISE there is none of them. */
static rim_status open_trained(monitor_plan *p) {
  const uint32_t features = p->words[RIM_CONFIG_FEATURES], outcomes = p->words[RIM_CONFIG_OUTCOMES];
  const bool external = p->words[RIM_CONFIG_EXTERNAL] != 0;
  const uint8_t *noise, *basis, *agreement, *behaviour;
  size_t noise_bytes, basis_bytes, agreement_bytes, behaviour_bytes = 0;
  p->is_trained = find(p, RIM_SECTION_NOISE, &noise, &noise_bytes);
  p->channel_count =
      (uint16_t)(p->is_trained ? rimi_noise_kinds(noise, noise_bytes, outcomes) * outcomes
                               : outcomes);
  if (!p->is_trained)
    return external ? RIM_OK : RIM_E_CONFIG;
  if (!find(p, RIM_SECTION_BASIS, &basis, &basis_bytes) ||
      !find(p, RIM_SECTION_AGREEMENT, &agreement, &agreement_bytes) ||
      find(p, RIM_SECTION_BEHAVIOUR, &behaviour, &behaviour_bytes) == external)
    return RIM_E_CONFIG;
  rim_status status = rimi_basis_open(&p->rows.basis, basis, basis_bytes, features, outcomes);
  const uint32_t means = p->rows.basis.means;
  if (status == RIM_OK && !external)
    status = rimi_behaviour_open(&p->models.behaviour, behaviour, behaviour_bytes,
                                 p->rows.basis.terms, outcomes);
  if (status == RIM_OK)
    status = rimi_agreement_open(&p->models.agreement, agreement, agreement_bytes, features,
                                 outcomes, means);
  p->rows.integrands = p->models.agreement.integrands;
  p->rows.integrand = p->models.agreement.integrand;
  if (status == RIM_OK)
    status = rimi_noise_open(&p->models.noise, noise, noise_bytes, p->channel_count, means);
  p->rows.with_gaps = p->models.noise.with_gaps;
  if (status != RIM_OK)
    return status;
  p->search.cuts = exact_section(p, RIM_SECTION_CUTS,
                                 SEARCH_CUTS * (size_t)p->words[RIM_CONFIG_REGION_FEATURES]);
  return p->search.cuts != NULL ? RIM_OK : RIM_E_CONFIG;
}

static rim_status open_threshold(monitor_plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (!find(p, RIM_SECTION_THRESHOLD, &data, &bytes))
    return RIM_E_CONFIG;
  const rim_status status = rimi_threshold_open(&p->models.threshold, data, bytes);
  if (status != RIM_OK)
    return status;
  return p->models.threshold.channels == p->channel_count ? RIM_OK : RIM_E_CONFIG;
}

/* What the ground has found wrong with the models since they were trained. */
static rim_status open_correct(monitor_plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (!find(p, RIM_SECTION_CORRECT, &data, &bytes))
    return RIM_OK;
  const rim_status status = rimi_correct_open(&p->models.correct, data, bytes);
  return status == RIM_OK ? fits(p, p->models.correct.features, p->models.correct.outcomes)
                          : status;
}

static void plan_searches(monitor_plan *p) {
  const uint32_t *w = p->words;
  p->search.features = (uint16_t)w[RIM_CONFIG_REGION_FEATURES];
  p->search.channels = p->channel_count;
  p->search.outcomes = (uint16_t)w[RIM_CONFIG_OUTCOMES];
  p->search.means = (uint16_t)p->rows.basis.means;
  p->search.ring = (uint16_t)w[RIM_CONFIG_RING];
  p->search.cells_per_turn = (uint8_t)(w[RIM_CONFIG_PAIRS] < 64u ? w[RIM_CONFIG_PAIRS] : 64u);
  p->search.noise = &p->models.noise;
  p->search.region = p->region;
  p->search.outcome_feature = p->rows.outcome_feature;
  p->select.features = (uint16_t)w[RIM_CONFIG_REGION_FEATURES];
  p->select.channels = p->channel_count;
  p->select.ring = (uint16_t)w[RIM_CONFIG_RING];
  p->select.bins = (uint16_t)w[RIM_CONFIG_BINS];
  p->select.grid = (uint16_t)w[RIM_CONFIG_GRID];
  p->select.pairs = (uint16_t)w[RIM_CONFIG_PAIRS];
  p->select.scans = (uint16_t)w[RIM_CONFIG_SCANS];
  p->select.edges = (uint16_t)w[RIM_CONFIG_EDGES];
  p->select.moves = (uint16_t)w[RIM_CONFIG_MOVES];
  p->select.small = w[RIM_CONFIG_SMALL] != 0;
  p->select.seed = w[RIM_CONFIG_SEED];
}

static rim_status make_plan(monitor_plan *p, const void *image, size_t image_bytes) {
  memset(p, 0, sizeof *p);
  rim_status status = rim_image_open(&p->image, image, image_bytes);
  if (status == RIM_OK)
    status = read_words(p);
  if (status != RIM_OK)
    return status;
  const uint32_t *w = p->words;
  p->rows.features = (uint16_t)w[RIM_CONFIG_FEATURES];
  p->rows.outcomes = (uint16_t)w[RIM_CONFIG_OUTCOMES];
  p->rows.block_rows = (uint16_t)w[RIM_CONFIG_BLOCK_ROWS];
  p->rows.external = w[RIM_CONFIG_EXTERNAL] != 0;
  p->rows.period_s = 1e-6 * (double)w[RIM_CONFIG_PERIOD_US];
  status = open_trained(p);
  if (status == RIM_OK)
    status = open_tables(p);
  if (status == RIM_OK && p->is_trained)
    status = open_level(p); /* which needs the tables */
  if (status == RIM_OK && p->is_trained)
    status = open_quadratic(p);
  if (status == RIM_OK && p->is_trained)
    status = check_steps(p);
  if (status == RIM_OK)
    status = open_scales(p);
  if (status == RIM_OK)
    status = open_threshold(p);
  if (status == RIM_OK)
    status = open_correct(p);
  if (status == RIM_OK)
    status =
        rimi_interference_watch_check(&p->image, p->rows.features, p->rows.outcomes, &p->has_watch);
  plan_searches(p);
  return status;
}

/* Where the parts lie in the monitor's memory, in bytes from its start. */
typedef struct layout {
  size_t rows, rows_bytes;
  size_t search, search_bytes; /* either search */
  size_t numbers;              /* doubles: see connect() */
  size_t place;
  size_t watch, total;
} layout;

static rim_status make_layout(const monitor_plan *p, layout *l) {
  const size_t outcomes = p->rows.outcomes, features = p->search.features;
  if (p->is_trained) {
    l->search_bytes = rimi_search_size(&p->search);
    if (l->search_bytes == 0)
      return RIM_E_CONFIG;
  } else {
    const rim_status status = rimi_select_size(&p->select, &l->search_bytes);
    if (status != RIM_OK)
      return status;
  }
  l->rows = RIM_MONITOR_HEADER_BYTES;
  l->rows_bytes = rimi_blocks_size(&p->rows);
  l->numbers = l->rows + l->rows_bytes;
  l->place =
      l->numbers + 8u * (p->is_trained ? (4u + AGREEMENT_STATE) * outcomes + p->channel_count +
                                             2u * p->models.quadratic.inputs
                                       : features + outcomes);
  l->search = RIM_MONITOR_ROUND8(l->place + (p->is_trained ? features + p->channel_count : 0u));
  l->watch = RIM_MONITOR_ROUND8(l->search + l->search_bytes);
  l->total = p->has_watch ? l->watch + RIM_MONITOR_INTERFERENCE_BYTES : l->search + l->search_bytes;
  return RIM_OK;
}

rim_status rim_monitor_size(const void *image, size_t image_bytes, size_t *bytes) {
  if (image == NULL || bytes == NULL)
    return RIM_E_ARGUMENT;
  monitor_plan p;
  layout l;
  rim_status status = make_plan(&p, image, image_bytes);
  if (status == RIM_OK)
    status = make_layout(&p, &l);
  if (status == RIM_OK)
    *bytes = l.total;
  return status;
}

/* What the image asks for, and where it goes in the caller's memory. */
static rim_status examine(monitor_plan *p, layout *l, const void *memory, size_t bytes,
                          const void *image, size_t image_bytes) {
  rim_status status = make_plan(p, image, image_bytes);
  if (status != RIM_OK)
    return status;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  status = make_layout(p, l);
  if (status != RIM_OK)
    return status;
  return bytes < l->total ? RIM_E_SIZE : RIM_OK;
}

/* Sets the pointers into the monitor's memory and into the image to where both are now. */
static void connect(rim_monitor *m, monitor_plan *p, const layout *l) {
  unsigned char *base = (unsigned char *)m;
  const size_t outcomes = p->rows.outcomes;
  m->image = p->image;
  m->models = p->models;
  m->is_trained = p->is_trained;
  m->range = p->range;
  m->region = p->region;
  m->scales = p->scales;
  p->search.noise = &m->models.noise; /* the plan's own is on the stack */
  double *numbers = (double *)(void *)(base + l->numbers);
  m->unit = numbers;
  m->predicted = numbers;
  m->level = numbers + 2u * outcomes;
  m->agreement_state = numbers + 4u * outcomes;
  m->residual = m->agreement_state + AGREEMENT_STATE * outcomes + 2u * p->models.quadratic.inputs;
  m->place = base + l->place;
  m->unknown = (bool *)(base + l->place + p->search.features);
  m->rows = (blocks *)(void *)(base + l->rows);
  m->search = p->is_trained ? (rim_search *)(void *)(base + l->search) : NULL;
  m->select = p->is_trained ? NULL : (rim_select *)(void *)(base + l->search);
  m->watch = p->has_watch ? (interference_watch *)(void *)(base + l->watch) : NULL;
}

/* Scales by which channels compare, for the search over independent rows. */
static rim_status init_select(rim_monitor *m, const monitor_plan *p, const layout *l) {
  float scale[RIM_SELECT_MAX_CHANNELS], offset[RIM_SELECT_MAX_CHANNELS];
  for (size_t c = 0; c < p->channel_count; ++c) {
    scale[c] = 1.0f / rimi_le_f32(p->models.threshold.scale, c);
    offset[c] = rimi_le_f32(p->models.threshold.offset, c) * scale[c];
  }
  rim_status status =
      rimi_select_init(&m->select, (unsigned char *)m + l->search, l->search_bytes, &p->select);
  if (status == RIM_OK)
    status = rimi_select_set_channel_scale(m->select, scale, offset);
  return status;
}

static void init_life(rim_monitor *m) {
  rim_alarm_life_config config = {
      .policy = {.stale_s = 1e-3 * (double)m->words[RIM_CONFIG_STALE_MS]},
      .model_id = m->image.model_id,
  };
  rim_alarm_slot_config *regions = &config.slot[RIM_DETECTOR_RIM];
  regions->raise_steps = m->words[RIM_CONFIG_PERSISTENCE];
  regions->clear_steps = m->words[RIM_CONFIG_CLEAR];
  regions->inhibit_s = 1e-3 * (double)m->words[RIM_CONFIG_INHIBIT_MS];
  regions->update_ratio = MONITOR_UPDATE_RATIO;
  config.slot[RIM_DETECTOR_INTERFERENCE] = rimi_interference_watch_life(regions);
  (void)rimi_alarm_life_init(&m->life, &config);
}

rim_status rim_monitor_init(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                            size_t image_bytes) {
  if (monitor == NULL || memory == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  monitor_plan p;
  layout l;
  rim_status status = examine(&p, &l, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  memset(memory, 0, l.search);
  rim_monitor *m = memory;
  memcpy(m->words, p.words, sizeof m->words);
  m->channel_count = p.channel_count;
  connect(m, &p, &l);
  unsigned char *base = memory;
  status = rimi_blocks_init(&m->rows, base + l.rows, l.rows_bytes, &p.rows);
  if (status == RIM_OK && p.is_trained)
    status = rimi_search_init(&m->search, base + l.search, l.search_bytes, &p.search);
  else if (status == RIM_OK)
    status = init_select(m, &p, &l);
  if (status != RIM_OK)
    return status;
  init_life(m);
  if (m->watch != NULL) {
    memset(m->watch, 0, RIM_MONITOR_INTERFERENCE_BYTES);
    rimi_interference_watch_init(m->watch, &m->image);
  }
  rimi_monitor_clear_verdict(m);
  m->magic = MONITOR_MAGIC;
  m->library = RIM_VERSION_NUMBER;
  m->header_bytes = (uint32_t)sizeof *m;
  rimi_guard_fix(m);
  rimi_guard_accept_image(m);
  rimi_guard_renew(m);
  rimi_guard_leave(m);
  *monitor = m;
  return RIM_OK;
}

rim_status rim_monitor_repair(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes) {
  if (memory == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  if (bytes < sizeof(struct rim_monitor))
    return RIM_E_SIZE;
  const monitor_kept kept = rimi_guard_kept(memory);
  const rim_status status = rim_monitor_init(monitor, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  rimi_alarm_life_go_on(&(*monitor)->life, &kept.policy, kept.seq, kept.raised);
  rimi_guard_leave(*monitor);
  return RIM_OK;
}

rim_status rim_monitor_attach(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes) {
  if (monitor == NULL || memory == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  monitor_plan p;
  layout l;
  const rim_status status = examine(&p, &l, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  rim_monitor *m = memory;
  if (m->magic != MONITOR_MAGIC || m->library != RIM_VERSION_NUMBER ||
      m->header_bytes != sizeof *m || m->image.model_id != p.image.model_id ||
      m->image.bytes != p.image.bytes || memcmp(m->words, p.words, sizeof m->words) != 0 ||
      !rimi_guard_copy_holds(m))
    return RIM_E_DATA;
  connect(m, &p,
          &l); /* the copy's own pointers are another place's, and were summed as they were */
  if (!rimi_guard_parts_hold(m))
    return RIM_E_DATA;
  rimi_blocks_attach(m->rows, &p.rows);
  if (p.is_trained)
    rimi_search_attach(m->search, &p.search);
  if (!rimi_guard_history_holds(m) || !rimi_guard_all(m))
    return RIM_E_DATA;
  rimi_guard_fix(m);
  rimi_guard_leave(m);
  *monitor = m;
  return RIM_OK;
}

void rimi_monitor_forget_regions(rim_monitor *m) {
  if (m->is_trained) {
    rimi_search_reset(m->search);
    memset(m->agreement_state, 0, 8u * AGREEMENT_STATE * (size_t)m->words[RIM_CONFIG_OUTCOMES]);
  } else {
    rimi_select_reset(m->select);
  }
  m->has_explained = m->has_place = false;
  m->ended_first = m->ended_end = m->ended_count = 0;
  m->refused = m->partly = m->unseen = 0;
  const double t_s = m->last.t_s;
  rimi_monitor_clear_verdict(m);
  m->last.t_s = t_s;
  rimi_guard_renew(m);
}

void rimi_monitor_forget(rim_monitor *m) {
  rimi_blocks_reset(m->rows);
  rimi_monitor_forget_regions(m);
  if (m->watch != NULL)
    rimi_interference_watch_reset(m->watch);
}

void rim_monitor_reset(rim_monitor *m) {
  if (m == NULL || !rimi_guard_enter(m))
    return;
  rimi_monitor_forget(m);
  rimi_alarm_life_reset(&m->life);
  rimi_guard_leave(m);
}
