#pragma once

#include <Eigen/Core>
#include <optional>

#include "dmslam/geometry/similarity.h"

namespace dmslam {

/// A camera's motion is told by what it does in a step of a thirtieth of a second, at whatever rate frames
/// come.
inline constexpr int kStepsPerSecond = 30;

/// How evenly a camera moves: the standard deviations, along each axis, by which two successive steps differ.
struct EvennessOptions {
  double rotation_rad = 0.007;
  double translation = 0.0055;  ///< as a share of the scene's depth
};

/// The velocity of a camera, by what all of its poses so far said of it, and how well it is known: a Kalman
/// filter with white noise on the acceleration (Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to
/// Tracking and Navigation", 2001, Sec. 6.2.2). A pose that is hardly known says little of the velocity, so
/// the next one is not carried away by it. Errors and steps are (w, v) of {Exp(w), v}, on the left of
/// T_cam_world.
class MotionFilter {
 public:
  /// A pose, and the covariance of where it is expected to be found.
  struct Expected {
    Vector6d step = Vector6d::Zero();  ///< from the last pose
    Matrix6d covariance = Matrix6d::Zero();
  };

  /// What has passed since the last pose.
  struct Since {
    double duration_s = 0;
    double depth = 1;   ///< of the scene [map units]
    double growth = 1;  ///< of the map's unit
  };

  /// From two poses, `step` from one to the other, of these covariances.
  MotionFilter(const EvennessOptions& options, const Since& since, const Vector6d& step,
               const Matrix6d& before, const Matrix6d& now);

  Expected Predict(const Since& since) const;
  /// A pose was found `error` from where it was expected, of this covariance.
  void Update(const Since& since, const Vector6d& error, const Matrix6d& covariance);

 private:
  struct State {
    Vector6d velocity_per_s = Vector6d::Zero();
    Matrix6d pose = Matrix6d::Zero(), cross = Matrix6d::Zero(), velocity = Matrix6d::Zero();  ///< covariances
  };
  State At(const Since& since) const;
  Vector6d Noise(double depth) const;  ///< power of the acceleration along each axis

  EvennessOptions options_;
  State state_;
};

}  // namespace dmslam
