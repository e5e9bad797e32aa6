#include "dmslam/geometry/solve_symmetric.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace dmslam {
namespace {

constexpr int kMaxSystem = 7;
using SystemMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxSystem, kMaxSystem>;

SystemMatrix Solve(const SystemMatrix& A, const SystemMatrix& b) { return A.ldlt().solve(b); }

std::optional<SystemMatrix> InverseByCholesky(const SystemMatrix& A) {
  const Eigen::LLT<SystemMatrix> factored(A);
  if (factored.info() != Eigen::Success) return std::nullopt;
  const SystemMatrix inverse = factored.solve(SystemMatrix::Identity(A.rows(), A.cols()));
  return SystemMatrix(0.5 * (inverse + inverse.transpose()));  // symmetric to the last digit
}

}  // namespace

template <int kSize, int kColumns>
Eigen::Matrix<double, kSize, kColumns> SolveSymmetric(const Eigen::Matrix<double, kSize, kSize>& A,
                                                      const Eigen::Matrix<double, kSize, kColumns>& b) {
  static_assert(kSize <= kMaxSystem && kColumns <= kMaxSystem);
  return Solve(A, b);
}

template Eigen::Matrix<double, 3, 1> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                    const Eigen::Matrix<double, 3, 1>&);
template Eigen::Matrix<double, 3, 2> SolveSymmetric(const Eigen::Matrix<double, 3, 3>&,
                                                    const Eigen::Matrix<double, 3, 2>&);
template Eigen::Matrix<double, 4, 1> SolveSymmetric(const Eigen::Matrix<double, 4, 4>&,
                                                    const Eigen::Matrix<double, 4, 1>&);
template Eigen::Matrix<double, 5, 1> SolveSymmetric(const Eigen::Matrix<double, 5, 5>&,
                                                    const Eigen::Matrix<double, 5, 1>&);
template Eigen::Matrix<double, 6, 1> SolveSymmetric(const Eigen::Matrix<double, 6, 6>&,
                                                    const Eigen::Matrix<double, 6, 1>&);
template Eigen::Matrix<double, 6, 6> SolveSymmetric(const Eigen::Matrix<double, 6, 6>&,
                                                    const Eigen::Matrix<double, 6, 6>&);
template Eigen::Matrix<double, 7, 1> SolveSymmetric(const Eigen::Matrix<double, 7, 7>&,
                                                    const Eigen::Matrix<double, 7, 1>&);

template <int kSize>
std::optional<Eigen::Matrix<double, kSize, kSize>> InverseOfPositive(
    const Eigen::Matrix<double, kSize, kSize>& A) {
  static_assert(kSize <= kMaxSystem);
  const std::optional<SystemMatrix> inverse = InverseByCholesky(A);
  if (!inverse) return std::nullopt;
  return *inverse;
}

template std::optional<Eigen::Matrix<double, 3, 3>> InverseOfPositive(const Eigen::Matrix<double, 3, 3>&);
template std::optional<Eigen::Matrix<double, 6, 6>> InverseOfPositive(const Eigen::Matrix<double, 6, 6>&);

Eigen::Matrix<double, 6, 6> InverseOf(const Eigen::Matrix<double, 6, 6>& A) {
  return SystemMatrix(A).partialPivLu().inverse();
}

}  // namespace dmslam
