/* SPDX-License-Identifier: MIT */
/* One row: checked, gathered, predicted, searched, judged. */
#include <string.h>

#include "base/bytes.h"
#include "base/real.h"
#include "base/usable.h"
#include "monitor/monitor_private.h"

void rimi_monitor_clear_verdict(rim_monitor *m) {
  memset(&m->last, 0, sizeof m->last);
  memset(&m->motion, 0, sizeof m->motion);
  m->last.level = RIM_LEVEL_OK;
  m->last.reason = RIM_REASON_TOO_FEW;
  m->last.p_value = 1.0;
  m->last.out_feature = BLOCKS_NO_FEATURE;
  m->last.threshold = rimi_threshold_ln_anom(&m->models.threshold, 0, 0);
  m->out_feature = BLOCKS_NO_FEATURE;
  m->out_value = m->out_t_s = 0.0;
}

/* ---- a trained image: residuals of a block ---- */

static bool is_corrected(const rim_monitor *m) {
  const rim_correct *c = &m->models.correct;
  return c->section != NULL && (c->kinds >> RIM_KIND_SHIFT & 1u) != 0;
}

static void correct(const rim_monitor *m, const double *context, double *mean) {
  if (is_corrected(m))
    (void)rimi_correct_mean(&m->models.correct, context, mean, mean);
}

/* A vane that turns through north, or a course while nothing moves, gains a whole turn that no
 * model knows of: an angle is as far off as the shorter way round. */
static void wrap_angles(const rim_monitor *m, double *residual) {
  const uint8_t *role = rimi_blocks_roles(m->rows);
  for (uint32_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o) {
    const uint16_t f = rimi_blocks_outcome_feature(m->rows, o);
    if (f != BLOCKS_NO_FEATURE)
      residual[o] = rimi_blocks_wrapped(residual[o], role[f]);
  }
}

/* Predictions and the residuals of the kinds BEHAVIOUR, SCATTER and REPEAT. */
static void predict(rim_monitor *m) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const double *measured = rimi_blocks_outcomes(m->rows);
  double *scatter = m->residual + RIM_CHANNEL_SCATTER * outcomes;
  const bool external = m->words[RIM_CONFIG_EXTERNAL] != 0;
  if (external) {
    memcpy(m->predicted, rimi_blocks_predicted(m->rows), 8u * outcomes);
    memset(m->predicted + outcomes, 0, 8u * outcomes);
  } else {
    rimi_behaviour_predict(&m->models.behaviour, rimi_blocks_terms(m->rows),
                           rimi_blocks_first(m->rows), m->predicted);
    correct(m, rimi_blocks_context(m->rows), m->predicted);
  }
  for (size_t o = 0; o < outcomes; ++o) {
    m->residual[o] = external ? measured[o] : measured[o] - m->predicted[o];
    scatter[o] = rimi_blocks_scatter(m->rows)[o] - m->predicted[outcomes + o];
    m->residual[RIM_CHANNEL_REPEAT * outcomes + o] = rimi_blocks_repeats(m->rows)[o];
  }
  wrap_angles(m, m->residual);
}

/* What sections LEVEL and QUADRATIC see of the block; false: the image has neither. */
static bool level_inputs(const rim_monitor *m, double input[RIM_NOMINAL_MAX_INPUTS]) {
  if (m->models.level.section == NULL && m->models.quadratic.section == NULL)
    return false;
  (void)rimi_level_inputs(rimi_blocks_roles(m->rows), m->words[RIM_CONFIG_FEATURES],
                          rimi_blocks_context(m->rows), input);
  return true;
}

/* Residuals of the kind AGREEMENT; m->predicted says from here on what behaviour and agreement
 * expect. Returns whether the block lies beyond what section LEVEL was trained on. */
