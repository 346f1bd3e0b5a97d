/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/state.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/crc.h"

#define MAGIC "RIMSTATE"
#define WRITER_STACK 65536
#ifndef RIM_VERSION
#define RIM_VERSION "0"
#endif

/* In the computer's own byte order and layout: the file never leaves it. */
typedef struct head {
  char magic[8];
  char version[16];
  uint32_t layout; /* sizes of a pointer and of long double: another compiler's layout is refused */
  uint32_t model_id, image_crc;
  uint32_t daemon_bytes, monitor_bytes;
  uint32_t crc; /* of everything, this field taken as 0 */
} head;

static uint32_t layout_tag(void) {
  return (uint32_t)(sizeof(void *) << 16 | sizeof(long double) << 8 | sizeof(head));
}

static head head_of(const state_parts *parts) {
  head h;
  memset(&h, 0, sizeof h);
  memcpy(h.magic, MAGIC, sizeof h.magic);
  snprintf(h.version, sizeof h.version, "%s", RIM_VERSION);
  h.layout = layout_tag();
  h.model_id = parts->model_id;
  h.image_crc = parts->image_crc;
  h.daemon_bytes = parts->daemon_bytes;
  h.monitor_bytes = parts->monitor_bytes;
  return h;
}

size_t state_bytes(const state_parts *parts) {
  return sizeof(head) + parts->daemon_bytes + parts->monitor_bytes;
}

static void pack(uint8_t *copy, const state_parts *parts) {
  const head h = head_of(parts);
  memcpy(copy, &h, sizeof h);
  memcpy(copy + sizeof h, parts->daemon, parts->daemon_bytes);
  memcpy(copy + sizeof h + parts->daemon_bytes, parts->monitor, parts->monitor_bytes);
}

static void seal(uint8_t *copy, size_t bytes) {
  const uint32_t crc = rimi_crc32(0, copy, bytes);
  memcpy(copy + offsetof(head, crc), &crc, sizeof crc);
}

/* Bytes read; a negative errno. */
static ssize_t read_whole(const char *path, uint8_t *to, size_t bytes) {
  const int fd = open(path, O_RDONLY | O_CLOEXEC);
  if (fd < 0)
    return -errno;
  size_t have = 0;
  ssize_t got = 0;
  while (have < bytes && (got = read(fd, to + have, bytes - have)) > 0)
    have += (size_t)got;
  const int why = errno;
  uint8_t more;
  const bool longer = got > 0 && read(fd, &more, 1) > 0;
  close(fd);
  if (got < 0)
    return -why;
  return longer ? (ssize_t)bytes + 1 : (ssize_t)have;
}

bool state_name(char *name, size_t bytes, const char *path, int generation) {
  const int length = snprintf(name, bytes, "%s%s", path, generation == 0 ? "" : ".old");
  return (size_t)length < bytes; /* one below 0 is more than any size */
}

const char *state_load(const char *path, const state_parts *parts, uint8_t *scratch) {
  const size_t bytes = state_bytes(parts);
  const ssize_t got = read_whole(path, scratch, bytes);
  if (got == -ENOENT)
    return STATE_NONE;
  if (got < 0)
    return strerror((int)-got);
  if ((size_t)got < sizeof(head))
    return "too short";
  head found, wanted = head_of(parts);
  memcpy(&found, scratch, sizeof found);
  if (memcmp(found.magic, wanted.magic, sizeof found.magic) != 0)
    return "not a state file";
  if (memcmp(found.version, wanted.version, sizeof found.version) != 0 ||
      found.layout != wanted.layout)
    return "written by another version";
  if (found.model_id != wanted.model_id || found.image_crc != wanted.image_crc ||
      found.monitor_bytes != wanted.monitor_bytes)
    return "of another flight image";
  if (found.daemon_bytes != wanted.daemon_bytes)
    return "written by another version";
  if ((size_t)got != bytes)
    return "cut, or longer than it should be";
  memset(scratch + offsetof(head, crc), 0, sizeof found.crc);
  if (rimi_crc32(0, scratch, bytes) != found.crc)
    return "damaged: the check sum disagrees";
  memcpy(parts->daemon, scratch + sizeof(head), parts->daemon_bytes);
  memcpy(parts->monitor, scratch + sizeof(head) + parts->daemon_bytes, parts->monitor_bytes);
  return NULL;
}

