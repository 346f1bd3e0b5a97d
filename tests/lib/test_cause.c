/* SPDX-License-Identifier: MIT */
/* monitor/cause.c where outcomes are rolled forward: a tank (outcome 3) keeps what two flows
 * (outcomes 1 and 2) bring and take, so it deviates with them, longer and more clearly. The cause
 * is named, and the tank where the rule does not hold. And where two outcomes read the same, which
 * a third one integrates. What the channels have found is put there by hand. */
#include <math.h>

#define BENCH_OUTCOMES 4
#include "rolled_bench.h"

#include "image/rolled.h"
#include "monitor/cause.h"

enum { LEAST = SEARCH_LEAST };

/* Up to two outcomes that deviate by their behaviour beside the leading one, which does so since
 * block 40. Scores in alarms; 0: it does not. */
typedef struct finding {
  uint16_t leading; /* channel */
  double score;
  struct {
    uint16_t outcome;
    double score;
    uint32_t onset;
  } other[2];
  uint16_t named; /* channel */
} finding;

static void name_each(const finding *of, size_t count) {
  rim_alarm a;
  for (size_t i = 0; i < count; ++i) {
    plant_nothing();
    plant(of[i].leading, SEARCH_SINCE, of[i].score * alarm_at, 3.0, 40);
    for (size_t k = 0; k < 2; ++k) {
      if (of[i].other[k].score > 0.0)
        plant(of[i].other[k].outcome, SEARCH_SINCE, of[i].other[k].score * alarm_at, 3.0,
              of[i].other[k].onset);
    }
    const uint16_t channel = named(of[i].leading, &a);
    if (channel != of[i].named)
      fail_msg("finding %zu: channel %u is named instead of %u", i, channel, of[i].named);
  }
}
#define NAME_EACH(of) name_each(of, sizeof(of) / sizeof *(of))

static void begin_with(const recipe *r) {
  from(r, false);
  feed(nothing, 1.0);
}

static void what_flows_in_is_the_cause(void **state) {
  (void)state;
  const recipe r = rolled(own);
  begin_with(&r);
  const finding of[] = {
      {TANK, 10.0, {{IN, 2.0, 40}}, IN},
      {TANK, 10.0, {{IN, 1.99, 40}}, TANK}, /* too little of what the tank shows */
      {TANK, 2.0, {{IN, 1.0, 40}}, IN},
      {TANK, 2.0, {{IN, 0.99, 40}}, TANK}, /* no alarm by itself */
      {TANK, 10.0, {{IN, 3.0, 40 + LEAST}}, IN},
      {TANK, 10.0, {{IN, 3.0, 41 + LEAST}}, TANK}, /* it deviates since later */
      {TANK, 10.0, {{IN, 3.0, SEARCH_FROM_START}}, IN},
      {TANK, 10.0, {{IN, 3.0, 40}, {OUT, 4.0, 40}}, OUT},
      {TANK, 10.0, {{IN, 4.0, 40}, {OUT, 3.0, 40}}, IN},
      {IN, 10.0, {{TANK, 9.0, 40}}, IN}, /* which keeps nothing of the tank */
      {OUT, 10.0, {{TANK, 9.0, 40}}, OUT},
      {OTHER, 10.0, {{IN, 9.0, 40}}, OTHER}, /* no state predicts it */
  };
  NAME_EACH(of);
}

/* The tank deviates in a region: since when, that does not say. */
static void a_region_is_no_earlier_than_what_flows_in(void **state) {
  (void)state;
  const recipe r = rolled(own);
  begin_with(&r);
  plant_nothing();
  plant(TANK, SEARCH_INTERVAL, 10.0 * alarm_at, 3.0, SEARCH_FROM_START);
  plant(IN, SEARCH_SINCE, 3.0 * alarm_at, 3.0, BLOCKS / 2);
  rim_alarm a;
  assert_int_equal(named(TANK, &a), IN);
}

/* An outcome that the states of the leading one do not move deviates by itself, and is asked
 * first. */
static void what_no_state_moves_is_the_cause(void **state) {
  (void)state;
  const recipe r = rolled(own);
  begin_with(&r);
  const finding of[] = {
      {IN, 10.0, {{OUT, 2.0, 40}}, OUT},
      {IN, 10.0, {{OUT, 1.99, 40}}, IN},
      {IN, 10.0, {{OTHER, 2.0, 40}}, OTHER},
      {IN, 10.0, {{OUT, 3.0, 40}, {OTHER, 4.0, 40}}, OTHER},
      {IN, 10.0, {{OUT, 4.0, 40}, {OTHER, 3.0, 40}}, OUT},
      {IN, 10.0, {{OUT, 4.0, 41 + LEAST}, {OTHER, 3.0, 40}}, OTHER},
      {IN, 10.0, {{TANK, 9.0, 40}, {OTHER, 3.0, 40}}, OTHER},
      {TANK, 10.0, {{IN, 9.0, 40}, {OTHER, 2.0, 40}}, OTHER},
      {TANK, 10.0, {{IN, 9.0, 40}, {OTHER, 1.99, 40}}, IN},
  };
  NAME_EACH(of);
}

