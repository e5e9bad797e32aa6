#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// A landmark seen in the frame.
struct PoseObservation {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();  ///< Undistorted.
  double inv_sigma_squared = 1.0;                   ///< [1 / px^2], 1 / Pyramid::SigmaSquared of the octave.
  double weight = 1.0;  ///< Trust in the landmark, multiplies its cost; the inlier test does not see it.
};

/// What is known of the pose beforehand. Its error is (w, v) of T * T_prior^-1 = {Exp(w), v}.
struct PosePrior {
  Rigid3d T_cam_world;
  Matrix6d information = Matrix6d::Zero();
};

struct PoseOptimizationOptions {
  int rounds = 4;         ///< After each round every observation is tested again.
  int iterations = 10;    ///< Steps per round at most; a round ends early when the step is tiny.
  int robust_rounds = 2;  ///< Rounds with Huber's loss; later ones trust the inlier test alone.
  double max_chi2 =
      kChiSquared2Dof;       ///< Inlier: squared error * inv_sigma_squared at most this (95 %, 2 dof).
  double min_step = 1e-7;    ///< A step shorter than this (rad and map units) ends the round.
  int min_observations = 3;  ///< Fewer: the report is not usable and the pose is the initial one.
  std::optional<PosePrior> prior;
};

struct PoseOptimizationReport {
  bool usable = false;
  Rigid3d T_cam_world;
  int num_inliers = 0;
  std::vector<char> inliers;  ///< Parallel to the observations.
  std::vector<double> chi2;   ///< Parallel to the observations; infinite behind the camera.
  double mean_chi2 = 0.0;     ///< Over the inliers.
  /// Gauss-Newton Hessian over the inliers (and the prior) at the solution, tangent (w, v).
  Matrix6d information = Matrix6d::Zero();
  int iterations = 0;
};

/// Pose-only optimisation: minimises the reprojection errors over T_cam_world, re-testing the observations
/// between the rounds (ORB-SLAM2's scheme). Levenberg-Marquardt on six unknowns. All start as inliers.
/// Deterministic. The report is overwritten; its vectors keep their memory, so that calls in the steady state
/// do not allocate.
void OptimizePose(const Pinhole& camera, const Rigid3d& T_cam_world_init,
                  std::span<const PoseObservation> observations, const PoseOptimizationOptions& options,
                  PoseOptimizationReport& report);
PoseOptimizationReport OptimizePose(const Pinhole& camera, const Rigid3d& T_cam_world_init,
                                    std::span<const PoseObservation> observations,
                                    const PoseOptimizationOptions& options = {});

/// Derivative of the prior's error with respect to a left step on the pose.
Matrix6d PosePriorJacobian(const Vector6d& error);

}  // namespace dmslam
