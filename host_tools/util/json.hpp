// SPDX-License-Identifier: MIT
// util/json.hpp - JSON values (nlohmann/json, keys in the order in which they were set), read and
// written in one source: the parser and the writer are what compiles slowly.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace rim {

using Json = nlohmann::ordered_json;

// The value that a text holds; is_discarded() where the text is not JSON. Throws for no text.
Json parse_json(const std::string &text);

// indent: spaces per level; -1 writes one line. Bytes that are not UTF-8 throw
// nlohmann::json::type_error, or become U+FFFD with `replace`.
std::string json_text(const Json &value, int indent = -1, bool replace = false);

} // namespace rim
