/* SPDX-License-Identifier: MIT */
#define _GNU_SOURCE
#include "rimd/say.h"

#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

void say(const char *format, ...) {
  char text[400] = "rimd: ";
  const size_t before = strlen(text);
  va_list arguments;
  va_start(arguments, format);
  const int wrote = vsnprintf(text + before, sizeof text - before - 1, format, arguments);
  va_end(arguments);
  size_t length = before + (size_t)(wrote > 0 ? wrote : 0);
  if (length > sizeof text - 2)
    length = sizeof text - 2;
  text[length] = '\n';
  /* A pipe that is ready for writing takes 4096 bytes without waiting (POSIX, PIPE_BUF). */
  struct pollfd ready = {.fd = STDERR_FILENO, .events = POLLOUT};
  if (poll(&ready, 1, 0) == 1 && (ready.revents & POLLOUT) != 0) {
    const ssize_t written = write(STDERR_FILENO, text, length + 1);
    (void)written;
  }
}
