#include "dmslam/evaluation/ate.h"

namespace dmslam {

AteReport EvaluateAte(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                      const AteOptions& options) {
  AteReport report;
  Association association = AssociateForEvaluation(ground_truth, estimate, options.max_difference_ns);
  report.reason = association.reason;
  if (!report.usable()) return report;
  report.pairs = std::move(association.pairs);

  std::vector<Eigen::Vector3d> p_ground_truth, p_estimate;
  for (const PosePair& pair : report.pairs) {
    p_ground_truth.push_back(ground_truth[pair.ground_truth].T_world_cam.translation);
    p_estimate.push_back(estimate[pair.estimate].T_world_cam.translation);
  }
  const auto ground_truth_from_estimate = AlignPoints(p_estimate, p_ground_truth, options.alignment);
  if (!ground_truth_from_estimate) {
    report.reason = "the positions lie in one point or on one line, so that no alignment is determined";
    return report;
  }
  report.ground_truth_from_estimate = *ground_truth_from_estimate;
  for (size_t i = 0; i < report.pairs.size(); ++i) {
    report.errors.push_back((*ground_truth_from_estimate * p_estimate[i] - p_ground_truth[i]).norm());
  }
  report.statistics = ComputeStatistics(report.errors);
  return report;
}

}  // namespace dmslam
