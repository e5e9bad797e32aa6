#include "dmslam/map/replica.h"

#include <algorithm>
#include <utility>

#include "dmslam/map/map_states.h"

namespace dmslam {

void Replica::Apply(const MapDelta& delta) {
  applied_new_keyframes_.clear();
  applied_removed_keyframes_.clear();
  for (const MapId map_id : delta.dropped_maps) {
    const Forgotten gone = Forget(map_id);
    applied_removed_keyframes_.insert(applied_removed_keyframes_.end(), gone.keyframes.begin(),
                                      gone.keyframes.end());
  }
  if (delta.version > version()) MoveLandmarks(delta.reference_moves);
  ApplyKeyframes(delta);
  ApplyLandmarks(delta);
  ApplyObservations(delta);
  ApplyTombstones(delta);
  SetVersion(std::max(version(), delta.version));
  // The writer has read nothing of any stream: it goes on in a saved map, whatever was told of others before.
  if (delta.progress == MapProgress()) ForgetProgress();
  SetProgressTo(delta.progress);
  ForgetOldTombstones();
  TidyFeatures();
}

void Replica::Clear() {
  Replica empty(camera(), pyramid());
  empty.KeepFeaturesIn(feature_store());
  *this = std::move(empty);
}

Keyframe* Replica::FindOrInsert(const KeyframeState& state) {
  if (Keyframe* keyframe = Find(state.id)) return keyframe;
  if (state.features == nullptr || keyframe_tombstones().contains(state.id)) return nullptr;
  Keyframe keyframe;
  keyframe.id = state.id;
  keyframe.features = MakeFrameFeatures(*state.features, camera(), pyramid());
  applied_new_keyframes_.push_back(state.id);
  return &Insert(std::move(keyframe));
}

void Replica::ApplyKeyframes(const MapDelta& delta) {
  for (const KeyframeState& state : delta.keyframes) {
    Keyframe* keyframe = FindOrInsert(state);
    if (keyframe == nullptr) {
      ++skipped_references_;
      continue;
    }
    keyframe->stamp_ns = state.stamp_ns;
    keyframe->camera_id = state.camera_id;
    keyframe->loop_edges = state.loop_edges;
    Place(*keyframe, state.T_cam_world, state.scale, state.map_id);
    Hang(*keyframe, state.parent);
  }
  for (const KeyframePose& pose : delta.keyframe_poses) {
    if (Keyframe* keyframe = Find(pose.id)) {
      Place(*keyframe, pose.T_cam_world, pose.scale, keyframe->map_id);
    } else {
      ++skipped_references_;
    }
  }
}

void Replica::ApplyLandmarks(const MapDelta& delta) {
  for (const LandmarkState& state : delta.landmarks) {
    Landmark* landmark = Find(state.id);
    if (landmark == nullptr) {
      Landmark made;
      made.id = state.id;
      landmark = &Insert(std::move(made));
    }
    landmark->map_id = state.map_id;
    landmark->descriptor = state.descriptor;
    landmark->first_keyframe = state.first_keyframe;
    landmark->first_ns = state.first_ns;
    landmark->evidence = state.evidence;
    SetReference(*landmark, state.reference);
    Place(*landmark, state.p_world);
  }
  for (const LandmarkPosition& position : delta.landmark_positions) {
    if (Landmark* landmark = Find(position.id)) {
      Place(*landmark, position.p_world);
    } else {
      ++skipped_references_;
    }
  }
  for (const LandmarkEvidenceState& state : delta.landmark_evidence) {
    if (Landmark* landmark = Find(state.id)) {
      landmark->evidence = state.evidence;
    } else {
      ++skipped_references_;
    }
  }
}

/// First all releases, then all observations: a landmark may have changed its feature within a keyframe.
void Replica::ApplyObservations(const MapDelta& delta) {
  for (const ObservationState& o : delta.observations) {
    Keyframe* keyframe = Find(o.keyframe);
    if (keyframe == nullptr || o.feature >= keyframe->landmarks.size()) {
      ++skipped_references_;
    } else if (ObservedBy(*keyframe, o.feature) != o.landmark) {
      Release(*keyframe, o.feature);
    }
  }
  for (const ObservationState& o : delta.observations) {
    Keyframe* keyframe = Find(o.keyframe);
    if (!o.landmark || keyframe == nullptr || o.feature >= keyframe->landmarks.size()) continue;
    if (Landmark* landmark = Find(*o.landmark)) {
      Observe(*keyframe, o.feature, *landmark);
    } else {
      ++skipped_references_;
    }
  }
}

void Replica::ApplyTombstones(const MapDelta& delta) {
  for (const LandmarkTombstone& tombstone : delta.landmark_tombstones) {
    if (const Landmark* landmark = Find(tombstone.id)) RemoveLandmark(*landmark);
    Bury(tombstone.id, tombstone.replaced_by);
  }
  for (const KeyframeTombstone& tombstone : delta.keyframe_tombstones) {
    Bury(tombstone);
    if (Keyframe* keyframe = Find(tombstone.id)) RemoveKeyframe(*keyframe);
  }
}

void Replica::RemoveLandmark(const Landmark& landmark) {
  const std::vector<Observation> observations = landmark.observations;
  for (const Observation& o : observations) Release(Mutable(At(o.keyframe)), o.feature);
  EraseLandmark(landmark.id);
}

void Replica::RemoveKeyframe(Keyframe& keyframe) {
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) Release(keyframe, static_cast<uint16_t>(i));
  applied_removed_keyframes_.push_back(keyframe.id);
  EraseKeyframe(keyframe.id);
}

}  // namespace dmslam
