/* SPDX-License-Identifier: MIT */
/* Every call of the system that rimd makes while it starts, failing one after another: the start is
 * refused with a reason, and nothing is left open. Then what the transports do when a call fails
 * while they run, and what the outbox keeps of it. */
#define _GNU_SOURCE
#include <arpa/inet.h>
#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "rimd/rimd.h"
#include "rimd/say.h"

#include "../lib/monitor_bench.h"
#include "own_folder.h"

enum { EXIT_DATA = 3 };

/* The calls, by the order in which rimd_start makes the first of each. */
typedef enum call {
  OPEN,
  FSTAT,
  MMAP,
  READ,
  SEM_INIT,
  ATTR_INIT,
  STACK,
  INHERIT,
  POLICY,
  PRIORITY,
  CREATE,
  SOCKET,
  SETSOCKOPT,
  BIND,
  CALLS
} call;

static struct {
  call which;
  int why;           /* an errno; 0: nothing fails */
  unsigned before;   /* calls of that kind that go well before */
  bool was_made;     /* it came to that */
  bool ends;         /* a read finds the end instead */
  int send, receive; /* an errno of sendmsg or recvmsg, at the next call */
  bool truncated;    /* the next datagram is longer than the buffer */
  uint32_t dropped;  /* told with the next datagram, after a message of another kind; 0: nothing */
  int said;          /* what poll says of stderr; 0: as ever */
} breaks;

/* Whether this call is the one that fails; errno is set. */
static bool is_it(call which) {
  if (breaks.why == 0 || breaks.which != which || breaks.was_made || breaks.before-- > 0)
    return false;
  breaks.was_made = true;
  errno = breaks.why;
  return true;
}

#define WRAPPED(type, name, parameters, arguments, which, failure)                                 \
  type __real_##name parameters;                                                                   \
  type __wrap_##name parameters;                                                                   \
  type __wrap_##name parameters { return is_it(which) ? (failure) : __real_##name arguments; }

WRAPPED(int, fstat, (int fd, struct stat *about), (fd, about), FSTAT, -1)
WRAPPED(void *, mmap, (void *at, size_t length, int protection, int flags, int fd, off_t from),
        (at, length, protection, flags, fd, from), MMAP, MAP_FAILED)
WRAPPED(ssize_t, read, (int fd, void *data, size_t length), (fd, data, length), READ,
        breaks.ends ? 0 : -1)
WRAPPED(int, sem_init, (sem_t * s, int shared, unsigned value), (s, shared, value), SEM_INIT, -1)
WRAPPED(int, pthread_attr_init, (pthread_attr_t * a), (a), ATTR_INIT, breaks.why)
WRAPPED(int, pthread_attr_setstacksize, (pthread_attr_t * a, size_t length), (a, length), STACK,
        breaks.why)
WRAPPED(int, pthread_attr_setinheritsched, (pthread_attr_t * a, int inherit), (a, inherit), INHERIT,
        breaks.why)
WRAPPED(int, pthread_attr_setschedpolicy, (pthread_attr_t * a, int policy), (a, policy), POLICY,
        breaks.why)
WRAPPED(int, pthread_attr_setschedparam, (pthread_attr_t * a, const struct sched_param *p), (a, p),
        PRIORITY, breaks.why)
WRAPPED(int, pthread_create,
        (pthread_t * t, const pthread_attr_t *a, void *(*run)(void *), void *argument),
        (t, a, run, argument), CREATE, breaks.why)
WRAPPED(int, socket, (int domain, int type, int protocol), (domain, type, protocol), SOCKET, -1)
WRAPPED(int, setsockopt, (int fd, int level, int name, const void *value, socklen_t length),
        (fd, level, name, value, length), SETSOCKOPT, -1)
WRAPPED(int, bind, (int fd, const struct sockaddr *address, socklen_t length),
        (fd, address, length), BIND, -1)

int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, mode_t mode);
int __wrap_open(const char *path, int flags, mode_t mode) {
  return is_it(OPEN) ? -1 : __real_open(path, flags, (flags & O_CREAT) != 0 ? mode : 0);
}

