#include "dmslam/map/shared_map.h"

#include <algorithm>

namespace dmslam {

bool IsShared(const Map& map, MapId map_id, CameraId camera) {
  return std::ranges::any_of(map.KeyframesOf(map_id),
                             [&](const Keyframe* keyframe) { return keyframe->id.camera() != camera; });
}

}  // namespace dmslam
