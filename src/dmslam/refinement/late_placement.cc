#include "dmslam/refinement/late_placement.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "dmslam/dynamics/proven.h"
#include "dmslam/util/random.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr int64_t kNearNs = 500'000'000;  // a placed frame so near in time bounds where a frame may be
constexpr int kWellSeen = 50;             // static features...
constexpr int kWellSeenCells = 8;         // ...and the cells of the image (kNumCells) that hold them
// Half more than a MotionModel allows a camera whose motion is not known (max_speed, max_turn_rad_per_s).
// That adds a slack to both, and here there is none.
constexpr double kMaxSpeed = 1.5;  // depths of the scene per second
constexpr double kMaxTurnRadPerS = 3.0;
constexpr size_t kKeyframesAside = 3;   // whose motion bounds that of the frames between them...
constexpr double kApartS = 0.3;         // ...apart, so that it is motion and not noise...
constexpr double kFasterThanAside = 2;  // ...which may be so many times as fast...
constexpr double kSlack = 0.05;         // ...and this beside [depths of the scene]

/// The same moment of time that runs backwards.
FrameTime Backwards(uint32_t index, int64_t stamp_ns) { return {~index, -stamp_ns}; }

double DistanceBetween(const Rigid3d& a, const Rigid3d& b) { return (a.Center() - b.Center()).norm(); }

}  // namespace

bool IsWellSeen(const TrackingReport& report) {
  return report.num_static >= kWellSeen && report.cells >= kWellSeenCells;
}

bool IsPlausibleMotion(const Rigid3d& a, const Rigid3d& b, double seconds, double depth) {
  const Rigid3d motion = a * b.Inverse();
  return motion.translation.norm() <= kMaxSpeed * depth * seconds &&
         AngleBetween(motion.rotation, Eigen::Quaterniond::Identity()) <= kMaxTurnRadPerS * seconds;
}

bool AgreesWithKeyframesAside(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                              double depth, CameraId camera_id) {
  std::vector<const Keyframe*> aside;
  const auto add = [&](const Keyframe& keyframe) {
    const bool apart = aside.empty() || SecondsApart(keyframe.stamp_ns, aside.back()->stamp_ns) >= kApartS;
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
    const double seconds = SecondsApart(aside[i]->stamp_ns, aside[i - 1]->stamp_ns);
    const double distance = DistanceBetween(aside[i]->T_cam_world, aside[i - 1]->T_cam_world);
    if (seconds > 0) speed = std::max(speed, distance / seconds);
  }
  return std::ranges::all_of(aside, [&](const Keyframe* keyframe) {
    const double seconds = SecondsApart(frame.stamp_ns, keyframe->stamp_ns);
    return DistanceBetween(frame.T_cam_world, keyframe->T_cam_world) <=
           kFasterThanAside * speed * seconds + kSlack * depth;
  });
}

bool IsLeftAtUsualSpeed(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                        double depth, const UsualSpeed& usual_speed, CameraId camera_id) {
  auto it = map.keyframes().lower_bound(KeyframeId::Make(session, frame.index, camera_id));
  for (; it != map.keyframes().end(); ++it) {
    const Keyframe& keyframe = it->second;
    const int64_t after_ns = keyframe.stamp_ns - frame.stamp_ns;
    const bool ours = keyframe.id.camera() == camera_id && keyframe.id.session() == session;
    if (!ours || after_ns > kNearNs) return true;
    if (keyframe.map_id != map_id || after_ns < UsualSpeed::kShortestNs) continue;
    const double moved = DistanceBetween(frame.T_cam_world, keyframe.T_cam_world) / depth;
    if (usual_speed.WasTooFar(moved, static_cast<double>(after_ns) * 1e-9)) return false;
  }
  return true;
}

void LatePlacement::Forget() {
  LeaveNeighbour();
  last_.reset();
}

void LatePlacement::LeaveNeighbour() {
  follower_.reset();
  weak_.clear();
}