static bool breaks_now(int *why) {
  errno = *why;
  const bool now = *why != 0;
  *why = 0;
  return now;
}

ssize_t __real_sendmsg(int fd, const struct msghdr *message, int flags);
ssize_t __wrap_sendmsg(int fd, const struct msghdr *message, int flags);
ssize_t __wrap_sendmsg(int fd, const struct msghdr *message, int flags) {
  return breaks_now(&breaks.send) ? -1 : __real_sendmsg(fd, message, flags);
}

ssize_t __real_recvmsg(int fd, struct msghdr *message, int flags);
ssize_t __wrap_recvmsg(int fd, struct msghdr *message, int flags);
ssize_t __wrap_recvmsg(int fd, struct msghdr *message, int flags) {
  if (breaks_now(&breaks.receive))
    return -1;
  const size_t room = message->msg_controllen;
  const ssize_t got = __real_recvmsg(fd, message, flags);
  if (got < 0)
    return got;
  if (breaks.truncated)
    message->msg_flags |= MSG_TRUNC;
  if (breaks.dropped == 0)
    return got;
  message->msg_controllen = room;
  struct cmsghdr *c = CMSG_FIRSTHDR(message);
  /* Before it one of another kind, then one of another level. */
  static unsigned turn;
  const int kind[2][2] = {
      {turn % 2 == 0 ? SOL_SOCKET : IPPROTO_IP, turn % 2 == 0 ? SO_TIMESTAMP : SO_RXQ_OVFL},
      {SOL_SOCKET, SO_RXQ_OVFL}};
  turn++;
  for (int i = 0; i < 2; ++i) {
    const uint32_t value = i == 1 ? breaks.dropped : 77u;
    c->cmsg_level = kind[i][0];
    c->cmsg_type = kind[i][1];
    c->cmsg_len = CMSG_LEN(sizeof value);
    memcpy(CMSG_DATA(c), &value, sizeof value);
    c = (struct cmsghdr *)(void *)((uint8_t *)c + CMSG_SPACE(sizeof value));
  }
  message->msg_controllen = 2 * CMSG_SPACE(sizeof(uint32_t));
  return got;
}

int __real_poll(struct pollfd *fds, nfds_t n, int ms);
int __wrap_poll(struct pollfd *fds, nfds_t n, int ms);
int __wrap_poll(struct pollfd *fds, nfds_t n, int ms) {
  if (breaks.said == 0)
    return __real_poll(fds, n, ms);
  fds[0].revents = (short)breaks.said;
  return 1;
}

static rimd d;
static char text[1024];
static FILE *said_file;
static int stderr_before;

static int make_files(void **state) {
  (void)state;
  static recipe r;
  static image blob;
  if (!make_folder())
    return -1;
  external_recipe(&r);
  build(&blob, &r);
  FILE *f = fopen(file("run.rim"), "wb");
  if (f == NULL || fwrite(blob.byte, 1, blob.size, f) != blob.size || fclose(f) != 0)
    return -1;
  snprintf(text, sizeof text,
           "image = %s\nlcm = udpm://239.255.76.68:7668?ttl=0\nlcm_interface = 127.0.0.1\n"
           "state = %s\n",
           file("run.rim"), file("state"));
  said_file = tmpfile();
  stderr_before = dup(STDERR_FILENO);
  return said_file == NULL || stderr_before < 0;
}

static int remove_files(void **state) {
  (void)state;
  const char *const name[] = {"run.rim", "state", "state.old", "state.tmp"};
  for (size_t i = 0; i < 4; ++i)
    unlink(file(name[i]));
  return rmdir(folder);
}

static uint32_t descriptors(void) {
  DIR *all = opendir("/proc/self/fd");
  uint32_t count = 0;
  assert_non_null(all);
  while (readdir(all) != NULL)
    count++;
  closedir(all);
  return count;
}

/* The daemon's start; what it said is in `said`. */
static int start_daemon(char *said, size_t room) {
  memset(&d, 0, sizeof d);
  assert_int_equal(config_parse(&d.config, "test", text, strlen(text)), 0);
  rewind(said_file);
  assert_int_equal(ftruncate(fileno(said_file), 0), 0);
  dup2(fileno(said_file), STDERR_FILENO);
  const int status = rimd_start(&d);
  const int why = breaks.why;
  breaks.why = 0; /* what follows is the test's own */
  dup2(stderr_before, STDERR_FILENO);
  rewind(said_file);
  said[fread(said, 1, room - 1, said_file)] = '\0';
  breaks.why = why;
  return status;
}

