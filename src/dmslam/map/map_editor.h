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
/// Ids are resolved at the border (`Find...`, `At`): what is edited is named by reference, as this map has
/// handed it out.
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
  void SetObservation(const Keyframe& keyframe, uint16_t feature, const Landmark& landmark);
  void ClearObservation(const Keyframe& keyframe, uint16_t feature);
  void SetPose(const Keyframe& keyframe, const Rigid3d& T_cam_world);
  /// The pose after a correction that also scales by `factor` what hangs on the keyframe.
  void SetPoseAndScale(const Keyframe& keyframe, const Rigid3d& T_cam_world, double factor);
  void SetPosition(const Landmark& landmark, const Eigen::Vector3d& p_world);
  /// Moves a landmark as its reference moves. Once between two deltas, and all that have this reference are
  /// either moved so or set: the delta tells the move once for all of them.
  void MoveWithReference(const Landmark& landmark, const Sim3d& after_from_before);
  void SetEvidence(const Landmark& landmark, const LandmarkEvidence& evidence);
  /// `parent` need not be there, and may be none.
  void SetParent(const Keyframe& keyframe, std::optional<KeyframeId> parent);
  void AddLoopEdge(const Keyframe& a, const Keyframe& b);
  void SetMapId(const Keyframe& keyframe, MapId map_id);
  void SetMapId(const Landmark& landmark, MapId map_id);
  /// Chooses the descriptor nearest to all observations (least median distance).
  void UpdateDescriptor(const Landmark& landmark);
  /// Moves all observations of `from` to `into` (unless the keyframe sees `into` already) and leaves a
  /// tombstone. `evidence` is what is known of the two as one.
  void Fuse(const Landmark& from, const Landmark& into, const LandmarkEvidence& evidence);
  void RemoveLandmark(const Landmark& landmark);
  /// Removes a keyframe: its children get new parents, a tombstone keeps its place relative to its parent,
  /// landmarks that nobody sees any more go with it. A map's first keyframe cannot be removed.
  void RemoveKeyframe(const Keyframe& keyframe);
  /// Forgets the keyframes and landmarks of a whole map.
  void DropMap(MapId map_id);
  void SetProgress(const MapProgress& progress) { SetProgressTo(progress); }
  using Map::ForgetProgress;

  /// What changed since the last call, as absolute values, with the next version number. What else the header
  /// holds is the caller's.
  MapDelta TakeDelta(MapEvent event, std::optional<KeyframeId> about, std::optional<MapId> map_id);

 private:
  void ReparentChildren(const Keyframe& removed, KeyframeId parent);
  void TakeFrom(const Keyframe& keyframe, uint16_t feature);
  void EraseAndBury(const Landmark& landmark, std::optional<LandmarkId> replaced_by);

  MapJournal journal_;
};

}  // namespace dmslam
