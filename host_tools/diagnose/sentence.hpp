// diagnose/sentence.hpp - findings in words.
#pragma once

#include <string>

#include "diagnose/diagnosis.hpp"

namespace rim::diagnose {

// "Quadratic drag" of "quadratic_drag".
std::string cause_words(const std::string &cause);
std::string finding_sentence(const Finding &finding, const Channel &channel);
std::string diagnosis_sentence(const Diagnosis &diagnosis);

} // namespace rim::diagnose
