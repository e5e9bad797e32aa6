#include "dmslam/slam/trajectory_builder.h"

#include <algorithm>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/geometry/uncertain_pose.h"
#include "dmslam/refinement/frame_refiner.h"

namespace dmslam {
namespace {

constexpr int64_t kJoinedNs = 20'000'000'000;  // of a path at a time

/// Where a pose that was told lies now, and how well it was known then.
PoseEstimate EstimateOf(const FramePose& told, const Map::ResolvedPose& reference, int64_t since_ns) {
  Vector6d scale = Vector6d::Ones();  // position first
  scale.head<3>().setConstant(reference.scale / told.reference_scale);
  const Matrix6d covariance = scale.asDiagonal() * FromUpperTriangle(told.covariance) * scale.asDiagonal();
  PoseEstimate estimate;
  estimate.time_s = 1e-9 * static_cast<double>(told.stamp_ns - since_ns);
  estimate.T_cam_world = reference.Compose(told.T_cam_reference, told.reference_scale);
  const auto known = InverseOfPositive(FromPoseInReference(covariance, told.T_cam_reference));
  if (known) estimate.information = *known;
  return estimate;
}

}  // namespace

namespace {

/// Its map was wrong from the beginning: the frame is one from before a first map.
void TakeBack(FramePose* pose) {
  pose->reference.reset();
  pose->state = TrackingState::kNotInitialized;
}

/// World to camera in the units of a world that has grown by `growth`.
Sim3d InGrownWorld(const Rigid3d& T_cam_world, double growth) {
  return Sim3d(T_cam_world.rotation, T_cam_world.translation / growth, 1.0 / growth);
}

}  // namespace

void TrajectoryBuilder::Carry(const Joined& joined, FramePose* pose) {
  pose->map_id = joined.into;
  pose->T_cam_world = (Sim3d(pose->T_cam_world) * joined.S_into_from.Inverse()).ToRigid();
}

std::map<MapId, TrajectoryBuilder::Joined> TrajectoryBuilder::JoinedBy(const MapDelta& delta) const {
  std::map<MapId, Joined> joined;
  for (const KeyframeState& now : delta.keyframes) {
    const Keyframe* then = map_.FindKeyframe(now.id);
    if (then == nullptr || then->map_id == now.map_id) continue;
    const Sim3d S_cam_into = InGrownWorld(now.T_cam_world, now.scale / then->scale);
    joined.try_emplace(then->map_id, Joined{now.map_id, S_cam_into.Inverse() * Sim3d(then->T_cam_world)});
  }
  return joined;
}

void TrajectoryBuilder::OnMapDelta(const MapDelta& delta) {
  const std::map<MapId, Joined> joined = JoinedBy(delta);
  map_.Apply(delta);
  if (delta.event == MapEvent::kMapStarted && delta.map_id) joined_.erase(*delta.map_id);
  if (joined.empty()) return;
  for (auto& [index, pose] : poses_) {
    if (!pose.map_id) continue;
    if (const auto from = joined.find(*pose.map_id); from != joined.end()) Carry(from->second, &pose);
  }
  for (auto& [gone, then] : joined_) {
    const auto next = joined.find(then.into);
    if (next != joined.end()) then = {next->second.into, next->second.S_into_from * then.S_into_from};
  }
  for (const auto& [from, into] : joined) joined_.insert_or_assign(from, into);
}

/// What was told in a map that is part of another by now is taken as told there.
void TrajectoryBuilder::OnFramePose(const FramePose& told) {
  FramePose pose = told;
  if (pose.map_id) {
    if (const auto from = joined_.find(*pose.map_id); from != joined_.end()) Carry(from->second, &pose);
  }
  const auto [it, inserted] = poses_.emplace(FrameName{pose.camera_id, pose.frame_index}, pose);
  if (inserted) return;
  const bool later = pose.state == TrackingState::kLocalizedLater;
  if (later && pose.HasPose() && it->second.HasPose()) refined_[{pose.camera_id, pose.frame_index}] = pose;
  if (!it->second.HasPose() || (pose.HasPose() && !later)) it->second = pose;
}

void TrajectoryBuilder::OnMapReset(const MapReset& reset) {
  if (reset.fate == MapReset::Fate::kKeep) return;
  for (auto& [index, pose] : poses_) {
    if (index.camera == reset.camera_id && pose.map_id == reset.map_id) TakeBack(&pose);
  }
  std::erase_if(refined_, [&reset](const auto& entry) {
    return entry.first.camera == reset.camera_id && entry.second.map_id == reset.map_id;
  });
}

/// Where its reference is no longer known: over the frame that became it, which was placed in the same map.
bool TrajectoryBuilder::Bridge(FramePose* pose) const {
  const auto frame = poses_.find({pose->reference->camera(), pose->reference->frame_index()});
  if (frame == poses_.end() || !MapOfFrame(frame->second)) return false;
  const FramePose& reference = frame->second;
  if (reference.map_id != pose->map_id) return false;  // its units are others
  Rigid3d T_cam_lost = pose->T_cam_reference;
  // To the units in which the lost one was placed: a keyframe begins with its reference's scale.
  T_cam_lost.translation *= reference.reference_scale / pose->reference_scale;
  pose->T_cam_reference = T_cam_lost * reference.T_cam_reference;
  pose->reference = reference.reference;
  pose->reference_scale = reference.reference_scale;
  return true;
}

/// Until nothing changes: what one hangs from is bridged before, mostly in the order of time.
void TrajectoryBuilder::BridgeLostKeyframes() {
  for (bool any = true; any;) {
    any = false;
    for (auto& [index, pose] : poses_) {
      if (pose.HasPose() && !MapOfFrame(pose)) any |= Bridge(&pose);
    }
  }
  for (auto& [index, pose] : refined_) {
    if (!MapOfFrame(pose)) Bridge(&pose);
  }
}

void TrajectoryBuilder::JoinPosesOf(const std::set<FrameName>& frames) {
  std::map<std::pair<CameraId, MapId>, std::vector<const FramePose*>> paths;
  for (const FrameName& frame : frames) {
    const auto told = poses_.find(frame);
    if (told == poses_.end() || refined_.contains(frame) || told->second.covariance.empty()) continue;
    if (const auto map_id = MapOfFrame(told->second)) paths[{frame.camera, *map_id}].push_back(&told->second);
  }
  for (const auto& of_map : paths) {
    const std::vector<const FramePose*>& path = of_map.second;
    std::optional<MotionNoise> noise;
    size_t begin = path.size() - std::min(path.size(), kFramesRemembered);
    for (size_t end = begin; end < path.size(); begin = end) {
      const auto together = [&](const FramePose* pose) {
        return pose->stamp_ns - path[begin]->stamp_ns < kJoinedNs;
      };
      while (end < path.size() && together(path[end])) ++end;
      Join(std::span(path).subspan(begin, end - begin), &noise);
    }
  }
}

/// Poses of one map, in order of time; the noise is found in the first of its paths.
void TrajectoryBuilder::Join(std::span<const FramePose* const> path, std::optional<MotionNoise>* noise) {
  std::vector<PoseEstimate> estimates;
  for (const FramePose* told : path)
    estimates.push_back(EstimateOf(*told, *map_.ResolvePose(*told->reference), path.front()->stamp_ns));
  SmoothingOptions options;
  options.noise = *noise;
  const SmoothedTrajectory joined = SmoothTrajectory(estimates, options);
  if (joined.noise) *noise = joined.noise;
  for (size_t i = 0; i < path.size(); ++i) {
    FramePose pose = *path[i];
    const Map::ResolvedPose reference = *map_.ResolvePose(*pose.reference);
    pose.T_cam_reference = joined.T_cam_world[i] * reference.T_cam_world.Inverse();
    pose.reference_scale = reference.scale;
    pose.state = TrackingState::kLocalizedLater;
    refined_[{pose.camera_id, pose.frame_index}] = pose;
  }
}

std::optional<MapId> TrajectoryBuilder::MapOfFrame(const FramePose& pose) const {
  if (!pose.HasPose()) return std::nullopt;
  const Keyframe* reference = map_.Resolve(*pose.reference);
  return reference != nullptr ? std::optional(reference->map_id) : std::nullopt;
}

/// Of all cameras together; and how many frames of `camera` the others hold.
void TrajectoryBuilder::ChooseMap(std::optional<CameraId> camera, Trajectories* result) const {
  std::map<MapId, size_t> frames_of, frames_of_camera;
  for (const auto& [frame, pose] : poses_) {
    const std::optional<MapId> map_id = MapOfFrame(pose);
    if (!map_id) continue;
    ++frames_of[*map_id];
    if (!camera || frame.camera == *camera) ++frames_of_camera[*map_id];
  }
  for (const auto& [map_id, count] : frames_of) {
    if (!result->map_id || count > frames_of.at(*result->map_id)) result->map_id = map_id;
  }
  for (const auto& [map_id, count] : frames_of_camera) {
    if (map_id != result->map_id) result->other_maps.emplace_back(map_id, count);
  }
}

TrajectoryBuilder::Trajectories TrajectoryBuilder::Build(std::optional<CameraId> camera) const {
  Trajectories result;
  ChooseMap(camera, &result);
  for (const auto& [index, pose] : poses_) {
    if (camera && index.camera != *camera) continue;
    if (!result.map_id || MapOfFrame(pose) != result.map_id) continue;
    const auto later = refined_.find(index);
    const FramePose& best =
        later != refined_.end() && MapOfFrame(later->second) == result.map_id ? later->second : pose;
    const Map::ResolvedPose reference = *map_.ResolvePose(*best.reference);
    const Rigid3d T_cam_world = reference.Compose(best.T_cam_reference, best.reference_scale);
    result.final.push_back({pose.stamp_ns, T_cam_world.Inverse()});
    if (pose.state != TrackingState::kLocalizedLater) {
      result.online.push_back({pose.stamp_ns, pose.T_cam_world.Inverse()});
    }
  }
  for (const auto& [id, keyframe] : map_.keyframes()) {
    const bool wanted = !camera || keyframe.camera_id == *camera;
    if (wanted && keyframe.map_id == result.map_id)
      result.keyframes.push_back({keyframe.stamp_ns, keyframe.T_cam_world.Inverse()});
  }
  std::ranges::stable_sort(result.keyframes, {}, &StampedPose::stamp_ns);  // sessions may be in any order
  return result;
}

}  // namespace dmslam
