// SPDX-License-Identifier: MIT
#include "util/json.hpp"

namespace rim {

Json parse_json(const std::string &text) { return Json::parse(text, nullptr, false); }

std::string json_text(const Json &value, int indent, bool replace) {
  return value.dump(indent, ' ', false,
                    replace ? Json::error_handler_t::replace : Json::error_handler_t::strict);
}

} // namespace rim
