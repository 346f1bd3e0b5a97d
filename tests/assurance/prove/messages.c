/* SPDX-License-Identifier: MIT */
/* The long messages of LCM (PART 1 observation, 2 plan, 3 model), any 0..size + 1 bytes. Function
 * by function: the readers of base/bytes.h are replaced by ones that check where they read and
 * return any number, and copies by ones that check both ends, so that the proof is of places,
 * counts and loops, for every content. */
#include "any.h"
#include "base/bytes.h"
#include "base/real.h"

#include <string.h>

uint32_t nondet_uint32(void);
uint64_t nondet_uint64(void);
double nondet_double(void);
_Bool nondet_bool(void);

static const uint8_t *message;
static size_t message_bytes;

static void is_inside(const uint8_t *at, size_t bytes) {
  is_inside_of(at, bytes, message, message_bytes);
}

static uint32_t read_u32(const uint8_t *at) {
  is_inside(at, 4);
  return nondet_uint32();
}
static uint64_t read_u64(const uint8_t *at) {
  is_inside(at, 8);
  return nondet_uint64();
}
static double read_f64(const uint8_t *at) {
  is_inside(at, 8);
  return nondet_double();
}

#define rimi_be_u32 read_u32
#define rimi_be_u64 read_u64
#define rimi_be_f64 read_f64
#define rimi_is_finite(x) ((void)(x), nondet_bool())

#if PART == 1
#include "../../../lib/src/wire/lcm.c"
static void use(const uint8_t *in, size_t n) {
  rim_observation_message out;
  if (rim_lcm_unpack_observation(&out, in, n) == RIM_OK)
    __ESBMC_assert(out.count >= 1 && out.count <= RIM_OBSERVATION_MAX_VALUES, "so many values");
}
#define SIZE RIM_LCM_OBSERVATION_SIZE
#elif PART == 2
static void cleared(void *to, size_t bytes);
#define memset(to, value, bytes) cleared(to, bytes)
#include "entry.c"
static rim_plan plan;
/* Arithmetic, which reads no further than the pose; any answer. */
static bool is_pose(const rim_pose *p) { return p != NULL && nondet_bool(); }
static void cleared(void *to, size_t bytes) {
  __ESBMC_assert(to == &plan && bytes == sizeof plan, "the plan");
}
static void use(const uint8_t *in, size_t n) {
  if (rim_lcm_unpack_plan(&plan, in, n) == RIM_OK)
    __ESBMC_assert(plan.count >= 1 && plan.count <= RIM_PLAN_MAX_POSES, "so many poses");
}
#define SIZE RIM_LCM_PLAN_SIZE
#else
static void copied(void *to, const void *from, size_t bytes, size_t room);
#define memcpy(to, from, bytes) copied(to, from, bytes, sizeof(to))
#include "../../../lib/src/wire/model.c"
static void copied(void *to, const void *from, size_t bytes, size_t room) {
  is_inside(from, bytes);
  __ESBMC_assert(bytes <= room, "no more than its room");
  ((char *)to)[bytes - 1] = (char)nondet_uint32(); /* the only one that is looked at */
}
static void use(const uint8_t *in, size_t n) {
  rim_model_message out;
  if (rim_lcm_unpack_model(&out, in, n) != RIM_OK)
    return;
  const uint32_t i = nondet_uint32() % RIM_MODEL_QUANTITIES;
  __ESBMC_assert(out.count <= RIM_MODEL_QUANTITIES, "so many quantities");
  __ESBMC_assert((uint64_t)out.first + out.count <= (uint64_t)out.features + out.outcomes,
                 "of all");
  __ESBMC_assert(out.quantity[i].name[RIM_MODEL_NAME_BYTES - 1] == 0 &&
                     out.quantity[i].unit[RIM_MODEL_UNIT_BYTES - 1] == 0,
                 "texts that end");
}
#define SIZE RIM_LCM_MODEL_SIZE
#endif

int main(void) {
  uint8_t any[SIZE + 1];
  message = any;
  message_bytes = any_size(sizeof any);
  use(any, message_bytes);
  return 0;
}