/* What deviated first, by which the standing alarm is named, before both. */
static void what_stands_is_the_cause(void **state) {
  (void)state;
  const recipe r = rolled(own);
  const struct {
    uint16_t stands;
    finding then;
  } of[] = {
      {IN, {TANK, 10.0, {{IN, 3.0, 40}, {OUT, 4.0, 40}}, IN}},
      {OUT, {TANK, 10.0, {{IN, 4.0, 40}, {OUT, 3.0, 40}}, OUT}},
      {IN, {TANK, 10.0, {{IN, 3.0, 40}, {OTHER, 9.0, 40}}, IN}},
      {IN, {TANK, 10.0, {{IN, 1.99, 40}, {OUT, 4.0, 40}}, OUT}}, /* it does so no more */
      {TANK, {TANK, 10.0, {{IN, 3.0, 40}}, IN}},
      {TANK, {IN, 10.0, {{TANK, 9.0, 40}}, TANK}},
      {TANK, {OTHER, 10.0, {{TANK, 9.0, 40}}, OTHER}},     /* no state predicts it */
      {AGREEMENT + IN, {TANK, 10.0, {{IN, 3.0, 40}}, IN}}, /* no outcome: it is no cause */
      {AGREEMENT + IN, {TANK, 10.0, {{AGREEMENT + IN, 9.0, 40}}, TANK}},
      {AGREEMENT, {TANK, 10.0, {{AGREEMENT, 9.0, 40}}, TANK}},
      {AGREEMENT + TANK, {TANK, 10.0, {{AGREEMENT + TANK, 9.0, 40}}, TANK}},
  };
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    begin_with(&r);
    stand(of[i].stands);
    name_each(&of[i].then, 1);
  }
}

/* An outcome that states predict but that is none of them keeps nothing of its own. */
static void what_keeps_nothing_is_its_own_cause(void **state) {
  (void)state;
  static const uint16_t by_the_tank[O] = {Z_TANK, Z_IN, Z_OUT, Z_TANK};
  const recipe r = rolled(by_the_tank);
  const finding its_own = {OTHER, 10.0, {{IN, 9.0, 40}, {TANK, 9.0, 40}}, OTHER};
  begin_with(&r);
  name_each(&its_own, 1);
  stand(IN);
  name_each(&its_own, 1);
  static const uint16_t by_the_flow[O] = {Z_IN, Z_IN, Z_OUT, Z_TANK};
  const recipe other = rolled(by_the_flow);
  begin_with(&other);
  const finding of[] = {{OTHER, 10.0, {{IN, 9.0, 40}}, OTHER},
                        /* that keeps what it shows, and would show more if it were the cause */
                        {OTHER, 10.0, {{OUT, 9.0, 40}, {IN, 9.0, 40}}, OTHER}};
  NAME_EACH(of);
}

/* An outcome that sums up the leading one deviates because of it. */
static void what_sums_up_is_no_cause(void **state) {
  (void)state;
  recipe r = rolled(own);
  put_row(&r, IN, AGREEMENT_RESIDUALS, TANK, 0, 0.0); /* mostly the integral of the tank */
  begin_with(&r);
  const finding of[] = {{TANK, 10.0, {{IN, 9.0, 40}}, TANK},
                        {TANK, 10.0, {{IN, 9.0, 40}, {OUT, 3.0, 40}}, OUT}};
  NAME_EACH(of);
  stand(IN);
  NAME_EACH(of);
}

/* The rule is one of behaviour: it holds where agreement led to the tank's, and of nothing else. */
static void other_kinds_of_channels(void **state) {
  (void)state;
  const recipe r = rolled(own);
  begin_with(&r);
  const uint16_t scatter = RIM_CHANNEL_SCATTER * O + TANK;
  const finding of[] = {{scatter, 10.0, {{IN, 9.0, 40}}, scatter},
                        {scatter, 10.0, {{OTHER, 9.0, 40}}, scatter},
                        {AGREEMENT + TANK, 10.0, {{TANK, 9.0, 40}, {IN, 3.0, 40}}, IN},
                        {AGREEMENT + TANK, 10.0, {{TANK, 9.0, 40}, {IN, 1.5, 40}}, TANK}};
  NAME_EACH(of);
}

/* The channel that deviates with the agreement of OTHER, or that itself; and by how much the
 * behaviour of OTHER does. */
static uint32_t together;
static double by_itself;

static double together_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  if (i < 40)
    return 0.0;
  return channel == together || channel == AGREEMENT + OTHER ? 3.0
         : channel == OTHER                                  ? by_itself
                                                             : 0.0;
}

/* An agreement leads. Of the outcomes that deviate by their behaviour, the largest score first, IN
 * does so there and then, and OUT does not. */
