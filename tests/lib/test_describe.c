/* SPDX-License-Identifier: MIT */
/* monitor/describe.c: which outcome is named when several channels deviate, and which sign. What
 * the channels have found is put there by hand, so that each rule is tried on both sides of it.
 * test_cause.c: where outcomes are rolled forward. */
#include <math.h>

#include "describe_bench.h"

enum { HALF = 128, HALF_BIN = SEARCH_BINS / 2 };
/* Channels, by kind and outcome. */
enum { B0 = 0, B1 = 1, A0 = AGREEMENT, A1 = AGREEMENT + 1 };

/* ---- which of two sensors ---- */

/* How far the other's agreement is off from block 40 on, in units of 0.05. */
static double other_off_by;

static double other_off_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel == A1 && i >= 40 ? other_off_by : 0.0;
}

/* The leading one reads 3 low since block 40. What the other has found for itself counts where the
 * leading one has found a gain, else what it reads since then. */
static void the_twin_that_is_wrong(void **state) {
  (void)state;
  static const struct {
    double off_by, score, shift;
    search_family leading;
    uint16_t named;
  } of[] = {{3.0, 1.0, 3.0, SEARCH_SINCE, A1},  {3.0, 1.0, -3.0, SEARCH_SINCE, A1},
            {-3.0, 1.0, 3.0, SEARCH_SINCE, A0}, {3.0, 0.99, 3.0, SEARCH_SINCE, A0},
            {-3.0, 1.0, 3.0, SEARCH_GAIN, A1},  {3.0, 1.0, -3.0, SEARCH_GAIN, A0},
            {3.0, 1.0, 0.0, SEARCH_GAIN, A0},   {-3.0, 1.0, 3.0, SEARCH_FIELD, A1}};
  rim_alarm a;
  for (int twins = 0; twins < 2; ++twins) {
    recipe r = without_integrals();
    for (size_t o = 0; o < O; ++o)
      put_row(&r, o, AGREEMENT_FEW, -1.0, 1 - o, twins);
    for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
      from(&r, false);
      other_off_by = of[i].off_by;
      feed(other_off_since_40, 0.2);
      plant_nothing();
      plant(A0, of[i].leading, 2.0 * alarm_at, -3.0, 40);
      plant(A1, SEARCH_SINCE, of[i].score * alarm_at, of[i].shift, 40);
      assert_int_equal(named(A0, &a), twins ? of[i].named : A0);
    }
    plant_nothing(); /* behaviour has no twin */
    plant(B0, SEARCH_SINCE, 2.0 * alarm_at, -3.0, 40);
    plant(A1, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(a.channels, 2); /* the other is named after it */
    assert_int_equal(a.channel[1], 1);
  }
}

/* Which outcomes' behaviour is off, and the second's agreement, by this from block 40 on, in units
 * of 0.05. */
static double off_by[O], reading_off_by;

static double off_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return i < 40 ? 0.0 : channel < O ? off_by[channel] : channel == A1 ? reading_off_by : 0.0;
}

/* Two sensors disagree. The agreement of the first leads, but the commands say that it is right,
 * and that the second is off by what its agreement shows. */
