// SPDX-License-Identifier: MIT
#include "image/flight_image.hpp"

#include <cmath>
#include <cstring>

#include "base/bytes.h"
#include "base/crc.h"
#include "image/image_writer.hpp"
#include "image/names.hpp"
#include "rim/image.h"
#include "util/error.hpp"

namespace rim {

namespace {

SectionBytes config_section(const FlightPlan &plan) {
  std::uint32_t words[RIM_CONFIG_WORDS] = {};
  words[RIM_CONFIG_FEATURES] = static_cast<std::uint32_t>(plan.layout.features());
  words[RIM_CONFIG_OUTCOMES] = static_cast<std::uint32_t>(plan.layout.outcomes());
  words[RIM_CONFIG_SMALL] = plan.small ? 1 : 0;
  words[RIM_CONFIG_BLOCK_ROWS] = plan.block_rows;
  words[RIM_CONFIG_EXTERNAL] = plan.layout.external ? 1 : 0;
  words[RIM_CONFIG_PERIOD_US] = static_cast<std::uint32_t>(std::lround(1e6 * plan.period_s));
  words[RIM_CONFIG_STALE_MS] = static_cast<std::uint32_t>(std::lround(1e3 * plan.stale_s));
  words[RIM_CONFIG_REGION_FEATURES] = static_cast<std::uint32_t>(plan.region.size());
  words[RIM_CONFIG_RING] = plan.ring;
  words[RIM_CONFIG_BINS] = plan.bins;
  words[RIM_CONFIG_GRID] = plan.grid;
  words[RIM_CONFIG_PAIRS] = plan.pairs;
  words[RIM_CONFIG_PERSISTENCE] = plan.persistence;
  words[RIM_CONFIG_CLEAR] = plan.clear;
  words[RIM_CONFIG_INHIBIT_MS] = static_cast<std::uint32_t>(std::lround(1e3 * plan.inhibit_s));
  words[RIM_CONFIG_SEED] = plan.seed;
  words[RIM_CONFIG_SCANS] = plan.scans;
  words[RIM_CONFIG_EDGES] = plan.edges;
  words[RIM_CONFIG_MOVES] = plan.moves;
  words[RIM_CONFIG_BUDGET] = plan.budget;
  SectionBytes bytes;
  for (const std::uint32_t word : words)
    bytes.u32(word);
  return bytes;
}

SectionBytes floats(const std::vector<float> &a, const std::vector<float> &b) {
  SectionBytes bytes;
  for (const float v : a)
    bytes.f32(v);
  for (const float v : b)
    bytes.f32(v);
  return bytes;
}

SectionBytes words16(const std::vector<std::uint16_t> &values) {
  SectionBytes bytes;
  for (const std::uint16_t v : values)
    bytes.u16(v);
  return bytes;
}

SectionBytes region_section(const FlightPlan &plan) {
  SectionBytes bytes;
  for (std::size_t i = 0; i < plan.region.size(); ++i) {
    bytes.u16(plan.region[i]);
    bytes.u16(plan.region_outcome.empty() ? 0xffff : plan.region_outcome[i]);
  }
  return bytes;
}

SectionBytes threshold_section(const Thresholds &t) {
  SectionBytes bytes;
  bytes.u32(static_cast<std::uint32_t>(t.offset.size()));
  bytes.u32(static_cast<std::uint32_t>(t.maxima.size()));
  bytes.u32(static_cast<std::uint32_t>(t.growth.size()));
  bytes.u32(t.rank);
  bytes.f32(t.alarm_score);
  bytes.f32(t.warn_score);
  bytes.f32(t.promised_rate);
  bytes.f32(0.0F);
  for (const auto *values : {&t.maxima, &t.growth, &t.offset, &t.scale}) {
    for (const float v : *values)
      bytes.f32(v);
  }
  return bytes;
}

SectionBytes names_section(const Layout &layout) {
  SectionBytes bytes;
  for (const auto *names : {&layout.feature_names, &layout.outcome_names}) {
    for (const std::string &name : *names) {
      for (const char letter : name)
        bytes.u8(static_cast<std::uint8_t>(letter));
      bytes.u8('\n');
    }
  }
  return bytes;
}

std::vector<std::uint8_t> write_image(const FlightPlan &plan, std::uint32_t model_id) {
  ImageWriter writer(model_id);
  writer.add_section(RIM_SECTION_CONFIG, config_section(plan));
  const auto add = [&writer](rim_section id, const std::vector<std::uint8_t> &bytes) {
    if (!bytes.empty())
      writer.add_section(id, bytes);
  };
  add(RIM_SECTION_LEVEL, plan.level);
  add(RIM_SECTION_QUADRATIC, plan.quadratic);
  if (!plan.inverse_sd.empty())
    writer.add_section(RIM_SECTION_SCALES, floats(plan.inverse_sd, {}));
  if (!plan.noise.empty()) {
    writer.add_section(RIM_SECTION_BASIS, basis_section(plan.basis));
    add(RIM_SECTION_BEHAVIOUR, plan.behaviour);
    add(RIM_SECTION_AGREEMENT, plan.agreement);
    add(RIM_SECTION_NOISE, plan.noise);
    add(RIM_SECTION_CUTS, plan.cuts);
  }
  writer.add_section(RIM_SECTION_THRESHOLD, threshold_section(plan.thresholds));
  writer.add_section(RIM_SECTION_FEATURES, floats(plan.low, plan.high));
  writer.add_section(RIM_SECTION_REGION, region_section(plan));
  if (!plan.layout.external) {
    writer.add_section(RIM_SECTION_OUTCOMES, words16(plan.layout.outcome_feature));
  }
  writer.add_section(RIM_SECTION_COMMANDS, plan.layout.command);
  writer.add_section(RIM_SECTION_NAMES, names_section(plan.layout));
  return writer.finish();
}

} // namespace

std::vector<std::uint8_t> make_image(const FlightPlan &plan) {
  const std::vector<std::uint8_t> first = write_image(plan, 0);
  return write_image(plan, rimi_crc32(0, first.data() + RIM_IMAGE_HEADER_BYTES,
                                      first.size() - RIM_IMAGE_HEADER_BYTES));
}

Layout layout_of_image(const rim_image &image) {
  const Names names = names_of_image(image, "the image");
  if (names.features.empty())
    throw DataError("the image carries no names");
  Layout layout;
  layout.external = names.external;
  for (const Quantity &feature : names.features) {
    layout.feature_names.push_back(feature.name);
    layout.feature_units.push_back(feature.unit);
  }
  for (const Quantity &outcome : names.outcomes) {
    layout.outcome_names.push_back(outcome.name);
    layout.outcome_units.push_back(outcome.unit);
  }
  std::size_t bytes = 0;
  const std::uint8_t *map = nullptr;
  if (rim_image_section(&image, RIM_SECTION_OUTCOMES, &map, &bytes) == RIM_OK) {
    for (std::size_t o = 0; o < layout.outcomes() && 2 * o + 1 < bytes; ++o) {
      layout.outcome_feature.push_back(rimi_le_u16(map, o));
    }
  }
  if (rim_image_section(&image, RIM_SECTION_COMMANDS, &map, &bytes) == RIM_OK) {
    layout.command.assign(map, map + bytes);
  }
  return layout;
}

Monitor::Monitor(std::vector<std::uint8_t> image, const std::string &name)
    : image_((image.size() + 7) / 8) {
  std::memcpy(image_.data(), image.data(), image.size());
  std::size_t need = 0;
  rim_status status = rim_monitor_size(image_.data(), image.size(), &need);
  if (status == RIM_OK) {
    memory_.resize((need + 7) / 8);
    status = rim_monitor_init(&monitor_, memory_.data(), memory_.size() * 8, image_.data(),
                              image.size());
  }
  if (status == RIM_OK) {
    (void)rim_image_open(&view_, image_.data(), image.size());
    return;
  }
  const std::string magic = RIM_IMAGE_MAGIC;
  const bool begins = std::string(image.begin(), image.end()).rfind(magic, 0) == 0;
  const char *advice = status == RIM_E_VERSION ? "; `rim train` makes it anew from its logs" : "";
  throw DataError(name + (begins ? ": not a flight image for this version: " +
                                       std::string(rim_status_text(status)) + advice
                                 : ": is no flight image (`rim train` writes one)"));
}

} // namespace rim
