#include "dmslam/tracking/motion_model.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

// Times are compared half a step beside those at which frames come at 30 Hz. The frame that comes next is
// near enough at any rate.
constexpr int64_t kStepNs = 1'000'000'000 / 30;
constexpr int64_t kRecentNs = 500'000'000;            // so long a tracked frame's pose leads anywhere
constexpr int64_t kKnownNs = kStepNs * 11 / 2;        // so long the newest pose's motion says something
constexpr int64_t kSuccessiveNs = kStepNs * 5 / 2;    // a step no longer than this is a motion...
constexpr int64_t kCoastingStepNs = kStepNs * 3 / 2;  // ...and this, with a weak pose at its end
constexpr double kJitter = 0.1;                       // share of a step by which stamps may be uneven

}  // namespace

PosePrior MotionPrior(const MotionModelOptions& options, const Rigid3d& T_cam_world, double depth,
                      double steps) {
  PosePrior prior;
  prior.T_cam_world = T_cam_world;
  const double rotation = 1.0 / (options.prior_rotation_rad * steps);
  const double translation = 1.0 / (options.prior_translation * depth * steps);
  prior.information.diagonal() << Eigen::Vector3d::Constant(rotation * rotation),
      Eigen::Vector3d::Constant(translation * translation);
  return prior;
}

std::optional<PlacedPose> PlacedPose::Of(const Map& map, const Rigid3d& T_cam_world, KeyframeId reference) {
  const Keyframe* keyframe = map.FindKeyframe(reference);
  if (keyframe == nullptr) return std::nullopt;
  return PlacedPose{reference, T_cam_world * keyframe->T_cam_world.Inverse(), keyframe->scale};
}

std::optional<Rigid3d> PlacedPose::In(const Map& map) const {
  const std::optional<Map::ResolvedPose> keyframe = map.ResolvePose(reference);
  if (!keyframe) return std::nullopt;
  return keyframe->Compose(T_cam_reference, scale);
}

void MotionModel::Begin(const PlacedPose& pose, const FrameTime& time) {
  last_ = {pose, time};
  Stop();
}

void MotionModel::Stop() {
  motion_.reset();
  coasting_.reset();
}

MotionModel::Motion MotionModel::MotionTo(const Rigid3d& T_cam_world, const Rigid3d& T_last_world,
                                          const FrameTime& time) const {
  return {T_cam_world * T_last_world.Inverse(), time.stamp_ns - Newest().time.stamp_ns};
}

/// The motion goes on evenly, for no longer than it says something. Stamps that jitter make no difference. A
/// frame that was tracked twice, as the one that made the first map is, has corrected its pose and not moved.
Rigid3d MotionModel::StepUntil(const FrameTime& time) const {
  const Rigid3d& motion = motion_->T_cam_lastcam;
  if (motion_->duration_ns <= 0) return motion;
  const int64_t since_ns =
      std::min(time.stamp_ns - Newest().time.stamp_ns, std::max(kKnownNs, motion_->duration_ns));
  const double steps = static_cast<double>(since_ns) / static_cast<double>(motion_->duration_ns);
  if (std::abs(steps - 1.0) < kJitter) return motion;
  return {ExpSo3(steps * LogSo3(motion.rotation)), steps * motion.translation};
}

bool MotionModel::IsWithin(const FrameTime& time, int64_t limit_ns) const {
  const FrameTime& newest = Newest().time;
  return time.index - newest.index == 1 || time.stamp_ns - newest.stamp_ns <= limit_ns;
}

/// Of the scene, as the keyframe seen last has it.
double MotionModel::Depth(const Map& map) const {
  const Keyframe* reference = map.FindKeyframe(last_.pose.reference);
  return reference != nullptr ? map.MedianDepth(*reference).value_or(1.0) : 1.0;
}

PosePrior MotionModel::MakePrior(const Map& map, const Rigid3d& T_cam_world, int64_t since_ns) const {
  return MotionPrior(options_, T_cam_world, Depth(map),
                     std::max(1.0, std::round(static_cast<double>(since_ns) / kStepNs)));
}

MotionModel::Prediction MotionModel::Predict(const Map& map, const FrameTime& time) const {
  Prediction prediction;
  prediction.recent = time.stamp_ns - last_.time.stamp_ns < kRecentNs;
  prediction.T_cam_world = Newest().pose.In(map);
  if (!prediction.T_cam_world || !motion_) return prediction;
  // The map may have been scaled since the motion was measured.
  const double growth = map.ResolvePose(Newest().pose.reference)->scale / Newest().pose.scale;
  const Rigid3d step = StepUntil(time);
  prediction.T_cam_world = Rigid3d(step.rotation, step.translation * growth) * *prediction.T_cam_world;
  if (!IsWithin(time, kKnownNs)) return prediction;
  prediction.prior = MakePrior(map, *prediction.T_cam_world, time.stamp_ns - Newest().time.stamp_ns);
  return prediction;
}

bool MotionModel::IsReachable(const Map& map, const Rigid3d& T_cam_world, const FrameTime& time) const {
  if (time.stamp_ns - last_.time.stamp_ns > static_cast<int64_t>(options_.reach_known_s * 1e9)) return true;
  const Prediction prediction = Predict(map, time);
  if (!prediction.T_cam_world) return true;
  const Rigid3d& from = prediction.prior ? *prediction.T_cam_world : *Newest().pose.In(map);
  const double turned_rad = AngleBetween(T_cam_world.rotation, from.rotation);
  const double moved = (T_cam_world.Center() - from.Center()).norm() / Depth(map);
  const double since_s =
      std::max(1.0 / 30, static_cast<double>(time.stamp_ns - Newest().time.stamp_ns) * 1e-9);
  if (prediction.prior) {
    const double steps = std::max(1.0, std::round(since_s * 30));
    return turned_rad <= options_.max_surprise * options_.prior_rotation_rad * steps &&
           moved <= options_.max_surprise * options_.prior_translation * steps;
  }
  return turned_rad <= options_.turn_slack_rad + options_.max_turn_rad_per_s * since_s &&
         moved <= options_.speed_slack + options_.max_speed * since_s;
}

void MotionModel::OnTracked(const Map& map, const PlacedPose& pose, const Rigid3d& T_cam_world,
                            const FrameTime& time, bool jumped) {
  const std::optional<Rigid3d> T_last_world = Newest().pose.In(map);
  const bool successive = IsWithin(time, kSuccessiveNs) && !jumped;
  const Motion motion = MotionTo(T_cam_world, T_last_world.value_or(T_cam_world), time);
  Begin(pose, time);
  if (successive && T_last_world) motion_ = motion;
}

void MotionModel::Coast(const Map& map, const Rigid3d& T_cam_world, const FrameTime& time) {
  const std::optional<Rigid3d> T_last_world = Newest().pose.In(map);
  const std::optional<PlacedPose> pose = PlacedPose::Of(map, T_cam_world, last_.pose.reference);
  if (!pose || !T_last_world || !IsWithin(time, kKnownNs)) return;
  if (IsWithin(time, kCoastingStepNs)) motion_ = MotionTo(T_cam_world, *T_last_world, time);
  coasting_ = Pose{*pose, time};
}

}  // namespace dmslam
