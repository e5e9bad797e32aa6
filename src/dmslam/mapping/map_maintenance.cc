#include "dmslam/mapping/map_maintenance.h"

#include <algorithm>

namespace dmslam {
namespace {

constexpr size_t kRememberedOrder = 1024;  // keyframes

bool FailsProbation(const Map& map, const Landmark& landmark, const InsertionOrder& order,
                    const MapperOptions& options) {
  const int age = order.CountSince(map, landmark.first_keyframe, options.probation_keyframes);
  if (age >= options.probation_keyframes) return false;
  const LandmarkEvidence& evidence = landmark.evidence;
  if (evidence.visible > 0 && evidence.found < options.min_found_ratio * evidence.visible) return true;
  return age >= options.probation_keyframes - 1 &&
         static_cast<int>(landmark.observations.size()) < options.probation_min_observations;
}

/// Whether at least three other keyframes see the landmark at the same or a finer scale.
bool SeenByThreeOthers(const Map& map, const Landmark& landmark, KeyframeId self, int octave) {
  int others = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == self) continue;
    if (map.FindKeyframe(o.keyframe)->features->set.keypoints[o.feature].octave <= octave + 1 &&
        ++others >= 3) {
      return true;
    }
  }
  return false;
}

bool IsRedundant(const Map& map, const Keyframe& keyframe, double share) {
  int total = 0, redundant = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const LandmarkId id = keyframe.landmarks[i];
    const Landmark* landmark = id.valid() ? map.FindLandmark(id) : nullptr;
    if (landmark == nullptr) continue;
    ++total;
    if (SeenByThreeOthers(map, *landmark, keyframe.id, keyframe.features->set.keypoints[i].octave))
      ++redundant;
  }
  return redundant > share * total;
}

}  // namespace

void InsertionOrder::Add(KeyframeId id) {
  ids_.push_back(id);
  if (ids_.size() > kRememberedOrder) ids_.pop_front();
}

void InsertionOrder::Assume(const Map& map) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, keyframe] : map.keyframes()) ids.push_back(id);
  for (const auto& [id, tombstone] : map.keyframe_tombstones()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  const auto settled = std::find(ids.begin(), ids.end(), map.progress().settled);
  if (settled != ids.end()) std::rotate(settled, settled + 1, ids.end());
  ids_.assign(ids.end() - static_cast<std::ptrdiff_t>(std::min(ids.size(), kRememberedOrder)), ids.end());
}

int InsertionOrder::CountSince(const Map& map, KeyframeId id, int most) const {
  int count = 0;
  for (auto it = ids_.rbegin(); it != ids_.rend() && *it != id && count < most; ++it) {
    const bool dropped = map.FindKeyframe(*it) == nullptr && !map.keyframe_tombstones().contains(*it);
    if (!dropped) ++count;
  }
  return count;
}

std::vector<KeyframeId> InsertionOrder::Newest(const Map& map, MapId map_id, int most) const {
  std::vector<KeyframeId> newest;
  for (auto it = ids_.rbegin(); it != ids_.rend() && static_cast<int>(newest.size()) < most; ++it) {
    const Keyframe* keyframe = map.FindKeyframe(*it);
    if (keyframe != nullptr && keyframe->map_id == map_id) newest.push_back(*it);
  }
  return newest;
}

int CullYoungLandmarks(MapEditor& map, MapId map_id, const InsertionOrder& order,
                       const MapperOptions& options) {
  // A landmark on probation is seen by one of the keyframes around its making.
  std::vector<LandmarkId> candidates;
  for (const KeyframeId id : order.Newest(map, map_id, 2 * options.probation_keyframes + 2)) {
    for (const LandmarkId landmark : map.FindKeyframe(id)->landmarks) {
      if (landmark.valid()) candidates.push_back(landmark);
    }
  }
  std::sort(candidates.begin(), candidates.end());
  candidates.erase(std::unique(candidates.begin(), candidates.end()), candidates.end());
  int culled = 0;
  for (const LandmarkId id : candidates) {
    if (!FailsProbation(map, *map.FindLandmark(id), order, options)) continue;
    map.RemoveLandmark(id);
    ++culled;
  }
  return culled;
}

int CullRedundantKeyframes(MapEditor& map, KeyframeId id, KeyframeId keep, const MapperOptions& options) {
  int culled = 0;
  for (const KeyframeId neighbour : map.BestCovisible(id, 1000, options.min_covisibility)) {
    const Keyframe& keyframe = *map.FindKeyframe(neighbour);
    if (!keyframe.parent.valid() || neighbour == keep) continue;
    if (!keyframe.loop_edges.empty() || !IsRedundant(map, keyframe, options.redundant_share)) continue;
    const std::vector<LandmarkId> seen = keyframe.landmarks;
    map.RemoveKeyframe(neighbour);
    ++culled;
    for (const LandmarkId landmark : seen) {
      const Landmark* left = landmark.valid() ? map.FindLandmark(landmark) : nullptr;
      if (left != nullptr && left->observations.size() < 2) map.RemoveLandmark(landmark);
    }
  }
  return culled;
}

int RemoveTooNear(MapEditor& map, MapId map_id, double share) {
  if (share <= 0) return 0;
  std::vector<LandmarkId> near;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const std::optional<double> depth = keyframe.map_id == map_id ? map.MedianDepth(keyframe) : std::nullopt;
    if (!depth) continue;
    for (const LandmarkId landmark : keyframe.landmarks) {
      if (!landmark.valid()) continue;
      const double z = (keyframe.T_cam_world * map.FindLandmark(landmark)->p_world).z();
      if (z < share * *depth) near.push_back(landmark);
    }
  }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  for (const LandmarkId id : near) map.RemoveLandmark(id);
  return static_cast<int>(near.size());
}

}  // namespace dmslam
