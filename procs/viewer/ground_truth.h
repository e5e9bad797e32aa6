#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

/// How the ground truth lies on the map.
struct TruthAlignment {
  Sim3d map_from_truth;
  double rmse_m = 0;  ///< of the camera's positions, after alignment
  size_t pairs = 0;
};

/// Where a camera truly was at a frame.
struct TruePosition {
  Eigen::Vector3d position;
  bool drawn = false;
};

}  // namespace dmslam
