/* SPDX-License-Identifier: MIT */
/* own_folder.h - a folder of a test's own, and the names of the files in it. */
#ifndef OWN_FOLDER_H
#define OWN_FOLDER_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

static char folder[64];

static inline bool make_folder(void) {
  snprintf(folder, sizeof folder, "/tmp/rim_test_XXXXXX");
  return mkdtemp(folder) != NULL;
}

/* Four names are kept at a time. */
static inline const char *file(const char *name) {
  static char path[4][128];
  static unsigned turn;
  char *to = path[turn++ % 4];
  snprintf(to, sizeof path[0], "%s/%s", folder, name);
  return to;
}

#endif
