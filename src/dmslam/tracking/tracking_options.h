#pragma once

#include "dmslam/dynamics/motion_judge.h"
#include "dmslam/tracking/motion_model.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {

/// Tracking (paper 2.3; ORB-SLAM2's constants where nothing better was found).
struct TrackingOptions {
  DynamicsOptions dynamics;  ///< which landmarks have a say, and what is said of the others
  double motion_radius_rad =
      0.0285;                   ///< search around the motion model's prediction, times the octave's scale
  int min_motion_matches = 20;  ///< fewer: the radius is doubled
  int min_motion_inliers = 10;
  int max_local_keyframes = 60;
  double local_radius_rad = 0.0076;  ///< search around a projected landmark, times the octave's scale
  double local_radius_frontal_rad = 0.00476;  ///< the same where the view is nearly the mean view
  double local_ratio = 0.8;           ///< best over second best descriptor distance at the same octave
  int max_descriptor_distance = 100;  ///< bits, with a position prior
  int min_local_inliers = 20;         ///< fewer: the frame is not tracked
  int min_coasting_inliers = 8;       ///< so many still lead the search in the next frames
  int min_inliers_after_relocalization = 30;
  double chi2 = kChiSquared2Dof;
  MotionModelOptions motion;  ///< how well the next pose is known beforehand
  bool doubt = true;  ///< poses that may rest on what is no part of the room are followed, but not told
  /// Poses that are too far for the camera's usual speed count only where the place is seen as a whole or
  /// proven to be no person; frames that are placed late do not count there either.
  bool usual_speed = true;
  int min_cells = 6;  ///< inliers must lie in at least so many cells of an 8 x 6 grid

  template <typename Visitor>
  void Describe(Visitor& v) {
    dynamics.Describe(v);
    v.Number("tracking.motion_radius_rad", motion_radius_rad, 0.001, 0.5, "rad",
             "search around the motion model's prediction");
    v.Number("tracking.min_inliers", min_local_inliers, 6, 10000, "",
             "fewer static inliers: the frame is not tracked");
    v.Number("tracking.max_local_keyframes", max_local_keyframes, 1, 1000, "",
             "keyframes whose landmarks are searched for");
    v.Switch("tracking.doubt", doubt,
             "poses that may rest on what is no part of the room are followed for a second, but not told");
    v.InBaseline("off");
    v.InPaper("off");
    v.Switch("tracking.usual_speed", usual_speed,
             "a pose that is too far for the camera's usual speed counts only where the place is seen as a "
             "whole or proven to be no person, and not at all in frames that are placed late");
    v.InBaseline("off");
    v.InPaper("off");
  }
};

/// When a frame becomes a keyframe.
struct KeyframeOptions {
  double min_interval_s = 0.1;  ///< never closer, unless tracking is weak
  /// Of the landmarks that the reference keyframe sees: fewer tracked asks for a keyframe. Keyframes that
  /// turn out to say nothing new are removed again (mapping.redundant_share).
  double tracked_ratio = 1.0;
  int min_inliers = 15;  ///< with no more it is no keyframe, however few a frame may be tracked with

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("keyframe.min_interval_s", min_interval_s, 0, 60, "s",
             "no two keyframes within this time (of the frames around it the nearest counts), unless "
             "tracking is weak");
    v.Number("keyframe.tracked_ratio", tracked_ratio, 0, 1, "",
             "of the reference's landmarks; fewer tracked asks for a keyframe");
    v.InBaseline("0.9");
    v.InPaper("0.9");
  }
};

}  // namespace dmslam
