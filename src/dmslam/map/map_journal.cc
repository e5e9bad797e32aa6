#include "dmslam/map/map_journal.h"

#include <algorithm>

#include "dmslam/map/map_states.h"

namespace dmslam {
namespace {

template <typename Change>
bool Has(uint8_t changes, Change change) {
  return (changes & static_cast<uint8_t>(change)) != 0;
}

}  // namespace

void MapJournal::Forget(KeyframeId id) {
  keyframes_.erase(id);
  observations_.erase(observations_.lower_bound({id, 0}), observations_.upper_bound({id, 0xffff}));
}

void MapJournal::NoteMoveWithReference(const Landmark& landmark, const Sim3d& after_from_before) {
  const Sim3d& noted = reference_moves_.emplace(landmark.reference, after_from_before).first->second;
  if (!(noted == after_from_before)) Note(landmark.id, LandmarkChange::kPosition);
}

void MapJournal::Write(const Map& map, MapDelta* delta) const {
  for (const auto& [id, changes] : keyframes_) {
    const Keyframe& keyframe = map.At(id);
    const bool with_features = Has(changes, KeyframeChange::kFeatures);
    if (with_features || Has(changes, KeyframeChange::kState)) {
      delta->keyframes.push_back(StateOf(keyframe, with_features));
    } else {
      delta->keyframe_poses.push_back({id, keyframe.T_cam_world, keyframe.scale});
    }
  }
  for (const auto& [reference, move] : reference_moves_) delta->reference_moves.push_back({reference, move});
  std::vector<std::pair<LandmarkId, uint8_t>> landmarks(landmarks_.begin(), landmarks_.end());
  std::sort(landmarks.begin(), landmarks.end());
  for (const auto& [id, changes] : landmarks) {
    const Landmark& landmark = map.At(id);
    if (Has(changes, LandmarkChange::kState)) {
      delta->landmarks.push_back(StateOf(landmark));
      continue;
    }
    if (Has(changes, LandmarkChange::kPosition)) delta->landmark_positions.push_back({id, landmark.p_world});
    if (Has(changes, LandmarkChange::kEvidence)) delta->landmark_evidence.push_back({id, landmark.evidence});
  }
  for (const auto& [keyframe, feature] : observations_) {
    delta->observations.push_back({keyframe, feature, ObservedBy(map.At(keyframe), feature)});
  }
  for (const KeyframeId id : keyframe_tombstones_) {
    delta->keyframe_tombstones.push_back(map.keyframe_tombstones().at(id));
  }
  for (const LandmarkId id : landmark_tombstones_) {
    delta->landmark_tombstones.push_back({id, map.landmark_tombstones().at(id)});
  }
  delta->dropped_maps = dropped_maps_;
}

}  // namespace dmslam
