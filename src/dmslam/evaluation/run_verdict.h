#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/dataset/trajectory.h"

namespace dmslam {

/// What a run must reach to be a success, and from where on a published pose, a loop or a first map is wrong.
struct VerdictLimits {
  double final_ate_m = 0.02;          ///< RMSE of the trajectory as it is in the end
  double online_ate_m = 0.03;         ///< ... as it was published while the run went on
  double tracked_share = 0.9;         ///< of all frames, in the end
  double tracked_online_share = 0.8;  ///< of the frames that show enough of the room, as they came
  double shows_room_share = 0.3;  ///< of the image: so much room must be visible for a frame to count there
  double motion_s = 1.0;          ///< length of the motions that are compared
  double motion_error_m = 0.05;
  double motion_error_deg = 3.0;
  double first_map_s = 2.0;  ///< a first map is judged by the poses published so long after the first
};

/// The limits for a camera's path of another length than the kitchen's: 0.5 and 0.75 % of it.
VerdictLimits LimitsForPath(double path_m);

/// Length of a trajectory's path [its unit].
double PathLength(std::span<const StampedPose> trajectory);

/// Two keyframes between which a loop was closed; a stamp is absent where it is not known.
struct ClosedLoop {
  std::optional<int64_t> stamp_ns;
  std::optional<int64_t> matched_stamp_ns;
  /// Takes points of the keyframe's camera into the matched one's [map units], as the loop closer measured
  /// it; absent: the keyframes' poses in the finished map are taken.
  std::optional<Rigid3d> T_matched_keyframe;
};

/// All that a run is judged by. Trajectories are empty where there are none.
struct JudgedRun {
  std::span<const StampedPose> ground_truth;
  std::span<const StampedPose> final;
  std::span<const StampedPose> online;
  std::span<const StampedPose> keyframes;    ///< of the finished map
  std::span<const int64_t> frame_stamps_ns;  ///< all frames of the sequence
  std::span<const double> covered_shares;    ///< of the image by people, per frame; empty: nobody is there
  std::span<const ClosedLoop> loops;
};

/// What a success lacks.
enum class Shortfall { kFinalAte, kOnlineAte, kTracked, kTrackedOnline };
std::string ShortfallName(Shortfall shortfall);

struct RunVerdict {
  std::optional<double> final_ate_m;   ///< RMSE; absent where there is no usable trajectory
  std::optional<double> online_ate_m;  ///< RMSE, aligned on its own
  double tracked_share = 0;            ///< of all frames, in the end
  double tracked_online_share = 0;     ///< of the frames that show enough of the room
  std::optional<double> first_map_s;   ///< from the first frame to the first published pose
  /// Published while the motion over the last second is off by too much, after the one alignment of the
  /// online trajectory: number of such poses times the time between frames [s].
  double wrong_poses_s = 0;
  bool wrong_first_map = false;  ///< see IsWrongFirstMap
  size_t loops = 0;
  size_t false_loops = 0;
  size_t unknown_loops = 0;  ///< of loops that neither measurement nor keyframe is known of
  double mean_covered_share = 0;
  std::vector<Shortfall> shortfalls;

  bool success() const { return shortfalls.empty(); }
};

/// Judges one run. Throws InputError where `covered_shares` has another number of entries than there are
/// frames.
RunVerdict JudgeRun(const JudgedRun& run, const VerdictLimits& limits);

/// Whether the poses published in the first `limits.first_map_s` contradict the ground truth: the motion from
/// the first of them to more than half of the others, brought to the ground truth's scale over these poses
/// alone, is off by more than a motion may be. An excursion of a few frames makes no wrong map.
bool IsWrongFirstMap(std::span<const StampedPose> ground_truth, std::span<const StampedPose> online,
                     const VerdictLimits& limits);

}  // namespace dmslam