/* The folder's entry must reach the medium too. */
static int flush_folder(const char *path) {
  char name[264];
  snprintf(name, sizeof name, "%s", path);
  const int fd = open(dirname(name), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0)
    return errno;
  const int why = fsync(fd) == 0 ? 0 : errno;
  close(fd);
  return why;
}

static int write_file(const state_file *state) {
  const int fd = open(state->temporary, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0)
    return errno;
  size_t done = 0;
  int why = 0;
  while (done < state->bytes && why == 0) {
    const ssize_t wrote = write(fd, state->copy + done, state->bytes - done);
    if (wrote > 0)
      done += (size_t)wrote;
    else if (wrote == 0 || errno != EINTR)
      why = wrote == 0 ? ENOSPC : errno;
  }
  if (why == 0 && fsync(fd) != 0)
    why = errno;
  if (close(fd) != 0 && why == 0)
    why = errno;
  /* Between the two there is no FILE, and FILE.old is whole. */
  if (why == 0 && rename(state->path, state->older) != 0 && errno != ENOENT)
    why = errno;
  if (why == 0 && rename(state->temporary, state->path) != 0)
    why = errno;
  if (why != 0)
    unlink(state->temporary);
  return why != 0 ? why : flush_folder(state->path);
}

static int write_copy(state_file *state) {
  seal(state->copy, state->bytes);
  const int why = write_file(state);
  if (why != 0) {
    atomic_store(&state->why, why);
    atomic_fetch_add(&state->failures, 1);
  }
  return why;
}

static void *writer(void *argument) {
  state_file *state = argument;
  for (;;) {
    (void)sem_wait(&state->wake); /* woken without a reason, it finds nothing to do */
    if (atomic_load(&state->busy)) {
      (void)write_copy(state);
      atomic_store(&state->busy, false);
      atomic_fetch_add(&state->finished, 1);
    }
    if (atomic_load(&state->stop))
      return NULL;
  }
}

int state_start(state_file *state, const char *path, uint8_t *copy, size_t bytes) {
  memset(state, 0, sizeof *state);
  state->path = path;
  state->copy = copy;
  state->bytes = bytes;
  const int length = snprintf(state->temporary, sizeof state->temporary, "%s.tmp", path);
  if ((size_t)length >= sizeof state->temporary)
    return ENAMETOOLONG;
  (void)state_name(state->older, sizeof state->older, path, 1); /* as long */
  if (sem_init(&state->wake, 0, 0) != 0)
    return errno;
  pthread_attr_t attributes;
  const struct sched_param ordinary = {.sched_priority = 0};
  sigset_t all, before;
  int why = pthread_attr_init(&attributes);
  if (why != 0)
    return why;
  sigfillset(&all); /* signals are the main thread's */
  pthread_sigmask(SIG_SETMASK, &all, &before);
  why = pthread_attr_setstacksize(&attributes, WRITER_STACK);
  if (why == 0)
    why = pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  if (why == 0)
    why = pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
  if (why == 0)
    why = pthread_attr_setschedparam(&attributes, &ordinary);
  if (why == 0)
    why = pthread_create(&state->thread, &attributes, writer, state);
  pthread_sigmask(SIG_SETMASK, &before, NULL);
  pthread_attr_destroy(&attributes);
  state->running = why == 0;
  return why;
}

bool state_save(state_file *state, const state_parts *parts) {
  if (atomic_load(&state->busy))
    return false;
  pack(state->copy, parts);
  atomic_store(&state->busy, true);
  state->taken++;
  sem_post(&state->wake);
  return true;
}

int state_finish(state_file *state, const state_parts *parts) {
  if (state->running) {
    atomic_store(&state->stop, true);
    sem_post(&state->wake);
    pthread_join(state->thread, NULL);
    state->running = false;
  }
  if (parts == NULL)
    return 0;
  pack(state->copy, parts);
  return write_copy(state);
}