static void the_reading_that_the_commands_deny(void **state) {
  (void)state;
  rim_alarm a;
  const struct {
    double source, off[2], other_score; /* the other's score, of the leading one's */
    uint16_t named;
  } of[] = {{AGREEMENT_RESIDUALS, {0.0, 4.0}, 0.7, A1},
            {AGREEMENT_RESIDUALS, {0.0, 4.0}, 0.09, A0}, /* which says next to nothing */
            {AGREEMENT_RESIDUALS, {4.0, 4.0}, 0.7, A0},
            {AGREEMENT_RESIDUALS, {0.0, 0.0}, 0.7, A0},
            {AGREEMENT_RESIDUALS, {0.0, 1.5}, 0.7, A1}, /* by less than it shows, but off it is */
            {AGREEMENT_RESIDUALS, {0.0, -4.0}, 0.7, A0},
            {AGREEMENT_FEW, {0.0, 4.0}, 0.7, A1},
            {AGREEMENT_INTEGRAL, {0.0, 4.0}, 0.7, A0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    recipe r = without_integrals();
    put_row(&r, 0, of[i].source, -1.0, 0, 0.0);
    from(&r, false);
    off_by[0] = of[i].off[0];
    off_by[1] = of[i].off[1];
    reading_off_by = 4.0;
    feed(off_since_40, 1.0);
    plant_nothing();
    plant(A0, SEARCH_SINCE, 4.0 * alarm_at, as_shift(A0, 4.0), 40);
    plant(A1, SEARCH_SINCE, 4.0 * of[i].other_score * alarm_at, as_shift(A1, 4.0), 40);
    assert_int_equal(named(A0, &a), of[i].named);
  }
}

/* The same, where the second deviates as long as the first does, by a step or by a drift that comes
 * to as much on the mean. */
static void two_sensors_disagree_together(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  const double drift = 4.0 * 512.0 / (BLOCKS - 40.0);
  const struct {
    double reading; /* what the second's agreement is off by */
    search_family family[2];
    double found[2]; /* shifts, in units of 0.05 */
    uint32_t onset[2];
    uint16_t named;
  } of[] = {{4.0, {SEARCH_SINCE, SEARCH_SINCE}, {4.0, 4.0}, {40, 40}, A1},
            {4.0, {SEARCH_SINCE, SEARCH_SINCE}, {4.0, 4.0}, {40, 60}, A1},
            {4.0, {SEARCH_SINCE, SEARCH_RAMP}, {4.0, drift}, {40, 40}, A1},
            {4.0, {SEARCH_RAMP, SEARCH_SINCE}, {drift, 4.0}, {40, 40}, A1},
            {4.0, {SEARCH_RAMP, SEARCH_RAMP}, {drift, drift}, {40, 40}, A1},
            /* A gain, of which the first's own blocks show none. */
            {4.0, {SEARCH_GAIN, SEARCH_GAIN}, {0.1, 0.1}, {40, 40}, A0},
            /* The second does not deviate where the first does. */
            {0.0, {SEARCH_SINCE, SEARCH_SINCE}, {4.0, 4.0}, {40, 40}, A0},
            {0.0, {SEARCH_RAMP, SEARCH_RAMP}, {drift, drift}, {40, 40}, A0},
            /* Of no block the commands say nothing. */
            {4.0, {SEARCH_SINCE, SEARCH_SINCE}, {4.0, 4.0}, {BLOCKS, BLOCKS}, A0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&r, false);
    off_by[0] = 0.0;
    off_by[1] = 4.0;
    reading_off_by = of[i].reading;
    feed(off_since_40, 1.0);
    plant_nothing();
    plant(A0, of[i].family[0], 4.0 * alarm_at, as_shift(A0, of[i].found[0]), of[i].onset[0]);
    plant(A1, of[i].family[1], 2.8 * alarm_at, as_shift(A1, of[i].found[1]), of[i].onset[1]);
    assert_int_equal(named(A0, &a), of[i].named);
  }
  reading_off_by = 4.0;
  from(&r, false);
  feed(off_since_40, 1.0);
  plant_nothing(); /* how its noise changed, the next channel after the agreements, is no reading */
  plant(A0, SEARCH_SINCE, 4.0 * alarm_at, as_shift(A0, 4.0), 40);
  plant(A1, SEARCH_SINCE, 2.8 * alarm_at, as_shift(A1, 4.0), 40);
  plant(RIM_CHANNEL_SCATTER * O, SEARCH_SINCE, 3.9 * alarm_at, 4.0, 40);
  assert_int_equal(named(A0, &a), A1);
  /* The second need not reach an alarm; what the commands find in the first is its own. */
  const struct {
    double reading, behaviour;
    uint16_t named;
  } least[] = {
      {0.202 * alarm_at, 2.9, A1}, {0.198 * alarm_at, 2.9, A0}, {0.202 * alarm_at, 3.1, A0}};
  for (size_t i = 0; i < sizeof least / sizeof *least; ++i) {
    plant_nothing();
    plant(A0, SEARCH_SINCE, 2.0 * alarm_at, as_shift(A0, 4.0), 40);
    plant(A1, SEARCH_SINCE, least[i].reading, as_shift(A1, 4.0), 40);
    plant(B0, SEARCH_SINCE, least[i].behaviour, as_shift(B0, 1.0), 70);
    assert_int_equal(named(A0, &a), least[i].named);
  }
}

/* ---- behaviour before agreement ---- */

/* The behaviour of both outcomes is off from block 40 on, and the agreement of outcome 0. */
static double together(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return i < 40 ? 0.0 : channel == B1 ? 10.0 : channel == B0 || channel == A0 ? 4.0 : 0.0;
}

static void the_vehicle_before_its_sensors(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(together, 1.0);
  const struct {
    double leading, score, shift; /* scores in alarms; of behaviour c */
    uint16_t c, named;
  } of[] = {{2.0, 1.0, 3.0, B1, B1},  {2.0, 1.0, -3.0, B1, B1}, {2.0, 0.99, 3.0, B1, A0},
            {5.0, 2.01, 3.0, B1, B1}, {5.0, 1.99, 3.0, B1, A0}, {2.0, 1.0, 3.0, B0, B0},
            {2.0, 1.0, -3.0, B0, A0}, {2.0, 1.0, 0.0, B0, B0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    plant_nothing();
    plant(A0, SEARCH_SINCE, of[i].leading * alarm_at, 3.0, 40);
    plant(of[i].c, SEARCH_SINCE, of[i].score * alarm_at, of[i].shift, 40);
    assert_int_equal(named(A0, &a), of[i].named);
  }
  for (uint16_t more = B0; more <= B1; ++more) { /* of two, the one that scores more */
    plant_nothing();
    plant(A0, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
    plant(B0, SEARCH_SINCE, 1.5 * alarm_at, 3.0, 40);
    plant(B1, SEARCH_SINCE, (more == B1 ? 1.6 : 1.4) * alarm_at, 3.0, 40);
    assert_int_equal(named(A0, &a), more);
  }
}

/* The same at another time. */
static double apart(uint32_t channel, uint32_t i, uint8_t byte) {
  return i >= 100 && i < 103 ? together(channel, i, byte) : 0.0;
}

static void another_time_is_another_matter(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  const struct {
    wave *of;
    search_family leading;
    uint16_t named;
  } of[] = {{together, SEARCH_SINCE, B1},
            {apart, SEARCH_SINCE, A0},
            {together, SEARCH_GAIN, B1},
            {apart, SEARCH_GAIN, A0},
            {apart, SEARCH_FIELD, B1}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&r, false);
    feed(of[i].of, 1.0);
    plant_nothing();
    plant(A0, of[i].leading, 20.0 * alarm_at, 3.0, of[i].of == apart ? 200 : 40);
    plant(B1, SEARCH_SINCE, 15.0 * alarm_at, 3.0, 40);
    assert_int_equal(named(A0, &a), of[i].named);
  }
}

/* Where no block is, nothing deviates together. */
static void a_time_without_blocks(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(together, 1.0);
  const uint32_t onset[] = {40, BLOCKS};
  for (size_t i = 0; i < 2; ++i) {
    plant_nothing();
    plant(A0, SEARCH_SINCE, 2.0 * alarm_at, 3.0, onset[i]);
    plant(B1, SEARCH_SINCE, alarm_at, 3.0, 40);
    assert_int_equal(named(A0, &a), onset[i] < BLOCKS ? B1 : A0);
  }
}

/* ---- what is integrated ---- */

static void the_cause_of_an_integral(void **state) {
  (void)state;
  rim_alarm a;
  recipe r = without_integrals();
  put_row(&r, 1, AGREEMENT_RESIDUALS, 0.0, 0, 0.0); /* outcome 1 mostly integrates outcome 0 */
  from(&r, false);
  feed(nothing, 1.0);
  const struct {
    search_family family; /* of the leading one, outcome 1's, since block 40 */
    uint16_t leading, c;  /* c: a channel of outcome 0 */
    double score;
    uint32_t onset;
    uint16_t named;
  } of[] = {{SEARCH_RAMP, A1, B0, 1.0, 40, B0},
            {SEARCH_RAMP, A1, A0, 1.0, 90, A0},
            {SEARCH_RAMP, A1, A0, 0.99, 40, A1},
            {SEARCH_SINCE, A1, A0, 9.0, 40, A1}, /* of a step, the commands have to say so too */
            {SEARCH_SINCE, B1, A0, 9.0, 40, B1},
            {SEARCH_SINCE, B1, B0, 1.0, 40, B0},
            {SEARCH_SINCE, B1, B0, 0.99, 40, B1},
            {SEARCH_SINCE, B1, B0, 1.0, 40 + SEARCH_LEAST, B0},
            {SEARCH_SINCE, B1, B0, 1.0, 41 + SEARCH_LEAST, B1}, /* it deviates since later */
            {SEARCH_SINCE, B1, B0, 1.0, SEARCH_FROM_START, B0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    plant_nothing();
    plant(of[i].leading, of[i].family, 3.0 * alarm_at, 3.0, 40);
    plant(of[i].c, SEARCH_SINCE, of[i].score * alarm_at, 3.0, of[i].onset);
    assert_int_equal(named(of[i].leading, &a), of[i].named);
  }
  plant_nothing(); /* outcome 0 integrates nothing */
  plant(A0, SEARCH_RAMP, 3.0 * alarm_at, 3.0, 40);
  plant(A1, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
  assert_int_equal(named(A0, &a), A0);
}

/* ---- a reading that stands still ---- */

static void repeats_are_the_cause(void **state) {
  (void)state;
  rim_alarm a;
  from(&calibrated[0], false);
  feed(nothing, 1.0);
  const uint16_t repeat = RIM_CHANNEL_REPEAT * O;
  const double unit = (double)rimi_noise_channel(&m->models.noise, repeat).s;
  const struct {
    double score, share;
    uint16_t named;
  } of[] = {{1.0, 0.31, repeat}, {1.0, 0.29, B0}, {0.99, 0.9, B0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    plant_nothing();
    plant(B0, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
    plant(repeat, SEARCH_SINCE, of[i].score * alarm_at, of[i].share / unit, 40);
    assert_int_equal(named(B0, &a), of[i].named);
    assert_int_equal(a.kind, of[i].named == repeat ? RIM_KIND_REPEAT : RIM_KIND_SHIFT);
  }
}

/* Scatter has no gain: what is said of it is a ratio of variances, whatever explains it. */
static void scatter_is_a_ratio(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(nothing, 1.0);
  const uint16_t scatter = RIM_CHANNEL_SCATTER * O;
  plant_nothing();
  plant(scatter, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
  plant(scatter + 1, SEARCH_GAIN, 1.5 * alarm_at, 0.5, 40);
  assert_int_equal(named(scatter, &a), scatter);
  assert_true(a.kind == RIM_KIND_VARIANCE && a.channels == 2 && a.channel[1] == 1);
  const noise_channel n = rimi_noise_channel(&m->models.noise, scatter + 1);
  assert_true(fabs(a.shift[1] - exp(0.5 * (double)n.s)) < 1e-9);
  assert_true(fabs(a.shift_sd[1] - 1.15 * (double)n.s * a.shift[1]) < 1e-6 * a.shift_sd[1]);
}

/* Where healthy runs exceed the ratio that their noise expects, standard errors grow by its root.
 */
static void errors_are_those_of_healthy_runs(void **state) {
  (void)state;
  rim_alarm a;
  recipe r = without_integrals();
  const uint16_t scatter = RIM_CHANNEL_SCATTER * O;
  put_noise_number(&r, scatter + 1, NOISE_CHANNEL_WORDS + FIELDS * (1 + RAW) + SEARCH_SINCE, 4.0);
  from(&r, false);
  feed(nothing, 1.0);
  plant_nothing();
  plant(scatter, SEARCH_SINCE, 9.0 * alarm_at, 3.0, 40);
  plant(scatter + 1, SEARCH_SINCE, 8.0 * alarm_at, 0.5, 40);
  assert_int_equal(named(scatter, &a), scatter);
  assert_true(a.channels == 2 && a.channel[1] == 1);
  const noise_channel n = rimi_noise_channel(&m->models.noise, scatter + 1);
  assert_true(fabs(a.shift_sd[1] - 2.0 * 1.15 * (double)n.s * a.shift[1]) < 1e-6 * a.shift_sd[1]);
}

/* ---- signs ---- */

static double agreement_since; /* of outcome 0's agreement from block 60 on; its behaviour: 2 */

static double both(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return i < 60 ? 0.0 : channel == B0 ? 2.0 : channel == A0 ? agreement_since : 0.0;
}

static void of_opposite_signs_the_surer(void **state) {
  (void)state;
  rim_alarm a;
  const struct {
    double agreement, shift;
    uint16_t named;
  } of[] = {{-6.0, -0.3, A0}, {6.0, 0.1, B0}, {-1.4, 0.1, B0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&calibrated[0], false);
    agreement_since = of[i].agreement;
    feed(both, 1.0);
    plant_nothing();
    plant(B0, SEARCH_SINCE, 2.0 * alarm_at, 2.0, 60);
    plant(A0, SEARCH_SINCE, alarm_at, of[i].agreement, 60);
    assert_int_equal(named(B0, &a), of[i].named);
    assert_true(fabs(a.shift[0] - of[i].shift) < 4.0 * a.shift_sd[0] && a.shift_sd[0] < 0.03);
    assert_true(fabs(a.since_s - 59.5) <= 3.0 * a.since_sd_s);
    assert_true(a.since_sd_s > 0.0 && (float)a.since_sd_s == m->explained_onset_sd);
    plant_nothing(); /* what does not pass is not asked */
    plant(B0, SEARCH_SINCE, 2.0 * alarm_at, 2.0, 60);
    plant(A0, SEARCH_SINCE, 0.99 * alarm_at, of[i].agreement, 60);
    assert_int_equal(named(B0, &a), B0);
  }
}

/* High where feature 0 is, low where it is not: the run's own offset could be either. */
static double halves(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)i;
  return channel != B0 && channel != A0 ? 0.0 : byte >= HALF ? 0.35 : -0.35;
}

/* The half that is high was found. */
static void find_high(uint32_t channel, uint8_t first, uint8_t last) {
  plant_nothing();
  search_hypothesis h = {
      .family = SEARCH_INTERVAL, .first = {first}, .last = {last}, .onset = SEARCH_FROM_START};
  assert_true(rimi_search_evaluate_channel(m->search, channel, &h) && h.shift > 0.0f);
  search_state(m->search, channel)->region = h;
}

static void explained_low(uint16_t channel, uint8_t feature) {
  search_hypothesis low = {.family = SEARCH_INTERVAL,
                           .feature = {feature},
                           .last = {HALF_BIN - 1},
                           .onset = SEARCH_FROM_START};
  assert_true(rimi_search_evaluate_channel(m->search, channel, &low) && low.shift < 0.0f);
  m->explained = low;
  m->explained_channel = channel;
  m->has_explained = true;
}

static void a_standing_alarm_keeps_its_sign(void **state) {
  (void)state;
  const struct {
    bool stands, has;
    uint16_t explained; /* channel */
    bool keeps;
  } of[] = {{true, true, B0, true},
            {true, true, A0, true}, /* beside what is found now */
            {true, true, B1, false},
            {false, true, B0, false},
            {true, false, B0, true}}; /* by what was said */
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&calibrated[0], false);
    feed(halves, 0.1);
    rim_alarm a;
    if (of[i].stands)
      stand(0);
    assert_int_equal(rim_monitor_standing(m, RIM_DETECTOR_RIM) != NULL, of[i].stands);
    explained_low(of[i].explained == B1 ? B0 : of[i].explained, 0);
    m->explained_channel = of[i].explained;
    m->has_explained = of[i].has;
    m->said_low[0] = UINT32_C(1) << (of[i].explained % O);
    find_high(B0, HALF_BIN, SEARCH_BINS - 1);
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(a.shift[0] < 0.0, of[i].keeps);
    assert_int_equal(m->explained.shift < 0.0f, of[i].keeps);
    assert_int_equal(a.region.dims, 1);
    assert_true(fabs(fabs(a.shift[0]) - 0.035) < 0.02);
    /* The command's range is -1..1, its half 0. */
    const double inside = of[i].keeps ? -0.5 : 0.5;
    assert_true(rim_region_contains(&a.region, &inside) || a.region.feature[0] != 0);
  }
}

/* High in the middle of feature 0, which is found, and, less clearly, low in half of feature 1.
 * Either side of the middle explains much less. */
static double crossed(uint32_t channel, uint32_t i, uint8_t byte) {
  const double low = (uint8_t)(i * 101u) < HALF ? -0.82 : 0.0;
  return channel != B0 ? 0.0 : low + (byte >= 85 && byte < 170 ? 1.0 : 0.0);
}

/* What the standing alarm was explained by keeps its sign where it was of this channel. */
static void what_explained_another_channel_does_not_count(void **state) {
  (void)state;
  rim_alarm a;
  const struct {
    bool has;
    uint16_t channel, feature; /* explained; by which it is now */
  } of[] = {{true, B0, 1}, {true, A0, 0}, {false, B0, 0}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    from(&calibrated[0], false);
    feed(crossed, 0.1);
    stand(0);
    m->said_low[0] = 1;
    explained_low(B0, 1);
    m->explained_channel = of[i].channel;
    m->has_explained = of[i].has;
    find_high(B0, 8, 15);
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.family, SEARCH_INTERVAL);
    assert_int_equal(m->explained.feature[0], of[i].feature);
    assert_int_equal(m->explained.shift < 0.0f, of[i].feature == 1);
  }
}

/* Healthy runs inflate some kinds of ratios more than others, so the score of what explains more
 * may be the smaller one. What stands for the sign is what explains more. */
static void the_sign_is_kept_by_what_explains_more(void **state) {
  (void)state;
  for (int inflated = 0; inflated < 2; ++inflated) {
    recipe r = calibrated[0];
    put_noise_number(&r, B0, NOISE_CHANNEL_WORDS + FIELDS * (1 + RAW) + SEARCH_INTERVAL_SINCE,
                     inflated ? 4.0 : 1.0);
    from(&r, false);
    feed(crossed, 0.1);
    stand(0);
    m->said_low[0] = 1;
    explained_low(B0, 1);
    m->explained.family = SEARCH_INTERVAL_SINCE;
    m->explained.onset = 1;
    search_hypothesis h = m->explained;
    assert_true(rimi_search_evaluate_channel(m->search, B0, &h));
    find_high(B0, 8, 15);
    search_hypothesis high = search_state(m->search, B0)->region, beside;
    assert_true(rimi_search_beside(m->search, B0, &high, &beside));
    assert_int_equal(h.score < beside.score, inflated);
    rim_alarm a;
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.family, SEARCH_INTERVAL_SINCE);
    assert_int_equal(m->explained.feature[0], 1);
    assert_true(m->explained.shift < 0.0f);
  }
}

/* Low in the lower half of feature 0, and as nominal in the rest. */
static double low_below(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)i;
  return channel == B0 && byte < HALF ? -1.5 : 0.0;
}

/* That the rest is high asks for an offset that healthy runs do not have. Once that was said of a
 * run whose own effects were known, it takes more to turn it. */
static void what_was_said_well_is_turned_less_easily(void **state) {
  (void)state;
  rim_alarm a;
  const struct { bool well, turned; } of[] = {{true, false}, {false, true}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    recipe r = without_integrals();
    put_noise_number(&r, B0, NOISE_CHANNEL_WORDS, 2.0); /* offsets of .7 of a block's noise */
    from(&r, false);
    feed(low_below, 1.0);
    stand(0);
    m->said_high[0] = 1;
    m->said_well[0] = of[i].well;
    find_high(B0, HALF_BIN, SEARCH_BINS - 1);
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.shift < 0.0f, of[i].turned);
  }
}

