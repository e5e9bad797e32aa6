#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/alignment.h"
#include "dmslam/evaluation/association.h"
#include "dmslam/evaluation/statistics.h"
#include "dmslam/geometry/rigid3.h"

namespace dmslam {

struct AteOptions {
  // How the estimate is laid onto the ground truth; a monocular one needs kSim3.
  Alignment alignment = Alignment::kSim3;
  // Poses further apart in time than this are no pair [ns].
  int64_t max_difference_ns = 20'000'000;
};

/// The absolute trajectory error: the distances between the aligned estimate's positions and the ground
/// truth's (Sturm et al., "A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS 2012, Eq. 5).
struct AteReport {
  // Why there is no result; empty where there is one.
  std::string reason;
  // Of the errors [unit of the ground truth, metres in TUM's files].
  Statistics statistics;
  // Takes points of the estimate's world into that of the ground truth.
  Sim3d ground_truth_from_estimate;
  std::vector<PosePair> pairs;
  std::vector<double> errors;  // one per pair, in its order

  bool usable() const { return reason.empty(); }
  double rmse() const { return statistics.rmse; }
  double scale() const { return ground_truth_from_estimate.scale; }
};

/// Both trajectories sorted by time; whatever is wrong with them is in the report's `reason`. Equal to
/// `evo_ape tum GT EST --align [--correct_scale]` (pose relation: translation part).
AteReport EvaluateAte(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                      const AteOptions& options = {});

}  // namespace dmslam
