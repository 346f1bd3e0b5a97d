/* SPDX-License-Identifier: MIT */
#include "interference/hmm.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/real.h"

#define N RIM_HMM_MAX_STATES
#define SUM_TOLERANCE 1e-6
#define LARGEST_LN 1e9
/* exp() of less is lost beside 1; a sum of terms above it, times transitions, is normal. */
#define LEAST_SUM 1e-290
#define LEAST_LN (-667.0) /* ln of about that */

static void count_up(uint32_t *n) {
  if (*n < UINT32_MAX)
    ++*n;
}

static double ln_of(double p) { return p > 0.0 ? rimi_log(p) : RIM_HMM_LN_ZERO; }

static bool is_distribution(const double *p, uint32_t n) {
  double sum = 0.0;
  for (uint32_t i = 0; i < n; ++i) {
    if (!(p[i] >= 0.0 && p[i] <= 1.0))
      return false;
    sum += p[i];
  }
  return rimi_abs(sum - 1.0) <= SUM_TOLERANCE;
}

static double largest(const double *x, uint32_t n) {
  double most = x[0];
  for (uint32_t i = 1; i < n; ++i)
    most = rimi_max(most, x[i]);
  return most;
}

/* initial: NULL for the same of every state. */
static void restart(rim_hmm *hmm, const double *initial) {
  for (uint32_t i = 0; i < hmm->model.states; ++i) {
    hmm->alpha[i] = initial != NULL ? initial[i] : 1.0 / (double)hmm->model.states;
    hmm->ln_alpha[i] = ln_of(hmm->alpha[i]);
  }
  hmm->ln_evidence = 0.0;
  hmm->steps = 0;
}

rim_status rimi_hmm_init(rim_hmm *hmm, const rim_hmm_model *model) {
  if (hmm == NULL || model == NULL)
    return RIM_E_ARGUMENT;
  if (model->states < 1 || model->states > N)
    return RIM_E_RANGE;
  if (!is_distribution(model->initial, model->states))
    return RIM_E_DATA;
  for (uint32_t i = 0; i < model->states; ++i) {
    if (!is_distribution(model->transition[i], model->states))
      return RIM_E_DATA;
  }
  const rim_hmm_model copy = *model; /* it may lie in *hmm */
  memset(hmm, 0, sizeof *hmm);
  hmm->model = copy;
  for (uint32_t i = 0; i < copy.states; ++i) {
    for (uint32_t j = 0; j < copy.states; ++j)
      hmm->ln_transition[i][j] = ln_of(copy.transition[i][j]);
  }
  restart(hmm, hmm->model.initial);
  return RIM_OK;
}

/* ln sum_i exp(ln_alpha_i) a_ij, in logarithms throughout. */
static double ln_reach(const rim_hmm *hmm, uint32_t j) {
  double term[N] = {0};
  for (uint32_t i = 0; i < hmm->model.states; ++i)
    term[i] = hmm->ln_alpha[i] + hmm->ln_transition[i][j];
  const double most = largest(term, hmm->model.states);
  double sum = 0.0;
  for (uint32_t i = 0; i < hmm->model.states; ++i)
    sum += rimi_exp(term[i] - most);
  return most + rimi_log(sum);
}

/* ln P(S_t = j | o_1..o_(t-1)) into ln_p, where j is possible at all; the first observation meets
 * the initial distribution. */
static void predict(const rim_hmm *hmm, const double *ln_emission, double *ln_p) {
  const uint32_t n = hmm->model.states;
  if (hmm->steps == 0) {
    memcpy(ln_p, hmm->ln_alpha, n * sizeof *ln_p);
    return;
  }
  double sum[N] = {0};
  for (uint32_t i = 0; i < n; ++i) {
    const double alpha = hmm->alpha[i];
    for (uint32_t j = 0; j < n; ++j)
      sum[j] += alpha * hmm->model.transition[i][j];
  }
  for (uint32_t j = 0; j < n; ++j) {
    if (ln_emission[j] > RIM_HMM_LN_ZERO)
      ln_p[j] = sum[j] > LEAST_SUM ? rimi_log(sum[j]) : ln_reach(hmm, j);
  }
}

