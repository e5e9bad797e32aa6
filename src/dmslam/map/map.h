#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/map/landmark.h"
#include "dmslam/map/map_delta.h"

namespace dmslam {

/// Keyframes, landmarks, who sees what, the covisibility graph and the spanning tree: the same class in the
/// mapper, who edits it, and in every replica, which only applies deltas. Every edit is remembered, and
/// `TakeDelta` turns what was edited since the last one into absolute values.
///
/// Order: keyframes iterate by id. Landmarks are stored by hash and are never iterated in that order; go
/// through keyframes' features or `LandmarkIdsSorted`.
class Map {
 public:
  Map(const Camera& camera, const Pyramid& pyramid);

  // Reading.
  const Camera& camera() const { return camera_; }
  const Pyramid& pyramid() const { return pyramid_; }
  uint64_t version() const { return version_; }
  const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  size_t num_landmarks() const { return landmarks_.size(); }
  const Keyframe* FindKeyframe(KeyframeId id) const;
  const Landmark* FindLandmark(LandmarkId id) const;
  std::vector<LandmarkId> LandmarkIdsSorted() const;
  /// The landmark that stands for `id` now: itself, or what it was fused into; none when culled or unknown.
  std::optional<LandmarkId> Resolve(LandmarkId id) const;
  /// Pose of a keyframe, through its tombstones when it was culled: T_kf_world. None when unknown.
  struct ResolvedPose {
    Rigid3d T_cam_world;
    double scale = 1.0;
    MapId map_id = 0;
    /// The pose of something told relative to this keyframe when its scale was `scale_then`.
    Rigid3d Compose(const Rigid3d& T_other_kf, double scale_then) const;
  };
  std::optional<ResolvedPose> ResolvePose(KeyframeId id) const;
  /// The keyframe that stands for `id` now: itself, or the nearest ancestor that is left.
  std::optional<KeyframeId> ResolveKeyframe(KeyframeId id) const;
  /// Spanning tree: who has `id` for its parent, sorted.
  const std::vector<KeyframeId>& Children(KeyframeId id) const;
  const std::map<KeyframeId, KeyframeTombstone>& keyframe_tombstones() const { return keyframe_tombstones_; }
  /// What dead landmarks were fused into; 0: culled. Of those that died last (kLandmarkTombstones, some
  /// minutes' worth): keyframes in flight, and what the frontend keeps of its newest frames, refer to no
  /// older ones.
  const std::map<LandmarkId, LandmarkId>& landmark_tombstones() const { return landmark_tombstones_; }
  static constexpr size_t kLandmarkTombstones = 32768;
  /// Keyframes that share at least `min_shared` landmarks with `id`, most first (ties: older first), at most
  /// `most`.
  std::vector<KeyframeId> BestCovisible(KeyframeId id, int most, int min_shared = 15) const;
  /// The other keyframes of the same map whose cameras stand nearer to that of `id` than `distance` and are
  /// turned from it by less than `angle_rad`, nearest first.
  std::vector<KeyframeId> KeyframesNear(KeyframeId id, double distance, double angle_rad) const;
  /// How many landmarks of a keyframe have at least `min_observations` observers.
  int CountTracked(const Keyframe& keyframe, int min_observations) const;
  /// Median depth of a keyframe's landmarks in its camera; none without landmarks.
  std::optional<double> MedianDepth(const Keyframe& keyframe) const;
  /// Direction and distances from which a landmark was seen (computed when stale).
  const Landmark::ViewingRange& Viewing(LandmarkId id) const;

  // Editing (the mapper, and Apply). Ids must exist unless said otherwise.
  void AddKeyframe(Keyframe keyframe);  ///< without landmarks; observations are added one by one
  void AddLandmark(Landmark landmark);  ///< without observations
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
  /// landmarks that nobody sees any more go with it.
  void RemoveKeyframe(KeyframeId id);
  /// Forgets a whole map: keyframes, landmarks, and their tombstones.
  void DropMap(MapId map_id);

