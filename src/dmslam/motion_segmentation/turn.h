#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

/// The turn from camera 0 to camera 1 that brings most rays of the matches near each other: robust least
/// squares on the rays' differences, whose scale is their median. It leaves the translation aside, so it says
/// where to look for matches, not how the camera moved. `start` is where the search begins.
Eigen::Quaterniond FitTurn(std::span<const Match> matches, const Camera& camera,
                           const Eigen::Quaterniond& start);

/// Where the points lie when the camera has turned by `R_1_0`, in undistorted pixels; not finite where behind
/// it.
std::vector<Eigen::Vector2d> Turned(std::span<const Eigen::Vector2d> uv0_px, const Camera& camera,
                                    const Eigen::Quaterniond& R_1_0);

}  // namespace dmslam
