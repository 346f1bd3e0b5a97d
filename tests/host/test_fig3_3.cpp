// SPDX-License-Identifier: MIT
// FARO in the binary golf world: what a run leaves, and what a bump does to it.
#include "check.hpp"
#include "thesis/experiment/fig3_3.hpp"

#include <cmath>
#include <cstdio>

namespace {

constexpr std::uint64_t kSeed = 91;

void a_bump_is_found_and_nothing_else(void **) {
  std::printf("seed %llu\n", static_cast<unsigned long long>(kSeed));
  double highest = 0.0, recall = 0.0, precision = 0.0;
  for (std::uint64_t k = 0; k < 3; ++k) {
    highest = std::fmax(highest, rim::run_faro_nominal(200, kSeed + k).highest);
    const rim::FaroTrace trace = rim::run_faro_golf(0.2, 40, 0.0, kSeed + k);
    assert_int_equal(trace.ln_anom.size(), 40);
    assert_true(trace.ln_anom.back() > 1.5 * highest && trace.ln_anom.back() > trace.ln_anom[9]);
    precision += trace.precision.back() / 3.0;
    recall += trace.recall.back() / 3.0;
    assert_true(trace.highest >= trace.ln_anom.back());
  }
  assert_true(highest > 1.0);
  assert_true(precision > 0.75 && precision <= 1.0);
  assert_true(recall > 0.6 && recall <= 1.0);
}

void a_weak_bump_takes_longer(void **) {
  const std::size_t strong = rim::run_faro_golf(0.2, 1, 20.0, kSeed).ln_anom.size();
  const std::size_t weak = rim::run_faro_golf(0.5, 1, 20.0, kSeed).ln_anom.size();
  assert_true(weak > strong + 5);
}

void the_same_run_again(void **) {
  const rim::FaroTrace one = rim::run_faro_golf(0.3, 12, 0.0, kSeed),
                       two = rim::run_faro_golf(0.3, 12, 0.0, kSeed),
                       other = rim::run_faro_golf(0.3, 12, 0.0, kSeed + 1);
  assert_true(one.ln_anom == two.ln_anom && one.recall == two.recall);
  assert_false(one.ln_anom == other.ln_anom);
}

} // namespace

int main() {
  const CMUnitTest tests[] = {
      cmocka_unit_test(a_bump_is_found_and_nothing_else),
      cmocka_unit_test(a_weak_bump_takes_longer),
      cmocka_unit_test(the_same_run_again),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
