// train/interference_report.hpp - rim train --interference: from logs and times of interference to
// a flight image with the one section RIM_INTERFERENCE_SECTION.
#pragma once

#include <string>
#include <vector>

#include "train/interference.hpp"

namespace rim {

// Labels by the log's path or, where none has it, its file name; a log without labels is a control
// run. Prints what was learned and, leaving one out, what is found. Throws DataError: see
// interference_run and InterferenceTrainer; labels of a log that is not among those given.
void train_interference(const std::vector<Log> &logs, const std::string &labels,
                        const std::string &out);

} // namespace rim
