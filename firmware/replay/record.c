/* SPDX-License-Identifier: MIT */
/* record IMAGE.rim LOG.csv OUT.rec [ROWS]: on the build machine, the recording that a port carries.
 *
 * The log is what `rim simulate` writes: a header line, a number in every field, time first.
 * Columns are found by the names in the image. Only the first ROWS rows, if given. Exit 3: the
 * reason on stderr. */
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/crc.h"
#include "replay/recording.h"
#include "rim/monitor.h"

#define MAX_BYTES (64u << 20)
#define LINE_BYTES 16384

static _Alignas(8) unsigned char out[MAX_BYTES];
static char line[LINE_BYTES];

static _Noreturn void refuse(const char *format, ...) {
  va_list arguments;
  va_start(arguments, format);
  fputs("record: ", stderr);
  vfprintf(stderr, format, arguments);
  fputc('\n', stderr);
  va_end(arguments);
  exit(3);
}

static void put_u32(size_t at, uint32_t value) {
  for (size_t i = 0; i < 4; ++i)
    out[at + i] = (unsigned char)(value >> (8 * i));
}

static void put_f64(size_t at, double value) {
  uint64_t bits;
  memcpy(&bits, &value, sizeof bits);
  for (size_t i = 0; i < 8; ++i)
    out[at + i] = (unsigned char)(bits >> (8 * i));
}

static size_t read_image(const char *path) {
  FILE *file = fopen(path, "rb");
  if (file == NULL)
    refuse("%s: %s", path, strerror(errno));
  const size_t bytes = fread(out + RECORDING_HEADER_BYTES, 1, MAX_BYTES / 2, file);
  fclose(file);
  return bytes;
}

/* Cuts the line at commas; false when there is none. */
static bool read_line(FILE *file, const char *path) {
  if (fgets(line, sizeof line, file) == NULL)
    return false;
  if (strchr(line, '\n') == NULL && !feof(file))
    refuse("%s: a line is too long", path);
  line[strcspn(line, "\r\n")] = '\0';
  return line[0] != '\0';
}

/* Field of the log's header line that is called PREFIX and then the name. */
static size_t find_column(const char *prefix, const char *name, size_t length, const char *path) {
  const size_t before = strlen(prefix);
  const char *field = line;
  for (size_t column = 0;; ++column) {
    const size_t width = strcspn(field, ",");
    if (width == before + length && memcmp(field, prefix, before) == 0 &&
        memcmp(field + before, name, length) == 0) {
      return column;
    }
    if (field[width] == '\0')
      refuse("%s: column '%s%.*s' is missing", path, prefix, (int)length, name);
    field += width + 1;
  }
}

/* What a row holds: time, the features, and with external predictions z. m. sd. of every outcome.
 */
typedef struct layout {
  const char *names; /* features' then outcomes', '\n' after each */
  size_t features;
  size_t outcomes; /* 0: the image predicts them itself */
  size_t columns;
} layout;

static layout layout_of(const rim_image *image, const char *path) {
  const uint8_t *names, *config;
  size_t bytes;
  if (rim_image_section(image, RIM_SECTION_NAMES, &names, NULL) != RIM_OK ||
      rim_image_section(image, RIM_SECTION_CONFIG, &config, &bytes) != RIM_OK ||
      bytes != 4 * RIM_CONFIG_WORDS) {
    refuse("%s: has no names", path);
  }
  layout l = {.names = (const char *)names, .features = rimi_le_u32(config, RIM_CONFIG_FEATURES)};
  if (rimi_le_u32(config, RIM_CONFIG_EXTERNAL) != 0)
    l.outcomes = rimi_le_u32(config, RIM_CONFIG_OUTCOMES);
  if (l.features == 0 || l.features >= RECORDING_MAX_DOUBLES ||
      l.outcomes > (RECORDING_MAX_DOUBLES - 1 - l.features) / 3) {
    refuse("%s: too many columns", path);
  }
  l.columns = 1 + l.features + 3 * l.outcomes;
  return l;
}

/* Outcomes of such an image are called z.NAME. */
static void find_columns(const layout *l, const char *path, size_t *column) {
  const char *name = l->names;
  column[0] = 0;
  for (size_t i = 0; i < l->features + l->outcomes; ++i) {
    const size_t length = strcspn(name, "\n");
    if (i < l->features) {
      column[1 + i] = find_column("", name, length, path);
    } else {
      size_t *const of = column + 1 + i;
      const size_t dot = strcspn(name, ".\n") + 1;
      if (dot > length)
        refuse("%s: outcome '%.*s' is no z. column", path, (int)length, name);
      of[0] = find_column("", name, length, path);
      of[l->outcomes] = find_column("m.", name + dot, length - dot, path);
      of[2 * l->outcomes] = find_column("sd.", name + dot, length - dot, path);
    }
    name += length + 1;
  }
}

static double number(const char *path, size_t row, size_t index) {
  const char *field = line;
  for (size_t i = 0; i < index; ++i) {
    field = strchr(field, ',');
    if (field == NULL)
      refuse("%s:row %zu: field %zu is missing", path, row, index + 1);
    ++field;
  }
  char *end;
  const double value = strtod(field, &end);
  if (end == field || (*end != ',' && *end != '\0'))
    refuse("%s:row %zu: field %zu is not a number", path, row, index + 1);
  return value;
}

/* Appends the rows; returns their number. */
static size_t read_rows(const char *path, const layout *l, size_t at, size_t most) {
  size_t column[RECORDING_MAX_DOUBLES];
  FILE *file = fopen(path, "r");
  if (file == NULL)
    refuse("%s: %s", path, strerror(errno));
  if (!read_line(file, path) || strncmp(line, "t_s,", 4) != 0)
    refuse("%s: time is not first", path);
  find_columns(l, path, column);
  size_t rows = 0;
  for (; rows < most && read_line(file, path); ++rows) {
    if (at + 8 * l->columns > MAX_BYTES)
      refuse("%s: too many rows", path);
    for (size_t i = 0; i < l->columns; ++i, at += 8)
      put_f64(at, number(path, rows + 1, column[i]));
  }
  fclose(file);
  return rows;
}

int main(int argc, char **argv) {
  if (argc < 4 || argc > 5) {
    fputs("usage: record IMAGE.rim LOG.csv OUT.rec [ROWS]\n", stderr);
    return 2;
  }
  const size_t image_bytes = read_image(argv[1]);
  rim_image image;
  const rim_status status = rim_image_open(&image, out + RECORDING_HEADER_BYTES, image_bytes);
  if (status != RIM_OK)
    refuse("%s: %s", argv[1], rim_status_text(status));
  const layout l = layout_of(&image, argv[1]);
  const size_t at = RECORDING_HEADER_BYTES + ((image_bytes + 7) & ~(size_t)7);
  const size_t most = argc == 5 ? strtoul(argv[4], NULL, 10) : SIZE_MAX;
  const size_t rows = read_rows(argv[2], &l, at, most);
  const size_t total = at + 8 * l.columns * rows;
  memcpy(out, RECORDING_MAGIC, 8);
  put_u32(8, (uint32_t)image_bytes);
  put_u32(12, (uint32_t)rows);
  put_u32(16, (uint32_t)l.columns);
  put_u32(20, rimi_crc32(0, out + RECORDING_HEADER_BYTES, total - RECORDING_HEADER_BYTES));
  FILE *file = fopen(argv[3], "wb");
  if (file == NULL || fwrite(out, 1, total, file) != total || fclose(file) != 0)
    refuse("%s: %s", argv[3], strerror(errno));
  return 0;
}
