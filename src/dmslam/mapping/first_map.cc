#include "dmslam/mapping/first_map.h"

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "dmslam/mapping/culling.h"
#include "dmslam/mapping/keyframe_insertion.h"
#include "dmslam/optimization/map_adjustment.h"

namespace dmslam {
namespace {

constexpr int kIterations = 20;
/// Standard deviation of a keypoint [pixels of its level]: the first map's matches were selected with this
/// one (Pyramid::Sigma), and with less the adjustment would clear some of those that were admitted.
constexpr double kSelectedSigmaPx = 1.0;
constexpr int kMinLandmarks = 40;
constexpr int kMinSights = 20;  // of a view between: fewer do not fix its pose

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

/// In the map of `first`, where the proposal puts it from there.
const Keyframe& AddBeside(MapEditor& map, const Keyframe& first, const KeyframeProposal& proposal) {
  Keyframe keyframe = MakeKeyframe(map, proposal, proposal.T_cam_reference);
  keyframe.map_id = first.map_id;
  keyframe.parent = first.id;
  return map.AddKeyframe(std::move(keyframe));
}

/// The landmarks of the points, in their order; null where a point names a feature that is not there.
std::vector<const Landmark*> AddLandmarks(MapEditor& map, const InitialMap& proposal, const Keyframe& first,
                                          const Keyframe& second, LandmarkMaker& maker) {
  std::vector<const Landmark*> landmarks;
  for (const InitialMap::Point& point : proposal.points) {
    landmarks.push_back(nullptr);
    const bool known =
        point.feature_first < first.landmarks.size() && point.feature_second < second.landmarks.size();
    if (!known) continue;
    const Landmark& landmark = maker.Add(map, first, second, point.p_world);
    map.SetObservation(first, point.feature_first, landmark);
    map.SetObservation(second, point.feature_second, landmark);
    landmarks.back() = &landmark;
  }
  return landmarks;
}

/// Null where the frame is known.
const Keyframe* AddViewBetween(MapEditor& map, const InitialMap::View& view, const Keyframe& first,
                               const std::vector<const Landmark*>& landmarks) {
  if (map.HasKnown(view.keyframe.id)) return nullptr;
  const Keyframe& keyframe = AddBeside(map, first, view.keyframe);
  for (const InitialMap::View::Sight& sight : view.sights) {
    const bool known = sight.point < landmarks.size() && landmarks[sight.point] != nullptr &&
                       sight.feature < keyframe.landmarks.size();
    if (known) map.SetObservation(keyframe, sight.feature, *landmarks[sight.point]);
  }
  return &keyframe;
}

}  // namespace

bool BuildFirstMap(MapEditor& map, const InitialMap& proposal, LandmarkMaker& maker) {
  const Keyframe& first = map.AddKeyframe(MakeKeyframe(map, proposal.first, Rigid3d()));
  const Keyframe& second = AddBeside(map, first, proposal.second);
  const std::vector<const Landmark*> landmarks = AddLandmarks(map, proposal, first, second, maker);
  std::vector<const Keyframe*> between;
  for (const InitialMap::View& view : proposal.between)
    between.push_back(AddViewBetween(map, view, first, landmarks));
  for (const Landmark* landmark : landmarks) {
    if (landmark != nullptr) map.UpdateDescriptor(*landmark);
  }
  AdjustWholeMap(map, proposal.map_id, kIterations, kSelectedSigmaPx, nullptr);
  // Before it is scaled: one that nothing holds may be anywhere.
  for (const Keyframe* view : between) {
    if (view != nullptr && map.CountTracked(*view, 2) < kMinSights) RemoveWithLonelyLandmarks(map, *view);
  }
  if (std::min(map.CountTracked(first, 2), map.CountTracked(second, 2)) < kMinLandmarks) return false;
  ScaleToUnitDepth(map, first);
  return true;
}

}  // namespace dmslam
