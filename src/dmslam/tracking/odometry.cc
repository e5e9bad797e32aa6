#include "dmslam/tracking/odometry.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr double kCarryS = 0.5;            // so long a motion goes on that is not seen
constexpr double kVelocityMemoryS = 0.05;  // time constant of the velocity's mean over the steps
constexpr double kLeastIntervalS = 1e-6;   // of two frames, to have a motion between them

}  // namespace

/// The mean over the last steps: a single one has the noise of two poses.
void Odometer::SetVelocity(const Twist& step, double duration_s) {
  if (!state_.velocity) {
    state_.velocity = step;
    return;
  }
  const double share = 1.0 - std::exp(-duration_s / kVelocityMemoryS);
  state_.velocity->linear_per_s += share * (step.linear_per_s - state_.velocity->linear_per_s);
  state_.velocity->angular_rad_per_s += share * (step.angular_rad_per_s - state_.velocity->angular_rad_per_s);
}

/// By the step from the frame tracked last, in the map as it is now. False: it is not known.
bool Odometer::Continue(const Map& map, const FrameTime& time, const Rigid3d& T_cam_world, bool follows) {
  if (!last_) return false;
  const std::optional<Rigid3d> T_last_world = last_->pose.In(map);
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(last_->pose.reference);
  if (!T_last_world || !reference || reference->map_id() != state_.map_id) return false;
  units_ *= reference->scale / last_->pose.scale;
  const double since_s = SecondsFromTo(last_->time.stamp_ns, time.stamp_ns);
  if (!follows || since_s > kCarryS || last_->segment != state_.segment) return false;
  Rigid3d T_last_now = *T_last_world * T_cam_world.Inverse();
  T_last_now.translation /= units_;
  state_.T_odom_cam = last_->T_odom_cam * T_last_now;
  if (since_s > kLeastIntervalS) SetVelocity(TwistOf(T_last_now, since_s), since_s);
  return true;
}

/// Where the camera is held to be stays; the correction takes up what is not known of the way.
void Odometer::BeginSegment(bool same_units) {
  state_.segment = state_.segment.value_or(0) + 1;
  state_.velocity.reset();
  if (!same_units) units_ = 1.0;
}

void Odometer::OnTracked(const Map& map, const FrameTime& time, const PlacedPose& pose,
                         const Rigid3d& T_cam_world, const std::optional<PoseCertainty>& certainty,
                         bool follows) {
  const std::optional<Map::ResolvedPose> reference = map.ResolvePose(pose.reference);
  state_.map_id = reference ? std::optional(reference->map_id()) : std::nullopt;
  const std::optional<Map::ResolvedPose> before =
      last_ ? map.ResolvePose(last_->pose.reference) : std::nullopt;
  if (!Continue(map, time, T_cam_world, follows)) BeginSegment(before && before->map_id() == state_.map_id);
  const Rigid3d T_world_cam = T_cam_world.Inverse();
  state_.measured = true;
  state_.map_from_odom =
      Sim3d(T_world_cam.rotation, T_world_cam.translation, units_) * Sim3d(state_.T_odom_cam).Inverse();
  state_.step.reset();
  if (certainty) {
    state_.depth = certainty->depth / units_;
    state_.step = certainty->step;
  }
  if (state_.step) {
    Vector6d units = Vector6d::Ones();
    units.head<3>() /= units_;
    state_.step->covariance = units.asDiagonal() * state_.step->covariance * units.asDiagonal();
  }
  last_ = Last{pose, time, state_.T_odom_cam, *state_.segment};
  turned_from_.reset();
}

/// Turns that are counted from the frame tracked last continue its segment; before others something is
/// missing.
void Odometer::OnTurned(int64_t since_ns, const Eigen::Quaterniond& R_now_since) {
  if (!turned_from_ || turned_from_->stamp_ns != since_ns) {
    const bool continues = last_ && last_->time.stamp_ns == since_ns && last_->segment == state_.segment;
    if (!continues) BeginSegment(true);
    turned_from_ = TurnedFrom{since_ns, (continues ? last_->T_odom_cam : state_.T_odom_cam).rotation};
  }
  state_.T_odom_cam.rotation = turned_from_->R_odom_cam * R_now_since.conjugate();
}

void Odometer::Predict(const FrameTime& time) {
  state_.measured = false;
  state_.step.reset();
  if (!last_ || !state_.velocity) return;
  const double since_s = SecondsFromTo(last_->time.stamp_ns, time.stamp_ns);
  state_.T_odom_cam = Carry(last_->T_odom_cam, *state_.velocity, std::clamp(since_s, 0.0, kCarryS));
  if (since_s > kCarryS) state_.velocity.reset();
}

}  // namespace dmslam
