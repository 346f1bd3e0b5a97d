/* SPDX-License-Identifier: MIT */
/* Everything that happens once: files read and checked, buses opened, memory taken. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/bytes.h"
#include "rimd/rimd.h"
#include "rimd/say.h"

#define LONG_AGO_S 1e15
#define JUMP_PERIODS 5.0 /* rows that may be missing unexplained */

enum { EXIT_DATA = 3, EXIT_INTERNAL = 4 };

/* Zeroed pages, aligned; NULL after telling why. */
static uint8_t *take_memory(size_t bytes, const char *what) {
  void *memory =
      mmap(NULL, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
  if (memory != MAP_FAILED)
    return memory;
  say("%zu bytes for %s: %s", bytes, what, strerror(errno));
  return NULL;
}

/* The whole file in memory of our own: one that is replaced later changes nothing. NULL after
 * telling why. */
static const uint8_t *read_file(const char *path, size_t *bytes) {
  struct stat about;
  uint8_t *memory = NULL;
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0 || fstat(fd, &about) != 0) {
    say("%s: %s", path, strerror(errno));
  } else if (!S_ISREG(about.st_mode) || about.st_size <= 0 || about.st_size > INT32_MAX) {
    say("%s: is empty, too large, or no file", path);
  } else {
    *bytes = (size_t)about.st_size;
    memory = take_memory(*bytes, path);
  }
  size_t have = 0;
  ssize_t got = 1;
  while (memory != NULL && have < *bytes && (got = read(fd, memory + have, *bytes - have)) > 0)
    have += (size_t)got;
  if (fd >= 0)
    close(fd);
  if (memory != NULL && have != *bytes) {
    say("%s: %s", path, got < 0 ? "cannot be read" : "became shorter while it was read");
    return NULL;
  }
  return memory;
}

/* A wrong time stamp can displace the true rows for as long as it may be ahead of them. */
static void set_clock(rimd *d) {
  const config *c = &d->config;
  const uint32_t period_us = rim_monitor_config(d->monitor, RIM_CONFIG_PERIOD_US);
  const double jump_s = period_us != 0 ? JUMP_PERIODS * 1e-6 * (double)period_us : 1.0;
  d->guard_config =
      (rim_clock_guard_config){.max_jump_s = c->max_jump_s != 0 ? (double)c->max_jump_s : jump_s,
                               .max_skew_s = (double)c->max_skew_s,
                               .resync_rows = c->resync_rows};
}

static int open_monitor(rimd *d) {
  const char *path = d->config.image;
  d->image = read_file(path, &d->image_bytes);
  if (d->image == NULL)
    return EXIT_DATA;
  rim_status status = rim_image_open(&d->view, d->image, d->image_bytes);
  if (status == RIM_OK)
    status = rim_monitor_size(d->image, d->image_bytes, &d->memory_bytes);
  if (status == RIM_OK) {
    d->memory = take_memory(d->memory_bytes, "the monitor");
    if (d->memory == NULL)
      return EXIT_DATA;
    status = rim_monitor_init(&d->monitor, d->memory, d->memory_bytes, d->image, d->image_bytes);
  }
  if (status != RIM_OK) {
    say("%s: %s", path, rim_status_text(status));
    return EXIT_DATA;
  }
  rimd_image_sums(d->image, d->image_sums);
  set_clock(d);
  d->features = rim_monitor_config(d->monitor, RIM_CONFIG_FEATURES);
  d->outcomes = rim_monitor_config(d->monitor, RIM_CONFIG_OUTCOMES);
  d->external = rim_monitor_config(d->monitor, RIM_CONFIG_EXTERNAL) != 0;
  d->values = d->features + (d->external ? 3 * d->outcomes : 0);
  const uint32_t stale_ms = d->config.stale_ms != 0
                                ? d->config.stale_ms
                                : rim_monitor_config(d->monitor, RIM_CONFIG_STALE_MS);
  d->policy = (rim_alarm_policy){.stale_s = 1e-3 * (double)stale_ms,
                                 .latch = d->config.latch,
                                 .replay = d->config.replay,
                                 .command_any = d->config.command_any};
  if (d->config.input_can || d->values <= RIM_OBSERVATION_MAX_VALUES)
    return 0;
  say("%s: a row has %u values, and an observation over LCM carries %u; input = can carries up to "
      "%u",
      path, d->values, (unsigned)RIM_OBSERVATION_MAX_VALUES, RIM_CAN_TABLE_MAX_VALUES);
  return EXIT_DATA;
}