static uint32_t high_from;

static double high_since(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel == B0 && i >= high_from ? 3.0 : 0.0;
}

static double high_above(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)i;
  return channel == B0 && byte >= HALF ? 3.0 : 0.0;
}

/* By the time of a step the run's own effects were known or not; a region says no time. */
static void what_is_said_well_is_known_by_its_time(void **state) {
  (void)state;
  static const struct {
    uint32_t from;
    bool well;
  } of[] = {{15, false}, {16, true}, {40, true}, {SEARCH_FROM_START, false}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    const recipe r = without_integrals();
    const bool is_region = of[i].from == SEARCH_FROM_START;
    rim_alarm a;
    from(&r, false);
    high_from = of[i].from;
    feed(is_region ? high_above : high_since, 0.05);
    plant_nothing();
    if (is_region)
      find_high(B0, HALF_BIN, SEARCH_BINS - 1);
    else
      plant(B0, SEARCH_SINCE, 3.0 * alarm_at, as_shift(B0, 3.0), of[i].from);
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.onset, of[i].from);
    assert_int_equal(m->said_high[0], 1);
    assert_int_equal(m->said_well[0], of[i].well);
  }
}

/* Outcome 0 dies away as a run's own effect does, but from where no healthy run begins. */
static double dies_away(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel == B0 ? 8.0 * exp(-(double)i / 20.0) : 0.0;
}

