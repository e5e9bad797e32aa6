#pragma once

#include <cstddef>
#include <map>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// Points that a keyframe shows and that are no landmarks. Mutual exclusion makes landmarks of a fifth of
/// what can be triangulated (DM-SLAM, Algorithm 1): a place that was in sight for a second or two has too few
/// to be recognised by. What the other features show is computed when a lost camera is looked for. It says
/// where to look; whether the camera is there the landmarks decide.
class UnmappedPoints {
 public:
  /// Those of a keyframe of `map`, as landmarks without an id. Valid until the next call. They are kept for
  /// the next frames, which look like the same places.
  const std::vector<Landmark>& Of(const Map& map, const Keyframe& keyframe);
  /// Call where the map has changed.
  void Clear() { points_.clear(); }
  size_t size() const { return points_.size(); }  ///< of how many keyframes they are kept

 private:
  std::map<KeyframeId, std::vector<Landmark>> points_;
};

}  // namespace dmslam