static bool agree(rim_monitor *m, bool is_next) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const double *level = NULL, *quadratic = NULL;
  double extrapolation = 0.0, input[RIM_NOMINAL_MAX_INPUTS];
  const bool has_inputs = level_inputs(m, input);
  if (has_inputs && rimi_nominal_predict(&m->models.level, input, m->level, m->level + outcomes,
                                         &extrapolation) == RIM_OK)
    level = m->level;
  if (has_inputs && m->models.quadratic.section != NULL) {
    quadratic = m->level + outcomes; /* in place of the deviations, which nobody reads */
    rimi_quadratic_take(&m->models.quadratic, input, is_next, monitor_quadratic_state(m));
    rimi_quadratic_predict(&m->models.quadratic, RIM_QUADRATIC_AGREES, monitor_quadratic_state(m),
                           m->level + outcomes);
  }
  const agreement_block block = {.residual = m->residual,
                                 .mean = rimi_blocks_means(m->rows),
                                 .measured = rimi_blocks_outcomes(m->rows),
                                 .predicted = m->predicted,
                                 .early = rimi_blocks_early(m->rows),
                                 .late = rimi_blocks_late(m->rows),
                                 .level = level,
                                 .quadratic = quadratic,
                                 .follows = is_next};
  rimi_agreement_evaluate(&m->models.agreement, &block, m->agreement_state,
                          m->residual + RIM_CHANNEL_AGREEMENT * outcomes, m->predicted + outcomes);
  wrap_angles(m, m->residual + RIM_CHANNEL_AGREEMENT * outcomes);
  return extrapolation > RIM_NOMINAL_BELIEVED;
}

/* Residuals of the kind STEP. An outcome without a model of its step has no such channel. */
static void step(rim_monitor *m) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const double *measured = rimi_blocks_outcomes(m->rows);
  double *residual = m->residual + RIM_CHANNEL_STEP * outcomes;
  if (!monitor_has_steps(m))
    return;
  memcpy(residual, measured, 8u * outcomes);
  rimi_quadratic_predict(&m->models.quadratic, RIM_QUADRATIC_STEPS, monitor_quadratic_state(m),
                         residual);
  for (size_t o = 0; o < outcomes; ++o)
    residual[o] = measured[o] - residual[o];
}

/* The region features as bytes of their trained range. */
static void find_place(rim_monitor *m) {
  const double *context = rimi_blocks_context(m->rows);
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = monitor_region(m, i), o = rimi_le_u16(m->region, 2 * i + 1);
    const double x = o < m->words[RIM_CONFIG_OUTCOMES] ? m->predicted[o] : context[f];
    const double byte = 256.0 * (x - monitor_low(m, f)) / monitor_width(m, f);
    m->place[i] = (uint8_t)rimi_clamp(rimi_floor(byte), 0.0, 255.0);
  }
  m->has_place = true;
}

/* Whether the block says where an outcome lies, of those of which anything can be said. */
static bool says_something(const rim_monitor *m) {
  static const uint8_t kinds[] = {RIM_CHANNEL_BEHAVIOUR, RIM_CHANNEL_AGREEMENT, RIM_CHANNEL_STEP};
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  bool is_any_watched = false;
  for (size_t k = 0; k < sizeof kinds; ++k) {
    for (uint32_t c = kinds[k] * outcomes; c < (kinds[k] + 1u) * outcomes; ++c) {
      if (c >= m->channel_count || !(rimi_noise_channel(&m->models.noise, c).active > 0.5f))
        continue;
      if (!m->unknown[c])
        return true;
      is_any_watched = true;
    }
  }
  return !is_any_watched;
}

