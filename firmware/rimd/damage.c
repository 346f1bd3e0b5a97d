/* SPDX-License-Identifier: MIT */
/* What follows when the monitor finds its memory or image damaged (configuration: on_damage). */
#define _GNU_SOURCE
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "base/bytes.h"
#include "rimd/rimd.h"
#include "rimd/say.h"

void rimd_image_sums(const uint8_t *head, uint32_t sums[3]) {
  const size_t word[3] = {8, 7, 5}; /* of 4 bytes, see rim/image.h */
  for (size_t i = 0; i < 3; ++i)
    sums[i] = rimi_le_u32(head, word[i]);
}

/* Whether all of them came. */
static bool read_bytes(int fd, uint8_t *to, size_t bytes) {
  size_t have = 0;
  ssize_t got = 1;
  while (have < bytes && (got = read(fd, to + have, bytes - have)) > 0)
    have += (size_t)got;
  return have == bytes;
}

/* The image's bytes once more, into the same place. Names, values of a row, the table of CAN
 * signals and the clock are those of the image at the start, so another one, however good, would be
 * no repair: check sums and the model's id have to be the same, to which all the rest is held when
 * the monitor is built. */
static bool read_image_again(rimd *d) {
  uint8_t head[RIM_IMAGE_HEADER_BYTES];
  uint32_t sums[3] = {0};
  uint8_t *to = (uint8_t *)(uintptr_t)d->image; /* taken by rimd_start, and writable */
  const int fd = open(d->config.image, O_RDONLY | O_CLOEXEC);
  bool whole = fd >= 0 && read_bytes(fd, head, sizeof head);
  if (whole)
    rimd_image_sums(head, sums);
  if (whole && memcmp(sums, d->image_sums, sizeof sums) != 0) {
    say("%s: is another image than at the start, and is not taken", d->config.image);
    whole = false;
  }
  if (whole) {
    memcpy(to, head, sizeof head);
    whole = read_bytes(fd, to + sizeof head, d->image_bytes - sizeof head);
  }
  if (fd >= 0)
    close(fd);
  return whole;
}

static bool repair(rimd *d) {
  return rim_monitor_repair(&d->monitor, d->memory, d->memory_bytes, d->image, d->image_bytes) ==
         RIM_OK;
}

static void rebuild(rimd *d) {
  bool whole = repair(d);
  if (!whole)
    whole = read_image_again(d) && repair(d);
  (void)rim_monitor_set_policy(d->monitor, &d->policy);
  if (whole)
    rimd_counts_began(d);
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
