/* SPDX-License-Identifier: MIT */
/* rim/bandit.h - which action to take, given what is uncertain about the model (thesis ch. 5 and
 * app. B): the contextual bandit by upper confidence bounds.
 *
 * Each turn the caller sees a state and proposes actions: for each the features x = chi(s, a) and
 * what the nominal model expects of it. rim_bandit_choose returns the one with the highest
 *
 *   mean + sqrt(beta_t) sd                                                            (eq. 5.1)
 *
 * and rim_bandit_observe takes the reward that it brought. Policies:
 *
 *   GP-UCB       nominal mean + a GP on the deviations from it (CGP-UCB, 5.1)
 *   RIM-UCB      nominal mean shifted by the RIMs (Algorithm 5, eq. 5.9, 5.12). sd^2 of the model
 *                without a RIM is the variance of a zero-mean GP over where observations were made,
 *                whatever they were: the prior of an unseen RIM (p. 69); that of a RIM its standard
 *                error
 *   RIM+GP-UCB   RIMs, and a GP on what the model they correct leaves (Algorithms 6, 7; eq. 5.13)
 *   bank         one GP for each of a finite set of plans, over the state alone (Algorithm 9, B.1)
 *
 * Safe exploration (7.2.7): actions that are not allowed are never returned, whatever their value.
 * Among actions of equal value one is drawn at random from the seed.
 *
 * One flat block without pointers into itself: its bytes copied elsewhere (aligned to 8) go on as
 * the original would. No allocation; equal calls give equal bits on every target. Functions
 * returning rim_status change nothing on error, except counters. Stack below 4 kB. */
#ifndef RIM_BANDIT_H
#define RIM_BANDIT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "rim/plan/extent.h"
#include "rim/plan/gp.h"
#include "rim/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define RIM_BANDIT_MAX_PLANS 64
#define RIM_BANDIT_HEADER_BYTES 1024

typedef enum rim_bandit_policy {
  RIM_BANDIT_GP_UCB = 0,
  RIM_BANDIT_RIM_UCB = 1,
  RIM_BANDIT_RIM_GP_UCB = 2,
  RIM_BANDIT_BANK = 3
} rim_bandit_policy;

/* beta_t, t = 1 for the first choice. */
typedef enum rim_bandit_schedule {
  RIM_BANDIT_BETA_CONSTANT = 0, /* beta */
  RIM_BANDIT_BETA_LOG = 1,      /* beta * 2 ln(a t^2 pi^2 / (6 delta)), a the number of actions
                                   proposed (Srinivas et al. 2010, theorem 1, for beta 1) */
  RIM_BANDIT_BETA_DECAY = 2     /* beta / t^power */
} rim_bandit_schedule;

/* What is maximised (7.2.7). P(r > level) is that of the mixture of normals with the reward's own
 * noise. */
typedef enum rim_bandit_risk {
  RIM_BANDIT_NEUTRAL = 0,    /* mean + sqrt(beta) sd */
  RIM_BANDIT_MEAN_SD = 1,    /* mean + sqrt(beta) sd - aversion * sd of the reward, its noise
                                included; aversion below 0 seeks risk */
  RIM_BANDIT_BOUNDED = 2,    /* neutral among the allowed actions with P(r > level) >= bound; where
                                there is none, the allowed action with the largest P */
  RIM_BANDIT_PROBABILITY = 3 /* P(r > level) */
} rim_bandit_risk;

/* Zero-initialise, then fill. */
typedef struct rim_bandit_config {
  uint8_t policy;   /* rim_bandit_policy */
  uint8_t schedule; /* rim_bandit_schedule */
  uint8_t risk;     /* rim_bandit_risk */
  uint8_t plans;    /* bank only: 1..RIM_BANDIT_MAX_PLANS */
  double beta;      /* >= 0; 0: never explore */
  double delta;     /* RIM_BANDIT_BETA_LOG: in (0, 1); 0: 0.1 */
  double power;     /* RIM_BANDIT_BETA_DECAY: in (0, 4]; 0: 1 */
  double aversion;
  double level;     /* in the reward's unit */
  double bound;     /* in [0, 1] */
  uint16_t slices;  /* rim_extent_search after every observation; 0: 6 */
  uint64_t seed;    /* of draws among equals */
  rim_gp_config gp; /* each plan's for the bank. Its mean should be 0: it is added to the nominal
                       model's, except with RIM-UCB */
  /* Beyond the thesis; 0 leaves each out. All >= 0. */
  double smooth_var; /* policies with RIM: added to the variance of every deviation in the search
                        for regions: what deviates by less makes no RIM */
  double unseen_var; /* RIM+GP-UCB: prior variance of the shift of a RIM not seen yet (the prior of
                        p. 69), added to that of the component without a RIM in proportion to the
                        GP's; RIM-UCB takes gp.signal_var for it */
  double gain; /* RIM+GP-UCB: nats of the GP's marginal likelihood by which the corrected model
                  must beat the nominal one for the RIMs to be as likely as not: what the GP
                  explains as well is left to it. 0: by ln anom alone (eq. 5.2) */
  rim_extent_config extent; /* policies with RIM; dims must be gp.dims */
} rim_bandit_config;