static bool observe_trained(rim_monitor *m) {
  if (m->words[RIM_CONFIG_EXTERNAL] == 0 && !rimi_blocks_has_first(m->rows))
    return false; /* models may need the run's first readings */
  predict(m);
  const bool is_next = m->has_place && rimi_blocks_adjoins(m->rows);
  const bool is_beyond = agree(m, is_next);
  step(m);
  const double disturbance = /* m->level: agree() is done with it */
      rimi_agreement_disturbance(&m->models.agreement, m->residual, m->level);
  const bool partly = rimi_monitor_find_unknown(m, is_beyond, is_next);
  find_place(m);
  const search_block block = {.t_s = rimi_blocks_since_start_s(m->rows),
                              .feature = m->place,
                              .mean = rimi_blocks_means(m->rows),
                              .predicted = m->predicted,
                              .residual = m->residual,
                              .unknown = m->unknown,
                              .disturbance = disturbance,
                              .apart = !is_next};
  if (m->has_explained && rim_monitor_standing(m, RIM_DETECTOR_RIM) != NULL)
    rimi_search_let_go(m->search, &m->explained);
  if (rimi_search_observe(m->search, &block) == RIM_OK) {
    if (partly)
      count(&m->partly);
    m->unseen = says_something(m) ? 0u : m->unseen + 1u;
    return true;
  }
  count(&m->refused);
  return false;
}

/* ---- independent rows with the caller's predictions ---- */

/* The caller's prediction as it is corrected, in memory that is used again when the block ends. */
static const double *expected_by_caller(const rim_monitor *m, const rim_observation *row) {
  double *mean = m->is_trained ? m->predicted : m->unit + m->words[RIM_CONFIG_REGION_FEATURES];
  return is_corrected(m) &&
                 rimi_correct_mean(&m->models.correct, row->context, row->mean, mean) == RIM_OK
             ? mean
             : row->mean;
}

static bool observe_rows(rim_monitor *m) {
  const double *context = rimi_blocks_context(m->rows);
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = monitor_region(m, i);
    m->unit[i] = (context[f] - monitor_low(m, f)) / monitor_width(m, f);
  }
  double *r = m->unit + m->words[RIM_CONFIG_REGION_FEATURES];
  for (size_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o)
    r[o] = rimi_clamp(rimi_blocks_outcomes(m->rows)[o] * monitor_scale(m, o), -8.0, 8.0);
  if (rimi_select_observe(m->select, m->unit, r) == RIM_OK)
    return true;
  count(&m->refused);
  return false;
}

/* ---- judgement ---- */

/* A step follows from all readings of the block before, so that one wrong sensor disturbs the steps
 * of several outcomes: they lead only where nothing else reaches an alarm, or raised the one that
 * stands. */
static void judge_trained(rim_monitor *m, rim_verdict *v) {
  const uint16_t others = (uint16_t)(RIM_MONITOR_KINDS * m->words[RIM_CONFIG_OUTCOMES]);
  const bool is_others =
      rim_monitor_standing(m, RIM_DETECTOR_RIM) != NULL && m->explained_channel < others;
  const search_hypothesis *best = NULL;
  for (uint16_t c = 0; c < m->channel_count; ++c) {
    const search_hypothesis *h = rimi_search_best(m->search, c);
    if (c == others && (is_others || (double)best->score >= m->models.threshold.alarm_score))
      break;
    if (best == NULL || h->score > best->score) {
      best = h;
      v->channel = c;
    }
  }
  v->blocks = rimi_search_blocks(m->search);
  v->score = v->ln_anom = 0.0;
  if (best == NULL || best->score < -1e9f)
    return;
  const noise_channel n = rimi_noise_channel(&m->models.noise, v->channel);
  v->score = (double)best->score;
  v->ln_anom = (double)best->ln_ratio;
  v->threshold =
      (m->models.threshold.alarm_score + rimi_search_description((search_family)best->family)) *
      rimi_search_inflation(&n, best);
}

static void judge_rows(rim_monitor *m, rim_verdict *v) {
  const float *scores = rimi_select_channel_scores(m->select);
  const rim_threshold *t = &m->models.threshold;
  v->blocks = rimi_select_observations(m->select);
  for (uint16_t c = 0; c < m->channel_count; ++c) {
    const double score = rimi_threshold_score(t, c, (double)scores[c], v->blocks);
    if (c > 0 && !(score > v->score))
      continue;
    v->score = score;
    v->channel = c;
  }
  v->ln_anom = (double)scores[v->channel];
  v->threshold = rimi_threshold_ln_anom(t, v->channel, v->blocks);
}

