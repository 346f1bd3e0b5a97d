// SPDX-License-Identifier: MIT
// diagnose/late.hpp - what comes late: columns delayed, through a first-order lag, through play
// or held.
#pragma once

#include <vector>

#include "diagnose/term.hpp"

namespace rim::diagnose {

// The value of a moment earlier in the same log, between two rows by a straight line, which is the
// best guess inside a short gap too; the log's first row before its beginning, the last one before
// it inside a long gap. O(rows).
Vector delayed(const Vector &x, const Measured &measured, double delay_s);

// Through a first-order lag, each log from its own first value. O(rows).
Vector through_lag(const Vector &x, const Measured &measured, double lag_s);

// What springs keep of a motion that slip when they are drawn by their limit, of which there are
// as many of every limit up to `reach`: at most about half of it, whichever way the motion came
// (Iwan's model, Prandtl and Ishlinskii's operator). A log begins with none drawn. O(rows).
Vector held_within(const Vector &x, const Measured &measured, double reach);

// The one column of a delay, a lag or play (remembers(term)) for each of these shapes in place of
// the term's own: rows x shapes. Of a thinned table what is late is looked up in the whole one.
// O(rows of the whole x shapes), but what the shapes share is computed once. DataError: an argument
// is not in the table, a parameter is missing.
Eigen::MatrixXd late_columns(const Term &term, const std::vector<std::vector<Parameter>> &shapes,
                             const Measured &measured, const Vector &m);

} // namespace rim::diagnose
