#include "rim/channels.h"

#include <string.h>

#include "rim/image.h"
#include "rim/real.h"

struct rim_channels {
  rim_channels_config config;
  rim_channels_health health;
  double block_start_s;
  double previous_t_s;
  uint16_t rows_in_block;
  uint16_t channels;
  uint8_t kinds_present;
  uint8_t kind_of[RIM_CHANNELS_KINDS]; /* n-th present kind */
  bool has_previous_row;
  bool has_previous_block;
  uint16_t steps_in_block; /* one-step residuals gathered: at most rows_in_block */
};

_Static_assert(sizeof(struct rim_channels) <= RIM_CHANNELS_HEADER_BYTES, "header outgrown");

/* The arrays follow the header in this order. */
enum { FEATURE_ARRAYS = 3, OUTCOME_ARRAYS = 9 };

static double *feature_array(const rim_channels *self, unsigned which) {
  unsigned char *base = (unsigned char *)(uintptr_t)self + RIM_CHANNELS_HEADER_BYTES;
  return (double *)(void *)base + (size_t)which * self->config.features;
}
static double *outcome_array(const rim_channels *self, unsigned which) {
  return feature_array(self, FEATURE_ARRAYS) + (size_t)which * self->config.outcomes;
}
#define BLOCK_SUM(self) feature_array(self, 0)      /* then the block's mean */
#define PREVIOUS_BLOCK(self) feature_array(self, 1) /* mean of the last block */
#define SCRATCH_CONTEXT(self) feature_array(self, 2)
#define PREDICTED(self) outcome_array(self, 0) /* one step ahead of the previous row */
#define PREDICTED_SD(self) outcome_array(self, 1)
#define STEP_SUM(self) outcome_array(self, 2)
#define STEP_SQUARES(self) outcome_array(self, 3)
#define BLOCK_MEAN(self) outcome_array(self, 4)
#define BLOCK_SD(self) outcome_array(self, 5)
#define INCREMENT_SD(self) outcome_array(self, 6)
#define PREVIOUS_READING(self) outcome_array(self, 7)
#define REPEATS(self) outcome_array(self, 8)
#define VALUES(self) outcome_array(self, OUTCOME_ARRAYS)

static bool has_kind(const rim_channels_config *config, rim_kind kind) {
  return (config->kinds >> (unsigned)kind & 1u) != 0u;
}

static bool shape_fits(const rim_nominal *model, const rim_channels_config *config) {
  return model != NULL && model->inputs == config->features && model->outputs == config->outcomes;
}

static bool correct_fits(const rim_channels_config *config) {
  const rim_correct *c = config->correct;
  return c == NULL ||
         (c->section != NULL && c->features == config->features && c->outcomes == config->outcomes);
}

static bool config_is_valid(const rim_channels_config *config) {
  if (config->features == 0 || config->features > RIM_CHANNELS_MAX_FEATURES ||
      config->outcomes == 0 || config->outcomes > RIM_CHANNELS_MAX_OUTCOMES ||
      config->block_rows == 0 || config->kinds == 0 || config->kinds >> RIM_CHANNELS_KINDS != 0 ||
      !rim_is_finite(config->period_s) || config->period_s < 0.0 || !correct_fits(config)) {
    return false;
  }
  if (config->external) {
    return config->kinds == 1u << RIM_KIND_SHIFT && config->block_rows == 1;
  }
  if (config->outcome_feature == NULL)
    return false;
  for (size_t o = 0; o < config->outcomes; ++o) {
    if (rim_image_u16(config->outcome_feature, o) >= config->features)
      return false;
  }
  const bool one_step = has_kind(config, RIM_KIND_VARIANCE) || has_kind(config, RIM_KIND_STEP);
  return (!one_step || shape_fits(config->step, config)) &&
         (!has_kind(config, RIM_KIND_SHIFT) || shape_fits(config->level, config)) &&
         (!has_kind(config, RIM_KIND_INCREMENT) || shape_fits(config->increment, config));
}