/* Index of a feature by its name in the image; RIM_LOOKAHEAD_NO_AXIS where there is none. */
static uint16_t feature_of(const rimd *d, const char *name) {
  const char *text;
  size_t length;
  for (uint32_t f = 0; f < d->features; ++f)
    if (rim_image_name(&d->view, f, &text, &length) == RIM_OK && length == strlen(name) &&
        memcmp(text, name, length) == 0)
      return (uint16_t)f;
  return RIM_LOOKAHEAD_NO_AXIS;
}

static int open_lookahead(rimd *d) {
  const char *const name[3] = {d->config.axis_x, d->config.axis_y, d->config.axis_z};
  for (size_t k = 0; k < 3; ++k) {
    uint16_t *axis = &d->config.ahead.axis[k];
    *axis = name[k][0] != '\0' ? feature_of(d, name[k]) : RIM_LOOKAHEAD_NO_AXIS;
    if (name[k][0] != '\0' && *axis == RIM_LOOKAHEAD_NO_AXIS) {
      say("axis_%c: %s has no feature '%s'", (char)('x' + k), d->config.image, name[k]);
      return EXIT_DATA;
    }
  }
  return 0;
}

/* The table of CAN signals, from a file of its own (an image with that section) or the image. */
static int open_table(rimd *d) {
  const bool own = d->config.can_table[0] != '\0';
  const char *path = own ? d->config.can_table : d->config.image;
  rim_image view = d->view;
  const uint8_t *section;
  size_t bytes = 0;
  if (own) {
    size_t image_bytes;
    const uint8_t *image = read_file(path, &image_bytes);
    if (image == NULL)
      return EXIT_DATA;
    const rim_status status = rim_image_open(&view, image, image_bytes);
    if (status != RIM_OK) {
      say("%s: %s", path, rim_status_text(status));
      return EXIT_DATA;
    }
  }
  if (rim_image_section(&view, RIM_SECTION_CAN_TABLE, &section, &bytes) != RIM_OK) {
    say("%s: has no table of CAN signals (rim can-table makes one)", path);
    return EXIT_DATA;
  }
  const rim_status status = rim_can_table_open(&d->table, section, bytes);
  if (status != RIM_OK) {
    say("%s: table of CAN signals: %s", path, rim_status_text(status));
    return EXIT_DATA;
  }
  if (d->table.values == d->values)
    return 0;
  say("%s: its CAN table makes rows of %u values, the image needs %u", path, d->table.values,
      d->values);
  return EXIT_DATA;
}

static int open_lcm(rimd *d) {
  const char *what = "";
  if (d->config.lcm[0] == '\0')
    return 0;
  const int status = lcm_udp_open(&d->lcm, &d->config.address, true, &what);
  if (status == 0)
    return 0;
  say("%s: %s: %s", d->config.lcm, what, strerror(-status));
  return EXIT_DATA;
}

static int open_one_can(socketcan *can, const char *name, const socketcan_filter *filter,
                        size_t filters, bool fd) {
  const int status = socketcan_open(can, name, filter, filters, fd);
  if (status != 0) {
    say("%s: %s", name, status == -EAFNOSUPPORT ? "this kernel has no CAN" : strerror(-status));
    return EXIT_DATA;
  }
  if (can->fd < 0)
    say("%s: no such interface yet; rimd waits for it", name);
  else if (can->is_down)
    say("%s: is down; rimd waits for it", name);
  return 0;
}

