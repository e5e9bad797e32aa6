#pragma once

#include "dmslam/map/map.h"
#include "mapper/mapper_options.h"

namespace dmslam {

/// Somebody who stands still is mapped like furniture, but what stands behind him is seen through him as soon
/// as he has left, and was before he came. A landmark is *proven* when it was seen over a longer time than
/// people stand. One that is not is *seen through* when keyframes from another time have landmarks at its
/// pixel that lie behind it, and none at its depth: free-space carving with the map's own points. Its
/// neighbours in the image and in depth go with it.

/// Removes them from a map whose sequence has ended; until then they are good to see, as long as people
/// stand. Witnesses are all keyframes. Where so many of the unproven are seen through that somebody must have
/// stood there, unproven landmarks that were ever found elsewhere go too, and those that too little supports.
/// Returns how many.
int RemoveSeenThrough(Map& map, MapId map_id, const SeenThroughOptions& options);

}  // namespace dmslam
