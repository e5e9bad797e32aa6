#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/plot.h"
#include "dmslam/evaluation/uncertain_trajectory.h"

namespace dmslam {

struct NeesOptions {
  double gauge_s = 5.0;    ///< the scale is that of the first seconds that were tracked
  double slack_m = 0.005;  ///< a truth may be wrong by so much, for `outside`
  int64_t max_difference_ns = 20'000'000;
  PoseErrorModel model;
};

/// What was told of the motion between two frames, and what was true of it.
struct NeesPair {
  int64_t stamp_ns = 0;  ///< of its end
  double coverage = 0;   ///< mean of both ends
  double position = 0;   ///< normalised error squared, of 3 dimensions; divided by 3 its mean should be 1
  double rotation = 0;
  double position_error = 0, rotation_error_rad = 0;  ///< lengths [m, rad]
  double position_sigma = 0, rotation_sigma_rad = 0;  ///< standard deviations along the errors
  bool outside = false;  ///< the position is off by more than 3 sigma and the slack
};

/// Beyond this a normalised error squared of three dimensions lies once in a thousand times.
inline constexpr double kBound999 = 16.266;

/// Relative poses `after_s` apart, each frame to the one so much later, of frames of one map whose covariance
/// was told. Those of a map on trial, which may be taken back, are left out. `coverage`: the share of the
/// image that moving things cover, by frame; may be empty. Position and rotation apart (NEES, Bar-Shalom et
/// al., Estimation with Applications to Tracking and Navigation, 2001, ch. 5.4). Empty where the first
/// seconds do not determine the scale.
std::vector<NeesPair> ComputeNees(std::span<const StampedPose> ground_truth, std::span<const ToldPose> told,
                                  std::span<const double> coverage, double after_s,
                                  const NeesOptions& options = {});

/// What pairs come to.
struct NeesSummary {
  size_t count = 0;
  double position = 0, rotation = 0;                // means of the normalised errors squared over 3
  double position_beyond = 0, rotation_beyond = 0;  // shares beyond kBound999
  double outside = 0;                               // share
};
NeesSummary Summarize(std::span<const NeesPair> pairs);

/// A third of the pairs by coverage: 0, 1 or 2, least first.
std::vector<NeesPair> ThirdByCoverage(std::vector<NeesPair> pairs, int third);

/// Errors against three standard deviations over time: a row of panels for each interval.
struct NeesCurve {
  double after_s = 1.0;
  std::vector<NeesPair> pairs;
};
PlotFigure NeesFigure(std::span<const NeesCurve> curves, const std::string& title);

}  // namespace dmslam
