#include "dmslam/evaluation/rpe.h"

#include <cmath>
#include <numbers>

#include "dmslam/evaluation/ate.h"

namespace dmslam {
namespace {

std::vector<MotionPair> MotionsByFrames(size_t poses, size_t delta, bool all_pairs) {
  std::vector<MotionPair> motions;
  const size_t step = all_pairs ? 1 : delta;
  for (size_t i = 0; i + delta < poses; i += step) motions.push_back({i, i + delta});
  return motions;
}

// From every pose to the one nearest to `delta_s` later. Several poses may have the same stamp, where
// estimates share one of the ground truth.
std::vector<MotionPair> MotionsBySeconds(std::span<const StampedPose> poses, double delta_s,
                                         int64_t tolerance_ns) {
  std::vector<MotionPair> motions;
  const int64_t delta_ns = std::llround(delta_s * 1e9);
  std::vector<int64_t> stamps_ns;
  for (const StampedPose& pose : poses) stamps_ns.push_back(pose.stamp_ns);
  for (size_t i = 0; i < stamps_ns.size(); ++i) {
    const int64_t wanted_ns = stamps_ns[i] + delta_ns;
    const size_t j = FirstOfNearest<int64_t>(stamps_ns, wanted_ns);
    const bool is_later = stamps_ns[j] > stamps_ns[i];
    if (is_later && std::abs(stamps_ns[j] - wanted_ns) <= tolerance_ns) motions.push_back({i, j});
  }
  return motions;
}

std::vector<double> PathLengths(std::span<const StampedPose> poses) {
  std::vector<double> lengths(poses.size(), 0.0);
  for (size_t i = 1; i < poses.size(); ++i) {
    lengths[i] =
        lengths[i - 1] + (poses[i].T_world_cam.translation - poses[i - 1].T_world_cam.translation).norm();
  }
  return lengths;
}

// From every pose to the first one at least `delta` further along the path.
std::vector<MotionPair> MotionsByMetresFromEveryPose(std::span<const StampedPose> poses, double delta) {
  const std::vector<double> lengths = PathLengths(poses);
  std::vector<MotionPair> motions;
  size_t j = 0;
  for (size_t i = 0; i < poses.size(); ++i) {
    while (j < poses.size() && lengths[j] - lengths[i] < delta) ++j;
    if (j < poses.size()) motions.push_back({i, j});
  }
  return motions;
}

// End to end, as `evo` does: a stop each time `delta` has been travelled, and the motions between the stops.
std::vector<MotionPair> MotionsByMetresEndToEnd(std::span<const StampedPose> poses, double delta) {
  std::vector<size_t> stops;
  double travelled = 0;
  for (size_t i = 1; i < poses.size(); ++i) {
    travelled += (poses[i].T_world_cam.translation - poses[i - 1].T_world_cam.translation).norm();
    if (travelled < delta) continue;
    stops.push_back(i);
    travelled = 0;
  }
  std::vector<MotionPair> motions;
  for (size_t k = 1; k < stops.size(); ++k) motions.push_back({stops[k - 1], stops[k]});
  return motions;
}

std::vector<MotionPair> ChooseMotions(std::span<const StampedPose> poses, const RpeOptions& options) {
  switch (options.unit) {
    case RpeUnit::kFrames:
      return MotionsByFrames(poses.size(), static_cast<size_t>(options.delta), options.all_pairs);
    case RpeUnit::kSeconds:
      return MotionsBySeconds(poses, options.delta, options.max_difference_ns);
    case RpeUnit::kMetres:
      return options.all_pairs ? MotionsByMetresFromEveryPose(poses, options.delta)
                               : MotionsByMetresEndToEnd(poses, options.delta);
  }
  return {};
}

std::string WhyWrong(const RpeOptions& options) {
  if (!(options.delta > 0) || !std::isfinite(options.delta)) return "the delta of RPE must be positive";
  if (options.delta > kMaxRpeDelta) return "the delta of RPE must be at most 1e9";
  if (options.unit == RpeUnit::kFrames && options.delta != std::floor(options.delta)) {
    return "the delta of RPE in frames must be a whole number";
  }
  return {};
}

}  // namespace

std::string_view RpeUnitName(RpeUnit unit) {
  switch (unit) {
    case RpeUnit::kFrames:
      return "frames";
    case RpeUnit::kSeconds:
      return "seconds";
    case RpeUnit::kMetres:
      return "metres";
  }
  return "frames";
}

RpeReport EvaluateRpe(std::span<const StampedPose> ground_truth, std::span<const StampedPose> estimate,
                      const RpeOptions& options) {
  RpeReport report;
  report.reason = WhyWrong(options);
  if (!report.usable()) return report;
  const AteReport ate = EvaluateAte(ground_truth, estimate, {options.alignment, options.max_difference_ns});
  report.reason = ate.reason;
  if (!report.usable()) return report;
  report.pairs = ate.pairs;

  std::vector<StampedPose> reference, aligned;
  for (const PosePair& pair : report.pairs) {
    reference.push_back(ground_truth[pair.ground_truth]);
    StampedPose pose = estimate[pair.estimate];
    pose.T_world_cam.translation = ate.ground_truth_from_estimate * pose.T_world_cam.translation;
    pose.T_world_cam.rotation = ate.ground_truth_from_estimate.rotation * pose.T_world_cam.rotation;
    aligned.push_back(pose);
  }
  report.motions = ChooseMotions(reference, options);
  if (report.motions.empty()) {
    report.reason = "no two poses lie " + std::to_string(options.delta) + " " +
                    std::string(RpeUnitName(options.unit)) + " apart";
    return report;
  }
  for (const auto& [i, j] : report.motions) {
    const Rigid3d true_motion = reference[i].T_world_cam.Inverse() * reference[j].T_world_cam;
    const Rigid3d estimated_motion = aligned[i].T_world_cam.Inverse() * aligned[j].T_world_cam;
    const Rigid3d error = true_motion.Inverse() * estimated_motion;
    report.translation_errors.push_back(error.translation.norm());
    report.rotation_errors_deg.push_back(LogSo3(error.rotation).norm() * 180.0 / std::numbers::pi);
  }
  report.translation = ComputeStatistics(report.translation_errors);
  report.rotation_deg = ComputeStatistics(report.rotation_errors_deg);
  return report;
}

}  // namespace dmslam
