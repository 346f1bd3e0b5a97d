// SPDX-License-Identifier: MIT
#include "stats/orthogonal.hpp"

// What the other sources leave to this one.
#define RIM_EIGEN_KERNEL
#include "stats/eigen_kernels.hpp"

#include <Eigen/QR>

namespace rim {

Eigen::MatrixXd orthonormal_basis(const Eigen::MatrixXd &a) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(a);
  return qr.householderQ() * Eigen::MatrixXd::Identity(a.rows(), a.cols());
}

Eigen::VectorXd in_orthonormal_basis(const Eigen::MatrixXd &a, const Eigen::VectorXd &y) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(a);
  return qr.householderQ().transpose() * y;
}

} // namespace rim
