#pragma once

#include <Eigen/Core>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// A motion that goes on evenly, along the axes of the body that moves.
struct Twist {
  Eigen::Vector3d linear_per_s = Eigen::Vector3d::Zero();       ///< [length / s]
  Eigen::Vector3d angular_rad_per_s = Eigen::Vector3d::Zero();  ///< rotation vector
};

/// The motion that takes a body along `T_before_after` within `duration_s` > 0. Carry() goes the same way.
Twist TwistOf(const Rigid3d& T_before_after, double duration_s);

/// Where a body stands `duration_s` later (earlier, below zero): T_world_body.
Rigid3d Carry(const Rigid3d& T_world_body, const Twist& twist, double duration_s);

}  // namespace dmslam
