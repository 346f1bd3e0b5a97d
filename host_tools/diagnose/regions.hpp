// SPDX-License-Identifier: MIT
// diagnose/regions.hpp - where the residuals of a channel shift together, before asking why.
#pragma once

#include <vector>

#include "diagnose/diagnosis.hpp"
#include "diagnose/measured.hpp"

namespace rim::diagnose {

// Several regions at once by rimi_dmaps_find (Alg. 3, p. 33; candidates by FS-RIM, Alg. 4, p. 50):
// each row explained once, a region only where its ln anom pays its price. `used`: rows that are
// measurements; `divisor`: by which a log likelihood ratio is thinned. Of more than some 2500 rows
// every k-th is looked at: neighbours say the same. Seconds for 2500 rows of 20 features: under 1.
std::vector<ResidualRegion> find_regions(const Measured &measured, const Channel &channel,
                                         const Vector &used, double divisor);

} // namespace rim::diagnose
