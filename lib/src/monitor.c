#include "rim/monitor.h"

#include <string.h>

#include "alarm_life.h"
#include "interference_watch.h"
#include "rim/nominal.h"
#include "rim/real.h"

#define UPDATE_RATIO 0.25         /* ln anom grown by a quarter is worth another record */
#define FEW_SCANS 8u              /* with fewer a row that ends a block does none */
#define MONITOR_MAGIC 0x52494d4du /* "RIMM": memory that holds a monitor */

struct rim_monitor {
  uint32_t magic;
  uint32_t words[RIM_CONFIG_WORDS];
  rim_image image;
  rim_nominal step, level, increment;
  rim_threshold threshold;
  rim_envelope envelope;
  rim_correct correct;
  rim_channels *channels;
  rim_select *select;
  interference_watch *watch; /* NULL: the image has none */
  double *unit;              /* [region features] scratch of a block in unit coordinates */
  float *inverse_scale;      /* [channels] */
  const uint8_t *range;      /* f32 low[features], high[features] */
  const uint8_t *region;
  rim_alarm_life life;
  double first_block_s;
  double last_block_s;
  double last_valid_s;
  uint32_t steps;
  uint32_t blocks_refused;
  uint16_t channel_count;
  rim_verdict last; /* what a row that completes no block repeats */
};

_Static_assert(sizeof(struct rim_monitor) <= RIM_MONITOR_HEADER_BYTES, "header outgrown");

/* Everything that is read from the image, gathered before anything is written. */
typedef struct plan {
  rim_image image;
  uint32_t words[RIM_CONFIG_WORDS];
  rim_nominal step, level, increment;
  rim_threshold threshold;
  rim_envelope envelope;
  rim_correct correct;
  rim_channels_config channels;
  rim_select_config select;
  const uint8_t *range;
  const uint8_t *region;
  uint8_t kinds_present;
  uint16_t channel_count;
  bool has_watch;
} plan;

static rim_status read_words(plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, RIM_SECTION_CONFIG, &data, &bytes) != RIM_OK ||
      bytes != 4u * RIM_CONFIG_WORDS) {
    return RIM_E_CONFIG;
  }
  for (size_t i = 0; i < RIM_CONFIG_WORDS; ++i)
    p->words[i] = rim_image_u32(data, i);
  const uint32_t *w = p->words;
  if (w[RIM_CONFIG_FEATURES] == 0 || w[RIM_CONFIG_FEATURES] > RIM_CHANNELS_MAX_FEATURES ||
      w[RIM_CONFIG_OUTCOMES] == 0 || w[RIM_CONFIG_OUTCOMES] > RIM_CHANNELS_MAX_OUTCOMES ||
      w[RIM_CONFIG_KINDS] == 0 || w[RIM_CONFIG_KINDS] >> RIM_CHANNELS_KINDS != 0 ||
      w[RIM_CONFIG_BLOCK_ROWS] == 0 || w[RIM_CONFIG_BLOCK_ROWS] > 10000 ||
      w[RIM_CONFIG_REGION_FEATURES] == 0 ||
      w[RIM_CONFIG_REGION_FEATURES] > w[RIM_CONFIG_FEATURES] || w[RIM_CONFIG_EXTERNAL] > 1 ||
      w[RIM_CONFIG_BUDGET] > 64) {
    return RIM_E_CONFIG;
  }
  for (size_t i = RIM_CONFIG_RING; i <= RIM_CONFIG_MOVES; ++i) {
    const bool is_count = i != RIM_CONFIG_INHIBIT_MS && i != RIM_CONFIG_SEED;
    if (is_count && w[i] > UINT16_MAX)
      return RIM_E_CONFIG;
  }
  return RIM_OK;
}

static rim_status open_model(const plan *p, rim_section id, rim_nominal *model) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, (uint32_t)id, &data, &bytes) != RIM_OK)
    return RIM_E_CONFIG;
  const rim_status status = rim_nominal_open(model, data, bytes);
  if (status != RIM_OK)
    return status;
  return model->inputs == p->words[RIM_CONFIG_FEATURES] &&
                 model->outputs == p->words[RIM_CONFIG_OUTCOMES]
             ? RIM_OK
             : RIM_E_CONFIG;
}

