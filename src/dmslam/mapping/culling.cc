#include "dmslam/mapping/culling.h"

#include <algorithm>

#include "dmslam/map/neighbourhood.h"

namespace dmslam {
namespace {

constexpr int kOtherObservers = 3;     // that make an observation redundant
constexpr int kMostNeighbours = 1000;  // that are looked at

/// Whether enough other keyframes see the landmark at the same or a finer scale.
bool SeenByOthers(const Map& map, const Landmark& landmark, KeyframeId self, int octave) {
  int others = 0;
  for (const Observation& o : landmark.observations) {
    if (o.keyframe == self) continue;
    const int its_octave = map.At(o.keyframe).features->set.keypoints[o.feature].octave;
    if (its_octave <= octave + 1 && ++others >= kOtherObservers) return true;
  }
  return false;
}

bool IsRedundant(const Map& map, const Keyframe& keyframe, double share) {
  int total = 0, redundant = 0;
  for (size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = map.LandmarkSeenBy(keyframe, i);
    if (landmark == nullptr) continue;
    ++total;
    if (SeenByOthers(map, *landmark, keyframe.id, keyframe.features->set.keypoints[i].octave)) ++redundant;
  }
  return redundant > share * total;
}

bool LiesNearer(const Keyframe& keyframe, const Landmark& landmark, double depth) {
  return (keyframe.T_cam_world * landmark.p_world).z() < depth;
}

}  // namespace

std::optional<ProbationFault> FaultOnProbation(const Map& map, const Landmark& landmark,
                                               const InsertionOrder& order, const MapperOptions& options) {
  const int age = order.CountSince(map, landmark.first_keyframe, options.probation_keyframes);
  if (age >= options.probation_keyframes) return std::nullopt;
  const LandmarkEvidence& evidence = landmark.evidence;
  if (evidence.visible > 0 && evidence.found < options.min_found_ratio * evidence.visible)
    return ProbationFault::kRarelyFound;
  const bool few = static_cast<int>(landmark.observations.size()) < options.probation_min_observations;
  if (age >= options.probation_keyframes - 1 && few) return ProbationFault::kFewObservers;
  return std::nullopt;
}

void RemoveWithLonelyLandmarks(MapEditor& map, const Keyframe& keyframe) {
  const std::vector<LandmarkId> seen = keyframe.landmarks;
  map.RemoveKeyframe(keyframe);
  for (const LandmarkId id : seen) {
    const Landmark* left = id.valid() ? map.FindLandmark(id) : nullptr;
    if (left != nullptr && left->observations.size() < 2) map.RemoveLandmark(*left);
  }
}

int CullYoungLandmarks(MapEditor& map, MapId map_id, const InsertionOrder& order,
                       const MapperOptions& options) {
  // A landmark on probation is seen by one of the keyframes around its making.
  const std::vector<KeyframeId> newest = order.Newest(map, map_id, 2 * options.probation_keyframes + 2);
  int culled = 0;
  for (const LandmarkId id : LandmarksSeenBy(map, newest)) {
    const Landmark& landmark = map.At(id);
    if (!FaultOnProbation(map, landmark, order, options)) continue;
    map.RemoveLandmark(landmark);
    ++culled;
  }
  return culled;
}

int CullRedundantKeyframes(MapEditor& map, const Keyframe& keyframe, std::optional<KeyframeId> keep,
                           const MapperOptions& options) {
  int culled = 0;
  for (const Keyframe* neighbour : map.BestCovisible(keyframe, kMostNeighbours, options.min_covisibility)) {
    const bool stays = !neighbour->parent || neighbour->id == keep || !neighbour->loop_edges.empty();
    if (stays || !IsRedundant(map, *neighbour, options.redundant_share)) continue;
    RemoveWithLonelyLandmarks(map, *neighbour);
    ++culled;
  }
  return culled;
}

bool IsTooNear(const Map& map, const Landmark& landmark, double share) {
  return share > 0 && std::ranges::any_of(landmark.observations, [&](const Observation& o) {
           const Keyframe& keyframe = map.At(o.keyframe);
           const std::optional<double> depth = map.MedianDepth(keyframe);
           return depth && LiesNearer(keyframe, landmark, share * *depth);
         });
}

int RemoveTooNear(MapEditor& map, MapId map_id, double share) {
  if (share <= 0) return 0;
  std::vector<const Landmark*> near;
  for (const Keyframe* keyframe : map.KeyframesOf(map_id)) {
    const std::optional<double> depth = map.MedianDepth(*keyframe);
    if (!depth) continue;
    for (size_t i = 0; i < keyframe->landmarks.size(); ++i) {
      const Landmark* landmark = map.LandmarkSeenBy(*keyframe, i);
      if (landmark != nullptr && LiesNearer(*keyframe, *landmark, share * *depth)) near.push_back(landmark);
    }
  }
  std::ranges::sort(near, {}, &Landmark::id);
  near.erase(std::unique(near.begin(), near.end()), near.end());
  for (const Landmark* landmark : near) map.RemoveLandmark(*landmark);
  return static_cast<int>(near.size());
}

}  // namespace dmslam
