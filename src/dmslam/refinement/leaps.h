#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// Where a frame was by what it saw.
struct SeenFrom {
  int64_t stamp_ns = 0;
  Rigid3d T_cam_world;
  bool known = false;  ///< else the pose is a guess
  double depth = 1.0;  ///< of the scene [map units]
};

/// Which frames (1) no motion leads to from the one before: the camera was put elsewhere, or frames of two
/// places follow one another. So it is where two frames before agree with each other, two after do, and no
/// carried camera goes from either of the first two to either of the others in the time between; of frames
/// that lie in a wrong place for a moment nothing is said. Frames are those of one map, in order of time.
std::vector<uint8_t> FindLeaps(std::span<const SeenFrom> frames, const MotionModelOptions& motion);

}  // namespace dmslam
