/* One row: checked, gathered, predicted, searched, judged. */
#include <string.h>

#include "monitor_private.h"
#include "rim/real.h"

void monitor_clear_verdict(rim_monitor *m) {
  memset(&m->last, 0, sizeof m->last);
  m->last.level = RIM_LEVEL_OK;
  m->last.reason = RIM_REASON_TOO_FEW;
  m->last.p_value = 1.0;
  m->last.out_feature = BLOCKS_NO_FEATURE;
  m->last.threshold = rim_threshold_ln_anom(&m->models.threshold, 0, 0);
  m->out_feature = BLOCKS_NO_FEATURE;
  m->out_value = m->out_t_s = 0.0;
}

static void count(uint32_t *counter) {
  if (*counter != UINT32_MAX)
    ++*counter;
}

/* ---- a trained image: residuals of a block ---- */

static void correct(const rim_monitor *m, const double *context, double *mean) {
  const rim_correct *c = &m->models.correct;
  if (c->section != NULL && (c->kinds >> RIM_KIND_SHIFT & 1u) != 0)
    (void)rim_correct_mean(c, context, mean, mean);
}

/* Predictions and the residuals of the kinds BEHAVIOUR, SCATTER and REPEAT. */
static void predict(rim_monitor *m) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const double *measured = blocks_outcomes(m->rows);
  double *scatter = m->residual + RIM_CHANNEL_SCATTER * outcomes;
  const bool external = m->words[RIM_CONFIG_EXTERNAL] != 0;
  if (external) {
    memcpy(m->predicted, blocks_predicted(m->rows), 8u * outcomes);
    memset(m->predicted + outcomes, 0, 8u * outcomes);
  } else {
    rim_behaviour_predict(&m->models.behaviour, blocks_terms(m->rows), blocks_first(m->rows),
                          m->predicted);
    correct(m, blocks_context(m->rows), m->predicted);
  }
  for (size_t o = 0; o < outcomes; ++o) {
    m->residual[o] = external ? measured[o] : measured[o] - m->predicted[o];
    scatter[o] = blocks_scatter(m->rows)[o] - m->predicted[outcomes + o];
    m->residual[RIM_CHANNEL_REPEAT * outcomes + o] = blocks_repeats(m->rows)[o];
  }
}

static void agree(rim_monitor *m) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const double *level = NULL;
  if (m->models.level.section != NULL &&
      rim_nominal_predict(&m->models.level, blocks_context(m->rows), m->level, m->level + outcomes,
                          NULL) == RIM_OK)
    level = m->level;
  rim_agreement_evaluate(&m->models.agreement, m->residual, blocks_means(m->rows),
                         blocks_outcomes(m->rows), level, m->before,
                         m->residual + RIM_CHANNEL_AGREEMENT * outcomes);
}

/* The region features as bytes of their trained range. */
static void find_place(rim_monitor *m) {
  const double *context = blocks_context(m->rows);
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = rim_image_u16(m->region, 2 * i), o = rim_image_u16(m->region, 2 * i + 1);
    const double x = o == MONITOR_NO_OUTCOME ? context[f] : m->predicted[o];
    const double byte = 256.0 * (x - monitor_low(m, f)) / monitor_width(m, f);
    m->place[i] = (uint8_t)rim_clamp(rim_floor(byte), 0.0, 255.0);
  }
  m->has_place = true;
}

static bool observe_trained(rim_monitor *m) {
  if (m->words[RIM_CONFIG_EXTERNAL] == 0 && !blocks_has_first(m->rows))
    return false; /* models may need the run's first readings */
  predict(m);
  agree(m);
  find_place(m);
  const search_block block = {.t_s = blocks_since_start_s(m->rows),
                              .feature = m->place,
                              .mean = blocks_means(m->rows),
                              .predicted = m->predicted,
                              .residual = m->residual,
                              .change = blocks_change(m->rows)};
  if (search_observe(m->search, &block) == RIM_OK)
    return true;
  count(&m->refused);
  return false;
}

/* ---- independent rows with the caller's predictions ---- */

static bool observe_rows(rim_monitor *m) {
  const double *context = blocks_context(m->rows);
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = rim_image_u16(m->region, 2 * i);
    m->unit[i] = (context[f] - monitor_low(m, f)) / monitor_width(m, f);
  }
  double *r = m->unit + m->words[RIM_CONFIG_REGION_FEATURES];
  for (size_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o)
    r[o] = rim_clamp(blocks_outcomes(m->rows)[o], -8.0, 8.0);
  if (rim_select_observe(m->select, m->unit, r) == RIM_OK)
    return true;
  count(&m->refused);
  return false;
}

/* ---- judgement ---- */

