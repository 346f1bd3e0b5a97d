/* SPDX-License-Identifier: MIT */
/* What follows when the monitor finds its memory or image damaged (configuration: on_damage). */
#define _GNU_SOURCE
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "rimd/rimd.h"
#include "rimd/say.h"

/* The image's bytes once more, into the same place. A file that has changed is refused by its check
 * sum or by the monitor. */
static void read_image_again(rimd *d) {
  const int fd = open(d->config.image, O_RDONLY | O_CLOEXEC);
  uint8_t *to = (uint8_t *)(uintptr_t)d->image; /* taken by rimd_start, and writable */
  size_t have = 0;
  ssize_t got = 1;
  while (fd >= 0 && have < d->image_bytes && (got = read(fd, to + have, d->image_bytes - have)) > 0)
    have += (size_t)got;
  if (fd >= 0)
    close(fd);
}

static bool repair(rimd *d) {
  return rim_monitor_repair(&d->monitor, d->memory, d->memory_bytes, d->image, d->image_bytes) ==
         RIM_OK;
}

static void rebuild(rimd *d) {
  bool whole = repair(d);
  if (!whole) {
    read_image_again(d);
    whole = repair(d);
  }
  (void)rim_monitor_set_policy(d->monitor, &d->policy);
  say(whole ? "the monitor was built anew from the image; what was observed is lost"
            : "the image is damaged too, and its file is no help: nothing is known from now on");
}

void rimd_damaged(rimd *d) {
  say("memory is damaged (control 1, image 2, observations 4: %u)",
      (unsigned)rim_monitor_get_health(d->monitor).damage);
  d->is_damaged = true;
  d->was_damaged = true;
  if (d->config.on_damage_restart) {
    say("ending, so that a restart goes on from the state file");
    d->ending = true;
  } else if (!d->config.on_damage_silent) {
    rebuild(d);
    d->is_damaged = rim_monitor_get_health(d->monitor).damage != 0;
  }
}
