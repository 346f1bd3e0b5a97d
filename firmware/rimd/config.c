/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/config.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "rimd/say.h"

typedef enum kind { TEXT, YES_NO, NUMBER } kind;

typedef struct key {
  const char *name;
  kind kind;
  size_t at;     /* in config */
  uint32_t high; /* of a number from 0 */
} key;

#define TEXT_KEY(field)                                                                            \
  { #field, TEXT, offsetof(config, field), 0 }
#define YES_NO_KEY(field)                                                                          \
  { #field, YES_NO, offsetof(config, field), 0 }
#define NUMBER_KEY(field, high)                                                                    \
  { #field, NUMBER, offsetof(config, field), high }

#define HOUR_MS 3600000u
#define YEAR_S 31536000u

static const key keys[] = {
    TEXT_KEY(image),
    TEXT_KEY(state),
    TEXT_KEY(lcm),
    TEXT_KEY(lcm_interface),
    TEXT_KEY(can),
    TEXT_KEY(can_input),
    TEXT_KEY(can_table),
    TEXT_KEY(input),
    TEXT_KEY(axis_x),
    TEXT_KEY(axis_y),
    TEXT_KEY(axis_z),
    TEXT_KEY(footprint),
    TEXT_KEY(on_damage),
    TEXT_KEY(key),
    YES_NO_KEY(can_fd),
    YES_NO_KEY(latch),
    YES_NO_KEY(command_any),
    YES_NO_KEY(replay),
    YES_NO_KEY(key_observations),
    YES_NO_KEY(mlock),
    NUMBER_KEY(node, RIM_CAN_MAX_NODE),
    NUMBER_KEY(fifo_priority, 99),
    NUMBER_KEY(stale_ms, HOUR_MS),
    NUMBER_KEY(health_ms, HOUR_MS),
    NUMBER_KEY(deadline_us, 1000u * HOUR_MS),
    NUMBER_KEY(state_s, YEAR_S),
    NUMBER_KEY(max_jump_s, YEAR_S),
    NUMBER_KEY(max_skew_s, YEAR_S),
    NUMBER_KEY(resync_rows, 1000000),
    NUMBER_KEY(signal_age_ms, HOUR_MS),
    NUMBER_KEY(margin_mm, 1000000),
};
enum { KEYS = sizeof keys / sizeof keys[0] };

typedef struct span {
  const char *text;
  size_t bytes;
} span;

/* Where the reading stands. */
typedef struct reader {
  config *c;
  const char *name;
  unsigned line, errors;
  unsigned line_of[KEYS]; /* 0: not yet */
} reader;

#define REFUSE(r, ...) REFUSE_LINE(r, (r)->line, __VA_ARGS__)
#define REFUSE_LINE(r, where, format, ...)                                                         \
  do {                                                                                             \
    say("%s:%u: " format, (r)->name, (where), __VA_ARGS__);                                        \
    (r)->errors++;                                                                                 \
  } while (0)

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }

static span trimmed(span s) {
  while (s.bytes > 0 && is_blank(s.text[0])) {
    s.text++;
    s.bytes--;
  }
  while (s.bytes > 0 && is_blank(s.text[s.bytes - 1]))
    s.bytes--;
  return s;
}

static bool equals(span s, const char *word) {
  return s.bytes == strlen(word) && memcmp(s.text, word, s.bytes) == 0;
}

static void set_text(reader *r, const key *k, span value) {
  if (value.bytes >= CONFIG_TEXT_BYTES) {
    REFUSE(r, "%s: longer than %u characters", k->name, CONFIG_TEXT_BYTES - 1);
    return;
  }
  memcpy((char *)r->c + k->at, value.text, value.bytes);
}

static void set_yes_no(reader *r, const key *k, span value) {
  const bool yes = equals(value, "yes");
  if (!yes && !equals(value, "no")) {
    REFUSE(r, "%s: '%.*s' is neither yes nor no", k->name, (int)value.bytes, value.text);
    return;
  }
  memcpy((char *)r->c + k->at, &yes, sizeof yes);
}

static void set_number(reader *r, const key *k, span value) {
  uint64_t number = 0;
  bool good = value.bytes <= 10; /* and not empty: take_line */
  for (size_t i = 0; good && i < value.bytes; ++i) {
    good = value.text[i] >= '0' && value.text[i] <= '9';
    number = 10 * number + (uint64_t)(value.text[i] - '0');
  }
  if (!good || number > k->high) {
    REFUSE(r, "%s: '%.*s' is not a whole number from 0 to %u", k->name, (int)value.bytes,
           value.text, k->high);
    return;
  }
  const uint32_t small = (uint32_t)number;
  memcpy((char *)r->c + k->at, &small, sizeof small);
}

static void take_pair(reader *r, span name, span value) {
  size_t i = 0;
  while (i < KEYS && !equals(name, keys[i].name))
    i++;
  if (i == KEYS) {
    REFUSE(r, "unknown key '%.*s'", (int)(name.bytes < 64 ? name.bytes : 64), name.text);
  } else if (r->line_of[i] != 0) {
    REFUSE(r, "%s: stands on line %u already", keys[i].name, r->line_of[i]);
  } else if (value.bytes == 0) {
    REFUSE(r, "%s: has no value", keys[i].name);
  } else {
    r->line_of[i] = r->line;
    if (keys[i].kind == TEXT)
      set_text(r, &keys[i], value);
    else if (keys[i].kind == YES_NO)
      set_yes_no(r, &keys[i], value);
    else
      set_number(r, &keys[i], value);
  }
}

static void take_line(reader *r, span line) {
  for (size_t i = 0; i < line.bytes; ++i) {
    const unsigned char c = (unsigned char)line.text[i];
    if (c < 0x20 && !is_blank((char)c)) {
      REFUSE(r, "byte 0x%02x: this is no text file", c);
      return;
    }
  }
  const char *comment = memchr(line.text, '#', line.bytes);
  if (comment != NULL)
    line.bytes = (size_t)(comment - line.text);
  line = trimmed(line);
  if (line.bytes == 0)
    return;
  const char *equal = memchr(line.text, '=', line.bytes);
  if (equal == NULL) {
    REFUSE(r, "'%.*s' is not 'key = value'", (int)(line.bytes < 64 ? line.bytes : 64), line.text);
    return;
  }
  const size_t before = (size_t)(equal - line.text);
  take_pair(r, trimmed((span){line.text, before}),
            trimmed((span){equal + 1, line.bytes - before - 1}));
}

static unsigned line_of(const reader *r, const char *name) {
  size_t i = 0;
  while (i + 1 < KEYS && strcmp(keys[i].name, name) != 0)
    i++;
  return r->line_of[i];
}

static uint32_t or_default(uint32_t value, uint32_t instead) {
  return value != 0 ? value : instead;
}

static void check_buses(reader *r) {
  config *c = r->c;
  struct in_addr interface;
  if (c->lcm[0] != '\0') {
    const char *wrong = lcm_udp_parse(&c->address, c->lcm);
    if (wrong != NULL)
      REFUSE_LINE(r, line_of(r, "lcm"), "lcm: %s: %s", c->lcm, wrong);
  }
  c->address.interface = INADDR_LOOPBACK; /* from elsewhere only where somebody has said so */
  if (c->lcm_interface[0] != '\0') {
    if (inet_pton(AF_INET, c->lcm_interface, &interface) == 1)
      c->address.interface = ntohl(interface.s_addr);
    else
      REFUSE_LINE(r, line_of(r, "lcm_interface"), "lcm_interface: '%s' is not an IPv4 address",
                  c->lcm_interface);
  }
  c->on_damage_restart = strcmp(c->on_damage, "restart") == 0;
  c->on_damage_silent = strcmp(c->on_damage, "silent") == 0;
  if (c->on_damage[0] != '\0' && !c->on_damage_restart && !c->on_damage_silent &&
      strcmp(c->on_damage, "rebuild") != 0)
    REFUSE_LINE(r, line_of(r, "on_damage"), "on_damage: '%s' is not rebuild, restart or silent",
                c->on_damage);
  c->input_can = strcmp(c->input, "can") == 0;
  if (c->input[0] != '\0' && !c->input_can && strcmp(c->input, "lcm") != 0)
    REFUSE_LINE(r, line_of(r, "input"), "input: '%s' is neither lcm nor can", c->input);
  if (strlen(c->can) > 15)
    REFUSE_LINE(r, line_of(r, "can"), "can: '%s' is longer than 15 characters", c->can);
  if (strlen(c->can_input) > 15)
    REFUSE_LINE(r, line_of(r, "can_input"), "can_input: '%s' is longer than 15 characters",
                c->can_input);
}

/* "x y z, x y z": three numbers of m a corner. */
static bool parse_footprint(rim_lookahead_config *ahead, const char *text) {
  while (*text != '\0') {
    if (ahead->vertices == RIM_LOOKAHEAD_VERTICES)
      return false;
    for (size_t k = 0; k < 3; ++k) {
      char *end;
      const double x = strtod(text, &end);
      if (end == text || !(x >= -1e4 && x <= 1e4))
        return false;
      ahead->vertex[ahead->vertices][k] = x;
      text = end;
    }
    ahead->vertices++;
    text += strspn(text, " \t");
    if (*text != '\0' && *text++ != ',')
      return false;
  }
  return true;
}

static void check_lookahead(reader *r) {
  config *c = r->c;
  c->look_ahead = c->axis_x[0] != '\0' || c->axis_y[0] != '\0' || c->axis_z[0] != '\0';
  c->ahead.margin_m = 1e-3 * (double)c->margin_mm;
  if (!parse_footprint(&c->ahead, c->footprint))
    REFUSE_LINE(r, line_of(r, "footprint"),
                "footprint: '%s' is not up to %u corners \"x y z, x y z\" within 10000 m",
                c->footprint, RIM_LOOKAHEAD_VERTICES);
  if (!c->look_ahead && (c->footprint[0] != '\0' || c->margin_mm != 0))
    REFUSE_LINE(r, r->line, "%s needs axis_x, axis_y or axis_z", "footprint");
  if (c->look_ahead && c->lcm[0] == '\0')
    REFUSE_LINE(r, r->line, "%s needs lcm: plans come by RIM_PLAN", "axis_x, axis_y, axis_z");
}

/* Counters that were used are in the state: without it a restart would take them again. */
static void check_key(reader *r) {
  config *c = r->c;
  if (c->key[0] != '\0' && c->state[0] == '\0')
    REFUSE_LINE(r, line_of(r, "key"),
                "%s needs state: a restart must know which counters were used", "key");
  if (c->key_observations && c->key[0] == '\0')
    REFUSE_LINE(r, line_of(r, "key_observations"), "%s needs key", "key_observations");
  if (c->key_observations && c->input_can)
    REFUSE_LINE(r, line_of(r, "key_observations"),
                "%s needs input = lcm: CAN has no room for a tag", "key_observations");
}

/* What one line alone cannot tell. */
static void check_whole(reader *r) {
  config *c = r->c;
  check_buses(r);
  check_key(r);
  check_lookahead(r);
  if (c->image[0] == '\0')
    REFUSE_LINE(r, r->line, "%s is missing", "image = FILE.rim");
  if (c->lcm[0] == '\0' && c->can[0] == '\0')
    REFUSE_LINE(r, r->line, "%s: neither lcm nor can is given", "nobody would hear the alarms");
  if (!c->input_can && c->lcm[0] == '\0')
    REFUSE_LINE(r, r->line, "%s needs lcm = URL", "input = lcm");
  if (c->input_can && c->can[0] == '\0' && c->can_input[0] == '\0')
    REFUSE_LINE(r, r->line, "%s needs can or can_input", "input = can");
  if (c->can_input[0] == '\0')
    memcpy(c->can_input, c->can, sizeof c->can_input);
  c->health_ms = or_default(c->health_ms, 1000);
  c->state_s = or_default(c->state_s, 10);
  c->resync_rows = or_default(c->resync_rows, 100);
  c->signal_age_ms = or_default(c->signal_age_ms, 1000);
}

/* state: instead of the text's; NULL: none is given. It is there before the whole is checked, so
 * that what needs a state has it. */
static unsigned parse(config *c, const char *name, const char *text, size_t bytes,
                      const char *state) {
  reader r = {.c = c, .name = name};
  memset(c, 0, sizeof *c);
  c->node = 1; /* that of the shipped DBC */
  while (bytes > 0) {
    const char *end = memchr(text, '\n', bytes);
    const size_t length = end != NULL ? (size_t)(end - text) : bytes;
    r.line++;
    take_line(&r, (span){text, length});
    const size_t used = length + (end != NULL ? 1u : 0u);
    text += used;
    bytes -= used;
  }
  if (state != NULL) {
    memset(c->state, 0, sizeof c->state);
    memcpy(c->state, state, strnlen(state, sizeof c->state - 1));
  }
  check_whole(&r);
  if (r.errors > 0)
    say("%s: %u error%s", name, r.errors, r.errors == 1 ? "" : "s");
  return r.errors;
}

unsigned config_parse(config *c, const char *name, const char *text, size_t bytes) {
  return parse(c, name, text, bytes, NULL);
}

unsigned config_read(config *c, const char *path, const char *state) {
  static char text[CONFIG_FILE_BYTES + 1];
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0) {
    say("%s: %s", path, strerror(errno));
    return 1;
  }
  size_t bytes = 0;
  ssize_t got = 0;
  while (bytes < sizeof text && (got = read(fd, text + bytes, sizeof text - bytes)) > 0)
    bytes += (size_t)got;
  const int why = errno;
  close(fd);
  if (got < 0) {
    say("%s: %s", path, strerror(why));
    return 1;
  }
  if (bytes > CONFIG_FILE_BYTES) {
    say("%s: longer than %u bytes", path, CONFIG_FILE_BYTES);
    return 1;
  }
  return parse(c, path, text, bytes, state);
}
