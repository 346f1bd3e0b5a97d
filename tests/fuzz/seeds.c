/* SPDX-License-Identifier: MIT */
/* seeds DIR: the seeds of tests/fuzz/corpus that librim itself packs: flight images of the unit
 * tests, a correction, an interference model, a state file. Behind the byte that chooses. */
#include "interference_sample.h"
#include "monitor_bench.h"

#include <stdio.h>

#include "image/correct.h"

static const char *folder;

static void keep(const char *name, uint8_t decoder, const uint8_t *data, size_t size) {
  char path[600];
  snprintf(path, sizeof path, "%s/%s", folder, name);
  FILE *file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fputc(decoder, file), decoder);
  assert_int_equal(fwrite(data, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static void keep_images(void) {
  recipe r;
  image m;
  external_recipe(&r);
  build(&m, &r);
  keep("flight_external", 9, m.byte, m.size);
  trained_recipe(&r);
  build(&m, &r);
  keep("flight_trained", 9, m.byte, m.size);
}

static void keep_correct(void) {
  const rim_correct_region region[2] = {
      {.region = {.dims = 1, .inverse_shape = {4.0}, .lower = {-0.5}, .upper = {0.5}},
       .confidence = 0.5},
      {.region = {.dims = 1, .inverse_shape = {4.0}, .lower = {0.2}, .upper = {0.9}},
       .is_box = true,
       .confidence = 1.0}};
  const double shift[4] = {1.0, 2.0, 3.0, 4.0};
  const rim_correct_model model = {
      .features = 3, .outcomes = 2, .regions = 2, .kinds = 1, .region = region, .shift = shift};
  static _Alignas(8) uint8_t section[8192];
  for (size_t size = 32; size < sizeof section; size += 4) {
    if (rimi_correct_pack(&model, section, size) == RIM_OK) {
      keep("sum_correct", 11, section, size);
      return;
    }
  }
  fail_msg("no size fits the correction");
}

static void keep_interference(void) {
  const rim_interference_model m = sample_interference();
  static _Alignas(8) uint8_t section[RIM_INTERFERENCE_BYTES];
  assert_int_equal(rimi_interference_pack(&m, section, sizeof section), RIM_OK);
  keep("sum_interference", 11, section, sizeof section);
}

int main(int argc, char **argv) {
  if (argc != 2)
    return 2;
  folder = argv[1];
  keep_images();
  keep_correct();
  keep_interference();
  return 0;
}
