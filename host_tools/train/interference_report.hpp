// SPDX-License-Identifier: MIT
// train/interference_report.hpp - rim train --interference: from logs and times of interference to
// the sections of a flight image that watches for it.
#pragma once

#include <string>
#include <vector>

#include "image/image_writer.hpp"
#include "train/interference.hpp"
#include "interference/detector.h"

namespace rim {

// Labels by the log's path or, where none has it, its file name; a log without labels is a control
// run. wheels: of the robot, for logs with encoder counters; null: those are refused. Prints what
// was learned and, leaving one out, what is found. model: the flight image to put it into; empty:
// out holds RIM_SECTION_INTERFERENCE alone, for rimi_interference_of_image. Throws DataError: see
// interference_run and InterferenceTrainer; labels of a log that is not among those given; an image
// that does not know the columns.
void train_interference(const std::vector<Log> &logs, const std::string &labels,
                        const rim_wheels *wheels, const std::string &model, const std::string &out);

// The image that watches for interference too: command u.vx_mps, speed s.vx_mps or z.vx_mps among
// its features and outcomes. DataError "NAME: reason".
std::vector<std::uint8_t> with_interference(const LoadedImage &image,
                                            const rim_interference_model &model,
                                            const std::string &name);

} // namespace rim
