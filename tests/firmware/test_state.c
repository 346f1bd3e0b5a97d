/* SPDX-License-Identifier: MIT */
/* The state file, the watchdog and what is said: every reason to refuse a file, every step at which
 * a medium may fail, every environment that a service manager may give. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cmocka.h>

#include "rimd/config.h"
#include "rimd/say.h"
#include "rimd/state.h"
#include "rimd/watchdog.h"

enum { DAEMON = 40, MONITOR = 100 }; /* bytes */

static uint8_t daemon_bytes[DAEMON], monitor_bytes[MONITOR];
static char folder[64], path[100];

/* What the system does: an errno, at the next call of that kind; 0: as ever. */
static struct {
  int write, fsync, close, rename, read;
  bool short_write, write_nothing;
  int renames_before; /* calls that go well before `rename` */
  int fsyncs_before;
} breaks;

ssize_t __real_write(int fd, const void *data, size_t bytes);
ssize_t __real_read(int fd, void *data, size_t bytes);
int __real_fsync(int fd);
int __real_close(int fd);
int __real_rename(const char *from, const char *to);
ssize_t __wrap_write(int fd, const void *data, size_t bytes);
ssize_t __wrap_read(int fd, void *data, size_t bytes);
int __wrap_fsync(int fd);
int __wrap_close(int fd);
int __wrap_rename(const char *from, const char *to);

static int broken(int *why) {
  errno = *why;
  *why = 0;
  return -1;
}

ssize_t __wrap_write(int fd, const void *data, size_t bytes) {
  if (fd > STDERR_FILENO && breaks.write != 0)
    return broken(&breaks.write);
  if (fd > STDERR_FILENO && breaks.write_nothing)
    return 0;
  if (fd > STDERR_FILENO && breaks.short_write && bytes > 7)
    bytes = 7;
  return __real_write(fd, data, bytes);
}

ssize_t __wrap_read(int fd, void *data, size_t bytes) {
  return breaks.read != 0 ? broken(&breaks.read) : __real_read(fd, data, bytes);
}

int __wrap_fsync(int fd) {
  if (breaks.fsync != 0 && breaks.fsyncs_before-- == 0)
    return broken(&breaks.fsync);
  return __real_fsync(fd);
}

int __wrap_close(int fd) {
  const int status = __real_close(fd);
  return breaks.close != 0 ? broken(&breaks.close) : status;
}

int __wrap_rename(const char *from, const char *to) {
  if (breaks.rename != 0 && breaks.renames_before-- == 0)
    return broken(&breaks.rename);
  return __real_rename(from, to);
}

static state_parts parts_of(void) {
  const state_parts parts = {.daemon = daemon_bytes,
                             .monitor = monitor_bytes,
                             .daemon_bytes = DAEMON,
                             .monitor_bytes = MONITOR,
                             .model_id = 7,
                             .image_crc = 9};
  return parts;
}

static int set_up(void **state) {
  (void)state;
  memset(&breaks, 0, sizeof breaks);
  snprintf(folder, sizeof folder, "/tmp/rim_state_XXXXXX");
  if (mkdtemp(folder) == NULL)
    return -1;
  snprintf(path, sizeof path, "%s/state", folder);
  return 0;
}

static int tear_down(void **state) {
  (void)state;
  char name[128];
  const char *const suffix[] = {"", ".old", ".tmp"};
  memset(&breaks, 0, sizeof breaks);
  for (size_t i = 0; i < 3; ++i) {
    snprintf(name, sizeof name, "%s%s", path, suffix[i]);
    unlink(name);
  }
  return rmdir(folder);
}

/* Writes the present bytes; 0 or an errno. */
static int save(void) {
  static uint8_t copy[1024];
  state_file f;
  const state_parts parts = parts_of();
  assert_true(state_bytes(&parts) <= sizeof copy);
  assert_int_equal(state_start(&f, path, copy, state_bytes(&parts)), 0);
  const int why = state_finish(&f, &parts);
  assert_true(atomic_load(&f.failures) == (why != 0) && atomic_load(&f.why) == why);
  return why;
}

static const char *load(const state_parts *parts) {
  static uint8_t scratch[1024];
  return state_load(path, parts, scratch);
}

