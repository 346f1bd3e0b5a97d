// SPDX-License-Identifier: MIT
// report/parts.hpp - the parts of the page that are not pictures.
#pragma once

#include <string>

#include "report/data.hpp"

namespace rim::diagnose::report {

std::string style_sheet(); // colours for day, night and paper; Okabe and Ito's, safe for the
                           // colour-blind

// What the claim's rivals explain: a row each with its bar, and what that means in a sentence.
std::string causes_table(const Finding &finding);
// The gain of every channel, set of rows and horizon as a forest plot in a table.
std::string gain_table(const Diagnosis &diagnosis);
// The one-step gain of the channels in large numbers.
std::string gain_tiles(const Diagnosis &diagnosis);
// Parameters with errors and units.
std::string parameter_table(const Term &term);
// "altitude 0 to 42 000 m, speed 760 to 940 m/s"; empty when everywhere.
std::string where_text(const Gate &gate);
// The gate: an interval a feature beside the data's range.
std::string where_table(const Finding &finding, const View &view);

} // namespace rim::diagnose::report