static int open_can(rimd *d) {
  const config *c = &d->config;
  int status = 0;
  if (c->can[0] != '\0') {
    const socketcan_filter command = {RIM_CAN_COMMAND_ID + c->node, 0x7ffu};
    status = open_one_can(&d->can, c->can, &command, 1, c->can_fd);
    if (status == 0 && c->can_fd && d->can.fd >= 0 && !d->can.fd_capable)
      say("%s: takes no FD frames; detail goes out in segments", c->can);
  }
  if (status != 0 || !c->input_can)
    return status;
  socketcan_filter filter[SOCKETCAN_MAX_FILTERS];
  for (uint16_t i = 0; i < d->table.frames; ++i) {
    const uint32_t id = rim_can_table_id(&d->table, i);
    const bool extended = (id & RIM_CAN_EXTENDED) != 0;
    filter[i] = (socketcan_filter){id, extended ? RIM_CAN_EXTENDED | 0x1fffffffu : 0x7ffu};
  }
  return open_one_can(&d->can_input, c->can_input, filter, d->table.frames, true);
}

state_parts rimd_parts(rimd *d) {
  const state_parts parts = {.daemon = &d->kept,
                             .monitor = d->memory,
                             .daemon_bytes = sizeof d->kept,
                             .monitor_bytes = (uint32_t)d->memory_bytes,
                             .model_id = d->view.model_id,
                             .image_crc = rimi_le_u32(d->image, 7)};
  return parts;
}

/* Goes on from one generation of the state. NULL, or why not; what is no good was counted. */
static const char *resume_from(rimd *d, const char *name, uint8_t *copy, uint32_t *refused) {
  const state_parts parts = rimd_parts(d);
  const char *why = state_load(name, &parts, copy);
  if (why == NULL) {
    const rim_status status =
        rim_monitor_attach(&d->monitor, d->memory, d->memory_bytes, d->image, d->image_bytes);
    if (status == RIM_OK)
      return NULL;
    /* A good check sum over what is no monitor of this image. */
    memset(&d->kept, 0, sizeof d->kept);
    (void)rim_monitor_init(&d->monitor, d->memory, d->memory_bytes, d->image, d->image_bytes);
    why = rim_status_text(status);
  }
  if (strcmp(why, STATE_NONE) != 0)
    ++*refused;
  return why;
}

/* Goes on from the newest generation of the state that is good. */
static int resume(rimd *d) {
  const char *path = d->config.state;
  char name[STATE_GENERATIONS][CONFIG_TEXT_BYTES + 8];
  uint32_t refused = 0;
  if (path[0] == '\0')
    return 0;
  const state_parts parts = rimd_parts(d);
  const size_t bytes = state_bytes(&parts);
  uint8_t *copy = take_memory(bytes, "the state file");
  if (copy == NULL)
    return EXIT_DATA;
  const char *why = STATE_NONE;
  for (int i = 0; i < STATE_GENERATIONS && why != NULL; ++i) {
    (void)state_name(name[i], sizeof name[i], path, i);
    why = resume_from(d, name[i], copy, &refused);
    if (why == NULL) {
      d->kept.counters.restarts++;
      d->kept.guard.last_here_s = -LONG_AGO_S; /* nobody knows how long it was down */
      say("%s: going on at t = %.3f s after %u observations", name[i], d->kept.row_s,
          d->kept.counters.rows);
    } else if (i == 0 || strcmp(why, STATE_NONE) != 0) {
      say("%s: %s", name[i], why);
    }
  }
  if (why != NULL)
    say("%s: beginning anew", path);
  d->kept.counters.state_refused += refused;
  const int failed = state_start(&d->state, path, copy, bytes);
  if (failed == 0)
    return 0;
  say("%s: %s", path, strerror(failed));
  return EXIT_DATA;
}

