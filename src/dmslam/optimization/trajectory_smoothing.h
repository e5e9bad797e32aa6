#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/similarity.h"

namespace dmslam {

/// The pose of one frame, found from what it saw alone.
struct PoseEstimate {
  double time_s = 0.0;
  Rigid3d T_cam_world;
  /// Of the pose, tangent (w, v) on its left as in PoseOptimizationReport; zero: nothing is known, and the
  /// pose given is where the search begins.
  Matrix6d information = Matrix6d::Zero();
  /// The part of the information that comes from what the frames before saw too: their errors are alike.
  Matrix6d shared = Matrix6d::Zero();
  bool leaps = false;  ///< no motion leads here from the pose before
};

/// How sure poses and motion are.
struct MotionNoise {
  double variance = 1.0;          ///< of the poses, relative to what their information says
  double jerk_rotation = 0.0;     ///< spectral density of the rotation's jerk [rad^2 / s^5]...
  double jerk_translation = 0.0;  ///< ...and of the camera centre's [map units^2 / s^5]
};

struct SmoothingOptions {
  int rounds = 4;                    ///< after each the weights of the poses and the noise are found anew
  double freedom = 6.0;              ///< degrees of freedom of Student's t: fewer, and outliers have less say
  double max_gap_s = 1.0;            ///< motions apart by more say nothing of each other
  int min_poses = 10;                ///< fewer are left as they are
  double min_variance = 0.1;         ///< of the poses, relative to what their information says...
  double max_variance = 1.0;         ///< ...what is more must be motion
  double common_variance = 0.1;      ///< of the errors that frames have in common, besides; relative likewise
  std::optional<MotionNoise> noise;  ///< as found before, in the same map; none: it is found from the data
  int threads = 1;                   ///< that work at a time; the result does not depend on it
};

struct SmoothedTrajectory {
  std::vector<Rigid3d> T_cam_world;  ///< parallel to the estimates
  std::optional<MotionNoise> noise;  ///< that was assumed; none where the poses were too few
};

/// Joins what each frame saw with how a carried camera moves: the most probable trajectory under white noise
/// on the jerk (a Gaussian process with rotation rate and velocity, their rates, and the pose as its state;
/// Barfoot, State Estimation for Robotics, ch. 3.4 and 11, with jerk for acceleration). Poses that are well
/// known hardly move; those of frames that saw a small part of the scene follow their neighbours. How strong
/// the noise is, of the motion and of the poses, is what makes the poses most likely, so that a jerky camera
/// is not smoothed. Frames that see the same landmarks err alike: ten poses that are wrong by the same are no
/// better known than one, so a part of each error is carried from frame to frame as far as the same landmarks
/// determine both (PoseEstimate::shared). Poses that contradict their neighbours lose weight (Student's t).
/// Estimates are in order of time, all in the coordinates of one map. What cannot be solved comes back as it
/// was given. Deterministic.
SmoothedTrajectory SmoothTrajectory(std::span<const PoseEstimate> estimates,
                                    const SmoothingOptions& options = {});

}  // namespace dmslam
