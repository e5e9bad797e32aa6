#include "dmslam/mapping/first_map.h"

#include <optional>
#include <utility>

#include "dmslam/mapping/keyframe_insertion.h"
#include "dmslam/optimization/map_adjustment.h"

namespace dmslam {
namespace {

constexpr int kIterations = 20;
constexpr int kMinLandmarks = 40;

void ScaleToUnitDepth(MapEditor& map, const Keyframe& first) {
  const std::optional<double> depth = map.MedianDepth(first);
  if (!depth || !(*depth > 0)) return;
  for (const Keyframe* keyframe : map.KeyframesOf(first.map_id)) {
    const Rigid3d& pose = keyframe->T_cam_world;
    map.SetPose(*keyframe, Rigid3d(pose.rotation, pose.translation / *depth));
  }
  for (const Landmark* landmark : map.LandmarksOf(first.map_id))
    map.SetPosition(*landmark, landmark->p_world / *depth);
}

}  // namespace

bool BuildFirstMap(MapEditor& map, const InitialMap& proposal, LandmarkMaker& maker) {
  const Keyframe& first = map.AddKeyframe(MakeKeyframe(map, proposal.first, Rigid3d()));
  Keyframe other = MakeKeyframe(map, proposal.second, proposal.second.T_cam_reference);
  other.parent = first.id;
  const Keyframe& second = map.AddKeyframe(std::move(other));
  for (const InitialMap::Point& point : proposal.points) {
    const bool known =
        point.feature_first < first.landmarks.size() && point.feature_second < second.landmarks.size();
    if (!known) continue;
    const Landmark& landmark = maker.Add(map, first, second, point.p_world);
    map.SetObservation(first, point.feature_first, landmark);
    map.SetObservation(second, point.feature_second, landmark);
    map.UpdateDescriptor(landmark);
  }
  AdjustWholeMap(map, proposal.map_id, kIterations, 1.0, nullptr);
  if (map.CountTracked(second, 2) < kMinLandmarks) return false;
  ScaleToUnitDepth(map, first);
  return true;
}

}  // namespace dmslam
