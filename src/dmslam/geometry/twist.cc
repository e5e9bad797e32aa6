#include "dmslam/geometry/twist.h"

namespace dmslam {

// The way is gone in the attitude of its middle: the body's velocity stays along its own axes to second
// order.
Twist TwistOf(const Rigid3d& T_before_after, double duration_s) {
  const Eigen::Vector3d turn = LogSo3(T_before_after.rotation);
  return {ExpSo3(-0.5 * turn) * T_before_after.translation / duration_s, turn / duration_s};
}

Rigid3d Carry(const Rigid3d& T_world_body, const Twist& twist, double duration_s) {
  const Eigen::Vector3d turn = duration_s * twist.angular_rad_per_s;
  return T_world_body * Rigid3d(ExpSo3(turn), ExpSo3(0.5 * turn) * (duration_s * twist.linear_per_s));
}

}  // namespace dmslam
