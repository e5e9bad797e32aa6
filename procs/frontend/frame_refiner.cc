#include "frontend/frame_refiner.h"

#include <algorithm>
#include <utility>

namespace dmslam {
namespace {

constexpr int kMinSights = 30;

/// What became of a landmark of map `map_id`; null where it is gone.
const Landmark* LandmarkNow(const Map& map, MapId map_id, LandmarkId id) {
  const std::optional<LandmarkId> now = map.Resolve(id);
  const Landmark* landmark = now ? map.FindLandmark(*now) : nullptr;
  return landmark != nullptr && landmark->map_id == map_id ? landmark : nullptr;
}

}  // namespace

void FrameRefiner::Keep(const TrackedFrame& frame, const FramePose& pose) {
  Kept kept{pose, SightsOf(frame), frame.features->set};
  kept.sights.shrink_to_fit();  // they stay for long
  num_features_ += kept.features.keypoints.size();
  frames_.push_back(std::move(kept));
  Bound();
}

void FrameRefiner::Bound() {
  if (frames_.size() > options_.max_frames) {
    num_features_ -= frames_.front().features.keypoints.size();
    num_without_features_ -= num_without_features_ > 0 ? 1 : 0;
    frames_.pop_front();
  }
  while (num_features_ > options_.max_features && num_without_features_ < frames_.size()) {
    FeatureSet& oldest = frames_[num_without_features_++].features;
    num_features_ -= oldest.keypoints.size();
    oldest = FeatureSet();
  }
}

void FrameRefiner::Begin(const Map& map, std::optional<MapId> map_id) {
  std::deque<Kept> others;
  for (Kept& kept : std::exchange(frames_, {})) {
    const std::optional<Map::ResolvedPose> reference = map.ResolvePose(kept.pose.reference);
    if (!reference) continue;
    (map_id && reference->map_id != *map_id ? others : due_).push_back(std::move(kept));
  }
  frames_ = std::move(others);
  num_features_ = 0;
  for (const Kept& kept : frames_) num_features_ += kept.features.keypoints.size();
  num_without_features_ = static_cast<size_t>(std::count_if(
      frames_.begin(), frames_.end(), [](const Kept& kept) { return kept.features.keypoints.empty(); }));
}

std::vector<Sight> FrameRefiner::SightsNow(const Map& map, MapId map_id, const Kept& kept) {
  std::vector<Sight> sights;
  for (const Sight& sight : kept.sights) {
    const Landmark* landmark = LandmarkNow(map, map_id, sight.landmark);
    if (landmark == nullptr) continue;
    sights.push_back(sight);
    sights.back().landmark = landmark->id;
  }
  return sights;
}

/// With what the map has become since: a frame from behind a walker saw little of the map of its time.
std::optional<std::vector<Sight>> FrameRefiner::SearchAgain(const Map& map, MapId map_id, const Kept& kept,
                                                            const Rigid3d& told, const Search& search) const {
  if (kept.features.keypoints.empty() || !search) return std::nullopt;
  TrackedFrame frame(kept.pose.frame_index, kept.pose.stamp_ns,
                     MakeFrameFeatures(kept.features, map.camera(), map.pyramid()));
  frame.T_cam_world = told;
  for (const Sight& sight : SightsNow(map, map_id, kept)) frame.landmarks[sight.feature] = sight.landmark;
  if (!search(&frame)) return std::nullopt;
  return SightsOf(frame);
}

std::optional<FinalPose> FrameRefiner::Measured(const Map& map, const Kept& kept, const Rigid3d& told,
                                                const std::vector<Sight>& sights) {
  if (static_cast<int>(sights.size()) < kMinSights) return std::nullopt;
  FinalPose refined;
  refined.pose = kept.pose;
  const PoseOptimizationReport report = MeasurePose(map, told, sights, &refined);
  if (!Agrees(report, sights.size())) return std::nullopt;
  return refined;
}

std::optional<FinalPose> FrameRefiner::RefineNext(const Map& map, const Search& search) {
  const Kept kept = std::move(due_.front());
  due_.pop_front();
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(kept.pose.reference);
  const std::optional<KeyframeId> keyframe_id = map.ResolveKeyframe(kept.pose.reference);
  if (!reference || !keyframe_id) return std::nullopt;
  const Rigid3d told = reference->Compose(kept.pose.T_cam_reference, kept.pose.reference_scale);
  auto sights = SearchAgain(map, reference->map_id, kept, told, search);
  if (!sights) sights = SightsNow(map, reference->map_id, kept);
  std::optional<FinalPose> refined = Measured(map, kept, told, *sights);
  if (!refined && kept.pose.state == TrackingState::kLocalizedLater) {
    refined.emplace();
    refined->pose = kept.pose;
    refined->measured = told;
  }
  if (!refined) return std::nullopt;
  refined->pose.state = TrackingState::kLocalizedLater;
  refined->SetPose(*map.FindKeyframe(*keyframe_id), refined->measured);
  return refined;
}

}  // namespace dmslam
