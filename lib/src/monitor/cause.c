/* SPDX-License-Identifier: MIT */
#include "monitor/cause.h"

#include <float.h>

#include "base/bytes.h"
#include "base/real.h"
#include "image/rolled.h"

/* A behaviour channel with this part of the score of the leading agreement channel is named
 * instead. */
#define BEHAVIOUR_SHARE 0.4
#define TOGETHER 0.25 /* of its score: what the leading channel's place and time explain there */
#define FROZEN 0.3    /* share of repeated readings, beyond the healthy, that is called stuck */
#define UPSTREAM 0.2  /* of the leading score, from which on what feeds an outcome is the cause */
#define DISAGREES 0.1 /* of the leading agreement's score: another reading disagrees with it */
#define SPEAKS 3.0    /* nats from which on behaviour speaks for a shift, or against it */
#define PLAINER 1.02  /* of the standard deviations by which the leading agreement is off */

bool rimi_cause_is_gain(const search_hypothesis *h) {
  return h->family == SEARCH_GAIN || h->shape == SEARCH_PROPORTIONAL;
}

double rimi_cause_score(const rim_monitor *m, uint16_t c) {
  return (double)rimi_search_best(m->search, c)->score;
}

static agreement_gain gain_of(const rim_monitor *m, uint16_t channel, uint16_t j) {
  return rimi_agreement_gain(&m->models.agreement, channel % m->words[RIM_CONFIG_OUTCOMES], j,
                             rimi_blocks_outcome_feature(m->rows, j));
}

bool rimi_cause_integrates(const rim_monitor *m, uint16_t channel, uint16_t j) {
  const agreement_gain gain = gain_of(m, channel, j);
  return rimi_abs(gain.sum) > 0.0 || gain.mostly;
}

bool rimi_cause_is_into(const rim_monitor *m, uint32_t channel) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  return channel / outcomes == RIM_CHANNEL_AGREEMENT &&
         rimi_agreement_source(&m->models.agreement, channel % outcomes) == AGREEMENT_INTO;
}

/* Two sensors that read the same: the channel that says how they differ, where outcome j is the one
 * that its own channels say other things of (see free_twins() in host_tools/train/agreement.cpp);
 * the number of channels: there is none. */
static uint16_t difference_from(const rim_monitor *m, uint32_t j) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  for (uint32_t o = 0; o < outcomes; ++o) {
    if (rimi_agreement_twin(&m->models.agreement, o, NULL) == j &&
        rimi_agreement_twin(&m->models.agreement, j, NULL) != o)
      return (uint16_t)(RIM_CHANNEL_AGREEMENT * outcomes + o);
  }
  return (uint16_t)m->channel_count;
}

uint16_t rimi_cause_shown_by(const rim_monitor *m, uint16_t channel) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  if (channel / outcomes != RIM_CHANNEL_AGREEMENT)
    return channel;
  const uint16_t difference = difference_from(m, channel % outcomes);
  if (difference == m->channel_count ||
      rimi_cause_score(m, difference) < m->models.threshold.alarm_score)
    return channel;
  return rimi_cause_is_into(m, channel) ||
                 rimi_cause_score(m, difference) > rimi_cause_score(m, channel)
             ? difference
             : channel;
}

/* The channel of outcome j, of its behaviour or agreement, whose score reaches *score. */
static void better_channel_of(const rim_monitor *m, uint16_t j, uint16_t *best, double *score) {
  for (uint32_t kind = RIM_CHANNEL_BEHAVIOUR; kind <= RIM_CHANNEL_AGREEMENT; ++kind) {
    const uint16_t c = (uint16_t)(kind * m->words[RIM_CONFIG_OUTCOMES] + j);
    if (rimi_cause_score(m, c) >= *score && !rimi_cause_is_into(m, c)) {
      *score = rimi_cause_score(m, c);
      *best = c;
    }
  }
}

/* Whether channel c deviates for no less long than another one, as far as both say since when. */
static bool is_before(const rim_monitor *m, uint16_t c, uint16_t other) {
  const uint32_t onset = rimi_search_best(m->search, c)->onset;
  const uint32_t limit = rimi_search_best(m->search, other)->onset;
  return onset == SEARCH_FROM_START || limit == SEARCH_FROM_START || onset <= limit + SEARCH_LEAST;
}

