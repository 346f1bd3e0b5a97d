/* SPDX-License-Identifier: MIT */
/* fake_can.h - SocketCAN without a kernel that has it: the calls of firmware/transport/socketcan.c
 * (linked with --wrap) meet one end of a local socket pair, and the test holds the other. What an
 * interface may do is set in `fake`. tests/cli/can.sh has the kernel's own. */
#ifndef FAKE_CAN_H
#define FAKE_CAN_H

#include <errno.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "rim/can.h"

enum { FAKE_SOCKETS = 16 };

typedef struct fake_can {
  bool no_can, absent, down, classic, no_force; /* what the system has */
  int bind_fails, mtu_fails, flags_fails;       /* an errno */
  int option_fails;                             /* an errno, of the option CAN_RAW_... `option` */
  int option;
  bool foreign;   /* beside what was dropped, the kernel tells something of another level */
  int disk_fails; /* an errno, of every write to a file */
  int write_fails, read_fails; /* an errno, for the next `fails` calls */
  unsigned fails;
  uint32_t dropped; /* told with every frame, where not 0 */
  int theirs[1024]; /* by descriptor of ours: the test's end; 0: no fake */
  int last;         /* descriptor opened last */
  struct can_filter filter[64];
  size_t filters;
} fake_can;

static fake_can fake;

int __real_socket(int domain, int type, int protocol);
int __real_close(int fd);
int __real_bind(int fd, const struct sockaddr *address, socklen_t bytes);
int __real_setsockopt(int fd, int level, int name, const void *value, socklen_t bytes);
ssize_t __real_write(int fd, const void *data, size_t bytes);
ssize_t __real_recvmsg(int fd, struct msghdr *message, int flags);
int __wrap_socket(int domain, int type, int protocol);
int __wrap_close(int fd);
int __wrap_bind(int fd, const struct sockaddr *address, socklen_t bytes);
int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t bytes);
ssize_t __wrap_write(int fd, const void *data, size_t bytes);
ssize_t __wrap_recvmsg(int fd, struct msghdr *message, int flags);
int __wrap_ioctl(int fd, unsigned long request, ...);

static bool is_fake(int fd) { return fd >= 0 && fd < 1024 && fake.theirs[fd] != 0; }

int __wrap_socket(int domain, int type, int protocol) {
  int pair[2];
  if (domain != AF_CAN)
    return __real_socket(domain, type, protocol);
  if (fake.no_can) {
    errno = EAFNOSUPPORT;
    return -1;
  }
  if (socketpair(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, pair) != 0)
    return -1;
  fake.theirs[pair[0]] = pair[1];
  fake.last = pair[0];
  return pair[0];
}

int __wrap_close(int fd) {
  if (is_fake(fd)) {
    __real_close(fake.theirs[fd]);
    fake.theirs[fd] = 0;
  }
  return __real_close(fd);
}

int __wrap_bind(int fd, const struct sockaddr *address, socklen_t bytes) {
  if (!is_fake(fd))
    return __real_bind(fd, address, bytes);
  errno = fake.bind_fails;
  return fake.bind_fails != 0 ? -1 : 0;
}

int __wrap_setsockopt(int fd, int level, int name, const void *value, socklen_t bytes) {
  if (!is_fake(fd))
    return __real_setsockopt(fd, level, name, value, bytes);
  if (level == SOL_CAN_RAW && name == fake.option && fake.option_fails != 0) {
    errno = fake.option_fails;
    return -1;
  }
  if (level == SOL_CAN_RAW && name == CAN_RAW_FILTER) {
    fake.filters = bytes / sizeof fake.filter[0];
    if (bytes > 0)
      memcpy(fake.filter, value, bytes);
  }
  return level == SOL_SOCKET && name == SO_RCVBUFFORCE && fake.no_force ? -1 : 0;
}

int __wrap_ioctl(int fd, unsigned long request, ...) {
  va_list arguments;
  va_start(arguments, request);
  struct ifreq *r = va_arg(arguments, struct ifreq *);
  va_end(arguments);
  if (!is_fake(fd) || fake.absent) {
    errno = ENODEV;
    return -1;
  }
  errno = request == SIOCGIFMTU ? fake.mtu_fails : request == SIOCGIFFLAGS ? fake.flags_fails : 0;
  if (errno != 0)
    return -1;
  if (request == SIOCGIFINDEX)
    r->ifr_ifindex = 3;
  else if (request == SIOCGIFMTU)
    r->ifr_mtu = fake.classic ? CAN_MTU : CANFD_MTU;
  else
    r->ifr_flags = fake.down ? 0 : IFF_UP;
  return 0;
}

static bool fails(int why) {
  if (fake.fails == 0 || why == 0)
    return false;
  fake.fails--;
  errno = why;
  return true;
}

ssize_t __wrap_write(int fd, const void *data, size_t bytes) {
  if (!is_fake(fd) && fd > STDERR_FILENO && fake.disk_fails != 0) {
    errno = fake.disk_fails;
    return -1;
  }
  return is_fake(fd) && fails(fake.write_fails) ? -1 : __real_write(fd, data, bytes);
}

ssize_t __wrap_recvmsg(int fd, struct msghdr *message, int flags) {
  if (!is_fake(fd))
    return __real_recvmsg(fd, message, flags);
  if (fails(fake.read_fails))
    return -1;
  const size_t room = message->msg_controllen;
  const ssize_t got = __real_recvmsg(fd, message, flags);
  if (got < 0 || fake.dropped == 0)
    return got;
  message->msg_controllen = room;
  struct cmsghdr *c = CMSG_FIRSTHDR(message);
  const struct timespec stamp = {100, 250000000};
  c->cmsg_level = fake.foreign ? SOL_CAN_RAW : SOL_SOCKET;
  c->cmsg_type = SO_TIMESTAMPNS;
  c->cmsg_len = CMSG_LEN(sizeof stamp);
  memcpy(CMSG_DATA(c), &stamp, sizeof stamp);
  struct cmsghdr *d = CMSG_NXTHDR(message, c);
  d->cmsg_level = SOL_SOCKET;
  d->cmsg_type = SO_RXQ_OVFL;
  d->cmsg_len = CMSG_LEN(sizeof fake.dropped);
  memcpy(CMSG_DATA(d), &fake.dropped, sizeof fake.dropped);
  message->msg_controllen = CMSG_SPACE(sizeof stamp) + CMSG_SPACE(sizeof fake.dropped);
  return got;
}

/* A frame from the bus to our socket. */
static inline void fake_send(int fd, uint32_t id, const uint8_t *data, uint8_t length,
                             bool fd_frame) {
  struct canfd_frame out;
  memset(&out, 0, sizeof out);
  out.can_id = id;
  out.len = length;
  memcpy(out.data, data, length < 64 ? length : 64);
  (void)!__real_write(fake.theirs[fd], &out, fd_frame ? CANFD_MTU : CAN_MTU);
}

/* The next frame that ours has sent. False: none. */
static inline bool fake_take(int fd, struct canfd_frame *in, ssize_t *bytes) {
  memset(in, 0, sizeof *in);
  *bytes = recv(fake.theirs[fd], in, sizeof *in, MSG_DONTWAIT);
  return *bytes > 0;
}

#endif