static rim_status open_models(plan *p) {
  if (p->words[RIM_CONFIG_EXTERNAL] != 0)
    return RIM_OK;
  const uint32_t kinds = p->words[RIM_CONFIG_KINDS];
  rim_status status = RIM_OK;
  if ((kinds & (1u << RIM_KIND_VARIANCE | 1u << RIM_KIND_STEP)) != 0) {
    status = open_model(p, RIM_SECTION_STEP, &p->step);
    p->channels.step = &p->step;
  }
  if (status == RIM_OK && (kinds & 1u << RIM_KIND_SHIFT) != 0) {
    status = open_model(p, RIM_SECTION_LEVEL, &p->level);
    p->channels.level = &p->level;
  }
  if (status == RIM_OK && (kinds & 1u << RIM_KIND_INCREMENT) != 0) {
    status = open_model(p, RIM_SECTION_INCREMENT, &p->increment);
    p->channels.increment = &p->increment;
  }
  return status;
}

/* A section that must have exactly these bytes; NULL when it is absent or has not. */
static const uint8_t *exact_section(const plan *p, rim_section id, size_t expected) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, (uint32_t)id, &data, &bytes) != RIM_OK)
    return NULL;
  return bytes == expected ? data : NULL;
}

static rim_status open_tables(plan *p) {
  const size_t features = p->words[RIM_CONFIG_FEATURES];
  const size_t region_features = p->words[RIM_CONFIG_REGION_FEATURES];
  p->range = exact_section(p, RIM_SECTION_FEATURES, 8u * features);
  p->region = exact_section(p, RIM_SECTION_REGION, 2u * region_features);
  if (p->range == NULL || p->region == NULL)
    return RIM_E_CONFIG;
  for (size_t f = 0; f < features; ++f) {
    const double low = (double)rim_image_f32(p->range, f);
    const double high = (double)rim_image_f32(p->range, features + f);
    if (!rim_is_finite(low) || !rim_is_finite(high) || !(high > low))
      return RIM_E_RANGE;
  }
  for (size_t i = 0; i < region_features; ++i) {
    const uint16_t f = rim_image_u16(p->region, i);
    if (f >= features)
      return RIM_E_RANGE;
    for (size_t j = 0; j < i; ++j) {
      if (rim_image_u16(p->region, j) == f)
        return RIM_E_RANGE;
    }
  }
  const uint8_t *scales = exact_section(p, RIM_SECTION_CHANNELS, 8u * (size_t)p->channel_count);
  if (scales == NULL)
    return RIM_E_CONFIG;
  for (size_t i = 0; i < 2u * (size_t)p->channel_count; ++i) {
    const double value = (double)rim_image_f32(scales, i);
    if (!rim_is_finite(value))
      return RIM_E_RANGE;
    if (i >= p->channel_count && !(value > 0.0))
      return RIM_E_RANGE;
  }
  p->channels.center = scales;
  p->channels.inverse_sd = scales + 4u * (size_t)p->channel_count;
  if (p->words[RIM_CONFIG_EXTERNAL] == 0) {
    p->channels.outcome_feature =
        exact_section(p, RIM_SECTION_OUTCOMES, 2u * (size_t)p->words[RIM_CONFIG_OUTCOMES]);
    if (p->channels.outcome_feature == NULL)
      return RIM_E_CONFIG;
    for (size_t o = 0; o < p->words[RIM_CONFIG_OUTCOMES]; ++o) {
      if (rim_image_u16(p->channels.outcome_feature, o) >= features)
        return RIM_E_RANGE;
    }
  }
  p->channels.command = exact_section(p, RIM_SECTION_COMMANDS, features);
  return p->channels.command != NULL ? RIM_OK : RIM_E_CONFIG;
}

static rim_status open_threshold(plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, RIM_SECTION_THRESHOLD, &data, &bytes) != RIM_OK) {
    return RIM_E_CONFIG;
  }
  const rim_status status = rim_threshold_open(&p->threshold, data, bytes);
  if (status != RIM_OK)
    return status;
  return p->threshold.channels == p->channel_count ? RIM_OK : RIM_E_CONFIG;
}

/* Trained images judge intervals by their nominal spread; without the section eq. 3.7 stands. */
static rim_status open_envelope(plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, RIM_SECTION_ENVELOPE, &data, &bytes) != RIM_OK)
    return RIM_OK;
  const rim_status status = rim_envelope_open(&p->envelope, data, bytes);
  p->select.envelope = &p->envelope;
  return status;
}

