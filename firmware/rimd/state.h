/* SPDX-License-Identifier: MIT */
/* state.h - rimd's memory across a restart: a file, replaced atomically, checked before use, and
 * the one before it.
 *
 * The step only copies; a thread of ordinary priority computes the check sum, writes FILE.tmp,
 * flushes it to the medium, renames FILE to FILE.old and FILE.tmp to FILE. A file of another
 * version, model or computer is refused with a reason; the daemon then goes on from FILE.old, and
 * starts without a state where that is refused too. */
#ifndef STATE_H
#define STATE_H
#define STATE_GENERATIONS 2

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Two stretches of memory that make up the state, and what they belong to. */
typedef struct state_parts {
  void *daemon, *monitor;
  uint32_t daemon_bytes, monitor_bytes;
  uint32_t model_id, image_crc;
} state_parts;

typedef struct state_file {
  const char *path;
  char temporary[264], older[264];
  uint8_t *copy; /* the writer's while busy */
  size_t bytes;
  sem_t wake;
  pthread_t thread;
  bool running;
  atomic_bool busy, stop;
  uint32_t taken;       /* copies given to the writer */
  atomic_uint finished; /* of them, written or failed */
  atomic_uint failures;
  atomic_int why; /* errno of the newest failure */
} state_file;

/* Bytes of the file, and of the copy that state_start() is given. */
size_t state_bytes(const state_parts *parts);

#define STATE_NONE "none yet"

/* The name of a generation: 0 is FILE, 1 the one before it. Returns false where it is too long. */
bool state_name(char *name, size_t bytes, const char *path, int generation);

/* Reads the state back into the parts. Returns NULL, or why not (then the parts are unchanged):
 * STATE_NONE when there is no file. scratch: state_bytes() bytes. O(bytes). */
const char *state_load(const char *path, const state_parts *parts, uint8_t *scratch);

/* Starts the writer. copy: state_bytes() bytes that are its own. Returns 0 or an errno. */
int state_start(state_file *state, const char *path, uint8_t *copy, size_t bytes);

/* Takes a copy for the writer and returns at once; false when it is still busy with the last one.
 * The copy is dealt with when `finished` reaches what `taken` is now. */
bool state_save(state_file *state, const state_parts *parts);

/* Ends the writer, after it has written what it had, then writes the present state. 0 or an errno.
 * parts NULL: only ends the writer; the files stay as they are. */
int state_finish(state_file *state, const state_parts *parts);

#endif
