#pragma once

#include "dmslam/util/chi_squared.h"

namespace dmslam {

struct EpipolarMatchOptions {
  int max_descriptor_distance = 50;  ///< bits
  double descriptor_ratio = 0.85;    ///< best over second best along the epipolar line
  double sigmas_squared = kRoundedChiSquared1Dof;
};

struct TriangulationOptions {
  int neighbours = 20;  ///< covisible keyframes that are matched with a keyframe
  double min_baseline_over_depth = 0.01;
  EpipolarMatchOptions matches;
  double min_parallax_rad = 0.0087;     ///< between the rays of a point, in the newest keyframe...
  double min_past_parallax_rad = 0.02;  ///< ...and in one that is placed after those that follow it
  double reprojection_sigmas_squared = kChiSquared2Dof;
  double scale_ratio_slack = 1.5;  ///< times the pyramid's factor
};

}  // namespace dmslam
