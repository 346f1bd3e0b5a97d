/* SPDX-License-Identifier: MIT */
/* The four functions that a compiler may call on its own (C11 4p6, gcc's -ffreestanding). Compiled
 * with -fno-tree-loop-distribute-patterns, or each would become a call of itself. */
#include <stdint.h>
#include <string.h>

typedef uint32_t __attribute__((may_alias)) word;

static int words_fit(const void *a, const void *b) {
  return (((uintptr_t)a | (uintptr_t)b) & (sizeof(word) - 1)) == 0;
}

void *memcpy(void *restrict to, const void *restrict from, size_t bytes) {
  unsigned char *d = to;
  const unsigned char *s = from;
  if (words_fit(d, s)) {
    for (; bytes >= 4 * sizeof(word); bytes -= 4 * sizeof(word)) {
      word *to4 = (word *)(void *)d;
      const word *from4 = (const word *)(const void *)s;
      const word a = from4[0], b = from4[1], c = from4[2], e = from4[3];
      to4[0] = a;
      to4[1] = b;
      to4[2] = c;
      to4[3] = e;
      d += 4 * sizeof(word);
      s += 4 * sizeof(word);
    }
    for (; bytes >= sizeof(word); bytes -= sizeof(word), d += sizeof(word), s += sizeof(word))
      *(word *)(void *)d = *(const word *)(const void *)s;
  }
  while (bytes-- > 0)
    *d++ = *s++;
  return to;
}

void *memmove(void *to, const void *from, size_t bytes) {
  unsigned char *d = to;
  const unsigned char *s = from;
  if ((uintptr_t)d - (uintptr_t)s >= bytes) { /* to does not begin inside from: forwards is safe */
    while (bytes-- > 0)
      *d++ = *s++;
  } else {
    while (bytes-- > 0)
      d[bytes] = s[bytes];
  }
  return to;
}

void *memset(void *to, int value, size_t bytes) {
  unsigned char *d = to;
  const word four = (unsigned char)value * UINT32_C(0x01010101);
  while (bytes > 0 && !words_fit(d, d)) {
    *d++ = (unsigned char)value;
    --bytes;
  }
  for (; bytes >= 4 * sizeof(word); bytes -= 4 * sizeof(word), d += 4 * sizeof(word)) {
    word *to4 = (word *)(void *)d;
    to4[0] = four;
    to4[1] = four;
    to4[2] = four;
    to4[3] = four;
  }
  for (; bytes >= sizeof(word); bytes -= sizeof(word), d += sizeof(word))
    *(word *)(void *)d = four;
  while (bytes-- > 0)
    *d++ = (unsigned char)value;
  return to;
}

int memcmp(const void *a, const void *b, size_t bytes) {
  const unsigned char *x = a, *y = b;
  for (; bytes > 0; --bytes, ++x, ++y)
    if (*x != *y)
      return *x < *y ? -1 : 1;
  return 0;
}
