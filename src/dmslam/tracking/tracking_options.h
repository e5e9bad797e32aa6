#pragma once

namespace dmslam {

/// Tracking (paper 2.3; ORB-SLAM2's constants where nothing better was found).
struct TrackingOptions {
  bool motion_belief = true;       ///< landmarks that are believed to move have no vote; off: all are equal
  double motion_radius_px = 15.0;  ///< search around the motion model's prediction, times the octave's scale
  int min_motion_matches = 20;     ///< fewer: the radius is doubled
  int min_motion_inliers = 10;
  int max_local_keyframes = 60;
  double local_radius = 4.0;          ///< search around a projected landmark, times the octave's scale
  double local_radius_frontal = 2.5;  ///< the same where the view is nearly the mean view
  double local_ratio = 0.8;           ///< best over second best descriptor distance at the same octave
  int max_descriptor_distance = 100;  ///< bits, with a position prior
  double hidden_distance =
      40;  ///< so few bits are asked of a match where nothing else of the map is found...
  double hidden_distance_slope =
      200;                       ///< ...and so many more are allowed, times the share that is found around it
  int min_local_inliers = 20;    ///< fewer: the frame is not tracked
  int min_coasting_inliers = 8;  ///< so many still lead the search in the next frames, for half a second
  int min_inliers_after_relocalization = 50;
  double chi2 = 5.991;
  double moved_chi2 = 4.0 * 5.991;  ///< a strong match farther off than this speaks for motion
  double moved_near_chi2 =
      16.0;  ///< a match near its place that is refused by so much speaks for motion too...
  int moved_near_distance = 60;     ///< ...where it looks like the landmark [bits]
  double moved_radius_px = 30.0;    ///< how far a landmark that is missed in its place is looked for
  int moved_max_distance = 40;      ///< bits; a match elsewhere must be strong...
  double moved_ratio = 0.7;         ///< ...and alone
  double seen_through_px = 40.0;    ///< what is seen this near to a missing landmark...
  double seen_through_depth = 1.2;  ///< ...and this much farther away says that it has gone...
  int seen_through_min = 2;     ///< ...where at least so many say it, and nothing of its own depth denies it
  int moving_together_min = 3;  ///< a missing landmark goes with so many of its depth around it that move
  double young_trust = 0.3;     ///< weight of a landmark that was just made...
  double trusted_age_s = 4.0;   ///< ...which grows to one when it stood still for so long
  double prior_rotation_rad = 0.01;  ///< how well the motion model knows the rotation...
  double prior_translation = 0.01;   ///< ...and the translation, as a share of the scene's depth
  int min_elders = 40;               ///< the oldest so many matched landmarks decide the pose first...
  double elder_share = 0.4;          ///< ...or this share of the matches, if that is more...
  double elder_agreement = 0.6;      ///< ...provided that this share of them agree
  double elder_chi2 = 7.8;           ///< younger ones farther from that pose have no say
  double young_to_elder_weight =
      0.5;            ///< all younger ones together weigh at most this much of what the elders weigh
  int min_cells = 6;  ///< inliers must lie in at least so many cells of an 8 x 6 grid
};

/// When a frame becomes a keyframe.
struct KeyframeOptions {
  double max_interval_s = 1.0;  ///< at least one per second, where it helps
  double min_interval_s = 0.1;  ///< never closer, unless tracking is weak
  double tracked_ratio = 0.9;   ///< of the reference keyframe's landmarks: fewer tracked asks for a keyframe
  int min_inliers = 15;
};

}  // namespace dmslam