/* What the ground has found wrong with the models since they were trained. */
static rim_status open_correct(plan *p) {
  const uint8_t *data;
  size_t bytes;
  if (rim_image_section(&p->image, RIM_SECTION_CORRECT, &data, &bytes) != RIM_OK)
    return RIM_OK;
  const rim_status status = rim_correct_open(&p->correct, data, bytes);
  if (status != RIM_OK)
    return status;
  p->channels.correct = &p->correct;
  return p->correct.features == p->words[RIM_CONFIG_FEATURES] &&
                 p->correct.outcomes == p->words[RIM_CONFIG_OUTCOMES]
             ? RIM_OK
             : RIM_E_CONFIG;
}

static rim_status make_plan(plan *p, const void *image, size_t image_bytes) {
  memset(p, 0, sizeof *p);
  rim_status status = rim_image_open(&p->image, image, image_bytes);
  if (status == RIM_OK)
    status = read_words(p);
  if (status != RIM_OK)
    return status;
  const uint32_t *w = p->words;
  for (unsigned k = 0; k < RIM_CHANNELS_KINDS; ++k) {
    p->kinds_present = (uint8_t)(p->kinds_present + (w[RIM_CONFIG_KINDS] >> k & 1u));
  }
  p->channel_count = (uint16_t)RIM_CHANNELS_COUNT(w[RIM_CONFIG_OUTCOMES], p->kinds_present);
  if (p->channel_count > RIM_SELECT_MAX_CHANNELS)
    return RIM_E_CONFIG;
  p->channels.features = (uint16_t)w[RIM_CONFIG_FEATURES];
  p->channels.outcomes = (uint16_t)w[RIM_CONFIG_OUTCOMES];
  p->channels.block_rows = (uint16_t)w[RIM_CONFIG_BLOCK_ROWS];
  p->channels.kinds = (uint8_t)w[RIM_CONFIG_KINDS];
  p->channels.external = w[RIM_CONFIG_EXTERNAL] != 0;
  p->channels.period_s = 1e-6 * (double)w[RIM_CONFIG_PERIOD_US];
  status = open_models(p);
  if (status == RIM_OK)
    status = open_tables(p);
  if (status == RIM_OK)
    status = open_threshold(p);
  if (status == RIM_OK)
    status = open_envelope(p);
  if (status == RIM_OK)
    status = open_correct(p);
  if (status == RIM_OK)
    status = rim_interference_watch_check(&p->image, p->channels.features, p->channels.outcomes,
                                          &p->has_watch);
  p->select.features = (uint16_t)w[RIM_CONFIG_REGION_FEATURES];
  p->select.channels = p->channel_count;
  p->select.ring = (uint16_t)w[RIM_CONFIG_RING];
  p->select.bins = (uint16_t)w[RIM_CONFIG_BINS];
  p->select.grid = (uint16_t)w[RIM_CONFIG_GRID];
  p->select.pairs = (uint16_t)w[RIM_CONFIG_PAIRS];
  p->select.scans = (uint16_t)w[RIM_CONFIG_SCANS];
  p->select.edges = (uint16_t)w[RIM_CONFIG_EDGES];
  p->select.moves = (uint16_t)w[RIM_CONFIG_MOVES];
  p->select.seed = w[RIM_CONFIG_SEED];
  return status;
}

/* Where the parts lie in the monitor's memory, in bytes from its start. */
typedef struct layout {
  size_t channels, channels_bytes;
  size_t floats; /* inverse scale, offset: f32[channels] each */
  size_t unit;
  size_t select, select_bytes;
  size_t watch;
  size_t total;
} layout;

static rim_status make_layout(const plan *p, layout *l) {
  const rim_status status = rim_select_size(&p->select, &l->select_bytes);
  if (status != RIM_OK)
    return status;
  l->channels = RIM_MONITOR_HEADER_BYTES;
  l->channels_bytes =
      RIM_CHANNELS_SIZE(p->channels.features, p->channels.outcomes, p->kinds_present);
  l->floats = l->channels + l->channels_bytes;
  l->unit = l->floats + 8u * (size_t)p->channel_count;
  l->select = l->unit + 8u * (size_t)p->select.features;
  l->watch = (l->select + l->select_bytes + 7u) / 8u * 8u;
  l->total = p->has_watch ? l->watch + RIM_MONITOR_INTERFERENCE_BYTES : l->select + l->select_bytes;
  return RIM_OK;
}

