/* SPDX-License-Identifier: MIT */
/* What rim_zephyr.c uses of Zephyr, as its documentation has it (3.0 to 4.2: Message Queue APIs,
 * Thread APIs, Mutex APIs, System Clock APIs): declarations alone, to compile against. */
#ifndef ZEPHYR_KERNEL_H
#define ZEPHYR_KERNEL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
  int64_t ticks;
} k_timeout_t;
#define K_NO_WAIT ((k_timeout_t){0})
#define K_FOREVER ((k_timeout_t){-1})
#define K_MSEC(ms) ((k_timeout_t){(int64_t)(ms)})

struct k_msgq {
  size_t msg_size;
  char *buffer;
};
#define K_MSGQ_DEFINE(q_name, q_msg_size, q_max_msgs, q_align)                                     \
  static _Alignas(q_align) char _k_fifo_buf_##q_name[(q_max_msgs) * (q_msg_size)];                 \
  struct k_msgq q_name = {(q_msg_size), _k_fifo_buf_##q_name}
int k_msgq_put(struct k_msgq *msgq, const void *data, k_timeout_t timeout);
int k_msgq_get(struct k_msgq *msgq, void *data, k_timeout_t timeout);

struct k_mutex {
  uint32_t lock_count;
};
#define K_MUTEX_DEFINE(name) struct k_mutex name = {0}
int k_mutex_lock(struct k_mutex *mutex, k_timeout_t timeout);
int k_mutex_unlock(struct k_mutex *mutex);

struct k_thread {
  void *base;
};
typedef struct k_thread *k_tid_t;
typedef struct {
  char data;
} k_thread_stack_t;
typedef void (*k_thread_entry_t)(void *p1, void *p2, void *p3);
#define K_THREAD_STACK_DEFINE(sym, size) k_thread_stack_t sym[size]
#define K_THREAD_STACK_SIZEOF(sym) sizeof(sym)
#define K_FP_REGS (1u << 1)
k_tid_t k_thread_create(struct k_thread *new_thread, k_thread_stack_t *stack, size_t stack_size,
                        k_thread_entry_t entry, void *p1, void *p2, void *p3, int prio,
                        uint32_t options, k_timeout_t delay);
int k_thread_name_set(k_tid_t thread, const char *str);
int64_t k_uptime_get(void);
#define ARG_UNUSED(x) (void)(x)

#endif
