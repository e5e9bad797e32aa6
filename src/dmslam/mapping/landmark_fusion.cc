#include "dmslam/mapping/landmark_fusion.h"

#include <algorithm>
#include <optional>
#include <set>

#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/map/neighbourhood.h"
#include "dmslam/map/projection.h"

namespace dmslam {
namespace {

constexpr int kNeighbours = 20, kNeighboursOfEach = 5;

/// Keyframes in which to search for a keyframe's landmarks, each listed once.
class Targets {
 public:
  explicit Targets(const Keyframe& keyframe) : listed_{keyframe.id} {}

  bool Add(const Keyframe* keyframe) {
    if (!listed_.insert(keyframe->id).second) return false;
    keyframes_.push_back(keyframe);
    return true;
  }
  const std::vector<const Keyframe*>& keyframes() const { return keyframes_; }

 private:
  std::vector<const Keyframe*> keyframes_;
  std::set<KeyframeId> listed_;
};

void AddNeighboursOfNeighbours(const Map& map, const Keyframe& keyframe, int min_covisibility,
                               Targets* targets) {
  const std::vector<const Keyframe*> first = map.BestCovisible(keyframe, kNeighbours, min_covisibility);
  for (const Keyframe* neighbour : first) targets->Add(neighbour);
  for (const Keyframe* neighbour : first) {
    for (const Keyframe* second : map.BestCovisible(*neighbour, kNeighboursOfEach, min_covisibility))
      targets->Add(second);
  }
}

/// Keyframes that look at the same place from nearby, whether they share landmarks or not: where drift is
/// small, a place that is seen again is joined with itself here, without a loop.
void AddKeyframesNearby(const Map& map, const Keyframe& keyframe, const MapperOptions& options,
                        Targets* targets) {
  const double depth = map.MedianDepth(keyframe).value_or(0.0);
  int added = 0;
  for (const Keyframe* near :
       map.KeyframesNear(keyframe, options.nearby_distance * depth, options.nearby_angle_rad)) {
    if (added == options.nearby_keyframes) return;
    if (targets->Add(near)) ++added;
  }
}

std::vector<LandmarkId> LandmarksInOrderOfFeatures(const Keyframe& keyframe) {
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : keyframe.landmarks) {
    if (id.valid()) ids.push_back(id);
  }
  return ids;
}

/// The feature that sees this landmark, as far as place and descriptor can say.
std::optional<uint16_t> FeatureAt(const Map& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                                  const Landmark& landmark, const MapperOptions& options) {
  static const std::vector<uint8_t> kNoneTaken;
  const std::optional<LandmarkView> view = PredictView(map, landmark, T_cam_world);
  if (!view) return std::nullopt;
  const double radius_px =
      SearchRadiusPx(map.camera(), options.fuse_radius_rad) * map.pyramid().SearchScale(view->octave);
  const std::optional<FeatureHit> hit =
      FindFeature(*keyframe.features, view->uv_px, radius_px, std::max(0, view->octave - 1), view->octave,
                  landmark.descriptor, kNoneTaken);
  if (!hit || hit->distance > options.max_fuse_distance) return std::nullopt;
  const double error = NormalizedErrorSquared(*keyframe.features, hit->feature, view->uv_px, map.pyramid());
  if (error > options.creation.triangulation.reprojection_sigmas_squared) return std::nullopt;
  return static_cast<uint16_t>(hit->feature);
}

/// Joins a landmark with what the feature sees already.
FusionCounts JoinAt(MapEditor& map, const Keyframe& keyframe, uint16_t feature, const Landmark& landmark) {
  const Landmark* other = map.LandmarkSeenBy(keyframe, feature);
  if (other == nullptr) {
    map.SetObservation(keyframe, feature, landmark);
    map.UpdateDescriptor(landmark);
    return {.landmarks = 0, .observations = 1};
  }
  const size_t mine = landmark.observations.size(), theirs = other->observations.size();
  const bool keep_other = theirs > mine || (theirs == mine && other->id < landmark.id);
  const Landmark &stays = keep_other ? *other : landmark, &goes = keep_other ? landmark : *other;
  map.Fuse(goes, stays, Merged(stays.evidence, goes.evidence));
  return {.landmarks = 1, .observations = 0};
}

}  // namespace

FusionCounts FuseInto(MapEditor& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                      const std::vector<LandmarkId>& landmarks, const MapperOptions& options) {
  FusionCounts fused;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.FindLandmark(id);
    if (landmark == nullptr || landmark->SeenBy(keyframe.id) != nullptr) continue;
    if (options.belief.enabled && !IsStatic(landmark)) continue;
    const std::optional<uint16_t> feature = FeatureAt(map, keyframe, T_cam_world, *landmark, options);
    if (!feature) continue;
    fused += JoinAt(map, keyframe, *feature, *landmark);
  }
  return fused;
}

FusionCounts FuseWithNeighbours(MapEditor& map, const Keyframe& keyframe, const MapperOptions& options) {
  Targets targets(keyframe);
  AddNeighboursOfNeighbours(map, keyframe, options.min_covisibility, &targets);
  AddKeyframesNearby(map, keyframe, options, &targets);
  FusionCounts fused;
  std::vector<KeyframeId> ids;
  for (const Keyframe* target : targets.keyframes()) {
    fused += FuseInto(map, *target, target->T_cam_world, LandmarksInOrderOfFeatures(keyframe), options);
    ids.push_back(target->id);
  }
  fused += FuseInto(map, keyframe, keyframe.T_cam_world, LandmarksSeenBy(map, ids), options);
  return fused;
}

}  // namespace dmslam
