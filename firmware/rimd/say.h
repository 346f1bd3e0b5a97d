/* SPDX-License-Identifier: MIT */
/* say.h - messages to stderr that never wait: when a pipe is full the message is lost, not time. */
#ifndef SAY_H
#define SAY_H

/* Writes "rimd: " and the text with a line end, cut to 400 characters. No heap. */
void say(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
