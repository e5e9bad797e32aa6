#include "dmslam/geometry/triangulation.h"

#include <cmath>

namespace dmslam {

double AngleBetweenRays(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

double ParallaxAngle(const Eigen::Vector3d& center1_world, const Eigen::Vector3d& center2_world,
                     const Eigen::Vector3d& p_world) {
  return AngleBetweenRays(center1_world - p_world, center2_world - p_world);
}

namespace {

/// The point in the frame of camera 2.
std::optional<Eigen::Vector3d> TriangulateInSecond(const Rigid3d& T_cam2_cam1, const Eigen::Vector3d& ray1,
                                                   const Eigen::Vector3d& ray2) {
  const Eigen::Vector3d& t = T_cam2_cam1.translation;
  const Eigen::Vector3d f1 = T_cam2_cam1.rotation * ray1.normalized(), f2 = ray2.normalized();
  const double p = f1.cross(f2).norm(), q = f1.cross(t).norm(), r = f2.cross(t).norm();
  if (!(p > 1e-7) || !(q > 0.0) || !(r > 0.0)) return std::nullopt;
  const Eigen::Vector3d along1 = (r / p) * f1, along2 = (q / p) * f2;
  // In front of both cameras only if the two ends agree better with these signs than with any other.
  const double gap = (t + along1 - along2).squaredNorm();
  if (gap >= (t + along1 + along2).squaredNorm() || gap >= (t - along1 - along2).squaredNorm() ||
      gap >= (t - along1 + along2).squaredNorm()) {
    return std::nullopt;
  }
  return Eigen::Vector3d(q / (q + r) * (t + (r / p) * (f1 + f2)));
}

}  // namespace

std::optional<Eigen::Vector3d> TriangulatePointInFirst(const Rigid3d& T_cam2_cam1,
                                                       const Eigen::Vector3d& ray1,
                                                       const Eigen::Vector3d& ray2) {
  const auto in_second = TriangulateInSecond(T_cam2_cam1, ray1, ray2);
  if (!in_second || !(in_second->z() > 0.0)) return std::nullopt;
  const Eigen::Vector3d in_first = T_cam2_cam1.rotation.conjugate() * (*in_second - T_cam2_cam1.translation);
  if (!(in_first.z() > 0.0)) return std::nullopt;
  return in_first;
}

std::optional<Eigen::Vector3d> TriangulatePoint(const Rigid3d& T_cam1_world, const Rigid3d& T_cam2_world,
                                                const Eigen::Vector3d& ray1, const Eigen::Vector3d& ray2) {
  const auto in_first = TriangulatePointInFirst(T_cam2_world * T_cam1_world.Inverse(), ray1, ray2);
  if (!in_first) return std::nullopt;
  return T_cam1_world.rotation.conjugate() * (*in_first - T_cam1_world.translation);
}

}  // namespace dmslam
