#include "dmslam/tracking/motion_model.h"

#include <algorithm>
#include <cmath>

#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

// Times are compared half a step beside those at which steps end. The frame that comes next is
// near enough at any rate.
constexpr int64_t kStepNs = 1'000'000'000 / kStepsPerSecond;
constexpr int64_t kRecentNs = 500'000'000;          // so long a tracked frame's pose leads anywhere
constexpr int64_t kKnownNs = kStepNs * 11 / 2;      // so long the newest pose's motion says something
constexpr int64_t kSuccessiveNs = kStepNs * 5 / 2;  // a step no longer than this is a motion...
constexpr double kFloor = 0.0005;                   // no pose is known better than this [rad], [depths]

struct Distance {
  double turned_rad = 0;
  double moved = 0;  ///< depths of the scene
};

Distance DistanceOf(const Rigid3d& a, const Rigid3d& b, double depth) {
  return {AngleBetween(a.rotation, b.rotation), (a.Center() - b.Center()).norm() / depth};
}

/// At least a step.
double SecondsSince(const FrameTime& from, const FrameTime& time) {
  return std::max(1.0 / kStepsPerSecond, SecondsFromTo(from.stamp_ns, time.stamp_ns));
}

Vector6d Difference(const Rigid3d& T, const Rigid3d& T_from) {
  const Rigid3d step = T * T_from.Inverse();
  Vector6d difference;
  difference << LogSo3(step.rotation), step.translation;
  return difference;
}

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

PlacedPose PlacedPose::Of(const Keyframe& reference, const Rigid3d& T_cam_world) {
  return {reference.id, T_cam_world * reference.T_cam_world.Inverse(), reference.scale};
}

std::optional<Rigid3d> PlacedPose::In(const Map& map) const {
  const std::optional<Map::ResolvedPose> keyframe = map.ResolvePose(reference);
  if (!keyframe) return std::nullopt;
  return In(*keyframe);
}

Rigid3d PlacedPose::In(const Map::ResolvedPose& resolved) const {
  return resolved.Compose(T_cam_reference, scale);
}

void MotionModel::Begin(const PlacedPose& pose, const FrameTime& time) {
  last_ = Pose{pose, time};
  Stop();
}

void MotionModel::Stop() {
  motion_.reset();
  coasting_.reset();
  covariance_.reset();
}

/// The motion goes on evenly, for no longer than it says something.
MotionFilter::Since MotionModel::Since(const Map& map, const Pose& newest, const FrameTime& time,
                                       double depth) const {
  int64_t since_ns = time.stamp_ns - newest.time.stamp_ns;
  if (time.index - newest.time.index != 1) since_ns = std::min(since_ns, kKnownNs);
  const auto reference = map.ResolvePose(newest.pose.reference);
  return {static_cast<double>(since_ns) * 1e-9, depth,
          reference ? reference->scale / newest.pose.scale : 1.0};
}

Matrix6d MotionModel::Floored(const Matrix6d& covariance, double depth) {
  Matrix6d floored = covariance;
  const double v = kFloor * depth;
  floored.diagonal() +=
      (Vector6d() << Eigen::Vector3d::Constant(kFloor * kFloor), Eigen::Vector3d::Constant(v * v)).finished();
  return floored;
}

/// What is known of the motion with this pose: none where too long has passed since the one before. A frame
/// that was tracked twice, as the one that made the first map is, has corrected its pose and not moved.
std::optional<MotionFilter> MotionModel::MotionTo(const Map& map, const FoundPose& found,
                                                  const FrameTime& time) const {
  const std::optional<Pose>& newest = Newest();
  const std::optional<Rigid3d> T_last_world = newest ? newest->pose.In(map) : std::nullopt;
  const std::optional<double> known_depth = Depth(map);
  if (!T_last_world || !known_depth) return std::nullopt;
  const double depth = *known_depth;
  const MotionFilter::Since since = Since(map, *newest, time, depth);
  if (since.duration_s <= 0) return motion_;
  if (motion_ && IsWithin(newest->time, time, kKnownNs)) {
    const Prediction prediction = Predict(map, time, depth);
    MotionFilter motion = *motion_;
    motion.Update(since, Difference(found.T_cam_world, *prediction.T_cam_world),
                  Floored(found.covariance, depth));
    return motion;
  }
  if (!IsWithin(newest->time, time, kSuccessiveNs)) return std::nullopt;
  return MotionFilter(options_.evenness, since, Difference(found.T_cam_world, *T_last_world),
                      Floored(covariance_.value_or(Matrix6d::Zero()), depth),
                      Floored(found.covariance, depth));
}

