#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "dmslam/geometry/normalization.h"
#include "dmslam/geometry/null_space.h"
#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {
namespace {

/// The two rows of x2 x (H x1) = 0 that matter, in the elements of H, row by row.
template <typename Row>
void TransferRows(const Eigen::Vector2d& x1, const Eigen::Vector2d& x2, Row& first, Row& second) {
  const double x = x1.x(), y = x1.y(), u = x2.x(), v = x2.y();
  const std::array<double, 9> a{-x, -y, -1, 0, 0, 0, u * x, u * y, u},
      b{0, 0, 0, -x, -y, -1, v * x, v * y, v};
  for (int k = 0; k < 9; ++k) {
    first[static_cast<size_t>(k)] = a[static_cast<size_t>(k)];
    second[static_cast<size_t>(k)] = b[static_cast<size_t>(k)];
  }
}

template <typename Vector>
Eigen::Matrix3d Denormalize(const Vector& h, const Normalization& n1, const Normalization& n2) {
  Eigen::Matrix3d H;
  H << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8];
  H = n2.InverseMatrix() * H * n1.Matrix();
  return H / H.norm();
}

bool ThreeCollinear(std::span<const Eigen::Vector2d> x, std::span<const int, 4> indices, double scale) {
  for (size_t left_out = 0; left_out < 4; ++left_out) {
    const Eigen::Vector2d& a = x[static_cast<size_t>(indices[left_out == 0 ? 1 : 0])];
    const Eigen::Vector2d& b = x[static_cast<size_t>(indices[left_out <= 1 ? 2 : 1])];
    const Eigen::Vector2d& c = x[static_cast<size_t>(indices[left_out <= 2 ? 3 : 2])];
    const Eigen::Vector2d ab = b - a, ac = c - a;
    if (std::abs(ab.x() * ac.y() - ab.y() * ac.x()) * scale * scale < 1e-4) return true;
  }
  return false;
}

}  // namespace

std::optional<Eigen::Matrix3d> HomographyFourPoint(std::span<const Eigen::Vector2d> x1_px,
                                                   std::span<const Eigen::Vector2d> x2_px,
                                                   std::span<const int, 4> indices) {
  const auto n1 = Normalization::Of(x1_px, indices), n2 = Normalization::Of(x2_px, indices);
  if (!n1 || !n2) return std::nullopt;
  if (ThreeCollinear(x1_px, indices, n1->scale) || ThreeCollinear(x2_px, indices, n2->scale))
    return std::nullopt;
  Equations<8> rows;
  for (size_t k = 0; k < 4; ++k) {
    const auto i = static_cast<size_t>(indices[k]);
    TransferRows((*n1)(x1_px[i]), (*n2)(x2_px[i]), rows[2 * k], rows[2 * k + 1]);
  }
  std::array<std::array<double, 9>, 1> basis;
  if (!NullSpace<8>(rows, basis)) return std::nullopt;
  return Denormalize(basis[0], *n1, *n2);
}

std::optional<Eigen::Matrix3d> HomographyLinear(std::span<const Eigen::Vector2d> x1_px,
                                                std::span<const Eigen::Vector2d> x2_px,
                                                std::span<const int> indices) {
  std::vector<int> all;
  if (indices.empty()) {
    all.resize(x1_px.size());
    std::iota(all.begin(), all.end(), 0);
    indices = all;
  }
  if (indices.size() < 4) return std::nullopt;
  const auto n1 = Normalization::Of(x1_px, indices), n2 = Normalization::Of(x2_px, indices);
  if (!n1 || !n2) return std::nullopt;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  std::array<double, 9> first, second;
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> a(first.data()), b(second.data());
  for (const int index : indices) {
    const auto i = static_cast<size_t>(index);
    TransferRows((*n1)(x1_px[i]), (*n2)(x2_px[i]), first, second);
    normal.noalias() += a * a.transpose() + b * b.transpose();
  }
  const SymmetricEigen<9> eigen = EigenOfSymmetric(normal);
  if (!(eigen.values(1) > 1e-12 * eigen.values(8))) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.vectors.col(0);
  return Denormalize(h, *n1, *n2);
}

namespace {

PlaneMotion MotionFromFrame(const Eigen::Matrix3d& H, const Eigen::Vector3d& v2, const Eigen::Vector3d& u) {
  Eigen::Matrix3d U, W;
  U << v2, u, v2.cross(u);
  const Eigen::Vector3d a = H * v2, b = H * u;
  W << a, b, a.cross(b);
  PlaneMotion motion;
  motion.T_cam2_cam1.rotation = Eigen::Quaterniond(Eigen::Matrix3d(W * U.transpose())).normalized();
  motion.normal_cam1 = v2.cross(u);
  motion.T_cam2_cam1.translation = (H - motion.T_cam2_cam1.rotation.toRotationMatrix()) * motion.normal_cam1;
  return motion;
}

}  // namespace

std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& H_px, const Pinhole& camera1,
                                             const Pinhole& camera2) {
  Eigen::Matrix3d H = camera2.K().inverse() * H_px * camera1.K();
  if (H.determinant() < 0) H = -H;
  const SymmetricEigen<3> eigen = EigenOfSymmetric<3>(H.transpose() * H);
  const Eigen::Vector3d& squares = eigen.values;
  if (!(squares(0) > 1e-14 * squares(2))) return {};
  H /= std::sqrt(squares(1));
  const double s1 = squares(2) / squares(1), s3 = squares(0) / squares(1);
  if (s1 - s3 < 1e-8)
    return {PlaneMotion{Rigid3d(Eigen::Quaterniond(H).normalized(), Eigen::Vector3d::Zero()), {0, 0, 1}}};
  const Eigen::Matrix3d V = eigen.vectors.rowwise().reverse();
  const double along1 = std::sqrt(std::max(0.0, 1.0 - s3) / (s1 - s3));
  const double along3 = std::sqrt(std::max(0.0, s1 - 1.0) / (s1 - s3));
  std::vector<PlaneMotion> motions;
  for (const double sign : {1.0, -1.0}) {
    const PlaneMotion motion = MotionFromFrame(H, V.col(1), along1 * V.col(0) + sign * along3 * V.col(2));
    PlaneMotion reversed = motion;
    reversed.normal_cam1 = -motion.normal_cam1;
    reversed.T_cam2_cam1.translation = -motion.T_cam2_cam1.translation;
    motions.push_back(motion);
    motions.push_back(reversed);
  }
  return motions;
}

}  // namespace dmslam
