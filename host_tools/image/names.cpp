// SPDX-License-Identifier: MIT
#include "image/names.hpp"

#include <algorithm>

#include "image/image_writer.hpp"
#include "log/log.hpp"
#include "util/error.hpp"

#include "base/bytes.h"
#include "rim/image.h"
#include "rim/monitor.h"

namespace rim {

namespace {

Quantity one_of(const std::vector<Quantity> &list, std::size_t index, const char *what) {
  if (index < list.size())
    return list[index];
  const std::string made = std::string(what) + " " + std::to_string(index);
  return {made, made, ""};
}

// A speed that was commanded and the speed that is measured are two things of one name.
void tell_apart(Names *names) {
  for (Quantity &feature : names->features) {
    const auto same = [&](const Quantity &other) {
      return other.words == feature.words && other.name != feature.name;
    };
    if (feature.name.rfind("u.", 0) == 0 &&
        (std::any_of(names->outcomes.begin(), names->outcomes.end(), same) ||
         std::any_of(names->features.begin(), names->features.end(), same)))
      feature.words = "commanded " + feature.words;
  }
}

} // namespace

Quantity quantity_of(const std::string &column_name) {
  return {column_name, plain_name(column_name), unit_of_name(column_name)};
}

Quantity Names::feature(std::size_t index) const { return one_of(features, index, "feature"); }
Quantity Names::outcome(std::size_t index) const { return one_of(outcomes, index, "outcome"); }

Names names_of_image(const rim_image &image, const std::string &name) {
  const std::uint8_t *config = nullptr, *text = nullptr;
  std::size_t config_bytes = 0, text_bytes = 0;
  Names names;
  if (rim_image_section(&image, RIM_SECTION_NAMES, &text, &text_bytes) != RIM_OK)
    return names;
  if (rim_image_section(&image, RIM_SECTION_CONFIG, &config, &config_bytes) != RIM_OK ||
      config_bytes < 4 * RIM_CONFIG_WORDS)
    throw DataError(name + ": has no configuration");
  const std::size_t features = rimi_le_u32(config, RIM_CONFIG_FEATURES);
  const std::size_t outcomes = rimi_le_u32(config, RIM_CONFIG_OUTCOMES);
  names.external = rimi_le_u32(config, RIM_CONFIG_EXTERNAL) != 0;
  std::size_t found = 0;
  const std::string all(reinterpret_cast<const char *>(text), text_bytes);
  for (std::size_t at = 0, end; (end = all.find('\n', at)) != std::string::npos; at = end + 1) {
    (found < features ? names.features : names.outcomes)
        .push_back(quantity_of(all.substr(at, end - at)));
    found++;
  }
  if (found != features + outcomes)
    throw DataError(name + ": holds " + std::to_string(found) + " names for " +
                    std::to_string(features) + " features and " + std::to_string(outcomes) +
                    " outcomes");
  tell_apart(&names);
  return names;
}

Names names_of_model(const std::string &path) {
  const LoadedImage image = load_image(path);
  return names_of_image(image.view(), path);
}

} // namespace rim
