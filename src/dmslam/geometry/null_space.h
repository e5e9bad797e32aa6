#pragma once

#include <array>
#include <cmath>
#include <utility>

namespace dmslam {

/// A homogeneous linear system of `kRows` equations in nine unknowns, as the small solvers of two-view
/// geometry meet it.
template <int kRows>
using Equations = std::array<std::array<double, 9>, static_cast<size_t>(kRows)>;

/// A basis of its null space, 9 - kRows vectors, by Gauss-Jordan elimination with full pivoting (the matrix
/// is destroyed). False if the rank is smaller than kRows, with pivots compared to `tolerance` times the
/// largest one.
template <int kRows>
bool NullSpace(Equations<kRows>& a, std::array<std::array<double, 9>, static_cast<size_t>(9 - kRows)>& basis,
               double tolerance = 1e-9) {
  constexpr size_t kN = static_cast<size_t>(kRows);
  std::array<size_t, 9> column{0, 1, 2, 3, 4, 5, 6, 7, 8};
  double first_pivot = 0.0;
  for (size_t k = 0; k < kN; ++k) {
    size_t best_row = k, best = k;
    double largest = -1.0;
    for (size_t r = k; r < kN; ++r) {
      for (size_t c = k; c < 9; ++c) {
        const double size = std::abs(a[r][column[c]]);
        if (size > largest) largest = size, best_row = r, best = c;
      }
    }
    if (k == 0) first_pivot = largest;
    if (!(largest > tolerance * first_pivot)) return false;
    std::swap(a[k], a[best_row]);
    std::swap(column[k], column[best]);
    const double inverse = 1.0 / a[k][column[k]];
    for (size_t c = k; c < 9; ++c) a[k][column[c]] *= inverse;
    for (size_t r = 0; r < kN; ++r) {
      const double factor = a[r][column[k]];
      if (r == k || factor == 0.0) continue;
      for (size_t c = k; c < 9; ++c) a[r][column[c]] -= factor * a[k][column[c]];
    }
  }
  for (size_t free = kN; free < 9; ++free) {
    auto& vector = basis[free - kN];
    vector.fill(0.0);
    vector[column[free]] = 1.0;
    for (size_t r = 0; r < kN; ++r) vector[column[r]] = -a[r][column[free]];
  }
  return true;
}

}  // namespace dmslam
