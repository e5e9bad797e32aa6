#include "dmslam/geometry/symmetric_eigen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace dmslam {
namespace {

constexpr int kMaxSweeps = 30;  // six or seven are enough: far more says that something is not a number
constexpr size_t kMaxEigenSize = 9;

/// Rows are vectors: element j of row i and row j of each.
using Rows = std::array<std::array<double, kMaxEigenSize>, kMaxEigenSize>;

double SumOfSquares(const Rows& a, size_t size, bool diagonal) {
  double sum = 0.0;
  for (size_t i = 0; i < size; ++i) {
    for (size_t j = 0; j < size; ++j) {
      if ((i == j) == diagonal) sum += a[i][j] * a[i][j];
    }
  }
  return sum;
}

/// Turns rows p and q so that a[p][q] becomes zero, and the vectors with them.
void Rotate(size_t p, size_t q, size_t size, Rows* a, Rows* vectors) {
  Rows& m = *a;
  if (m[p][q] == 0.0) return;
  const double theta = 0.5 * (m[q][q] - m[p][p]) / m[p][q];
  const double tangent = (theta < 0.0 ? -1.0 : 1.0) / (std::abs(theta) + std::hypot(1.0, theta));
  const double c = 1.0 / std::sqrt(1.0 + tangent * tangent), s = tangent * c;
  const double shift = tangent * m[p][q];
  const auto turn = [c, s](double* x, double* y) {
    const double x_before = *x, y_before = *y;
    *x = c * x_before - s * y_before;
    *y = s * x_before + c * y_before;
  };
  m[p][p] -= shift;
  m[q][q] += shift;
  m[p][q] = m[q][p] = 0.0;
  for (size_t i = 0; i < size; ++i) {
    turn(&(*vectors)[p][i], &(*vectors)[q][i]);
    if (i == p || i == q) continue;
    turn(&m[p][i], &m[q][i]);
    m[i][p] = m[p][i];
    m[i][q] = m[q][i];
  }
}

/// Makes `a` diagonal; its eigenvectors become the rows of `vectors`.
void Diagonalize(size_t size, Rows* a, Rows* vectors) {
  constexpr double kNegligible =
      1e-3 * std::numeric_limits<double>::epsilon();  // by now they shrink by squares
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    const double rest = SumOfSquares(*a, size, false);
    if (!(rest > kNegligible * kNegligible * SumOfSquares(*a, size, true))) return;
    for (size_t p = 0; p < size; ++p) {
      for (size_t q = p + 1; q < size; ++q) Rotate(p, q, size, a, vectors);
    }
  }
}

}  // namespace

template <int kSize>
SymmetricEigen<kSize> EigenOfSymmetric(const Eigen::Matrix<double, kSize, kSize>& A) {
  constexpr size_t kCount = kSize;
  static_assert(kCount <= kMaxEigenSize);
  Rows a, vectors;
  for (size_t i = 0; i < kCount; ++i) {
    for (size_t j = 0; j < kCount; ++j) {
      a[i][j] = A(static_cast<int>(std::max(i, j)), static_cast<int>(std::min(i, j)));
      vectors[i][j] = i == j ? 1.0 : 0.0;
    }
  }
  Diagonalize(kCount, &a, &vectors);
  std::array<size_t, kCount> order;
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](size_t i, size_t j) { return a[i][i] < a[j][j]; });
  SymmetricEigen<kSize> eigen;
  for (int k = 0; k < kSize; ++k) {
    const size_t from = order[static_cast<size_t>(k)];
    eigen.values(k) = a[from][from];
    for (int i = 0; i < kSize; ++i) eigen.vectors(i, k) = vectors[from][static_cast<size_t>(i)];
  }
  return eigen;
}

template SymmetricEigen<3> EigenOfSymmetric(const Eigen::Matrix<double, 3, 3>&);
template SymmetricEigen<6> EigenOfSymmetric(const Eigen::Matrix<double, 6, 6>&);
template SymmetricEigen<9> EigenOfSymmetric(const Eigen::Matrix<double, 9, 9>&);

double SmallerEigenvalue(const Eigen::Matrix2d& A) {
  const double mean = 0.5 * (A(0, 0) + A(1, 1));
  return mean - std::hypot(0.5 * (A(0, 0) - A(1, 1)), A(1, 0));
}

}  // namespace dmslam
