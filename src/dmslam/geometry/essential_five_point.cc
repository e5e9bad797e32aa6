#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "dmslam/geometry/null_space.h"
#include "dmslam/geometry/polynomial.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

// Polynomials in (x, y, z). Degree one: coefficients of x, y, z, 1. Degree two: the ten of kQuadratic. Degree
// three: the twenty of kCubic, in the order that Nister's elimination wants.
using Linear = std::array<double, 4>;
using Quadratic = std::array<double, 10>;
using Cubic = std::array<double, 20>;
using Exponents = std::array<int, 3>;

constexpr std::array<Exponents, 4> kLinear{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};
constexpr std::array<Exponents, 10> kQuadratic{{{2, 0, 0},
                                                {1, 1, 0},
                                                {0, 2, 0},
                                                {1, 0, 1},
                                                {0, 1, 1},
                                                {0, 0, 2},
                                                {1, 0, 0},
                                                {0, 1, 0},
                                                {0, 0, 1},
                                                {0, 0, 0}}};
constexpr std::array<Exponents, 20> kCubic{{{3, 0, 0}, {0, 3, 0}, {2, 1, 0}, {1, 2, 0}, {2, 0, 1},
                                            {2, 0, 0}, {0, 2, 1}, {0, 2, 0}, {1, 1, 1}, {1, 1, 0},
                                            {1, 0, 2}, {1, 0, 1}, {1, 0, 0}, {0, 1, 2}, {0, 1, 1},
                                            {0, 1, 0}, {0, 0, 3}, {0, 0, 2}, {0, 0, 1}, {0, 0, 0}}};

/// Where the product of monomial i of `a` and monomial j of the linear ones stands in `product`.
template <size_t kA, size_t kProduct>
constexpr auto ProductTable(const std::array<Exponents, kA>& a,
                            const std::array<Exponents, kProduct>& product) {
  std::array<std::array<size_t, 4>, kA> table{};
  for (size_t i = 0; i < kA; ++i) {
    for (size_t j = 0; j < 4; ++j) {
      for (size_t k = 0; k < kProduct; ++k) {
        bool same = true;
        for (size_t e = 0; e < 3; ++e) same = same && a[i][e] + kLinear[j][e] == product[k][e];
        if (same) table[i][j] = k;
      }
    }
  }
  return table;
}
constexpr auto kLinearTimesLinear = ProductTable(kLinear, kQuadratic);
constexpr auto kQuadraticTimesLinear = ProductTable(kQuadratic, kCubic);

void AddProduct(const Linear& a, const Linear& b, double factor, Quadratic& sum) {
  for (size_t i = 0; i < 4; ++i) {
    for (size_t j = 0; j < 4; ++j) sum[kLinearTimesLinear[i][j]] += factor * a[i] * b[j];
  }
}

void AddProduct(const Quadratic& a, const Linear& b, Cubic& sum) {
  for (size_t i = 0; i < 10; ++i) {
    for (size_t j = 0; j < 4; ++j) sum[kQuadraticTimesLinear[i][j]] += a[i] * b[j];
  }
}

using Matrix10x20 = Eigen::Matrix<double, 10, 20, Eigen::RowMajor>;
using Basis = std::array<std::array<double, 9>, 4>;
using LinearMatrix = std::array<std::array<Linear, 3>, 3>;

void StoreRow(const Cubic& row, int index, Matrix10x20& system) {
  for (int k = 0; k < 20; ++k) system(index, k) = row[static_cast<size_t>(k)];
}

