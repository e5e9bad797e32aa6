#pragma once

#include <algorithm>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/map/may_drop.h"

namespace dmslam {

/// The maps that one camera begins, by their numbers. Each camera has a range of its own, as the others
/// number theirs at the same time.
class OwnMaps {
 public:
  explicit OwnMaps(CameraId camera) : camera_(camera), newest_(First()) {}

  MapId First() const { return camera_ * kMapsPerCamera + 1; }
  /// A map has this number, or had it: one of this camera's is not given to another.
  void Take(MapId taken) {
    if (taken / kMapsPerCamera == camera_) newest_ = std::max(newest_, taken);
  }
  /// A number that no map has had: those of a saved one are taken, and those of maps that were joined.
  MapId Next(const Map& map) {
    for (const auto& [id, keyframe] : map.keyframes()) Take(keyframe.map_id);
    return ++newest_;
  }

  void Drop(MapId map_id) { dropped_ = map_id; }
  /// Whether the map that was dropped last is still there: the mapper has not heard of it yet. Not where it
  /// was joined with another meanwhile, and stays.
  bool HasDropped(const Map& map) const {
    return dropped_ && map.HasMap(*dropped_) && MayDrop(map, *dropped_, camera_);
  }

 private:
  CameraId camera_;
  MapId newest_;  ///< the highest number that was given to a map that this camera began
  std::optional<MapId> dropped_;
};

}  // namespace dmslam
