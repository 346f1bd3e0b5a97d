/* SPDX-License-Identifier: MIT */
/* What was found, as a record: which outcome, how it deviates, by how much, where, since when. */
#include <string.h>

#include "base/bytes.h"
#include "base/ellipsoid.h"
#include "base/real.h"
#include "monitor/cause.h"

#define FACTOR_OFF                                                                                 \
  0.12 /* relative: a run's mean of a product's other factor, from that of healthy runs */
/* Of a standard error: the noise itself is known from some dozens of runs only, and without this
 * 95 % intervals are too narrow ("covered" of tests/vehicles/grade.py). */
#define LEARNT 1.15
#define SIGN_KEEPS 0.5   /* of a contrary explanation's worth: the sign of before stays */
#define KNOWN_BLOCKS 16u /* from which on a run's own effects are known, roughly */
#define LIKELY                                                                                     \
  1.0 /* nats for the outcome that is mostly integrated: a bias is likelier than a drift */

static void begin(const rim_monitor *m, const rim_verdict *verdict, rim_alarm *alarm) {
  memset(alarm, 0, sizeof *alarm);
  alarm->t_s = verdict->t_s;
  alarm->since_s = verdict->t_s;
  alarm->model_id = m->image.model_id;
  alarm->detector = RIM_DETECTOR_RIM;
  alarm->level = verdict->level;
  alarm->ln_anom = verdict->ln_anom;
  alarm->threshold = verdict->threshold;
  alarm->p_value = verdict->p_value;
}

/* Outcomes whose best score passes, most anomalous first, after the one that is named already. */
static void name_others(rim_alarm *alarm, uint16_t channels, uint16_t outcomes, double least,
                        double (*score_of)(const rim_monitor *, uint16_t), const rim_monitor *m) {
  while (alarm->channels < RIM_ALARM_MAX_CHANNELS) {
    double best = least;
    uint16_t next = outcomes;
    for (uint16_t c = 0; c < channels; ++c) {
      const uint16_t outcome = (uint16_t)(c % outcomes);
      bool taken = false;
      for (size_t i = 0; i < alarm->channels; ++i)
        taken = taken || alarm->channel[i] == outcome;
      const double score = score_of(m, c);
      if (!taken && score >= best) {
        best = score;
        next = outcome;
      }
    }
    if (next == outcomes)
      return;
    alarm->channel[alarm->channels++] = next;
  }
}

/* ---- a trained image ---- */

static rim_kind kind_of(uint16_t channel_kind, const search_hypothesis *h) {
  if (channel_kind == RIM_CHANNEL_SCATTER)
    return RIM_KIND_VARIANCE;
  if (channel_kind == RIM_CHANNEL_REPEAT)
    return RIM_KIND_REPEAT;
  return rimi_cause_is_gain(h)      ? RIM_KIND_GAIN
         : h->family == SEARCH_RAMP ? RIM_KIND_DRIFT
                                    : RIM_KIND_SHIFT;
}

/* Kinds of channels whose residual is in the outcome's unit. */
static bool is_of_outcome(uint32_t kind) {
  return kind <= RIM_CHANNEL_AGREEMENT || kind == RIM_CHANNEL_STEP;
}

/* Residuals of rows that bring their predictions are in the caller's standard deviations. */
static double outcome_unit(const rim_monitor *m, uint16_t channel) {
  const uint32_t outcome = channel % m->words[RIM_CONFIG_OUTCOMES];
  return m->words[RIM_CONFIG_EXTERNAL] != 0 ? rimi_blocks_sd(m->rows)[outcome] : 1.0;
}

