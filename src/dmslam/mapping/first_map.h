#pragma once

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/landmark_maker.h"

namespace dmslam {

/// Builds a map of two frames, of what both see, and of the frames between that see it too, adjusts it, and
/// scales it so that the median depth of what the first sees is one. Neither of the two may be known to the
/// map; a frame between that is known, or sees too little, is left out. False where too few landmarks survive
/// the adjustment: what was built is then still there, for the caller to drop.
bool BuildFirstMap(MapEditor& map, const InitialMap& proposal, LandmarkMaker& maker);

}  // namespace dmslam
