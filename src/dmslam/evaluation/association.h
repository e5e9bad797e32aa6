#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"

namespace dmslam {

/// The index of the first of those nearest to `moment` in a not empty list that does not fall.
template <typename Time>
size_t FirstOfNearest(std::span<const Time> rising, Time moment) {
  const auto not_before = std::lower_bound(rising.begin(), rising.end(), moment);
  size_t nearest = static_cast<size_t>(not_before - rising.begin());
  if (nearest == rising.size()) --nearest;
  while (nearest > 0 && std::abs(rising[nearest - 1] - moment) <= std::abs(rising[nearest] - moment))
    --nearest;
  return nearest;
}

/// Two poses of the same moment: indices into the ground truth and into the estimate.
struct PosePair {
  size_t ground_truth;
  size_t estimate;
};

/// Pairs by time, as `evo` makes them: every pose of the shorter trajectory (of the estimate, where both are
/// equally long) takes the nearest in time of the longer one (the earlier of two equally near), unless that
/// is more than `max_difference_ns` away. A pose of the longer one may be taken twice. Both must be sorted by
/// time. Distances are taken between stamps rounded to doubles, as there: with stamps of 1.3e9 s their
/// rounding (0.1 us) decides between poses that are equally near, which real files do contain.
std::vector<PosePair> AssociateByTime(std::span<const StampedPose> ground_truth,
                                      std::span<const StampedPose> estimate, int64_t max_difference_ns);

/// Why a trajectory cannot be evaluated ("pose 17 (stamp 12.5) is not later than the one before it"), empty
/// where it can: stamps must rise strictly and every number must be finite.
std::string WhyUnusable(std::span<const StampedPose> trajectory);

/// As AssociateByTime, for evaluation: `reason` says why there are no usable pairs (an unusable trajectory,
/// no overlap in time, fewer than three pairs), and is empty where there are.
struct Association {
  std::vector<PosePair> pairs;
  std::string reason;
};
Association AssociateForEvaluation(std::span<const StampedPose> ground_truth,
                                   std::span<const StampedPose> estimate, int64_t max_difference_ns);

}  // namespace dmslam
