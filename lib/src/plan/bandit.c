/* SPDX-License-Identifier: MIT */
#include "rim/plan/bandit.h"

#include <string.h>

#include "base/real.h"
#include "base/rng.h"
#include "base/usable.h"

#define STREAM                                                                                     \
  UINT64_C(0x62616e646974) /* the draws among equals: apart from the search's streams */

struct rim_bandit {
  rim_bandit_config config;
  rim_bandit_counters counters;
  uint32_t turn;  /* choices made */
  double support; /* what the GP leaves of the RIMs' existence, 0..1 */
  rim_rng rng;
};

_Static_assert(sizeof(struct rim_bandit) <= RIM_BANDIT_HEADER_BYTES, "header");
_Static_assert(RIM_BANDIT_HEADER_BYTES % 8 == 0, "blocks of double follow");

static bool has_rims(const rim_bandit_config *c) {
  return c->policy == RIM_BANDIT_RIM_UCB || c->policy == RIM_BANDIT_RIM_GP_UCB;
}

static uint32_t plans_of(const rim_bandit_config *c) {
  return c->policy == RIM_BANDIT_BANK ? c->plans : 1u;
}

static bool is_extra(double v) { return v >= 0.0 && v <= 1e100; }

static rim_status complete(rim_bandit_config *c) {
  if (c->policy > RIM_BANDIT_BANK || c->schedule > RIM_BANDIT_BETA_DECAY ||
      c->risk > RIM_BANDIT_PROBABILITY) {
    return RIM_E_CONFIG;
  }
  if (c->policy == RIM_BANDIT_BANK && (c->plans < 1 || c->plans > RIM_BANDIT_MAX_PLANS)) {
    return RIM_E_CONFIG;
  }
  if (has_rims(c) && c->extent.dims != c->gp.dims)
    return RIM_E_CONFIG;
  if (!is_usable(c->beta) || c->beta < 0.0 || !is_usable(c->delta) || !is_usable(c->power) ||
      !is_usable(c->aversion) || !is_usable(c->level) || !is_usable(c->bound) ||
      !is_extra(c->smooth_var) || !is_extra(c->unseen_var) || !is_extra(c->gain)) {
    return RIM_E_RANGE;
  }
  RIM_OR_DEFAULT(c->delta, 0.1);
  RIM_OR_DEFAULT(c->power, 1.0);
  RIM_OR_DEFAULT(c->slices, 6);
  const bool fine = c->power > 0.0 && c->power <= 4.0 && c->delta > 0.0 && c->delta < 1.0 &&
                    c->bound >= 0.0 && c->bound <= 1.0;
  return fine ? RIM_OK : RIM_E_CONFIG;
}

static size_t gp_bytes(const rim_bandit_config *c) { return RIM_GP_SIZE(c->gp.dims, c->gp.points); }

static size_t extent_bytes(const rim_bandit_config *c) {
  const size_t lambdas = c->extent.lambdas > 0 ? c->extent.lambdas : RIM_EXTENT_DEFAULT_LAMBDAS;
  const size_t rims = c->extent.rims > 0 ? c->extent.rims : 1;
  return has_rims(c) ? RIM_EXTENT_SIZE(c->extent.dims, c->extent.points, lambdas, rims) : 0;
}

static size_t total_bytes(const rim_bandit_config *c) {
  return RIM_BANDIT_HEADER_BYTES + plans_of(c) * gp_bytes(c) + extent_bytes(c);
}

/* The parts, located in every call: the block may have been moved. */
static uint8_t *part_at(const rim_bandit *b, size_t offset) {
  return (uint8_t *)(uintptr_t)b + RIM_BANDIT_HEADER_BYTES + offset;
}

static rim_gp *gp_of(const rim_bandit *b, uint32_t plan) {
  return (rim_gp *)(void *)part_at(b, plan * gp_bytes(&b->config));
}

static rim_extent *extent_of(const rim_bandit *b) {
  return (rim_extent *)(void *)part_at(b, plans_of(&b->config) * gp_bytes(&b->config));
}

rim_status rim_bandit_size(const rim_bandit_config *config, size_t *bytes) {
  if (config == NULL || bytes == NULL)
    return RIM_E_ARGUMENT;
  rim_bandit_config c = *config;
  const rim_status status = complete(&c);
  if (status == RIM_OK)
    *bytes = total_bytes(&c);
  return status;
}

