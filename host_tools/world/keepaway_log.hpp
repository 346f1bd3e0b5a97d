// SPDX-License-Identifier: MIT
// world/keepaway_log.hpp - passes of the keepaway world as a log, a row each.
#pragma once

#include "world/keepaway.hpp"
#include "world/recording.hpp"

namespace rim::world {

// The greedy planner of 3.5.3 with the nominal model plays.
// Columns x.ahead_m ..: eq. 3.35 of the taker that decides eq. 3.34, z.success, and by the nominal
// model m.success and sd.success (at least 0.01). Truth: a habit acted on any taker.
Recording record_keepaway(Keepaway &keepaway, const KeepawayParams &params, std::size_t passes);

} // namespace rim::world