/* shift and its standard error in the units of the record's kind. */
static void size_shift(const rim_monitor *m, uint16_t channel, const search_hypothesis *h,
                       double *shift, double *sd) {
  const noise_channel n = rimi_noise_channel(&m->models.noise, channel);
  const uint16_t kind = (uint16_t)(channel / m->words[RIM_CONFIG_OUTCOMES]);
  /* Healthy runs exceed the ratio that the noise model expects by phi: so does the error. */
  const double inflation = LEARNT * rimi_sqrt(rimi_search_inflation(&n, h));
  double unit = (double)n.s;
  if (rimi_cause_is_gain(h) && is_of_outcome(kind))
    unit = 1.0;
  if (h->shape == SEARCH_KEPT)
    unit *= rimi_search_kept_mean(m->search, h);
  if (h->family == SEARCH_RAMP)
    unit *= (double)(rimi_search_blocks(m->search) - h->onset) / 256.0;
  if (is_of_outcome(kind))
    unit *= outcome_unit(m, channel);
  *shift = (double)h->shift * unit;
  *sd = (double)h->sd * unit * inflation;
  if (kind == RIM_CHANNEL_SCATTER) { /* from logarithms to the ratio of variances */
    *shift = rimi_exp(rimi_clamp(*shift, -60.0, 60.0));
    *sd *= *shift;
  }
}

static void place_region(const rim_monitor *m, const search_hypothesis *h, rim_region *region) {
  const uint8_t dims = (uint8_t)search_dims(h);
  uint16_t feature[2];
  double lower[2], upper[2];
  for (size_t k = 0; k < dims; ++k) {
    uint32_t low, high;
    rimi_search_edges(m->search, h->feature[k], h->first[k], h->last[k], &low, &high);
    feature[k] = monitor_region(m, h->feature[k]);
    const double step = monitor_width(m, feature[k]) / 256.0;
    lower[k] = monitor_low(m, feature[k]) + step * (double)low;
    upper[k] = monitor_low(m, feature[k]) + step * (double)(high + 1u);
  }
  if (dims > 0)
    (void)rimi_region_from_box(region, dims, feature, lower, upper);
}

static double block_s(const rim_monitor *m) {
  return (double)m->words[RIM_CONFIG_BLOCK_ROWS] * 1e-6 * (double)m->words[RIM_CONFIG_PERIOD_US];
}

/* Where a block of the ring begins; of one that has left it, where the ring begins. */
static double begin_s(const rim_monitor *m, uint32_t block) {
  return m->run_start_s + rimi_search_time_of(m->search, block) - 0.5 * block_s(m);
}

/* Returns the first block. */
static uint32_t date(rim_monitor *m, const search_hypothesis *h, double onset_sd,
                     rim_alarm *alarm) {
  const uint32_t first = rimi_search_first_shown(m->search, h);
  alarm->since_s = begin_s(m, first);
  if (h->onset != SEARCH_FROM_START)
    alarm->since_sd_s = onset_sd * block_s(m);
  return first;
}

/* An outcome that integrates others drifts when one of those is biased. The others' own channels
 * say whose bias it is, or whether it is a drift of its own; where they say nothing, the one that
 * it mostly integrates is named. */
static void blame_integrand(rim_monitor *m, uint16_t channel, const search_hypothesis *h,
                            rim_alarm *alarm) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  if (channel / outcomes != RIM_CHANNEL_AGREEMENT || h->family != SEARCH_RAMP ||
      rimi_cause_is_out_of_range(m, channel % outcomes))
    return;
  const noise_channel own = rimi_noise_channel(&m->models.noise, channel);
  const double unit = (double)own.s / 256.0; /* of a ramp, per block */
  const double inflation = LEARNT * rimi_sqrt((double)rimi_le_f32(own.phi, SEARCH_RAMP));
  double most = 0.0;
  for (uint32_t j = 0; j < outcomes; ++j) {
    const agreement_gain gain = rimi_agreement_gain(&m->models.agreement, channel % outcomes, j,
                                                    rimi_blocks_outcome_feature(m->rows, j));
    if (!(rimi_abs(gain.sum) > 0.0))
      continue;
    const double bias = -(double)h->shift * unit / gain.sum;
    const double support = rimi_cause_support(m, j, bias, h->onset) + (gain.mostly ? LIKELY : 0.0);
    if (!(support > most))
      continue;
    most = support;
    alarm->kind = RIM_KIND_SHIFT;
    alarm->channel[0] = (uint16_t)j;
    alarm->shift[0] = bias;
    const double sd = (double)h->sd * unit / gain.sum * inflation;
    const double of_gain = FACTOR_OFF * gain.of_products / gain.sum * bias;
    alarm->shift_sd[0] = rimi_sqrt(sd * sd + of_gain * of_gain);
  }
}

