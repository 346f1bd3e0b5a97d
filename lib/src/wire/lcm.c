/* SPDX-License-Identifier: MIT */
#include "rim/lcm.h"

#include "wire/message.h"

/* lcm-gen's fingerprints of the types in lib/wire; test_lcm holds them to the generated code.
 */
#define HASH_OBSERVATION UINT64_C(0xefc23e26e7c61f20)
#define HASH_ALARM UINT64_C(0x9505554c04eb3825)
#define HASH_ALARM_1 UINT64_C(0xe5c3ead08ca812db) /* without since_sd_s */
#define ALARM_1_SIZE (RIM_LCM_ALARM_SIZE - 8)
#define HASH_HEALTH UINT64_C(0xdb1eada15e13938f)

/* Arrays, and readers that step on; each returns the place behind what it wrote or read. */
static uint8_t *put_f64(uint8_t *at, const double *value, size_t count) {
  for (size_t i = 0; i < count; ++i)
    at = rimi_be_put_f64(at, value[i]);
  return at;
}

static uint8_t *put_u16s(uint8_t *at, const uint16_t *value, size_t count) {
  for (size_t i = 0; i < count; ++i)
    at = rimi_be_put_u16(at, value[i]);
  return at;
}

static const uint8_t *get_u32(const uint8_t *at, uint32_t *value) {
  *value = rimi_be_u32(at);
  return at + 4;
}

static const uint8_t *get_f64(const uint8_t *at, double *value, size_t count) {
  for (size_t i = 0; i < count; i++, at += 8)
    value[i] = rimi_be_f64(at);
  return at;
}

static const uint8_t *get_u16s(const uint8_t *at, uint16_t *value, size_t count) {
  for (size_t i = 0; i < count; i++, at += 2)
    value[i] = rimi_be_u16(at);
  return at;
}

rim_status rim_lcm_pack_observation(uint8_t *out, size_t bytes, const rim_observation_message *in) {
  static const double zero = 0.0;
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_OBSERVATION_SIZE)
    return RIM_E_SIZE;
  if (in->count < 1 || in->count > RIM_OBSERVATION_MAX_VALUES)
    return RIM_E_RANGE;
  uint8_t *at = rimi_be_put_u64(out, HASH_OBSERVATION);
  at = rimi_be_put_u64(at, (uint64_t)in->t_us);
  at = rimi_be_put_u32(at, in->sequence);
  at = rimi_be_put_u32(at, in->count);
  at = put_f64(at, in->value, in->count);
  for (uint32_t i = in->count; i < RIM_OBSERVATION_MAX_VALUES; ++i)
    at = put_f64(at, &zero, 1);
  return RIM_OK;
}

rim_status rim_lcm_unpack_observation(rim_observation_message *out, const uint8_t *in,
                                      size_t bytes) {
  const rim_status status =
      check_message(out, in, bytes, RIM_LCM_OBSERVATION_SIZE, HASH_OBSERVATION);
  if (status != RIM_OK)
    return status;
  const uint64_t t_us = rimi_be_u64(in + 8);
  const uint8_t *at = get_u32(in + 16, &out->sequence);
  at = get_u32(at, &out->count);
  get_f64(at, out->value, RIM_OBSERVATION_MAX_VALUES);
  /* Two's complement by bits: a conversion of a large unsigned value is left to the compiler. */
  memcpy(&out->t_us, &t_us, sizeof t_us);
  return out->count >= 1 && out->count <= RIM_OBSERVATION_MAX_VALUES ? RIM_OK : RIM_E_RANGE;
}