bool MotionModel::IsWithin(const FrameTime& newest, const FrameTime& time, int64_t limit_ns) {
  return time.index - newest.index == 1 || time.stamp_ns - newest.stamp_ns <= limit_ns;
}

/// Of the scene, as the keyframe seen last has it, or, where that was culled, the one that stands for it.
/// None where there is no such keyframe, or it sees nothing.
std::optional<double> MotionModel::Depth(const Map& map) const {
  const Keyframe* seen = last_ ? map.Resolve(last_->pose.reference) : nullptr;
  return seen != nullptr ? map.MedianDepth(*seen) : std::nullopt;
}

MotionModel::Prediction MotionModel::Predict(const Map& map, const FrameTime& time) const {
  return Predict(map, time, Depth(map));
}

MotionModel::Prediction MotionModel::Predict(const Map& map, const FrameTime& time,
                                             std::optional<double> depth) const {
  Prediction prediction;
  const std::optional<Pose>& newest = Newest();
  if (!newest) return prediction;
  prediction.recent = time.stamp_ns - last_->time.stamp_ns < kRecentNs;
  prediction.T_cam_world = newest->pose.In(map);
  if (!prediction.T_cam_world || !motion_ || !depth) return prediction;
  const MotionFilter::Expected expected = motion_->Predict(Since(map, *newest, time, *depth));
  prediction.T_cam_world =
      Rigid3d(ExpSo3(expected.step.head<3>()), expected.step.tail<3>()) * *prediction.T_cam_world;
  if (!IsWithin(newest->time, time, kKnownNs)) return prediction;
  prediction.prior = PosePrior{*prediction.T_cam_world, InverseOf(expected.covariance)};
  return prediction;
}

bool MotionModel::IsReachable(const Map& map, const Rigid3d& T_cam_world, const FrameTime& time) const {
  if (!IsRemembered(time)) return true;
  const Pose& newest = *Newest();
  const std::optional<double> depth = Depth(map);
  const Prediction prediction = Predict(map, time, depth);
  if (!prediction.prior || !depth) return IsWithinSpeed(map, newest, T_cam_world, time);
  const Distance distance = DistanceOf(T_cam_world, *prediction.T_cam_world, *depth);
  const double steps = std::max(1.0, std::round(SecondsSince(newest.time, time) * kStepsPerSecond));
  return distance.turned_rad <= options_.max_surprise * options_.prior_rotation_rad * steps &&
         distance.moved <= options_.max_surprise * options_.prior_translation * steps;
}

bool MotionModel::IsReachableFromTracked(const Map& map, const Rigid3d& T_cam_world,
                                         const FrameTime& time) const {
  return !IsRemembered(time) || IsWithinSpeed(map, *last_, T_cam_world, time);
}

bool MotionModel::IsRemembered(const FrameTime& time) const {
  return last_ && time.stamp_ns - last_->time.stamp_ns <= ToNs(options_.reach_known_s);
}

/// Whether a carried camera comes there from `pose`, no faster than hands and cars are.
bool MotionModel::IsWithinSpeed(const Map& map, const Pose& pose, const Rigid3d& T_cam_world,
                                const FrameTime& time) const {
  const std::optional<double> depth = Depth(map);
  const std::optional<Rigid3d> from = pose.pose.In(map);
  if (!from || !depth) return true;
  const Distance distance = DistanceOf(T_cam_world, *from, *depth);
  const double since_s = SecondsSince(pose.time, time);
  return distance.turned_rad <= options_.turn_slack_rad + options_.max_turn_rad_per_s * since_s &&
         distance.moved <= options_.speed_slack + options_.max_speed * since_s;
}

void MotionModel::OnTracked(const Map& map, const PlacedPose& pose, const FoundPose& found,
                            const FrameTime& time, bool jumped) {
  std::optional<MotionFilter> motion;
  if (!jumped) motion = MotionTo(map, found, time);
  Begin(pose, time);
  motion_ = std::move(motion);
  covariance_ = found.covariance;
}

void MotionModel::Coast(const Map& map, const FoundPose& found, const FrameTime& time) {
  if (!last_ || !IsWithin(Newest()->time, time, kKnownNs)) return;
  const Keyframe* reference = map.Resolve(last_->pose.reference);
  if (reference == nullptr) return;
  const PlacedPose pose = PlacedPose::Of(*reference, found.T_cam_world);
  motion_ = MotionTo(map, found, time);
  coasting_ = Pose{pose, time};
  covariance_ = found.covariance;
}

}  // namespace dmslam
