#include "dmslam/slam/trajectory_builder.h"

#include <algorithm>

namespace dmslam {

void TrajectoryBuilder::OnFramePose(const FramePose& pose) {
  const auto [it, inserted] = poses_.emplace(pose.frame_index, pose);
  if (inserted) return;
  const bool later = pose.state == TrackingState::kLocalizedLater;
  if (later && pose.HasPose() && it->second.HasPose()) refined_[pose.frame_index] = pose;
  if (!it->second.HasPose() || (pose.HasPose() && !later)) it->second = pose;
}

void TrajectoryBuilder::OnMapReset(const MapReset& reset) {
  if (!reset.drop) return;
  for (auto& [index, pose] : poses_) {
    if (pose.map_id == reset.map_id) pose.reference = {};
  }
  std::erase_if(refined_, [&reset](const auto& entry) { return entry.second.map_id == reset.map_id; });
}

MapId TrajectoryBuilder::MapOfFrame(const FramePose& pose) const {
  if (!pose.HasPose()) return 0;
  const std::optional<Map::ResolvedPose> reference = map_.ResolvePose(pose.reference);
  return reference ? reference->map_id : 0;
}

TrajectoryBuilder::Trajectories TrajectoryBuilder::Build() const {
  std::map<MapId, size_t> frames_of;
  for (const auto& [index, pose] : poses_) {
    const MapId map_id = MapOfFrame(pose);
    if (map_id != 0) ++frames_of[map_id];
  }
  Trajectories result;
  for (const auto& [map_id, count] : frames_of) {
    if (result.map_id == 0 || count > frames_of.at(result.map_id)) result.map_id = map_id;
  }
  for (const auto& [map_id, count] : frames_of) {
    if (map_id != result.map_id) result.other_maps.emplace_back(map_id, count);
  }
  for (const auto& [index, pose] : poses_) {
    if (MapOfFrame(pose) != result.map_id || result.map_id == 0) continue;
    const auto later = refined_.find(index);
    const FramePose& best =
        later != refined_.end() && MapOfFrame(later->second) == result.map_id ? later->second : pose;
    const Map::ResolvedPose reference = *map_.ResolvePose(best.reference);
    const Rigid3d T_cam_world = reference.Compose(best.T_cam_reference, best.reference_scale);
    result.final.push_back({pose.stamp_ns, T_cam_world.Inverse()});
    if (pose.state != TrackingState::kLocalizedLater) {
      result.online.push_back({pose.stamp_ns, pose.T_cam_world.Inverse()});
    }
  }
  for (const auto& [id, keyframe] : map_.keyframes()) {
    if (keyframe.map_id == result.map_id)
      result.keyframes.push_back({keyframe.stamp_ns, keyframe.T_cam_world.Inverse()});
  }
  return result;
}

}  // namespace dmslam