void LatePlacement::OnMapChanged(const Map& map) {
  if (!follower_) return;
  const bool follows = last_ && last_->index == follower_->last().index;
  const std::optional<Rigid3d> T_cam_world = follows ? last_->pose.In(map) : std::nullopt;
  if (!T_cam_world) return LeaveNeighbour();
  const Keyframe* keyframe = map.FindKeyframe(KeyframeId::Make(session_, last_->index, camera_id_));
  TrackedFrame moved = keyframe != nullptr ? TrackedFrame::Of(*keyframe) : follower_->last();
  if (keyframe == nullptr) moved.T_cam_world = *T_cam_world;
  follower_->SetLast(std::move(moved));
}

/// Where the frame placed last is too far: the next keyframe.
void LatePlacement::FindNeighbour(const Map& map, LateMap late_map, const TrackedFrame& frame) {
  if (follower_) {
    const int64_t after_ns = follower_->last().stamp_ns - frame.stamp_ns;
    if (after_ns >= 0 && after_ns <= kNearNs) return;
  }
  LeaveNeighbour();
  const uint32_t from = late_map == LateMap::kGrows ? frame.index + 1 : frame.index;
  const auto next = map.keyframes().lower_bound(KeyframeId::Make(session_, from, camera_id_));
  if (next == map.keyframes().end() || next->first.camera() != camera_id_) return;
  follower_.emplace(options_);
  follower_->BeginAt(next->second, Backwards(next->first.frame_index(), next->second.stamp_ns));
}

/// Whether the camera gets there from its neighbour and from the keyframes aside.
bool LatePlacement::IsPlausible(const Map& map, const Keyframe* reference, const TrackedFrame& frame) const {
  if (reference == nullptr) return false;
  const double depth = map.MedianDepth(*reference).value_or(1.0);
  if (follower_) {
    const TrackedFrame& next = follower_->last();
    const double seconds = static_cast<double>(next.stamp_ns - frame.stamp_ns) * 1e-9;
    if (!IsPlausibleMotion(frame.T_cam_world, next.T_cam_world, seconds, depth)) return false;
  }
  return AgreesWithKeyframesAside(map, reference->map_id, frame, session_, depth, camera_id_);
}

bool LatePlacement::IsBelieved(const Map& map, const TrackingReport& report, const PoseSearch& search,
                               const TrackedFrame& frame) const {
  return report.IsTracked() && IsPlausible(map, search.Reference(map), frame);
}

/// From a keyframe that is too far ahead for its motion to say anything: if the camera has hardly moved
/// since.
TrackingReport LatePlacement::FindBeside(const Map& map, PoseSearch* search, TrackedFrame* frame) const {
  const TrackedFrame& next = follower_->last();
  const auto found = search->FromFrame(map, next, next.T_cam_world, std::nullopt, frame);
  if (found != PoseSearch::FromFrameResult::kFound) return {};
  TrackingReport report = search->InLocalMap(map, true, std::nullopt, frame);
  if (!IsBelieved(map, report, *search, *frame)) report.TakePoseAway();
  return report;
}

/// From the placed frame after it, and its motion.
TrackingReport LatePlacement::TrackBackwards(const Map& map, PoseSearch* search, TrackedFrame* frame) {
  if (!follower_) return {};
  if (follower_->last().stamp_ns - frame->stamp_ns > kNearNs) return FindBeside(map, search, frame);
  const FrameTime time = Backwards(frame->index, frame->stamp_ns);
  const uint64_t seed = DeriveSeed(seed_, frame->index, "late_keyframe");
  MotionFollower::Attempt attempt = follower_->Follow(map, time, false, seed, search, frame);
  TrackingReport& report = attempt.report;
  if (!IsBelieved(map, report, *search, *frame)) report.TakePoseAway();
  if (!report.IsTracked() && attempt.weak_pose) Coast(map, *attempt.weak_pose, report, *search, *frame);
  return report;
}

