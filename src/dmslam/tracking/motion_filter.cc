#include "dmslam/tracking/motion_filter.h"

#include "dmslam/geometry/solve_symmetric.h"

namespace dmslam {
namespace {

constexpr double kStep_s = 1.0 / kStepsPerSecond;

/// Power of a white acceleration under which two successive steps differ by sigma: their difference has the
/// variance 2/3 * power * step^3.
double Power(double sigma) { return 1.5 * sigma * sigma / (kStep_s * kStep_s * kStep_s); }

}  // namespace

Vector6d MotionFilter::Noise(double depth) const {
  Vector6d noise;
  noise << Eigen::Vector3d::Constant(Power(options_.rotation_rad)),
      Eigen::Vector3d::Constant(Power(options_.translation * depth));
  return noise;
}

MotionFilter::MotionFilter(const EvennessOptions& options, const Since& since, const Vector6d& step,
                           const Matrix6d& before, const Matrix6d& now)
    : options_(options) {
  const double dt = since.duration_s;
  state_.velocity_per_s = step / dt;
  state_.pose = now;
  state_.cross = now / dt;
  state_.velocity = (before + now) / (dt * dt);
  state_.velocity.diagonal() += dt / 3 * Noise(since.depth);
}

MotionFilter::State MotionFilter::At(const Since& since) const {
  Vector6d unit;
  unit << Eigen::Vector3d::Ones(), Eigen::Vector3d::Constant(since.growth);
  const auto grown = [&](const Matrix6d& covariance) -> Matrix6d {
    return unit.asDiagonal() * covariance * unit.asDiagonal();
  };
  const Vector6d noise = Noise(since.depth);
  const Matrix6d pose = grown(state_.pose), cross = grown(state_.cross), velocity = grown(state_.velocity);
  const double dt = since.duration_s;
  State state;
  state.velocity_per_s = unit.cwiseProduct(state_.velocity_per_s);
  state.pose = pose + dt * (cross + cross.transpose()) + dt * dt * velocity;
  state.pose.diagonal() += dt * dt * dt / 3 * noise;
  state.cross = cross + dt * velocity;
  state.cross.diagonal() += dt * dt / 2 * noise;
  state.velocity = velocity;
  state.velocity.diagonal() += dt * noise;
  return state;
}

MotionFilter::Expected MotionFilter::Predict(const Since& since) const {
  const State state = At(since);
  return {since.duration_s * state.velocity_per_s, state.pose};
}

void MotionFilter::Update(const Since& since, const Vector6d& error, const Matrix6d& covariance) {
  State state = At(since);
  const Matrix6d gain = SolveSymmetric(state.pose, state.cross).transpose();
  state.velocity_per_s += gain * error;
  state.velocity -= gain * (state.pose - covariance) * gain.transpose();
  state.cross = covariance * gain.transpose();
  state.pose = covariance;
  state_ = state;
}

}  // namespace dmslam
