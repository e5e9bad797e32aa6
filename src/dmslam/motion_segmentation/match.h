#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace dmslam {

/// A feature of frame 0 and the one of frame 1 that looks like it.
struct Match {
  Eigen::Vector2d uv0_px = Eigen::Vector2d::Zero();  ///< ideal (undistorted) pixel in frame 0
  Eigen::Vector2d uv1_px = Eigen::Vector2d::Zero();  ///< ideal (undistorted) pixel in frame 1
  uint8_t octave0 = 0;                               ///< pyramid level of the keypoint in frame 0
  uint8_t octave1 = 0;                               ///< pyramid level of the keypoint in frame 1
  uint32_t index0 = 0;                               ///< which keypoint of frame 0; carried through, not used
  uint32_t index1 = 0;                               ///< which keypoint of frame 1; carried through, not used
};

}  // namespace dmslam
