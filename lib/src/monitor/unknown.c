/* SPDX-License-Identifier: MIT */
/* Of which channels a block says nothing. */
#include <string.h>

#include "base/bytes.h"
#include "image/rolled.h"
#include "monitor/monitor_private.h"

#define ROUNDED 1e-7 /* of a number of the image */

/* Nothing is known of outcomes that depend on these states: bit s for state s. */
static void doubt_states(const rim_monitor *m, uint32_t uncertain, double *error) {
  const rim_basis *basis = rimi_blocks_basis(m->rows);
  for (uint32_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o) {
    if ((rimi_rolled_states(basis, &m->models.behaviour, o) & uncertain) != 0)
      error[o] = MONITOR_NOT_KNOWN;
  }
}

/* After a long gap a state went on from a reading, whose noise it keeps for as long as what is put
 * into it. That is as it always is where the noise itself lasts. Elsewhere nothing is known for so
 * long of what the state carries, and a healthy run would show a step, unless the healthy runs had
 * such gaps as well. */
static void add_resumed(const rim_monitor *m, double *error) {
  const rim_basis *basis = rimi_blocks_basis(m->rows);
  if (!rimi_blocks_has_resumed(m->rows) || m->models.noise.with_gaps)
    return;
  uint32_t uncertain = 0;
  for (uint32_t s = 0; s < basis->states; ++s) {
    const size_t o = rimi_le_index(basis->state, s, m->words[RIM_CONFIG_OUTCOMES]);
    const double rho = (double)rimi_noise_channel(&m->models.noise, (uint32_t)o).rho;
    if (rimi_blocks_state_kept(m->rows)[s] * (1.0 - rho) > MONITOR_MOST_UNKNOWN + ROUNDED)
      uncertain |= UINT32_C(1) << s;
  }
  doubt_states(m, uncertain, error);
}

/* The states of which short gaps have left more unknown than their outcome's noise hides. */
static uint32_t lost_states(const rim_monitor *m) {
  const rim_basis *basis = rimi_blocks_basis(m->rows);
  const double *variance = rimi_blocks_state_variance(m->rows);
  uint32_t lost = 0;
  for (uint32_t s = 0; s < basis->states; ++s) {
    const size_t o = rimi_le_index(basis->state, s, m->words[RIM_CONFIG_OUTCOMES]);
    const noise_channel n = rimi_noise_channel(&m->models.noise, (uint32_t)o);
    const double known = MONITOR_MOST_UNKNOWN * (double)n.s / (1.0 - (double)n.rho);
    if (variance[s] > known * known)
      lost |= UINT32_C(1) << s;
  }
  return lost;
}

/* Where a run is longer than all that were learnt from, what gathers over a run goes where no
 * healthy run has been: sums, and states that are rolled forward. */
static bool gathers_too_long(const rim_monitor *m) {
  return rimi_blocks_beyond_learnt(m->rows) > MONITOR_BEYOND;
}

/* The states that gather over a run; the others have forgotten how they began. */
static uint32_t gathering_states(const rim_monitor *m) {
  uint32_t gathering = 0;
  for (uint32_t s = 0; s < rimi_blocks_basis(m->rows)->states; ++s) {
    if (rimi_blocks_state_kept(m->rows)[s] > MONITOR_FORGOTTEN)
      gathering |= UINT32_C(1) << s;
  }
  return gathering;
}

static bool is_sum(const rim_monitor *m, size_t o) {
  const uint32_t source = rimi_agreement_source(&m->models.agreement, (uint32_t)o);
  return source == AGREEMENT_INTEGRAL || source == AGREEMENT_INTO;
}

static bool is_out(const rim_monitor *m, uint32_t o) {
  return rimi_blocks_is_out(m->rows, rimi_blocks_outcome_feature(m->rows, o));
}

/* Whether the outcome is held against another reading that is out of range. That is limited, and so
 * does not say what the vehicle did. */
static bool relies_on_out(const rim_monitor *m, uint32_t o) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  const uint16_t own = rimi_blocks_outcome_feature(m->rows, o);
  for (uint32_t f = 0; f < m->words[RIM_CONFIG_FEATURES]; ++f) {
    if (f == own || !rimi_blocks_is_out(m->rows, (uint16_t)f))
      continue;
    uint32_t j = 0;
    while (j < outcomes && rimi_blocks_outcome_feature(m->rows, j) != f)
      ++j;
    if (rimi_agreement_takes(&m->models.agreement, o, j, (uint16_t)f) ||
        rimi_agreement_source(&m->models.agreement, o) == AGREEMENT_QUADRATIC)
      return true;
  }
  return false;
}

static bool any_is_out(const rim_monitor *m) {
  bool any = false;
  for (uint32_t f = 0; f < m->words[RIM_CONFIG_FEATURES]; ++f)
    any = any || rimi_blocks_is_out(m->rows, (uint16_t)f);
  return any;
}

/* How uncertain the behaviour residual of another outcome is, where it is out of range. */
static void doubt_out(const rim_monitor *m, double *error) {
  for (uint32_t o = 0; o < m->words[RIM_CONFIG_OUTCOMES]; ++o) {
    if (is_out(m, o))
      error[o] = MONITOR_NOT_KNOWN;
  }
}

/* Uncertainty of what an outcome's agreement with others says. Where its own reading is out of
 * range, that is what it is to say. */
