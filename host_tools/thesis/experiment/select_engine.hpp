// SPDX-License-Identifier: MIT
// thesis/experiment/select_engine.hpp - the library's online region search in memory of its own.
#pragma once

#include <cstdint>
#include <vector>

#include "search/select.h"

namespace rim {

class SelectEngine {
public:
  // Throws UsageError where the search cannot be that large or that small, logic_error where it
  // refuses the rest of its configuration.
  explicit SelectEngine(const rim_select_config &config);
  rim_select *get() const { return engine_; }

private:
  std::vector<std::uint64_t> memory_; // where it is stays the same when this is moved
  rim_select *engine_ = nullptr;
};

} // namespace rim
