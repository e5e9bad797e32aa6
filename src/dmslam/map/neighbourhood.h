#pragma once

#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// Landmarks that any of the keyframes sees, by id.
std::vector<LandmarkId> LandmarksSeenBy(const Map& map, const std::vector<KeyframeId>& keyframes);
std::vector<const Landmark*> LandmarksSeenBy(const Map& map, const std::vector<const Keyframe*>& keyframes);

/// Landmarks of a keyframe and of those `neighbours` that share most landmarks with it (`min_shared` or
/// more), sorted.
std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId id, int neighbours, int min_shared);

}  // namespace dmslam