static void judge_trained(rim_monitor *m, rim_verdict *v) {
  const search_hypothesis *best = NULL;
  for (uint16_t c = 0; c < m->channel_count; ++c) {
    const search_hypothesis *h = search_best(m->search, c);
    if (best == NULL || h->score > best->score) {
      best = h;
      v->channel = c;
    }
  }
  v->blocks = search_blocks(m->search);
  if (best == NULL || best->score < -1e9f)
    return;
  const noise_channel n = rim_noise_channel(&m->models.noise, v->channel);
  v->score = (double)best->score;
  v->ln_anom = (double)best->ln_ratio;
  v->threshold = (m->models.threshold.alarm_score +
                  search_description((search_family)best->family)) *
                 (double)rim_image_f32(n.phi, best->family);
}

static void judge_rows(rim_monitor *m, rim_verdict *v) {
  const float *scores = rim_select_channel_scores(m->select);
  const rim_threshold *t = &m->models.threshold;
  v->blocks = rim_select_observations(m->select);
  for (uint16_t c = 0; c < m->channel_count; ++c) {
    const double score = rim_threshold_score(t, c, (double)scores[c], v->blocks);
    if (c > 0 && !(score > v->score))
      continue;
    v->score = score;
    v->channel = c;
  }
  v->ln_anom = (double)scores[v->channel];
  v->threshold = rim_threshold_ln_anom(t, v->channel, v->blocks);
}

static void judge(rim_monitor *m, rim_verdict *v) {
  const rim_threshold *t = &m->models.threshold;
  if (m->is_trained)
    judge_trained(m, v);
  else
    judge_rows(m, v);
  v->p_value = rim_threshold_p_value(t, v->score);
  v->level = v->score >= t->alarm_score  ? RIM_LEVEL_ERROR
             : v->score >= t->warn_score ? RIM_LEVEL_WARN
                                         : RIM_LEVEL_OK;
}

static void publish(rim_monitor *m, const rim_alarm *record) {
  m->last.alarm = *record;
  if (record->state == RIM_ALARM_RAISED)
    count(&m->alarms);
}

static void search_and_judge(rim_monitor *m, bool new_block) {
  const uint32_t budget = m->words[RIM_CONFIG_BUDGET] != 0 ? m->words[RIM_CONFIG_BUDGET] : 1;
  if (m->is_trained)
    search_work(m->search, budget);
  else
    rim_select_work(m->select, budget);
  if ((m->is_trained ? search_blocks(m->search) : rim_select_observations(m->select)) == 0)
    return;
  judge(m, &m->last);
  /* An alarm is raised at the threshold and stands until the score is below the warning score. */
  if (m->life.active && m->last.level == RIM_LEVEL_WARN)
    m->last.level = RIM_LEVEL_ERROR;
  if (!new_block)
    return;
  const bool found = m->last.level == RIM_LEVEL_ERROR;
  rim_alarm candidate, record;
  if (found)
    monitor_describe(m, &m->last, &candidate);
  if (rim_alarm_life_step(&m->life, m->last.t_s, found ? &candidate : NULL, &record))
    publish(m, &record);
}

/* A record of the regions in the same row goes first: seq counts in the order in which they leave.
 */
static void watch_motion(rim_monitor *m, const rim_observation *row) {
  rim_alarm record;
  if (rim_interference_watch_step(m->watch, row, m->last.alarm.state == RIM_ALARM_NONE,
                                  &m->life.seq, &m->last.interference, &record))
    publish(m, &record);
}

static bool take_block(rim_monitor *m) {
  if (!(m->is_trained ? observe_trained(m) : observe_rows(m)))
    return false;
  m->last_block_s = m->last.t_s;
  if ((m->is_trained ? search_blocks(m->search) : rim_select_observations(m->select)) == 1)
    m->first_block_s = m->last.t_s;
  if (m->is_trained)
    m->run_start_s = blocks_run_start_s(m->rows);
  return true;
}

/* What keeps the level from being about the vehicle, the gravest first. */
static void give_reason(rim_monitor *m, rim_verdict *v) {
  double value;
  const uint16_t feature = blocks_out_of_range(m->rows, &value);
  v->reason = RIM_REASON_NONE;
  v->out_feature = BLOCKS_NO_FEATURE;
  if (v->valid && feature != BLOCKS_NO_FEATURE) {
    v->reason = RIM_REASON_OUT_OF_RANGE;
    v->out_feature = feature;
    v->out_value = value;
    if (m->out_feature == BLOCKS_NO_FEATURE) {
      m->out_feature = feature;
      m->out_value = value;
      m->out_t_s = v->t_s;
    }
    if (v->level < RIM_LEVEL_ERROR)
      v->level = RIM_LEVEL_OUT_OF_RANGE;
  }
  if (m->is_stale)
    v->reason = RIM_REASON_SILENT;
  else if (blocks_rate_is_wrong(m->rows))
    v->reason = RIM_REASON_RATE;
  else if (v->reason == RIM_REASON_NONE && m->is_trained && v->blocks < RIM_MONITOR_LEAST_BLOCKS)
    v->reason = RIM_REASON_TOO_FEW;
  if ((v->reason == RIM_REASON_SILENT || v->reason == RIM_REASON_RATE) &&
      v->level != RIM_LEVEL_ERROR)
    v->level = RIM_LEVEL_STALE;
}