/* An outcome that integrates others sums up what is wrong with them. Where one that it integrates
 * deviates by its own channels, that one is the cause; of a step, only where the commands say so
 * too, and for no less long: a reading that is off by a step also disagrees with what it
 * integrates. */
static uint16_t integrated_cause(const rim_monitor *m, uint16_t leading) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const bool is_step = rimi_search_best(m->search, leading)->family == SEARCH_SINCE;
  uint16_t best = leading;
  double score = m->models.threshold.alarm_score;
  for (uint16_t j = 0; j < outcomes; ++j) {
    if (!rimi_cause_integrates(m, leading, j))
      continue;
    if (!is_step) {
      better_channel_of(m, j, &best, &score);
    } else if (rimi_cause_score(m, j) >= score && is_before(m, j, leading)) {
      score = rimi_cause_score(m, j);
      best = j; /* its behaviour */
    }
  }
  return best;
}

/* Whether the behaviour channel of the leading outcome itself has the other sign: then the sensor
 * was off from the start, from which behaviour is predicted. */
static bool contradicts(const rim_monitor *m, uint16_t leading, uint16_t c) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  return c == leading % outcomes &&
         rimi_search_best(m->search, c)->shift * rimi_search_best(m->search, leading)->shift < 0.0f;
}

/* A channel's shift where and since when another one deviates; what it says of its own where that
 * is no such thing. */
static double shift_as(const rim_monitor *m, uint16_t c, uint16_t other) {
  const double own = (double)rimi_search_best(m->search, c)->shift;
  search_hypothesis same = *rimi_search_best(m->search, other);
  if (same.family == SEARCH_FIELD || same.family == SEARCH_GAIN ||
      !rimi_search_evaluate_channel(m->search, c, &same))
    return own;
  return (double)same.shift;
}

/* ln likelihood ratio, as healthy runs inflate it, of a bias of outcome j since this block, by what
 * channel c says: its own, that of its difference from its twin, or a sum that integrates it. */
static double support_by(const rim_monitor *m, uint32_t c, uint32_t j, double bias,
                         uint32_t onset) {
  const rim_agreement *agreement = &m->models.agreement;
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES], o = c % outcomes;
  const noise_channel n = rimi_noise_channel(&m->models.noise, c);
  search_hypothesis since = {.family = SEARCH_SINCE, .onset = onset};
  double z = bias / (double)n.s;
  if (rimi_cause_is_into(m, c) || (o != j && rimi_agreement_integral(agreement, o) < outcomes)) {
    since.family = SEARCH_RAMP;
    z *= -256.0 * rimi_agreement_gain(agreement, o, j, rimi_blocks_outcome_feature(m->rows, j)).sum;
  } else if (o != j) {
    double weight = 0.0;
    (void)rimi_agreement_twin(agreement, o, &weight);
    z *= -weight;
  }
  if (!(n.active > 0.5f) || !rimi_search_evaluate_channel(m->search, c, &since))
    return 0.0;
  const double a = 1.0 / ((double)since.sd * (double)since.sd);
  return (z * (double)since.shift - 0.5 * z * z) * a / rimi_search_inflation(&n, &since);
}

double rimi_cause_support(const rim_monitor *m, uint32_t j, double bias, uint32_t onset) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint32_t own = RIM_CHANNEL_AGREEMENT * outcomes + j;
  const uint16_t difference = rimi_cause_is_into(m, own) ? difference_from(m, j) : m->channel_count;
  return support_by(m, RIM_CHANNEL_BEHAVIOUR * outcomes + j, j, bias, onset) +
         support_by(m, difference < m->channel_count ? difference : own, j, bias, onset);
}

/* Whether the agreement of outcome o sums up what outcome j reads, over the run. */
static bool sums(const rim_monitor *m, uint32_t o, uint32_t j) {
  return rimi_agreement_integral(&m->models.agreement, o) < m->words[RIM_CONFIG_OUTCOMES] &&
         (o == j || rimi_cause_integrates(m, (uint16_t)o, (uint16_t)j));
}

static bool is_summed(const rim_monitor *m, uint32_t j) {
  for (uint32_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o) {
    if (sums(m, o, j))
      return true;
  }
  return false;
}

