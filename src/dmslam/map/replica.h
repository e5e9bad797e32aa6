#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// A copy of the map of another process, made of that map's deltas alone. Whoever holds one reads it, and
/// cannot edit it.
class Replica : public Map {
 public:
  using Map::Map;
  /// Begins with what another process holds.
  explicit Replica(Map map) : Map(std::move(map)) {}

  /// Applies a delta of the writer's map. Twice is once. What refers to unknown ids is skipped and counted.
  void Apply(const MapDelta& delta);
  /// Forgets all: another map, or a snapshot, begins.
  void Clear();

  /// Keyframes that the last Apply brought and took, for readers with indices.
  const std::vector<KeyframeId>& applied_new_keyframes() const { return applied_new_keyframes_; }
  const std::vector<KeyframeId>& applied_removed_keyframes() const { return applied_removed_keyframes_; }
  uint64_t skipped_references() const { return skipped_references_; }

 private:
  void ApplyKeyframes(const MapDelta& delta);
  void ApplyLandmarks(const MapDelta& delta);
  void ApplyObservations(const MapDelta& delta);
  void ApplyTombstones(const MapDelta& delta);
  Keyframe* FindOrInsert(const KeyframeState& state);
  void RemoveLandmark(const Landmark& landmark);
  void RemoveKeyframe(Keyframe& keyframe);

  std::vector<KeyframeId> applied_new_keyframes_;
  std::vector<KeyframeId> applied_removed_keyframes_;
  uint64_t skipped_references_ = 0;
};

}  // namespace dmslam
