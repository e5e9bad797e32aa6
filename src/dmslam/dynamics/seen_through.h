#pragma once

#include <cstdint>

#include "dmslam/map/map_editor.h"

namespace dmslam {

/// Whether landmarks of people who stood still are told from furniture.
struct SeenThroughOptions {
  bool enabled = true;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("mapping.seen_through", enabled,
             "landmarks go that other keyframes see through (people who stood)");
    v.InBaseline("off");
    v.InPaper("off");
  }
};

/// Somebody who stands still is mapped like furniture, but what stands behind him is seen through him as soon
/// as he has left, and was before he came. A landmark is *proven* when it was seen over a longer time than
/// people stand. One that is not is *seen through* when keyframes from another time have landmarks at its
/// pixel that lie behind it, and none at its depth: free-space carving with the map's own points. Its
/// neighbours in the image and in depth go with it.

/// Removes those among the landmarks that a keyframe of this map sees. Witnesses are the keyframes that look
/// at the same place. Returns how many.
int RemoveSeenThrough(MapEditor& map, const Keyframe& keyframe);

/// The same over a whole map when its sequence has ended. Where so many of the unproven were seen through
/// (now, or `removed_before` while mapping) that somebody must have stood there, unproven landmarks that were
/// ever found elsewhere go too, and those that nothing supports; not in a map too short to prove anything.
/// Returns how many.
int RemoveUnproven(MapEditor& map, MapId map_id, uint64_t removed_before);

}  // namespace dmslam