/* The same by the sums alone, the first CAUSE_SUMS of them. */
static double support_by_sums(const rim_monitor *m, uint32_t j, double bias, uint32_t onset) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  double sum = 0.0;
  for (uint32_t o = 0, asked = 0; o < outcomes && asked < CAUSE_SUMS; ++o) {
    if (!sums(m, o, j))
      continue;
    sum += support_by(m, RIM_CHANNEL_AGREEMENT * outcomes + o, j, bias, onset);
    ++asked;
  }
  return sum;
}

/* By how much the reading of a channel's outcome is off on the mean, in the channel's unit, and
 * since when. */
static double mean_shift(const rim_monitor *m, uint16_t channel, uint32_t *since) {
  const double s = (double)rimi_noise_channel(&m->models.noise, channel).s;
  const uint32_t end = rimi_search_blocks(m->search);
  search_hypothesis h = *rimi_search_best(m->search, channel);
  *since = h.onset != SEARCH_FROM_START ? h.onset : rimi_search_first_inside(m->search, &h);
  if (h.family == SEARCH_RAMP)
    return (double)h.shift * s * (double)(end - *since) / 512.0;
  if (rimi_cause_is_gain(&h) || h.family == SEARCH_FIELD) {
    h = (search_hypothesis){.family = SEARCH_SINCE, .onset = *since};
    /* Where the blocks say nothing of it, the shift is 0. */
    (void)rimi_search_evaluate_channel(m->search, channel, &h);
  }
  return (double)h.shift * s *
         rimi_min(1.0, (double)h.blocks / rimi_max(1.0, (double)(end - *since)));
}

/* What one of two sensors reads low beside the other, the other reads high. The wrong one is that
 * whose bias the sums of their readings speak for more; where there are none, the twin where it
 * disagrees so with what it is itself watched by. */
static uint16_t wrong_twin(const rim_monitor *m, uint16_t channel) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  double weight = 1.0;
  const uint32_t twin = rimi_agreement_twin(&m->models.agreement, channel % outcomes, &weight);
  if (twin >= outcomes)
    return channel;
  const uint16_t own = (uint16_t)(RIM_CHANNEL_AGREEMENT * outcomes + twin);
  if (is_summed(m, twin) || is_summed(m, channel % outcomes)) {
    uint32_t since;
    const double bias = mean_shift(m, channel, &since);
    return support_by_sums(m, twin, -bias / weight, since) >
                   support_by_sums(m, channel % outcomes, bias, since)
               ? own
               : channel;
  }
  return rimi_cause_score(m, own) >= m->models.threshold.alarm_score &&
                 shift_as(m, own, channel) * (double)rimi_search_best(m->search, channel)->shift <
                     0.0
             ? own
             : channel;
}

/* Whether channel c deviates where and when the leading one does: when the vehicle itself deviates,
 * its sensors do so together. What happens at other times is another matter. */
static bool deviates_too(const rim_monitor *m, uint16_t leading, uint16_t c) {
  search_hypothesis same = *rimi_search_best(m->search, leading);
  const double score = rimi_cause_score(m, c); /* which judging it may renew */
  if (same.family == SEARCH_FIELD)
    return true;
  if (same.family == SEARCH_GAIN)
    same.family = SEARCH_SINCE;
  return rimi_search_evaluate_channel(m->search, c, &same) &&
         (double)same.score + rimi_search_description((search_family)same.family) >=
             TOGETHER * score;
}

/* How much the behaviour of a channel's outcome speaks for what its agreement shows on the mean. */
static double confirmed(const rim_monitor *m, uint16_t agreement) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  uint32_t since;
  const double bias = mean_shift(m, agreement, &since);
  return support_by(m, agreement - outcomes, agreement % outcomes, bias, since);
}

/* Whether outcome j may be the cause of what the leading outcome keeps: it deviates by its own
 * behaviour, for no less long, and does not sum up the leading one. *score: of the best so far. */
static bool may_feed(const rim_monitor *m, uint16_t j, uint16_t leading, double *score) {
  if (j == leading || rimi_cause_score(m, j) < *score || !is_before(m, j, leading) ||
      rimi_cause_integrates(m, j, leading))
    return false;
  *score = rimi_cause_score(m, j);
  return true;
}

static uint32_t states_of(const rim_monitor *m, uint32_t outcome) {
  return rimi_rolled_states(rimi_blocks_basis(m->rows), &m->models.behaviour, outcome);
}

