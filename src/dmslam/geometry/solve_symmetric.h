#pragma once

#include <Eigen/Core>

namespace dmslam {

/// Solves A x = b for a symmetric positive (or negative) semidefinite A, by Eigen's LDLT with pivoting. Only
/// for the sizes below: they are compiled once, in solve_symmetric.cc, for each takes seconds to compile.
template <int kSize, int kColumns>
Eigen::Matrix<double, kSize, kColumns> SolveSymmetric(const Eigen::Matrix<double, kSize, kSize>& A,
                                                      const Eigen::Matrix<double, kSize, kColumns>& b);

extern template Eigen::Matrix<double, 3, 1> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                           const Eigen::Matrix<double, 3, 1>&);
extern template Eigen::Matrix<double, 3, 2> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                           const Eigen::Matrix<double, 3, 2>&);
extern template Eigen::Matrix<double, 5, 1> SolveSymmetric(const Eigen::Matrix<double, 5, 5>&,
                                                           const Eigen::Matrix<double, 5, 1>&);
extern template Eigen::Matrix<double, 6, 1> SolveSymmetric(const Eigen::Matrix<double, 6, 6>&,
                                                           const Eigen::Matrix<double, 6, 1>&);
extern template Eigen::Matrix<double, 7, 1> SolveSymmetric(const Eigen::Matrix<double, 7, 7>&,
                                                           const Eigen::Matrix<double, 7, 1>&);

}  // namespace dmslam
