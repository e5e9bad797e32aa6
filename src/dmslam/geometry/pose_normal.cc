#include "dmslam/geometry/pose_normal.h"

#include <algorithm>
#include <array>
#include <limits>

namespace dmslam {
namespace {

using Lanes = double __attribute__((vector_size(4 * sizeof(double))));

/// A match's residual, and its Jacobian without what is zero: elements 0, 1, 2 and 5 of both rows, element 3
/// of the first and element 4 of the second.
struct PoseTerms {
  Lanes u, v;
  double u3, v4;
  double error_u, error_v;
};

[[gnu::always_inline]] inline PoseTerms TermsOf(const Pinhole& camera, const Eigen::Vector3d& p,
                                                const Eigen::Vector2d& uv_px) {
  const Eigen::Vector2d error = camera.Project(p) - uv_px;
  const double u = p.x() / p.z(), v = p.y() / p.z(), inverse_z = 1.0 / p.z();
  const double fx = camera.fx_px, fy = camera.fy_px;
  return {Lanes{-fx * u * v, fx * (1 + u * u), -fx * v, -fx * u * inverse_z},
          Lanes{-fy * (1 + v * v), fy * u * v, fy * u, -fy * v * inverse_z},
          fx * inverse_z,
          fy * inverse_z,
          error.x(),
          error.y()};
}

/// The sums while they grow: the columns 0, 1, 2 and 5 of the matrix and the gradient with the rows 0, 1, 2
/// and 5, then the columns 0, 1, 2 and 5 of its rows 3 and 4 (of the last, the element below the diagonal),
/// and what is left: both diagonal elements and both of the gradient.
struct PoseSums {
  std::array<Lanes, 4> columns{};
  Lanes gradient{}, row3{}, row4{}, rest{};
  double cost = 0;
};

/// A product of three is (weight a) b with a of the row and b of the column.
[[gnu::always_inline]] inline void Add(const PoseTerms& t, double weight, PoseSums* sums) {
  const Lanes wu = weight * t.u, wv = weight * t.v;
  const double wu3 = weight * t.u3, wv4 = weight * t.v4;
  for (int c = 0; c < 4; ++c) sums->columns[static_cast<size_t>(c)] += wu * t.u[c] + wv * t.v[c];
  sums->gradient += wu * t.error_u + wv * t.error_v;
  sums->row3 += Lanes{t.u[0], t.u[1], t.u[2], wu[3]} * Lanes{wu3, wu3, wu3, t.u3};
  sums->row4 += Lanes{t.v[0], t.v[1], t.v[2], wv[3]} * Lanes{wv4, wv4, wv4, t.v4};
  sums->rest += Lanes{wu3, wv4, wu3, wv4} * Lanes{t.u3, t.v4, t.error_u, t.error_v};
  sums->cost += weight * (t.error_u * t.error_u + t.error_v * t.error_v);
}

/// Inline, or GCC 12 takes the call for the end of the AVX2 code and leaves the upper halves of the registers
/// in use, which slows down the SSE code of others from then on.
[[gnu::always_inline]] inline PoseNormal Unpack(const PoseSums& sums) {
  constexpr std::array<int, 4> kAt{0, 1, 2, 5};
  PoseNormal normal;
  for (int c = 0; c < 4; ++c) {
    const auto at = kAt[static_cast<size_t>(c)];
    for (int r = c; r < 4; ++r)
      normal.matrix(kAt[static_cast<size_t>(r)], at) = sums.columns[static_cast<size_t>(c)][r];
    normal.gradient(at) = sums.gradient[c];
    normal.matrix(std::max(3, at), std::min(3, at)) = sums.row3[c];
    normal.matrix(std::max(4, at), std::min(4, at)) = sums.row4[c];
  }
  normal.matrix(3, 3) = sums.rest[0];
  normal.matrix(4, 4) = sums.rest[1];
  normal.gradient(3) = sums.rest[2];
  normal.gradient(4) = sums.rest[3];
  normal.cost = sums.cost;
  return normal;
}

[[gnu::always_inline]] inline PoseNormal Sum(const Pinhole& camera, const Rigid3d& T,
                                             std::span<const Eigen::Vector3d> points,
                                             std::span<const Eigen::Vector2d> uv_px,
                                             std::span<const double> inv_sigma_squared,
                                             std::span<const int> indices) {
  PoseSums sums;
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (const int index : indices) {
    const auto i = static_cast<size_t>(index);
    const Eigen::Vector3d p = R * points[i] + T.translation;
    if (!(p.z() > 1e-9)) {
      sums.cost = std::numeric_limits<double>::infinity();
      break;
    }
    Add(TermsOf(camera, p, uv_px[i]), inv_sigma_squared.empty() ? 1.0 : inv_sigma_squared[i], &sums);
  }
  return Unpack(sums);
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) PoseNormal SumAvx2(const Pinhole& camera, const Rigid3d& T,
                                                   std::span<const Eigen::Vector3d> points,
                                                   std::span<const Eigen::Vector2d> uv_px,
                                                   std::span<const double> inv_sigma_squared,
                                                   std::span<const int> indices) {
  return Sum(camera, T, points, uv_px, inv_sigma_squared, indices);
}
#endif

}  // namespace

PoseNormal SumPoseNormal(const Pinhole& camera, const Rigid3d& T_cam_world,
                         std::span<const Eigen::Vector3d> points_world,
                         std::span<const Eigen::Vector2d> uv_px, std::span<const double> inv_sigma_squared,
                         std::span<const int> indices, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx2, path))
    return SumAvx2(camera, T_cam_world, points_world, uv_px, inv_sigma_squared, indices);
#endif
  return Sum(camera, T_cam_world, points_world, uv_px, inv_sigma_squared, indices);
}

}  // namespace dmslam
