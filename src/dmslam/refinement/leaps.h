#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// Where a frame was by what it saw.
struct SeenFrom {
  int64_t stamp_ns = 0;
  Rigid3d T_cam_world;
  double depth = 1.0;  ///< of the scene [map units]
  /// Standard deviation of the rotation [rad] and of the position over the depth, whichever is more; none:
  /// the pose is a guess.
  std::optional<double> spread;
};

/// Which frames (1) no motion leads to from the one before: the camera was put elsewhere, or frames of two
/// places follow one another. So it is where two frames before tell a motion and two after do, and neither
/// leads to where the others are, by far more than a carried camera gains speed in the time between. Of
/// frames that lie in a wrong place for a moment nothing is said. Frames are those of one map, in order of
/// time.
std::vector<uint8_t> FindLeaps(std::span<const SeenFrom> frames, const MotionModelOptions& motion);

}  // namespace dmslam