/* The standing record where it names an integrand of the outcome that explains most, as it did
 * before. What an integrand's bias adds up to leaves the range in which its shape is known, and the
 * shape then says nothing more of whose bias it is. */
static const rim_alarm *standing_blame(const rim_monitor *m, uint16_t channel) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const rim_alarm *standing = rim_monitor_standing(m, RIM_DETECTOR_RIM);
  const bool is_same = standing != NULL && m->has_explained &&
                       m->explained_channel % outcomes == channel % outcomes &&
                       channel / outcomes <= RIM_CHANNEL_AGREEMENT &&
                       standing->kind == RIM_KIND_SHIFT &&
                       standing->channel[0] != channel % outcomes;
  return is_same && rimi_cause_integrates(m, channel, standing->channel[0]) ? standing : NULL;
}

static void keep_blame(const rim_alarm *standing, rim_alarm *alarm) {
  alarm->kind = standing->kind;
  alarm->channel[0] = standing->channel[0];
  alarm->shift[0] = standing->shift[0];
  alarm->shift_sd[0] = standing->shift_sd[0];
  alarm->since_s = standing->since_s;
  alarm->since_sd_s = standing->since_sd_s;
  alarm->region = standing->region;
}

/* Where behaviour and agreement of one outcome have opposite signs, the surer one is reported. */
static void prefer_agreement(rim_monitor *m, uint16_t *channel, search_hypothesis *h,
                             double *onset_sd) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint16_t other = (uint16_t)(outcomes + *channel);
  if (*channel >= outcomes || rimi_cause_is_into(m, other) ||
      rimi_cause_score(m, other) < m->models.threshold.alarm_score)
    return;
  search_hypothesis agreed;
  double agreed_sd, shift[2], sd[2];
  rimi_search_explain(m->search, other, &agreed, &agreed_sd);
  size_shift(m, *channel, h, &shift[0], &sd[0]);
  size_shift(m, other, &agreed, &shift[1], &sd[1]);
  if (shift[0] * shift[1] < 0.0 && rimi_abs(shift[0]) * sd[1] < rimi_abs(shift[1]) * sd[0]) {
    *channel = other;
    *h = agreed;
    *onset_sd = agreed_sd;
  }
}

/* In each block some features are looked at for a rate that deviates in a region. What was found in
 * others stays while it explains most. */
static void keep_rate(rim_monitor *m, uint16_t channel, search_hypothesis *h, double *onset_sd) {
  search_hypothesis rate = m->explained;
  if (!m->has_explained || m->explained_channel != channel || rate.shape != SEARCH_KEPT ||
      !rimi_search_evaluate_channel(m->search, channel, &rate) ||
      !(rimi_search_worth(m->search, channel, &rate) > rimi_search_worth(m->search, channel, h)))
    return;
  *h = rate;
  *onset_sd = (double)m->explained_onset_sd;
}

/* A region's family without an onset; of what is no region, 0. */
static uint8_t region_family(const search_hypothesis *h) {
  static const uint8_t family[3] = {0u, SEARCH_INTERVAL, SEARCH_BOX};
  return family[search_dims(h)];
}

/* The ring holds only so much: where all that it holds is inside, the onset is the one that was
 * seen when its blocks were there. */
