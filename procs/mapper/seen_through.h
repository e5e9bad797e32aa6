#pragma once

#include <cstdint>

#include "dmslam/map/map.h"
#include "mapper/mapper_options.h"

namespace dmslam {

/// Somebody who stands still is mapped like furniture, but what stands behind him is seen through him as soon
/// as he has left, and was before he came. A landmark is *proven* when it was seen over a longer time than
/// people stand. One that is not is *seen through* when keyframes from another time have landmarks at its
/// pixel that lie behind it, and none at its depth: free-space carving with the map's own points. Its
/// neighbours in the image and in depth go with it.

/// Removes those among the landmarks that keyframe `id` sees. Witnesses are the keyframes that look at the
/// same place. Returns how many.
int RemoveSeenThrough(Map& map, KeyframeId id, const SeenThroughOptions& options);

/// The same over a whole map when its sequence has ended. Where so many of the unproven were seen through
/// (now, or `removed_before` while mapping) that somebody must have stood there, unproven landmarks that were
/// ever found elsewhere go too, and those that nothing supports. Returns how many.
int RemoveUnproven(Map& map, MapId map_id, uint64_t removed_before, const SeenThroughOptions& options);

}  // namespace dmslam
