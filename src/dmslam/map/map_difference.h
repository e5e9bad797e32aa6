#pragma once

#include <optional>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// Names that one of two maps has, and how many both have.
template <typename Id>
struct NamesApart {
  std::vector<Id> only_a, only_b;  ///< sorted
  size_t both = 0;
};

/// By how much things stand elsewhere, in units of depth: a camera's of the median depth of what it sees, a
/// landmark's of its distance from its reference keyframe (in the map where that is larger).
struct Displacement {
  size_t moved = 0;  ///< of those in both, not exactly where they were
  double median_depths = 0, max_depths = 0;
};

/// One map of `a` beside the map of `b` that has most of its keyframes.
struct CommonMap {
  MapId a = 0, b = 0;
  size_t keyframes = 0, landmarks = 0;  ///< in both
  /// How the map as a whole lies in `b`, from the places of the cameras: a map that was joined with another
  /// lies elsewhere, and is larger or smaller. None: it lies where it lay, or too few cameras tell.
  std::optional<Sim3d> S_b_a;
  Displacement cameras, points;  ///< beyond that
};

/// What `b` has that `a` has not, and the reverse. Things are the same where they are called the same:
/// keyframes by session and frame, landmarks by their ids. What is known of the dead, and how far the streams
/// are, is not compared.
struct MapDifference {
  NamesApart<MapId> maps;
  NamesApart<KeyframeId> keyframes;
  NamesApart<LandmarkId> landmarks;
  std::vector<KeyframeId> other_times;  ///< in both, but not taken at the same time: other runs, one number
  size_t changed_keyframes = 0;         ///< in both, with another parent, other loops or in another map
  size_t changed_landmarks = 0;         ///< in both, seen by others, or with another history
  std::vector<CommonMap> common;

  bool Equal() const;
};

MapDifference Compare(const Map& a, const Map& b);

}  // namespace dmslam