/* The n-th call of a kind, n = 0, 1, ... until it makes no more of them. */
static void a_start_that_fails_says_why(void **state) {
  (void)state;
  const int whys[] = {EMFILE, EIO,    ENOMEM, EIO,    ENOSYS, ENOMEM,      EINVAL,
                      EINVAL, EINVAL, EINVAL, EAGAIN, ENFILE, ENOPROTOOPT, EADDRNOTAVAIL};
  uint32_t refused[CALLS] = {0}, kinds = 0;
  char said[4096];
  for (int which = 0; which < CALLS; ++which) {
    for (unsigned n = 0; n < 64; ++n) {
      unlink(file("state"));
      unlink(file("state.old"));
      memset(&breaks, 0, sizeof breaks);
      const uint32_t open_before = descriptors();
      breaks.which = (call)which;
      breaks.why = whys[which];
      breaks.before = n;
      const int status = start_daemon(said, sizeof said);
      const bool was_made = breaks.was_made;
      memset(&breaks, 0, sizeof breaks);
      if (status == 0)
        assert_int_equal(rimd_finish(&d), 0);
      else {
        assert_int_equal(status, EXIT_DATA);
        assert_true(was_made);
        assert_non_null(strstr(said, "rimd: "));
        assert_true(strstr(said, strerror(whys[which])) != NULL ||
                    strstr(said, "cannot be read") != NULL);
        refused[which]++;
      }
      assert_int_equal(descriptors(), open_before);
      if (!was_made)
        break;
    }
    kinds += refused[which] > 0;
  }
  assert_int_equal(kinds, CALLS);
  assert_int_equal(refused[MMAP], 3);    /* image, monitor, copy of the state */
  assert_int_equal(refused[SOCKET], 2);  /* one to send by, one to receive by */
  assert_true(refused[SETSOCKOPT] >= 7); /* a bus that is set otherwise than was asked is no bus */
}

/* A file that becomes shorter while it is read, one that has nothing, and one of 3 GB. */
static void a_shrinking_image_is_refused(void **state) {
  (void)state;
  char said[1024];
  memset(&breaks, 0, sizeof breaks);
  breaks.which = READ;
  breaks.why = EIO;
  breaks.ends = true;
  assert_int_equal(start_daemon(said, sizeof said), EXIT_DATA);
  memset(&breaks, 0, sizeof breaks);
  assert_non_null(strstr(said, "became shorter while it was read"));
  FILE *f = fopen(file("state"), "wb"); /* an image of no bytes, under another name */
  assert_non_null(f);
  fclose(f);
  snprintf(d.config.image, sizeof d.config.image, "%s", file("state"));
  assert_int_equal(rimd_check(&d), EXIT_DATA);
  assert_int_equal(truncate(file("state"), (off_t)3000000000), 0); /* a hole: it takes no room */
  assert_int_equal(rimd_check(&d), EXIT_DATA);
  unlink(file("state"));
}

static void a_key_that_cannot_be_read(void **state) {
  (void)state;
#ifdef SEAL_SODIUM
  static seal s;
  FILE *f = fopen(file("state"), "wb");
  assert_non_null(f);
  fclose(f);
  chmod(file("state"), 0600);
  const call which[2] = {FSTAT, READ};
  const char *const reason[2] = {"is no file", strerror(EIO)};
  for (int i = 0; i < 2; ++i) {
    memset(&breaks, 0, sizeof breaks);
    breaks.which = which[i];
    breaks.why = EIO;
    assert_string_equal(seal_read_key(&s, file("state")), reason[i]);
    assert_false(s.has_key);
  }
  memset(&breaks, 0, sizeof breaks);
  if (geteuid() == 0) { /* as a user whose file it is not */
    assert_int_equal(chown(file("state"), 4321, 4321), 0);
    assert_string_equal(seal_read_key(&s, file("state")), "belongs to another user");
  }
  unlink(file("state"));
#else
  skip();
#endif
}