rim_status rim_channels_init(rim_channels **instance, void *memory, size_t bytes,
                             const rim_channels_config *config) {
  if (instance == NULL || memory == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  if (!config_is_valid(config))
    return RIM_E_CONFIG;
  uint8_t present = 0;
  for (unsigned k = 0; k < RIM_CHANNELS_KINDS; ++k) {
    present = (uint8_t)(present + (config->kinds >> k & 1u));
  }
  const size_t need = RIM_CHANNELS_SIZE(config->features, config->outcomes, present);
  if (bytes < need)
    return RIM_E_SIZE;
  memset(memory, 0, need);
  rim_channels *self = memory;
  self->config = *config;
  self->kinds_present = present;
  self->channels = (uint16_t)RIM_CHANNELS_COUNT(config->outcomes, present);
  uint8_t n = 0;
  for (uint8_t k = 0; k < RIM_CHANNELS_KINDS; ++k) {
    if ((config->kinds >> k & 1u) != 0u)
      self->kind_of[n++] = k;
  }
  *instance = self;
  return RIM_OK;
}

void rim_channels_attach(rim_channels *self, const rim_channels_config *config) {
  self->config = *config;
}

static void count(uint32_t *counter) {
  if (*counter != UINT32_MAX)
    ++*counter;
}

static bool all_finite(const double *x, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    if (!rim_is_finite(x[i]))
      return false;
  }
  return true;
}

static bool row_is_finite(const rim_channels *self, double t_s, const double *context,
                          const double *outcome, const double *mean, const double *sd) {
  const size_t o = self->config.outcomes;
  if (!rim_is_finite(t_s) || !all_finite(context, self->config.features))
    return false;
  if (!self->config.external)
    return true;
  if (!all_finite(outcome, o) || !all_finite(mean, o) || !all_finite(sd, o))
    return false;
  for (size_t i = 0; i < o; ++i) {
    if (!(sd[i] > 0.0))
      return false;
  }
  return true;
}

/* mean[outcomes], predicted from this context, as the corrected model would have it. */
static void correct(const rim_channels *self, rim_kind kind, const double *context, double *mean) {
  const rim_correct *c = self->config.correct;
  if (c != NULL && (c->kinds >> (unsigned)kind & 1u) != 0)
    (void)rim_correct_mean(c, context, mean, mean);
}

static void begin_block(rim_channels *self) {
  self->rows_in_block = 0;
  self->steps_in_block = 0;
  memset(BLOCK_SUM(self), 0, self->config.features * sizeof(double));
  memset(STEP_SUM(self), 0, 2u * self->config.outcomes * sizeof(double));
  memset(REPEATS(self), 0, self->config.outcomes * sizeof(double));
}

static void gather_repeats(rim_channels *self, const double *context, bool had_previous) {
  double *previous = PREVIOUS_READING(self);
  double *repeats = REPEATS(self);
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    const double reading = context[rim_image_u16(self->config.outcome_feature, o)];
    const bool repeated = had_previous && rim_bits(reading) == rim_bits(previous[o]);
    if (repeated || !(rim_abs(reading) > 0.0))
      repeats[o] += 1.0;
    previous[o] = reading;
  }
}

static void gather_step_residuals(rim_channels *self, const double *context) {
  const double *predicted = PREDICTED(self);
  const double *sd = PREDICTED_SD(self);
  double *sum = STEP_SUM(self);
  double *squares = STEP_SQUARES(self);
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    const size_t f = rim_image_u16(self->config.outcome_feature, o);
    double r = (context[f] - predicted[o]) / sd[o];
    if (r > RIM_CHANNELS_CLIP)
      r = RIM_CHANNELS_CLIP;
    if (r < -RIM_CHANNELS_CLIP)
      r = -RIM_CHANNELS_CLIP;
    sum[o] += r;
    squares[o] += r * r;
  }
  ++self->steps_in_block;
}

static double standardise(const rim_channels *self, size_t channel, double raw) {
  const rim_channels_config *config = &self->config;
  if (config->center != NULL)
    raw -= (double)rim_image_f32(config->center, channel);
  if (config->inverse_sd != NULL)
    raw *= (double)rim_image_f32(config->inverse_sd, channel);
  return raw;
}

static void emit_step(rim_channels *self, double *raw) {
  const double n = self->steps_in_block > 0 ? (double)self->steps_in_block : 1.0;
  for (size_t o = 0; o < self->config.outcomes; ++o)
    raw[o] = STEP_SUM(self)[o] / n;
}

/* About the block's own mean, so that an offset of the run is not taken for noise; its logarithm,
 * so that a fall counts as much as a rise. */