static void what_deviates_together_is_named(void **state) {
  (void)state;
  static const uint16_t by_commands[O] = {NONE, NONE, NONE, NONE};
  const recipe r = rolled(by_commands);
  from(&r, false);
  together = IN;
  by_itself = 3.0;
  feed(together_since_40, 1.0);
  const uint16_t leading = AGREEMENT + OTHER;
  const finding of[] = {{leading, 10.0, {{IN, 4.01, 40}}, IN},
                        {leading, 10.0, {{IN, 3.99, 40}}, leading}, /* too little of it */
                        {leading, 10.0, {{OUT, 9.0, 40}}, leading},
                        {leading, 10.0, {{OUT, 9.0, 40}, {IN, 5.0, 40}}, IN},
                        {leading, 10.0, {{OUT, 5.0, 40}, {IN, 9.0, 40}}, IN}};
  NAME_EACH(of);
}

/* The agreement of OTHER leads. The commands deny a deviation of OTHER, and say that IN deviates:
 * its score need not be large, and what another agreement says counts for less. */
static void what_the_commands_deny_is_not_named(void **state) {
  (void)state;
  static const uint16_t by_commands[O] = {NONE, NONE, NONE, NONE};
  const recipe r = rolled(by_commands);
  const uint16_t leading = AGREEMENT + OTHER;
  for (int denied = 0; denied < 2; ++denied) {
    from(&r, false);
    together = IN;
    by_itself = denied ? 0.0 : 3.0;
    feed(together_since_40, 1.0);
    const uint16_t said = denied ? IN : leading;
    const finding of[] = {{leading, 10.0, {{IN, 1.0, 40}}, said},
                          {leading, 10.0, {{AGREEMENT + OUT, 2.0, 40}, {IN, 1.0, 40}}, said},
                          {leading, 10.0, {{IN, 0.99, 40}}, leading},  /* no alarm by itself */
                          {leading, 10.0, {{OUT, 3.0, 40}}, leading}}; /* not there and then */
    NAME_EACH(of);
  }
}

/* Three outcomes deviate, and none where the agreement does: it stays its own. */
static void what_deviates_at_other_times_is_not_named(void **state) {
  (void)state;
  static const uint16_t by_commands[O] = {NONE, NONE, NONE, NONE};
  const recipe r = rolled(by_commands);
  from(&r, false);
  together = AGREEMENT + OTHER;
  by_itself = 0.0;
  feed(together_since_40, 1.0);
  plant_nothing();
  plant(AGREEMENT + OTHER, SEARCH_SINCE, 10.0 * alarm_at, 3.0, 40);
  plant(IN, SEARCH_SINCE, 7.0 * alarm_at, 3.0, 40);
  plant(OUT, SEARCH_SINCE, 9.0 * alarm_at, 3.0, 40);
  plant(TANK, SEARCH_SINCE, 8.0 * alarm_at, 3.0, 40);
  rim_alarm a;
  assert_int_equal(named(AGREEMENT + OTHER, &a), AGREEMENT + OTHER);
}

static double off_by; /* the agreement of IN */

static double agreements_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  if (i < 40)
    return 0.0;
  return channel == AGREEMENT + OTHER || channel == OTHER ? 3.0
         : channel == AGREEMENT + IN                      ? off_by
                                                          : 0.0;
}

/* Two readings disagree, and the agreement of OTHER has the larger score. Where no command says
 * that it is the one, it is the one whose agreement is farther off in its own noise. */
static void what_is_farthest_off_is_named(void **state) {
  (void)state;
  static const uint16_t by_commands[O] = {NONE, NONE, NONE, NONE};
  const uint16_t leading = AGREEMENT + OTHER, other = AGREEMENT + IN;
  const struct {
    bool silent;     /* the commands say nothing of OTHER */
    double off, rho; /* of the agreement of IN */
    double score;    /* over that of the leading one */
    uint16_t named;
  } of[] = {
      {true, 3.2, 0.0, 0.5, other},    {true, -3.2, 0.0, 0.5, other},
      {true, 3.2, 0.0, 0.11, other},   {true, 3.2, 0.0, 0.09, leading}, /* it agrees */
      {true, 3.01, 0.0, 0.5, leading},                                  /* by hardly more */
      {true, 2.0, 0.0, 0.5, leading},  {true, 3.2, 0.6, 0.5, leading},  /* its noise is larger */
      {false, 3.2, 0.0, 0.5, leading}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    recipe r = rolled(by_commands);
    if (of[i].silent)
      put_noise_number(&r, OTHER, 0, 0.0);
    put_noise_number(&r, other, 2, of[i].rho);
    from(&r, false);
    off_by = of[i].off;
    feed(agreements_since_40, 0.05);
    const finding found[] = {{leading,
                              10.0,
                              {{other, 10.0 * of[i].score, 40}, {AGREEMENT + OUT, 1.05, 40}},
                              of[i].named}};
    NAME_EACH(found);
  }
}

/* ---- two that read the same, and what integrates one of them ---- */

