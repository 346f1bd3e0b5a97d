// SPDX-License-Identifier: MIT
// report/show.hpp - what a file holds, in words and as JSON: rim show.
#pragma once

#include <string>

#include "log/log.hpp"

namespace rim {

enum class FileKind { image, alarms, diagnosis, extension, log };

struct Shown {
  std::string json; // one object, indented by one; always with "kind" and "path"
  std::string text; // in words; ends in a line end
};

// By the file's first bytes; what is nothing else is taken for a log. DataError: it cannot be read.
FileKind kind_of_file(const std::string &path);

// DataError: the file is damaged, or not of this kind.
Shown show_image(const std::string &path);
Shown show_image_bytes(const std::vector<std::uint8_t> &image, const std::string &name);
Shown show_alarms(const std::string &path);
Shown show_diagnosis(const std::string &path);
Shown show_extension(const std::string &path);
Shown show_log(const Log &log);

} // namespace rim