/// det(E) = 0 and 2 E E^T E - trace(E E^T) E = 0, for E = x X + y Y + z Z + W.
Matrix10x20 EssentialConstraints(const LinearMatrix& e) {
  std::array<std::array<Quadratic, 3>, 3> gram{};  // E E^T - trace / 2
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = i; j < 3; ++j) {
      for (size_t k = 0; k < 3; ++k) AddProduct(e[i][k], e[j][k], 1.0, gram[i][j]);
    }
  }
  Quadratic half_trace;
  for (size_t k = 0; k < 10; ++k) half_trace[k] = 0.5 * (gram[0][0][k] + gram[1][1][k] + gram[2][2][k]);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 10; ++k) gram[i][i][k] -= half_trace[k];
    for (size_t j = 0; j < i; ++j) gram[i][j] = gram[j][i];
  }
  Matrix10x20 system;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      Cubic row{};
      for (size_t k = 0; k < 3; ++k) AddProduct(gram[i][k], e[k][j], row);
      StoreRow(row, static_cast<int>(3 * i + j), system);
    }
  }
  Cubic determinant{};
  for (size_t j = 0; j < 3; ++j) {
    const size_t a = (j + 1) % 3, b = (j + 2) % 3;
    Quadratic minor{};
    AddProduct(e[1][a], e[2][b], 1.0, minor);
    AddProduct(e[1][b], e[2][a], -1.0, minor);
    AddProduct(minor, e[0][j], determinant);
  }
  StoreRow(determinant, 9, system);
  return system;
}

/// A polynomial in z, lowest degree first.
template <size_t kSize>
using Poly = std::array<double, kSize>;

template <size_t kA, size_t kB>
Poly<kA + kB - 1> Multiply(const Poly<kA>& a, const Poly<kB>& b) {
  Poly<kA + kB - 1> product{};
  for (size_t i = 0; i < kA; ++i) {
    for (size_t j = 0; j < kB; ++j) product[i + j] += a[i] * b[j];
  }
  return product;
}

template <size_t kN>
Poly<kN> Minus(Poly<kN> a, const Poly<kN>& b) {
  for (size_t i = 0; i < kN; ++i) a[i] -= b[i];
  return a;
}

template <size_t kN>
double Evaluate(const Poly<kN>& p, double z) {
  double value = 0.0;
  for (size_t i = kN; i-- > 0;) value = value * z + p[i];
  return value;
}

/// One row of Nister's B(z): the equation (upper row) - z (lower row) of the reduced system, as polynomials
/// that multiply x, y and 1.
struct HiddenRow {
  Poly<4> x, y;
  Poly<5> one;
};

using Reduced = Eigen::Matrix<double, 10, 10>;

HiddenRow MakeHiddenRow(const Reduced& r, int upper) {
  const int lower = upper + 1;
  HiddenRow row;
  row.x = {r(upper, 2), r(upper, 1) - r(lower, 2), r(upper, 0) - r(lower, 1), -r(lower, 0)};
  row.y = {r(upper, 5), r(upper, 4) - r(lower, 5), r(upper, 3) - r(lower, 4), -r(lower, 3)};
  row.one = {r(upper, 9), r(upper, 8) - r(lower, 9), r(upper, 7) - r(lower, 8), r(upper, 6) - r(lower, 7),
             -r(lower, 6)};
  return row;
}

using Constraint = Eigen::Matrix<double, 9, 1>;

Eigen::Matrix3d BasisMatrix(const std::array<double, 9>& b) {
  Eigen::Matrix3d m;
  m << b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7], b[8];
  return m;
}

/// Gauss-Newton on 2 E E^T E = trace(E E^T) E within the span of the basis, for the solutions that the
/// elimination left inaccurate. `v` are the coordinates, of unit length.
void PolishEssential(const Basis& basis, Eigen::Vector4d& v, Eigen::Matrix3d& E) {
  for (int round = 0; round < 4; ++round) {
    const Eigen::Matrix3d gram = E * E.transpose();
    const Eigen::Matrix3d value = 2.0 * gram * E - gram.trace() * E;
    if (value.squaredNorm() < 1e-24) return;
    Eigen::Matrix<double, 9, 4> jacobian;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Matrix3d B = BasisMatrix(basis[static_cast<size_t>(k)]);
      const Eigen::Matrix3d slope = 2.0 * (B * E.transpose() * E + E * B.transpose() * E + gram * B) -
                                    2.0 * (E.transpose() * B).trace() * E - gram.trace() * B;
      jacobian.col(k) = Eigen::Map<const Constraint>(slope.data());
    }
    const Eigen::Matrix4d normal = jacobian.transpose() * jacobian + v * v.transpose();  // The length stays.
    v -= normal.ldlt().solve(jacobian.transpose() * Eigen::Map<const Constraint>(value.data()));
    v.normalize();
    E.setZero();
    for (int k = 0; k < 4; ++k) E += v(k) * BasisMatrix(basis[static_cast<size_t>(k)]);
  }
}

