/* SPDX-License-Identifier: MIT */
/* Every decoder on its corpus and on a short run of damaged copies of it. RIM_FUZZ names the folder
 * (tests/fuzz/corpus); `make fuzz` searches for longer, guided by coverage. */
#define _GNU_SOURCE
#include <dirent.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <unistd.h>

#include <cmocka.h>

#include "../fuzz/fuzz_decoders.h"

#define MOST 8192
#define COPIES 20000 /* of each file */

static uint32_t next(uint32_t *state) {
  *state = *state * 1664525u + 1013904223u;
  return *state >> 8;
}

/* One to eight bytes changed, or the end cut, or bytes doubled. */
static size_t damage(uint8_t *data, size_t bytes, uint32_t *random) {
  for (uint32_t k = next(random) % 8 + 1; k > 0 && bytes > 1; k--)
    data[1 + next(random) % (bytes - 1)] = (uint8_t)next(random);
  if (next(random) % 4 == 0)
    bytes = 1 + next(random) % bytes;
  if (next(random) % 8 == 0 && bytes < MOST / 2) {
    memcpy(data + bytes, data + 1, bytes - 1);
    bytes += bytes - 1;
  }
  return bytes;
}

static void the_corpus_and_its_damaged_copies(void **state) {
  (void)state;
  static uint8_t good[MOST], bad[MOST];
  uint32_t random = 77, files = 0;
  const char *folder = getenv("RIM_FUZZ") != NULL ? getenv("RIM_FUZZ") : "tests/fuzz/corpus";
  printf("seed %u\n", random);
  /* config_parse tells every error: not here. */
  const int null = open("/dev/null", O_WRONLY), errors = dup(STDERR_FILENO);
  assert_true(dup2(null, STDERR_FILENO) >= 0);
  DIR *all = opendir(folder);
  assert_non_null(all);
  for (struct dirent *entry; (entry = readdir(all)) != NULL;) {
    char path[600];
    snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
    FILE *file = entry->d_name[0] != '.' ? fopen(path, "rb") : NULL;
    if (file == NULL)
      continue;
    const size_t bytes = fread(good, 1, sizeof good, file);
    fclose(file);
    fuzz_one(good, bytes);
    files++;
    for (int i = 0; i < COPIES; ++i) {
      memcpy(bad, good, bytes);
      fuzz_one(bad, damage(bad, bytes, &random));
    }
  }
  closedir(all);
  dup2(errors, STDERR_FILENO);
  assert_true(files >= 15);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(the_corpus_and_its_damaged_copies)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