rim_status rim_bandit_init(rim_bandit **bandit, void *memory, size_t bytes,
                           const rim_bandit_config *config) {
  if (bandit == NULL || memory == NULL || config == NULL)
    return RIM_E_ARGUMENT;
  if (((uintptr_t)memory & 7u) != 0)
    return RIM_E_ALIGN;
  rim_bandit_config c = *config;
  rim_status status = complete(&c);
  if (status != RIM_OK)
    return status;
  if (bytes < total_bytes(&c))
    return RIM_E_SIZE;
  rim_bandit *b = memory;
  memset(b, 0, RIM_BANDIT_HEADER_BYTES);
  b->config = c;
  b->support = 1.0;
  rimi_rng_seed(&b->rng, c.seed, STREAM);
  for (uint32_t plan = 0; status == RIM_OK && plan < plans_of(&c); ++plan) {
    rim_gp *gp = NULL;
    status = rim_gp_init(&gp, gp_of(b, plan), gp_bytes(&c), &c.gp);
  }
  if (status == RIM_OK && has_rims(&c)) {
    rim_extent *extent = NULL;
    status = rim_extent_init(&extent, extent_of(b), extent_bytes(&c), &c.extent);
  }
  if (status == RIM_OK)
    *bandit = b;
  return status;
}

rim_gp *rim_bandit_gp(rim_bandit *bandit, uint32_t plan) {
  return plan < plans_of(&bandit->config) ? gp_of(bandit, plan) : NULL;
}

rim_extent *rim_bandit_extent(rim_bandit *bandit) {
  return has_rims(&bandit->config) ? extent_of(bandit) : NULL;
}

rim_bandit_config rim_bandit_get_config(const rim_bandit *bandit) { return bandit->config; }
rim_bandit_counters rim_bandit_get_counters(const rim_bandit *bandit) { return bandit->counters; }

double rim_bandit_beta(const rim_bandit *bandit, uint32_t turn, uint32_t actions) {
  const rim_bandit_config *c = &bandit->config;
  const double t = (double)(turn > 0 ? turn : 1);
  if (c->schedule == RIM_BANDIT_BETA_CONSTANT)
    return c->beta;
  if (c->schedule == RIM_BANDIT_BETA_DECAY)
    return c->beta * rimi_exp(-c->power * rimi_log(t));
  const double growth = (double)actions * (t * t) * (RIM_PI * RIM_PI) / (6.0 * c->delta);
  return c->beta * rimi_max(2.0 * rimi_log(growth), 0.0);
}

/* Takes part of the RIMs' weight away. */
static void weaken(rim_extent_mixture *m, double support) {
  m->weight[0] = 1.0;
  for (uint32_t i = 1; i < m->components; ++i) {
    m->weight[i] *= support;
    m->weight[0] -= m->weight[i];
  }
}

/* The reward at x: nominal, GP and RIMs together (eq. 5.13, 5.14). */
static rim_extent_mixture mixture_of(const rim_bandit *b, const double *x, double nominal,
                                     double gp_mean, double gp_var) {
  const uint8_t policy = b->config.policy;
  const double mean = policy == RIM_BANDIT_RIM_UCB ? nominal : nominal + gp_mean;
  if (has_rims(&b->config)) {
    /* eq. 5.12: with RIM-UCB a RIM's component has its standard error only */
    const bool rim_alone = policy == RIM_BANDIT_RIM_UCB;
    rim_extent_mixture mixture = rim_extent_reward(extent_of(b), x, mean, rim_alone ? 0.0 : gp_var);
    if (rim_alone) {
      mixture.var[0] += gp_var;
    } else { /* what is not known of RIMs not yet seen, where nobody looked */
      mixture.var[0] += b->config.unseen_var * (gp_var / rim_gp_get_config(gp_of(b, 0)).signal_var);
      weaken(&mixture, b->support);
    }
    return mixture;
  }
  rim_extent_mixture alone;
  memset(&alone, 0, sizeof alone);
  alone.components = 1;
  alone.weight[0] = 1.0;
  alone.mean[0] = mean;
  alone.var[0] = gp_var;
  return alone;
}

/* P(r > level) for the mixture with the reward's own noise. */
static double probability_above(const rim_extent_mixture *m, double level, double noise_var) {
  double sum = 0.0;
  for (uint32_t i = 0; i < m->components; ++i) {
    if (!(m->weight[i] > 0.0))
      continue;
    const double sd = rimi_sqrt(m->var[i] + noise_var);
    const double above =
        sd > 0.0 ? rimi_normal_cdf((m->mean[i] - level) / sd) : (m->mean[i] > level ? 1.0 : 0.0);
    sum += m->weight[i] * above;
  }
  return sum;
}