static void keep_onset(const rim_monitor *m, uint16_t channel, search_hypothesis *h) {
  const search_hypothesis *before = &m->explained;
  const uint32_t oldest = rimi_search_oldest(m->search);
  if (!m->has_explained || m->explained_channel != channel || oldest == 0 ||
      rim_monitor_standing(m, RIM_DETECTOR_RIM) == NULL)
    return;
  const bool is_same = region_family(h) != 0 && region_family(h) == region_family(before);
  if (h->onset == SEARCH_FROM_START) {
    if (is_same && before->onset < oldest) {
      h->onset = before->onset;
      h->family = before->family;
    }
    return;
  }
  const bool always = is_same && before->onset == SEARCH_FROM_START;
  if (!always && before->onset >= h->onset)
    return;
  search_hypothesis whole = *h;
  whole.onset = SEARCH_FROM_START;
  if (h->onset >= rimi_search_first_inside(m->search, &whole) + SEARCH_LEAST)
    return;
  h->onset = before->onset;
  if (always)
    h->family = before->family;
}

static bool is_said(const uint32_t *said, uint32_t outcome) {
  return (said[outcome / 32u] >> (outcome % 32u) & 1u) != 0;
}

/* What the standing alarm said of an outcome: 1 high, -1 low, 0 nothing. */
static double said_sign(const rim_monitor *m, uint32_t outcome) {
  return is_said(m->said_high, outcome) ? 1.0 : is_said(m->said_low, outcome) ? -1.0 : 0.0;
}

static void say_sign(rim_monitor *m, uint32_t outcome, double shift, uint32_t onset) {
  const uint32_t bit = UINT32_C(1) << (outcome % 32u);
  if (shift * said_sign(m, outcome) < 0.0)
    m->said_well[outcome / 32u] &= ~bit;
  else if (!is_said(m->said_high, outcome) && !is_said(m->said_low, outcome) &&
           onset != SEARCH_FROM_START && onset >= KNOWN_BLOCKS)
    m->said_well[outcome / 32u] |= bit;
  m->said_high[outcome / 32u] &= ~bit;
  m->said_low[outcome / 32u] &= ~bit;
  if (shift > 0.0)
    m->said_high[outcome / 32u] |= bit;
  else if (shift < 0.0)
    m->said_low[outcome / 32u] |= bit;
}

/* Whether the outcome reads high by a hypothesis (> 0) or low (< 0); 0: of a gain whose outcome has
 * no sign that it mostly has (in its region, or in healthy runs), and of run effects. */
static double sign_of(const rim_monitor *m, uint16_t channel, const search_hypothesis *h) {
  const noise_channel n = rimi_noise_channel(&m->models.noise, channel);
  if (h->family == SEARCH_FIELD)
    return 0.0;
  if (!rimi_cause_is_gain(h))
    return (double)h->shift;
  if (h->family != SEARCH_GAIN)
    return (double)h->shift * rimi_search_side(m->search, channel, h);
  return rimi_abs((double)n.p_center) >= (double)n.p_scale ? (double)h->shift * (double)n.p_center
                                                           : 0.0;
}

/* A region in which the outcome reads high and the rest, in which it reads low, explain much the
 * same, for a run has an offset of its own. An operator acts on the sign, so a standing alarm keeps
 * what it said first unless the contrary explains clearly more. A gain that says neither takes its
 * place no sooner; and what stands as such a gain stays, too, while it explains as much. */
