#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/geometry/uncertain_pose.h"
#include "dmslam/util/ids.h"

namespace dmslam {

// How well a pose is known that was found from landmarks. Tangents are (w, v) on the left of T_cam_world, as
// everywhere (StepPose()); ToPoseInReference() tells them as a
// message does.

/// Whether it is finite and has no variance below zero. One that is a difference may be neither, by rounding.
bool IsCovariance(const Matrix6d& covariance);

/// A keyframe's sight of a landmark.
struct LandmarkRay {
  Rigid3d T_cam_world;
  double variance_px = 1.0;  ///< of the pixel's coordinates
};

/// Covariance of a landmark, along the world's axes, by the angles under which it was seen while the cameras
/// stood where they stand: (sum J^T J / variance)^-1. Along each ray the depth is known to within itself
/// beforehand, so that a landmark seen from one place has a large variance and not an infinite one.
Eigen::Matrix3d LandmarkCovariance(const Pinhole& camera, const Eigen::Vector3d& p_world,
                                   std::span<const LandmarkRay> views);

/// The symmetric root of a covariance: alike for covariances that are alike.
Eigen::Matrix3d SymmetricRoot(const Eigen::Matrix3d& covariance);

/// A landmark that a pose was found by.
struct PoseSight {
  LandmarkId landmark;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Eigen::Matrix3d landmark_root = Eigen::Matrix3d::Zero();  ///< SymmetricRoot of the landmark's covariance
  double variance_px = 1.0;  ///< of the pixel's coordinates as they are believed to be
  double weight = 1.0;       ///< that its squared error / variance_px had in the pose's optimisation
  int cell = 0;              ///< of the image: features in the same one err alike
};

/// How landmarks' errors go into a pose: error of the pose = sum gain * error of the landmark.
using LandmarkGain = Eigen::Matrix<double, 6, 3>;

/// The covariance of a pose by what makes it; the sum is the pose's. All with tangent (w, v).
struct PoseUncertainty {
  Matrix6d noise = Matrix6d::Zero();      ///< of the features' pixels, and of the prior; new in each frame
  Matrix6d landmarks = Matrix6d::Zero();  ///< of the landmarks: the next frame has most of it again
  std::vector<LandmarkGain> gains;        ///< parallel to the sights
  Matrix6d Sum() const { return noise + landmarks; }
};

/// Of the pose that minimises sum weight * |reprojection error|^2 / variance + the prior's cost, with
/// `information` that sum's Gauss-Newton Hessian (PoseOptimizationReport::information). The estimate weighs
/// all sights as if they were independent and the landmarks known; the covariance is that of this estimate,
/// H^-1 (sum of J^T W C W J) H^-1 (White, Econometrica 1980; by cells, Liang and Zeger, Biometrika 1986),
/// where C holds what is true of the errors. `noise_variance`: of the features' pixels relative to
/// variance_px. None where the information does not determine the pose.
std::optional<PoseUncertainty> EstimatePoseUncertainty(const Pinhole& camera, const Rigid3d& T_cam_world,
                                                       std::span<const PoseSight> sights,
                                                       const Matrix6d& information, double noise_variance,
                                                       const PoseErrorModel& model);

/// One end of a step: sights by landmark, and what was made of them.
struct StepEnd {
  Rigid3d T_cam_world;
  std::span<const PoseSight> sights;  ///< ascending by landmark
  const PoseUncertainty* uncertainty = nullptr;
};

/// Covariance of T_after_before = T_after_world * T_before_world^-1, tangent on its left. A landmark that
/// both saw has moved both poses, almost alike: what is left is the difference of its gains. The noise of
/// both adds.
Matrix6d StepUncertainty(const StepEnd& before, const StepEnd& after, const PoseErrorModel& model);

}  // namespace dmslam
