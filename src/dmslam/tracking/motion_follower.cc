#include "dmslam/tracking/motion_follower.h"

namespace dmslam {

void MotionFollower::BeginAt(const Keyframe& keyframe, const FrameTime& time) {
  last_ = TrackedFrame::Of(keyframe);
  motion_.Begin({keyframe.id, Rigid3d(), keyframe.scale}, time);
}

MotionFollower::Attempt MotionFollower::Follow(const Map& map, const FrameTime& time, bool careful,
                                               uint64_t seed, PoseSearch* search, TrackedFrame* frame) {
  Attempt attempt;
  attempt.report.reason = "too few features match the last frame";
  const MotionModel::Prediction prediction = motion_.Predict(map, time);
  if (!prediction.T_cam_world || !prediction.recent) return attempt;
  if (!FindFirstPose(map, prediction, seed, search, frame, &attempt)) return attempt;
  attempt.report =
      search->InLocalMap(map, careful, attempt.begins_anew ? std::nullopt : prediction.prior, frame);
  attempt.begins_anew |= attempt.report.by_rival;
  if (attempt.begins_anew) motion_.Stop();
  if (!motion_.IsReachable(map, frame->T_cam_world, time)) {
    attempt.report.outcome = TrackingReport::Outcome::kContradicted;
    attempt.report.reason = "the pose contradicts the camera's motion";
  } else if (attempt.report.num_static >= options_.min_coasting_inliers) {
    attempt.weak_pose = search->found(*frame);
  }
  return attempt;
}

/// By the last frame's matches, by all that lies around it, or by its keyframe.
bool MotionFollower::FindFirstPose(const Map& map, const MotionModel::Prediction& prediction, uint64_t seed,
                                   PoseSearch* search, TrackedFrame* frame, Attempt* attempt) const {
  using Result = PoseSearch::FromFrameResult;
  const Result last = search->FromFrame(map, last_, *prediction.T_cam_world, prediction.prior, frame);
  attempt->begins_anew = last == Result::kFoundRival;
  if (last == Result::kFound || last == Result::kFoundRival) return true;
  if (last == Result::kContradicted) attempt->report.outcome = TrackingReport::Outcome::kContradicted;
  if (prediction.prior) {
    const int inliers = search->FromPrediction(map, *prediction.T_cam_world, prediction.prior, frame);
    if (inliers >= options_.min_local_inliers) return true;
    if (inliers >= options_.min_coasting_inliers) attempt->weak_pose = search->found(*frame);
  }
  return search->FromKeyframe(map, motion_.last()->reference, seed, prediction.prior, frame);
}

void MotionFollower::OnTracked(const Map& map, const PlacedPose& pose, const FoundPose& found,
                               const FrameTime& time, const TrackedFrame& frame, bool jumped) {
  motion_.OnTracked(map, pose, found, time, jumped);
  last_ = frame;
}

}  // namespace dmslam