enum { TWIN = 1, PLACE = 2, A_FIRST = AGREEMENT, A_TWIN = AGREEMENT + TWIN };
#define PER_BLOCK 0.05 /* by which the sums grow, in units of 0.05, where the bias is in them */
#define WEIGHT (PER_BLOCK / 6.0) /* a bias of 3 grows by twice as much */

/* Outcome 0 reads `weight` times what outcome TWIN reads; `summing`, that one or PLACE, has the
 * sum of what `integrand` reads. */
static recipe with_sums(double weight, uint32_t summing, uint32_t integrand) {
  recipe r = without_integrals();
  bytes *to = &r.section[RIM_SECTION_AGREEMENT];
  to->size = 0;
  const uint32_t header[4] = {3, O, MEANS, 1};
  for (size_t i = 0; i < 4; ++i)
    u32(to, header[i]);
  for (size_t i = 0; i < O; ++i)
    f32(to, 20.0);
  const uint16_t of[4] = {AGREEMENT_PLAIN, (uint16_t)sensor(integrand), (uint16_t)sensor(integrand),
                          0};
  for (size_t i = 0; i < 4; ++i)
    u16(to, of[i]);
  const double numbers[3] = {1.0, 1.0, 0.0};
  for (size_t i = 0; i < 3; ++i)
    f32(to, numbers[i]);
  for (uint32_t o = 0; o < O; ++o) {
    const uint32_t source = o == 0            ? AGREEMENT_FEW
                            : o != summing    ? AGREEMENT_RESIDUALS
                            : summing == TWIN ? AGREEMENT_INTO
                                              : AGREEMENT_INTEGRAL;
    f32(to, source);
    f32(to, source == AGREEMENT_INTO ? PLACE : 0.0);
    f32(to, -1.0);
    f32(to, 0.0);
    for (uint32_t j = 0; j < O * (2 + MEANS); ++j)
      f32(to, o == 0 && j == TWIN ? weight : o == summing && j == 0 ? WEIGHT : 0.0);
  }
  return r;
}

/* The channel whose sum grows from block 40 on, by this in units of 0.05. */
static uint32_t growing;
static double grows;

static double apart_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  if (i < 40)
    return 0.0;
  return channel == A_FIRST ? -3.0 : channel == growing ? grows * (double)(i - 40) : 0.0;
}

static rim_alarm described(uint16_t leading) {
  rim_alarm a;
  const rim_verdict v = {.channel = leading, .level = RIM_LEVEL_ERROR, .t_s = 99.0};
  rimi_monitor_describe(m, &v, &a);
  return a;
}

/* Outcome 0 reads 3 units low beside its twin, from block 40 on. Either it does, or the twin reads
 * high: what integrates one of them tells. */
static void the_sum_of_readings_tells_which_twin(void **state) {
  (void)state;
  static const struct {
    uint32_t row, integrand;
    double grows;
    uint16_t named;
  } of[] = {{TWIN, TWIN, 1.0, TWIN}, {TWIN, TWIN, 0.0, 0},    {TWIN, TWIN, -1.0, 0},
            {TWIN, TWIN, 0.4, 0},    {TWIN, TWIN, 0.6, TWIN}, {PLACE, TWIN, -1.0, TWIN},
            {PLACE, TWIN, 0.0, 0},   {PLACE, TWIN, 1.0, 0},   {PLACE, 0, 1.0, 0},
            {PLACE, 0, 0.0, TWIN},   {PLACE, 0, -1.0, TWIN}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    for (int half = 0; half < 2; ++half) { /* the twin reads twice as much, then */
      const double weight = half ? 0.5 : 1.0;
      const recipe r = with_sums(weight, of[i].row, of[i].integrand);
      from(&r, false);
      growing = AGREEMENT + of[i].row;
      grows = of[i].grows * PER_BLOCK / (of[i].integrand == TWIN ? weight : 1.0);
      feed(apart_since_40, 0.05);
      plant_nothing();
      plant(A_FIRST, SEARCH_SINCE, 2.0 * alarm_at, as_shift(A_FIRST, -3.0), 40);
      search_state(m->search, A_FIRST)->time.blocks = BLOCKS - 40;
      const rim_alarm a = described(A_FIRST);
      if (a.channel[0] != of[i].named)
        fail_msg("case %zu: outcome %u is named instead of %u", i, a.channel[0], of[i].named);
      assert_int_equal(m->explained_channel, A_FIRST); /* which shows it best */
      assert_int_equal(a.kind, RIM_KIND_SHIFT);
      const double shift = of[i].named == TWIN ? 0.15 / weight : -0.15;
      assert_true(fabs(a.shift[0] - shift) < 0.02 * fabs(shift));
      assert_true(a.shift_sd[0] > 0.0);
    }
  }
}

static double apart_from_place(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  const double off = channel == A_FIRST ? -3.0 : channel == AGREEMENT + PLACE ? 3.0 * grows : 0.0;
  return i < 40 ? 0.0 : off;
}

