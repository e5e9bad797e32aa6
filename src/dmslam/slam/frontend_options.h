#pragma once

#include <string>

#include "dmslam/refinement/frame_refiner.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

struct FrontendOptions {
  /// dlrsac; arsac, behind the same gates; or ransac: two frames and plain RANSAC without gates (the
  /// baseline).
  std::string initializer_method = "dlrsac";
  double initializer_feature_factor =
      2.0;  ///< features of a frame while there is no map, times those of others
  TrackingOptions tracking;
  KeyframeOptions keyframe;
  double trial_s = 0.5;            ///< a first map must predict the frames of this time, else it is dropped
  double new_map_after_s = 5.0;    ///< lost for so long: a new map is started, the old one is kept
  double evidence_every_s = 0.32;  ///< what frames said of landmarks is told so often, and before a keyframe
  int max_kept_frames = 900;       ///< unplaced frames kept for localisation at the end
  FrameRefinerOptions refiner;     ///< of the poses told at the end
  bool smooth_at_end = true;       ///< these are joined with the motion of a carried camera
  bool keyframes_at_end = true;  ///< frames that are placed when the sequence has ended become keyframes too
};

}  // namespace dmslam
