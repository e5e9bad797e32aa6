#pragma once

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/landmark_maker.h"

namespace dmslam {

/// Builds a map of two frames and what both see, adjusts it, and scales it so that the median depth of what
/// the first sees is one. Neither frame may be known to the map. False where too few landmarks survive the
/// adjustment: what was built is then still there, for the caller to drop.
bool BuildFirstMap(MapEditor& map, const InitialMap& proposal, LandmarkMaker& maker);

}  // namespace dmslam