/* Outcome 0 reads 3 units low beside PLACE, which has the sum of what another one reads: a bias of
 * PLACE itself is one of its difference from that sum. */
static void a_sum_tells_of_its_own_outcome(void **state) {
  (void)state;
  recipe r = with_sums(0.0, PLACE, TWIN); /* not beside TWIN */
  put_f32(r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 20 + 16 + 4 * PLACE, 1.0);
  for (int is_off = 0; is_off < 2; ++is_off) {
    from(&r, false);
    grows = is_off;
    feed(apart_from_place, 0.05);
    plant_nothing();
    plant(A_FIRST, SEARCH_SINCE, 2.0 * alarm_at, as_shift(A_FIRST, -3.0), 40);
    search_state(m->search, A_FIRST)->time.blocks = BLOCKS - 40;
    assert_int_equal(described(A_FIRST).channel[0], is_off ? PLACE : 0);
  }
}

/* Outcome 0 reads off from block 40 on, and the sum of it grows. */
static double reads_off_and_grows(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  if (i < 40)
    return 0.0;
  return channel == 0 || channel == A_FIRST ? -3.0 * grows / PER_BLOCK
         : channel == growing               ? grows * (double)(i - 40)
                                            : 0.0;
}

/* Two sensors read the same: their difference tells the error of one, and its behaviour does not.
 * Of one that agrees with two others behaviour does, as of any. */
static void the_difference_tells_the_error(void **state) {
  (void)state;
  recipe r = with_sums(1.0, PLACE, TWIN);
  grows = PER_BLOCK;
  growing = NONE;
  for (int others = 1; others <= 2; ++others) {
    if (others == 2)
      put_f32(r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 20 + 16 + 4 * PLACE, 1.0);
    from(&r, false);
    feed(reads_off_and_grows, 0.05);
    plant_nothing();
    plant(A_FIRST, SEARCH_SINCE, 10.0 * alarm_at, as_shift(A_FIRST, -3.0), 40);
    plant(0, SEARCH_SINCE, 9.0 * alarm_at, as_shift(0, -3.0), 40);
    rim_alarm a;
    assert_int_equal(named(A_FIRST, &a), others == 1 ? A_FIRST : 0);
  }
}

/* Place has the sum of what its integrand reads, by itself or times another reading. The bias that
 * is said of it is as uncertain as the sum's growth, and of a product also by 12 % of itself:
 * how the other factor was on the mean of this run. */
static void a_bias_within_a_product_is_less_sure(void **state) {
  (void)state;
  const double growth[] = {PER_BLOCK, -0.5 * PER_BLOCK};
  for (size_t i = 0; i < 2; ++i) {
    rim_alarm a[2];
    for (uint32_t product = 0; product < 2; ++product) {
      recipe r = with_sums(1.0, PLACE, 0);
      uint8_t *integrand = r.section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O;
      put_u16(integrand, product ? AGREEMENT_PRODUCT : AGREEMENT_PLAIN);
      put_u16(integrand + 4, sensor(TWIN));
      put_f32(integrand + 20 + 4 * PLACE * (4 + O * (2 + MEANS)) + 8, 0.0); /* mostly of this */
      from(&r, false);
      growing = AGREEMENT + PLACE;
      grows = growth[i];
      feed(reads_off_and_grows, 0.05);
      plant_nothing();
      plant(AGREEMENT + PLACE, SEARCH_RAMP, 3.0 * alarm_at, growth[i], 40);
      a[product] = described(AGREEMENT + PLACE);
      assert_true(a[product].kind == RIM_KIND_SHIFT && a[product].channel[0] == 0);
      const search_hypothesis *h = &m->explained;
      const double share = 1.15 * (double)h->sd / fabs((double)h->shift); /* of the growth */
      const double sure = a[product].shift_sd[0] / fabs(a[product].shift[0]);
      assert_true(product ? sure > 1.01 * share : fabs(sure - share) < 1e-6 * share);
    }
    assert_true(a[0].shift[0] == a[1].shift[0] && a[0].shift[0] * growth[i] < 0.0);
    const double more = pow(a[1].shift_sd[0], 2) - pow(a[0].shift_sd[0], 2);
    assert_true(fabs(sqrt(more) - 0.12 * fabs(a[0].shift[0])) < 1e-3 * fabs(a[0].shift[0]));
  }
}

/* A sum leads. Where the two that read the same differ, that is said; where they do not, what
 * integrates them deviates, by its own channel or by the sum, in which it has the other sign. */