/* Whether an outcome is itself a state: it sums up what flows in and out of it. */
static bool is_state(const rim_monitor *m, uint32_t outcome) {
  const rim_basis *basis = rimi_blocks_basis(m->rows);
  for (size_t s = 0; s < basis->states; ++s) {
    if (rimi_le_index(basis->state, s, m->words[RIM_CONFIG_OUTCOMES]) == outcome)
      return true;
  }
  return false;
}

/* Of the outcomes that the states of the leading one do not move, the one that deviates most
 * clearly. A state that deviates less than what keeps nothing is not its cause: it would show
 * more. */
static uint16_t independent_cause(const rim_monitor *m, uint16_t leading, uint32_t states,
                                  double score) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  const bool keeps = is_state(m, leading);
  uint16_t best = leading;
  for (uint16_t j = 0; j < outcomes; ++j) {
    double reached = score;
    if (!keeps && is_state(m, j))
      continue;
    if (may_feed(m, j, leading, &reached) && (states_of(m, j) & states) == 0) {
      score = reached;
      best = j;
    }
  }
  return best;
}

/* What an outcome that is rolled forward keeps of others (a tank of what flows in) deviates with
 * them, longer and often more clearly, and so does all that is predicted from it. The cause is the
 * outcome that deviated first, by which the standing alarm is named; or one that deviates although
 * it is predicted without these states; or one that it is rolled from. */
static uint16_t rolled_cause(const rim_monitor *m, uint16_t leading) {
  const rim_basis *basis = rimi_blocks_basis(m->rows);
  const rim_alarm *standing = rim_monitor_standing(m, RIM_DETECTOR_RIM);
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint32_t states = leading < outcomes ? states_of(m, leading) : 0u;
  if (states == 0)
    return leading;
  const bool keeps = is_state(m, leading);
  double score =
      rimi_max(UPSTREAM * rimi_cause_score(m, leading), (double)m->models.threshold.alarm_score);
  double reached = score;
  if (keeps && standing != NULL && standing->channel[0] < outcomes &&
      may_feed(m, standing->channel[0], leading, &reached))
    return standing->channel[0];
  uint16_t best = independent_cause(m, leading, states, score);
  if (best != leading)
    return best;
  for (size_t s = 0; s < basis->states && keeps; ++s) {
    const uint16_t j = rimi_le_index(basis->state, s, outcomes);
    if ((states >> s & 1u) != 0 && may_feed(m, j, leading, &score))
      best = j;
  }
  return best;
}

/* What a leading sum (INTO) shows: the difference of its outcome from its twin; where they agree, a
 * deviation of what integrates it. */
static uint16_t shown_by_sum(const rim_monitor *m, uint16_t leading) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  uint16_t best = rimi_cause_is_into(m, leading) ? rimi_cause_shown_by(m, leading) : leading;
  double score = m->models.threshold.alarm_score;
  if (rimi_cause_is_into(m, best))
    better_channel_of(m,
                      (uint16_t)rimi_agreement_integral(&m->models.agreement, leading % outcomes),
                      &best, &score);
  return best;
}

/* Of the behaviour channels that may stand for the leading agreement channel, the one with the
 * largest score from `least` on that is below `below`; `leading`: there is none. */
static uint16_t next_behaviour(const rim_monitor *m, uint16_t leading, double least, double below) {
  uint16_t best = leading;
  for (uint16_t c = 0; c < m->words[RIM_CONFIG_OUTCOMES]; ++c) {
    const double score = rimi_cause_score(m, c);
    if (score >= least && score < below && !contradicts(m, leading, c)) {
      least = score;
      best = c;
    }
  }
  return best;
}

/* The other agreement whose disagreement with the leading one is clearest; `leading`: none. */
static uint16_t other_reading(const rim_monitor *m, uint16_t leading) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  uint16_t next = leading;
  double score = DISAGREES * rimi_cause_score(m, leading);
  for (uint16_t j = 0; j < outcomes; ++j) {
    const uint16_t c = (uint16_t)(RIM_CHANNEL_AGREEMENT * outcomes + j);
    if (c == leading || rimi_cause_is_into(m, c) || rimi_cause_score(m, c) < score)
      continue;
    score = rimi_cause_score(m, c);
    next = c;
  }
  return next;
}

