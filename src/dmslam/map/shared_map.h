#pragma once

#include "dmslam/map/map.h"

namespace dmslam {

/// Whether another camera than `camera` has a part in a map: a keyframe in it is that camera's. Then it is
/// not this one's to drop, as the other one may not have heard yet that they have a map in common.
bool IsShared(const Map& map, MapId map_id, CameraId camera);

}  // namespace dmslam
