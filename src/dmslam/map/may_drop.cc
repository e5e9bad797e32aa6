#include "dmslam/map/may_drop.h"

#include <algorithm>

namespace dmslam {

bool MayDrop(const Map& map, MapId map_id, CameraId camera) {
  return std::ranges::all_of(map.KeyframesOf(map_id), [&](const Keyframe* keyframe) {
    return keyframe->id.camera() == camera && keyframe->loop_edges.empty();
  });
}

}  // namespace dmslam
