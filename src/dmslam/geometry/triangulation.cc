#include "dmslam/geometry/triangulation.h"

#include <Eigen/LU>
#include <cmath>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/util/check.h"

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

namespace {

/// Least squares of the distances to all rays.
std::optional<Eigen::Vector3d> NearestToRays(std::span<const Rigid3d> T_cam_world,
                                             std::span<const Eigen::Vector3d> rays) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d d = T_cam_world[i].rotation.conjugate() * rays[i].normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    normal += across;
    right += across * T_cam_world[i].Center();
  }
  // The product of the eigenvalues; for parallel rays one of them vanishes with the square of their angle.
  const double n = static_cast<double>(rays.size());
  if (!(normal.determinant() > 1e-14 * n * n * n)) return std::nullopt;
  return SolveSymmetric(normal, right);
}

/// One Gauss-Newton step on the reprojection errors in normalised coordinates. False if the point is behind a
/// camera.
bool RefineOnce(std::span<const Rigid3d> T_cam_world, std::span<const Eigen::Vector3d> rays,
                Eigen::Vector3d& point) {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Matrix3d R = T_cam_world[i].rotation.toRotationMatrix();
    const Eigen::Vector3d p = R * point + T_cam_world[i].translation;
    if (!(p.z() > 0.0)) return false;
    const Eigen::Vector2d error = p.hnormalized() - rays[i].hnormalized();
    Eigen::Matrix<double, 2, 3> J;
    J << 1.0, 0.0, -p.x() / p.z(), 0.0, 1.0, -p.y() / p.z();
    const Eigen::Matrix<double, 2, 3> jacobian = (J / p.z()) * R;
    hessian += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * error;
  }
  const Eigen::Vector3d step = SolveSymmetric(hessian, gradient);
  if (!step.allFinite()) return false;
  point -= step;
  return true;
}

}  // namespace

std::optional<Eigen::Vector3d> TriangulateMultiView(std::span<const Rigid3d> T_cam_world,
                                                    std::span<const Eigen::Vector3d> rays, int refinements) {
  DMSLAM_CHECK(T_cam_world.size() == rays.size(), "one ray per pose");
  if (rays.size() < 2) return std::nullopt;
  auto point = NearestToRays(T_cam_world, rays);
  if (!point) return std::nullopt;
  for (int k = 0; k < refinements; ++k) {
    if (!RefineOnce(T_cam_world, rays, *point)) return std::nullopt;
  }
  for (const Rigid3d& T : T_cam_world) {
    if (!((T * *point).z() > 0.0)) return std::nullopt;
  }
  return point;
}

}  // namespace dmslam
