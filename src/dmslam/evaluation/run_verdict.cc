#include "dmslam/evaluation/run_verdict.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "dmslam/evaluation/ate.h"
#include "dmslam/evaluation/coverage.h"
#include "dmslam/evaluation/rpe.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kSameMomentNs = 20'000'000;
constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

bool IsTooFarOff(double error_m, double error_deg, const VerdictLimits& limits) {
  return error_m > limits.motion_error_m || error_deg > limits.motion_error_deg;
}

/// The pose of the moment; null where none is near enough.
const StampedPose* PoseAt(std::span<const StampedPose> trajectory, std::optional<int64_t> moment_ns) {
  if (!moment_ns) return nullptr;
  const int64_t stamp_ns = *moment_ns;
  const auto later = std::lower_bound(
      trajectory.begin(), trajectory.end(), stamp_ns - kSameMomentNs,
      [](const StampedPose& pose, int64_t earliest_ns) { return pose.stamp_ns < earliest_ns; });
  const StampedPose* nearest = nullptr;
  for (auto pose = later; pose != trajectory.end() && pose->stamp_ns <= stamp_ns + kSameMomentNs; ++pose) {
    if (nearest == nullptr || std::abs(pose->stamp_ns - stamp_ns) < std::abs(nearest->stamp_ns - stamp_ns))
      nearest = &*pose;
  }
  return nearest;
}

double SecondsBetweenFrames(std::span<const int64_t> stamps_ns) {
  if (stamps_ns.size() < 2) return 0;
  return 1e-9 * static_cast<double>(stamps_ns.back() - stamps_ns.front()) /
         static_cast<double>(stamps_ns.size() - 1);
}

double WrongPosesSeconds(const JudgedRun& run, const VerdictLimits& limits) {
  RpeOptions options;
  options.unit = RpeUnit::kSeconds;
  options.delta = limits.motion_s;
  const RpeReport report = EvaluateRpe(run.ground_truth, run.online, options);
  if (!report.usable()) return 0;
  size_t wrong = 0;
  for (size_t i = 0; i < report.motions.size(); ++i) {
    if (IsTooFarOff(report.translation_errors[i], report.rotation_errors_deg[i], limits)) ++wrong;
  }
  return static_cast<double>(wrong) * SecondsBetweenFrames(run.frame_stamps_ns);
}

/// From the keyframe's camera into the matched one's, as the map has it [map units].
std::optional<Rigid3d> MotionInMap(const JudgedRun& run, const ClosedLoop& loop) {
  if (loop.T_matched_keyframe) return loop.T_matched_keyframe;
  const StampedPose* keyframe = PoseAt(run.keyframes, loop.stamp_ns);
  const StampedPose* matched = PoseAt(run.keyframes, loop.matched_stamp_ns);
  if (keyframe == nullptr || matched == nullptr) return std::nullopt;
  return matched->T_world_cam.Inverse() * keyframe->T_world_cam;
}

/// Whether the loop's relative pose contradicts the ground truth; nothing where it is not known.
std::optional<bool> IsFalse(const JudgedRun& run, const ClosedLoop& loop, double scale,
                            const VerdictLimits& limits) {
  const std::optional<Rigid3d> motion = MotionInMap(run, loop);
  const StampedPose* keyframe = PoseAt(run.ground_truth, loop.stamp_ns);
  const StampedPose* matched = PoseAt(run.ground_truth, loop.matched_stamp_ns);
  if (!motion || keyframe == nullptr || matched == nullptr) return std::nullopt;
  const Rigid3d truth = matched->T_world_cam.Inverse() * keyframe->T_world_cam;
  const double error_m = (scale * motion->translation - truth.translation).norm();
  return IsTooFarOff(error_m, AngleBetween(motion->rotation, truth.rotation) * kDegreesPerRadian, limits);
}

void JudgeLoops(const JudgedRun& run, const AteReport& ate, const VerdictLimits& limits,
                RunVerdict* verdict) {
  verdict->loops = run.loops.size();
  for (const ClosedLoop& loop : run.loops) {
    const std::optional<bool> is_false =
        ate.usable() ? IsFalse(run, loop, ate.scale(), limits) : std::nullopt;
    if (!is_false) ++verdict->unknown_loops;
    if (is_false.value_or(false)) ++verdict->false_loops;
  }
}

/// Of the frames that show enough of the room, the share that has a pose; 1 where no frame does.
double TrackedShareOfVisible(const JudgedRun& run, const VerdictLimits& limits) {
  std::vector<int64_t> visible_ns;
  for (size_t i = 0; i < run.frame_stamps_ns.size(); ++i) {
    const double covered = run.covered_shares.empty() ? 0.0 : run.covered_shares[i];
    if (1.0 - covered >= limits.shows_room_share) visible_ns.push_back(run.frame_stamps_ns[i]);
  }
  if (visible_ns.empty()) return 1;
  return 0.01 * ComputeCoverage(run.online, visible_ns).percent.value_or(0);
}