static void a_sum_that_leads(void **state) {
  (void)state;
  const recipe r = with_sums(1.0, TWIN, TWIN);
  from(&r, false);
  growing = A_TWIN;
  grows = PER_BLOCK;
  feed(apart_since_40, 0.05);
  plant_nothing();
  plant(A_TWIN, SEARCH_RAMP, 3.0 * alarm_at, 3.0, 40);
  plant(A_FIRST, SEARCH_SINCE, alarm_at, as_shift(A_FIRST, -3.0), 40);
  search_state(m->search, A_FIRST)->time.blocks = BLOCKS - 40;
  rim_alarm a = described(A_TWIN);
  assert_int_equal(a.channel[0], TWIN);
  assert_int_equal(m->explained_channel, A_FIRST);
  plant(A_FIRST, SEARCH_SINCE, 0.99 * alarm_at, as_shift(A_FIRST, -3.0), 40);
  a = described(A_TWIN);
  assert_int_equal(a.channel[0], PLACE);
  assert_int_equal(m->explained_channel, A_TWIN);
  assert_int_equal(a.kind, RIM_KIND_DRIFT);
  assert_true(a.shift[0] < 0.0 && a.shift_sd[0] > 0.0); /* the sum grows */
  plant(PLACE, SEARCH_SINCE, alarm_at, -3.0, 40);       /* its behaviour */
  a = described(A_TWIN);
  assert_int_equal(a.channel[0], PLACE);
  assert_int_equal(m->explained_channel, PLACE);
}

/* However the difference of the two goes on, its mean is what the sums are asked about. */
static void the_mean_of_any_shape_is_asked_about(void **state) {
  (void)state;
  static const struct {
    search_family family;
    double
        shift; /* for 3 units low on the mean of the blocks since 40; of a gain it says nothing */
    uint32_t onset;
  } of[] = {{SEARCH_RAMP, -3.0 * 512.0 / (BLOCKS - 40), 40},
            {SEARCH_GAIN, -0.4, 40},
            {SEARCH_GAIN, 0.4, 40},
            {SEARCH_FIELD, 0.0, SEARCH_FROM_START}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    for (int is_in_sum = 0; is_in_sum < 2; ++is_in_sum) {
      const recipe r = with_sums(1.0, TWIN, TWIN);
      from(&r, false);
      growing = A_TWIN;
      grows = is_in_sum ? PER_BLOCK : 0.0;
      feed(apart_since_40, 0.05);
      plant_nothing();
      plant(A_FIRST, of[i].family, 2.0 * alarm_at, as_shift(A_FIRST, of[i].shift), of[i].onset);
      const rim_alarm a = described(A_FIRST);
      const bool since_40 = of[i].onset == 40; /* the sum does not grow from the start */
      if (a.channel[0] != (is_in_sum && since_40 ? TWIN : 0))
        fail_msg("shape %zu, sum %d: outcome %u is named", i, is_in_sum, a.channel[0]);
    }
  }
}

/* The difference of the two is a gain: whichever of them is named, the gain is the other way round,
 * and no weight changes it. */
static void a_gain_has_no_weight(void **state) {
  (void)state;
  for (int is_in_sum = 0; is_in_sum < 2; ++is_in_sum) {
    const recipe r = with_sums(0.5, TWIN, TWIN);
    from(&r, false);
    const noise_channel c = rimi_noise_channel(&m->models.noise, A_FIRST);
    /* by as much as the twin would be off on the mean, where 0.15 make it grow by PER_BLOCK */
    const double mean = (double)c.p_center + (double)c.p_scale;
    const double grown = PER_BLOCK * 0.4 * mean / 0.5 / 0.15;
    const double zero[CHANNELS] = {0.0};
    for (uint32_t i = 0; i < BLOCKS; ++i) {
      double residual[CHANNELS] = {0.0}, predicted[2 * O] = {0.0};
      const uint8_t feature[REGION] = {(uint8_t)(i * 37u), (uint8_t)(i * 101u)};
      predicted[A_FIRST] = (double)c.p_center + (double)c.p_scale * (double)(i % 3u);
      residual[A_FIRST] = i < 40 ? 0.0 : -0.4 * predicted[A_FIRST];
      residual[A_TWIN] = i < 40 || !is_in_sum ? 0.0 : 0.05 * grown * (double)(i - 40);
      const search_block block = {
          .t_s = i, .feature = feature, .mean = zero, .predicted = predicted, .residual = residual};
      assert_int_equal(rimi_search_observe(m->search, &block), RIM_OK);
    }
    plant_nothing();
    plant(A_FIRST, SEARCH_GAIN, 2.0 * alarm_at, -0.4, 40);
    const rim_alarm a = described(A_FIRST);
    assert_int_equal(m->explained_channel, A_FIRST);
    assert_int_equal(a.kind, RIM_KIND_GAIN);
    assert_int_equal(a.channel[0], is_in_sum ? TWIN : 0);
    if (!(fabs(a.shift[0] - (is_in_sum ? 0.4 : -0.4)) < 0.05))
      fail_msg("the gain is %.3f +- %.3f", a.shift[0], a.shift_sd[0]);
  }
}

