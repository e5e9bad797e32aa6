#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// What one of two maps has, by the names it has there, and how many both have.
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

/// Why a session that two maps name is not the same run in both, as far as can be seen.
enum class OtherRun : uint8_t {
  kTold,            ///< it was known before
  kOtherTimes,      ///< a frame of one number was taken at other times
  kNoKeyframe,      ///< neither knows a keyframe of the other one's, living or culled
  kOtherLandmarks,  ///< most landmarks of one number were made, and are seen, by other frames
};
using OtherRuns = std::map<uint32_t, OtherRun>;  ///< by session

/// A keyframe that is called the same in two maps, and was taken at two times [ns].
struct OtherTime {
  KeyframeId id;
  int64_t in_a_ns = 0, in_b_ns = 0;
};

/// What `b` has that `a` has not, and the reverse. Things are the same where they are of the same run and
/// have the same number in it: keyframes by session and frame, landmarks by session, which of its mappers
/// made them, and number; maps where they have keyframes in common. Numbers alone say nothing: each run
/// counts anew. What is known of the dead, and how far the streams are, is not compared.
struct MapDifference {
  NamesApart<MapId> maps;
  NamesApart<KeyframeId> keyframes;
  NamesApart<LandmarkId> landmarks;
  OtherRuns other_runs;  ///< of which nothing is compared
  std::vector<OtherTime> other_times;
  size_t changed_keyframes = 0;     ///< in both, with another parent, other loops or in another map
  size_t changed_landmarks = 0;     ///< in both, seen by others, or with another history
  size_t renumbered_landmarks = 0;  ///< in both, by other ordinals: one map was joined with another
  std::vector<CommonMap> common;

  bool Equal() const;
  /// No keyframe and no landmark is in both.
  bool NothingInCommon() const { return keyframes.both == 0 && landmarks.both == 0; }
};

/// `other_runs`: sessions of which it is known that they are other runs in `a` than in `b`.
MapDifference Compare(const Map& a, const Map& b, const std::set<uint32_t>& other_runs = {});

}  // namespace dmslam
