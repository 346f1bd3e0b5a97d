/* SPDX-License-Identifier: MIT */
/* The records of a trained monitor keep their bits (bits.h), from the first alarm to its end:
 * monitor/step.c and describe.c on faults of several kinds, in outcomes that agree, that integrate
 * one another or are watched by few others. */
#include "bits.h"

#include "monitor/monitor_private.h"

#include "monitor_bench.h"

enum { FLOWN = 1400, FROM = 420, TO = 700 };

typedef enum fault {
  HEALTHY,
  BIAS,       /* of sensor 1, for good */
  SPELL,      /* and for a while */
  TWO_SPELLS, /* and again, with the other sign */
  DRIFT,
  PLACE, /* where the command is high */
  STUCK,
  NOISY,
  OTHER, /* sensor 2 drifts off */
  BOTH,  /* the vehicle: both at once */
  SILENCE,
  FAULTS
} fault;

static void faulty_row(row *r, uint32_t run, uint32_t t, fault of) {
  make_row(r, false, run, t, of == PLACE && t > FROM ? 0.3 : 0.0);
  const double since = t < FROM ? 0.0 : (double)(t - FROM);
  const bool on = t >= FROM, spell = t >= FROM && t < TO;
  double *s1 = &r->context[1], *s2 = &r->context[2];
  *s1 += of == BIAS && on ? 0.3 : of == DRIFT ? 0.001 * since : 0.0;
  *s1 += (of == SPELL || of == TWO_SPELLS) && spell ? 0.4 : 0.0;
  *s1 -= of == TWO_SPELLS && t >= TO + 250 && t < TO + 500 ? 0.4 : 0.0;
  *s1 += of == BOTH && on ? -0.25 : of == SILENCE && on ? 0.3 : 0.0;
  *s2 += of == BOTH && on ? 0.2 : of == OTHER ? -0.0008 * since : 0.0;
  if (of == STUCK && on && t % 4 != 0)
    *s2 = 0.0625;
  if (of == NOISY && on)
    *s1 += (t % 2 == 0 ? 1.0 : -1.0) * 0.25;
  r->t_s += of == SILENCE && t > TO ? 40.0 * PERIOD_S : 0.0;
  r->view.t_s = r->t_s;
}

static void take_record(uint64_t *digest, const rim_alarm *a) {
  const double of_it[6] = {a->t_s, a->since_s, a->since_sd_s, a->ln_anom, a->threshold, a->p_value};
  take_reals(digest, of_it, 6);
  take_bits(digest, (uint64_t)a->seq << 32 | a->observations);
  take_bits(digest, (uint64_t)a->state << 24 | (uint64_t)a->level << 16 | (uint64_t)a->kind << 8 |
                        a->flags);
  for (uint32_t i = 0; i < a->channels; ++i) {
    take_bits(digest, a->channel[i]);
    take_real(digest, a->shift[i]);
    take_real(digest, a->shift_sd[i]);
  }
  for (uint32_t i = 0; i < a->region.dims; ++i) {
    take_bits(digest, a->region.feature[i]);
    take_real(digest, a->region.lower[i]);
    take_real(digest, a->region.upper[i]);
  }
}

/* How outcome 0 and 1 watch one another. */
static void put_rows(recipe *r, double first, double second, double mostly, double weight) {
  const double source[O] = {first, second};
  for (size_t o = 0; o < O; ++o) {
    uint8_t *at =
        r->section[RIM_SECTION_AGREEMENT].byte + 16 + 4 * O + 4 * o * (4 + O * (2 + MEANS));
    put_f32(at, source[o]);
    put_f32(at + 8, o == 1 ? mostly : -1.0);
    put_f32(at + 16 + 4 * (1 - o), weight);
  }
}

static uint64_t flown(const recipe *r, fault of, uint32_t *records) {
  static bench b, copy;
  uint64_t digest = BITS_START;
  memset(&b, 0, sizeof b);
  build(&b.blob, r);
  start(&b);
  for (uint32_t t = 0; t < FLOWN; ++t) {
    row now;
    rim_verdict v;
    rim_alarm record;
    faulty_row(&now, 940, t, of);
    assert_int_equal(rim_monitor_step(b.monitor, &now.view, &v), RIM_OK);
    record = v.alarm;
    while (record.seq > 0) {
      take_record(&digest, &record);
      ++*records;
      record.seq = 0;
      (void)rim_monitor_next_record(b.monitor, &record);
    }
    if (t % 40 != 39)
      continue;
    uint32_t first = 0, end = 0;
    take_bits(&digest, rim_monitor_ended(b.monitor, &first, &end));
    take_bits(&digest, (uint64_t)first << 32 | end);
    take_real(&digest, rim_monitor_membership(b.monitor, now.context));
    if (v.blocks == 0 || !(v.score > 1.0))
      continue;
    rim_alarm seen; /* what would be said now, whether it is or not */
    copy = b;
    assert_int_equal(rim_monitor_attach(&copy.monitor, copy.memory, sizeof copy.memory,
                                        copy.blob.byte, copy.blob.size),
                     RIM_OK);
    copy.monitor->guard.busy = true; /* as within a step */
    rimi_monitor_describe(copy.monitor, &v, &seen);
    take_record(&digest, &seen);
    take_bits(&digest, copy.monitor->explained_channel);
    take_real(&digest, (double)copy.monitor->explained.shift);
  }
  return digest;
}

static void records_keep_their_bits(void **state) {
  (void)state;
  static const uint64_t expected[FAULTS] = {
      UINT64_C(0x68cc7def32bd7527), UINT64_C(0x515afafbc57e9e62), UINT64_C(0xab4621a749b337de),
      UINT64_C(0xc1f7306eae91f596), UINT64_C(0x87e4dd3c61522546), UINT64_C(0x8fca7e79b6807fb8),
      UINT64_C(0x3dd63cbbafb9fd55), UINT64_C(0xf58a7a69ff6794cd), UINT64_C(0x5a5491483294a608),
      UINT64_C(0xd5c466cb5cc3948c), UINT64_C(0xb016adb2c1b9cd7d)};
  recipe of[3] = {calibrated[0], calibrated[0], calibrated[0]};
  put_rows(&of[1], AGREEMENT_RESIDUALS, AGREEMENT_RESIDUALS, 0.0, 0.5);
  put_rows(&of[2], AGREEMENT_FEW, AGREEMENT_FEW, -1.0, 0.8);
  for (int what = HEALTHY; what < FAULTS; ++what) {
    uint64_t digest = BITS_START;
    uint32_t records = 0;
    for (size_t i = 0; i < 3; ++i)
      take_bits(&digest, flown(&of[i], (fault)what, &records));
    print_message("fault %d: %u records, %016llx\n", what, records, (unsigned long long)digest);
    bits_are(digest, expected[what]);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(records_keep_their_bits),
  };
  return cmocka_run_group_tests(tests, set_up, NULL);
}
