#pragma once

#include <Eigen/Core>
#include <cmath>

#include "dmslam/geometry/similarity.h"
#include "dmslam/optimization/sim3_optimization.h"

namespace dmslam {

/// A reprojection error [px] on one side, and its derivative with respect to the step (w, v, log scale) of
/// StepSim3.
struct Sim3SideError {
  Eigen::Vector2d error;
  Eigen::Matrix<double, 2, 7> jacobian;
};

/// p_cam2 carried into camera 1, and p_cam1 carried into camera 2; the points lie in front of the cameras.
Sim3SideError Sim3ErrorInFirst(const Pinhole& camera1, const Sim3d& S_12, const Sim3Match& match);
Sim3SideError Sim3ErrorInSecond(const Pinhole& camera2, const Sim3d& S_12, const Sim3Match& match);

/// The step {Exp(w), v, exp(log scale)} on the left.
inline Sim3d StepSim3(const Sim3d& S, const Vector7d& step) {
  return Sim3d(ExpSo3(step.head<3>()), step.segment<3>(3), std::exp(step(6))) * S;
}

}  // namespace dmslam