/* By how many standard deviations of its noise in a block an agreement is off, by this shift. */
static double off_by(const rim_monitor *m, uint16_t c, const search_hypothesis *h) {
  const noise_channel n = rimi_noise_channel(&m->models.noise, c);
  const double rho = rimi_noise_rho(&n, false);
  return rimi_abs((double)h->shift) * rimi_sqrt(1.0 - rho * rho);
}

/* Neither a sum nor a twin's difference, of which others tell which is wrong. */
static bool follows_from_several(const rim_monitor *m, uint32_t outcome) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  return rimi_agreement_integral(&m->models.agreement, outcome) >= outcomes &&
         rimi_agreement_twin(&m->models.agreement, outcome, NULL) >= outcomes;
}

/* No gain, and not what runs differ by: what other agreements show there and then compares. */
static bool has_shift(const rim_monitor *m, uint16_t channel) {
  const search_hypothesis *h = rimi_search_best(m->search, channel);
  return !rimi_cause_is_gain(h) && h->family != SEARCH_FIELD;
}

/* For readings that say nearly the same, where no command tells which is wrong. An error of one
 * shows in the agreements of all that are predicted from it, and what runs differ by decides which
 * of them has the largest score. Where noise is normal and an agreement the regression on all
 * others, the wrong one is off by most of its own standard deviations: an error of reading j puts
 * P_ij / P_ii into agreement i, of standard deviation 1 / sqrt(P_ii), and P_ij^2 <= P_ii P_jj of a
 * precision matrix P. */
static uint16_t farthest_off(const rim_monitor *m, uint16_t leading) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  uint16_t with[CAUSE_COMPARED] = {leading}, best = leading;
  uint32_t count = 1;
  for (; count < CAUSE_COMPARED; ++count) {
    double most = DISAGREES * rimi_cause_score(m, leading);
    with[count] = leading;
    for (uint16_t j = 0; j < outcomes; ++j) {
      const uint16_t c = (uint16_t)(RIM_CHANNEL_AGREEMENT * outcomes + j);
      bool is_new = follows_from_several(m, j);
      for (uint32_t i = 0; i < count; ++i)
        is_new = is_new && with[i] != c;
      if (is_new && rimi_cause_score(m, c) > most) {
        most = rimi_cause_score(m, c);
        with[count] = c;
      }
    }
    if (with[count] == leading)
      break;
  }
  const search_hypothesis where = *rimi_search_best(m->search, leading);
  double most_off = PLAINER * off_by(m, leading, &where);
  for (uint32_t i = 1; i < count; ++i) {
    search_hypothesis same = where;
    if (!rimi_search_evaluate_channel(m->search, with[i], &same))
      continue;
    const double off = off_by(m, with[i], &same);
    if (off > most_off) {
      most_off = off;
      best = with[i];
    }
  }
  return best;
}

/* Two sensors disagree: their agreements deviate together, and the larger score need not be that of
 * the sensor that is off. One of them is. Where the commands deny that it is the leading one, it is
 * one of which they say so themselves; where there is none, the next agreement, unless they deny
 * that nearly as much. */
static uint16_t wrong_reading(const rim_monitor *m, uint16_t leading) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  if (rimi_agreement_integral(&m->models.agreement, leading % outcomes) < outcomes ||
      rimi_cause_score(m, leading % outcomes) >= SPEAKS)
    return leading;
  const bool compares = has_shift(m, leading) && follows_from_several(m, leading % outcomes);
  const double is_leading = confirmed(m, leading); /* which judging it may renew */
  if (is_leading > -SPEAKS)
    return is_leading < SPEAKS && compares ? farthest_off(m, leading) : leading;
  const uint16_t said =
      next_behaviour(m, leading, (double)m->models.threshold.alarm_score, DBL_MAX);
  if (said != leading && deviates_too(m, leading, said))
    return said;
  const uint16_t next = other_reading(m, leading);
  return next != leading && deviates_too(m, leading, next) &&
                 confirmed(m, next) >= is_leading + 2.0 * SPEAKS
             ? next
             : leading;
}

/* When the vehicle itself deviates, several of its sensors do, and agree. Of what deviates with the
 * leading agreement channel by its behaviour, the most clearly; CAUSE_TOGETHER are asked. One of
 * two sensors that read the same is not asked itself: what they differ by is its error, and its
 * behaviour, which may start from its wrong first reading, shows another one. */
