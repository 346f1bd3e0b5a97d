/* SPDX-License-Identifier: MIT */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "rim/version.h"

static void headers_and_library_agree(void **state) {
  (void)state;
  assert_int_equal(rim_version(), RIM_VERSION_NUMBER);
  assert_int_equal(rim_version() / 1000000, RIM_VERSION_MAJOR);
  assert_int_equal(rim_version() / 1000 % 1000, RIM_VERSION_MINOR);
  assert_int_equal(rim_version() % 1000, RIM_VERSION_PATCH);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(headers_and_library_agree)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