/* Value, expectation and risk of one action; `out` is zero but for its action and beta. */
static void judge(const rim_bandit *b, const rim_extent_mixture *mixture, double noise_var,
                  rim_bandit_choice *out) {
  const rim_bandit_config *c = &b->config;
  double var = 0.0;
  rim_extent_moments(mixture, &out->mean, &var);
  out->sd = rimi_sqrt(rimi_max(var, 0.0));
  out->member = 1.0 - mixture->weight[0];
  out->value = out->mean + rimi_sqrt(out->beta) * out->sd;
  out->bound_met = true;
  if (c->risk == RIM_BANDIT_MEAN_SD) {
    out->value -= c->aversion * rimi_sqrt(var + noise_var);
  } else if (c->risk != RIM_BANDIT_NEUTRAL) {
    out->probability = probability_above(mixture, c->level, noise_var);
    if (c->risk == RIM_BANDIT_PROBABILITY) {
      out->value = out->probability;
    } else if (!(out->probability >= c->bound)) {
      out->bound_met = false; /* valued by its probability, below any that meets the bound */
      out->value = out->probability;
    }
  }
}

/* The best so far, and how many are as good. */
typedef struct leader {
  rim_bandit_choice choice;
  uint32_t equals;
} leader;

static void challenge(rim_bandit *b, leader *best, const rim_bandit_choice *candidate) {
  const bool first = best->equals == 0;
  const bool same_class = !first && candidate->bound_met == best->choice.bound_met;
  if (first || (candidate->bound_met && !best->choice.bound_met) ||
      (same_class && candidate->value > best->choice.value)) {
    best->choice = *candidate;
    best->equals = 1;
  } else if (same_class && !(candidate->value < best->choice.value)) {
    ++best->equals; /* each of k equals is kept with probability 1 / k */
    if (rimi_rng_below(&b->rng, best->equals) == 0)
      best->choice = *candidate;
  }
}

static double noise_of(const rim_bandit *b, const rim_bandit_actions *actions, uint32_t i) {
  return actions->var != NULL ? actions->var[i] : b->config.gp.noise_var;
}

static bool is_allowed(const rim_bandit_actions *actions, uint32_t i) {
  return actions->allowed == NULL || actions->allowed[i] != 0;
}

/* Whether action i may be judged; counts those that are allowed but not usable. */
static bool is_candidate(rim_bandit *b, const rim_bandit_actions *actions, uint32_t i) {
  if (!is_allowed(actions, i))
    return false;
  const size_t dims = b->config.gp.dims;
  const double *x =
      b->config.policy == RIM_BANDIT_BANK ? actions->x : actions->x + (size_t)i * dims;
  const double noise = noise_of(b, actions, i);
  const bool usable = all_usable(x, dims) && noise >= 0.0 && is_usable(noise) &&
                      (actions->nominal == NULL || is_usable(actions->nominal[i]));
  if (!usable)
    count(&b->counters.unusable);
  return usable;
}

/* Candidates gathered for one batch of predictions. */
typedef struct batch {
  uint32_t width;
  uint32_t action[RIM_GP_BATCH];
  double x[RIM_GP_BATCH * RIM_GP_MAX_DIMS];
} batch;

static void judge_batch(rim_bandit *b, const rim_bandit_actions *actions, const batch *in,
                        double beta, leader *best) {
  const size_t dims = b->config.gp.dims;
  double mean[RIM_GP_BATCH], var[RIM_GP_BATCH];
  if (b->config.policy == RIM_BANDIT_BANK) { /* one plan's process each */
    for (uint32_t k = 0; k < in->width; ++k) {
      (void)rim_gp_predict(gp_of(b, in->action[k]), in->x + k * dims, mean + k, var + k);
    }
  } else {
    (void)rim_gp_predict_many(gp_of(b, 0), in->x, in->width, mean, var);
  }
  for (uint32_t k = 0; k < in->width; ++k) {
    const uint32_t i = in->action[k];
    const double nominal = actions->nominal != NULL ? actions->nominal[i] : 0.0;
    const rim_extent_mixture mixture = mixture_of(b, in->x + k * dims, nominal, mean[k], var[k]);
    rim_bandit_choice candidate = {.action = i, .beta = beta};
    judge(b, &mixture, noise_of(b, actions, i), &candidate);
    challenge(b, best, &candidate);
  }
}