static void keep_sign(rim_monitor *m, uint16_t channel, search_hypothesis *h, double *onset_sd) {
  const double sign = said_sign(m, channel % m->words[RIM_CONFIG_OUTCOMES]);
  const double now = h->family == SEARCH_FIELD ? (double)h->shift : sign_of(m, channel, h);
  if (!(rimi_abs(sign) > 0.0) || sign * now > 0.0)
    return;
  const search_hypothesis contrary = *h;
  search_hypothesis other = m->explained;
  const bool has_sign = rimi_abs(now) > 0.0;
  const bool is_same =
      m->has_explained && m->explained_channel == channel && m->explained.family != SEARCH_FIELD;
  const rim_search *search = m->search;
  double best = SIGN_KEEPS * rimi_search_worth(search, channel, h);
  if (is_same && (has_sign || !rimi_cause_is_gain(&other)) &&
      rimi_search_evaluate_channel(m->search, channel, &other) &&
      sign * sign_of(m, channel, &other) >= 0.0 &&
      rimi_search_worth(search, channel, &other) >= best) {
    best = rimi_search_worth(search, channel, &other);
    *h = other;
    *onset_sd = (double)m->explained_onset_sd;
  }
  if (!has_sign) /* a gain that has none does not contradict */
    return;
  if (rimi_search_beside(m->search, channel, &contrary, &other) &&
      sign * sign_of(m, channel, &other) > 0.0 &&
      rimi_search_worth(search, channel, &other) >= best) {
    best = rimi_search_worth(search, channel, &other);
    *h = other;
    *onset_sd = 0.0; /* it is from the start of the run */
  }
  if (rimi_search_passed(m->search, channel, is_same ? &m->explained : NULL, &other) &&
      sign * sign_of(m, channel, &other) > 0.0 &&
      rimi_search_worth(search, channel, &other) >= best) {
    *h = other;
    *onset_sd = rimi_search_sd_of_onset(m->search, h);
  }
}

/* Of the first other outcome of which nothing was said: its sign where and when this one deviates.
 * One per record, for its cost. */
static void say_sign_of_another(rim_monitor *m, const search_hypothesis *h,
                                const rim_alarm *alarm) {
  for (size_t i = 1; i < alarm->channels; ++i) {
    const uint16_t outcome = alarm->channel[i];
    search_hypothesis same = *h;
    if (said_sign(m, outcome) * said_sign(m, outcome) > 0.0)
      continue;
    if (rimi_search_evaluate_channel(m->search, outcome, &same))
      say_sign(m, outcome, (double)same.shift, same.onset);
    return;
  }
}

/* No alarm stands yet that this record could be of. */
static void begin_alarm(rim_monitor *m) {
  m->raised_at = rimi_search_blocks(m->search);
  memset(m->said_high, 0, sizeof m->said_high);
  memset(m->said_low, 0, sizeof m->said_low);
  memset(m->said_well, 0, sizeof m->said_well);
}

/* Names the outcome that deviates, where the channel that shows it is of another one: of its twin,
 * or of what the outcome integrates. Both say it with the sign reversed. */
static void name_shown(const rim_monitor *m, uint16_t named, uint16_t channel, rim_alarm *alarm) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  double weight = 1.0;
  if (named != channel) {
    (void)rimi_agreement_twin(&m->models.agreement, channel % outcomes, &weight);
    alarm->channel[0] = (uint16_t)(named % outcomes);
  } else {
    alarm->channel[0] = (uint16_t)rimi_agreement_integral(&m->models.agreement, named % outcomes);
  }
  if (alarm->kind == RIM_KIND_GAIN)
    weight = 1.0;
  alarm->shift[0] /= -weight;
  alarm->shift_sd[0] /= weight;
}

static bool is_of_level(const rim_alarm *alarm) {
  return alarm->kind != RIM_KIND_VARIANCE && alarm->kind != RIM_KIND_REPEAT;
}

/* What explains a standing alarm best may begin after it was raised: where the vehicle enters the
 * place of a fault again, say. Or the deviation began in blocks that have left the ring, and what
 * is left of it begins later. Then that is not when the deviation began, unless it is another one:
 * of scatter or repeats, or of other outcomes than the one that was named. */
static void keep_since(const rim_monitor *m, const search_hypothesis *h, uint32_t first,
                       rim_alarm *alarm) {
  const rim_alarm *standing = rim_monitor_standing(m, RIM_DETECTOR_RIM);
  bool is_same = false;
  for (size_t i = 0; standing != NULL && i < alarm->channels; ++i)
    is_same = is_same || alarm->channel[i] == standing->channel[0];
  if (!is_same || is_of_level(standing) != is_of_level(alarm))
    return;
  const uint32_t oldest = rimi_search_oldest(m->search);
  const bool has_left =
      first < oldest || (h->onset == SEARCH_FROM_START && standing->since_s < begin_s(m, oldest));
  if (first < m->raised_at && !has_left)
    return;
  alarm->since_s = standing->since_s;
  alarm->since_sd_s = standing->since_sd_s;
}