static void effects_of_the_run_say_no_sign(void **state) {
  (void)state;
  rim_alarm a;
  for (int said = -1; said <= 1; ++said) {
    recipe r = without_integrals();
    put_noise_number(&r, B0, NOISE_CHANNEL_WORDS + FIELDS, 0.0);
    put_noise_number(&r, B0, NOISE_CHANNEL_WORDS + FIELDS + 3, 1.0); /* that decays */
    from(&r, false);
    feed(dies_away, 0.3);
    plant_nothing();
    plant(B0, SEARCH_SINCE, 2.0 * alarm_at, 3.0, 40);
    if (said != 0)
      stand(0);
    m->said_high[0] = said > 0;
    m->said_low[0] = said < 0;
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.family, SEARCH_FIELD);
    assert_true(m->explained.shift > 0.0f && a.kind == RIM_KIND_SHIFT && a.shift[0] > 0.0);
    assert_int_equal(m->said_high[0], said > 0); /* as it was */
    assert_int_equal(m->said_low[0], said < 0);
  }
}

/* ---- what the ring does not hold any more ---- */

enum { LONG = 400 }; /* blocks, of which the ring holds TRAINED_RING */

/* High in the upper half of feature 0, or where feature 1 is in its upper half too. */
static bool needs_both;

static double in_a_region(uint32_t channel, uint32_t i, uint8_t byte) {
  const bool second = (uint8_t)(i * 101u) >= HALF;
  return channel == B0 && byte >= HALF && (second || !needs_both) ? 10.0 : 0.0;
}