/* A folder that cannot be written is found now, not at the first alarm. */
static int try_state(rimd *d) {
  if (d->config.state[0] == '\0')
    return 0;
  const int fd = open(d->state.temporary, O_WRONLY | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) {
    say("%s: %s", d->state.temporary, strerror(errno));
    return EXIT_DATA;
  }
  close(fd);
  unlink(d->state.temporary);
  return 0;
}

static int open_key(rimd *d) {
  const config *c = &d->config;
  if (c->key[0] == '\0')
    return 0;
  const char *wrong = seal_read_key(&d->seal, c->key);
  if (wrong != NULL) {
    say("%s: %s", c->key, wrong);
    return EXIT_DATA;
  }
  if (c->can[0] != '\0' && !c->can_fd)
    say("%s: with a key no command by classic CAN is obeyed: 8 bytes have no room for a tag "
        "(can_fd = yes)",
        c->can);
  return 0;
}

int rimd_check(rimd *d) {
  int status = open_monitor(d);
  if (status == 0)
    status = open_key(d);
  if (status == 0)
    status = open_lookahead(d);
  return status == 0 && d->config.input_can ? open_table(d) : status;
}

int rimd_start(rimd *d) {
  const config *c = &d->config;
  d->lcm.in = d->lcm.out = d->can.fd = d->can_input.fd = -1;
  int status = rimd_check(d);
  if (status == 0)
    status = resume(d);
  if (status == 0)
    status = try_state(d);
  if (status == 0)
    status = open_lcm(d);
  if (status == 0)
    status = open_can(d);
  if (status != 0) {
    (void)state_finish(&d->state, NULL); /* its thread waits */
    return status;
  }
  outbox_init(&d->outbox, c->lcm[0] != '\0' ? &d->lcm : NULL, c->can[0] != '\0' ? &d->can : NULL,
              c->node);
  const uint64_t now_ns = rimd_now_ns();
  watchdog_open(&d->watchdog);
  d->valid_ns = d->next_health_ns = now_ns;
  d->next_state_ns = now_ns + UINT64_C(1000000000) * c->state_s;
  (void)rim_monitor_set_policy(d->monitor, &d->policy);
  rim_monitor_repeat(d->monitor); /* after a restart: standing alarms are sent again */
  rimd_send_records(d);
  return 0;
}

int rimd_finish(rimd *d) {
  int status = 0;
  rimd_collect_counts(d);
  if (d->config.state[0] != '\0') {
    d->kept.dropped += d->outbox.dropped;
    const state_parts parts = rimd_parts(d);
    const int why = state_finish(&d->state, d->is_damaged ? NULL : &parts);
    if (why != 0) {
      say("%s: %s", d->config.state, strerror(why));
      status = EXIT_DATA;
    }
  }
  if (d->ending)
    status = EXIT_INTERNAL;
  rimd_release_records(d);
  watchdog_close(&d->watchdog);
  lcm_udp_close(&d->lcm);
  socketcan_close(&d->can);
  socketcan_close(&d->can_input);
  return status;
}

static void tell_counters(const rim_counters *counters) {
  char text[350];
  size_t at = 0;
  text[0] = '\0';
  for (uint32_t i = 1; i < RIM_COUNTERS_FIELDS; ++i) {
    char one[40];
    const uint32_t value = rim_counters_value(counters, i);
    if (value == 0)
      continue;
    const int length = snprintf(one, sizeof one, " %s %u", rim_counters_name(i), value);
    if (at + (size_t)length >= sizeof text) {
      say("counted:%s", text);
      at = 0;
    }
    memcpy(text + at, one, (size_t)length + 1);
    at += (size_t)length;
  }
  if (at > 0)
    say("counted:%s", text);
}

void rimd_tell_counts(const rimd_kept *kept) {
  const seal_counts *c = &kept->sealed;
  tell_counters(&kept->counters);
  if (c->unsealed > 0 || c->forged > 0 || c->replayed > 0)
    say("with the key: unsealed %u forged %u replayed %u", c->unsealed, c->forged, c->replayed);
}