/* What is said of one of the two is shown by their difference only where that deviates more. */
static void the_difference_shows_what_it_shows_better(void **state) {
  (void)state;
  const recipe r = with_sums(1.0, PLACE, TWIN);
  from(&r, false);
  feed(nothing, 1.0);
  static const struct {
    double own, difference;
    uint16_t shown;
  } of[] = {{3.0, 2.0, A_TWIN},
            {3.0, 3.0, A_TWIN}, /* as well is not better */
            {3.0, 4.0, A_FIRST},
            {0.5, 0.9, A_TWIN},
            {0.5, 1.0, A_FIRST}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    plant_nothing();
    plant(A_TWIN, SEARCH_SINCE, of[i].own * alarm_at, 3.0, 40);
    plant(A_FIRST, SEARCH_SINCE, of[i].difference * alarm_at, -3.0, 40);
    assert_int_equal(rimi_cause_shown_by(m, A_TWIN), of[i].shown);
    assert_int_equal(rimi_cause_shown_by(m, TWIN), TWIN); /* behaviour shows itself */
  }
}

/* Whichever two outcomes it is the difference of. */
static void any_two_may_differ(void **state) {
  (void)state;
  for (size_t o = 0; o < O; ++o) {
    for (size_t j = 0; j < O; ++j) {
      recipe r = without_integrals();
      if (j != o)
        put_row(&r, o, AGREEMENT_FEW, -1.0, j, 1.0);
      from(&r, false);
      feed(nothing, 1.0);
      plant_nothing();
      plant((uint32_t)(AGREEMENT + o), SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
      for (uint16_t c = AGREEMENT; c < AGREEMENT + O; ++c)
        assert_int_equal(rimi_cause_shown_by(m, c),
                         j != o && c == AGREEMENT + j ? AGREEMENT + o : c);
    }
  }
}

/* A row of the run, with this reading of one outcome. */
static void read_row(uint32_t t, uint32_t outcome, double reading) {
  double context[D] = {0.0};
  context[sensor(outcome)] = reading;
  (void)rimi_blocks_row(m->rows, 10.0 + PERIOD_S * (double)t, context, NULL, NULL, NULL);
}

/* The twin reads 3 units high by its own channels too, and what integrates it grows with that. */
static double twin_and_sum_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  if (i < 40)
    return 0.0;
  return channel == TWIN || channel == A_TWIN ? 3.0
         : channel == AGREEMENT + PLACE       ? -PER_BLOCK * (double)(i - 40)
                                              : 0.0;
}

/* What reads far beyond what healthy runs read, in most rows, is named where it deviates by itself;
 * and where it integrates another one, the other is not blamed. */
static void what_is_out_of_range_is_named(void **state) {
  (void)state;
  static const struct {
    uint32_t far, rows; /* rows out of range, of how many */
    double score;
    bool is_named;
  } of[] = {{6, 10, 1.0, true}, {6, 10, 0.99, false}, {5, 10, 1.0, false}, {0, 10, 1.0, false}};
  const recipe r = rolled(own);
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    begin_with(&r);
    for (uint32_t t = 0; t < of[i].rows; ++t)
      read_row(t, OTHER, t < of[i].far ? 1e9 : 0.0);
    m->out_feature = (uint16_t)sensor(OTHER);
    plant_nothing();
    plant(IN, SEARCH_SINCE, 10.0 * alarm_at, 3.0, 40);
    plant(OTHER, SEARCH_SINCE, of[i].score * alarm_at, 3.0, 40);
    rim_alarm a;
    assert_int_equal(named(IN, &a), of[i].is_named ? OTHER : IN);
  }
  const recipe sums = with_sums(1.0, PLACE, TWIN);
  for (int is_far = 0; is_far < 2; ++is_far) {
    from(&sums, false);
    feed(twin_and_sum_since_40, 0.05);
    for (uint32_t t = 0; t < 10; ++t)
      read_row(t, PLACE, 1e9);
    m->out_feature = (uint16_t)sensor(is_far ? PLACE : OTHER);
    plant_nothing();
    plant(AGREEMENT + PLACE, SEARCH_RAMP, 2.0 * alarm_at, -3.0, 40);
    const rim_alarm a = described(AGREEMENT + PLACE);
    assert_int_equal(a.channel[0], is_far ? PLACE : TWIN);
    assert_int_equal(a.kind, is_far ? RIM_KIND_DRIFT : RIM_KIND_SHIFT);
  }
}

/* A sum tells of a reading far out of range before that reading's own channels do. */
static void what_is_out_of_range_is_named_for_its_sum(void **state) {
  (void)state;
  static const struct {
    uint32_t far, of; /* rows of 10 in which this outcome is out of range */
    double score;
    bool is_named;
  } of[] = {{6, TWIN, -0.5, true},
            {6, TWIN, -1e30, false}, /* nothing was found in it yet */
            {5, TWIN, -0.5, false},
            {6, OTHER, -0.5, false}}; /* it is in no sum */
  const recipe sums = with_sums(1.0, PLACE, TWIN);
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&sums, false);
    for (uint32_t t = 0; t < 10; ++t)
      read_row(t, of[i].of, t < of[i].far ? 1e9 : 0.0);
    m->out_feature = (uint16_t)sensor(of[i].of);
    plant_nothing();
    plant(AGREEMENT + PLACE, SEARCH_RAMP, 2.0 * alarm_at, -3.0, 40);
    plant(of[i].of, SEARCH_SINCE, of[i].score * alarm_at, 3.0, 40);
    assert_int_equal(rimi_cause(m, AGREEMENT + PLACE),
                     of[i].is_named ? of[i].of : AGREEMENT + PLACE);
  }
}