static search_hypothesis region_since(bool is_box, uint32_t onset) {
  return (search_hypothesis){.family = is_box ? SEARCH_BOX_SINCE : SEARCH_INTERVAL_SINCE,
                             .feature = {0, 1},
                             .first = {HALF_BIN, HALF_BIN},
                             .last = {SEARCH_BINS - 1, SEARCH_BINS - 1},
                             .onset = onset};
}

/* The region's deviation is as old as the run; found is that it began with what the ring holds. The
 * standing alarm was explained by the same before. */
static void an_onset_is_kept(void **state) {
  (void)state;
  rim_alarm a;
  const struct {
    bool box, stands, has;
    uint16_t channel; /* that was explained */
    search_family before;
    uint32_t onset;
    bool kept, throughout; /* found without an onset */
  } of[] = {{true, true, true, B0, SEARCH_BOX, SEARCH_FROM_START, true, false},
            {false, true, true, B0, SEARCH_INTERVAL, SEARCH_FROM_START, true, false},
            {true, true, true, B0, SEARCH_INTERVAL, SEARCH_FROM_START, false, false},
            {false, true, true, B0, SEARCH_BOX, SEARCH_FROM_START, false, false},
            {true, true, true, B0, SEARCH_BOX_SINCE, 20, true, false},
            {false, true, true, B0, SEARCH_INTERVAL_SINCE, 20, true, false},
            {false, true, true, B0, SEARCH_INTERVAL_SINCE, LONG - TRAINED_RING + 1, false, false},
            {true, false, true, B0, SEARCH_BOX, SEARCH_FROM_START, false, false},
            {true, true, false, B0, SEARCH_BOX, SEARCH_FROM_START, false, false},
            {true, true, true, B0, SEARCH_BOX_SINCE, 20, true, true},
            {false, true, true, B0, SEARCH_INTERVAL_SINCE, 20, true, true},
            {false, true, true, B0, SEARCH_INTERVAL_SINCE, LONG - TRAINED_RING, false, true},
            {false, true, true, B0, SEARCH_BOX_SINCE, 20, false, true},
            {true, true, true, B1, SEARCH_BOX, SEARCH_FROM_START, false, false}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    const recipe r = without_integrals();
    from(&r, false);
    needs_both = of[i].box;
    feed_blocks(in_a_region, 0.3, LONG);
    const uint32_t oldest = LONG - TRAINED_RING;
    assert_int_equal(rimi_search_oldest(m->search), oldest);
    plant_nothing();
    search_hypothesis h = region_since(of[i].box, oldest);
    assert_true(rimi_search_evaluate_channel(m->search, B0, &h) && h.shift > 0.0f);
    const uint32_t first = rimi_search_first_inside(m->search, &h); /* that tells of it */
    if (of[i].throughout) {
      h.family = of[i].box ? SEARCH_BOX : SEARCH_INTERVAL;
      h.onset = SEARCH_FROM_START;
      assert_true(rimi_search_evaluate_channel(m->search, B0, &h));
    }
    search_state(m->search, B0)->region = h;
    if (of[i].stands)
      stand(0);
    m->explained = h;
    m->explained.family = (uint8_t)of[i].before;
    m->explained.onset = of[i].onset;
    m->explained_channel = of[i].channel;
    m->has_explained = of[i].has;
    assert_int_equal(named(B0, &a), B0);
    /* Not kept, it is the same or, in fewer words, throughout. */
    const uint8_t throughout = of[i].box ? SEARCH_BOX : SEARCH_INTERVAL;
    if (!of[i].kept && m->explained.family == throughout) {
      assert_int_equal(m->explained.onset, SEARCH_FROM_START);
    } else {
      assert_int_equal(m->explained.family, of[i].kept ? of[i].before : h.family);
      assert_int_equal(m->explained.onset, of[i].kept ? of[i].onset : first);
    }
    assert_int_equal(a.region.dims, of[i].box ? 2 : 1);
  }
}