rim_status rimi_hmm_step(rim_hmm *hmm, const double *ln_emission) {
  if (hmm == NULL || ln_emission == NULL || hmm->model.states == 0)
    return RIM_E_ARGUMENT;
  const uint32_t n = hmm->model.states;
  double ln_p[N] = {0};
  predict(hmm, ln_emission, ln_p);
  for (uint32_t j = 0; j < n; ++j) {
    const double b = ln_emission[j];
    if (!(b <= LARGEST_LN && (b >= -LARGEST_LN || b <= RIM_HMM_LN_ZERO))) {
      count_up(&hmm->refused);
      return RIM_E_DATA;
    }
    ln_p[j] = rimi_max(ln_p[j] + b, RIM_HMM_LN_ZERO);
  }
  const double most = largest(ln_p, n);
  if (!(most > RIM_HMM_LN_ZERO)) {
    count_up(&hmm->refused);
    return RIM_E_DATA;
  }
  double sum = 0.0;
  for (uint32_t j = 0; j < n; ++j) {
    hmm->alpha[j] = ln_p[j] - most > LEAST_LN ? rimi_exp(ln_p[j] - most) : 0.0;
    sum += hmm->alpha[j];
  }
  const double norm = most + rimi_log(sum);
  const double inverse = 1.0 / sum;
  for (uint32_t j = 0; j < n; ++j) {
    hmm->alpha[j] *= inverse;
    hmm->ln_alpha[j] = ln_p[j] > RIM_HMM_LN_ZERO ? ln_p[j] - norm : RIM_HMM_LN_ZERO;
  }
  hmm->ln_evidence += norm;
  count_up(&hmm->steps);
  return RIM_OK;
}

void rimi_hmm_reset(rim_hmm *hmm) {
  if (hmm == NULL)
    return;
  restart(hmm, hmm->model.initial);
  count_up(&hmm->resets);
}

void rimi_hmm_begin_anywhere(rim_hmm *hmm) { restart(hmm, NULL); }

double rimi_hmm_ln_odds(const rim_hmm *hmm, uint32_t state) {
  if (hmm == NULL || state >= hmm->model.states)
    return RIM_HMM_LN_ZERO;
  double sum = 0.0, most = RIM_HMM_LN_ZERO;
  for (uint32_t i = 0; i < hmm->model.states; ++i) {
    if (i == state)
      continue;
    sum += hmm->alpha[i];
    most = rimi_max(most, hmm->ln_alpha[i]);
  }
  if (sum > LEAST_SUM)
    return hmm->ln_alpha[state] - rimi_log(sum);
  sum = 0.0;
  for (uint32_t i = 0; i < hmm->model.states; ++i) {
    if (i != state)
      sum += rimi_exp(hmm->ln_alpha[i] - most);
  }
  return hmm->ln_alpha[state] - (sum > 0.0 ? most + rimi_log(sum) : RIM_HMM_LN_ZERO);
}

rim_status rimi_hmm_from_counts(rim_hmm_model *model, uint32_t states, const double *counts,
                                double smoothing, uint32_t *unseen) {
  if (model == NULL || counts == NULL)
    return RIM_E_ARGUMENT;
  if (states < 1 || states > N)
    return RIM_E_RANGE;
  if (!(smoothing > 0.0) || !rimi_is_finite(smoothing))
    return RIM_E_DATA;
  for (uint32_t i = 0; i < states * states; ++i) {
    if (!(counts[i] >= 0.0) || !rimi_is_finite(counts[i]))
      return RIM_E_DATA;
  }
  memset(model, 0, sizeof *model);
  model->states = states;
  model->initial[0] = 1.0;
  uint32_t mask = 0;
  for (uint32_t i = 0; i < states; ++i) {
    double sum = 0.0;
    for (uint32_t j = 0; j < states; ++j)
      sum += counts[i * states + j];
    if (!(sum > 0.0))
      mask |= UINT32_C(1) << i;
    for (uint32_t j = 0; j < states; ++j)
      model->transition[i][j] = (counts[i * states + j] + smoothing) / (sum + smoothing * states);
  }
  if (unseen != NULL)
    *unseen = mask;
  return RIM_OK;
}
