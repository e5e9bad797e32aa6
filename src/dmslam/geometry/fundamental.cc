#include <numeric>

#include "dmslam/geometry/normalization.h"
#include "dmslam/geometry/null_space.h"
#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// The row of x2^T F x1 = 0 in the elements of F, row by row.
template <typename Row>
void EpipolarRow(const Eigen::Vector2d& x1, const Eigen::Vector2d& x2, Row& row) {
  row[0] = x2.x() * x1.x();
  row[1] = x2.x() * x1.y();
  row[2] = x2.x();
  row[3] = x2.y() * x1.x();
  row[4] = x2.y() * x1.y();
  row[5] = x2.y();
  row[6] = x1.x();
  row[7] = x1.y();
  row[8] = 1.0;
}

template <typename Vector>
Eigen::Matrix3d FromRows(const Vector& f) {
  Eigen::Matrix3d m;
  m << f[0], f[1], f[2], f[3], f[4], f[5], f[6], f[7], f[8];
  return m;
}

/// The matrix of rank two that is nearest but for the accuracy of the direct eigen solver: F - F v v^T with
/// the smallest right singular vector v is singular whatever v is.
Eigen::Matrix3d MakeRankTwo(const Eigen::Matrix3d& F) {
  const Eigen::Vector3d v = DirectEigenOfSymmetric(F.transpose() * F).vectors.col(0);
  return F - (F * v) * v.transpose();
}

Eigen::Matrix3d Denormalize(const Eigen::Matrix3d& F, const Normalization& n1, const Normalization& n2) {
  const Eigen::Matrix3d raw = n2.Matrix().transpose() * F * n1.Matrix();
  return raw / raw.norm();
}

std::optional<Vector9d> LeastSquaresEpipolar(std::span<const Eigen::Vector2d> x1,
                                             std::span<const Eigen::Vector2d> x2,
                                             std::span<const int> indices, std::span<const double> weights,
                                             const Normalization& n1, const Normalization& n2) {
  Matrix9d normal = Matrix9d::Zero();
  Vector9d row;
  for (const int index : indices) {
    const auto i = static_cast<size_t>(index);
    EpipolarRow(n1(x1[i]), n2(x2[i]), row);
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, weights.empty() ? 1.0 : weights[i]);
  }
  const SymmetricEigen<9> eigen = EigenOfSymmetric(normal);
  if (!(eigen.values(1) > 1e-14 * eigen.values(8))) return std::nullopt;
  return eigen.vectors.col(0);
}

}  // namespace

std::optional<Eigen::Matrix3d> FundamentalEightPointMinimal(std::span<const Eigen::Vector2d> x1_px,
                                                            std::span<const Eigen::Vector2d> x2_px,
                                                            std::span<const int, 8> indices) {
  const auto n1 = Normalization::Of(x1_px, indices), n2 = Normalization::Of(x2_px, indices);
  if (!n1 || !n2) return std::nullopt;
  Equations<8> rows;
  for (size_t k = 0; k < 8; ++k) {
    const auto i = static_cast<size_t>(indices[k]);
    EpipolarRow((*n1)(x1_px[i]), (*n2)(x2_px[i]), rows[k]);
  }
  std::array<std::array<double, 9>, 1> basis;
  if (!NullSpace<8>(rows, basis)) return std::nullopt;
  return Denormalize(MakeRankTwo(FromRows(basis[0])), *n1, *n2);
}

std::optional<Eigen::Matrix3d> FundamentalEightPoint(std::span<const Eigen::Vector2d> x1_px,
                                                     std::span<const Eigen::Vector2d> x2_px,
                                                     std::span<const int> indices,
                                                     std::span<const double> weights) {
  std::vector<int> all;
  if (indices.empty()) {
    all.resize(x1_px.size());
    std::iota(all.begin(), all.end(), 0);
    indices = all;
  }
  if (indices.size() < 8) return std::nullopt;
  const auto n1 = Normalization::Of(x1_px, indices), n2 = Normalization::Of(x2_px, indices);
  if (!n1 || !n2) return std::nullopt;
  const auto f = LeastSquaresEpipolar(x1_px, x2_px, indices, weights, *n1, *n2);
  if (!f) return std::nullopt;
  return Denormalize(MakeRankTwo(FromRows(*f)), *n1, *n2);
}

}  // namespace dmslam
