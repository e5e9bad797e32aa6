#pragma once

#include <Eigen/Core>
#include <span>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/util/vector_path.h"

namespace dmslam {

/// What a step of Gauss and Newton for a camera's pose needs, sums over matches of points and pixels.
struct PoseNormal {
  Matrix6d matrix = Matrix6d::Zero();  ///< tangent (w, v); its lower half, above the diagonal it is zero
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;  ///< infinite if a point is behind the camera, and then the rest says nothing
};

/// Over the matches `indices` of points and undistorted pixels; without `inv_sigma_squared` all weigh the
/// same.
PoseNormal SumPoseNormal(const Pinhole& camera, const Rigid3d& T_cam_world,
                         std::span<const Eigen::Vector3d> points_world,
                         std::span<const Eigen::Vector2d> uv_px, std::span<const double> inv_sigma_squared,
                         std::span<const int> indices, VectorPath path = VectorPath::kWidest);

}  // namespace dmslam
