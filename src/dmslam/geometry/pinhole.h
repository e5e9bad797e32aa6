#pragma once

#include <Eigen/Core>
#include <limits>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// A point that is no farther than this in front of the camera is at or behind it, in units of the map.
inline constexpr double kMinDepth = 1e-9;

/// The four numbers of an ideal pinhole camera [pixels]. Solvers and optimisers work on undistorted pixels
/// and need no more than this.
struct Pinhole {
  double fx_px = 1.0, fy_px = 1.0, cx_px = 0.0, cy_px = 0.0;

  Eigen::Matrix3d K() const {
    Eigen::Matrix3d k;
    k << fx_px, 0, cx_px, 0, fy_px, cy_px, 0, 0, 1;
    return k;
  }
  /// Pixel of a point in the camera frame; the caller has made sure that z > 0.
  Eigen::Vector2d Project(const Eigen::Vector3d& p_cam) const {
    const double inverse_z = 1.0 / p_cam.z();
    return {fx_px * p_cam.x() * inverse_z + cx_px, fy_px * p_cam.y() * inverse_z + cy_px};
  }
  /// Undistorted pixel to the ray through it, with z = 1.
  Eigen::Vector3d Ray(const Eigen::Vector2d& uv_px) const {
    return {(uv_px.x() - cx_px) / fx_px, (uv_px.y() - cy_px) / fy_px, 1.0};
  }
};

/// Squared distance [px^2] between the projection of a world point and its undistorted pixel; infinite for a
/// point at or behind the camera.
inline double ReprojectionErrorSquared(const Pinhole& camera, const Rigid3d& T_cam_world,
                                       const Eigen::Vector3d& p_world, const Eigen::Vector2d& uv_px) {
  const Eigen::Vector3d p_cam = T_cam_world * p_world;
  if (!(p_cam.z() > kMinDepth)) return std::numeric_limits<double>::infinity();
  return (camera.Project(p_cam) - uv_px).squaredNorm();
}

}  // namespace dmslam
