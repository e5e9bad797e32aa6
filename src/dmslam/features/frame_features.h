#pragma once

#include <Eigen/Core>
#include <vector>

#include "dmslam/features/feature_grid.h"
#include "dmslam/features/types.h"

namespace dmslam {

/// What a camera saw in one frame, and where on the ideal image plane. Made once, never changed, shared by
/// all who hold the frame or the keyframe made of it.
struct FrameFeatures {
  FeatureSet set;
  std::vector<Eigen::Vector2d> uv_px;  ///< undistorted pixel of each keypoint
  FeatureGrid grid;                    ///< finds features near an undistorted pixel

  size_t size() const { return set.size(); }
};

}  // namespace dmslam
