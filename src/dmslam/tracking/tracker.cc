#include "dmslam/tracking/tracker.h"

#include <cmath>
#include <utility>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

constexpr int64_t kCarefulNs = 1'000'000'000;  // so long more is asked of a camera that was found

}  // namespace

Tracker::Tracker(const Setup& setup)
    : options_(setup.options),
      seed_(setup.seed),
      search_(setup.options, setup.camera),
      relocalizer_(setup.vocabulary),
      motion_(setup.options.motion) {}

void Tracker::BeginAt(const Keyframe& keyframe) {
  last_ = TrackedFrame::Of(keyframe);
  motion_.Begin({keyframe.id, Rigid3d(), keyframe.scale}, {last_.index, last_.stamp_ns});
}

void Tracker::OnMapForgotten() {
  relocalizer_.Clear();
  search_.Reset();
}

void Tracker::OnMapGivenUp() {
  search_.Reset();
  motion_.Stop();
}

TrackingResult Tracker::Track(const Map& map, const Request& request, TrackedFrame frame) {
  const FrameTime time{frame.index, frame.stamp_ns};
  Attempt attempt = FollowMotion(map, &frame);
  if (!attempt.report.ok && request.may_relocalize) Relocalize(map, request.map_id, &frame, &attempt);
  TrackingResult result{.report = attempt.report, .relocalized = attempt.relocalized};
  if (attempt.report.ok) result.pose = PlacedPose::Of(map, frame.T_cam_world, search_.reference());
  if (result.pose) {
    motion_.OnTracked(map, *result.pose, frame.T_cam_world, time, attempt.relocalized);
    last_ = frame;
  } else if (attempt.weak_pose) {
    motion_.Coast(map, *attempt.weak_pose, time);
  }
  result.frame = std::move(frame);
  return result;
}

/// From where the motion model expects the camera, to what the map around says.
Tracker::Attempt Tracker::FollowMotion(const Map& map, TrackedFrame* frame) {
  Attempt attempt;
  attempt.report.reason = "too few features match the last frame";
  const MotionModel::Prediction prediction = motion_.Predict(map, {frame->index, frame->stamp_ns});
  if (!prediction.T_cam_world || !prediction.recent) return attempt;
  if (!FindByMotion(map, prediction, frame, &attempt)) return attempt;
  attempt.report = search_.InLocalMap(map, IsCareful(frame->stamp_ns), prediction.prior, frame);
  if (attempt.report.num_static >= options_.min_coasting_inliers) attempt.weak_pose = frame->T_cam_world;
  return attempt;
}

/// A first pose: by the last frame's matches, by all that lies around it, or by its keyframe.
bool Tracker::FindByMotion(const Map& map, const MotionModel::Prediction& prediction, TrackedFrame* frame,
                           Attempt* attempt) {
  if (search_.FromFrame(map, last_, *prediction.T_cam_world, prediction.prior, frame)) return true;
  if (prediction.prior) {
    const int inliers = search_.FromPrediction(map, *prediction.T_cam_world, prediction.prior, frame);
    if (inliers >= options_.min_local_inliers) return true;
    if (inliers >= options_.min_coasting_inliers) attempt->weak_pose = frame->T_cam_world;
  }
  const uint64_t seed = DeriveSeed(seed_, frame->index, "track_keyframe");
  return search_.FromKeyframe(map, motion_.last().reference, seed, prediction.prior, frame);
}

/// The frame stays as it was where no place in the map fits.
void Tracker::Relocalize(const Map& map, std::optional<MapId> map_id, TrackedFrame* frame, Attempt* attempt) {
  TrackedFrame found(frame->index, frame->stamp_ns, frame->features);
  const uint64_t seed = DeriveSeed(seed_, frame->index, "relocalize");
  const auto last = LastKnown(map, map_id, frame->stamp_ns);
  if (!relocalizer_.Relocalize(map, map_id, motion_.last().reference, seed, &search_, &found, last)) return;
  *frame = std::move(found);
  attempt->report = search_.InLocalMap(map, true, std::nullopt, frame);
  attempt->relocalized = attempt->report.ok;
  if (attempt->relocalized) relocalized_ns_ = frame->stamp_ns;
}

/// Where the camera was when it was last tracked; none where that is not known in this map.
std::optional<Relocalizer::LastKnown> Tracker::LastKnown(const Map& map, std::optional<MapId> map_id,
                                                         int64_t stamp_ns) const {
  const std::optional<Rigid3d> T_last_world = motion_.last().In(map);
  const Keyframe* reference = map.FindKeyframe(motion_.last().reference);
  const std::optional<double> depth = reference != nullptr ? map.MedianDepth(*reference) : std::nullopt;
  if (!T_last_world || !depth || reference->map_id != map_id) return std::nullopt;
  const double elapsed_s = static_cast<double>(stamp_ns - motion_.last_stamp_ns()) * 1e-9;
  return Relocalizer::LastKnown{*T_last_world, std::abs(elapsed_s), *depth};
}

bool Tracker::IsCareful(int64_t stamp_ns) const {
  return relocalized_ns_ && stamp_ns - *relocalized_ns_ < kCarefulNs;
}

}  // namespace dmslam
