/* SPDX-License-Identifier: MIT */
/* Keys, tags and counters of sealed messages. The tags are those of Python's hashlib.blake2b. */
#define _GNU_SOURCE
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "rimd/seal.h"
#include "wire/sealed.h"

static const char digits[] = "000102030405060708090a0b0c0d0e0f101112131415161718191A1b1c1d1e1f\n";
static char path[64];

static void write_key(const char *text, mode_t mode) {
  snprintf(path, sizeof path, "/tmp/rim_key_%d", (int)getpid());
  unlink(path);
  const int fd = open(path, O_WRONLY | O_CREAT | O_EXCL, 0600);
  assert_true(fd >= 0);
  assert_int_equal(write(fd, text, strlen(text)), (ssize_t)strlen(text));
  assert_int_equal(fchmod(fd, mode), 0);
  close(fd);
}

/* The reason says what is asked for, or the key is good. */
static void reads(const char *text, mode_t mode, const char *reason) {
  seal s = {0};
  write_key(text, mode);
  const char *wrong = seal_read_key(&s, path);
  unlink(path);
#ifdef SEAL_SODIUM
  if (reason == NULL) {
    assert_null(wrong);
    for (uint8_t i = 0; i < SEAL_KEY_BYTES; ++i)
      assert_int_equal(s.key[i], i);
  } else {
    assert_non_null(wrong);
    assert_non_null(strstr(wrong, reason));
  }
  assert_int_equal(s.has_key, reason == NULL);
#else
  (void)reason;
  assert_non_null(strstr(wrong, "libsodium"));
  assert_false(s.has_key);
#endif
}

static void keys_are_read_or_refused(void **state) {
  (void)state;
  char text[100];
  reads(digits, 0600, NULL);
  reads(digits, 0400, NULL);
  memcpy(text, digits, 64);
  text[64] = '\0';
  reads(text, 0600, NULL); /* no line end */
  strcpy(text + 64, "\r\n");
  reads(text, 0600, NULL);
  reads(digits, 0640, "chmod 600");
  reads(digits, 0602, "chmod 600");
  reads(digits + 1, 0600, "64 hexadecimal");
  strcpy(text + 64, "0\n");
  reads(text, 0600, "64 hexadecimal");
  strcpy(text + 64, "00000000000000000\n");
  reads(text, 0600, "64 hexadecimal");
  strcpy(text + 64, "\n");
  text[10] = 'g';
  reads(text, 0600, "digits alone");
  text[10] = ' ';
  reads(text, 0600, "digits alone");
  reads("", 0600, "64 hexadecimal");
  seal s = {0};
#ifdef SEAL_SODIUM
  assert_non_null(strstr(seal_read_key(&s, "/tmp"), "is no file"));
  assert_non_null(strstr(seal_read_key(&s, "/tmp/rim_no_such_key"), "No such file"));
  if (geteuid() == 0) {
    write_key(digits, 0600);
    assert_int_equal(chown(path, 12345, 12345), 0);
    assert_non_null(strstr(seal_read_key(&s, path), "another user"));
    unlink(path);
  }
#endif
  assert_false(s.has_key);
}

static void a_counter_is_good_once(void **state) {
  (void)state;
  seal_window w = {0, 0};
  assert_true(seal_window_take(&w, 0));
  assert_false(seal_window_take(&w, 0));
  assert_true(seal_window_take(&w, 100));
  assert_false(seal_window_take(&w, 100));
  assert_false(seal_window_take(&w, 100 - SEAL_LATE - 1));
  assert_true(seal_window_take(&w, 100 - SEAL_LATE));
  assert_false(seal_window_take(&w, 100 - SEAL_LATE));
  for (uint64_t c = 99; c > 100 - SEAL_LATE; c--) { /* late, in any order, each once */
    assert_true(seal_window_take(&w, c));
    assert_false(seal_window_take(&w, c));
  }
  assert_true(seal_window_take(&w, 101));
  assert_false(seal_window_take(&w, 100 - SEAL_LATE + 1));
  assert_true(seal_window_take(&w, 101 + SEAL_LATE)); /* the bit of 101 is the last */
  assert_false(seal_window_take(&w, 101));
  assert_true(seal_window_take(&w, 102));
  assert_true(seal_window_take(&w, UINT64_MAX));
  assert_false(seal_window_take(&w, UINT64_MAX));
  assert_false(seal_window_take(&w, 102 + SEAL_LATE));
  assert_true(seal_window_take(&w, UINT64_MAX - 1));
  assert_true(w.highest == UINT64_MAX && w.seen == 3);
}

