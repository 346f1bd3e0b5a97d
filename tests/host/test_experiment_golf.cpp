// SPDX-License-Identifier: MIT
// The golf experiment in small: equal for equal seeds, however it is sharded; what is counted as
// what.
#include <algorithm>
#include <cstdio>

#include "check.hpp"
#include "thesis/experiment/golf.hpp"
#include "util/error.hpp"

namespace {

rim::GolfExperiment small() {
  rim::GolfExperiment e;
  e.dims = {2, 5};
  e.runs = 6;
  e.nominal = 10;
  e.calibration = 19; // the fewest that can promise 5 %
  e.seed = 90000;
  e.search = rim::GolfSearch::flight;
  return e;
}

void a_run_is_its_seed(void **) {
  const rim::GolfRun one = rim::run_golf(10, 90001, true, rim::GolfSearch::standard);
  const rim::GolfRun two = rim::run_golf(10, 90001, true, rim::GolfSearch::standard);
  assert_true(one.f1 == two.f1 && one.score_by_anomalous == two.score_by_anomalous);
  assert_true(one.f1 > 0.0 && one.f1 <= 1.0);
  assert_int_equal(one.score_by_anomalous.size(), 31);
  for (std::size_t k = 1; k < 31; ++k)
    assert_true(one.score_by_anomalous[k] >= one.score_by_anomalous[k - 1]);
  assert_true(one.score_by_anomalous.back() == one.largest_score);
  const rim::GolfRun null = rim::run_golf(10, 90001, false, rim::GolfSearch::standard);
  assert_int_equal(null.shots, one.shots);
  assert_true(null.largest_score < one.largest_score);
}

void shards_make_the_whole(void **) {
  const rim::GolfExperiment e = small();
  const rim::Campaign whole = rim::run_golf_campaign(e, {1, 1});
  assert_true(whole.complete());
  rim::Campaign merged = rim::run_golf_campaign(e, {1, 2});
  assert_false(merged.complete());
  const rim::Campaign rest = rim::run_golf_campaign(e, {2, 2});
  merged.units.insert(rest.units.begin(), rest.units.end());
  assert_true(merged.units == whole.units);
  const auto a = rim::summarise_golf(whole);
  const auto b = rim::summarise_golf(merged);
  assert_int_equal(a.size(), 2);
  for (std::size_t k = 0; k < 2; ++k) {
    assert_true(a[k].f1.value == b[k].f1.value && a[k].threshold == b[k].threshold);
    assert_true(a[k].f1.low <= a[k].f1.value && a[k].f1.value <= a[k].f1.high);
    assert_true(a[k].f1.value > 0.7);
  }
  double largest = 0.0; // of 19 calibration runs the threshold is the largest
  for (std::uint64_t i = 0; i < e.calibration; ++i)
    largest = std::max(largest, whole.units.at(i).at("largest").get<double>());
  assert_true(a[0].threshold == largest);
}

void too_few_runs_promise_nothing(void **) {
  rim::GolfExperiment e = small();
  e.dims = {2};
  e.calibration = 18;
  const auto s = rim::summarise_golf(rim::run_golf_campaign(e, {1, 1}));
  assert_true(s[0].false_alarms == 0.0);
  assert_int_equal(s[0].missed, e.runs);
  assert_true(s[0].threshold > 1e300);
}

template <class Error, class Body> bool throws(Body body) {
  try {
    body();
  } catch (const Error &) {
    return true;
  }
  return false;
}

void wrong_campaigns_are_refused(void **) {
  rim::GolfExperiment e = small();
  rim::Campaign half = rim::run_golf_campaign(e, {1, 20});
  assert_true(throws<rim::DataError>([&] { rim::summarise_golf(half); }));
  half.kind = "lander";
  assert_true(throws<rim::DataError>([&] { rim::summarise_golf(half); }));
  assert_true(throws<rim::UsageError>([] { rim::parse_golf_search("fast"); }));
}

} // namespace

int main() {
  std::printf("seed %llu\n", static_cast<unsigned long long>(small().seed));
  const CMUnitTest tests[] = {cmocka_unit_test(a_run_is_its_seed),
                              cmocka_unit_test(shards_make_the_whole),
                              cmocka_unit_test(too_few_runs_promise_nothing),
                              cmocka_unit_test(wrong_campaigns_are_refused)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
