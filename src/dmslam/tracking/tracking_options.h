#pragma once

#include "dmslam/dynamics/motion_judge.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// Tracking (paper 2.3; ORB-SLAM2's constants where nothing better was found).
struct TrackingOptions {
  DynamicsOptions dynamics;        ///< which landmarks have a say, and what is said of the others
  double motion_radius_px = 15.0;  ///< search around the motion model's prediction, times the octave's scale
  int min_motion_matches = 20;     ///< fewer: the radius is doubled
  int min_motion_inliers = 10;
  int max_local_keyframes = 60;
  double local_radius = 4.0;          ///< search around a projected landmark, times the octave's scale
  double local_radius_frontal = 2.5;  ///< the same where the view is nearly the mean view
  double local_ratio = 0.8;           ///< best over second best descriptor distance at the same octave
  int max_descriptor_distance = 100;  ///< bits, with a position prior
  int min_local_inliers = 20;         ///< fewer: the frame is not tracked
  int min_coasting_inliers = 8;       ///< so many still lead the search in the next frames
  int min_inliers_after_relocalization = 50;
  double chi2 = 5.991;
  MotionModelOptions motion;  ///< how well the next pose is known beforehand
  int min_cells = 6;          ///< inliers must lie in at least so many cells of an 8 x 6 grid
};

/// When a frame becomes a keyframe.
struct KeyframeOptions {
  double max_interval_s = 1.0;  ///< at least one per second, where it helps
  double min_interval_s = 0.1;  ///< never closer, unless tracking is weak
  double tracked_ratio = 0.9;   ///< of the reference keyframe's landmarks: fewer tracked asks for a keyframe
  int min_inliers = 15;
};

}  // namespace dmslam