/* Shifts and drifts are both in the outcome's unit. */
static bool is_in_unit_of(uint8_t kind, rim_kind other) {
  return other == kind || (other == RIM_KIND_SHIFT && kind == RIM_KIND_DRIFT) ||
         (other == RIM_KIND_DRIFT && kind == RIM_KIND_SHIFT);
}

/* The other outcomes: what explains each best of what its behaviour and its agreement show in the
 * record's unit; of scatter and repeats, what these show. */
static void size_others(const rim_monitor *m, uint16_t kind, rim_alarm *alarm) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint32_t first = is_of_outcome(kind) ? RIM_CHANNEL_BEHAVIOUR : kind;
  const uint32_t last = is_of_outcome(kind) ? RIM_CHANNEL_AGREEMENT : kind;
  for (size_t i = 1; i < alarm->channels; ++i) {
    float best = -1e9f;
    for (uint32_t k = first; k <= last; ++k) {
      const uint16_t c = (uint16_t)(k * outcomes + alarm->channel[i]);
      const search_hypothesis *h = rimi_search_best(m->search, c);
      if (!(h->score > best) || rimi_cause_is_into(m, c) ||
          !is_in_unit_of(alarm->kind, kind_of((uint16_t)k, h)))
        continue;
      best = h->score;
      size_shift(m, c, h, &alarm->shift[i], &alarm->shift_sd[i]);
    }
  }
}

static void describe_trained(rim_monitor *m, const rim_verdict *verdict, rim_alarm *alarm) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  const uint16_t named = rimi_cause(m, verdict->channel);
  const uint16_t shown = rimi_cause_shown_by(m, named);
  uint16_t channel = shown;
  search_hypothesis h;
  double onset_sd;
  rimi_search_explain(m->search, channel, &h, &onset_sd);
  prefer_agreement(m, &channel, &h, &onset_sd);
  if (rim_monitor_standing(m, RIM_DETECTOR_RIM) == NULL)
    begin_alarm(m);
  if (is_of_outcome(channel / outcomes)) {
    const double said = said_sign(m, channel % outcomes);
    keep_rate(m, channel, &h, &onset_sd);
    keep_sign(m, channel, &h, &onset_sd);
    const bool is_known = said * (double)h.shift > 0.0 && is_said(m->said_well, channel % outcomes);
    (void)rimi_search_against_nominal(m->search, channel, &h, is_known, &onset_sd);
    if (rimi_abs(sign_of(m, channel, &h)) > 0.0)
      say_sign(m, channel % outcomes, sign_of(m, channel, &h), h.onset);
  }
  keep_onset(m, channel, &h);
  const rim_alarm *blame = standing_blame(m, channel);
  m->explained = h;
  m->explained_channel = channel;
  m->explained_onset_sd = (float)onset_sd;
  m->has_explained = true;
  alarm->kind = (uint8_t)kind_of((uint16_t)(channel / outcomes), &h);
  alarm->observations = h.blocks;
  place_region(m, &h, &alarm->region);
  const uint32_t first = date(m, &h, onset_sd, alarm);
  alarm->channel[0] = (uint16_t)(channel % outcomes);
  alarm->channels = 1;
  size_shift(m, channel, &h, &alarm->shift[0], &alarm->shift_sd[0]);
  if (shown != named || rimi_cause_is_into(m, shown))
    name_shown(m, named, shown, alarm);
  else
    blame_integrand(m, channel, &h, alarm);
  /* What its own channels contradict is blamed no longer. */
  if (blame != NULL && alarm->channel[0] == channel % outcomes &&
      rimi_cause_support(m, blame->channel[0], blame->shift[0], h.onset) > -LIKELY)
    keep_blame(blame, alarm);
  name_others(alarm, (uint16_t)(RIM_MONITOR_KINDS * outcomes), outcomes,
              m->models.threshold.alarm_score, rimi_cause_score, m);
  keep_since(m, &h, first, alarm);
  size_others(m, (uint16_t)(channel / outcomes), alarm);
  if (is_of_outcome(channel / outcomes) && !rimi_cause_is_gain(&h))
    say_sign_of_another(m, &h, alarm);
}

