// SPDX-License-Identifier: MIT
// diagnose/sentence.hpp - findings in words.
#pragma once

#include <string>

#include "diagnose/diagnosis.hpp"

namespace rim::diagnose {

// "Quadratic drag" of "quadratic_drag".
std::string cause_words(const std::string &cause);
std::string finding_sentence(const Finding &finding, const Channel &channel);
// Of what was seen and is not claimed, and why not.
std::string unconfirmed_sentence(const Finding &finding, const Channel &channel,
                                 const std::string &reason);
std::string diagnosis_sentence(const Diagnosis &diagnosis);

} // namespace rim::diagnose