static void what_was_saved_comes_back(void **state) {
  (void)state;
  const state_parts parts = parts_of();
  assert_string_equal(load(&parts), STATE_NONE);
  for (uint8_t i = 0; i < DAEMON; ++i)
    daemon_bytes[i] = (uint8_t)(i + 1);
  memset(monitor_bytes, 0x77, sizeof monitor_bytes);
  breaks.short_write = true; /* in pieces */
  assert_int_equal(save(), 0);
  memset(daemon_bytes, 0, sizeof daemon_bytes);
  memset(monitor_bytes, 0, sizeof monitor_bytes);
  assert_null(load(&parts));
  assert_true(daemon_bytes[39] == 40 && monitor_bytes[99] == 0x77);
}

/* The bytes of the file with those from `at` on replaced. */
static void patch(long at, const void *with, size_t bytes) {
  FILE *f = fopen(path, "r+b");
  assert_non_null(f);
  assert_int_equal(fseek(f, at, SEEK_SET), 0);
  assert_int_equal(fwrite(with, 1, bytes, f), bytes);
  assert_int_equal(fclose(f), 0);
}

static void refuses(const state_parts *parts, const char *reason) {
  memset(daemon_bytes, 0x11, sizeof daemon_bytes);
  memset(monitor_bytes, 0x22, sizeof monitor_bytes);
  const char *why = load(parts);
  assert_non_null(why);
  if (strstr(why, reason) == NULL)
    fail_msg("'%s' does not say '%s'", why, reason);
  assert_true(daemon_bytes[0] == 0x11 && monitor_bytes[99] == 0x22); /* as before */
}

static void every_reason_to_refuse_a_file(void **state) {
  (void)state;
  state_parts parts = parts_of();
  const uint8_t other = 0xee;
  assert_int_equal(save(), 0);
  patch(0, &other, 1);
  refuses(&parts, "not a state file");
  assert_int_equal(save(), 0);
  patch(8, &other, 1); /* of the version's text */
  refuses(&parts, "another version");
  assert_int_equal(save(), 0);
  patch(24, &other, 1); /* of the layout */
  refuses(&parts, "another version");
  assert_int_equal(save(), 0);
  parts.model_id = 8;
  refuses(&parts, "another flight image");
  parts = parts_of();
  parts.image_crc = 8;
  refuses(&parts, "another flight image");
  parts = parts_of();
  parts.monitor_bytes = MONITOR - 4;
  refuses(&parts, "another flight image");
  parts = parts_of();
  parts.daemon_bytes = DAEMON - 4;
  refuses(&parts, "another version");
  parts = parts_of();
  patch((long)state_bytes(&parts), &other, 1);
  refuses(&parts, "longer");
  assert_int_equal(truncate(path, (long)state_bytes(&parts) - 1), 0);
  refuses(&parts, "cut");
  assert_int_equal(truncate(path, 20), 0);
  refuses(&parts, "too short");
  assert_int_equal(save(), 0);
  patch((long)state_bytes(&parts) - 1, &other, 1);
  refuses(&parts, "the check sum disagrees");
  assert_int_equal(save(), 0);
  breaks.read = EIO;
  refuses(&parts, strerror(EIO));
  assert_null(load(&parts));
}

/* The medium fails at one step after another: told, nothing half-written, and what was there before
 * is still there, as FILE or as FILE.old. */
