#include "frontend/frame_refiner.h"

#include <utility>

#include "dmslam/optimization/pose_optimization.h"

namespace dmslam {
namespace {

constexpr int kMinSights = 30;
constexpr double kMinInlierShare = 0.7;

}  // namespace

void FrameRefiner::Keep(const TrackedFrame& frame, const FramePose& pose) {
  Kept kept{pose, {}};
  for (size_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].valid() || frame.classes[i] != FeatureClass::kUsed) continue;
    kept.sights.push_back({frame.landmarks[i], frame.features->uv_px[i].cast<float>(),
                           static_cast<uint8_t>(frame.features->set.keypoints[i].octave)});
  }
  kept.sights.shrink_to_fit();  // they stay for long
  frames_.push_back(std::move(kept));
  if (frames_.size() > max_frames_) frames_.pop_front();
}

std::optional<FramePose> FrameRefiner::RefineOne(const Map& map, const Kept& kept) const {
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(kept.pose.reference);
  const std::optional<KeyframeId> keyframe_id = map.ResolveKeyframe(kept.pose.reference);
  if (!reference || !keyframe_id) return std::nullopt;
  std::vector<PoseObservation> observations;
  for (const Sight& sight : kept.sights) {
    const std::optional<LandmarkId> id = map.Resolve(sight.landmark);
    const Landmark* landmark = id ? map.FindLandmark(*id) : nullptr;
    if (landmark == nullptr || landmark->map_id != reference->map_id) continue;
    observations.push_back(
        {landmark->p_world, sight.uv_px.cast<double>(), 1.0 / pyramid_.SigmaSquared(sight.octave), 1.0});
  }
  if (static_cast<int>(observations.size()) < kMinSights) return std::nullopt;
  const Rigid3d told = reference->Compose(kept.pose.T_cam_reference, kept.pose.reference_scale);
  const PoseOptimizationReport report = OptimizePose(camera_.Ideal(), told, observations);
  if (!report.usable || report.num_inliers < kMinInlierShare * static_cast<double>(observations.size())) {
    return std::nullopt;
  }
  const Keyframe& keyframe = *map.FindKeyframe(*keyframe_id);
  FramePose pose = kept.pose;
  pose.state = TrackingState::kLocalizedLater;
  pose.map_id = keyframe.map_id;
  pose.reference = *keyframe_id;
  pose.T_cam_reference = report.T_cam_world * keyframe.T_cam_world.Inverse();
  pose.reference_scale = keyframe.scale;
  pose.T_cam_world = report.T_cam_world;
  return pose;
}

std::vector<FramePose> FrameRefiner::Refine(const Map& map, std::optional<MapId> map_id) {
  std::vector<FramePose> poses;
  for (Kept& kept : std::exchange(frames_, {})) {
    const std::optional<Map::ResolvedPose> reference = map.ResolvePose(kept.pose.reference);
    if (!reference) continue;
    if (map_id && reference->map_id != *map_id) {
      frames_.push_back(std::move(kept));
    } else if (std::optional<FramePose> pose = RefineOne(map, kept)) {
      poses.push_back(std::move(*pose));
    }
  }
  return poses;
}

}  // namespace dmslam
