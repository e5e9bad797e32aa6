#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// How a keyframe sees a landmark, with what shows it.
struct LandmarkSight {
  KeyframeId keyframe;
  int64_t stamp_ns = 0;  ///< of the keyframe
  uint16_t feature = 0;
  Keypoint keypoint;               ///< in the raw image
  std::optional<double> error_px;  ///< from the undistorted keypoint to where the landmark is projected;
                                   ///< none: it lies behind the camera
};

/// All keyframes that see a landmark of this map, by id.
std::vector<LandmarkSight> SightsOf(const Map& map, const Landmark& landmark);

/// The keyframe whose ray makes the widest angle with that of another one.
struct WidestAngle {
  KeyframeId keyframe;
  double rad = 0;
};

/// Of those that see a landmark besides `from`; none: nobody does, or `from` is not there.
std::optional<WidestAngle> WidestAngleWith(const Map& map, const Landmark& landmark, KeyframeId from);

}  // namespace dmslam