static void every_step_at_which_a_medium_fails(void **state) {
  (void)state;
  const state_parts parts = parts_of();
  char older[128], temporary[128];
  snprintf(older, sizeof older, "%s.old", path);
  snprintf(temporary, sizeof temporary, "%s.tmp", path);
  memset(daemon_bytes, 3, sizeof daemon_bytes);
  assert_int_equal(save(), 0);
  for (int step = 0; step < 6; ++step) {
    memset(daemon_bytes, 4, sizeof daemon_bytes);
    memset(&breaks, 0, sizeof breaks);
    if (step == 0)
      breaks.write = EIO;
    else if (step == 1)
      breaks.write_nothing = true;
    else if (step == 2)
      breaks.fsync = EIO;
    else if (step == 3)
      breaks.close = EIO;
    else
      breaks.rename = EROFS, breaks.renames_before = step - 4;
    assert_int_equal(save(), step == 1 ? ENOSPC : step > 3 ? EROFS : EIO);
    assert_int_equal(access(temporary, F_OK), -1);
    memset(daemon_bytes, 0, sizeof daemon_bytes);
    if (load(&parts) != NULL)
      assert_int_equal(__real_rename(older, path), 0);
    assert_null(load(&parts));
    assert_int_equal(daemon_bytes[0], 3);
  }
  /* The file is whole, and its folder's entry may not be on the medium: told. */
  memset(&breaks, 0, sizeof breaks);
  memset(daemon_bytes, 6, sizeof daemon_bytes);
  breaks.fsync = EIO;
  breaks.fsyncs_before = 1;
  assert_int_equal(save(), EIO);
  assert_null(load(&parts));
  assert_int_equal(daemon_bytes[0], 6);
  /* The first failure is the one that is told. */
  breaks.fsync = ENOSPC;
  breaks.fsyncs_before = 0;
  breaks.close = EIO;
  assert_int_equal(save(), ENOSPC);
  memset(daemon_bytes, 5, sizeof daemon_bytes);
  breaks.write = EINTR; /* no failure: again */
  assert_int_equal(save(), 0);
  assert_null(load(&parts));
  assert_int_equal(daemon_bytes[0], 5);
  snprintf(path, sizeof path, "%s/none/state", folder);
  assert_int_equal(save(), ENOENT);
  snprintf(path, sizeof path, "%s/state", folder);
}

static void names_that_are_too_long(void **state) {
  (void)state;
  char name[400], to[20];
  state_file f;
  uint8_t copy[8];
  memset(name, 'a', sizeof name);
  name[sizeof name - 1] = '\0';
  assert_int_equal(state_start(&f, name, copy, sizeof copy), ENAMETOOLONG);
  assert_true(state_name(to, sizeof to, "a/state", 0) && strcmp(to, "a/state") == 0);
  assert_true(state_name(to, sizeof to, "a/state", 1) && strcmp(to, "a/state.old") == 0);
  assert_false(state_name(to, sizeof to, "0123456789012345", 1));
}

static void every_watchdog(void **state) {
  (void)state;
  struct sockaddr_un at = {.sun_family = AF_UNIX};
  watchdog dog;
  char text[40], longest[200];
  memset(longest, 'x', sizeof longest);
  longest[0] = '/';
  longest[sizeof longest - 1] = '\0';
  const int s = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
  snprintf(at.sun_path + 1, sizeof at.sun_path - 1, "rim_watchdog_%d", (int)getpid());
  const socklen_t bytes =
      (socklen_t)(offsetof(struct sockaddr_un, sun_path) + 1 + strlen(at.sun_path + 1));
  assert_int_equal(bind(s, (const struct sockaddr *)&at, bytes), 0);
  char abstract[120];
  snprintf(abstract, sizeof abstract, "@%s", at.sun_path + 1);
  const struct {
    const char *socket, *period;
    bool works;
  } of[] = {
      {NULL, NULL, false},        {abstract, NULL, false},     {NULL, "1000000", false},
      {abstract, "0", false},     {abstract, "x", false},      {abstract, "99999999999", false},
      {"/", "1000000", false},    {longest, "1000000", false}, {"/nowhere", "1000000", false},
      {abstract, "1000000", true}};
  for (size_t i = 0; i < sizeof of / sizeof of[0]; ++i) {
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    if (of[i].socket != NULL)
      setenv("NOTIFY_SOCKET", of[i].socket, 1);
    if (of[i].period != NULL)
      setenv("WATCHDOG_USEC", of[i].period, 1);
    watchdog_open(&dog);
    assert_int_equal(dog.fd >= 0, of[i].works);
    if (!of[i].works)
      assert_int_equal(watchdog_wait_ms(&dog, 5), -1);
    watchdog_feed(&dog, 1000);
  }
  assert_int_equal(recv(s, text, sizeof text, 0), 10);
  assert_memory_equal(text, "WATCHDOG=1", 10);
  watchdog_feed(&dog, 1001); /* not so soon */
  assert_int_equal(recv(s, text, sizeof text, 0), -1);
  assert_int_equal(watchdog_wait_ms(&dog, 1001), 500);
  assert_int_equal(watchdog_wait_ms(&dog, UINT64_C(600000000)), 0);
  watchdog_feed(&dog, UINT64_C(600000000));
  assert_int_equal(recv(s, text, sizeof text, 0), 10);
  watchdog_close(&dog);
  watchdog_close(&dog);
  __real_close(s);
}

