#pragma once

#include <limits>
#include <span>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/util/vector_path.h"

namespace dmslam {

// The sums over what a frame sees, which its pose is found by. They are taken in vector code across
// observations for the terms, and across one observation's terms for the sums; each sum is added up
// observation by observation in their order. So every path gives the same bits.

/// Normal equations of a step (w, v) on the left of a pose.
struct PoseEquations {
  Matrix6d hessian = Matrix6d::Zero();  ///< Gauss-Newton
  Vector6d gradient = Vector6d::Zero();
  double cost = 0.0;
};

/// Sums the reprojection errors of those observations whose `use` is not zero (parallel to them): weight *
/// rho(chi2), with Huber's rho, which begins where chi2 is `huber_chi2`. One at or behind the camera has a
/// fixed cost that no step is to gain by, and no slope.
PoseEquations SumPoseEquations(const Pinhole& camera, const Rigid3d& T_cam_world,
                               std::span<const PoseObservation> observations, std::span<const char> use,
                               double huber_chi2 = std::numeric_limits<double>::infinity(),
                               VectorPath path = VectorPath::kWidest);

}  // namespace dmslam
