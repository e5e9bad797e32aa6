#pragma once

#include <Eigen/Core>

namespace dmslam {

/// A = vectors diag(values) vectors^T of a symmetric matrix, values ascending.
template <int kSize>
struct SymmetricEigen {
  Eigen::Matrix<double, kSize, 1> values;
  Eigen::Matrix<double, kSize, kSize> vectors;
};

/// Reads the lower triangle. Compiled once, in symmetric_eigen.cc, for sizes 3, 6 and 9.
template <int kSize>
SymmetricEigen<kSize> EigenOfSymmetric(const Eigen::Matrix<double, kSize, kSize>& A);

/// In closed form: faster, and less accurate where eigenvalues are close to each other.
SymmetricEigen<3> DirectEigenOfSymmetric(const Eigen::Matrix3d& A);
Eigen::Vector3d DirectEigenvaluesOfSymmetric(const Eigen::Matrix3d& A);

/// The smaller eigenvalue.
double SmallerEigenvalue(const Eigen::Matrix2d& A);

}  // namespace dmslam
