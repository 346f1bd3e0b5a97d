// SPDX-License-Identifier: MIT
#include "image/facts.hpp"

#include "base/bytes.h"
#include "image/flight_image.hpp"
#include "monitor/inspect.h"
#include "rim/image.h"

extern "C" {
#include "monitor/blocks.h"
}

namespace rim {

const char *section_name(std::uint32_t id) {
  switch (id) {
  case RIM_SECTION_CONFIG:
    return "configuration";
  case RIM_SECTION_LEVEL:
    return "model: outcomes from the other sensors";
  case RIM_SECTION_QUADRATIC:
    return "model: outcomes from products of readings";
  case RIM_SECTION_BASIS:
    return "inputs of the models";
  case RIM_SECTION_BEHAVIOUR:
    return "model: outcomes from the commands";
  case RIM_SECTION_AGREEMENT:
    return "model: agreement between outcomes";
  case RIM_SECTION_NOISE:
    return "noise of healthy runs";
  case RIM_SECTION_CUTS:
    return "features' bins";
  case RIM_SECTION_THRESHOLD:
    return "thresholds";
  case RIM_SECTION_FEATURES:
    return "features' ranges";
  case RIM_SECTION_REGION:
    return "features of regions";
  case RIM_SECTION_OUTCOMES:
    return "outcomes";
  case RIM_SECTION_COMMANDS:
    return "commands";
  case RIM_SECTION_NAMES:
    return "names";
  case RIM_SECTION_CORRECT:
    return "corrections of the predictions";
  case RIM_SECTION_SCALES:
    return "factors of the residuals";
  case RIM_SECTION_INTERFERENCE:
  case RIM_SECTION_INTERFERENCE_INPUTS:
    return "motion interference";
  default:
    return "other";
  }
}

namespace {

void read_ranges(const rim_image &image, ImageFacts *facts) {
  const std::uint8_t *data = nullptr;
  std::size_t bytes = 0;
  const std::size_t n = facts->layout.features();
  if (rim_image_section(&image, RIM_SECTION_FEATURES, &data, &bytes) == RIM_OK && bytes >= 8 * n) {
    for (std::size_t f = 0; f < n; ++f) {
      facts->low.push_back(static_cast<double>(rimi_le_f32(data, f)));
      facts->high.push_back(static_cast<double>(rimi_le_f32(data, n + f)));
    }
  }
  if (rim_image_section(&image, RIM_SECTION_REGION, &data, &bytes) == RIM_OK)
    for (std::size_t i = 0; 4 * i + 3 < bytes; ++i)
      facts->region.push_back(rimi_le_u16(data, 2 * i));
}

} // namespace

ImageFacts facts_of_image(const std::vector<std::uint8_t> &bytes, const std::string &name) {
  const Monitor monitor(bytes, name); // validates the whole of it
  const rim_image &image = monitor.image();
  const auto word = [&](std::uint32_t w) { return rim_monitor_config(monitor.get(), w); };
  ImageFacts facts;
  facts.model_id = image.model_id;
  facts.major = image.major;
  facts.minor = image.minor;
  facts.layout = layout_of_image(image);
  facts.names = names_of_image(image, name);
  read_ranges(image, &facts);
  facts.period_s = 1e-6 * word(RIM_CONFIG_PERIOD_US);
  facts.block_rows = word(RIM_CONFIG_BLOCK_ROWS);
  facts.stale_s = 1e-3 * word(RIM_CONFIG_STALE_MS);
  facts.persistence = word(RIM_CONFIG_PERSISTENCE);
  const rim_threshold *threshold = rimi_monitor_threshold(monitor.get());
  facts.runs = threshold->runs;
  facts.promised_rate = threshold->promised_rate;
  facts.alarm_score = threshold->alarm_score;
  facts.warn_score = threshold->warn_score;
  for (std::uint32_t id = 1; id < 256; ++id) {
    std::size_t size = 0;
    if (rim_image_section(&image, id, nullptr, &size) == RIM_OK)
      facts.sections.push_back({section_name(id), size});
  }
  facts.bytes = image.bytes;
  facts.monitor_bytes = monitor.bytes();
  return facts;
}

double range_margin(const ImageFacts &facts, std::size_t feature) {
  return BLOCKS_LIMIT_MARGIN * (facts.high[feature] - facts.low[feature]);
}

} // namespace rim
