// SPDX-License-Identifier: MIT
// report/output_folder.hpp - a folder of results that appears whole under its name or not at all.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace rim::diagnose {

// Names of the files a diagnosis leaves: a folder that holds only these, diagnosis.json among them,
// is an earlier diagnosis and may be replaced.
extern const std::vector<std::string> kOutputNames;

// DataError (path, reason) when `folder` may not be written: it is a file, the current folder, or
// holds anything but an earlier diagnosis. Call it before the hours of work, too.
void check_output_folder(const std::string &folder);

// Writes the (name, content) pairs into FOLDER.tmp.PID beside FOLDER, on the disk before anything
// is renamed, and puts it in FOLDER's place: one rename, or one exchange with an earlier diagnosis.
// On DataError (path, reason) FOLDER is as it was and nothing is left beside it.
void write_output_folder(const std::vector<std::pair<std::string, std::string>> &files,
                         const std::string &folder);

} // namespace rim::diagnose
