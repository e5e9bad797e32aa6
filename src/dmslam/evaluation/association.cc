#include "dmslam/evaluation/association.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr size_t kMinPairs = 3;
constexpr double kFarthest = 1e12;

// The double nearest to a stamp in seconds, as reading its decimal text gives.
double Seconds(int64_t stamp_ns) {
  const std::string text = FormatStampNs(stamp_ns);
  double seconds = 0;
  std::from_chars(text.data(), text.data() + text.size(), seconds);
  return seconds;
}

std::vector<double> Seconds(std::span<const StampedPose> trajectory) {
  std::vector<double> seconds;
  for (const StampedPose& pose : trajectory) seconds.push_back(Seconds(pose.stamp_ns));
  return seconds;
}

std::string TimeSpan(std::span<const StampedPose> trajectory) {
  return FormatStampNs(trajectory.front().stamp_ns) + " to " + FormatStampNs(trajectory.back().stamp_ns) +
         " s";
}

std::string WhyTooFewPairs(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                           size_t pairs, int64_t max_difference_ns) {
  const bool apart = ground_truth.back().stamp_ns + max_difference_ns < estimate.front().stamp_ns ||
                     estimate.back().stamp_ns + max_difference_ns < ground_truth.front().stamp_ns;
  const std::string spans = "ground truth " + TimeSpan(ground_truth) + ", estimate " + TimeSpan(estimate);
  if (apart) return "no overlap in time (" + spans + ")";
  return "fewer than three pairs: " + std::to_string(pairs) + " within " + FormatStampNs(max_difference_ns) +
         " s of each other (" + spans + ")";
}

}  // namespace

std::vector<PosePair> AssociateByTime(std::span<const StampedPose> ground_truth,
                                      std::span<const StampedPose> estimate, int64_t max_difference_ns) {
  const bool estimate_longer = estimate.size() > ground_truth.size();
  const std::vector<double> shorter = Seconds(estimate_longer ? ground_truth : estimate);
  const std::vector<double> longer = Seconds(estimate_longer ? estimate : ground_truth);
  const double max_difference = Seconds(max_difference_ns);
  std::vector<PosePair> pairs;
  for (size_t i = 0; i < shorter.size(); ++i) {
    const size_t j = FirstOfNearest<double>(longer, shorter[i]);
    if (std::abs(longer[j] - shorter[i]) > max_difference) continue;
    pairs.push_back(estimate_longer ? PosePair{i, j} : PosePair{j, i});
  }
  return pairs;
}

std::string WhyUnusable(std::span<const StampedPose> trajectory) {
  if (trajectory.empty()) return "holds no pose";
  for (size_t i = 0; i < trajectory.size(); ++i) {
    const std::string name =
        "pose " + std::to_string(i + 1) + " (stamp " + FormatStampNs(trajectory[i].stamp_ns) + ")";
    if (!trajectory[i].T_world_cam.AllFinite()) return name + " is not finite";
    if (trajectory[i].T_world_cam.translation.cwiseAbs().maxCoeff() > kFarthest)
      return name + " is more than 1e12 from the origin, where differences can no longer be told";
    if (i == 0 || trajectory[i].stamp_ns > trajectory[i - 1].stamp_ns) continue;
    return name + (trajectory[i].stamp_ns == trajectory[i - 1].stamp_ns
                       ? " repeats the stamp before it"
                       : " is earlier than the one before it");
  }
  return {};
}

Association AssociateForEvaluation(std::span<const StampedPose> ground_truth,
                                   std::span<const StampedPose> estimate, int64_t max_difference_ns) {
  Association association;
  if (const std::string why = WhyUnusable(ground_truth); !why.empty()) {
    association.reason = "ground truth: " + why;
  } else if (const std::string why_estimate = WhyUnusable(estimate); !why_estimate.empty()) {
    association.reason = "estimate: " + why_estimate;
  } else {
    association.pairs = AssociateByTime(ground_truth, estimate, max_difference_ns);
    if (association.pairs.size() < kMinPairs) {
      association.reason =
          WhyTooFewPairs(ground_truth, estimate, association.pairs.size(), max_difference_ns);
      association.pairs.clear();
    }
  }
  return association;
}

}  // namespace dmslam
