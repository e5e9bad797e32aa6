#pragma once

#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/ate.h"
#include "dmslam/evaluation/coverage.h"
#include "dmslam/evaluation/rpe.h"

namespace dmslam {

struct EvaluationOptions {
  Alignment alignment = Alignment::kSim3;
  int64_t max_difference_ns = 20'000'000;
  // One RPE for each; their alignment and max_difference_ns are set to the ones above.
  std::vector<RpeOptions> rpe;
};

/// All that is said about one trajectory.
struct Evaluation {
  EvaluationOptions options;
  AteReport ate;
  std::vector<RpeReport> rpe;  // one per options.rpe
  Coverage coverage;
};

/// Errors of `estimate`; `coverage` (see ComputeCoverage) is carried along.
Evaluation Evaluate(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                    const EvaluationOptions& options, const Coverage& coverage);

/// The evaluation as a table for people, and as a JSON document (lengths in metres, angles in degrees, times
/// in seconds; null where there is no value).
std::string EvaluationTable(const Evaluation& evaluation);
std::string EvaluationJson(const Evaluation& evaluation);

/// One line for under a plot's title: "ATE RMSE 0.0098 m (sim3, scale 1.106), 32 pairs, 97.2 % of 1000
/// frames".
std::string EvaluationSummary(const Evaluation& evaluation);

}  // namespace dmslam
