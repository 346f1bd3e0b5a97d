// SPDX-License-Identifier: MIT
// log/derive.hpp - what a schema makes of the rows once they are read.
#pragma once

#include "log/log.hpp"
#include "log/schema.hpp"

namespace rim {

// Appends the derived columns. sources: rows of the log x schema.derive. Rows before the first full
// window are left out and counted in rows_filtered. O(rows x rows in a window).
void derive_columns(Log &log, const Matrix &sources, const Schema &schema);

// Rows on the grid of schema.resample_hz (0: as they are), held or interpolated; no rows inside
// gaps longer than max_gap_s. row[] is that of the newest file row used.
void resample(Log &log, const Schema &schema);

} // namespace rim