static void emit_variance(rim_channels *self, double *raw) {
  const double n = self->steps_in_block > 1 ? (double)self->steps_in_block : 2.0;
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    const double sum = STEP_SUM(self)[o];
    const double variance = (STEP_SQUARES(self)[o] - sum * sum / n) / (n - 1.0);
    raw[o] = rim_log(rim_max(variance, RIM_CHANNELS_LEAST_VARIANCE));
  }
}

static void emit_repeats(rim_channels *self, double *raw) {
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    raw[o] = REPEATS(self)[o] / (double)self->rows_in_block;
  }
}

static void emit_level(rim_channels *self, double *raw) {
  double *mean = BLOCK_MEAN(self);
  double *sd = BLOCK_SD(self);
  const double *context = BLOCK_SUM(self);
  double extrapolation = 0.0;
  (void)rim_nominal_predict(self->config.level, context, mean, sd, &extrapolation);
  correct(self, RIM_KIND_SHIFT, context, mean);
  if (extrapolation > RIM_CHANNELS_FAR)
    count(&self->health.far);
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    const size_t f = rim_image_u16(self->config.outcome_feature, o);
    raw[o] = (context[f] - mean[o]) / sd[o];
  }
}

/* The change is driven by the commands of both blocks, so the model sees their average. */
static void emit_increment(rim_channels *self, double *raw) {
  const rim_channels_config *config = &self->config;
  double *input = SCRATCH_CONTEXT(self);
  const double *now = BLOCK_SUM(self);
  const double *before = PREVIOUS_BLOCK(self);
  for (size_t f = 0; f < config->features; ++f) {
    const bool command = config->command != NULL && rim_image_u8(config->command, f) != 0;
    input[f] = command ? 0.5 * (before[f] + now[f]) : before[f];
  }
  double *mean = BLOCK_MEAN(self);
  double *sd = INCREMENT_SD(self);
  (void)rim_nominal_predict(config->increment, input, mean, sd, NULL);
  correct(self, RIM_KIND_INCREMENT, input, mean);
  for (size_t o = 0; o < config->outcomes; ++o) {
    const size_t f = rim_image_u16(config->outcome_feature, o);
    raw[o] = (now[f] - before[f] - mean[o]) / sd[o];
  }
}

/* Returns whether values were made: the first block after a gap has no increment to judge. */
static bool finish_block(rim_channels *self) {
  double *mean = BLOCK_SUM(self);
  for (size_t f = 0; f < self->config.features; ++f)
    mean[f] /= (double)self->rows_in_block;
  const bool complete = self->has_previous_block || !has_kind(&self->config, RIM_KIND_INCREMENT);
  double *values = VALUES(self);
  for (uint8_t k = 0; complete && k < self->kinds_present; ++k) {
    double *raw = values + (size_t)k * self->config.outcomes;
    switch ((rim_kind)self->kind_of[k]) {
    case RIM_KIND_SHIFT:
      emit_level(self, raw);
      break;
    case RIM_KIND_INCREMENT:
      emit_increment(self, raw);
      break;
    case RIM_KIND_VARIANCE:
      emit_variance(self, raw);
      break;
    case RIM_KIND_STEP:
      emit_step(self, raw);
      break;
    case RIM_KIND_REPEAT:
      emit_repeats(self, raw);
      break;
    }
  }
  for (size_t c = 0; complete && c < self->channels; ++c) {
    /* One block must not decide alone. */
    values[c] = rim_clamp(standardise(self, c, values[c]), -RIM_CHANNELS_VALUE_CLIP,
                          RIM_CHANNELS_VALUE_CLIP);
  }
  memcpy(PREVIOUS_BLOCK(self), mean, self->config.features * sizeof(double));
  self->has_previous_block = true;
  return complete;
}

static int external_row(rim_channels *self, const double *context, const double *outcome,
                        const double *mean, const double *sd) {
  memcpy(BLOCK_SUM(self), context, self->config.features * sizeof(double));
  double *values = VALUES(self);
  double *expected = BLOCK_MEAN(self);
  memcpy(expected, mean, self->config.outcomes * sizeof(double));
  correct(self, RIM_KIND_SHIFT, context, expected);
  for (size_t o = 0; o < self->config.outcomes; ++o) {
    values[o] = standardise(self, o, (outcome[o] - expected[o]) / sd[o]);
    BLOCK_SD(self)[o] = sd[o];
  }
  return 1;
}

