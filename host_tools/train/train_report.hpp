// What training tells its user: errors in the sensors' units, choices, the promise, the image.
#ifndef RIM_TRAIN_TRAIN_REPORT_HPP
#define RIM_TRAIN_TRAIN_REPORT_HPP

#include <cstdint>
#include <string>
#include <vector>

#include "train/kernel.hpp"
#include "train/trainer.hpp"

namespace rim {

// One-step errors of the thesis's kernel average and of its prototypes on the same logs, beside
// `training`'s local-linear maps. A few seconds. Empty vectors when no one-step model was trained.
KernelReport one_step_kernels(const std::vector<Log> &logs, const Training &training);

// Tables and sentences, ready to print.
std::string error_report(const Training &training, const KernelReport &kernels);
std::string choice_report(const Training &training);
std::string promise_report(const Training &training, double false_alarm);
std::string image_report(const std::vector<std::uint8_t> &image);

} // namespace rim
#endif
