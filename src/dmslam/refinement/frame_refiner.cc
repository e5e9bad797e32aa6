#include "dmslam/refinement/frame_refiner.h"

#include <algorithm>
#include <utility>

#include "dmslam/refinement/late_placement.h"
#include "dmslam/util/parallel.h"

namespace dmslam {
namespace {

constexpr int kMinSights = 30;
constexpr double kSeesLess = 0.8;  // of what the frame before saw
constexpr size_t kAhead = 4;       // frames for each search that are looked for at once
constexpr double kSeesMore = 1.3;  // from its motion, than from where it was told to be

/// What became of a landmark of map `map_id`; null where it is gone.
const Landmark* LandmarkNow(const Map& map, MapId map_id, LandmarkId id) {
  const Landmark* landmark = map.Resolve(id);
  return landmark != nullptr && landmark->map_id == map_id ? landmark : nullptr;
}

/// Whether the keyframes before and after rule out that the camera was there. Behind people a few wrong
/// sights may agree with a pose far aside.
bool IsAside(const Map& map, const Keyframe& reference, const FramePose& pose, const Rigid3d& T_cam_world) {
  TrackedFrame frame;
  frame.index = pose.frame_index;
  frame.stamp_ns = pose.stamp_ns;
  frame.T_cam_world = T_cam_world;
  const double depth = map.MedianDepth(reference).value_or(1.0);
  return !AgreesWithKeyframesAside(map, reference.map_id, frame, reference.id.session(), depth,
                                   reference.id.camera());
}

}  // namespace

FrameRefiner::Kept FrameRefiner::ToKept(const TrackedFrame& frame, const FramePose& pose) {
  Kept kept{pose, SightsOf(frame), frame.features->set};
  kept.sights.shrink_to_fit();  // they stay for long
  return kept;
}

void FrameRefiner::Keep(const TrackedFrame& frame, const FramePose& pose) {
  Kept kept = ToKept(frame, pose);
  num_features_ += kept.features.keypoints.size();
  frames_.push_back(std::move(kept));
  Bound();
}

void FrameRefiner::KeepEarlier(const TrackedFrame& frame, const FramePose& pose) {
  if (frames_.size() >= options_.max_frames) return;
  Kept kept = ToKept(frame, pose);
  const size_t features = kept.features.keypoints.size();
  if (num_without_features_ > 0 || num_features_ + features > options_.max_features) {
    kept.features = FeatureSet();
    ++num_without_features_;
  }
  num_features_ += kept.features.keypoints.size();
  frames_.push_front(std::move(kept));
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
  ahead_.clear();  // others may come first now
  for (Kept& kept : std::exchange(frames_, {})) {
    const std::optional<Map::ResolvedPose> reference = map.ResolvePose(*kept.pose.reference);
    if (!reference) continue;
    (map_id && reference->map_id() != *map_id ? others : due_).push_back(std::move(kept));
  }
  frames_ = std::move(others);
  if (options_.for_smoothing) {  // those that were placed later came after
    std::stable_sort(due_.begin(), due_.end(),
                     [](const Kept& a, const Kept& b) { return a.pose.stamp_ns < b.pose.stamp_ns; });
  }
  CountFeatures();
}

std::vector<WaitingFrame> FrameRefiner::TakeFramesOf(MapId map_id) {
  std::vector<WaitingFrame> taken;
  for (Kept& kept : frames_) {
    if (kept.pose.map_id != map_id || kept.features.keypoints.empty()) continue;
    taken.emplace_back(kept.pose.frame_index, kept.pose.stamp_ns, std::move(kept.features));
  }
  std::erase_if(frames_, [map_id](const Kept& kept) { return kept.pose.map_id == map_id; });
  CountFeatures();
  return taken;
}

void FrameRefiner::CountFeatures() {
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
std::optional<std::vector<Sight>> FrameRefiner::SearchAgain(const Map& map, const Kept& kept,
                                                            const Rigid3d& told,
                                                            const std::vector<Sight>& known,
                                                            const Search& search) {
  if (kept.features.keypoints.empty() || !search) return std::nullopt;
  TrackedFrame frame(kept.pose.frame_index, kept.pose.stamp_ns,
                     MakeFrameFeatures(kept.features, map.camera(), map.pyramid()));
  frame.T_cam_world = told;
  for (const Sight& sight : known) frame.landmarks[sight.feature] = sight.landmark;
  if (!search(&frame)) return std::nullopt;
  return SightsOf(frame);
}

std::optional<FinalPose> FrameRefiner::Measured(const Map& map, const Kept& kept, const Rigid3d& told,
                                                const std::vector<Sight>& sights) const {
  if (static_cast<int>(sights.size()) < kMinSights) return std::nullopt;
  FinalPose refined;
  refined.pose = kept.pose;
  const auto measure = options_.for_smoothing ? MeasureCheckedPose : MeasurePose;
  const PoseOptimizationReport report = measure(map, told, sights, &refined);
  if (!Agrees(report)) return std::nullopt;
  return refined;
}

/// Where the last frame's motion goes on to; none where a frame is missing between.
std::optional<Rigid3d> FrameRefiner::FromMotion(MapId map_id, int64_t stamp_ns) const {
  if (!before_ || !last_ || before_->map_id != map_id || last_->map_id != map_id) return std::nullopt;
  const int64_t earlier_ns = last_->stamp_ns - before_->stamp_ns, now_ns = stamp_ns - last_->stamp_ns;
  const bool evenly = now_ns > 0 && earlier_ns > 0 && now_ns < 2 * earlier_ns && earlier_ns < 2 * now_ns;
  if (!evenly) return std::nullopt;
  return last_->T_cam_world * before_->T_cam_world.Inverse() * last_->T_cam_world;
}

void FrameRefiner::LookFromMotion(const Map& map, MapId map_id, const Kept& kept,
                                  const std::vector<Sight>& known, const Search& search,
                                  std::optional<FinalPose>* refined) const {
  const std::optional<Rigid3d> predicted = FromMotion(map_id, kept.pose.stamp_ns);
  const size_t found = *refined ? (*refined)->sights.size() : 0;
  if (!predicted || static_cast<double>(found) >= kSeesLess * static_cast<double>(last_->num_sights)) return;
  const auto sights = SearchAgain(map, kept, *predicted, known, search);
  if (!sights) return;
  std::optional<FinalPose> other = Measured(map, kept, *predicted, *sights);
  const bool more =
      other && static_cast<double>(other->sights.size()) > kSeesMore * static_cast<double>(found);
  if (more) *refined = std::move(other);
}

std::optional<FrameRefiner::Looked> FrameRefiner::Look(const Map& map, const Kept& kept,
                                                       const Search& search) const {
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(*kept.pose.reference);
  if (!reference) return std::nullopt;
  const Rigid3d told = reference->Compose(kept.pose.T_cam_reference, kept.pose.reference_scale);
  Looked looked{SightsNow(map, reference->map_id(), kept), std::nullopt};
  const auto found = SearchAgain(map, kept, told, looked.known, search);
  looked.refined = Measured(map, kept, told, found.value_or(looked.known));
  return looked;
}

void FrameRefiner::LookAhead(const Map& map, std::span<const Search> searches) {
  ahead_.resize(std::min(due_.size(), kAhead * searches.size()));
  ForEachInParallel(searches.size(), static_cast<int>(searches.size()), [&](size_t k) {
    for (size_t i = k; i < ahead_.size(); i += searches.size()) ahead_[i] = Look(map, due_[i], searches[k]);
  });
}

std::optional<FinalPose> FrameRefiner::RefineNext(const Map& map, const Search& search) {
  const Kept kept = std::move(due_.front());
  due_.pop_front();
  std::optional<Looked> looked = IsAhead() ? std::move(ahead_.front()) : Look(map, kept, search);
  if (IsAhead()) ahead_.pop_front();
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(*kept.pose.reference);
  if (!looked || !reference) return std::nullopt;
  const Rigid3d told = reference->Compose(kept.pose.T_cam_reference, kept.pose.reference_scale);
  std::optional<FinalPose> refined = std::move(looked->refined);
  if (options_.for_smoothing) LookFromMotion(map, reference->map_id(), kept, looked->known, search, &refined);
  const bool is_moved_aside = refined && IsAside(map, *reference->keyframe, kept.pose, refined->measured) &&
                              !IsAside(map, *reference->keyframe, kept.pose, told);
  if (is_moved_aside) refined.reset();
  before_ = std::exchange(last_, std::nullopt);
  if (refined) last_ = {reference->map_id(), kept.pose.stamp_ns, refined->measured, refined->sights.size()};
  if (!refined && kept.pose.state == TrackingState::kLocalizedLater) {
    refined.emplace();
    refined->pose = kept.pose;
    refined->measured = told;
  }
  if (!refined) return std::nullopt;
  refined->pose.state = TrackingState::kLocalizedLater;
  refined->SetPose(*reference->keyframe, refined->measured);
  return refined;
}

}  // namespace dmslam
