/* SPDX-License-Identifier: MIT */
/* fuzz_decoders.h - every decoder of what comes from a bus or a file, behind one function of bytes.
 *
 * The first byte chooses the decoder, the rest is its input, in memory of exactly that size, so
 * that the address sanitizer sees a byte too far. What is accepted is used: packed again, or shown.
 */
#ifndef FUZZ_DECODERS_H
#define FUZZ_DECODERS_H

#include "fuzz_repaired.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "image/basis.h"
#include "image/correct.h"
#include "image/noise.h"
#include "image/nominal.h"
#include "image/quadratic.h"
#include "image/rolled.h"
#include "image/threshold.h"
#include "rim/can.h"
#include "rim/can_table.h"
#include "rim/image.h"
#include "rim/monitor.h"
#include "rim/plan/lookahead.h"
#include "rimd/config.h"
#include "transport/lcm_packet.h"
#include "transport/lcm_udp.h"

/* An accepted message must pack again. */
static inline void fuzz_must(bool good) {
  if (!good)
    abort();
}

static inline void fuzz_lcm(const uint8_t *data, size_t bytes) {
  static uint8_t out[8192];
  static rim_observation_message observation;
  static rim_plan plan;
  static rim_model_message model;
  rim_alarm alarm;
  rim_health_message health;
  rim_command command;
  rim_counters counters;
  rim_entry entry;
  if (rim_lcm_unpack_observation(&observation, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_observation(out, sizeof out, &observation) == RIM_OK);
  if (rim_lcm_unpack_alarm(&alarm, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_alarm(out, sizeof out, &alarm) == RIM_OK &&
              (bytes < RIM_LCM_ALARM_SIZE || memcmp(out, data, bytes) == 0));
  if (rim_lcm_unpack_health(&health, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_health(out, sizeof out, &health) == RIM_OK);
  if (rim_lcm_unpack_command(&command, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_command(out, sizeof out, &command) == RIM_OK);
  if (rim_lcm_unpack_counters(&counters, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_counters(out, sizeof out, &counters) == RIM_OK);
  if (rim_lcm_unpack_entry(&entry, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_entry(out, sizeof out, &entry) == RIM_OK);
  if (rim_lcm_unpack_model(&model, data, bytes) == RIM_OK)
    fuzz_must(strlen(model.quantity[0].name) < RIM_MODEL_NAME_BYTES &&
              model.first + model.count <= model.features + model.outcomes);
  if (rim_lcm_unpack_plan(&plan, data, bytes) == RIM_OK)
    fuzz_must(rim_lcm_pack_plan(out, sizeof out, &plan) == RIM_OK);
}

static inline void fuzz_packet(const uint8_t *data, size_t bytes) {
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  if (lcm_packet_open(data, bytes, &channel, &payload, &payload_bytes) != LCM_PACKET_MESSAGE)
    return;
  fuzz_must(strlen(channel) > 0 && strlen(channel) <= LCM_PACKET_MAX_CHANNEL &&
            payload + payload_bytes == data + bytes);
  fuzz_lcm(payload, payload_bytes);
}

/* Frames one after another: identifier (2), length and FD (1), data. */
static inline bool fuzz_next_frame(const uint8_t **data, size_t *bytes, rim_can_frame *frame) {
  memset(frame, 0, sizeof *frame);
  if (*bytes < 3)
    return false;
  frame->id = (uint32_t)((*data)[0] | (*data)[1] << 8) & 0x7ffu;
  frame->fd = ((*data)[2] & 0x80) != 0;
  const size_t most = frame->fd ? 64 : 8;
  size_t length = (*data)[2] & 0x7fu;
  length = length < most ? length : most;
  if (*bytes - 3 < length)
    return false;
  frame->length = (uint8_t)length;
  memcpy(frame->data, *data + 3, length);
  *data += 3 + length;
  *bytes -= 3 + length;
  return true;
}

static inline void fuzz_can(const uint8_t *data, size_t bytes) {
  rim_can_assembly assembly = {.node = 1};
  static rim_can_frame packed[RIM_CAN_DETAIL_FRAMES];
  rim_can_frame frame;
  rim_can_summary summary;
  rim_can_heartbeat heartbeat;
  rim_command command;
  rim_can_finding finding;
  rim_entry entry;
  rim_alarm alarm;
  bool complete;
  while (fuzz_next_frame(&data, &bytes, &frame)) {
    (void)rim_can_unpack_summary(&summary, &frame);
    (void)rim_can_unpack_heartbeat(&heartbeat, &frame);
    (void)rim_can_unpack_finding(&finding, &frame);
    (void)rim_can_unpack_command(&command, 1, &frame);
    if (rim_can_unpack_entry(&entry, &frame) == RIM_OK)
      fuzz_must(rim_can_pack_entry(packed, frame.id - RIM_CAN_ENTRY_ID, &entry) == RIM_OK);
    if (rim_can_unpack_detail_fd(&alarm, &frame) == RIM_OK)
      fuzz_must(rim_can_pack_detail(packed, 1, &alarm) == RIM_OK);
    if (rim_can_take_detail(&assembly, &frame, &alarm, &complete) == RIM_OK && complete)
      fuzz_must(rim_can_pack_detail(packed, 1, &alarm) == RIM_OK);
  }
}

/* A table, its length first (2 bytes), then frames for it. */
static inline void fuzz_table(const uint8_t *data, size_t bytes) {
  static rim_can_gather gather;
  rim_can_table table;
  rim_can_frame frame;
  if (bytes < 2)
    return;
  const size_t length = (size_t)(data[0] | data[1] << 8);
  if (length > bytes - 2 || rim_can_table_open(&table, data + 2, length) != RIM_OK)
    return;
  memset(&gather, 0, sizeof gather);
  const uint8_t *rest = data + 2 + length;
  size_t rest_bytes = bytes - 2 - length;
  double t_s = 0.0, row_s;
  bool complete;
  while (fuzz_next_frame(&rest, &rest_bytes, &frame))
    (void)rim_can_gather_frame(&gather, &table, &frame, t_s += 0.1, 1.0, &complete, &row_s);
}

static inline void fuzz_image(const uint8_t *data, size_t bytes) {
  rim_image view;
  size_t need;
  (void)rim_image_open(&view, data, bytes);
  (void)rim_monitor_size(data, bytes, &need);
}

/* A state stays within its limits, whatever rates a damaged image has. */
static inline void fuzz_rolled(const rim_basis *basis) {
  static const double filter[BASIS_MAX_INPUTS * BASIS_MAX_TIMES] = {1.0, -1e9, 1e9};
  double state[BASIS_MAX_STATES] = {0.0}, part[BASIS_MAX_RATES];
  rimi_rolled_begin(basis, filter, 1.0, state, part);
  rimi_rolled_step(basis, filter, 0.5, 1.0, 1.0, state, part);
  for (size_t s = 0; s < basis->states; ++s)
    fuzz_must(state[s] >= (double)rimi_le_f32(basis->limit, 2 * s) &&
              state[s] <= (double)rimi_le_f32(basis->limit, 2 * s + 1));
  for (size_t i = 0; i < basis->terms; ++i) {
    if (rimi_le_u16(basis->term, 4 * i) == BASIS_ROLLED)
      (void)rimi_rolled_term(basis, i, filter, state);
  }
}

/* The sections of a trained image of 4 features and 2 outcomes. */
static inline void fuzz_trained(const uint8_t *data, size_t bytes) {
  static double term[BASIS_MAX_TERMS], first[2], predicted[4];
  rim_basis basis;
  rim_behaviour behaviour;
  rim_agreement agreement;
  rim_noise noise;
  if (rimi_basis_open(&basis, data, bytes, 4, 2) == RIM_OK) {
    fuzz_must(basis.terms <= BASIS_MAX_TERMS && basis.means <= BASIS_MAX_MEANS);
    fuzz_rolled(&basis);
  }
  if (rimi_behaviour_open(&behaviour, data, bytes, 1, 2) == RIM_OK)
    rimi_behaviour_predict(&behaviour, term, first, predicted);
  if (rimi_agreement_open(&agreement, data, bytes, 4, 2, 1) == RIM_OK) {
    double state[2 * AGREEMENT_STATE] = {0.0}, remains[2], expected[2];
    static const double integral[2 * AGREEMENT_INTEGRANDS];
    const agreement_block block = {.residual = first,
                                   .mean = term,
                                   .measured = first,
                                   .predicted = first,
                                   .early = integral,
                                   .late = integral,
                                   .level = first};
    rimi_agreement_evaluate(&agreement, &block, state, remains, expected);
  }
  if (rimi_noise_open(&noise, data, bytes, 8, 1) != RIM_OK)
    return;
  for (uint32_t c = 0; c < 8; ++c) {
    const noise_channel channel = rimi_noise_channel(&noise, c);
    const double w = rimi_noise_weight(&channel, 4.0, 3.0, 1.0);
    fuzz_must(channel.fields <= NOISE_MAX_FIELDS && w > 0.0 && w < 10.0);
  }
}

/* What stands behind the image's check sum: its sections, each by its own reader; what a model that
 * opens says of a context is finite. */
static inline void fuzz_sections(const uint8_t *data, size_t bytes) {
  static double x[RIM_NOMINAL_MAX_INPUTS], mean[RIM_NOMINAL_MAX_OUTPUTS],
      sd[RIM_NOMINAL_MAX_OUTPUTS];
  rim_nominal model;
  rim_threshold threshold;
  rim_correct corrected;
  static double z[2 * RIM_QUADRATIC_MAX_INPUTS];
  rim_quadratic products;
  if (rimi_nominal_open(&model, data, bytes) == RIM_OK)
    (void)rimi_nominal_predict(&model, x, mean, sd, NULL);
  const uint32_t inputs = bytes >= 8 ? rimi_le_u32(data, 1) : 0;
  if (rimi_quadratic_open(&products, data, bytes, inputs, RIM_NOMINAL_MAX_OUTPUTS) == RIM_OK) {
    rimi_quadratic_take(&products, x, true, z);
    rimi_quadratic_predict(&products, RIM_QUADRATIC_AGREES, z, mean);
    rimi_quadratic_predict(&products, RIM_QUADRATIC_STEPS, z, mean);
  }
  if (rimi_threshold_open(&threshold, data, bytes) == RIM_OK)
    (void)rimi_threshold_p_value(&threshold, 1.0);
  if (rimi_correct_open(&corrected, data, bytes) == RIM_OK &&
      corrected.features <= RIM_NOMINAL_MAX_INPUTS && corrected.outcomes <= RIM_NOMINAL_MAX_OUTPUTS)
    (void)rimi_correct_mean(&corrected, x, mean, mean);
  fuzz_trained(data, bytes);
}

/* Datagrams one after another, each behind its length (2 bytes) and sender (1). */
static inline void fuzz_fragments(const uint8_t *data, size_t bytes) {
  static lcm_fragments fragments;
  const char *channel;
  const uint8_t *payload;
  size_t payload_bytes;
  uint32_t lost = 0;
  memset(&fragments, 0, sizeof fragments);
  while (bytes >= 3) {
    size_t length = (size_t)(data[0] | data[1] << 8);
    length = length < bytes - 3 ? length : bytes - 3;
    if (lcm_fragments_take(&fragments, data[2], data + 3, length, &channel, &payload,
                           &payload_bytes, &lost) == LCM_FRAGMENTS_COMPLETE)
      fuzz_lcm(payload, payload_bytes);
    data += 3 + length;
    bytes -= 3 + length;
  }
}

static inline void fuzz_text(const uint8_t *data, size_t bytes) {
  static config c;
  lcm_udp_address address;
  char url[300];
  (void)config_parse(&c, "fuzz", (const char *)data, bytes);
  const size_t length = bytes < sizeof url - 1 ? bytes : sizeof url - 1;
  memcpy(url, data, length);
  url[length] = '\0';
  (void)lcm_udp_parse(&address, url);
}

static inline void fuzz_lookahead(const uint8_t *data, size_t bytes) {
  static const rim_lookahead_config c = {
      .axis = {0, 1, 2}, .vertices = 2, .vertex = {{1, 0, 0}, {-1, 0, 0}}};
  static rim_plan plan;
  rim_region region;
  rim_lookahead_result result;
  if (bytes < RIM_LCM_PLAN_SIZE || rim_lcm_unpack_plan(&plan, data, RIM_LCM_PLAN_SIZE) != RIM_OK)
    return;
  memset(&region, 0, sizeof region);
  if (bytes - RIM_LCM_PLAN_SIZE >= sizeof region.inverse_shape)
    memcpy(region.inverse_shape, data + RIM_LCM_PLAN_SIZE, sizeof region.inverse_shape);
  region.dims = (uint8_t)(plan.sequence % 5u);
  for (uint16_t d = 0; d < RIM_REGION_MAX_DIMS; ++d)
    region.feature[d] = d;
  (void)rim_lookahead_check(&c, &region, &plan, 0.0, &result);
}

#define FUZZ_DECODERS 12u

static inline void fuzz_one(const uint8_t *data, size_t bytes) {
  if (bytes == 0)
    return;
  const size_t rest = bytes - 1;
  uint64_t *exact = malloc(rest > 0 ? rest : 1); /* aligned as an image must be */
  if (exact == NULL)
    return;
  memcpy(exact, data + 1, rest);
  const uint8_t *in = (const uint8_t *)exact;
  switch (data[0] % FUZZ_DECODERS) {
  case 0:
    fuzz_lcm(in, rest);
    break;
  case 1:
    fuzz_packet(in, rest);
    break;
  case 2:
    fuzz_can(in, rest);
    break;
  case 3:
    fuzz_table(in, rest);
    break;
  case 4:
    fuzz_image(in, rest);
    break;
  case 5:
    fuzz_lookahead(in, rest);
    break;
  case 6:
    fuzz_text(in, rest);
    break;
  case 7:
    fuzz_fragments(in, rest);
    break;
  case 8:
    fuzz_sections(in, rest);
    break;
  case 9:
    fuzz_flight(in, rest);
    break;
  case 10:
    fuzz_state(in, rest);
    break;
  default:
    fuzz_own_sum(in, rest);
    break;
  }
  free(exact);
}

#endif
