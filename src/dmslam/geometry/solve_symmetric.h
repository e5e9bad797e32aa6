#pragma once

#include <Eigen/Core>
#include <optional>

namespace dmslam {

// Small matrices. Eigen's decompositions of fixed size take three to ten seconds to compile for each size and
// in each file; here they are compiled once for all sizes, with room for the largest (nothing is allocated).

/// Solves A x = b for a symmetric positive (or negative) semidefinite A, by L D L^T with pivoting; along what
/// A says nothing of, x is zero. For sizes 3 to 7.
template <int kSize, int kColumns>
Eigen::Matrix<double, kSize, kColumns> SolveSymmetric(const Eigen::Matrix<double, kSize, kSize>& A,
                                                      const Eigen::Matrix<double, kSize, kColumns>& b);

/// Inverse of a symmetric positive definite matrix; none if it is not. For sizes 3 and 6.
template <int kSize>
std::optional<Eigen::Matrix<double, kSize, kSize>> InverseOfPositive(
    const Eigen::Matrix<double, kSize, kSize>& A);

/// Inverse of any matrix, by L U with pivots; not finite where there is none.
Eigen::Matrix<double, 6, 6> InverseOf(const Eigen::Matrix<double, 6, 6>& A);

}  // namespace dmslam