static void judge(rim_monitor *m, rim_verdict *v) {
  const rim_threshold *t = &m->models.threshold;
  if (m->is_trained)
    judge_trained(m, v);
  else
    judge_rows(m, v);
  v->p_value = rimi_threshold_p_value(t, v->score);
  v->level = v->score >= t->alarm_score  ? RIM_LEVEL_ERROR
             : v->score >= t->warn_score ? RIM_LEVEL_WARN
                                         : RIM_LEVEL_OK;
}

/* A deviation that ended was reported with its end. From now on it is no evidence, so that the
 * alarm clears and the next one is found. */
static void end_deviation(rim_monitor *m) {
  const search_hypothesis *h = &m->explained;
  if (!m->is_trained || rim_monitor_standing(m, RIM_DETECTOR_RIM) == NULL ||
      h->family != SEARCH_DURING || rimi_search_blocks(m->search) - h->end < MONITOR_OVER_BLOCKS)
    return;
  const double quiet_s = rimi_search_time_of(m->search, rimi_search_blocks(m->search)) -
                         rimi_search_time_of(m->search, h->end);
  if (quiet_s < MONITOR_OVER_RUN * m->models.noise.run_s ||
      !rimi_search_exclude(m->search, h->onset, h->end))
    return;
  m->ended_first = h->onset;
  m->ended_end = h->end;
  count(&m->ended_count);
  (void)rimi_alarm_life_over(&m->life, RIM_DETECTOR_RIM, m->last.t_s);
}

static void work(rim_monitor *m) {
  const uint32_t budget = m->words[RIM_CONFIG_BUDGET] != 0 ? m->words[RIM_CONFIG_BUDGET] : 1;
  if (!m->is_trained) {
    rimi_select_work(m->select, budget);
    return;
  }
  const bool changes_ring = rimi_search_is_taking_out(m->search);
  rimi_search_work(m->search, budget);
  if (changes_ring)
    rimi_guard_renew(m);
}

static void search_and_judge(rim_monitor *m, bool new_block) {
  work(m);
  if ((m->is_trained ? rimi_search_blocks(m->search) : rimi_select_observations(m->select)) == 0)
    return;
  judge(m, &m->last);
  if (!new_block)
    return;
  rim_alarm candidate = {.level = m->last.level};
  if (rimi_alarm_life_would_raise(&m->life, RIM_DETECTOR_RIM, &candidate) && !rimi_guard_all(m))
    return;
  if (candidate.level == RIM_LEVEL_ERROR ||
      (candidate.level == RIM_LEVEL_WARN && rim_monitor_standing(m, RIM_DETECTOR_RIM) != NULL))
    rimi_monitor_describe(m, &m->last, &candidate);
  rimi_alarm_life_step(&m->life, RIM_DETECTOR_RIM, m->last.t_s, &candidate);
  if (candidate.level == RIM_LEVEL_ERROR)
    end_deviation(m);
}

static void watch_motion(rim_monitor *m, const rim_observation *row) {
  rim_alarm candidate;
  const bool found = rimi_interference_watch_step(m->watch, row, &m->motion, &candidate);
  if (m->motion.valid)
    rimi_alarm_life_step(&m->life, RIM_DETECTOR_INTERFERENCE, row->t_s, found ? &candidate : NULL);
}