static double agreement_error(const rim_monitor *m, uint32_t o, bool too_long,
                              const double *error) {
  if (is_out(m, o))
    return 0.0;
  if (((too_long || rimi_blocks_jumped(m->rows)) && is_sum(m, o)) || relies_on_out(m, o))
    return MONITOR_NOT_KNOWN;
  return rimi_agreement_error(&m->models.agreement, o, rimi_blocks_means(m->rows), error);
}

/* error: standard deviation of a channel's nominal value. Returns whether the channel is watched
 * and the block says nothing of it. */
static bool mark(rim_monitor *m, uint32_t kind, uint32_t o, double error) {
  const uint32_t c = kind * m->words[RIM_CONFIG_OUTCOMES] + o;
  const noise_channel n = rimi_noise_channel(&m->models.noise, c);
  /* An error that lasts shows in what is new in a block by so much less. */
  m->unknown[c] = error * (1.0 - (double)n.rho) > MONITOR_MOST_UNKNOWN * (double)n.s;
  return m->unknown[c] && n.active > 0.5f;
}

/* What a channel should be may follow from commands of which too much is not known, or from a
 * reading that is out of range. Returns whether that is so of a channel that is watched. */
static bool hide_what_is_not_known(rim_monitor *m) {
  const size_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  if (m->words[RIM_CONFIG_EXTERNAL] != 0 || rimi_blocks_knows_all(m->rows))
    return false;
  double *error = m->level; /* [2 O]: agree() is done with it */
  bool any = false;
  rimi_behaviour_error(&m->models.behaviour, rimi_blocks_unknown(m->rows),
                       rimi_blocks_knows_start(m->rows), error);
  add_resumed(m, error);
  doubt_states(m, rimi_blocks_out_states(m->rows) | lost_states(m), error);
  const bool too_long = gathers_too_long(m);
  if (too_long)
    doubt_states(m, gathering_states(m), error);
  for (uint32_t o = 0; o < outcomes; ++o)
    any = mark(m, RIM_CHANNEL_BEHAVIOUR, o, error[o]) || any;
  doubt_out(m, error); /* of what the others are held against */
  for (uint32_t o = 0; o < outcomes; ++o) {
    any = mark(m, RIM_CHANNEL_AGREEMENT, o, agreement_error(m, o, too_long, error)) || any;
    const double limited = is_out(m, o) ? MONITOR_NOT_KNOWN : 0.0; /* is no reading of its own */
    any = mark(m, RIM_CHANNEL_SCATTER, o, error[outcomes + o] + limited) || any;
    (void)mark(m, RIM_CHANNEL_REPEAT, o, limited); /* needs no model */
    /* A step follows from all readings, which may be out of range, or where none has been. */
    if (monitor_has_steps(m))
      (void)mark(m, RIM_CHANNEL_STEP, o, too_long || any_is_out(m) ? MONITOR_NOT_KNOWN : 0.0);
  }
  return any;
}

/* Nor does section LEVEL say anything of a block beyond what it was trained on. */
static void hide_levels(rim_monitor *m) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  bool beyond[RIM_NOMINAL_MAX_OUTPUTS] = {false};
  uint16_t own[RIM_NOMINAL_MAX_OUTPUTS];
  double input[RIM_NOMINAL_MAX_INPUTS];
  for (uint32_t o = 0; o < outcomes; ++o)
    own[o] = rimi_blocks_outcome_feature(m->rows, o);
  (void)rimi_level_inputs(rimi_blocks_roles(m->rows), m->words[RIM_CONFIG_FEATURES],
                          rimi_blocks_context(m->rows), input);
  (void)rimi_nominal_beyond(&m->models.level, input, own, beyond);
  for (uint32_t o = 0; o < outcomes; ++o) {
    if (beyond[o] && rimi_agreement_source(&m->models.agreement, o) == AGREEMENT_LEVEL)
      m->unknown[RIM_CHANNEL_AGREEMENT * outcomes + o] = true;
  }
}

/* Nor do too few readings in a row say how much they scatter and repeat. */
static void hide_readings(rim_monitor *m) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  for (uint32_t o = 0; o < outcomes; ++o) {
    m->unknown[RIM_CHANNEL_SCATTER * outcomes + o] = true;
    m->unknown[RIM_CHANNEL_REPEAT * outcomes + o] = true;
  }
}

/* Nor does a block that does not follow on another say anything of what products of readings of the
 * block before let expect. */
static void hide_products(rim_monitor *m) {
  const uint32_t outcomes = m->words[RIM_CONFIG_OUTCOMES];
  for (uint32_t o = 0; o < outcomes; ++o) {
    if (rimi_agreement_source(&m->models.agreement, o) == AGREEMENT_QUADRATIC)
      m->unknown[RIM_CHANNEL_AGREEMENT * outcomes + o] = true;
    if (monitor_has_steps(m))
      m->unknown[RIM_CHANNEL_STEP * outcomes + o] = true;
  }
}

bool rimi_monitor_find_unknown(rim_monitor *m, bool is_beyond, bool is_next) {
  memset(m->unknown, 0, m->channel_count * sizeof *m->unknown);
  const bool partly = hide_what_is_not_known(m);
  if (is_beyond)
    hide_levels(m);
  if (!rimi_blocks_knows_readings(m->rows))
    hide_readings(m);
  if (!is_next && m->models.quadratic.section != NULL)
    hide_products(m);
  return partly;
}