  /// What changed since the last call, as absolute values, with the next version number. `event`, `about` and
  /// the rest of the header are the caller's.
  MapDelta TakeDelta(MapEvent event, KeyframeId about, MapId map_id);
  /// Applies a delta of a writer's map to this replica. What refers to unknown ids is skipped and counted.
  void Apply(const MapDelta& delta);
  /// How far the streams are that the map is made of; travels with every delta and snapshot.
  const MapProgress& progress() const { return progress_; }
  void SetProgress(const MapProgress& progress) { progress_ = progress; }
  /// Highest ordinal of an epoch of which the map knows a landmark, living or dead; 0: of none.
  uint16_t HighestOrdinal() const;
  uint64_t skipped_references() const { return skipped_references_; }
  /// The whole map as deltas with at most `max_bytes_hint` of payload each, keyframes near `center` first.
  /// Applying all of them to an empty map gives this one.
  std::vector<MapDelta> Snapshot(KeyframeId center, size_t max_bytes_hint) const;

  /// Landmarks touched by the last Apply (new, moved, or with changed observations), sorted; for readers with
  /// indices.
  const std::vector<KeyframeId>& applied_new_keyframes() const { return applied_new_keyframes_; }
  const std::vector<KeyframeId>& applied_removed_keyframes() const { return applied_removed_keyframes_; }

 private:
  enum LandmarkDirty : uint8_t { kPositionDirty = 1, kEvidenceDirty = 2, kStateDirty = 4 };
  enum KeyframeDirty : uint8_t { kPoseDirty = 1, kKeyframeStateDirty = 2, kFeaturesDirty = 4 };

  /// Where a camera stands. Kept beside the keyframes, which lie all over the memory: thousands are compared
  /// at a time.
  struct Standpoint {
    KeyframeId id;
    MapId map_id = 0;
    Eigen::Vector3d center;
  };

  Keyframe& MutableKeyframe(KeyframeId id);
  void UpdateStandpoint(const Keyframe& keyframe);
  Landmark& MutableLandmark(LandmarkId id);
  void Link(const Landmark& landmark, KeyframeId keyframe, int sign);
  void Attach(KeyframeId child, KeyframeId parent);
  void Detach(KeyframeId child, KeyframeId parent);
  void ReparentChildren(const Keyframe& removed);
  KeyframeState StateOf(const Keyframe& keyframe, bool with_features) const;
  static LandmarkState StateOf(const Landmark& landmark);
  void ApplyKeyframes(const MapDelta& delta);
  void ApplyLandmarks(const MapDelta& delta);
  void ApplyTombstones(const MapDelta& delta);
  void EraseKeyframe(KeyframeId id);
  void EraseLandmark(LandmarkId id);
  void RefreshViewing(Landmark& landmark) const;
  void ClearJournal();
  void Bury(LandmarkId id, LandmarkId replaced_by);
  void ForgetOldTombstones();
  void ForgetMap(MapId map_id);

  Camera camera_;
  Pyramid pyramid_;
  uint64_t version_ = 0;
  MapProgress progress_;
  uint64_t skipped_references_ = 0;
  std::map<KeyframeId, Keyframe> keyframes_;
  std::vector<Standpoint> standpoints_;  ///< of all keyframes, by id
  mutable std::unordered_map<LandmarkId, Landmark> landmarks_;
  std::map<KeyframeId, std::vector<KeyframeId>>
      children_;  ///< by parent, whether the parent is known yet or not
  std::map<KeyframeId, KeyframeTombstone> keyframe_tombstones_;
  std::map<LandmarkId, LandmarkId> landmark_tombstones_;
  std::deque<LandmarkId> burials_;  ///< their ids in the order of death

  std::map<KeyframeId, uint8_t> dirty_keyframes_;
  std::unordered_map<LandmarkId, uint8_t> dirty_landmarks_;
  std::set<std::pair<KeyframeId, uint16_t>> dirty_observations_;
  std::vector<KeyframeId> new_keyframe_tombstones_;
  std::vector<LandmarkId> new_landmark_tombstones_;
  std::vector<MapId> dropped_maps_;
  std::vector<KeyframeId> applied_new_keyframes_;
  std::vector<KeyframeId> applied_removed_keyframes_;
};

}  // namespace dmslam
