#pragma once

#include <Eigen/Core>
#include <array>
#include <span>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// Camera poses T_cam_world from three world points and the rays to them (camera frame, any length). Up to
/// four poses, written to `poses`; returns how many (0 for a degenerate sample). Persson and Nordberg,
/// "Lambda Twist: An Accurate Fast Robust Perspective Three Point (P3P) Solver" (ECCV 2018).
int SolveP3p(std::span<const Eigen::Vector3d, 3> rays, std::span<const Eigen::Vector3d, 3> points_world,
             std::array<Rigid3d, 4>& poses);

/// Gauss-Newton on the reprojection error of the matches named by `indices`; `inv_sigma_squared`, if not
/// empty, is parallel to the points. Returns the refined pose, or the given one where the error did not fall.
Rigid3d RefinePose(const Pinhole& camera, const Rigid3d& T_cam_world,
                   std::span<const Eigen::Vector3d> points_world, std::span<const Eigen::Vector2d> uv_px,
                   std::span<const double> inv_sigma_squared, std::span<const int> indices,
                   int iterations = 5);

}  // namespace dmslam
