/* SPDX-License-Identifier: MIT */
/* seeds DIR: the seeds of tests/fuzz/corpus that librim itself packs: flight images of the unit
 * tests, a correction, an interference model, a state file. Behind the byte that chooses. */
#include "monitor_bench.h"

#include <stdio.h>

#include "image/correct.h"
#include "interference/detector.h"

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
  rim_interference_model m = {.ln_odds = 8.0,
                              .latency_s = 0.1,
                              .accel_mps2 = 1.0,
                              .decel_mps2 = 2.0,
                              .settle_s = 0.2,
                              .gap_s = 0.5,
                              .one_step = {0.03, 0.06, 1.0, 8.0},
                              .open_loop = {0.03, 0.06, 1.0, 12.0}};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j < 5; ++j)
      m.transition[i][j] = i == j ? 0.96 : 0.01;
    for (int k = 0; k < 3; ++k) {
      m.mean[i][k] = 0.1 * (i - k);
      m.sd[i][k] = 0.2 + 0.1 * k;
    }
  }
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