void rim_channels_reset(rim_channels *self) {
  self->has_previous_row = false;
  self->has_previous_block = false;
  memset(&self->health, 0, sizeof self->health);
  begin_block(self);
}

/* Time is strictly increasing here. A missing row voids the one-step residual that spans it; a
 * longer gap, a quarter of a block, voids the block too. */
static void note_gap(rim_channels *self, double t_s) {
  const double gap_s = t_s - self->previous_t_s;
  if (!self->has_previous_row || self->config.period_s <= 0.0)
    return;
  if (gap_s <= 1.5 * self->config.period_s)
    return;
  count(&self->health.gaps);
  self->has_previous_row = false;
  if (gap_s <= 0.25 * (double)self->config.block_rows * self->config.period_s)
    return;
  self->has_previous_block = false;
  begin_block(self);
}

int rim_channels_row(rim_channels *self, double t_s, const double *context, const double *outcome,
                     const double *mean, const double *sd) {
  if (self == NULL || context == NULL)
    return RIM_E_ARGUMENT;
  if (self->config.external && (outcome == NULL || mean == NULL || sd == NULL)) {
    return RIM_E_ARGUMENT;
  }
  count(&self->health.rows);
  if (!row_is_finite(self, t_s, context, outcome, mean, sd)) {
    count(&self->health.not_finite);
    return RIM_E_DATA;
  }
  if (self->health.rows_used > 0 && !(t_s > self->previous_t_s)) {
    count(&self->health.time_back);
    return RIM_E_DATA;
  }
  note_gap(self, t_s);
  count(&self->health.rows_used);
  if (self->rows_in_block == self->config.block_rows)
    begin_block(self);
  if (self->rows_in_block == 0)
    self->block_start_s = t_s;
  ++self->rows_in_block;
  const bool had_previous = self->has_previous_row;
  self->previous_t_s = t_s;
  self->has_previous_row = true;
  if (self->config.external)
    return external_row(self, context, outcome, mean, sd);

  double *sum = BLOCK_SUM(self);
  for (size_t f = 0; f < self->config.features; ++f)
    sum[f] += context[f];
  if (has_kind(&self->config, RIM_KIND_REPEAT))
    gather_repeats(self, context, had_previous);
  if (self->config.step != NULL) {
    if (had_previous)
      gather_step_residuals(self, context);
    (void)rim_nominal_predict(self->config.step, context, PREDICTED(self), PREDICTED_SD(self),
                              NULL);
    correct(self, RIM_KIND_STEP, context, PREDICTED(self));
  }
  if (self->rows_in_block < self->config.block_rows)
    return 0;
  return finish_block(self) ? 1 : 0;
}

const double *rim_channels_values(const rim_channels *self) { return VALUES(self); }
const double *rim_channels_context(const rim_channels *self) { return BLOCK_SUM(self); }
double rim_channels_block_start_s(const rim_channels *self) { return self->block_start_s; }
const rim_channels_health *rim_channels_get_health(const rim_channels *self) {
  return &self->health;
}
uint16_t rim_channels_count(const rim_channels *self) { return self->channels; }
rim_kind rim_channels_kind(const rim_channels *self, uint16_t channel) {
  return channel < self->channels ? (rim_kind)self->kind_of[channel / self->config.outcomes]
                                  : RIM_KIND_SHIFT;
}
uint16_t rim_channels_outcome(const rim_channels *self, uint16_t channel) {
  return (uint16_t)(channel % self->config.outcomes);
}

double rim_channels_unit(const rim_channels *self, uint16_t channel) {
  const uint16_t o = rim_channels_outcome(self, channel);
  double unit = 1.0;
  if (self->config.inverse_sd != NULL) {
    unit /= (double)rim_image_f32(self->config.inverse_sd, channel);
  }
  switch (rim_channels_kind(self, channel)) {
  case RIM_KIND_SHIFT:
    return unit * BLOCK_SD(self)[o];
  case RIM_KIND_INCREMENT:
    return unit * INCREMENT_SD(self)[o];
  case RIM_KIND_STEP:
    return unit * PREDICTED_SD(self)[o];
  case RIM_KIND_REPEAT:
    break;
  case RIM_KIND_VARIANCE:
    break; /* the logarithm of a ratio */
  }
  return unit;
}
