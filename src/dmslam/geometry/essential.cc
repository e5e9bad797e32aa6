#include <Eigen/LU>
#include <numeric>

#include "dmslam/geometry/svd.h"
#include "dmslam/geometry/two_view.h"

namespace dmslam {

Eigen::Matrix3d ProjectToEssential(const Eigen::Matrix3d& E) {
  const Svd3 svd = SvdOf(E);
  const double size = std::sqrt(0.5);
  return svd.U * Eigen::Vector3d(size, size, 0.0).asDiagonal() * svd.V.transpose();
}

Eigen::Matrix3d EssentialFromFundamental(const Eigen::Matrix3d& F, const Pinhole& camera1,
                                         const Pinhole& camera2) {
  return ProjectToEssential(camera2.K().transpose() * F * camera1.K());
}

Eigen::Matrix3d FundamentalFromEssential(const Eigen::Matrix3d& E, const Pinhole& camera1,
                                         const Pinhole& camera2) {
  const Eigen::Matrix3d F = camera2.K().inverse().transpose() * E * camera1.K().inverse();
  return F / F.norm();
}

Eigen::Matrix3d EssentialFromPose(const Rigid3d& T_cam2_cam1) {
  return Hat(T_cam2_cam1.translation) * T_cam2_cam1.rotation.toRotationMatrix();
}

std::optional<Eigen::Matrix3d> EssentialEightPoint(std::span<const Eigen::Vector3d> rays1,
                                                   std::span<const Eigen::Vector3d> rays2,
                                                   std::span<const int> indices) {
  std::vector<Eigen::Vector2d> x1, x2;
  const size_t count = indices.empty() ? rays1.size() : indices.size();
  x1.reserve(count);
  x2.reserve(count);
  for (size_t k = 0; k < count; ++k) {
    const size_t i = indices.empty() ? k : static_cast<size_t>(indices[k]);
    x1.push_back(rays1[i].hnormalized());
    x2.push_back(rays2[i].hnormalized());
  }
  const auto F = FundamentalEightPoint(x1, x2);
  if (!F) return std::nullopt;
  return ProjectToEssential(*F);
}

std::array<Rigid3d, 4> DecomposeEssential(const Eigen::Matrix3d& E) {
  const Svd3 svd = SvdOf(E);
  Eigen::Matrix3d U = svd.U, V = svd.V;
  if (U.determinant() < 0) U.col(2) = -U.col(2);
  if (V.determinant() < 0) V.col(2) = -V.col(2);
  Eigen::Matrix3d W;
  W << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  const Eigen::Quaterniond first(Eigen::Matrix3d(U * W * V.transpose()));
  const Eigen::Quaterniond second(Eigen::Matrix3d(U * W.transpose() * V.transpose()));
  const Eigen::Vector3d t = U.col(2);
  return {Rigid3d(first.normalized(), t), Rigid3d(first.normalized(), -t), Rigid3d(second.normalized(), t),
          Rigid3d(second.normalized(), -t)};
}

namespace {

/// How many rays meet in front of both cameras with the translation `t`, and how many with `-t`.
std::pair<int, int> CountInFront(const Eigen::Matrix3d& R, const Eigen::Vector3d& t,
                                 std::span<const Eigen::Vector3d> rays1,
                                 std::span<const Eigen::Vector3d> rays2, std::span<const int> indices) {
  int forward = 0, backward = 0;
  for (const int index : indices) {
    const Eigen::Vector3d turned = R * rays1[static_cast<size_t>(index)];
    const Eigen::Vector3d& other = rays2[static_cast<size_t>(index)];
    // From t + d1 turned = d2 other: d1 n = other x t and d2 n = turned x t, with n = turned x other.
    const Eigen::Vector3d n = turned.cross(other);
    const double depth1 = other.cross(t).dot(n), depth2 = turned.cross(t).dot(n);
    if (depth1 > 0 && depth2 > 0) ++forward;
    if (depth1 < 0 && depth2 < 0) ++backward;
  }
  return {forward, backward};
}

}  // namespace

int PoseFromEssential(const Eigen::Matrix3d& E, std::span<const Eigen::Vector3d> rays1,
                      std::span<const Eigen::Vector3d> rays2, std::span<const int> indices,
                      Rigid3d& T_cam2_cam1) {
  const std::array<Rigid3d, 4> candidates = DecomposeEssential(E);
  int best = -1;
  for (const size_t k : {size_t{0}, size_t{2}}) {
    const auto [forward, backward] = CountInFront(candidates[k].rotation.toRotationMatrix(),
                                                  candidates[k].translation, rays1, rays2, indices);
    if (forward > best) best = forward, T_cam2_cam1 = candidates[k];
    if (backward > best) best = backward, T_cam2_cam1 = candidates[k + 1];
  }
  return best;
}

}  // namespace dmslam