/* Observation n - 1 came now: was there a gap before it? */
static void note_gap(rim_monitor *m, uint32_t n) {
  const monitor_gap *last = m->gaps > 0 ? &m->gap[m->gaps - 1] : NULL;
  const uint32_t since = last != NULL ? n - 1u - last->index : n - 1u; /* rows since the last gap */
  const double begin_s = last != NULL ? last->after_s : m->first_block_s;
  if (since < 2 || m->last.t_s - m->last_block_s <=
                       MONITOR_GAP * (m->last_block_s - begin_s) / (double)(since - 1u))
    return;
  if (m->gaps == MONITOR_GAPS)
    memmove(&m->gap[0], &m->gap[1], sizeof m->gap - sizeof m->gap[0]);
  else
    ++m->gaps;
  m->gap[m->gaps - 1] = (monitor_gap){m->last_block_s, m->last.t_s, n - 1u};
}

static bool take_block(rim_monitor *m) {
  if (!rimi_guard_before_block(m))
    return false;
  const bool taken = m->is_trained ? observe_trained(m) : observe_rows(m);
  rimi_guard_after_block(m);
  if (!taken)
    return false;
  const uint32_t n =
      m->is_trained ? rimi_search_blocks(m->search) : rimi_select_observations(m->select);
  if (n == 1) {
    m->first_block_s = m->last.t_s;
    m->gaps = 0;
  } else if (!m->is_trained) {
    note_gap(m, n);
  }
  m->last_block_s = m->last.t_s;
  if (m->is_trained)
    m->run_start_s = rimi_blocks_run_start_s(m->rows);
  return true;
}

/* What keeps the level from being about the vehicle, the gravest first. */
static void give_reason(rim_monitor *m, rim_verdict *v) {
  double value;
  const uint16_t feature = rimi_blocks_out_of_range(m->rows, &value);
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
  if (v->level == RIM_LEVEL_STALE)
    v->reason = RIM_REASON_SILENT;
  else if (rimi_blocks_rate_is_wrong(m->rows))
    v->reason = RIM_REASON_RATE;
  else if (v->reason == RIM_REASON_NONE && m->is_trained &&
           v->blocks < RIM_MONITOR_LEAST_BLOCKS + m->partly)
    v->reason = RIM_REASON_TOO_FEW;
  const bool is_blind = m->unseen >= RIM_MONITOR_LEAST_BLOCKS; /* what it said before grows old */
  if (v->reason == RIM_REASON_NONE && is_blind)
    v->reason = RIM_REASON_TOO_FEW;
  const bool is_unseen = v->reason == RIM_REASON_TOO_FEW && is_blind;
  if ((v->reason == RIM_REASON_RATE || is_unseen) && v->level != RIM_LEVEL_ERROR)
    v->level = RIM_LEVEL_STALE;
}

/* At most one record per row; the others wait, and the level is that of the whole. */
static void end_verdict(rim_monitor *m, rim_verdict *verdict) {
  (void)rimi_alarm_life_next_record(&m->life, &m->last.alarm);
  m->last.level = (uint8_t)rimi_alarm_life_level(&m->life);
  give_reason(m, &m->last);
  *verdict = m->last;
  verdict->interference = m->motion.valid ? &m->motion : NULL;
}

/* Nothing is known, and nothing in memory is to be believed. */
static void say_damaged(const rim_observation *row, rim_verdict *verdict) {
  memset(verdict, 0, sizeof *verdict);
  verdict->t_s = row->t_s;
  verdict->p_value = 1.0;
  verdict->out_feature = BLOCKS_NO_FEATURE;
  verdict->level = RIM_LEVEL_INTEGRITY;
  verdict->reason = RIM_REASON_INTEGRITY;
}

static void take_row(rim_monitor *m, const rim_observation *row, rim_verdict *verdict) {
  const bool external = m->words[RIM_CONFIG_EXTERNAL] != 0;
  const double *mean = external ? expected_by_caller(m, row) : NULL;
  const blocks_result made =
      rimi_blocks_row(m->rows, row->t_s, row->context, row->outcome, mean, row->sd);
  count(&m->steps);
  m->last.alarm.state = RIM_ALARM_NONE;
  m->last.alarm.seq = 0;
  m->last.step = m->steps;
  m->last.t_s = row->t_s;
  m->last.valid = made != BLOCKS_BAD;
  m->motion.valid = false;
  if (made != BLOCKS_BAD) {
    m->last_valid_s = row->t_s;
    rimi_alarm_life_row(&m->life, row->t_s);
    search_and_judge(m, made == BLOCKS_DONE && take_block(m));
    if (m->watch != NULL)
      watch_motion(m, row);
  } else {
    (void)rimi_alarm_life_idle(&m->life, row->t_s);
  }
  if (m->guard.damaged == 0) /* found in this row too: its record is not sent */
    end_verdict(m, verdict);
}

