/* SPDX-License-Identifier: MIT */
/* monitor/describe.c where more outcomes deviate than a record names. */
#define BENCH_OUTCOMES 6
#include "describe_bench.h"

static double all_since_40(uint32_t channel, uint32_t i, uint8_t byte) {
  (void)byte;
  return channel < O && i >= 40 ? 4.0 : 0.0;
}

/* The one that leads, then the most anomalous of the others, as many as there is room for. */
static void a_record_names_the_most_anomalous(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(all_since_40, 0.2);
  plant_nothing();
  for (uint32_t o = 0; o < O; ++o)
    plant(o, SEARCH_SINCE, (3.0 + 0.1 * (o * 5 % 6)) * alarm_at, as_shift(o, 4.0), 40);
  const uint16_t first = named(1, &a);
  assert_int_equal(a.channels, RIM_ALARM_MAX_CHANNELS);
  uint32_t before = UINT32_MAX;
  for (uint32_t i = 0; i < a.channels; ++i) {
    assert_true(a.channel[i] < O && a.shift[i] > 0.0 && a.shift_sd[i] > 0.0);
    if (i == 0) {
      assert_int_equal(a.channel[0], first);
      continue;
    }
    const uint32_t rank = a.channel[i] * 5u % 6u;
    assert_true(a.channel[i] != first && rank < before);
    before = rank;
  }
}

/* Each record of a standing alarm settles, beside the leading outcome, the sign of one more of the
 * others that it names, until it has said all of them. */
static void each_record_says_the_sign_of_one_more(void **state) {
  (void)state;
  rim_alarm a;
  const recipe r = without_integrals();
  from(&r, false);
  feed(all_since_40, 0.2);
  stand(1);
  for (uint32_t records = 1; records <= RIM_ALARM_MAX_CHANNELS; ++records) {
    plant_nothing();
    for (uint32_t o = 0; o < O; ++o)
      plant(o, SEARCH_SINCE, (3.0 + 0.1 * (o * 5 % 6)) * alarm_at, as_shift(o, 4.0), 40);
    (void)named(1, &a);
    uint32_t said = 0;
    for (uint32_t i = 0; i < a.channels; ++i)
      said += m->said_high[0] >> a.channel[i] & 1u;
    assert_int_equal(a.channels, RIM_ALARM_MAX_CHANNELS);
    assert_int_equal(said, records + 1 < a.channels ? records + 1 : a.channels);
    assert_int_equal(m->said_low[0], 0);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(a_record_names_the_most_anomalous),
                                     cmocka_unit_test(each_record_says_the_sign_of_one_more)};
  return cmocka_run_group_tests(tests, set_up_trained, NULL);
}
