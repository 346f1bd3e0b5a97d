/* SPDX-License-Identifier: MIT */
/* Every status has a text of its own. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "rim/status.h"

static void texts_are_distinct(void **state) {
  (void)state;
  for (int i = RIM_OK; i >= RIM_E_DATA; --i) {
    const char *text = rim_status_text((rim_status)i);
    assert_non_null(text);
    assert_string_not_equal(text, "unknown status");
    for (int j = RIM_OK; j > i; --j) {
      assert_string_not_equal(text, rim_status_text((rim_status)j));
    }
  }
}

static void others_are_unknown(void **state) {
  (void)state;
  int value = 1;
  rim_status status = RIM_OK;
  memcpy(&status, &value, sizeof status);
  assert_string_equal(rim_status_text(status), "unknown status");
  assert_string_equal(rim_status_text((rim_status)-14), "unknown status");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(texts_are_distinct),
      cmocka_unit_test(others_are_unknown),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
