#pragma once

#include <deque>

#include "dmslam/map/map_editor.h"
#include "dmslam/map/proposals.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// The order in which keyframes were inserted, which is not always that of their stamps: the newest ones.
class InsertionOrder {
 public:
  void Add(KeyframeId id);
  /// Of a map that others made: by stamp, as nothing better is known than which keyframe was settled last.
  void Assume(const Map& map);
  /// How many keyframes were inserted after `id`, up to `most`; culled ones count.
  int CountSince(const Map& map, KeyframeId id, int most) const;
  /// The newest keyframes of a map, up to `most`.
  std::vector<KeyframeId> Newest(const Map& map, MapId map_id, int most) const;

 private:
  std::deque<KeyframeId> ids_;
};

/// Removes landmarks that were made within the last keyframes and do not hold up (ORB-SLAM2's rule): found
/// too rarely, or with too few observers after two keyframes. Returns how many.
int CullYoungLandmarks(MapEditor& map, MapId map_id, const InsertionOrder& order,
                       const MapperOptions& options);

/// Removes neighbours of keyframe `id` whose landmarks others see as well. `keep` is never removed (the
/// frontend tracks against it). Returns how many.
int CullRedundantKeyframes(MapEditor& map, KeyframeId id, KeyframeId keep, const MapperOptions& options);

/// Removes landmarks that lie just before the lens of a keyframe that sees them: nearer than `share` of what
/// the keyframe sees in the median. A mismatch beside the epipole makes them, and one pulls at the poses
/// harder than all others together. Returns how many.
int RemoveTooNear(MapEditor& map, MapId map_id, double share);

}  // namespace dmslam