/* ---- while it runs ---- */

static lcm_udp lcm;
static outbox box;

static void open_bus(void) {
  lcm_udp_address address;
  const char *what;
  memset(&breaks, 0, sizeof breaks);
  memset(&lcm, 0, sizeof lcm);
  assert_null(lcm_udp_parse(&address, "udpm://239.255.76.68:7669?ttl=0"));
  address.interface = INADDR_LOOPBACK;
  assert_int_equal(lcm_udp_open(&lcm, &address, true, &what), 0);
}

/* Waits for the next datagram of ours, and takes it. */
static int receive(lcm_udp_message *message) {
  struct pollfd in = {.fd = lcm.in, .events = POLLIN};
  assert_int_equal(__real_poll(&in, 1, 5000), 1);
  return lcm_udp_receive(&lcm, message);
}

static void a_bus_that_fails_is_counted(void **state) {
  (void)state;
  const uint8_t payload[4] = {1, 2, 3, 4};
  lcm_udp_message m;
  open_bus();
  assert_int_equal(lcm_udp_receive(&lcm, &m), 0);
  breaks.receive = ENETDOWN;
  assert_int_equal(lcm_udp_receive(&lcm, &m), -1);
  const int busy[2] = {EAGAIN, ENOBUFS};
  for (int i = 0; i < 2; ++i) { /* to be tried again: nothing is lost yet */
    breaks.send = busy[i];
    assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), -busy[i]);
    assert_int_equal(lcm.counts.unsent, 0);
  }
  breaks.send = ENETUNREACH;
  assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), -ENETUNREACH);
  assert_int_equal(lcm.counts.unsent, 1);
  lcm.counts.unsent = UINT32_MAX;
  breaks.send = ENETUNREACH;
  assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), -ENETUNREACH);
  assert_int_equal(lcm.counts.unsent, UINT32_MAX); /* saturates */
  /* Names that the format has no room for. */
  char name[LCM_PACKET_MAX_CHANNEL + 2];
  memset(name, 'x', sizeof name);
  name[sizeof name - 1] = '\0';
  assert_int_equal(lcm_udp_send(&lcm, name, payload, 4), -EINVAL);
  assert_int_equal(lcm_udp_send(&lcm, "", payload, 4), -EINVAL);
  assert_int_equal(lcm.sequence, 0);
  name[sizeof name - 2] = '\0';
  assert_int_equal(lcm_udp_send(&lcm, name, payload, 4), 0);
  assert_int_equal(lcm.sequence, 1);
  assert_int_equal(receive(&m), 1);
  assert_string_equal(m.channel, name);
  assert_true(m.bytes == 4 && memcmp(m.payload, payload, 4) == 0);
  /* What the kernel dropped, as it tells it; the same total again is no more. */
  breaks.dropped = 5;
  for (int i = 0; i < 2; ++i) {
    assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), 0);
    assert_int_equal(receive(&m), 1);
    assert_int_equal(lcm.counts.lost, 5);
  }
  lcm.counts.lost = UINT32_MAX - 1;
  breaks.dropped = 9;
  assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), 0);
  assert_int_equal(receive(&m), 1);
  assert_int_equal(lcm.counts.lost, UINT32_MAX);
  breaks.dropped = 0;
  breaks.truncated = true;
  assert_int_equal(lcm_udp_send(&lcm, "A", payload, 4), 0);
  assert_int_equal(receive(&m), -1);
  assert_int_equal(lcm.counts.malformed, 1);
  lcm_udp_close(&lcm);
  assert_true(lcm.in == -1 && lcm.out == -1);
}

/* A sender alone has one socket, and any interface may be the route's. */
static void a_sender_alone(void **state) {
  (void)state;
  lcm_udp_address address;
  const char *what;
  memset(&breaks, 0, sizeof breaks);
  assert_non_null(lcm_udp_parse(&address, "udpm://239.255.76.68:0"));
  assert_null(lcm_udp_parse(&address, "udpm://239.255.76.68:7669?ttl=0"));
  assert_int_equal(lcm_udp_open(&lcm, &address, false, &what), 0);
  assert_true(lcm.in == -1 && lcm.out >= 0);
  lcm_udp_close(&lcm);
}

