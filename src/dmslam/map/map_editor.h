#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "dmslam/map/map.h"
#include "dmslam/map/map_journal.h"

namespace dmslam {

/// The map of its one writer, the mapper. Every edit is remembered, and `TakeDelta` turns what was edited
/// since the last one into absolute values for everybody else's `Replica`.
///
/// Ids must be those of what is in the map.
class MapEditor : public Map {
 public:
  using Map::Map;
  /// Continues a map, of which everybody is taken to know all.
  explicit MapEditor(Map map) : Map(std::move(map)) {}

  /// Adds a keyframe without landmarks; observations are added one by one.
  const Keyframe& AddKeyframe(Keyframe keyframe);
  /// Adds a landmark without observations.
  const Landmark& AddLandmark(Landmark landmark);
  /// Feature `feature` of `keyframe` sees `landmark`. Replaces what the feature saw; a landmark has at most
  /// one feature per keyframe (an older one is released).
  void SetObservation(KeyframeId keyframe, uint16_t feature, LandmarkId landmark);
  void ClearObservation(KeyframeId keyframe, uint16_t feature);
  void SetPose(KeyframeId id, const Rigid3d& T_cam_world);
  /// The pose after a correction that also scales by `factor` what hangs on the keyframe.
  void SetPoseAndScale(KeyframeId id, const Rigid3d& T_cam_world, double factor);
  void SetPosition(LandmarkId id, const Eigen::Vector3d& p_world);
  void SetEvidence(LandmarkId id, const LandmarkEvidence& evidence);
  void SetParent(KeyframeId id, KeyframeId parent);
  void AddLoopEdge(KeyframeId a, KeyframeId b);
  void SetMapId(KeyframeId id, MapId map_id);
  void SetMapId(LandmarkId id, MapId map_id);
  /// Chooses the descriptor nearest to all observations (least median distance).
  void UpdateDescriptor(LandmarkId id);
  /// Moves all observations of `from` to `into` (unless the keyframe sees `into` already) and leaves a
  /// tombstone.
  void Fuse(LandmarkId from, LandmarkId into);
  void RemoveLandmark(LandmarkId id);
  /// Removes a keyframe: its children get new parents, a tombstone keeps its place relative to its parent,
  /// landmarks that nobody sees any more go with it. A map's first keyframe cannot be removed.
  void RemoveKeyframe(KeyframeId id);
  /// Forgets the keyframes and landmarks of a whole map.
  void DropMap(MapId map_id);
  void SetProgress(const MapProgress& progress) { SetProgressTo(progress); }

  /// What changed since the last call, as absolute values, with the next version number. What else the header
  /// holds is the caller's.
  MapDelta TakeDelta(MapEvent event, std::optional<KeyframeId> about, std::optional<MapId> map_id);

 private:
  void ReparentChildren(const Keyframe& removed);
  void EraseAndForget(KeyframeId id);
  void EraseAndForget(LandmarkId id);

  MapJournal journal_;
};

}  // namespace dmslam
