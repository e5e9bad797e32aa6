#pragma once

#include "dmslam/refinement/frame_refiner.h"
#include "dmslam/slam/first_map_method.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

struct FrontendOptions {
  FirstMapMethod initializer_method = FirstMapMethod::kDlrsac;
  double initializer_feature_factor =
      2.0;  ///< features of a frame while there is no map, times those of others
  TrackingOptions tracking;
  KeyframeOptions keyframe;
  double trial_s = 1.0;  ///< a first map must predict the frames of this time, else it is dropped
  /// Lost for so long while there is something to see: a new first map is looked for, while every frame goes
  /// on asking all maps where it is. The old map is kept.
  double new_map_after_s = 1.5;
  double evidence_every_s = 0.32;  ///< what frames said of landmarks is told so often, and before a keyframe
  int max_kept_frames = 900;       ///< unplaced frames kept for localisation at the end
  FrameRefinerOptions refiner;     ///< of the poses told at the end
  bool smooth_at_end = true;       ///< these are joined with the motion of a carried camera
  bool keyframes_at_end = true;  ///< frames that are placed when the sequence has ended become keyframes too

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Choice("initializer.method", initializer_method,
             {{"dlrsac", FirstMapMethod::kDlrsac},
              {"arsac", FirstMapMethod::kArsac},
              {"ransac", FirstMapMethod::kTwoFrameRansac},
              {"paper", FirstMapMethod::kTwoFramePaper}},
             "which matches are static; of two frames alone: ransac, without gates, and paper, DLRSAC as "
             "published (with these two, no initializer.* but method and feature_factor has an effect)");
    v.InBaseline("ransac");
    v.InPaper("paper");
    v.Number("initializer.feature_factor", initializer_feature_factor, 0.5, 5, "",
             "features of a frame while there is no map, times features.count; at most 9000");
    tracking.Describe(v);
    v.Number("tracking.trial_s", trial_s, 0, 60, "s", "time for which a first map must predict the frames");
    v.InPaper("0");
    v.Number("tracking.new_map_after_s", new_map_after_s, 0.1, 3600, "s",
             "lost for so long, darkness not counted: a new map is started as well");
    v.InBaseline("5");
    v.InPaper("5");
    v.Number("tracking.max_kept_frames", max_kept_frames, 0, 100000, "frames",
             "unplaced frames kept for localisation at the end");
    v.InBaseline("300");
    v.InPaper("300");
    v.Switch("tracking.smooth_at_end", smooth_at_end,
             "the poses told at the end: landmarks placed by all frames, weak frames looked for from the "
             "motion, and joined with it");
    v.InBaseline("off");
    v.InPaper("off");
    keyframe.Describe(v);
    v.Switch("keyframe.at_end", keyframes_at_end,
             "frames placed when the sequence has ended become keyframes too, and the map grows to where "
             "they see");
    v.InBaseline("off");
    v.InPaper("off");
  }
};

}  // namespace dmslam
