#include "dmslam/mapping/landmark_fate.h"

#include <optional>
#include <set>
#include <utility>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/mapping/culling.h"

namespace dmslam {

void LandmarkFates::Follow(const Map& map, const MapDelta& delta) {
  if (delta.event == MapEvent::kSnapshot) {
    assume_order_ = true;
    return;
  }
  if (std::exchange(assume_order_, false)) order_.Assume(map);
  if (delta.event == MapEvent::kKeyframeInserted && delta.about) order_.Add(*delta.about);
  if (delta.event != MapEvent::kMapStarted) return;
  std::set<KeyframeId> first_map;  // those that did not hold are gone, but count
  for (const KeyframeState& keyframe : delta.keyframes) first_map.insert(keyframe.id);
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) first_map.insert(tombstone.id);
  for (const KeyframeId id : first_map) order_.Add(id);
}

LandmarkFate LandmarkFates::Of(const LandmarkTombstone& tombstone, const Map& map,
                               const MapDelta& delta) const {
  if (tombstone.replaced_by) return LandmarkFate::kFused;
  const Landmark* landmark = map.FindLandmark(tombstone.id);
  switch (delta.event) {
    case MapEvent::kLandmarksCreated:
      return WhileMaking(map, landmark);
    case MapEvent::kEvidence:
      return LandmarkFate::kMoved;
    case MapEvent::kMapStarted:
    case MapEvent::kAdjusted:
      return LandmarkFate::kUnheld;
    case MapEvent::kMapped:
      return LandmarkFate::kKeyframeCulled;
    case MapEvent::kMapAdjusted:
      return WhenAdjusted(map, landmark, delta);
    case MapEvent::kRequestDone:
    case MapEvent::kEnded:
      return LandmarkFate::kUnproven;
    default:
      return LandmarkFate::kNotTold;
  }
}

/// By the mapper's own rule, item by item until it removes the landmark.
LandmarkEvidence LandmarkFates::With(const FrameEvidence& said, const Map& map,
                                     const Landmark& landmark) const {
  LandmarkEvidence evidence = landmark.evidence;
  for (const FrameEvidence::Item& item : said.items) {
    if (map.Resolve(item.landmark) != &landmark) continue;
    evidence = Updated(evidence, item, said.stamp_ns, options_.belief);
    if (IsToBeRemoved(evidence, options_.belief)) break;
  }
  return evidence;
}

/// First those on probation go, then landmarks are made, then those that are seen through go, old or new.
LandmarkFate LandmarkFates::WhileMaking(const Map& map, const Landmark* landmark) const {
  if (landmark == nullptr) return LandmarkFate::kSeenThrough;
  const std::optional<ProbationFault> fault = FaultOnProbation(map, *landmark, order_, options_);
  if (!fault) return LandmarkFate::kSeenThrough;
  return *fault == ProbationFault::kRarelyFound ? LandmarkFate::kRarelyFound : LandmarkFate::kFewObservers;
}

/// Those that are not proven in a map go with the record that follows its adjustment.
LandmarkFate LandmarkFates::WhenAdjusted(const Map& map, const Landmark* landmark,
                                         const MapDelta& delta) const {
  if (landmark == nullptr) return LandmarkFate::kNotTold;
  if (landmark->map_id != delta.map_id) return LandmarkFate::kUnproven;
  return IsTooNear(map, *landmark, options_.min_depth) ? LandmarkFate::kTooNear : LandmarkFate::kUnheld;
}

}  // namespace dmslam