/* Bytes of a bandit without RIMs and with them. RIM_BANDIT_SIZE_BANK for `plans` plans. */
#define RIM_BANDIT_SIZE_GP(dims, points) (RIM_BANDIT_HEADER_BYTES + RIM_GP_SIZE(dims, points))
#define RIM_BANDIT_SIZE_RIM(dims, points, extent_points, lambdas, rims)                            \
  (RIM_BANDIT_SIZE_GP(dims, points) + RIM_EXTENT_SIZE(dims, extent_points, lambdas, rims))
#define RIM_BANDIT_SIZE_BANK(dims, points, plans)                                                  \
  (RIM_BANDIT_HEADER_BYTES + (size_t)(plans)*RIM_GP_SIZE(dims, points))

/* What may be done this turn. */
typedef struct rim_bandit_actions {
  uint32_t count;         /* 1..; the bank: plans */
  const double *x;        /* [count][dims] features of state and action; the bank: [dims], of the
                             state alone */
  const double *nominal;  /* [count] expected reward of the nominal model; NULL: 0 */
  const double *var;      /* [count] nominal variance of the reward; NULL: gp.noise_var. Matters to
                             the risk settings only */
  const uint8_t *allowed; /* [count] 0: never choose it; NULL: all are allowed */
} rim_bandit_actions;

typedef struct rim_bandit_choice {
  uint32_t action;    /* index into the actions */
  double value;       /* what was maximised */
  double mean;        /* expected reward (eq. 5.9) */
  double sd;          /* of that expectation (eq. 5.12) */
  double beta;        /* beta_t */
  double member;      /* 1 - w_0 (eq. 5.10); 0 without RIMs */
  double probability; /* P(r > level); 0 unless the risk setting asks for it */
  bool bound_met;     /* RIM_BANDIT_BOUNDED: false when no allowed action meets the bound */
} rim_bandit_choice;

/* Saturating. */
typedef struct rim_bandit_counters {
  uint32_t choices;
  uint32_t observations; /* taken in */
  uint32_t refused;      /* observations with a number that is not finite */
  uint32_t unusable;     /* allowed actions with such a number, passed over */
  uint32_t none_allowed; /* turns without an action to choose */
} rim_bandit_counters;

typedef struct rim_bandit rim_bandit;

/* Writes the bytes that a configuration needs. RIM_E_ARGUMENT: NULL; RIM_E_CONFIG. */
rim_status rim_bandit_size(const rim_bandit_config *config, size_t *bytes);

/* Makes a bandit that has seen nothing. RIM_E_ARGUMENT: NULL; RIM_E_ALIGN: memory not aligned to 8;
 * RIM_E_CONFIG: policy, schedule, risk, plans, delta or bound out of range, or dims that disagree;
 * RIM_E_RANGE: a number not finite, beta < 0; RIM_E_SIZE: fewer bytes than the macros say; and the
 * statuses of rim_gp_init and rim_extent_init. */
rim_status rim_bandit_init(rim_bandit **bandit, void *memory, size_t bytes,
                           const rim_bandit_config *config);

/* Chooses one of the actions. Actions with x, nominal or var not finite are passed over and
 * counted. RIM_OK; RIM_E_ARGUMENT: NULL; RIM_E_RANGE: count 0, or for the bank not `plans`;
 * RIM_E_DATA: no action is allowed and usable: *choice unchanged, counted: the caller must fall
 * back on what is safe. O(count n^2), n observations held: 200 actions with 200 observations some 1
 * ms on a PC. */
rim_status rim_bandit_choose(rim_bandit *bandit, const rim_bandit_actions *actions,
                             rim_bandit_choice *choice);

/* Takes in what an action brought: x[dims] of that action (the bank: of the state) and `plan` (the
 * bank: which; otherwise not looked at), the nominal model's expectation and variance (> 0; 0:
 * gp.noise_var or, where that is 0 too, gp.signal_var; the bank does not look at it), and the
 * reward. With RIMs: rim_extent_add, rim_extent_search, and the GP's offsets anew. A variance given
 * replaces gp.noise_var for this point, unless it is smaller. RIM_E_DATA: a number not finite or
 * var < 0: counted, nothing learnt; RIM_E_RANGE: plan. RIM_E_SINGULAR: as rim_gp_add.
 * O(n^2) and rim_extent_search. */
rim_status rim_bandit_observe(rim_bandit *bandit, const double *x, uint32_t plan, double nominal,
                              double var, double reward);

/* What it expects of one action's features now: mean (eq. 5.9) and variance (eq. 5.12) of the
 * expected reward. plan as above. RIM_E_DATA: not finite; RIM_E_RANGE: plan. O(n^2). */
rim_status rim_bandit_expect(rim_bandit *bandit, const double *x, uint32_t plan, double nominal,
                             double *mean, double *var);

/* beta_t for turn t = 1, 2, ... among this many actions. */
double rim_bandit_beta(const rim_bandit *bandit, uint32_t turn, uint32_t actions);

/* The parts, inside the bandit's memory: to look at, to draw, to fit hyperparameters. plan is 0
 * except for the bank. NULL where there is none. */
rim_gp *rim_bandit_gp(rim_bandit *bandit, uint32_t plan);
rim_extent *rim_bandit_extent(rim_bandit *bandit);

rim_bandit_config rim_bandit_get_config(const rim_bandit *bandit);
rim_bandit_counters rim_bandit_get_counters(const rim_bandit *bandit);

#ifdef __cplusplus
}
#endif
#endif
