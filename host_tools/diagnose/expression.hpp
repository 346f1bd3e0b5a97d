// SPDX-License-Identifier: MIT
// diagnose/expression.hpp - a formula where no named form explains: sums of products of powers,
// roots, exponentials, waves and magnitudes of up to three features.
//
// By description length, in the currency of diagnose/sets.hpp: every product pays ln of the
// features, of the functions and of the widths it was chosen from, and k/2 ln n for its numbers.
#pragma once

#include <string>
#include <vector>

#include "diagnose/model.hpp"

namespace rim::diagnose {

struct Expression {
  Member member;      // cause `unknown`, form `expression`, a basis for each product; without sizes
  double score = 0.0; // nats, of this and what is kept, by `noise`
};

// The best formulas for y (in stated sd) beside what is kept, best first; another feature or
// function in the largest product makes another formula. Some 1200 rows are scanned, all are
// fitted. O(rows x functions^2): some tenths of a second.
std::vector<Expression> find_expressions(const Measured &measured, const Channel &channel,
                                         const Vector &y, const std::vector<Member> &kept,
                                         const Noise &noise);

} // namespace rim::diagnose
