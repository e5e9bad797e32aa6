#include "dmslam/geometry/solve_symmetric.h"

#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace dmslam {
namespace {

constexpr size_t kMaxSystem = 7;

/// P A P^T = L D L^T (Golub & Van Loan, Matrix Computations, 4.1 and 4.4), in plain loops: they compile in a
/// hundredth of the time that the templates of a library take.
class Ldlt {
 public:
  /// Of a matrix of doubles, column by column, of which the lower triangle is read.
  Ldlt(const double* matrix, size_t size) : size_(size) {
    for (size_t j = 0; j < size; ++j) {
      for (size_t i = j; i < size; ++i) a_[i][j] = matrix[j * size + i];
    }
    for (size_t k = 0; k < size; ++k) {
      SwapWithLargest(k);
      Eliminate(k);
    }
  }

  void SolveInPlace(double* x) const {
    for (size_t k = 0; k < size_; ++k) std::swap(x[k], x[swapped_[k]]);
    for (size_t i = 0; i < size_; ++i) {
      for (size_t j = 0; j < i; ++j) x[i] -= a_[i][j] * x[j];
    }
    for (size_t i = 0; i < size_; ++i) {
      const bool known = std::abs(a_[i][i]) > std::numeric_limits<double>::min();
      x[i] = known ? x[i] / a_[i][i] : 0.0;
    }
    for (size_t i = size_; i-- > 0;) {
      for (size_t j = i + 1; j < size_; ++j) x[i] -= a_[j][i] * x[j];
    }
    for (size_t k = size_; k-- > 0;) std::swap(x[k], x[swapped_[k]]);
  }

 private:
  /// Rows and columns k and that of the largest diagonal element from k on.
  void SwapWithLargest(size_t k) {
    size_t largest = k;
    for (size_t i = k + 1; i < size_; ++i) {
      if (std::abs(a_[i][i]) > std::abs(a_[largest][largest])) largest = i;
    }
    swapped_[k] = largest;
    if (largest == k) return;
    for (size_t j = 0; j < k; ++j) std::swap(a_[k][j], a_[largest][j]);
    for (size_t i = largest + 1; i < size_; ++i) std::swap(a_[i][k], a_[i][largest]);
    for (size_t i = k + 1; i < largest; ++i) std::swap(a_[i][k], a_[largest][i]);
    std::swap(a_[k][k], a_[largest][largest]);
  }

  void Eliminate(size_t k) {
    std::array<double, kMaxSystem> scaled;
    for (size_t j = 0; j < k; ++j) scaled[j] = a_[j][j] * a_[k][j];
    for (size_t i = k; i < size_; ++i) {
      double sum = 0.0;
      for (size_t j = 0; j < k; ++j) sum += a_[i][j] * scaled[j];
      a_[i][k] -= sum;
    }
    if (a_[k][k] == 0.0) return;
    for (size_t i = k + 1; i < size_; ++i) a_[i][k] /= a_[k][k];
  }

  size_t size_;
  std::array<std::array<double, kMaxSystem>, kMaxSystem> a_;  ///< below the diagonal L, on it D
  std::array<size_t, kMaxSystem> swapped_;
};

}  // namespace

template <int kSize, int kColumns>
Eigen::Matrix<double, kSize, kColumns> SolveSymmetric(const Eigen::Matrix<double, kSize, kSize>& A,
                                                      const Eigen::Matrix<double, kSize, kColumns>& b) {
  static_assert(size_t{kSize} <= kMaxSystem);
  const Ldlt factored(A.data(), kSize);
  Eigen::Matrix<double, kSize, kColumns> x = b;
  for (int column = 0; column < kColumns; ++column) factored.SolveInPlace(x.data() + kSize * column);
  return x;
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
  // Cholesky, A = L L^T: column by column L^-1, then L^-T L^-1.
  Eigen::Matrix<double, kSize, kSize> L = A;
  for (int k = 0; k < kSize; ++k) {
    for (int j = 0; j < k; ++j) {
      for (int i = k; i < kSize; ++i) L(i, k) -= L(i, j) * L(k, j);
    }
    if (!(L(k, k) > 0.0)) return std::nullopt;
    const double root = std::sqrt(L(k, k));
    for (int i = k; i < kSize; ++i) L(i, k) /= root;
  }
  Eigen::Matrix<double, kSize, kSize> inverse_root;
  for (int column = 0; column < kSize; ++column) {
    for (int i = column; i < kSize; ++i) {
      double sum = i == column ? 1.0 : 0.0;
      for (int j = column; j < i; ++j) sum -= L(i, j) * inverse_root(j, column);
      inverse_root(i, column) = sum / L(i, i);
    }
  }
  Eigen::Matrix<double, kSize, kSize> inverse;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = 0.0;
      for (int k = i; k < kSize; ++k) sum += inverse_root(k, i) * inverse_root(k, j);
      inverse(i, j) = inverse(j, i) = sum;
    }
  }
  return inverse;
}

template std::optional<Eigen::Matrix<double, 3, 3>> InverseOfPositive(const Eigen::Matrix<double, 3, 3>&);
template std::optional<Eigen::Matrix<double, 6, 6>> InverseOfPositive(const Eigen::Matrix<double, 6, 6>&);

Eigen::Matrix<double, 6, 6> InverseOf(const Eigen::Matrix<double, 6, 6>& A) {
  constexpr size_t kSize = 6;
  std::array<std::array<double, 2 * kSize>, kSize> rows{};  // of (A 1), then of (1 A^-1)
  for (size_t i = 0; i < kSize; ++i) {
    for (size_t j = 0; j < kSize; ++j) rows[i][j] = A(static_cast<int>(i), static_cast<int>(j));
    rows[i][kSize + i] = 1.0;
  }
  for (size_t k = 0; k < kSize; ++k) {
    size_t pivot = k;
    for (size_t i = k + 1; i < kSize; ++i) {
      if (std::abs(rows[i][k]) > std::abs(rows[pivot][k])) pivot = i;
    }
    std::swap(rows[k], rows[pivot]);
    const double divisor = rows[k][k];
    for (double& element : rows[k]) element /= divisor;
    for (size_t i = 0; i < kSize; ++i) {
      if (i == k) continue;
      const double factor = rows[i][k];
      for (size_t j = 0; j < 2 * kSize; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  Eigen::Matrix<double, 6, 6> inverse;
  for (size_t i = 0; i < kSize; ++i) {
    for (size_t j = 0; j < kSize; ++j) inverse(static_cast<int>(i), static_cast<int>(j)) = rows[i][kSize + j];
  }
  return inverse;
}

}  // namespace dmslam
