#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/alignment.h"
#include "dmslam/evaluation/association.h"
#include "dmslam/evaluation/statistics.h"

namespace dmslam {

/// What the length of a relative motion is counted in.
enum class RpeUnit {
  kFrames,   // associated poses
  kSeconds,  // ground-truth stamps
  kMetres,   // path length along the ground truth
};

/// The largest length of a relative motion, in any unit: more than any trajectory has, and neither indices
/// nor nanoseconds overflow.
inline constexpr double kMaxRpeDelta = 1e9;

struct RpeOptions {
  Alignment alignment = Alignment::kSim3;
  // Poses further apart in time than this are no pair [ns]; in kSeconds, also how far the second pose of a
  // motion may be from the wanted moment.
  int64_t max_difference_ns = 20'000'000;
  RpeUnit unit = RpeUnit::kFrames;
  // Length of a relative motion, in `unit`, up to kMaxRpeDelta; a whole number in kFrames.
  double delta = 1;
  // kFrames and kMetres: motions from every pose (true), or end to end (false), as `evo` does by default.
  // kSeconds always takes every pose.
  bool all_pairs = false;
};

/// Two associated pairs between which the motion is compared: indices into `RpeReport::pairs`.
struct MotionPair {
  size_t from;
  size_t to;
};

/// The relative pose error: per motion, E = (Q_i^-1 Q_j)^-1 (P_i^-1 P_j) with ground truth Q and aligned
/// estimate P (Sturm et al., IROS 2012, Eq. 3).
struct RpeReport {
  // Why there is no result; empty where there is one.
  std::string reason;
  Statistics translation;   // length of E's translation [unit of the ground truth]
  Statistics rotation_deg;  // angle of E's rotation [degrees]
  std::vector<PosePair> pairs;
  std::vector<MotionPair> motions;
  std::vector<double> translation_errors;   // one per motion
  std::vector<double> rotation_errors_deg;  // one per motion

  bool usable() const { return reason.empty(); }
};

/// Equal to `evo_rpe tum GT EST --align [--correct_scale] --delta D --delta_unit f|m --pairs_from_reference`.
RpeReport EvaluateRpe(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                      const RpeOptions& options = {});

/// "frames", "seconds", "metres".
std::string_view RpeUnitName(RpeUnit unit);

}  // namespace dmslam