/* Only outcome 0 deviates. */
static double first_alone(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel % O == 0 && i >= 40 ? 4.0 : 0.0;
}

/* The other is named because its score passes; where and when the first deviates it reads neither
 * high nor low, and so no sign is said of it. */
static void what_is_not_off_has_no_sign(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(first_alone, 0.0);
  plant_nothing();
  plant(B0, SEARCH_SINCE, 3.0 * alarm_at, as_shift(B0, 4.0), 40);
  plant(A1, SEARCH_SINCE, alarm_at, 3.0, 40);
  assert_int_equal(named(B0, &a), B0);
  assert_int_equal(a.channels, 2);
  assert_int_equal(m->said_high[0], 1);
  assert_int_equal(m->said_low[0], 0);
}

/* Outcome 0 reads low since block 40, and more clearly not far enough from 0, which it is on both
 * sides of: a gain that reads neither high nor low. It does not take the place of what a standing
 * alarm said while that explains nearly as much. */
static void a_gain_without_a_sign_turns_none(void **state) {
  (void)state;
  static const struct {
    double low; /* units of 0.05 */
    bool stands, keeps;
  } of[] = {{2.2, true, true}, {2.2, false, false}, {0.3, true, false}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    rim_alarm a;
    const recipe r = without_integrals();
    from(&r, false);
    rim_rng rng;
    rimi_rng_seed(&rng, SEED, 2);
    for (uint32_t t = 0; t < BLOCKS; ++t) {
      double residual[CHANNELS], predicted[CHANNELS] = {0.0};
      const uint8_t feature[REGION] = {(uint8_t)(t * 37u), (uint8_t)(t * 101u)};
      predicted[B0] = t % 2u == 0 ? 0.6 : -0.6;
      for (uint32_t c = 0; c < CHANNELS; ++c)
        residual[c] = 0.05 * rimi_rng_normal(&rng);
      if (t >= 40)
        residual[B0] -= 0.105 * predicted[B0] + 0.05 * of[i].low;
      const search_block block = {.t_s = t,
                                  .feature = feature,
                                  .mean = predicted,
                                  .predicted = predicted,
                                  .residual = residual};
      assert_int_equal(rimi_search_observe(m->search, &block), RIM_OK);
    }
    plant_nothing();
    plant(B0, SEARCH_GAIN, 3.0 * alarm_at, -0.105, 40);
    search_hypothesis low = {.family = SEARCH_SINCE, .onset = 40};
    assert_true(rimi_search_evaluate_channel(m->search, B0, &low) && low.shift < 0.0f);
    if (of[i].stands) {
      stand(0);
      m->said_low[0] = 1;
      m->explained = low;
      m->explained_channel = B0;
      m->has_explained = true;
    }
    assert_int_equal(named(B0, &a), B0);
    print_message("low by %g: kind %d, score %g of %g\n", of[i].low, a.kind, (double)low.score,
                  (double)m->explained.score);
    assert_int_equal(a.kind, of[i].keeps ? RIM_KIND_SHIFT : RIM_KIND_GAIN);
  }
}

