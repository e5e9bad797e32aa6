#include "dmslam/mapping/landmark_fusion.h"

#include <algorithm>
#include <set>

#include "dmslam/map/projection.h"

namespace dmslam {
namespace {

bool Sees(const Landmark& landmark, KeyframeId keyframe) {
  const auto at = std::lower_bound(landmark.observations.begin(), landmark.observations.end(), keyframe,
                                   [](const Observation& o, KeyframeId id) { return o.keyframe < id; });
  return at != landmark.observations.end() && at->keyframe == keyframe;
}

std::vector<KeyframeId> NeighboursOfNeighbours(const Map& map, KeyframeId id, int min_covisibility,
                                               std::set<KeyframeId>* out_listed) {
  std::vector<KeyframeId> targets = map.BestCovisible(id, 20, min_covisibility);
  std::set<KeyframeId> listed(targets.begin(), targets.end());
  listed.insert(id);
  const size_t first = targets.size();
  for (size_t i = 0; i < first; ++i) {
    for (const KeyframeId second : map.BestCovisible(targets[i], 5, min_covisibility)) {
      if (listed.insert(second).second) targets.push_back(second);
    }
  }
  *out_listed = std::move(listed);
  return targets;
}

/// Keyframes that look at the same place from nearby, whether they share landmarks or not: where drift is
/// small, a place that is seen again is joined with itself here, without a loop.
void AddKeyframesNearby(const Map& map, KeyframeId id, const MapperOptions& options,
                        std::set<KeyframeId>* listed, std::vector<KeyframeId>* targets) {
  const double depth = map.MedianDepth(*map.FindKeyframe(id)).value_or(0.0);
  int added = 0;
  for (const KeyframeId near :
       map.KeyframesNear(id, options.nearby_distance * depth, options.nearby_angle_rad)) {
    if (added == options.nearby_keyframes) return;
    if (!listed->insert(near).second) continue;
    targets->push_back(near);
    ++added;
  }
}

std::vector<LandmarkId> LandmarksOf(const Keyframe& keyframe) {
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : keyframe.landmarks) {
    if (id.valid()) ids.push_back(id);
  }
  return ids;
}

/// Joins a landmark with what the feature sees already.
void JoinAt(MapEditor& map, const Keyframe& keyframe, uint16_t feature, LandmarkId id) {
  const LandmarkId other = keyframe.landmarks[feature];
  if (!other.valid()) {
    map.SetObservation(keyframe.id, feature, id);
    map.UpdateDescriptor(id);
    return;
  }
  if (other == id) return;
  const size_t mine = map.FindLandmark(id)->observations.size();
  const size_t theirs = map.FindLandmark(other)->observations.size();
  const bool keep_other = theirs > mine || (theirs == mine && other < id);
  map.Fuse(keep_other ? id : other, keep_other ? other : id);
}

}  // namespace

int FuseInto(MapEditor& map, KeyframeId id, const Rigid3d& T_cam_world,
             const std::vector<LandmarkId>& landmarks, double radius_px, const MapperOptions& options) {
  const Keyframe& keyframe = *map.FindKeyframe(id);
  const std::vector<uint8_t> none_taken;
  int joined = 0;
  for (const LandmarkId landmark_id : landmarks) {
    const Landmark* landmark = map.FindLandmark(landmark_id);
    if (landmark == nullptr || Sees(*landmark, id)) continue;
    if (options.belief.enabled && !IsStatic(landmark)) continue;
    const auto view = PredictView(map, *landmark, T_cam_world);
    if (!view) continue;
    const double radius = radius_px * map.pyramid().Scale(view->octave);
    const FeatureHit hit = FindFeature(*keyframe.features, view->uv_px, radius, std::max(0, view->octave - 1),
                                       view->octave, landmark->descriptor, none_taken);
    if (hit.feature < 0 || hit.distance > options.max_fuse_distance) continue;
    if (NormalizedErrorSquared(*keyframe.features, hit.feature, view->uv_px, map.pyramid()) >
        options.creation.reprojection_sigmas_squared) {
      continue;
    }
    JoinAt(map, keyframe, static_cast<uint16_t>(hit.feature), landmark_id);
    ++joined;
  }
  return joined;
}

int FuseWithNeighbours(MapEditor& map, KeyframeId id, const MapperOptions& options) {
  std::set<KeyframeId> listed;
  std::vector<KeyframeId> targets = NeighboursOfNeighbours(map, id, options.min_covisibility, &listed);
  AddKeyframesNearby(map, id, options, &listed, &targets);
  int joined = 0;
  for (const KeyframeId target : targets) {
    const std::vector<LandmarkId> mine = LandmarksOf(*map.FindKeyframe(id));
    joined +=
        FuseInto(map, target, map.FindKeyframe(target)->T_cam_world, mine, options.fuse_radius_px, options);
  }
  std::set<LandmarkId> theirs;
  for (const KeyframeId target : targets) {
    for (const LandmarkId landmark : LandmarksOf(*map.FindKeyframe(target))) theirs.insert(landmark);
  }
  joined += FuseInto(map, id, map.FindKeyframe(id)->T_cam_world, {theirs.begin(), theirs.end()},
                     options.fuse_radius_px, options);
  return joined;
}

}  // namespace dmslam