/* What integrates an outcome drifts with its bias. Its behaviour denies one here; the
 * difference from its twin, not its own sum, speaks for one as much, or denies it too. */
static void the_difference_supports_a_bias(void **state) {
  (void)state;
  recipe r = with_sums(1.0, TWIN, TWIN);
  double support[3];
  for (int differs = 0; differs < 3; ++differs) {
    enum { PHI = NOISE_CHANNEL_WORDS + 1 + RAW, OF_EACH = PHI + FAMILIES };
    for (size_t i = 0; differs == 2 && i < CHANNELS * FAMILIES; ++i) /* healthy runs scatter more */
      put_f32(r.section[RIM_SECTION_NOISE].byte + 36 +
                  4 * (i / FAMILIES * OF_EACH + PHI + i % FAMILIES),
              1.5);
    from(&r, false);
    growing = A_TWIN;
    grows = PER_BLOCK;
    feed(differs == 1 ? apart_since_40 : nothing, 0.05);
    support[differs] = rimi_cause_support(m, TWIN, 0.15, 40);
  }
  print_message("support %.1f, %.1f nats\n", support[0], support[1]);
  assert_true(support[0] < -100.0 && fabs(support[1]) < 0.05 * fabs(support[0]));
  assert_true(fabs(support[2] - support[0] / 1.5) < 1e-6 * fabs(support[0])); /* it says less */
}

/* What the others say of a reading is no better than they are. */
static void another_reading_stands_still(void **state) {
  (void)state;
  const recipe r = rolled(own);
  const uint16_t repeats = RIM_CHANNEL_REPEAT * O, agreement = AGREEMENT + OTHER;
  const struct {
    uint16_t leading;
    double in, out, share; /* scores of their repeats, and how many readings repeat */
    uint16_t named;
  } of[] = {
      {agreement, 1.0, 0.0, 0.31, (uint16_t)(repeats + IN)},
      {agreement, 1.0, 0.0, 0.29, agreement}, /* some */
      {agreement, 0.99, 0.0, 0.9, agreement}, /* no alarm by itself */
      {agreement, 1.0, 1.1, 0.9, (uint16_t)(repeats + OUT)},
      {agreement, 1.1, 1.0, 0.9, (uint16_t)(repeats + IN)},
      {OTHER, 3.0, 0.0, 0.9, OTHER}, /* the commands say it */
  };
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    rim_alarm a;
    begin_with(&r);
    plant_nothing();
    plant(of[i].leading, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
    for (uint16_t k = 0; k < 2; ++k) {
      const uint16_t c = (uint16_t)(repeats + (k == 0 ? IN : OUT));
      const double unit = (double)rimi_noise_channel(&m->models.noise, c).s;
      plant(c, SEARCH_SINCE, (k == 0 ? of[i].in : of[i].out) * alarm_at, of[i].share / unit, 40);
    }
    assert_int_equal(named(of[i].leading, &a), of[i].named);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(what_flows_in_is_the_cause),
      cmocka_unit_test(a_region_is_no_earlier_than_what_flows_in),
      cmocka_unit_test(what_no_state_moves_is_the_cause),
      cmocka_unit_test(what_stands_is_the_cause),
      cmocka_unit_test(what_keeps_nothing_is_its_own_cause),
      cmocka_unit_test(what_sums_up_is_no_cause),
      cmocka_unit_test(other_kinds_of_channels),
      cmocka_unit_test(what_deviates_together_is_named),
      cmocka_unit_test(what_the_commands_deny_is_not_named),
      cmocka_unit_test(what_deviates_at_other_times_is_not_named),
      cmocka_unit_test(what_is_farthest_off_is_named),
      cmocka_unit_test(the_sum_of_readings_tells_which_twin),
      cmocka_unit_test(a_sum_tells_of_its_own_outcome),
      cmocka_unit_test(the_difference_tells_the_error),
      cmocka_unit_test(the_mean_of_any_shape_is_asked_about),
      cmocka_unit_test(a_gain_has_no_weight),
      cmocka_unit_test(any_two_may_differ),
      cmocka_unit_test(the_difference_shows_what_it_shows_better),
      cmocka_unit_test(what_is_out_of_range_is_named),
      cmocka_unit_test(what_is_out_of_range_is_named_for_its_sum),
      cmocka_unit_test(a_bias_within_a_product_is_less_sure),
      cmocka_unit_test(a_sum_that_leads),
      cmocka_unit_test(the_difference_supports_a_bias),
      cmocka_unit_test(another_reading_stands_still),
  };
  return cmocka_run_group_tests(tests, set_up_trained, NULL);
}