rim_status rim_monitor_step(rim_monitor *m, const rim_observation *row, rim_verdict *verdict) {
  if (m == NULL || row == NULL || row->context == NULL || verdict == NULL)
    return RIM_E_ARGUMENT;
  const bool holds = rimi_guard_enter(m) && rimi_guard_scrub(m);
  if (holds && m->words[RIM_CONFIG_EXTERNAL] != 0 &&
      (row->outcome == NULL || row->mean == NULL || row->sd == NULL)) {
    rimi_guard_leave(m);
    return RIM_E_ARGUMENT;
  }
  if (holds)
    take_row(m, row, verdict);
  if (m->guard.damaged != 0)
    say_damaged(row, verdict);
  rimi_guard_leave(m);
  return RIM_OK;
}

/* ---- the alarms' life ---- */

rim_status rim_monitor_set_policy(rim_monitor *m, const rim_alarm_policy *policy) {
  if (m == NULL || policy == NULL)
    return RIM_E_ARGUMENT;
  if (!rimi_guard_enter_header(m))
    return RIM_E_CRC;
  const rim_status status = rimi_alarm_life_set_policy(&m->life, policy);
  rimi_guard_leave_header(m);
  return status;
}

bool rim_monitor_idle(rim_monitor *m, double now_s) {
  if (m == NULL || !rimi_guard_enter_header(m))
    return false;
  const bool stale = rimi_alarm_life_idle(&m->life, now_s);
  rimi_guard_leave_header(m);
  return stale;
}

rim_status rim_monitor_command(rim_monitor *m, const rim_command *command, unsigned bits) {
  uint32_t forget = 0;
  if (m == NULL || command == NULL)
    return RIM_E_ARGUMENT;
  if (!rimi_guard_enter(m))
    return RIM_E_CRC;
  const rim_status status = rimi_alarm_life_command(&m->life, command, bits, &forget);
  if ((forget >> RIM_DETECTOR_RIM & 1u) != 0)
    rimi_monitor_forget_regions(m);
  if ((forget >> RIM_DETECTOR_INTERFERENCE & 1u) != 0)
    rimi_interference_watch_reset(m->watch);
  rimi_guard_leave(m);
  return status;
}

void rim_monitor_restart(rim_monitor *m, double now_s) {
  if (m == NULL || !rimi_is_finite(now_s) || !rimi_guard_enter(m))
    return;
  rimi_monitor_forget(m);
  rimi_blocks_begin_late(m->rows); /* the rows that bore the clock out were left out */
  rimi_alarm_life_restart(&m->life, now_s);
  rimi_guard_leave(m);
}

void rim_monitor_repeat(rim_monitor *m) {
  if (m == NULL || !rimi_guard_enter_header(m))
    return;
  rimi_alarm_life_repeat(&m->life);
  rimi_guard_leave_header(m);
}

bool rim_monitor_next_record(rim_monitor *m, rim_alarm *record) {
  if (m == NULL || record == NULL || !rimi_alarm_life_waits(&m->life) ||
      !rimi_guard_enter_header(m))
    return false;
  const bool taken = rimi_alarm_life_next_record(&m->life, record);
  rimi_guard_leave_header(m);
  return taken;
}

rim_alarm_status rim_monitor_alarms(const rim_monitor *m) {
  rim_alarm_status status = {.level = RIM_LEVEL_STALE};
  if (m != NULL && rimi_guard_header_holds(m))
    rimi_alarm_life_status(&m->life, &status);
  return status;
}

