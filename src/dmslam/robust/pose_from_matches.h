#pragma once

#include <Eigen/Core>
#include <span>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/robust/ransac.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

struct PoseRansacOptions {
  int max_iterations = 300;
  int min_iterations = 10;
  double confidence = 0.99;
  double max_chi2 = kChiSquared2Dof;  ///< Inlier: squared reprojection error * inv_sigma_squared below this.
  int min_inliers = 10;
  uint64_t seed = 0;
};

/// T_cam_world from world points and their undistorted pixels, with outliers: P3P samples, truncated
/// quadratic score, every new best pose refined on its inliers. `inv_sigma_squared` is parallel to the points
/// or empty (all 1).
RansacReport<Rigid3d> PoseFromMatches(const Pinhole& camera, std::span<const Eigen::Vector3d> points_world,
                                      std::span<const Eigen::Vector2d> uv_px,
                                      std::span<const double> inv_sigma_squared,
                                      const PoseRansacOptions& options);

}  // namespace dmslam
