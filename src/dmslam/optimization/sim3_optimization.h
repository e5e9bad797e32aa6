#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// A landmark of keyframe 1 and the landmark of keyframe 2 that should be the same: each in the frame of its
/// own camera, with the keypoint in its own image.
struct Sim3Match {
  Eigen::Vector3d p_cam1 = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_cam2 = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv1_px = Eigen::Vector2d::Zero();  ///< Undistorted.
  Eigen::Vector2d uv2_px = Eigen::Vector2d::Zero();
  double inv_sigma_squared1 = 1.0;
  double inv_sigma_squared2 = 1.0;
};

struct Sim3RansacOptions {
  int max_iterations = 300;
  double confidence = 0.99;
  int min_inliers = 20;
  double max_chi2 = kChiSquared2Dof99;  ///< On both sides.
  bool fix_scale = false;
  uint64_t seed = 0;
};

struct Sim3OptimizationOptions {
  int first_iterations = 5;    ///< With Huber's loss; then the outliers are removed.
  int second_iterations = 10;  ///< Without it.
  double max_chi2 = 10.0;      ///< On both sides; also the square of Huber's delta.
  int min_inliers = 10;        ///< Fewer after the first stage: no success.
  bool fix_scale = false;
};

struct Sim3Report {
  bool success = false;  ///< Enough inliers.
  Sim3d S_cam1_cam2;     ///< p_cam1 = S_cam1_cam2 * p_cam2.
  int num_inliers = 0;
  std::vector<char> inliers;  ///< Parallel to the matches.
  int iterations = 0;
};

/// RANSAC over samples of three pairs (AlignSim3). A match is an inlier when p_cam2 carried into camera 1
/// meets uv1, and p_cam1 carried into camera 2 meets uv2. The best model is refitted to its inliers.
Sim3Report EstimateSim3Ransac(const Pinhole& camera1, const Pinhole& camera2,
                              std::span<const Sim3Match> matches, const Sim3RansacOptions& options);

/// Refines S_cam1_cam2 by the reprojection errors on both sides; the points stay as they are.
Sim3Report OptimizeSim3(const Pinhole& camera1, const Pinhole& camera2, std::span<const Sim3Match> matches,
                        const Sim3d& S_cam1_cam2_init, const Sim3OptimizationOptions& options = {});

}  // namespace dmslam
