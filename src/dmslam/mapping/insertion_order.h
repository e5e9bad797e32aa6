#pragma once

#include <deque>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// The order in which keyframes were inserted, which is not always that of their stamps: the newest ones.
class InsertionOrder {
 public:
  void Add(KeyframeId id);
  /// Of a map that others made: by stamp, as nothing better is known than which keyframe was settled last.
  void Assume(const Map& map);
  /// How many keyframes of its camera were inserted after `id`, up to `most`; culled ones count.
  int CountSince(const Map& map, KeyframeId id, int most) const;
  /// The newest keyframes of a map, up to `most` of each camera.
  std::vector<KeyframeId> Newest(const Map& map, MapId map_id, int most) const;

 private:
  std::deque<KeyframeId> ids_;
};

}  // namespace dmslam