const rim_alarm *rim_monitor_standing(const rim_monitor *m, rim_detector detector) {
  return m != NULL && rimi_guard_header_holds(m) ? rimi_alarm_life_standing(&m->life, detector)
                                                 : NULL;
}

/* ---- what can be asked ---- */

double rim_monitor_membership(const rim_monitor *m, const double *context) {
  const rim_alarm *alarm = rim_monitor_standing(m, RIM_DETECTOR_RIM);
  if (context == NULL || alarm == NULL)
    return 0.0;
  if (m->is_trained) /* its regions are boxes, closed where data ends */
    return rimi_region_box_contains(&alarm->region, context) ? 1.0 : 0.0;
  double unit[RIM_MONITOR_MAX_FEATURES];
  for (size_t i = 0; i < m->words[RIM_CONFIG_REGION_FEATURES]; ++i) {
    const size_t f = monitor_region(m, i);
    unit[i] = (context[f] - monitor_low(m, f)) / monitor_width(m, f);
  }
  return rimi_select_membership(m->select, alarm->channel[0], unit);
}

const uint8_t *rimi_monitor_place(const rim_monitor *m) {
  return m != NULL && m->has_place ? m->place : NULL;
}

const double *rimi_monitor_residuals(const rim_monitor *m) {
  return m != NULL && m->has_place ? m->residual : NULL;
}

uint32_t rimi_monitor_channels(const rim_monitor *m) { return m != NULL ? m->channel_count : 0u; }

bool rimi_monitor_inside(const rim_monitor *m, const uint8_t *place, uint32_t block) {
  return m != NULL && place != NULL && m->has_explained && m->is_trained &&
         rimi_search_inside(m->search, &m->explained, place, block);
}

uint32_t rim_monitor_ended(const rim_monitor *m, uint32_t *first, uint32_t *end) {
  if (m == NULL)
    return 0;
  if (first != NULL)
    *first = m->ended_first;
  if (end != NULL)
    *end = m->ended_end;
  return m->ended_count;
}

rim_monitor_health rim_monitor_get_health(const rim_monitor *m) {
  if (m == NULL || !rimi_guard_header_holds(m))
    return (rim_monitor_health){.out_feature = BLOCKS_NO_FEATURE,
                                .damage = m != NULL ? rimi_guard_damage(m) : 0};
  const blocks_health rows = rimi_blocks_get_health(m->rows);
  rim_monitor_health health = {.rows = {.rows = rows.rows,
                                        .rows_used = rows.rows_used,
                                        .not_finite = rows.not_finite,
                                        .time_back = rows.time_back,
                                        .gaps = rows.gaps,
                                        .out_of_range = rows.out_of_range,
                                        .wrong_rate = rows.wrong_rate,
                                        .refused = m->refused},
                               .blocks = m->last.blocks,
                               .alarms = m->life.raised,
                               .stale = m->life.stale_times,
                               .last_valid_s = m->last_valid_s,
                               .period_s = rimi_blocks_period_s(m->rows),
                               .out_feature = m->out_feature,
                               .out_value = m->out_value,
                               .out_t_s = m->out_t_s,
                               .partly = m->partly};
  return health;
}

rim_interference_health rim_interference_get_health(const rim_monitor *m) {
  return m != NULL && rimi_guard_header_holds(m) && m->watch != NULL ? m->watch->state.health
                                                                     : (rim_interference_health){0};
}

const rim_select *rimi_monitor_search(const rim_monitor *m) { return m != NULL ? m->select : NULL; }
const rim_threshold *rimi_monitor_threshold(const rim_monitor *m) {
  return m != NULL ? &m->models.threshold : NULL;
}
uint32_t rim_monitor_config(const rim_monitor *m, uint32_t word) {
  return m != NULL && word < RIM_CONFIG_WORDS ? m->words[word] : 0u;
}