std::vector<Shortfall> Shortfalls(const RunVerdict& verdict, const VerdictLimits& limits) {
  std::vector<Shortfall> shortfalls;
  const auto require = [&](bool reached, Shortfall shortfall) {
    if (!reached) shortfalls.push_back(shortfall);
  };
  require(verdict.final_ate_m && *verdict.final_ate_m <= limits.final_ate_m, Shortfall::kFinalAte);
  require(verdict.online_ate_m && *verdict.online_ate_m <= limits.online_ate_m, Shortfall::kOnlineAte);
  require(verdict.tracked_share >= limits.tracked_share, Shortfall::kTracked);
  require(verdict.tracked_online_share >= limits.tracked_online_share, Shortfall::kTrackedOnline);
  return shortfalls;
}

}  // namespace

VerdictLimits LimitsForPath(double path_m) {
  VerdictLimits limits;
  limits.final_ate_m = 0.005 * path_m;
  limits.online_ate_m = 0.0075 * path_m;
  return limits;
}

double PathLength(std::span<const StampedPose> trajectory) {
  double length = 0;
  for (size_t i = 1; i < trajectory.size(); ++i)
    length += (trajectory[i].T_world_cam.translation - trajectory[i - 1].T_world_cam.translation).norm();
  return length;
}

std::string ShortfallName(Shortfall shortfall) {
  switch (shortfall) {
    case Shortfall::kFinalAte:
      return "ATE final";
    case Shortfall::kOnlineAte:
      return "ATE online";
    case Shortfall::kTracked:
      return "tracked";
    case Shortfall::kTrackedOnline:
      return "tracked online";
  }
  return "tracked online";
}

bool IsWrongFirstMap(std::span<const StampedPose> ground_truth, std::span<const StampedPose> online,
                     const VerdictLimits& limits) {
  if (online.empty()) return false;
  const StampedPose* true_first = PoseAt(ground_truth, online.front().stamp_ns);
  if (true_first == nullptr) return false;
  std::vector<Rigid3d> truths, estimates;
  for (const StampedPose& pose : online) {
    if (1e-9 * static_cast<double>(pose.stamp_ns - online.front().stamp_ns) > limits.first_map_s) break;
    const StampedPose* truth = PoseAt(ground_truth, pose.stamp_ns);
    if (truth == nullptr) continue;
    truths.push_back(true_first->T_world_cam.Inverse() * truth->T_world_cam);
    estimates.push_back(online.front().T_world_cam.Inverse() * pose.T_world_cam);
  }
  // Motions from one camera need no common world: the scale is all that is unknown.
  double across = 0, own = 0;
  for (size_t i = 0; i < truths.size(); ++i) {
    across += truths[i].translation.dot(estimates[i].translation);
    own += estimates[i].translation.squaredNorm();
  }
  const double scale = own > 0 ? std::max(0.0, across / own) : 0.0;
  size_t wrong = 0;
  for (size_t i = 0; i < truths.size(); ++i) {
    const double error_m = (scale * estimates[i].translation - truths[i].translation).norm();
    const double error_deg = AngleBetween(estimates[i].rotation, truths[i].rotation) * kDegreesPerRadian;
    if (IsTooFarOff(error_m, error_deg, limits)) ++wrong;
  }
  return 2 * wrong > truths.size();
}

RunVerdict JudgeRun(const JudgedRun& run, const VerdictLimits& limits) {
  if (!run.covered_shares.empty() && run.covered_shares.size() != run.frame_stamps_ns.size()) {
    throw InputError("the sequence has " + std::to_string(run.frame_stamps_ns.size()) +
                     " frames, but coverage is given for " + std::to_string(run.covered_shares.size()));
  }
  RunVerdict verdict;
  const AteReport final = EvaluateAte(run.ground_truth, run.final);
  const AteReport online = EvaluateAte(run.ground_truth, run.online);
  if (final.usable()) verdict.final_ate_m = final.rmse();
  if (online.usable()) verdict.online_ate_m = online.rmse();
  verdict.tracked_share = 0.01 * ComputeCoverage(run.final, run.frame_stamps_ns).percent.value_or(0);
  verdict.tracked_online_share = TrackedShareOfVisible(run, limits);
  verdict.first_map_s = ComputeCoverage(run.online, run.frame_stamps_ns).time_to_first_pose_s;
  verdict.wrong_poses_s = WrongPosesSeconds(run, limits);
  verdict.wrong_first_map = IsWrongFirstMap(run.ground_truth, run.online, limits);
  JudgeLoops(run, final, limits, &verdict);
  if (!run.covered_shares.empty()) {
    verdict.mean_covered_share = std::accumulate(run.covered_shares.begin(), run.covered_shares.end(), 0.0) /
                                 static_cast<double>(run.covered_shares.size());
  }
  verdict.shortfalls = Shortfalls(verdict, limits);
  return verdict;
}

}  // namespace dmslam
