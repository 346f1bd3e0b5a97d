// SPDX-License-Identifier: MIT
// stats/orthogonal.hpp - what Householder's orthogonal decomposition a = Q R is used for. It is
// compiled once, here, because Eigen's templates of it take seconds in each source.
#pragma once

#include <Eigen/Core>

namespace rim {

// An orthonormal basis of the columns of a (n x k, n >= k >= 1): the first k columns of Q.
// O(n k^2).
Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd &a);

// y (n) in the coordinates of Q: its first k numbers lie in the span of the columns of a (n x k,
// n >= k >= 1), and the squares of the others sum to what least squares leave. O(n k^2).
Eigen::VectorXd in_orthonormal_basis(const Eigen::MatrixXd &a, const Eigen::VectorXd &y);

} // namespace rim