/* Input older than the limit: the level says so; what was found before stays found. */
static void note_staleness(rim_monitor *m, double t_s) {
  const uint32_t limit_ms = m->words[RIM_CONFIG_STALE_MS];
  if (limit_ms == 0 || !m->has_valid || !rim_is_finite(t_s))
    return;
  const bool stale = t_s - m->last_valid_s > 1e-3 * (double)limit_ms;
  if (stale && !m->is_stale)
    count(&m->stale);
  m->is_stale = stale;
}

rim_status rim_monitor_step(rim_monitor *m, const rim_observation *row, rim_verdict *verdict) {
  if (m == NULL || row == NULL || row->context == NULL || verdict == NULL)
    return RIM_E_ARGUMENT;
  const bool external = m->words[RIM_CONFIG_EXTERNAL] != 0;
  if (external && (row->outcome == NULL || row->mean == NULL || row->sd == NULL))
    return RIM_E_ARGUMENT;
  const blocks_result made =
      blocks_row(m->rows, row->t_s, row->context, row->outcome, row->mean, row->sd);
  count(&m->steps);
  m->last.alarm.state = RIM_ALARM_NONE;
  m->last.step = m->steps;
  m->last.t_s = row->t_s;
  m->last.valid = made != BLOCKS_BAD;
  m->last.interference.valid = false;
  if (made != BLOCKS_BAD) {
    m->has_valid = true;
    m->is_stale = false;
    m->last_valid_s = row->t_s;
    search_and_judge(m, made == BLOCKS_DONE && take_block(m));
    if (m->watch != NULL)
      watch_motion(m, row);
  } else {
    note_staleness(m, row->t_s);
  }
  *verdict = m->last;
  if (m->watch != NULL && m->watch->life.active)
    verdict->level = RIM_LEVEL_ERROR;
  give_reason(m, verdict);
  return RIM_OK;
}

/* ---- what can be asked ---- */

double rim_monitor_membership(const rim_monitor *m, const double *context) {
  if (m == NULL || context == NULL || !m->life.active || m->is_trained)
    return 0.0;
  double unit[RIM_MONITOR_MAX_FEATURES];
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = rim_image_u16(m->region, 2 * i);
    unit[i] = (context[f] - monitor_low(m, f)) / monitor_width(m, f);
  }
  return rim_select_membership(m->select, unit);
}

const uint8_t *rim_monitor_place(const rim_monitor *m) {
  return m != NULL && m->has_place ? m->place : NULL;
}

bool rim_monitor_inside(const rim_monitor *m, const uint8_t *place, uint32_t block) {
  return m != NULL && place != NULL && m->has_explained && m->is_trained &&
         search_inside(m->search, &m->explained, place, block);
}

rim_monitor_health rim_monitor_get_health(const rim_monitor *m) {
  const blocks_health rows = blocks_get_health(m->rows);
  rim_monitor_health health = {.rows = {.rows = rows.rows,
                                        .rows_used = rows.rows_used,
                                        .not_finite = rows.not_finite,
                                        .time_back = rows.time_back,
                                        .gaps = rows.gaps,
                                        .out_of_range = rows.out_of_range,
                                        .wrong_rate = rows.wrong_rate,
                                        .refused = m->refused},
                               .blocks = m->last.blocks,
                               .alarms = m->alarms,
                               .stale = m->stale,
                               .last_valid_s = m->last_valid_s,
                               .period_s = blocks_period_s(m->rows),
                               .out_feature = m->out_feature,
                               .out_value = m->out_value,
                               .out_t_s = m->out_t_s};
  if (m->watch != NULL)
    health.interference = m->watch->state.health;
  return health;
}

const rim_select *rim_monitor_search(const rim_monitor *m) { return m->select; }
const rim_threshold *rim_monitor_threshold(const rim_monitor *m) { return &m->models.threshold; }
uint32_t rim_monitor_config(const rim_monitor *m, rim_config_word word) {
  return (unsigned)word < RIM_CONFIG_WORDS ? m->words[word] : 0u;
}
