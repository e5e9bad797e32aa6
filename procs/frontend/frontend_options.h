#pragma once

#include <optional>
#include <string>

namespace dmslam {

/// Tracking (paper 2.3; ORB-SLAM2's constants where nothing better was found).
struct TrackingOptions {
  bool motion_belief = true;         ///< landmarks that are believed to move have no vote; off: all are equal
  double motion_radius_px = 15.0;    ///< search around the motion model's prediction, times the octave's scale
  int min_motion_matches = 20;       ///< fewer: the radius is doubled
  int min_motion_inliers = 10;
  int max_local_keyframes = 60;
  double local_radius = 4.0;         ///< search around a projected landmark, times the octave's scale
  double local_radius_frontal = 2.5; ///< the same where the view is nearly the mean view
  double local_ratio = 0.8;          ///< best over second best descriptor distance at the same octave
  int max_descriptor_distance = 100; ///< bits, with a position prior
  int min_local_inliers = 30;        ///< fewer: the frame is not tracked
  int min_inliers_after_relocalization = 50;
  double chi2 = 5.991;
  double moved_chi2 = 4.0 * 5.991;   ///< a strong match farther off than this speaks for motion
  double moved_radius_px = 30.0;     ///< how far a landmark that is missed in its place is looked for
  int moved_max_distance = 40;       ///< bits; a match elsewhere must be strong...
  double moved_ratio = 0.7;          ///< ...and alone
  double young_trust = 0.3;          ///< weight of a landmark that was just made...
  double trusted_age_s = 4.0;        ///< ...which grows to one when it stood still for so long
  int min_cells = 6;                 ///< inliers must lie in at least so many cells of an 8 x 6 grid
};

/// When a frame becomes a keyframe.
struct KeyframeOptions {
  double max_interval_s = 1.0;       ///< at least one per second, where it helps
  double min_interval_s = 0.1;       ///< never closer, unless tracking is weak
  double tracked_ratio = 0.9;        ///< of the reference keyframe's landmarks: fewer tracked asks for a keyframe
  int min_inliers = 15;
};

struct FrontendOptions {
  TrackingOptions tracking;
  KeyframeOptions keyframe;
  double trial_s = 0.5;              ///< a first map must predict the frames of this time, else it is dropped
  double new_map_after_s = 5.0;      ///< lost for so long: a new map is started, the old one is kept
  int evidence_every_frames = 10;
  int max_kept_frames = 300;         ///< unplaced frames kept for localisation at the end
};

}  // namespace dmslam