#ifdef SEAL_SODIUM
static const uint8_t lcm_tag[16] = {0x90, 0x92, 0xd7, 0x3b, 0x6b, 0x90, 0xac, 0xc5,
                                    0x01, 0xed, 0x08, 0xaa, 0xec, 0x89, 0xf4, 0xa9};
static const uint8_t can_tag[16] = {0x1b, 0x1f, 0xdb, 0x02, 0xea, 0xbb, 0x8f, 0x9c,
                                    0xae, 0x21, 0x28, 0x89, 0x8d, 0xee, 0x40, 0x8f};
static const rim_command clear_seven = {7, 9, RIM_COMMAND_CLEAR};

static seal with_key(void) {
  seal s = {.has_key = true};
  for (uint8_t i = 0; i < SEAL_KEY_BYTES; ++i)
    s.key[i] = i;
  return s;
}

static void sealed_commands_over_lcm(void **state) {
  (void)state;
  const seal s = with_key();
  seal_window used = {0, 0};
  seal_counts n = {0, 0, 0};
  uint8_t plain[RIM_LCM_COMMAND_SIZE], in[sizeof plain + RIMI_SEAL_BYTES], out[sizeof plain];
  assert_int_equal(rim_lcm_pack_command(plain, sizeof plain, &clear_seven), RIM_OK);
  memcpy(rimi_lcm_seal(in, plain, rimi_sealed_command(), 1000), lcm_tag, sizeof lcm_tag);
  for (size_t bit = 64; bit < 8 * sizeof in; ++bit) { /* the type's own bits: no such type */
    in[bit / 8] = (uint8_t)(in[bit / 8] ^ 1u << bit % 8);
    assert_false(seal_open_lcm(&s, &used, &n, in, sizeof in, out, sizeof out));
    in[bit / 8] = (uint8_t)(in[bit / 8] ^ 1u << bit % 8);
  }
  assert_true(n.forged == 8 * (sizeof in - 8) && n.unsealed == 0 && n.replayed == 0);
  assert_true(used.highest == 0 && used.seen == 0); /* what is forged uses no counter up */
  assert_true(seal_open_lcm(&s, &used, &n, in, sizeof in, out, sizeof out));
  assert_memory_equal(out, plain, sizeof out);
  assert_false(seal_open_lcm(&s, &used, &n, in, sizeof in, out, sizeof out));
  assert_int_equal(n.replayed, 1);
  assert_false(seal_open_lcm(&s, &used, &n, plain, sizeof plain, out, sizeof out));
  assert_false(seal_open_lcm(&s, &used, &n, in, sizeof in - 1, out, sizeof out));
  assert_int_equal(n.unsealed, 2);
  seal other = s;
  other.key[31] ^= 0x80;
  used = (seal_window){0, 0};
  assert_false(seal_open_lcm(&other, &used, &n, in, sizeof in, out, sizeof out));
  assert_int_equal(n.forged, 8 * (sizeof in - 8) + 1);
  n.forged = n.unsealed = n.replayed = UINT32_MAX;
  assert_false(seal_open_lcm(&other, &used, &n, in, sizeof in, out, sizeof out));
  assert_int_equal(n.forged, UINT32_MAX);
}

static void sealed_commands_over_can(void **state) {
  (void)state;
  const seal s = with_key();
  seal_window used = {0, 0};
  seal_counts n = {0, 0, 0};
  rim_can_frame frame, plain;
  rim_command out = {0};
  rimi_can_seal(&frame, 5, &clear_seven, 1000);
  rimi_can_seal_finish(&frame, can_tag);
  for (size_t byte = 0; byte < 36; ++byte) { /* layout and node and command are told before */
    rim_can_frame bad = frame;
    bad.data[byte] ^= 0x10;
    rimi_can_seal_finish(&bad, bad.data + RIMI_SEALED_FRAME_BODY);
    assert_false(seal_open_can(&s, &used, &n, &bad, 5, &out));
  }
  assert_true(n.unsealed == 3 && n.forged == 33);
  assert_true(seal_open_can(&s, &used, &n, &frame, 5, &out));
  assert_true(out.sequence == 7 && out.model_id == 9 && out.command == RIM_COMMAND_CLEAR);
  assert_false(seal_open_can(&s, &used, &n, &frame, 5, &out));
  assert_int_equal(n.replayed, 1);
  assert_int_equal(rim_can_pack_command(&plain, 5, &clear_seven), RIM_OK);
  assert_false(seal_open_can(&s, &used, &n, &plain, 5, &out));
  assert_int_equal(n.unsealed, 4);
}
#endif

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(keys_are_read_or_refused),
      cmocka_unit_test(a_counter_is_good_once),
#ifdef SEAL_SODIUM
      cmocka_unit_test(sealed_commands_over_lcm),
      cmocka_unit_test(sealed_commands_over_can),
#endif
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
