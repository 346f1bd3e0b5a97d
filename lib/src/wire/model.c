/* SPDX-License-Identifier: MIT */
#include "rim/lcm.h"

#include "base/bytes.h"
#include "wire/message.h"

/* lcm-gen's fingerprint of lib/wire/rim_model_t.lcm; test_model holds it to the generated code. */
#define HASH_MODEL UINT64_C(0x5ac022122475c6bd)
#define NAMES_AT (8u + 7u * 4u + 2u)
#define UNITS_AT (NAMES_AT + RIM_MODEL_QUANTITIES * RIM_MODEL_NAME_BYTES)
#define RANGES_AT (UNITS_AT + RIM_MODEL_QUANTITIES * RIM_MODEL_UNIT_BYTES)

_Static_assert(RANGES_AT + 16u * RIM_MODEL_QUANTITIES == RIM_LCM_MODEL_SIZE,
               "names, units, ranges");

/* At most room - 1 bytes, and zeroes to the end. */
static void put_text(uint8_t *at, size_t room, const char *text, size_t length) {
  memset(at, 0, room);
  if (text != NULL)
    memcpy(at, text, length < room ? length : room - 1u);
}

static void put_quantity(uint8_t *out, const rim_image *image, uint32_t i, uint32_t index,
                         uint32_t features) {
  const char *name = NULL;
  const uint8_t *range = NULL;
  size_t length = 0, bytes = 0;
  (void)rim_image_name(image, index, &name, &length);
  const char *unit = rim_unit_of_name(name, length);
  uint8_t *to = out + UNITS_AT + i * RIM_MODEL_UNIT_BYTES; /* zeroes */
  put_text(out + NAMES_AT + i * RIM_MODEL_NAME_BYTES, RIM_MODEL_NAME_BYTES, name, length);
  for (size_t k = 0; k + 1u < RIM_MODEL_UNIT_BYTES && unit[k] != '\0'; ++k)
    to[k] = (uint8_t)unit[k];
  if (index < features &&
      rim_image_section(image, RIM_SECTION_FEATURES, &range, &bytes) == RIM_OK &&
      bytes == 8u * (size_t)features) {
    (void)rimi_be_put_f64(out + RANGES_AT + 8u * i, (double)rimi_le_f32(range, index));
    (void)rimi_be_put_f64(out + RANGES_AT + 8u * (RIM_MODEL_QUANTITIES + i),
                          (double)rimi_le_f32(range, features + index));
  }
}

rim_status rim_lcm_pack_model(uint8_t *out, size_t bytes, const rim_image *image, uint32_t first,
                              uint8_t flags) {
  const uint8_t *config;
  size_t config_bytes;
  if (out == NULL || image == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_MODEL_SIZE)
    return RIM_E_SIZE;
  const rim_status status = rim_image_section(image, RIM_SECTION_CONFIG, &config, &config_bytes);
  if (status != RIM_OK)
    return status;
  if (config_bytes < 4u * RIM_CONFIG_WORDS)
    return RIM_E_RANGE;
  const uint32_t features = rimi_le_u32(config, RIM_CONFIG_FEATURES);
  const uint32_t outcomes = rimi_le_u32(config, RIM_CONFIG_OUTCOMES);
  if (features > UINT16_MAX || outcomes > UINT16_MAX || first >= features + outcomes)
    return RIM_E_RANGE;
  const uint32_t rest = features + outcomes - first;
  const uint32_t count = rest < RIM_MODEL_QUANTITIES ? rest : RIM_MODEL_QUANTITIES;
  memset(out, 0, RIM_LCM_MODEL_SIZE);
  uint8_t *at = rimi_be_put_u64(out, HASH_MODEL);
  at = rimi_be_put_u32(at, image->model_id);
  at = rimi_be_put_u32(at, features);
  at = rimi_be_put_u32(at, outcomes);
  at = rimi_be_put_u32(at, rimi_le_u32(config, RIM_CONFIG_PERIOD_US));
  at = rimi_be_put_u32(at, rimi_le_u32(config, RIM_CONFIG_BLOCK_ROWS));
  at = rimi_be_put_u32(at, first);
  at = rimi_be_put_u32(at, count);
  at[0] = rimi_le_u32(config, RIM_CONFIG_EXTERNAL) != 0 ? 1u : 0u;
  at[1] = flags;
  for (uint32_t i = 0; i < count; ++i)
    put_quantity(out, image, i, first + i, features);
  return RIM_OK;
}

static rim_status get_quantity(rim_model_quantity *out, const uint8_t *in, uint32_t i) {
  memcpy(out->name, in + NAMES_AT + i * RIM_MODEL_NAME_BYTES, RIM_MODEL_NAME_BYTES);
  memcpy(out->unit, in + UNITS_AT + i * RIM_MODEL_UNIT_BYTES, RIM_MODEL_UNIT_BYTES);
  out->low = rimi_be_f64(in + RANGES_AT + 8u * i);
  out->high = rimi_be_f64(in + RANGES_AT + 8u * (RIM_MODEL_QUANTITIES + i));
  if (out->name[RIM_MODEL_NAME_BYTES - 1] != '\0' || out->unit[RIM_MODEL_UNIT_BYTES - 1] != '\0')
    return RIM_E_RANGE; /* a text without an end */
  return rimi_is_finite(out->low) && rimi_is_finite(out->high) ? RIM_OK : RIM_E_DATA;
}

rim_status rim_lcm_unpack_model(rim_model_message *out, const uint8_t *in, size_t bytes) {
  rim_status status = check_message(out, in, bytes, RIM_LCM_MODEL_SIZE, HASH_MODEL);
  if (status != RIM_OK)
    return status;
  out->model_id = rimi_be_u32(in + 8);
  out->features = rimi_be_u32(in + 12);
  out->outcomes = rimi_be_u32(in + 16);
  out->period_us = rimi_be_u32(in + 20);
  out->block_rows = rimi_be_u32(in + 24);
  out->first = rimi_be_u32(in + 28);
  out->count = rimi_be_u32(in + 32);
  out->external = in[36] != 0;
  out->flags = in[37];
  if (out->features > UINT16_MAX || out->outcomes > UINT16_MAX ||
      out->count > RIM_MODEL_QUANTITIES || out->first > out->features + out->outcomes ||
      out->count > out->features + out->outcomes - out->first)
    return RIM_E_RANGE;
  for (uint32_t i = 0; i < RIM_MODEL_QUANTITIES; ++i) {
    status = get_quantity(&out->quantity[i], in, i);
    if (status != RIM_OK)
      return status;
  }
  return RIM_OK;
}
