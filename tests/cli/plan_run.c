/* SPDX-License-Identifier: MIT */
/* Whole runs of every policy of the bandit: 100 turns among 51 actions (or 6 plans), in a world
 * with a better-than-expected parallelogram, with librim's arithmetic alone. Prints a digest over
 * every bit of every choice, of what is expected at the end and of the regions. plan_digest.sh
 * compares the builds. An argument changes the seed. */
#include <base/crc.h>
#include <base/real.h>
#include <base/rng.h>
#include <rim/plan/bandit.h>
#include <stdio.h>

enum { TURNS = 100, ACTIONS = 51, PLANS = 6, LAMBDAS = 9 };
static _Alignas(8) unsigned char memory[RIM_BANDIT_SIZE_RIM(2, TURNS, TURNS, LAMBDAS, 1) +
                                        RIM_BANDIT_SIZE_BANK(2, TURNS, PLANS)];

static rim_bandit_config config_of(unsigned policy, unsigned kernel, unsigned long long seed) {
  const rim_bandit_config c = {.policy = (uint8_t)policy,
                               .schedule = (uint8_t)(policy % 3),
                               .risk =
                                   (uint8_t)(kernel == 2 ? RIM_BANDIT_MEAN_SD : RIM_BANDIT_NEUTRAL),
                               .aversion = 0.1,
                               .plans = policy == RIM_BANDIT_BANK ? PLANS : 0,
                               .beta = 1.0,
                               .seed = seed,
                               .slices = 2,
                               .smooth_var = 0.0036,
                               .unseen_var = 0.3,
                               .gain = 5.0,
                               .gp = {.kernel = (uint8_t)kernel,
                                      .dims = 2,
                                      .points = TURNS - 20,
                                      .signal_var = 0.09,
                                      .noise_var = 0.001,
                                      .length = {1.5, 0.2}},
                               .extent = {.dims = 2,
                                          .points = TURNS,
                                          .lambdas = LAMBDAS,
                                          .set = (uint8_t)(kernel > 0),
                                          .shape = (uint8_t)(kernel > 1),
                                          .seed = seed,
                                          .lower = {1.0, -0.5},
                                          .upper = {5.0, 0.5}}};
  return c;
}

static double reward(const double *x, unsigned plan, double noise) {
  const double middle = 0.25 - 0.12 * (x[0] - 1.8);
  const bool inside = x[0] > 1.8 && x[0] < 4.2 && rimi_abs(x[1] - middle) < 0.15;
  return 0.1 * rimi_sqrt(x[0]) - rimi_abs(x[1]) * 0.2 + (inside ? 0.4 : 0.0) + 0.05 * plan + noise;
}

static uint64_t run(const rim_bandit_config *c, uint64_t digest) {
  rim_bandit *b = NULL;
  if (rim_bandit_init(&b, memory, sizeof memory, c) != RIM_OK)
    return 0;
  const bool bank = c->policy == RIM_BANDIT_BANK;
  rim_rng rng;
  rimi_rng_seed(&rng, c->seed, 9);
  for (unsigned t = 0; t < TURNS; ++t) {
    double x[ACTIONS][2], nominal[ACTIONS];
    const double s = 1.0 + 4.0 * rimi_rng_uniform(&rng);
    for (unsigned i = 0; i < ACTIONS; ++i) {
      x[i][0] = s;
      x[i][1] = bank ? 0.1 : -0.5 + i / 50.0;
      nominal[i] = 0.1 * rimi_exp(-s) + 0.02 * rimi_log(1.0 + i);
    }
    const rim_bandit_actions actions = {bank ? PLANS : ACTIONS, x[0], nominal, NULL, NULL};
    rim_bandit_choice k;
    if (rim_bandit_choose(b, &actions, &k) != RIM_OK)
      return 0;
    const double *at = bank ? x[0] : x[k.action];
    const double r = reward(at, bank ? k.action : 0, 0.03 * rimi_rng_normal(&rng));
    if (rim_bandit_observe(b, at, k.action, nominal[k.action], 0.0009, r) != RIM_OK)
      return 0;
    digest = rimi_digest_f64(rimi_digest_u32(digest, k.action), k.value);
    digest = rimi_digest_f64(rimi_digest_f64(rimi_digest_f64(digest, k.mean), k.sd), k.member);
  }
  for (unsigned i = 0; i < 50; ++i) {
    const double at[2] = {1.0 + 4.0 * rimi_rng_uniform(&rng), rimi_rng_uniform(&rng) - 0.5};
    double mean = 0.0, var = 0.0;
    if (rim_bandit_expect(b, at, i % PLANS, 0.0, &mean, &var) != RIM_OK)
      return 0;
    digest = rimi_digest_f64(rimi_digest_f64(digest, mean), var);
  }
  const rim_extent *extent = rim_bandit_extent(b);
  for (uint32_t i = 0; extent != NULL && i < LAMBDAS; ++i) {
    rim_extent_region region;
    if (rim_extent_get_region(extent, 0, i, &region) != RIM_OK)
      return 0;
    digest = rimi_digest_f64(rimi_digest_f64(digest, region.ln_anom), region.volume);
  }
  return digest;
}

int main(int argc, char **argv) {
  (void)argv;
  uint64_t digest = RIM_DIGEST_START;
  for (unsigned policy = RIM_BANDIT_GP_UCB; policy <= RIM_BANDIT_BANK; ++policy) {
    for (unsigned kernel = 0; kernel < 3; ++kernel) {
      const rim_bandit_config c = config_of(policy, kernel, 71u + (unsigned)(argc > 1));
      digest = run(&c, digest);
      if (digest == 0)
        return 1;
    }
  }
  printf("digest %016llx\n", (unsigned long long)digest);
  return 0;
}
