// SPDX-License-Identifier: MIT
// stats/eigen_kernels.hpp - Eigen's products and decompositions of matrices of double, compiled
// once, in orthogonal.cpp. The precompiled header includes this; without it a source compiles
// them again, and the linker keeps one. Results are the same to the bit.
//
// Some of the names are Eigen's own (3.4, Debian 12). Where another release lacks one, take its
// line away: it only saves time.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#ifndef RIM_EIGEN_KERNEL
#define RIM_EIGEN_KERNEL extern
#endif

namespace Eigen {
namespace internal {
using KernelTraits = gebp_traits<double, double>;
using ColumnsIn = const_blas_data_mapper<double, long, ColMajor>;
using RowsIn = const_blas_data_mapper<double, long, RowMajor>;
using Out = blas_data_mapper<double, long, ColMajor, Unaligned, 1>;
using Blocking = level3_blocking<double, double>;
RIM_EIGEN_KERNEL template void
evaluateProductBlockingSizesHeuristic<double, double, 1, Index>(Index &, Index &, Index &, Index);
RIM_EIGEN_KERNEL template void
evaluateProductBlockingSizesHeuristic<double, double, 4, Index>(Index &, Index &, Index &, Index);
RIM_EIGEN_KERNEL template struct gebp_kernel<double, double, long, Out, KernelTraits::mr,
                                             KernelTraits::nr, false, false>;
RIM_EIGEN_KERNEL template struct gemm_pack_lhs<double, long, ColumnsIn, KernelTraits::mr,
                                               KernelTraits::LhsProgress,
                                               KernelTraits::LhsPacket4Packing, ColMajor>;
RIM_EIGEN_KERNEL template struct gemm_pack_lhs<double, long, RowsIn, KernelTraits::mr,
                                               KernelTraits::LhsProgress,
                                               KernelTraits::LhsPacket4Packing, RowMajor>;
RIM_EIGEN_KERNEL template struct gemm_pack_rhs<double, long, ColumnsIn, KernelTraits::nr, ColMajor>;
RIM_EIGEN_KERNEL template struct gemm_pack_rhs<double, long, RowsIn, KernelTraits::nr, RowMajor>;
RIM_EIGEN_KERNEL template struct gemm_pack_rhs<double, long, Out, KernelTraits::nr, ColMajor, false,
                                               true>;
RIM_EIGEN_KERNEL template struct general_matrix_vector_product<long, double, RowsIn, RowMajor,
                                                               false, double, ColumnsIn, false, 0>;
RIM_EIGEN_KERNEL template struct general_matrix_vector_product<long, double, ColumnsIn, ColMajor,
                                                               false, double, ColumnsIn, false, 0>;
RIM_EIGEN_KERNEL template struct general_matrix_vector_product<long, double, ColumnsIn, ColMajor,
                                                               false, double, RowsIn, false, 0>;
RIM_EIGEN_KERNEL template struct general_matrix_vector_product<long, double, RowsIn, RowMajor,
                                                               false, double, RowsIn, false, 0>;
RIM_EIGEN_KERNEL template struct general_matrix_matrix_product<
    long, double, ColMajor, false, double, ColMajor, false, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct general_matrix_matrix_product<
    long, double, RowMajor, false, double, ColMajor, false, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct general_matrix_matrix_product<
    long, double, ColMajor, false, double, RowMajor, false, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct triangular_solve_matrix<double, long, OnTheLeft, Lower | UnitDiag,
                                                         false, ColMajor, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct triangular_solve_matrix<double, long, OnTheLeft, Upper | UnitDiag,
                                                         false, RowMajor, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct triangular_solve_matrix<double, long, OnTheLeft, Lower, false,
                                                         ColMajor, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct triangular_solve_matrix<double, long, OnTheLeft, Upper, false,
                                                         RowMajor, ColMajor, 1>;
RIM_EIGEN_KERNEL template struct product_triangular_matrix_matrix<
    double, long, Upper, true, RowMajor, false, ColMajor, false, ColMajor, 1, 0>;
RIM_EIGEN_KERNEL template struct product_triangular_matrix_matrix<
    double, long, Upper | UnitDiag, true, RowMajor, false, ColMajor, false, ColMajor, 1, 0>;
RIM_EIGEN_KERNEL template struct product_triangular_matrix_matrix<
    double, long, Lower, true, ColMajor, false, ColMajor, false, ColMajor, 1, 0>;
RIM_EIGEN_KERNEL template struct product_triangular_matrix_matrix<
    double, long, Lower | UnitDiag, true, ColMajor, false, ColMajor, false, ColMajor, 1, 0>;
RIM_EIGEN_KERNEL template struct selfadjoint_matrix_vector_product<double, long, ColMajor, Lower,
                                                                   false, false, 0>;
RIM_EIGEN_KERNEL template ComputationInfo
computeFromTridiagonal_impl<MatrixXd, VectorXd, VectorXd>(VectorXd &, VectorXd &, const Index, bool,
                                                          MatrixXd &);
RIM_EIGEN_KERNEL template void tridiagonalization_inplace<MatrixXd, VectorXd>(MatrixXd &,
                                                                              VectorXd &);
} // namespace internal
RIM_EIGEN_KERNEL template LDLT<MatrixXd> &
LDLT<MatrixXd>::compute<MatrixXd>(const EigenBase<MatrixXd> &);
RIM_EIGEN_KERNEL template void
LDLT<MatrixXd>::_solve_impl_transposed<true, VectorXd, VectorXd>(const VectorXd &,
                                                                 VectorXd &) const;
RIM_EIGEN_KERNEL template void
LDLT<MatrixXd>::_solve_impl_transposed<true, MatrixXd, MatrixXd>(const MatrixXd &,
                                                                 MatrixXd &) const;
RIM_EIGEN_KERNEL template LLT<MatrixXd> &
LLT<MatrixXd>::compute<MatrixXd>(const EigenBase<MatrixXd> &);
RIM_EIGEN_KERNEL template void PartialPivLU<MatrixXd>::compute();
RIM_EIGEN_KERNEL template SelfAdjointEigenSolver<MatrixXd> &
SelfAdjointEigenSolver<MatrixXd>::compute<MatrixXd>(const EigenBase<MatrixXd> &, int);
using Gram = Product<Transpose<const MatrixXd>, MatrixXd, 0>;
RIM_EIGEN_KERNEL template SelfAdjointEigenSolver<MatrixXd> &
SelfAdjointEigenSolver<MatrixXd>::compute<Gram>(const EigenBase<Gram> &, int);
} // namespace Eigen