/* What explains a standing alarm begins in block 40. The alarm was raised when so many blocks had
 * been seen, for an outcome that deviates still or not. */
static void a_deviation_began_before_its_alarm(void **state) {
  (void)state;
  static const struct {
    bool stands, both; /* outcome 1 deviates too */
    uint16_t outcome;
    uint32_t raised_at;
    rim_kind kind;
    bool kept;
  } of[] = {
      {true, false, 0, 40, RIM_KIND_SHIFT, true},   {true, false, 0, 41, RIM_KIND_SHIFT, false},
      {true, false, 0, 20, RIM_KIND_DRIFT, true},   {true, false, 0, 20, RIM_KIND_VARIANCE, false},
      {true, false, 0, 20, RIM_KIND_REPEAT, false}, {true, false, 1, 20, RIM_KIND_SHIFT, false},
      {true, true, 1, 20, RIM_KIND_SHIFT, true},    {false, false, 0, 20, RIM_KIND_SHIFT, false}};
  for (size_t i = 0; i < sizeof of / sizeof *of; ++i) {
    rim_alarm a;
    const recipe r = without_integrals();
    from(&r, false);
    off_by[0] = 4.0;
    off_by[1] = 0.0;
    feed(off_since_40, 0.2);
    plant_nothing();
    plant(B0, SEARCH_SINCE, 3.0 * alarm_at, as_shift(B0, 4.0), 40);
    if (of[i].both)
      plant(B1, SEARCH_SINCE, alarm_at, 1.0, 40);
    if (of[i].stands)
      stand(of[i].outcome);
    rim_alarm *standing = &m->life.slot[RIM_DETECTOR_RIM].record;
    standing->kind = (uint8_t)of[i].kind;
    standing->since_s = -7.0;
    standing->since_sd_s = 0.25;
    m->raised_at = of[i].raised_at;
    assert_int_equal(named(B0, &a), B0);
    assert_int_equal(m->explained.onset, 40);
    assert_int_equal(a.since_s == -7.0 && a.since_sd_s == 0.25, of[i].kept);
    assert_int_equal(m->raised_at, of[i].stands ? of[i].raised_at : BLOCKS);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(the_twin_that_is_wrong),
      cmocka_unit_test(the_reading_that_the_commands_deny),
      cmocka_unit_test(two_sensors_disagree_together),
      cmocka_unit_test(the_vehicle_before_its_sensors),
      cmocka_unit_test(a_time_without_blocks),
      cmocka_unit_test(another_time_is_another_matter),
      cmocka_unit_test(the_cause_of_an_integral),
      cmocka_unit_test(repeats_are_the_cause),
      cmocka_unit_test(scatter_is_a_ratio),
      cmocka_unit_test(errors_are_those_of_healthy_runs),
      cmocka_unit_test(of_opposite_signs_the_surer),
      cmocka_unit_test(a_standing_alarm_keeps_its_sign),
      cmocka_unit_test(what_explained_another_channel_does_not_count),
      cmocka_unit_test(what_was_said_well_is_turned_less_easily),
      cmocka_unit_test(what_is_said_well_is_known_by_its_time),
      cmocka_unit_test(the_sign_is_kept_by_what_explains_more),
      cmocka_unit_test(effects_of_the_run_say_no_sign),
      cmocka_unit_test(an_onset_is_kept),
      cmocka_unit_test(what_is_not_off_has_no_sign),
      cmocka_unit_test(a_gain_without_a_sign_turns_none),
      cmocka_unit_test(a_deviation_began_before_its_alarm),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