/* The newest record takes the place of one that waits, goes out when the network is back, and the
 * one that never went is counted. */
static void the_newest_record_waits(void **state) {
  (void)state;
  rim_alarm a, heard;
  lcm_udp_message m;
  memset(&a, 0, sizeof a);
  a.state = RIM_ALARM_RAISED;
  a.level = RIM_LEVEL_ERROR;
  a.channels = 1;
  a.p_value = 0.05;
  open_bus();
  outbox_init(&box, &lcm, NULL, 1);
  for (uint32_t i = 1; i <= 3; ++i) {
    a.seq = i;
    breaks.send = ENOBUFS;
    outbox_alarm(&box, &a, i);
    assert_true(box.lcm_waits);
    assert_int_equal(box.dropped, i - 1);
  }
  box.dropped = UINT32_MAX;
  a.seq = 4;
  breaks.send = ENOBUFS;
  outbox_alarm(&box, &a, 4);
  assert_int_equal(box.dropped, UINT32_MAX);
  assert_true(outbox_pump(&box, 5) == -1 && !box.lcm_waits);
  assert_int_equal(receive(&m), 1);
  assert_string_equal(m.channel, RIM_LCM_CHANNEL_ALARM);
  assert_int_equal(rim_lcm_unpack_alarm(&heard, m.payload, m.bytes), RIM_OK);
  assert_int_equal(heard.seq, 4);
  assert_int_equal(lcm_udp_receive(&lcm, &m), 0); /* it went once */
  lcm_udp_close(&lcm);
}

/* A service manager that cannot be reached holds up nothing. */
static void a_watchdog_without_a_socket(void **state) {
  (void)state;
  watchdog dog;
  memset(&breaks, 0, sizeof breaks);
  setenv("NOTIFY_SOCKET", "@rim_nobody", 1);
  setenv("WATCHDOG_USEC", "1000000", 1);
  breaks.which = SOCKET;
  breaks.why = EMFILE;
  watchdog_open(&dog);
  assert_true(breaks.was_made && dog.fd == -1);
  assert_int_equal(watchdog_wait_ms(&dog, 5), -1);
  memset(&breaks, 0, sizeof breaks);
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
}

/* Features are found by their whole name; an image without names has none. */
static void axes_are_named(void **state) {
  (void)state;
  char said[1024];
  const char *const axis[3] = {"b", "bb", "x"};
  const size_t end = strlen(text);
  for (int i = 0; i < 3; ++i) {
    memset(&breaks, 0, sizeof breaks);
    snprintf(text + end, sizeof text - end, "axis_y = %s\n", axis[i]);
    const int status = start_daemon(said, sizeof said);
    assert_int_equal(status, i == 0 ? 0 : EXIT_DATA);
    if (status == 0) {
      assert_int_equal(d.config.ahead.axis[1], 1);
      assert_int_equal(d.config.ahead.axis[0], RIM_LOOKAHEAD_NO_AXIS);
      assert_int_equal(rimd_finish(&d), 0);
    } else {
      assert_non_null(strstr(said, "axis_y: "));
      assert_non_null(strstr(said, axis[i]));
    }
  }
  static recipe r;
  static image blob;
  external_recipe(&r);
  r.section[RIM_SECTION_NAMES].size = 0;
  build(&blob, &r);
  FILE *f = fopen(file("bare.rim"), "wb");
  assert_non_null(f);
  assert_int_equal(fwrite(blob.byte, 1, blob.size, f), blob.size);
  fclose(f);
  char before[sizeof text];
  memcpy(before, text, sizeof before);
  snprintf(text, sizeof text, "image = %s\nlcm = udpm://239.255.76.68:7668?ttl=0\naxis_x = b\n",
           file("bare.rim"));
  assert_int_equal(start_daemon(said, sizeof said), EXIT_DATA);
  assert_non_null(strstr(said, "has no feature 'b'"));
  memcpy(text, before, sizeof before);
  text[end] = '\0';
  unlink(file("bare.rim"));
}