/* ---- independent rows ---- */

/* Unit coordinates over region features -> units of the features, indices of the image. */
static rim_region to_features(const rim_monitor *m, const rim_unit_region *region) {
  uint16_t feature[RIM_REGION_MAX_DIMS];
  double low[RIM_REGION_MAX_DIMS], width[RIM_REGION_MAX_DIMS];
  for (size_t i = 0; i < region->unit.dims; ++i) {
    feature[i] = monitor_region(m, region->unit.feature[i]);
    low[i] = monitor_low(m, feature[i]);
    width[i] = monitor_width(m, feature[i]);
  }
  return rimi_region_from_unit(region, feature, low, width);
}

static double row_score(const rim_monitor *m, uint16_t c) {
  return rimi_threshold_score(&m->models.threshold, c,
                              (double)rimi_select_channel_scores(m->select)[c],
                              rimi_select_observations(m->select));
}

/* Rows are evenly spaced between two gaps. */
static double time_of_observation(const rim_monitor *m, uint32_t index) {
  uint32_t first = 0, end = rimi_select_observations(m->select);
  double first_s = m->first_block_s, last_s = m->last_block_s;
  for (uint32_t i = 0; i < m->gaps && m->gap[i].index <= index; ++i) {
    first = m->gap[i].index;
    first_s = m->gap[i].after_s;
  }
  for (uint32_t i = m->gaps; i-- > 0 && m->gap[i].index > index;) {
    end = m->gap[i].index;
    last_s = m->gap[i].before_s;
  }
  if (end - first < 2)
    return last_s;
  const double spacing_s = (last_s - first_s) / (double)(end - first - 1u);
  return first_s + spacing_s * (double)(index - first);
}

static void describe_rows(rim_monitor *m, const rim_verdict *verdict, rim_alarm *alarm) {
  rim_candidate best;
  memset(&best, 0, sizeof best);
  if (rimi_select_best_of_channel(m->select, verdict->channel, &best)) {
    alarm->region = to_features(m, &best.region);
    /* The whole range of a feature is no restriction. */
    if (best.dims == 1 && best.region.unit.lower[0] <= 0.0 && best.region.unit.upper[0] >= 1.0)
      memset(&alarm->region, 0, sizeof alarm->region);
    alarm->observations = (uint32_t)best.n;
    if (best.since != UINT32_MAX)
      alarm->since_s = time_of_observation(m, best.since);
  }
  alarm->channel[0] = verdict->channel;
  alarm->channels = 1;
  name_others(alarm, m->channel_count, m->channel_count, m->models.threshold.alarm_score, row_score,
              m);
  for (size_t i = 0; i < alarm->channels; ++i) {
    rim_candidate found = best;
    if (i > 0 && !rimi_select_shift_of_channel(m->select, alarm->channel[i], &found))
      continue;
    /* F = shift^2 / (2 Var) gives the standard error without asking for Var again. */
    alarm->shift[i] =
        found.shift * outcome_unit(m, alarm->channel[i]) / monitor_scale(m, alarm->channel[i]);
    alarm->shift_sd[i] =
        found.ln_anom > 0.0 ? rimi_abs(alarm->shift[i]) / rimi_sqrt(2.0 * found.ln_anom) : 0.0;
  }
}

void rimi_monitor_describe(rim_monitor *m, const rim_verdict *verdict, rim_alarm *alarm) {
  begin(m, verdict, alarm);
  if (m->is_trained)
    describe_trained(m, verdict, alarm);
  else
    describe_rows(m, verdict, alarm);
}
