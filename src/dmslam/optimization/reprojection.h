#pragma once

#include <Eigen/Core>

#include "dmslam/geometry/pinhole.h"

namespace dmslam {

using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;

/// d(pixel) / d(point in the camera frame).
inline Matrix23 ProjectionJacobian(const Pinhole& camera, const Eigen::Vector3d& p_cam) {
  const double inverse_z = 1.0 / p_cam.z();
  const double x = p_cam.x() * inverse_z, y = p_cam.y() * inverse_z;
  Matrix23 J;
  J << camera.fx_px * inverse_z, 0.0, -camera.fx_px * x * inverse_z, 0.0, camera.fy_px * inverse_z,
      -camera.fy_px * y * inverse_z;
  return J;
}

/// d(pixel) / d(step (w, v) on the left of the pose), for the point in the camera frame: J [-[p]x, I].
inline Matrix26 PoseJacobian(const Pinhole& camera, const Eigen::Vector3d& p_cam) {
  const double inverse_z = 1.0 / p_cam.z();
  const double x = p_cam.x() * inverse_z, y = p_cam.y() * inverse_z;
  Matrix26 J;
  J << -camera.fx_px * x * y, camera.fx_px * (1.0 + x * x), -camera.fx_px * y, camera.fx_px * inverse_z, 0.0,
      -camera.fx_px * x * inverse_z, -camera.fy_px * (1.0 + y * y), camera.fy_px * x * y, camera.fy_px * x,
      0.0, camera.fy_px * inverse_z, -camera.fy_px * y * inverse_z;
  return J;
}

}  // namespace dmslam
