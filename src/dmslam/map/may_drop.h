#pragma once

#include "dmslam/map/map.h"

namespace dmslam {

/// Whether a map is `camera`'s to drop, as a first map that does not predict: not if another camera has a
/// keyframe in it, which may not have heard yet that they have a map in common; nor if it was joined with
/// another map (a loop edge says so), whose poses would go with it.
bool MayDrop(const Map& map, MapId map_id, CameraId camera);

}  // namespace dmslam
