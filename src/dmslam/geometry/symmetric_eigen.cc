#include "dmslam/geometry/symmetric_eigen.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace dmslam {
namespace {

constexpr int kMaxEigenSize = 9;
using EigenMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxEigenSize, kMaxEigenSize>;

}  // namespace

template <int kSize>
SymmetricEigen<kSize> EigenOfSymmetric(const Eigen::Matrix<double, kSize, kSize>& A) {
  static_assert(kSize <= kMaxEigenSize);
  const Eigen::SelfAdjointEigenSolver<EigenMatrix> solver{EigenMatrix(A)};
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template SymmetricEigen<3> EigenOfSymmetric(const Eigen::Matrix<double, 3, 3>&);
template SymmetricEigen<6> EigenOfSymmetric(const Eigen::Matrix<double, 6, 6>&);
template SymmetricEigen<9> EigenOfSymmetric(const Eigen::Matrix<double, 9, 9>&);

SymmetricEigen<3> DirectEigenOfSymmetric(const Eigen::Matrix3d& A) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::Vector3d DirectEigenvaluesOfSymmetric(const Eigen::Matrix3d& A) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(A, Eigen::EigenvaluesOnly);
  return solver.eigenvalues();
}

double SmallerEigenvalue(const Eigen::Matrix2d& A) {
  const double mean = 0.5 * (A(0, 0) + A(1, 1));
  return mean - std::hypot(0.5 * (A(0, 0) - A(1, 1)), A(1, 0));
}

}  // namespace dmslam