/// The frame's weak pose leads the search on, and may come to be believed.
void LatePlacement::Coast(const Map& map, const FoundPose& weak_pose, const TrackingReport& report,
                          const PoseSearch& search, const TrackedFrame& frame) {
  follower_->Coast(map, weak_pose, Backwards(frame.index, frame.stamp_ns));
  const auto pose = PlacedPose::Of(search.Reference(map), weak_pose.T_cam_world);
  if (pose && report.num_static >= options_.min_coasting_inliers)
    weak_.push_back({.frame = frame, .report = report, .pose = *pose});
}

/// From its neighbour, or else like a lost camera.
LatePlacement::Found LatePlacement::Place(const Map& map, LateMap late_map, const Tracked& tracked,
                                          TrackedFrame* frame) {
  FindNeighbour(map, late_map, *frame);
  PoseSearch* search = tracked.search;
  Found found{TrackBackwards(map, search, frame)};
  if (found.report.IsTracked() && !IsTooFast(map, tracked, *frame)) return found;
  search->judge().DropEvidence();  // a pose that is not believed says nothing of landmarks
  frame->ClearMatches();
  const uint64_t seed = DeriveSeed(seed_, frame->index, "later");
  if (!tracked.relocalizer.Relocalize(map, {.seed = seed}, search, frame)) return {};
  found = {search->InLocalMap(map, true, std::nullopt, frame), true};
  TrackingReport& report = found.report;
  if (!IsBelieved(map, report, *search, *frame) || !IsProvenPlace(map, *search, *frame) ||
      IsTooFast(map, tracked, *frame))
    report.TakePoseAway();
  return found;
}

/// Somebody who stood for a while is a place, too. What would be placed from there becomes keyframes, and
/// these would prove him.
bool LatePlacement::IsProvenPlace(const Map& map, const PoseSearch& search, const TrackedFrame& frame) {
  const Keyframe* reference = search.Reference(map);
  return reference != nullptr &&
         (!CanBeProven(map, reference->map_id, {}) || CountProven(map, frame.landmarks, {}) >= kSomeProven);
}

/// Somebody who walked before the first map, and is in it, takes the camera along into the past.
bool LatePlacement::IsTooFast(const Map& map, const Tracked& tracked, const TrackedFrame& frame) const {
  const Keyframe* reference = tracked.search->Reference(map);
  if (!options_.usual_speed || reference == nullptr) return false;
  const std::optional<double> depth = map.MedianDepth(*reference);
  return depth && !IsLeftAtUsualSpeed(map, reference->map_id, frame, session_, *depth, tracked.usual_speed,
                                      camera_id_);
}

/// Whether the motion of the frame placed last goes on to there.
bool LatePlacement::LeadsTo(const Map& map, const std::optional<Before>& before) const {
  return before && follower_->motion().IsReachable(map, before->T_cam_world,
                                                   Backwards(before->index, before->stamp_ns));
}

std::vector<LatePlacement::Placed> LatePlacement::GoOnFrom(const Map& map, LateMap late_map,
                                                           const PoseSearch& search, Placed placed,
                                                           const std::optional<Before>& before) {
  if (placed.jumped) weak_.clear();
  if (!follower_) follower_.emplace(options_);
  const FrameTime time = Backwards(placed.frame.index, placed.frame.stamp_ns);
  follower_->OnTracked(map, placed.pose, search.found(placed.frame), time, placed.frame, placed.jumped);
  last_.reset();
  if (late_map == LateMap::kGrows) last_ = Last{placed.frame.index, placed.pose};
  const bool believed = placed.jumped || IsWellSeen(placed.report) || LeadsTo(map, before);
  placed.confirmed = CountProven(map, placed.frame.landmarks, {}) >= kManyProven;
  weak_.push_back(std::move(placed));
  if (!believed) return {};
  return std::exchange(weak_, {});
}

}  // namespace dmslam