/// Orthonormal basis of the matrices E with x2^T E x1 = 0 for the sample.
bool EpipolarBasis(std::span<const Eigen::Vector3d> rays1, std::span<const Eigen::Vector3d> rays2,
                   std::span<const int, 5> indices, Basis& basis) {
  Equations<5> rows;
  for (size_t k = 0; k < 5; ++k) {
    const Eigen::Vector3d& a = rays1[static_cast<size_t>(indices[k])];
    const Eigen::Vector3d& b = rays2[static_cast<size_t>(indices[k])];
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) rows[k][static_cast<size_t>(3 * i + j)] = b(i) * a(j);
    }
  }
  if (!NullSpace<5>(rows, basis)) return false;
  for (size_t k = 0; k < 4; ++k) {
    Eigen::Map<Eigen::Matrix<double, 9, 1>> v(basis[k].data());
    for (size_t earlier = 0; earlier < k; ++earlier) {
      const Eigen::Map<const Eigen::Matrix<double, 9, 1>> u(basis[earlier].data());
      v -= u.dot(v) * u;
    }
    v.normalize();
  }
  return true;
}

}  // namespace

int EssentialFivePoint(std::span<const Eigen::Vector3d> rays1, std::span<const Eigen::Vector3d> rays2,
                       std::span<const int, 5> indices, std::array<Eigen::Matrix3d, 10>& models) {
  Basis basis;
  if (!EpipolarBasis(rays1, rays2, indices, basis)) return 0;
  LinearMatrix e;
  for (size_t k = 0; k < 9; ++k) e[k / 3][k % 3] = {basis[0][k], basis[1][k], basis[2][k], basis[3][k]};
  const Matrix10x20 system = EssentialConstraints(e);
  const Reduced reduced = system.leftCols<10>().eval().partialPivLu().solve(system.rightCols<10>().eval());
  if (!reduced.allFinite()) return 0;
  // Rows 4..9 have the leading monomials x^2 z, x^2, y^2 z, y^2, xyz, xy.
  const HiddenRow k = MakeHiddenRow(reduced, 4), l = MakeHiddenRow(reduced, 6), m = MakeHiddenRow(reduced, 8);
  const Poly<8> cofactor_x = Minus(Multiply(k.y, l.one), Multiply(k.one, l.y));
  const Poly<8> cofactor_y = Minus(Multiply(k.one, l.x), Multiply(k.x, l.one));
  const Poly<7> cofactor_one = Minus(Multiply(k.x, l.y), Multiply(k.y, l.x));
  Poly<11> determinant = Multiply(cofactor_x, m.x);
  const Poly<11> second = Multiply(cofactor_y, m.y), third = Multiply(cofactor_one, m.one);
  for (size_t i = 0; i < 11; ++i) determinant[i] += second[i] + third[i];
  std::array<double, 10> roots;
  const int count = RealRootsDegree10(determinant, roots);
  for (int i = 0; i < count; ++i) {
    const double z = roots[static_cast<size_t>(i)];
    const double one = Evaluate(cofactor_one, z);
    const double x = Evaluate(cofactor_x, z) / one, y = Evaluate(cofactor_y, z) / one;
    Eigen::Vector4d v = Eigen::Vector4d(x, y, z, 1.0).normalized();
    Eigen::Matrix3d& E = models[static_cast<size_t>(i)];
    E.setZero();
    for (int n = 0; n < 4; ++n) E += v(n) * BasisMatrix(basis[static_cast<size_t>(n)]);
    PolishEssential(basis, v, E);
  }
  return count;
}

}  // namespace dmslam
