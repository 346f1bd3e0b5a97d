// SPDX-License-Identifier: MIT
#include "thesis/experiment/select_engine.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <stdexcept>

#include "util/error.hpp"

namespace rim {

SelectEngine::SelectEngine(const rim_select_config &config) {
  std::size_t bytes = 0;
  if (rimi_select_size(&config, &bytes) != RIM_OK)
    throw UsageError(fmt::format("{} dims: the search takes 2 to 128", config.features));
  memory_.resize(bytes / 8 + 1);
  if (rimi_select_init(&engine_, memory_.data(), 8 * memory_.size(), &config) != RIM_OK)
    throw std::logic_error("the search refused its configuration");
}

} // namespace rim
