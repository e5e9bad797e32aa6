#pragma once

#include <span>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/frame_features.h"
#include "dmslam/features/matcher.h"
#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

/// How features of two frames are matched.
struct MatchingOptions {
  bool use_window = true;         ///< search only near where the feature was
  double window_rad = 0.19;       ///< radius
  int octave_slack = 1;           ///< largest difference of octaves in the window
  double max_ratio = 0.9;         ///< best distance to second best
  int max_distance = 50;          ///< [bits]
  bool check_orientation = true;  ///< keep the turns that most matches share
};

/// Matches of two frames of the camera by the options, sorted by index0. `predicted_px`: where the features
/// of the first are looked for in the second; empty: where they were.
std::vector<Match> MatchFrames(const FrameFeatures& frame0, const FrameFeatures& frame1, const Camera& camera,
                               const MatchingOptions& options, FeatureMatcher* matcher,
                               std::span<const Eigen::Vector2d> predicted_px = {});

/// Looks for the features of the first frame that are in none of `matches` where they were, and adds what is
/// found to them, sorted by index0: what moves apart from the rest is not where the others' motion would have
/// brought it.
void AddMatchesInPlace(const FrameFeatures& frame0, const FrameFeatures& frame1, const Camera& camera,
                       const MatchingOptions& options, FeatureMatcher* matcher, std::vector<Match>* matches);

/// At most so many of the matches, spread evenly over them.
std::vector<Match> ChooseEvenly(const std::vector<Match>& matches, size_t most);

}  // namespace dmslam