rim_status rim_bandit_choose(rim_bandit *bandit, const rim_bandit_actions *actions,
                             rim_bandit_choice *choice) {
  if (bandit == NULL || actions == NULL || choice == NULL || actions->x == NULL) {
    return RIM_E_ARGUMENT;
  }
  const rim_bandit_config *c = &bandit->config;
  const bool bank = c->policy == RIM_BANDIT_BANK;
  if (actions->count == 0 || (bank && actions->count != c->plans))
    return RIM_E_RANGE;
  const size_t dims = c->gp.dims;
  const uint32_t turn = bandit->turn < UINT32_MAX ? bandit->turn + 1 : bandit->turn;
  const double beta = rim_bandit_beta(bandit, turn, actions->count);
  leader best;
  memset(&best, 0, sizeof best);
  batch next;
  next.width = 0;
  for (uint32_t i = 0; i < actions->count; ++i) {
    if (is_candidate(bandit, actions, i)) {
      const double *x = bank ? actions->x : actions->x + (size_t)i * dims;
      memcpy(next.x + next.width * dims, x, dims * sizeof *x);
      next.action[next.width++] = i;
    }
    if (next.width == RIM_GP_BATCH || (next.width > 0 && i + 1 == actions->count)) {
      judge_batch(bandit, actions, &next, beta, &best);
      next.width = 0;
    }
  }
  if (best.equals == 0) {
    count(&bandit->counters.none_allowed);
    return RIM_E_DATA;
  }
  bandit->turn = turn;
  count(&bandit->counters.choices);
  *choice = best.choice;
  return RIM_OK;
}

/* Sets what the GP's points have explained by the RIMs, times `part`; returns its log likelihood.
 */
static double explain(const rim_bandit *b, double part) {
  rim_gp *gp = gp_of(b, 0);
  const rim_extent *extent = extent_of(b);
  for (uint32_t i = 0; i < rim_gp_points(gp); ++i) {
    rim_gp_point point = {0};
    (void)rim_gp_get_point(gp, i, &point);
    (void)rim_gp_set_offset(gp, i,
                            part > 0.0 ? part * rim_extent_correction(extent, point.x) : 0.0);
  }
  rim_gp_refresh(gp);
  return rim_gp_log_likelihood(gp);
}

/* Algorithm 6: the process describes what the corrected model leaves. RIM-UCB uses its variance
 * alone, which offsets do not change. */
static void update_offsets(rim_bandit *b) {
  const double with = explain(b, 1.0);
  b->support = 1.0;
  if (b->config.gain > 0.0) {
    b->support = 1.0 / (1.0 + rimi_exp(b->config.gain - (with - explain(b, 0.0))));
    (void)explain(b, b->support);
  }
}

rim_status rim_bandit_observe(rim_bandit *bandit, const double *x, uint32_t plan, double nominal,
                              double var, double reward) {
  if (bandit == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  const rim_bandit_config *c = &bandit->config;
  if (c->policy == RIM_BANDIT_BANK && plan >= c->plans)
    return RIM_E_RANGE;
  const double dz = reward - nominal;
  const bool fine = all_usable(x, c->gp.dims) && is_usable(nominal) && is_usable(reward) &&
                    is_usable(dz) && var >= 0.0 && var <= 1e100;
  if (!fine) {
    count(&bandit->counters.refused);
    return RIM_E_DATA;
  }
  rim_gp *gp = gp_of(bandit, c->policy == RIM_BANDIT_BANK ? plan : 0);
  const rim_gp_config hyper = rim_gp_get_config(gp);
  const double noise = rimi_max(var - hyper.noise_var, 0.0);
  const rim_status status = rim_gp_add(gp, x, dz, noise, 0.0);
  if (status != RIM_OK) {
    count(&bandit->counters.refused);
    return status;
  }
  count(&bandit->counters.observations);
  if (has_rims(c)) {
    const double floor_var = hyper.noise_var > 0.0 ? hyper.noise_var : hyper.signal_var;
    const double own_var = (var > 0.0 ? var : floor_var) + c->smooth_var;
    (void)rim_extent_add(extent_of(bandit), x, dz, own_var);
    rim_extent_search(extent_of(bandit), c->slices);
    if (c->policy == RIM_BANDIT_RIM_GP_UCB)
      update_offsets(bandit);
  }
  return RIM_OK;
}

rim_status rim_bandit_expect(rim_bandit *bandit, const double *x, uint32_t plan, double nominal,
                             double *mean, double *var) {
  if (bandit == NULL || x == NULL)
    return RIM_E_ARGUMENT;
  const rim_bandit_config *c = &bandit->config;
  const bool bank = c->policy == RIM_BANDIT_BANK;
  if (bank && plan >= c->plans)
    return RIM_E_RANGE;
  if (!is_usable(nominal))
    return RIM_E_DATA;
  double gp_mean = 0.0, gp_var = 0.0;
  const rim_status status = rim_gp_predict(gp_of(bandit, bank ? plan : 0), x, &gp_mean, &gp_var);
  if (status != RIM_OK)
    return status;
  const rim_extent_mixture mixture = mixture_of(bandit, x, nominal, gp_mean, gp_var);
  rim_extent_moments(&mixture, mean, var);
  return RIM_OK;
}