rim_status rim_lcm_pack_alarm(uint8_t *out, size_t bytes, const rim_alarm *in) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_ALARM_SIZE)
    return RIM_E_SIZE;
  if (!alarm_codes_in_range(in))
    return RIM_E_RANGE;
  if (!alarm_is_finite(in))
    return RIM_E_DATA;
  const rim_region *region = &in->region;
  uint8_t *at = rimi_be_put_u64(out, HASH_ALARM);
  at = put_f64(at, &in->t_s, 1);
  at = put_f64(at, &in->since_s, 1);
  at = rimi_be_put_u32(at, in->seq);
  at = rimi_be_put_u32(at, in->model_id);
  at = rimi_be_put_u32(at, in->observations);
  at = put_u16s(put_alarm_codes(at, in), in->channel, RIM_ALARM_MAX_CHANNELS);
  at = put_f64(at, in->shift, RIM_ALARM_MAX_CHANNELS);
  at = put_f64(at, in->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = put_u16s(at, region->feature, RIM_REGION_MAX_DIMS);
  at = put_f64(at, region->center, RIM_REGION_MAX_DIMS);
  at = put_f64(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = put_f64(at, region->lower, RIM_REGION_MAX_DIMS);
  at = put_f64(at, region->upper, RIM_REGION_MAX_DIMS);
  at = put_f64(at, &in->ln_anom, 1);
  at = put_f64(at, &in->threshold, 1);
  at = put_f64(at, &in->p_value, 1);
  put_f64(at, &in->since_sd_s, 1);
  return RIM_OK;
}

rim_status rim_lcm_unpack_alarm(rim_alarm *out, const uint8_t *in, size_t bytes) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  const bool first = bytes >= 8 && rimi_be_u64(in) == HASH_ALARM_1;
  const rim_status status =
      first ? check_message(out, in, bytes, ALARM_1_SIZE, HASH_ALARM_1)
            : check_message(out, in, bytes, RIM_LCM_ALARM_SIZE, HASH_ALARM);
  if (status != RIM_OK)
    return status;
  rim_region *region = &out->region;
  const uint8_t *at = get_f64(in + 8, &out->t_s, 1);
  at = get_f64(at, &out->since_s, 1);
  at = get_u32(at, &out->seq);
  at = get_u32(at, &out->model_id);
  at = get_u32(at, &out->observations);
  at = get_u16s(get_alarm_codes(at, out), out->channel, RIM_ALARM_MAX_CHANNELS);
  at = get_f64(at, out->shift, RIM_ALARM_MAX_CHANNELS);
  at = get_f64(at, out->shift_sd, RIM_ALARM_MAX_CHANNELS);
  at = get_u16s(at, region->feature, RIM_REGION_MAX_DIMS);
  at = get_f64(at, region->center, RIM_REGION_MAX_DIMS);
  at = get_f64(at, region->inverse_shape, RIM_REGION_MAX_DIMS * RIM_REGION_MAX_DIMS);
  at = get_f64(at, region->lower, RIM_REGION_MAX_DIMS);
  at = get_f64(at, region->upper, RIM_REGION_MAX_DIMS);
  at = get_f64(at, &out->ln_anom, 1);
  at = get_f64(at, &out->threshold, 1);
  at = get_f64(at, &out->p_value, 1);
  out->since_sd_s = 0.0;
  if (!first)
    get_f64(at, &out->since_sd_s, 1);
  return check_alarm(out);
}

rim_status rim_lcm_pack_health(uint8_t *out, size_t bytes, const rim_health_message *in) {
  if (out == NULL || in == NULL)
    return RIM_E_ARGUMENT;
  if (bytes < RIM_LCM_HEALTH_SIZE)
    return RIM_E_SIZE;
  if (in->level > RIM_LEVEL_STALE)
    return RIM_E_RANGE;
  uint8_t *at = rimi_be_put_u64(out, HASH_HEALTH);
  at = put_f64(at, &in->t_s, 1);
  at = rimi_be_put_u32(at, in->sequence);
  at = rimi_be_put_u32(at, in->model_id);
  at = rimi_be_put_u32(at, in->observations);
  at = rimi_be_put_u32(at, in->rejected);
  at = rimi_be_put_u32(at, in->gaps);
  at = rimi_be_put_u32(at, in->alarms);
  at = rimi_be_put_u32(at, in->dropped);
  at[0] = in->level;
  at[1] = in->flags;
  return RIM_OK;
}

rim_status rim_lcm_unpack_health(rim_health_message *out, const uint8_t *in, size_t bytes) {
  const rim_status status = check_message(out, in, bytes, RIM_LCM_HEALTH_SIZE, HASH_HEALTH);
  if (status != RIM_OK)
    return status;
  const uint8_t *at = get_f64(in + 8, &out->t_s, 1);
  at = get_u32(at, &out->sequence);
  at = get_u32(at, &out->model_id);
  at = get_u32(at, &out->observations);
  at = get_u32(at, &out->rejected);
  at = get_u32(at, &out->gaps);
  at = get_u32(at, &out->alarms);
  at = get_u32(at, &out->dropped);
  out->level = at[0];
  out->flags = at[1];
  if (out->level > RIM_LEVEL_STALE)
    return RIM_E_RANGE;
  return rimi_is_finite(out->t_s) ? RIM_OK : RIM_E_DATA;
}
