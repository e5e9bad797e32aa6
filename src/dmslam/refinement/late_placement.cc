#include "dmslam/refinement/late_placement.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dmslam/util/random.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr int64_t kNearNs = 350'000'000;  // a placed frame so near in time bounds where a frame may be
constexpr double kMaxSpeed = 1.5;         // depths of the scene per second
constexpr double kMaxTurn_rad_per_s = 3.0;
constexpr size_t kKeyframesAside = 3;   // whose motion bounds that of the frames between them...
constexpr double kApartS = 0.3;         // ...apart, so that it is motion and not noise...
constexpr double kFasterThanAside = 2;  // ...which may be so many times as fast...
constexpr double kSlack = 0.05;         // ...and this beside [depths of the scene]

double SecondsBetween(int64_t a_ns, int64_t b_ns) { return std::abs(SecondsFromTo(a_ns, b_ns)); }

double DistanceBetween(const Rigid3d& a, const Rigid3d& b) { return (a.Center() - b.Center()).norm(); }

}  // namespace

bool IsPlausibleMotion(const Rigid3d& a, const Rigid3d& b, double seconds, double depth) {
  const Rigid3d motion = a * b.Inverse();
  return motion.translation.norm() <= kMaxSpeed * depth * seconds &&
         AngleBetween(motion.rotation, Eigen::Quaterniond::Identity()) <= kMaxTurn_rad_per_s * seconds;
}

bool AgreesWithKeyframesAside(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                              double depth, CameraId camera_id) {
  std::vector<const Keyframe*> aside;
  const auto add = [&](const Keyframe& keyframe) {
    const bool apart = aside.empty() || SecondsBetween(keyframe.stamp_ns, aside.back()->stamp_ns) >= kApartS;
    const bool ours = keyframe.id.camera() == camera_id && keyframe.map_id == map_id;
    if (ours && apart) aside.push_back(&keyframe);
  };
  const auto after = map.keyframes().lower_bound(KeyframeId::Make(session, frame.index, camera_id));
  for (auto it = after; it != map.keyframes().begin() && aside.size() < kKeyframesAside;) add((--it)->second);
  std::ranges::reverse(aside);
  const size_t before = aside.size();
  for (auto it = after; it != map.keyframes().end() && aside.size() < before + kKeyframesAside; ++it)
    add(it->second);
  double speed = 0;
  for (size_t i = 1; i < aside.size(); ++i) {
    const double seconds = SecondsBetween(aside[i]->stamp_ns, aside[i - 1]->stamp_ns);
    const double distance = DistanceBetween(aside[i]->T_cam_world, aside[i - 1]->T_cam_world);
    if (seconds > 0) speed = std::max(speed, distance / seconds);
  }
  return std::ranges::all_of(aside, [&](const Keyframe* keyframe) {
    const double seconds = SecondsBetween(frame.stamp_ns, keyframe->stamp_ns);
    return DistanceBetween(frame.T_cam_world, keyframe->T_cam_world) <=
           kFasterThanAside * speed * seconds + kSlack * depth;
  });
}

void LatePlacement::Forget() {
  next_.reset();
  last_.reset();
}

void LatePlacement::OnMapChanged(const Map& map) {
  if (!next_) return;
  const bool is_keyframe = map.FindKeyframe(KeyframeId::Make(session_, next_->index, camera_id_)) != nullptr;
  const bool follows = growing_ && last_ && last_->index == next_->index && !is_keyframe;
  const std::optional<Rigid3d> T_cam_world = follows ? last_->pose.In(map) : std::nullopt;
  if (T_cam_world) {
    next_->T_cam_world = *T_cam_world;
  } else {
    next_.reset();
  }
}

/// Where the frame placed last is too far: the next keyframe.
void LatePlacement::FindNeighbour(const Map& map, const TrackedFrame& frame) {
  const int64_t after_ns = next_ ? next_->stamp_ns - frame.stamp_ns : -1;
  if (after_ns >= 0 && after_ns <= kNearNs) return;
  next_.reset();
  const uint32_t from = growing_ ? frame.index + 1 : frame.index;
  const auto next = map.keyframes().lower_bound(KeyframeId::Make(session_, from, camera_id_));
  if (next != map.keyframes().end() && next->first.camera() == camera_id_)
    next_ = TrackedFrame::Of(next->second);
}

/// By constant velocity backwards, where the three frames are consecutive.
std::optional<Rigid3d> LatePlacement::Predict(const TrackedFrame& frame) const {
  const bool moves = last_ && last_->T_this_next && last_->index == next_->index;
  if (!moves || next_->index - frame.index != 1) return std::nullopt;
  return *last_->T_this_next * next_->T_cam_world;
}

bool LatePlacement::IsPlausible(const TrackedFrame& frame, double depth) const {
  const double seconds = static_cast<double>(next_->stamp_ns - frame.stamp_ns) * 1e-9;
  return IsPlausibleMotion(frame.T_cam_world, next_->T_cam_world, seconds, depth);
}

/// From the placed frame after it, and its motion.
TrackingReport LatePlacement::TrackBackwards(const Map& map, double depth, PoseSearch* search,
                                             TrackedFrame* frame) const {
  if (!next_) return {};
  const std::optional<Rigid3d> predicted = Predict(*frame);
  PoseSearch::Prior prior;
  if (predicted) prior = MotionPrior(motion_, *predicted, depth);
  const Rigid3d guess = predicted.value_or(next_->T_cam_world);
  if (search->FromFrame(map, *next_, guess, prior, frame) != PoseSearch::FromFrameResult::kFound) return {};
  TrackingReport report = search->InLocalMap(map, true, prior, frame);  // nothing hurries
  report.ok = report.ok && !report.doubtful && IsPlausible(*frame, depth);
  return report;
}

TrackingReport LatePlacement::Place(const Map& map, PoseSearch* search, const Relocalizer& relocalizer,
                                    TrackedFrame* frame) {
  FindNeighbour(map, *frame);
  const Keyframe* reference = map.FindKeyframe(search->reference());
  const double depth = reference != nullptr ? map.MedianDepth(*reference).value_or(1.0) : 1.0;
  const auto agrees = [&] {
    const Keyframe* there = map.FindKeyframe(search->reference());
    return there != nullptr &&
           AgreesWithKeyframesAside(map, there->map_id, *frame, session_, depth, camera_id_);
  };
  TrackingReport report = TrackBackwards(map, depth, search, frame);
  if (report.ok && agrees()) return report;
  search->judge().DropEvidence();  // a pose that is not believed says nothing of landmarks
  frame->ClearMatches();
  const uint64_t seed = DeriveSeed(seed_, frame->index, "later");
  if (!relocalizer.Relocalize(map, {.seed = seed}, search, frame)) return {};
  report = search->InLocalMap(map, true, std::nullopt, frame);
  report.ok = report.ok && !report.doubtful && (!next_ || IsPlausible(*frame, depth)) && agrees();
  return report;
}

void LatePlacement::GoOnFrom(TrackedFrame frame, const PlacedPose& pose) {
  last_ = Placed{frame.index, pose, {}};
  if (next_ && next_->index - frame.index == 1)
    last_->T_this_next = frame.T_cam_world * next_->T_cam_world.Inverse();
  next_ = std::move(frame);
}

}  // namespace dmslam