/* A folder that cannot be opened any more: the file is written, and that its entry may not be on
 * the medium is told. */
static void a_folder_that_is_gone(void **state) {
  (void)state;
  static state_file f;
  static uint8_t copy[1024];
  const char *const path = file("state");
  char name[128];
  snprintf(name, sizeof name, "%s", path);
  const state_parts parts = {.daemon = copy + 512,
                             .monitor = copy + 600,
                             .daemon_bytes = 40,
                             .monitor_bytes = 100,
                             .model_id = 7,
                             .image_crc = 9};
  memset(&breaks, 0, sizeof breaks);
  assert_int_equal(state_start(&f, name, copy, state_bytes(&parts)), 0);
  breaks.which = OPEN;
  breaks.why = EACCES;
  breaks.before = 1; /* after the file itself */
  assert_int_equal(state_finish(&f, &parts), EACCES);
  memset(&breaks, 0, sizeof breaks);
  assert_int_equal(access(name, F_OK), 0);
  unlink(name);
}

/* A terminal that is gone, or takes nothing, stops nobody. */
static void nobody_listens(void **state) {
  (void)state;
  memset(&breaks, 0, sizeof breaks);
  rewind(said_file);
  assert_int_equal(ftruncate(fileno(said_file), 0), 0);
  dup2(fileno(said_file), STDERR_FILENO);
  breaks.said = POLLERR;
  say("%d", 1);
  breaks.said = POLLOUT;
  say("%d", 2);
  breaks.said = 0;
  dup2(stderr_before, STDERR_FILENO);
  char heard[64] = {0};
  rewind(said_file);
  assert_true(fread(heard, 1, sizeof heard - 1, said_file) > 0);
  assert_string_equal(heard, "rimd: 2\n");
}

/* Every counter that is not 0 is said, in as many lines as that takes, and nothing else. */
static void counters_are_told(void **state) {
  (void)state;
  static rimd_kept kept;
  char heard[4096], one[64];
  memset(&breaks, 0, sizeof breaks);
  for (int which = 0; which < 6; ++which) {
    memset(&kept, 0, sizeof kept);
    if (which == 1)
      memset(&kept.counters, 0xff, sizeof kept.counters);
    kept.sealed =
        (seal_counts){.unsealed = which == 2, .forged = which == 3, .replayed = which == 4};
    kept.counters.rows = 77; /* told elsewhere */
    rewind(said_file);
    assert_int_equal(ftruncate(fileno(said_file), 0), 0);
    dup2(fileno(said_file), STDERR_FILENO);
    rimd_tell_counts(&kept);
    dup2(stderr_before, STDERR_FILENO);
    rewind(said_file);
    heard[fread(heard, 1, sizeof heard - 1, said_file)] = '\0';
    for (uint32_t i = 1; i < RIM_COUNTERS_FIELDS; ++i) {
      snprintf(one, sizeof one, " %s %u", rim_counters_name(i),
               rim_counters_value(&kept.counters, i));
      const bool is_said = strstr(heard, one) != NULL;
      assert_int_equal(is_said, rim_counters_value(&kept.counters, i) != 0);
    }
    snprintf(one, sizeof one, "with the key: unsealed %u forged %u replayed %u\n",
             kept.sealed.unsealed, kept.sealed.forged, kept.sealed.replayed);
    assert_int_equal(strstr(heard, one) != NULL, which >= 2 && which <= 4);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(a_start_that_fails_says_why),
      cmocka_unit_test(a_shrinking_image_is_refused),
      cmocka_unit_test(a_key_that_cannot_be_read),
      cmocka_unit_test(a_bus_that_fails_is_counted),
      cmocka_unit_test(a_sender_alone),
      cmocka_unit_test(the_newest_record_waits),
      cmocka_unit_test(nobody_listens),
      cmocka_unit_test(a_watchdog_without_a_socket),
      cmocka_unit_test(axes_are_named),
      cmocka_unit_test(counters_are_told),
      cmocka_unit_test(a_folder_that_is_gone),
  };
  return cmocka_run_group_tests(tests, make_files, remove_files);
}
