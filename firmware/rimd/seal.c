/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/seal.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "wire/sealed.h"

#ifdef SEAL_SODIUM
#include <sodium.h>
#endif

#define DIGITS (2u * SEAL_KEY_BYTES)

#ifdef SEAL_SODIUM
_Static_assert(crypto_generichash_KEYBYTES == SEAL_KEY_BYTES, "a key of BLAKE2b");
_Static_assert(crypto_generichash_BYTES_MIN <= RIMI_TAG_BYTES, "a tag of BLAKE2b");

static bool is_ready(void) { return sodium_init() >= 0; }

/* In time that does not depend on how much of a forged tag is right. */
static bool tag_is_good(const seal *s, const uint8_t *bytes, size_t length, const uint8_t *tag) {
  uint8_t own[RIMI_TAG_BYTES];
  return crypto_generichash(own, sizeof own, bytes, length, s->key, sizeof s->key) == 0 &&
         sodium_memcmp(own, tag, sizeof own) == 0;
}
#else
static bool is_ready(void) { return false; }

static bool tag_is_good(const seal *s, const uint8_t *bytes, size_t length, const uint8_t *tag) {
  (void)s, (void)bytes, (void)length, (void)tag;
  return false;
}
#endif

static int digit(char c) {
  static const char digits[] = "0123456789abcdef";
  const char *at = c != '\0' ? strchr(digits, c >= 'A' && c <= 'F' ? c - 'A' + 'a' : c) : NULL;
  return at != NULL ? (int)(at - digits) : -1;
}

static const char *parse_key(seal *s, const char *text, size_t bytes) {
  while (bytes > 0 && (text[bytes - 1] == '\n' || text[bytes - 1] == '\r'))
    bytes--;
  for (size_t i = 0; i < bytes; ++i)
    if (digit(text[i]) < 0)
      return "a key has hexadecimal digits alone";
  if (bytes != DIGITS)
    return "a key has 64 hexadecimal digits";
  for (size_t i = 0; i < SEAL_KEY_BYTES; ++i)
    s->key[i] = (uint8_t)(16 * digit(text[2 * i]) + digit(text[2 * i + 1]));
  s->has_key = true;
  return NULL;
}

const char *seal_read_key(seal *s, const char *path) {
  char text[DIGITS + 8];
  struct stat about;
  if (!is_ready())
    return "this rimd was built without libsodium";
  const int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0)
    return strerror(errno);
  const char *wrong = NULL;
  ssize_t got = 0;
  if (fstat(fd, &about) != 0 || !S_ISREG(about.st_mode))
    wrong = "is no file";
  else if ((about.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    wrong = "others may read or write it (chmod 600)";
  else if (about.st_uid != geteuid() && about.st_uid != 0)
    wrong = "belongs to another user";
  else if ((got = read(fd, text, sizeof text)) < 0)
    wrong = strerror(errno);
  close(fd);
  return wrong != NULL ? wrong : parse_key(s, text, (size_t)got);
}

bool seal_window_take(seal_window *window, uint64_t counter) {
  if (counter > window->highest) {
    const uint64_t ahead = counter - window->highest;
    window->seen = (ahead > SEAL_LATE ? 0 : window->seen << ahead) | 1u;
    window->highest = counter;
    return true;
  }
  const uint64_t behind = window->highest - counter;
  if (behind > SEAL_LATE || (window->seen >> behind & 1u) != 0)
    return false;
  window->seen |= UINT64_C(1) << behind;
  return true;
}

/* The tag first: what is forged moves no window. */
static bool take(const seal *s, seal_window *window, seal_counts *counts, const uint8_t *bytes,
                 size_t length, const uint8_t *tag, uint64_t counter) {
  if (!tag_is_good(s, bytes, length, tag)) {
    count(&counts->forged);
    return false;
  }
  if (seal_window_take(window, counter))
    return true;
  count(&counts->replayed);
  return false;
}

bool seal_open_lcm(const seal *s, seal_window *window, seal_counts *counts, const uint8_t *in,
                   size_t bytes, uint8_t *out, size_t out_bytes) {
  const rimi_sealed_type type =
      out_bytes == RIM_LCM_COMMAND_SIZE ? rimi_sealed_command() : rimi_sealed_observation();
  const uint8_t *tag;
  uint64_t counter;
  if (rimi_lcm_unseal(out, in, bytes, type, &counter, &tag) != RIM_OK) {
    count(&counts->unsealed);
    return false;
  }
  return take(s, window, counts, in, (size_t)(tag - in), tag, counter);
}

bool seal_open_can(const seal *s, seal_window *window, seal_counts *counts,
                   const rim_can_frame *frame, uint32_t node, rim_command *command) {
  uint64_t counter;
  if (rimi_can_unseal(command, node, frame, &counter) != RIM_OK) {
    count(&counts->unsealed);
    return false;
  }
  return take(s, window, counts, frame->data, RIMI_SEALED_FRAME_BODY,
              frame->data + RIMI_SEALED_FRAME_BODY, counter);
}
