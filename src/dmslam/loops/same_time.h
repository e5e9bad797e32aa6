#pragma once

#include <cstdlib>

#include "dmslam/map/keyframe.h"

namespace dmslam {

/// Whether a camera took two keyframes so shortly after one another that nothing has moved far meanwhile, nor
/// has the camera. Of two sessions nothing says that their clocks are the same.
inline bool AreAtSameTime(const Keyframe& a, const Keyframe& b, double seconds) {
  const double apart_s = static_cast<double>(std::abs(a.stamp_ns - b.stamp_ns)) * 1e-9;
  return a.id.session() == b.id.session() && a.camera_id == b.camera_id && apart_s <= seconds;
}

}  // namespace dmslam