static uint16_t behaviour_instead(const rim_monitor *m, uint16_t leading) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint16_t shown = rimi_cause_shown_by(m, leading);
  const double least =
      rimi_max(BEHAVIOUR_SHARE * rimi_cause_score(m, shown), m->models.threshold.alarm_score);
  double below = DBL_MAX;
  for (uint32_t asked = 0; asked < CAUSE_TOGETHER; ++asked) {
    const uint16_t c = next_behaviour(m, leading, least, below);
    if (c == leading)
      return leading;
    below = rimi_cause_score(m, c); /* which judging it may renew */
    if (c == leading % outcomes)
      return rimi_agreement_twin(&m->models.agreement, c, NULL) < outcomes ? leading : c;
    if (deviates_too(m, shown, c))
      return c;
  }
  return leading;
}

static uint16_t choose_channel(const rim_monitor *m, uint16_t leading) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  leading = shown_by_sum(m, leading);
  if (rimi_cause_is_into(m, leading))
    return leading;
  if (leading / outcomes <= RIM_CHANNEL_AGREEMENT)
    leading = integrated_cause(m, leading);
  if (leading / outcomes != RIM_CHANNEL_AGREEMENT)
    return rolled_cause(m, leading);
  leading = wrong_twin(m, leading);
  const uint16_t best = behaviour_instead(m, leading);
  return best != leading ? rolled_cause(m, best) : wrong_reading(m, leading);
}

bool rimi_cause_is_out_of_range(const rim_monitor *m, uint32_t outcome) {
  const blocks_health health = rimi_blocks_get_health(m->rows);
  return m->out_feature != BLOCKS_NO_FEATURE && health.out_of_range > health.rows_used / 2u &&
         rimi_blocks_outcome_feature(m->rows, outcome) == m->out_feature;
}

/* The channel of the outcome that is out of range, where it deviates, or where what leads is a sum
 * that it is in; otherwise this one. Such a sum tells sooner than the outcome's own channels, which
 * are clipped, but it tells the wrong name. */
static uint16_t out_of_range_or(const rim_monitor *m, uint16_t leading, uint16_t channel) {
  double score = m->models.threshold.alarm_score;
  for (uint16_t j = 0; j < m->words[RIM_CONFIG_OUTCOMES]; ++j) {
    if (!rimi_cause_is_out_of_range(m, j))
      continue;
    if (gain_of(m, leading, j).factor && rimi_search_best(m->search, j)->score > -1e9f)
      channel = j; /* its behaviour */
    better_channel_of(m, j, &channel, &score);
  }
  return channel;
}

/* Whether an outcome's readings repeat, clearly and mostly. */
static bool is_frozen(const rim_monitor *m, uint16_t repeats) {
  const double share = (double)rimi_search_best(m->search, repeats)->shift *
                       (double)rimi_noise_channel(&m->models.noise, repeats).s;
  return rimi_cause_score(m, repeats) >= m->models.threshold.alarm_score && share > FROZEN;
}

/* A reading that stands still soon deviates too: the repeats are the cause, where they are many. So
 * does one of which the others say what it should be, where one of these stands still: of them the
 * one that repeats most clearly. */
static uint16_t frozen_or(const rim_monitor *m, uint16_t channel) {
  const uint16_t outcomes = (uint16_t)m->words[RIM_CONFIG_OUTCOMES];
  const uint16_t first = (uint16_t)(RIM_CHANNEL_REPEAT * outcomes);
  const uint16_t own = (uint16_t)(first + channel % outcomes);
  if (is_frozen(m, own))
    return own;
  if (channel / outcomes != RIM_CHANNEL_AGREEMENT)
    return channel;
  double most = 0.0;
  for (uint16_t repeats = first; repeats < first + outcomes; ++repeats) {
    if (!is_frozen(m, repeats) || rimi_cause_score(m, repeats) <= most)
      continue;
    most = rimi_cause_score(m, repeats);
    channel = repeats;
  }
  return channel;
}

uint16_t rimi_cause(const rim_monitor *m, uint16_t leading) {
  return frozen_or(m, out_of_range_or(m, leading, choose_channel(m, leading)));
}
