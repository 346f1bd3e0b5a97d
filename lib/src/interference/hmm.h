/* SPDX-License-Identifier: MIT */
/* interference/hmm.h - hidden Markov model of few states: the forward algorithm in fixed memory
 * (thesis App. C.2, p. 129; Rabiner 1989).
 *
 * The state keeps the natural logarithm of P(S_t = i | o_1..o_t), normalised at every step, and the
 * sum of the normalisers ln P(o_1..o_t). Nothing underflows: sums are taken relative to their
 * largest term, and where a term is lost to the range of `double` the sum is taken again in
 * logarithms. A probability of exactly 0 (structural) has the logarithm RIM_HMM_LN_ZERO. */
#ifndef RIM_HMM_H
#define RIM_HMM_H

#include <stdint.h>

#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_HMM_MAX_STATES 8
#define RIM_HMM_LN_ZERO (-1e12)

typedef struct rim_hmm_model {
  uint32_t states; /* 1..RIM_HMM_MAX_STATES */
  double initial[RIM_HMM_MAX_STATES];
  double transition[RIM_HMM_MAX_STATES][RIM_HMM_MAX_STATES]; /* [from][to], rows sum to 1 */
} rim_hmm_model;

/* Private to the functions below; copy it to save it. 1.3 kB. */
typedef struct rim_hmm {
  rim_hmm_model model;
  double ln_transition[RIM_HMM_MAX_STATES][RIM_HMM_MAX_STATES];
  double ln_alpha[RIM_HMM_MAX_STATES]; /* ln P(S_t = i | o_1..o_t) */
  double alpha[RIM_HMM_MAX_STATES];    /* the same, 0 where it is lost */
  double ln_evidence;                  /* ln P(o_1..o_t) since the last reset */
  uint32_t steps;                      /* observations since the last reset, saturating */
  uint32_t resets;                     /* saturating */
  uint32_t refused;                    /* observations refused, saturating */
} rim_hmm;

/* Sets up. Rows and initial may sum to 1 within 1e-6. RIM_E_ARGUMENT NULL; RIM_E_RANGE states;
 * RIM_E_DATA a probability not in [0, 1], or a sum that is not 1. Unchanged on error.
 * O(states^2), a logarithm each. */
rim_status rimi_hmm_init(rim_hmm *hmm, const rim_hmm_model *model);

/* Takes one observation: ln_emission[states] is ln b_i(o_t), each at most 1e9 in size or
 * RIM_HMM_LN_ZERO (or less) for an impossible one. RIM_E_ARGUMENT NULL; RIM_E_DATA NaN, or too
 * large, or no state possible: counted in `refused`, otherwise unchanged. O(states^2)
 * multiply-adds, states exponentials, states + 1 logarithms; the rare sum in logarithms adds
 * O(states) exponentials for a state. Stack below 400 bytes. */
rim_status rimi_hmm_step(rim_hmm *hmm, const double *ln_emission);

/* Back to the initial distribution; counted. Before the first step the posterior is the initial. */
void rimi_hmm_reset(rim_hmm *hmm);

/* The same, not counted, with every state as likely as any other. */
void rimi_hmm_begin_anywhere(rim_hmm *hmm);

/* ln P / (1 - P) of P(S_t = state | o_1..o_t), exact also where P rounds to 0 or 1;
 * RIM_HMM_LN_ZERO for a state that is not there. O(states). */
double rimi_hmm_ln_odds(const rim_hmm *hmm, uint32_t state);

/* Transition probabilities from counts[from * states + to] (eq. C.1), with `smoothing` > 0 counts
 * added to each so that none is 0; `initial` becomes 1 for state 0. *unseen (may be NULL): bit i
 * set where nothing was seen to leave state i: its row is uniform. RIM_E_ARGUMENT, RIM_E_RANGE;
 * RIM_E_DATA: a count negative or not finite, smoothing not above 0. Unchanged on error. */
rim_status rimi_hmm_from_counts(rim_hmm_model *model, uint32_t states, const double *counts,
                                double smoothing, uint32_t *unseen);

#ifdef __cplusplus
}
#endif
#endif