/* A pipe that is full, or gone, holds nobody up; a long text is cut. */
static void what_is_said(void **state) {
  (void)state;
  int ends[2];
  char text[1000], long_word[800];
  const int before = dup(STDERR_FILENO);
  memset(long_word, 'y', sizeof long_word);
  long_word[sizeof long_word - 1] = '\0';
  assert_int_equal(pipe2(ends, O_NONBLOCK), 0);
  assert_true(dup2(ends[1], STDERR_FILENO) >= 0);
  say("%s", long_word);
  say("short %d", 5);
  const ssize_t got = __real_read(ends[0], text, sizeof text);
  assert_int_equal(got, 400 - 1 + 14);
  assert_memory_equal(text, "rimd: yyy", 9);
  assert_memory_equal(text + 399, "rimd: short 5\n", 14);
  while (__real_write(ends[1], long_word, sizeof long_word) > 0) {
  }
  say("nobody hears this");
  __real_close(ends[0]);
  assert_true(dup2(before, STDERR_FILENO) >= 0);
  __real_close(ends[1]);
  __real_close(before);
}

/* What one line alone cannot tell, and numbers at their ends. */
static void configurations(void **state) {
  (void)state;
  static config c;
  const struct {
    const char *text;
    unsigned errors;
  } of[] = {
      {"image = a\nlcm = udpm://239.255.76.67:7667\n", 0},
      {"image = a\ncan = can0\ninput = can\n", 0},
      {"image = a\ncan_input = can0\ninput = can\n", 1}, /* nobody hears the alarms */
      {"image = a\nlcm = udpm://239.255.76.67:7667\ninput = can\n", 1},
      {"image = a\nlcm = udpm://239.255.76.67:7667\ninput = can\ncan_input = can1\n", 0},
      {"image = a\nlcm = udpm://239.255.76.67:7667\ninput = lcm\n", 0},
      {"image = a\nlcm = udpm://239.255.76.67:7667\ninput = canbus\n", 1},
      {"image = a\ncan = a_name_of_sixteen\ninput = can\n", 1},
      {"image = a\ncan = can0\ninput = can\ncan_input = a_name_of_sixteen\n", 1},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nmargin_mm = 5\n", 1},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nmargin_mm = 5\naxis_y = b\n", 0},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nnode = 12345678901\n", 1},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nnode = 127\n", 0},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nkey = k\n", 1},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nkey = k\nstate = s\n", 0},
      {"image = a\nlcm = udpm://239.255.76.67:7667\nkey_observations = yes\n", 1},
      {"", 3},
  };
  const int null = open("/dev/null", O_WRONLY), before = dup(STDERR_FILENO);
  assert_true(dup2(null, STDERR_FILENO) >= 0);
  unsigned wrong = 0;
  for (size_t i = 0; i < sizeof of / sizeof of[0]; ++i)
    if (config_parse(&c, "test", of[i].text, strlen(of[i].text)) != of[i].errors)
      wrong = (unsigned)i + 1;
  breaks.read = EIO;
  const unsigned unread = config_read(&c, "/dev/null", NULL);
  assert_true(dup2(before, STDERR_FILENO) >= 0);
  __real_close(null);
  __real_close(before);
  assert_int_equal(wrong, 0);
  assert_int_equal(unread, 1);
}

int main(void) {
#define TEST(name) cmocka_unit_test_setup_teardown(name, set_up, tear_down)
  const struct CMUnitTest tests[] = {
      TEST(what_was_saved_comes_back),
      TEST(every_reason_to_refuse_a_file),
      TEST(every_step_at_which_a_medium_fails),
      TEST(names_that_are_too_long),
      TEST(every_watchdog),
      TEST(what_is_said),
      TEST(configurations),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
