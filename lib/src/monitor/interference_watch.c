/* SPDX-License-Identifier: MIT */
#include "monitor/interference_watch.h"

#include "base/bytes.h"
#include "base/real.h"

#define INPUTS_BYTES 4u /* u16 feature of the command, u16 outcome of the speed */
#define INHIBIT_S 1.0   /* updates of an interference come no more often */

rim_alarm_slot_config rimi_interference_watch_life(const rim_alarm_slot_config *regions) {
  /* The detector has persistence and hysteresis of its own: raised and cleared at once. */
  const rim_alarm_slot_config config = {.raise_steps = 1,
                                        .clear_steps = 1,
                                        .inhibit_s = rimi_max(INHIBIT_S, regions->inhibit_s),
                                        .update_ratio = regions->update_ratio};
  return config;
}

rim_status rimi_interference_watch_check(const rim_image *image, size_t features, size_t outcomes,
                                         bool *present) {
  const uint8_t *model_data = NULL, *inputs = NULL;
  size_t model_bytes = 0, inputs_bytes = 0;
  const bool has_model =
      rim_image_section(image, RIM_SECTION_INTERFERENCE, &model_data, &model_bytes) == RIM_OK;
  const bool has_inputs =
      rim_image_section(image, RIM_SECTION_INTERFERENCE_INPUTS, &inputs, &inputs_bytes) == RIM_OK;
  *present = has_model && has_inputs;
  if (!has_model && !has_inputs)
    return RIM_OK;
  if (!*present || inputs_bytes != INPUTS_BYTES)
    return RIM_E_CONFIG;
  if (rimi_le_u16(inputs, 0) >= features || rimi_le_u16(inputs, 1) >= outcomes)
    return RIM_E_RANGE;
  rim_interference_model model;
  return rimi_interference_open(&model, model_data, model_bytes);
}

void rimi_interference_watch_init(interference_watch *watch, const rim_image *image) {
  const uint8_t *inputs = NULL;
  size_t bytes = 0;
  (void)rim_image_section(image, RIM_SECTION_INTERFERENCE_INPUTS, &inputs, &bytes);
  rim_interference_model model;
  (void)rimi_interference_of_image(&model, image);
  (void)rimi_interference_init(&watch->state, &model);
  watch->model_id = image->model_id;
  watch->command = rimi_le_u16(inputs, 0);
  watch->speed = rimi_le_u16(inputs, 1);
  watch->external = rim_image_section(image, RIM_SECTION_OUTCOMES, &inputs, &bytes) != RIM_OK;
  watch->speed_feature = watch->external ? 0 : rimi_le_u16(inputs, watch->speed);
}

void rimi_interference_watch_reset(interference_watch *watch) {
  rimi_interference_reset(&watch->state);
}

bool rimi_interference_watch_step(interference_watch *watch, const rim_observation *row,
                                  rim_interference_verdict *verdict, rim_alarm *candidate) {
  const double speed =
      watch->external ? row->outcome[watch->speed] : row->context[watch->speed_feature];
  (void)rimi_interference_step(&watch->state, row->t_s, row->context[watch->command], speed,
                               verdict);
  return verdict->valid &&
         rimi_interference_alarm(verdict, watch->model_id, watch->speed, candidate);
}
