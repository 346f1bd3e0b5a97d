/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/watchdog.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define MS UINT64_C(1000000)

void watchdog_open(watchdog *dog) {
  *dog = (watchdog){.fd = -1};
  const char *path = getenv("NOTIFY_SOCKET"), *period = getenv("WATCHDOG_USEC");
  struct sockaddr_un to = {.sun_family = AF_UNIX};
  const unsigned long long us = period != NULL ? strtoull(period, NULL, 10) : 0;
  const size_t length = path != NULL ? strlen(path) : 0;
  if (us == 0 || us > UINT32_MAX || length < 2 || length >= sizeof to.sun_path)
    return;
  memcpy(to.sun_path, path, length);
  if (path[0] == '@') /* the abstract name space of Linux */
    to.sun_path[0] = '\0';
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const socklen_t bytes = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length);
  if (fd >= 0 && connect(fd, (const struct sockaddr *)&to, bytes) == 0) {
    dog->fd = fd;
    dog->interval_ns = 500 * (uint64_t)us;
  } else if (fd >= 0) {
    close(fd);
  }
}

void watchdog_feed(watchdog *dog, uint64_t now_ns) {
  static const char text[] = "WATCHDOG=1";
  if (dog->fd < 0 || now_ns < dog->next_ns)
    return;
  (void)send(dog->fd, text, sizeof text - 1, MSG_DONTWAIT | MSG_NOSIGNAL);
  dog->next_ns = now_ns + dog->interval_ns;
}

int watchdog_wait_ms(const watchdog *dog, uint64_t now_ns) {
  if (dog->fd < 0)
    return -1;
  return dog->next_ns <= now_ns ? 0 : (int)((dog->next_ns - now_ns) / MS) + 1;
}

void watchdog_close(watchdog *dog) {
  if (dog->fd >= 0)
    close(dog->fd);
  dog->fd = -1;
}