rim_status rim_monitor_size(const void *image, size_t image_bytes, size_t *bytes) {
  if (image == NULL || bytes == NULL)
    return RIM_E_ARGUMENT;
  plan p;
  layout l;
  rim_status status = make_plan(&p, image, image_bytes);
  if (status == RIM_OK)
    status = make_layout(&p, &l);
  if (status == RIM_OK)
    *bytes = l.total;
  return status;
}

/* What the image asks for, and where it goes in the caller's memory. */
static rim_status examine(plan *p, layout *l, const void *memory, size_t bytes, const void *image,
                          size_t image_bytes) {
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

/* Pointers into the monitor's own memory and into the image, anew for where both are now. */
static void connect(rim_monitor *self, const plan *p, const layout *l) {
  unsigned char *base = (unsigned char *)self;
  self->image = p->image;
  self->step = p->step;
  self->level = p->level;
  self->increment = p->increment;
  self->threshold = p->threshold;
  self->envelope = p->envelope;
  self->correct = p->correct;
  self->range = p->range;
  self->region = p->region;
  self->inverse_scale = (float *)(void *)(base + l->floats);
  self->unit = (double *)(void *)(base + l->unit);
  self->watch = p->has_watch ? (interference_watch *)(void *)(base + l->watch) : NULL;
}

/* The plan's views are on the stack: the channels must point to the monitor's own. */
static rim_channels_config channels_config(const rim_monitor *self, const plan *p) {
  rim_channels_config config = p->channels;
  if (config.step != NULL)
    config.step = &self->step;
  if (config.level != NULL)
    config.level = &self->level;
  if (config.increment != NULL)
    config.increment = &self->increment;
  if (config.correct != NULL)
    config.correct = &self->correct;
  return config;
}

static rim_status init_search(rim_monitor *self, plan *p, const layout *l) {
  unsigned char *base = (unsigned char *)self;
  float *offset = self->inverse_scale + p->channel_count;
  for (size_t c = 0; c < p->channel_count; ++c) {
    self->inverse_scale[c] = 1.0f / rim_image_f32(p->threshold.scale, c);
    offset[c] = rim_image_f32(p->threshold.offset, c) * self->inverse_scale[c];
  }
  if (p->select.envelope != NULL)
    p->select.envelope = &self->envelope;
  rim_status status = rim_select_init(&self->select, base + l->select, l->select_bytes, &p->select);
  if (status == RIM_OK) {
    status = rim_select_set_channel_scale(self->select, self->inverse_scale, offset);
  }
  return status;
}

static void init_life(rim_monitor *self) {
  rim_alarm_life_config config = {
      .policy = {.stale_s = 1e-3 * (double)self->words[RIM_CONFIG_STALE_MS]},
      .model_id = self->image.model_id,
  };
  rim_alarm_slot_config *regions = &config.slot[RIM_DETECTOR_RIM];
  regions->raise_steps = self->words[RIM_CONFIG_PERSISTENCE];
  regions->clear_steps = self->words[RIM_CONFIG_CLEAR];
  regions->inhibit_s = 1e-3 * (double)self->words[RIM_CONFIG_INHIBIT_MS];
  regions->update_ratio = UPDATE_RATIO;
  config.slot[RIM_DETECTOR_INTERFERENCE] = rim_interference_watch_life(regions);
  (void)rim_alarm_life_init(&self->life, &config);
}

rim_status rim_monitor_init(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                            size_t image_bytes) {
  if (monitor == NULL || memory == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  plan p;
  layout l;
  rim_status status = examine(&p, &l, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  memset(memory, 0, RIM_MONITOR_HEADER_BYTES);
  rim_monitor *self = memory;
  memcpy(self->words, p.words, sizeof self->words);
  self->channel_count = p.channel_count;
  connect(self, &p, &l);
  const rim_channels_config config = channels_config(self, &p);
  status = rim_channels_init(&self->channels, (unsigned char *)memory + l.channels,
                             l.channels_bytes, &config);
  if (status == RIM_OK)
    status = init_search(self, &p, &l);
  if (status != RIM_OK)
    return status;
  init_life(self);
  if (self->watch != NULL)
    rim_interference_watch_init(self->watch, &self->image);
  self->last.level = RIM_LEVEL_OK;
  self->last.p_value = 1.0;
  self->last.threshold = rim_threshold_ln_anom(&self->threshold, 0, 0);
  self->magic = MONITOR_MAGIC;
  *monitor = self;
  return RIM_OK;
}

rim_status rim_monitor_attach(rim_monitor **monitor, void *memory, size_t bytes, const void *image,
                              size_t image_bytes) {
  if (monitor == NULL || memory == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  plan p;
  layout l;
  const rim_status status = examine(&p, &l, memory, bytes, image, image_bytes);
  if (status != RIM_OK)
    return status;
  rim_monitor *self = memory;
  if (self->magic != MONITOR_MAGIC || self->image.model_id != p.image.model_id ||
      self->image.bytes != p.image.bytes || memcmp(self->words, p.words, sizeof self->words) != 0) {
    return RIM_E_DATA;
  }
  connect(self, &p, &l);
  self->channels = (rim_channels *)(void *)((unsigned char *)memory + l.channels);
  self->select = (rim_select *)(void *)((unsigned char *)memory + l.select);
  const rim_channels_config config = channels_config(self, &p);
  rim_channels_attach(self->channels, &config);
  rim_select_attach(self->select, p.select.envelope != NULL ? &self->envelope : NULL);
  *monitor = self;
  return RIM_OK;
}

static void forget_regions(rim_monitor *self) {
  rim_channels_reset(self->channels);
  rim_select_reset(self->select);
  const double t_s = self->last.t_s;
  memset(&self->last, 0, sizeof self->last);
  self->last.t_s = t_s;
  self->last.p_value = 1.0;
  self->last.threshold = rim_threshold_ln_anom(&self->threshold, 0, 0);
}

static void forget_detectors(rim_monitor *self) {
  forget_regions(self);
  if (self->watch != NULL)
    rim_interference_watch_reset(self->watch);
}

void rim_monitor_reset(rim_monitor *self) {
  if (self == NULL)
    return;
  forget_detectors(self);
  rim_alarm_life_reset(&self->life);
}

static double feature_low(const rim_monitor *self, size_t f) {
  return (double)rim_image_f32(self->range, f);
}
static double feature_width(const rim_monitor *self, size_t f) {
  return (double)rim_image_f32(self->range, self->words[RIM_CONFIG_FEATURES] + f) -
         feature_low(self, f);
}

static void to_unit(const rim_monitor *self, const double *context, double *unit) {
  for (size_t i = 0; i < self->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = rim_image_u16(self->region, i);
    unit[i] = (context[f] - feature_low(self, f)) / feature_width(self, f);
  }
}

/* Unit coordinates over region features -> units of the features, indices of the image. */
static rim_region to_features(const rim_monitor *self, const rim_region *unit) {
  rim_region region = *unit;
  double width[RIM_REGION_MAX_DIMS];
  for (size_t i = 0; i < unit->dims; ++i) {
    const uint16_t f = rim_image_u16(self->region, unit->feature[i]);
    const double low = feature_low(self, f);
    width[i] = feature_width(self, f);
    region.feature[i] = f;
    region.center[i] = low + unit->center[i] * width[i];
    region.lower[i] = low + unit->lower[i] * width[i];
    region.upper[i] = low + unit->upper[i] * width[i];
  }
  for (size_t i = 0; i < unit->dims; ++i) {
    for (size_t j = 0; j < unit->dims; ++j) {
      const size_t at = i * unit->dims + j;
      region.inverse_shape[at] = unit->inverse_shape[at] / (width[i] * width[j]);
    }
  }
  return region;
}

/* Outcomes whose score is above the threshold, most anomalous first; the leading one always. */
static void name_channels(const rim_monitor *self, rim_alarm *alarm, uint16_t leading) {
  const float *scores = rim_select_channel_scores(self->select);
  const uint32_t n = rim_select_observations(self->select);
  alarm->channels = 1;
  alarm->channel[0] = rim_channels_outcome(self->channels, leading);
  while (alarm->channels < RIM_ALARM_MAX_CHANNELS) {
    double best = self->threshold.alarm_score;
    bool found = false;
    uint16_t best_outcome = 0;
    for (uint16_t c = 0; c < self->channel_count; ++c) {
      const uint16_t outcome = rim_channels_outcome(self->channels, c);
      bool taken = false;
      for (size_t i = 0; i < alarm->channels; ++i)
        taken = taken || alarm->channel[i] == outcome;
      const double score = rim_threshold_score(&self->threshold, c, (double)scores[c], n);
      if (!taken && score >= best) {
        best = score;
        best_outcome = outcome;
        found = true;
      }
    }
    if (!found)
      return;
    alarm->channel[alarm->channels++] = best_outcome;
  }
}

/* The most likely shift (eq. 3.6) and its standard error in the outcome's unit, per named
 * outcome: by the same kind of channel as the leading one. */
static void size_shifts(const rim_monitor *self, rim_alarm *alarm, uint16_t leading,
                        const rim_candidate *best) {
  const uint16_t outcomes = (uint16_t)self->words[RIM_CONFIG_OUTCOMES];
  const uint16_t first_of_kind = (uint16_t)(leading - leading % outcomes);
  for (size_t i = 0; i < alarm->channels; ++i) {
    const uint16_t c = (uint16_t)(first_of_kind + alarm->channel[i]);
    rim_candidate found;
    if (c == leading)
      found = *best;
    else if (!rim_select_shift_of_channel(self->select, c, &found))
      continue;
    if (found.n <= 0.0)
      continue;
    const double mean = found.shift;
    const double unit = rim_channels_unit(self->channels, c);
    /* F = shift^2 / (2 Var) gives the standard error without asking for Var again. */
    const double sd = found.ln_anom > 0.0 ? rim_abs(mean) / rim_sqrt(2.0 * found.ln_anom) : 0.0;
    alarm->shift[i] = mean * unit;
    alarm->shift_sd[i] = sd * unit;
    if (alarm->kind == RIM_KIND_VARIANCE) { /* from logarithms to the ratio of variances */
      alarm->shift[i] = rim_exp(alarm->shift[i]);
      alarm->shift_sd[i] *= alarm->shift[i];
    }
  }
}

static double time_of_observation(const rim_monitor *self, uint32_t index) {
  const uint32_t n = rim_select_observations(self->select);
  if (n < 2)
    return self->last_block_s;
  const double spacing_s = (self->last_block_s - self->first_block_s) / (double)(n - 1);
  return self->first_block_s + spacing_s * (double)index;
}

static void describe(const rim_monitor *self, const rim_verdict *verdict, rim_alarm *alarm) {
  memset(alarm, 0, sizeof *alarm);
  alarm->t_s = verdict->t_s;
  alarm->since_s = verdict->t_s;
  alarm->model_id = self->image.model_id;
  alarm->detector = RIM_DETECTOR_RIM;
  alarm->level = verdict->level;
  alarm->kind = (uint8_t)rim_channels_kind(self->channels, verdict->channel);
  alarm->ln_anom = verdict->ln_anom;
  alarm->threshold = verdict->threshold;
  alarm->p_value = verdict->p_value;
  rim_candidate best;
  memset(&best, 0, sizeof best);
  if (rim_select_best_of_channel(self->select, verdict->channel, &best)) {
    alarm->region = to_features(self, &best.region);
    /* The whole range of a feature is no restriction. */
    if (best.dims == 1 && best.region.lower[0] <= 0.0 && best.region.upper[0] >= 1.0) {
      memset(&alarm->region, 0, sizeof alarm->region);
    }
    alarm->observations = (uint32_t)best.n;
    if (best.since != UINT32_MAX)
      alarm->since_s = time_of_observation(self, best.since);
  }
  name_channels(self, alarm, verdict->channel);
  size_shifts(self, alarm, verdict->channel, &best);
}

static void judge(rim_monitor *self, rim_verdict *verdict) {
  const float *scores = rim_select_channel_scores(self->select);
  const uint32_t n = rim_select_observations(self->select);
  const double envelope = rim_threshold_envelope(&self->threshold, n);
  const float *offset = self->inverse_scale + self->channel_count;
  double best = 0.0;
  uint16_t channel = 0;
  for (uint16_t c = 0; c < self->channel_count; ++c) {
    const double score =
        (double)scores[c] * (double)self->inverse_scale[c] / envelope - (double)offset[c];
    if (c == 0 || score > best) {
      best = score;
      channel = c;
    }
  }
  verdict->channel = channel;
  verdict->blocks = n;
  verdict->ln_anom = (double)scores[channel];
  verdict->score = rim_threshold_score(&self->threshold, channel, verdict->ln_anom, n);
  verdict->threshold = rim_threshold_ln_anom(&self->threshold, channel, n);
  verdict->p_value = rim_threshold_p_value(&self->threshold, verdict->score);
  verdict->level = verdict->score >= self->threshold.alarm_score  ? RIM_LEVEL_ERROR
                   : verdict->score >= self->threshold.warn_score ? RIM_LEVEL_WARN
                                                                  : RIM_LEVEL_OK;
}

/* With few scans a row the image is for a small processor: the row that ends a block, with its two
 * further predictions, is the most costly one and leaves the search to the others. */
static bool is_spared(const rim_monitor *self, uint32_t rows, bool new_block) {
  const uint32_t scans = self->words[RIM_CONFIG_SCANS];
  return new_block && rows == 1 && self->words[RIM_CONFIG_BLOCK_ROWS] > 1 && scans > 0 &&
         scans < FEW_SCANS;
}

static void search_and_judge(rim_monitor *self, uint32_t rows, bool new_block) {
  const uint32_t budget = self->words[RIM_CONFIG_BUDGET] != 0 ? self->words[RIM_CONFIG_BUDGET] : 1;
  if (is_spared(self, rows, new_block))
    rows = 0;
  for (uint32_t i = 0; i < rows; ++i)
    rim_select_work(self->select, budget);
  if (rim_select_observations(self->select) == 0)
    return;
  judge(self, &self->last);
  if (!new_block)
    return;
  rim_alarm candidate = {.level = self->last.level};
  if (candidate.level == RIM_LEVEL_ERROR ||
      (candidate.level == RIM_LEVEL_WARN && rim_monitor_standing(self, RIM_DETECTOR_RIM) != NULL))
    describe(self, &self->last, &candidate);
  rim_alarm_life_step(&self->life, RIM_DETECTOR_RIM, self->last.t_s, &candidate);
}

static void watch_motion(rim_monitor *self, const rim_observation *row) {
  rim_alarm candidate;
  const bool found =
      rim_interference_watch_step(self->watch, row, &self->last.interference, &candidate);
  if (self->last.interference.valid)
    rim_alarm_life_step(&self->life, RIM_DETECTOR_INTERFERENCE, row->t_s,
                        found ? &candidate : NULL);
}

static rim_status observe(rim_monitor *self, double t_s, const double *context,
                          const double *values) {
  to_unit(self, context, self->unit);
  const rim_status status = rim_select_observe(self->select, self->unit, values);
  if (status != RIM_OK)
    return status;
  if (rim_select_observations(self->select) == 1)
    self->first_block_s = t_s;
  self->last_block_s = t_s;
  return RIM_OK;
}

static void begin_verdict(rim_monitor *self, double t_s, bool valid) {
  self->last.alarm.state = RIM_ALARM_NONE;
  self->last.alarm.seq = 0;
  self->last.t_s = t_s;
  self->last.valid = valid;
  self->last.interference.valid = false;
}

/* At most one record a row; the others wait, and the level is that of the whole. */
static void end_verdict(rim_monitor *self, rim_verdict *verdict) {
  (void)rim_alarm_life_next_record(&self->life, &self->last.alarm);
  self->last.level = (uint8_t)rim_alarm_life_level(&self->life);
  *verdict = self->last;
}

rim_status rim_monitor_step(rim_monitor *self, const rim_observation *row, rim_verdict *verdict) {
  if (self == NULL || row == NULL || row->context == NULL || verdict == NULL) {
    return RIM_E_ARGUMENT;
  }
  const int made =
      rim_channels_row(self->channels, row->t_s, row->context, row->outcome, row->mean, row->sd);
  if (made == RIM_E_ARGUMENT)
    return RIM_E_ARGUMENT;
  if (self->steps != UINT32_MAX)
    ++self->steps;
  self->last.step = self->steps;
  begin_verdict(self, row->t_s, made >= 0);
  if (made >= 0) {
    self->last_valid_s = row->t_s;
    rim_alarm_life_row(&self->life, row->t_s);
    const bool new_block =
        made == 1 && observe(self, row->t_s, rim_channels_context(self->channels),
                             rim_channels_values(self->channels)) == RIM_OK;
    if (made == 1 && !new_block && self->blocks_refused != UINT32_MAX)
      ++self->blocks_refused;
    search_and_judge(self, 1, new_block);
    if (self->watch != NULL)
      watch_motion(self, row);
  } else {
    (void)rim_alarm_life_idle(&self->life, row->t_s);
  }
  end_verdict(self, verdict);
  return RIM_OK;
}

rim_status rim_monitor_block(rim_monitor *self, double t_s, const double *context,
                             const double *values, uint32_t rows, rim_verdict *verdict) {
  if (self == NULL || context == NULL || values == NULL || verdict == NULL)
    return RIM_E_ARGUMENT;
  const rim_status status = observe(self, t_s, context, values);
  if (status != RIM_OK)
    return status;
  begin_verdict(self, t_s, true);
  rim_alarm_life_row(&self->life, t_s);
  search_and_judge(self, rows, true);
  end_verdict(self, verdict);
  return RIM_OK;
}

rim_status rim_monitor_set_policy(rim_monitor *self, const rim_alarm_policy *policy) {
  return rim_alarm_life_set_policy(self != NULL ? &self->life : NULL, policy);
}

bool rim_monitor_idle(rim_monitor *self, double now_s) {
  return self != NULL && rim_alarm_life_idle(&self->life, now_s);
}

rim_status rim_monitor_command(rim_monitor *self, const rim_command *command, unsigned bits) {
  uint32_t forget = 0;
  const rim_status status =
      rim_alarm_life_command(self != NULL ? &self->life : NULL, command, bits, &forget);
  if ((forget >> RIM_DETECTOR_RIM & 1u) != 0)
    forget_regions(self);
  if ((forget >> RIM_DETECTOR_INTERFERENCE & 1u) != 0)
    rim_interference_watch_reset(self->watch);
  return status;
}

void rim_monitor_restart(rim_monitor *self, double now_s) {
  if (self == NULL || !rim_is_finite(now_s))
    return;
  forget_detectors(self);
  rim_alarm_life_restart(&self->life, now_s);
}

void rim_monitor_repeat(rim_monitor *self) {
  if (self != NULL)
    rim_alarm_life_repeat(&self->life);
}

bool rim_monitor_next_record(rim_monitor *self, rim_alarm *record) {
  return self != NULL && record != NULL && rim_alarm_life_next_record(&self->life, record);
}

rim_alarm_status rim_monitor_alarms(const rim_monitor *self) {
  rim_alarm_status status = {.level = RIM_LEVEL_STALE};
  if (self != NULL)
    rim_alarm_life_status(&self->life, &status);
  return status;
}

const rim_alarm *rim_monitor_standing(const rim_monitor *self, rim_detector detector) {
  return self != NULL ? rim_alarm_life_standing(&self->life, detector) : NULL;
}

double rim_monitor_membership(const rim_monitor *self, const double *context) {
  if (context == NULL || rim_monitor_standing(self, RIM_DETECTOR_RIM) == NULL)
    return 0.0;
  double unit[RIM_CHANNELS_MAX_FEATURES];
  to_unit(self, context, unit);
  return rim_select_membership(self->select, unit);
}

rim_monitor_health rim_monitor_get_health(const rim_monitor *self) {
  rim_monitor_health health = {.last_valid_s = 0.0};
  if (self == NULL)
    return health;
  health.rows = *rim_channels_get_health(self->channels);
  health.blocks_refused = self->blocks_refused;
  health.alarms = self->life.raised;
  health.stale = self->life.stale_times;
  health.last_valid_s = self->last_valid_s;
  if (self->watch != NULL)
    health.interference = self->watch->state.health;
  return health;
}

const rim_select *rim_monitor_search(const rim_monitor *self) {
  return self != NULL ? self->select : NULL;
}
const rim_channels *rim_monitor_channels(const rim_monitor *self) {
  return self != NULL ? self->channels : NULL;
}
const rim_threshold *rim_monitor_threshold(const rim_monitor *self) {
  return self != NULL ? &self->threshold : NULL;
}
uint32_t rim_monitor_config(const rim_monitor *self, rim_config_word word) {
  return self != NULL && (unsigned)word < RIM_CONFIG_WORDS ? self->words[word] : 0;
}
