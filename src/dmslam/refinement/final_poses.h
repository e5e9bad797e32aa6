#pragma once

#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/optimization/trajectory_smoothing.h"
#include "dmslam/tracking/motion_model.h"

namespace dmslam {

/// A landmark that a frame saw.
struct Sight {
  LandmarkId landmark;
  Eigen::Vector2f uv_px;  ///< undistorted
  uint16_t feature = 0;   ///< of the frame
  uint8_t octave = 0;     ///< of the feature
};

/// A frame's pose as it is told at the end.
struct FinalPose {
  FramePose pose;
  Rigid3d T_reference_world;  ///< of the keyframe that the pose is relative to, as it was then
  Rigid3d measured;           ///< T_cam_world by what the frame saw, and how well that determines it:
  Matrix6d information = Matrix6d::Zero();  ///< tangent (w, v) on its left
  std::vector<Sight> sights;                ///< that agree with the pose

  /// The pose in the map and relative to its keyframe.
  void SetPose(const Rigid3d& T_cam_world);
  void SetPose(const Keyframe& reference, const Rigid3d& T_cam_world);
};

/// The landmarks that a tracked frame uses.
std::vector<Sight> SightsOf(const TrackedFrame& frame);

/// Whether so many of the landmarks observed agree that the pose can be believed.
bool Agrees(const PoseOptimizationReport& report);

/// The pose of least reprojection errors, from `T_cam_world`, by what was seen alone; fills in what was
/// measured and the sights. The landmarks must be in the map.
PoseOptimizationReport MeasurePose(const Map& map, const Rigid3d& T_cam_world,
                                   const std::vector<Sight>& sights, FinalPose* pose);

/// The same, of a pose that rests on no single sight: where one says more than half of what all others say of
/// some direction, it is left out, as no other could contradict it (leverage; Baarda's redundancy numbers).
PoseOptimizationReport MeasureCheckedPose(const Map& map, const Rigid3d& T_cam_world,
                                          const std::vector<Sight>& sights, FinalPose* pose);

/// The poses that are told at the end, and with them once more the landmarks that they see.
///
/// Two things are left when every frame has been matched with the finished map. In a frame of which walkers
/// hide most, a few landmarks in a corner leave the pose open along some direction: poses are joined with the
/// motion of a carried camera (SmoothTrajectory()), but for where it was put elsewhere (FindLeaps()). And the
/// map knows a landmark from a few keyframes only, which is the more of an error the fewer landmarks a frame
/// sees: each is placed again by all the frames that saw it, and the frames by the landmarks. The map itself
/// stays as it is. Poses stay relative to their keyframes: where a keyframe moves meanwhile (a loop closed
/// late), they go with it, and no more is improved.
class FinalPoses {
 public:
  /// `threads`: that work at a time; the poses do not depend on it. `motion`: how far a camera gets.
  explicit FinalPoses(int threads = 1, const MotionModelOptions& motion = {})
      : threads_(threads), motion_(motion) {}

  /// The frame's landmarks must be in the map now; they may leave it later.
  void Add(const Map& map, FinalPose pose);
  /// One portion of a round: landmarks and frames are placed (not in the first), then the poses of each map
  /// smoothed. After a round they are in order of map and time. The map must not change within one.
  void Improve(const Map& map);
  bool IsMidRound() const { return step_ != Step::kBetweenRounds; }
  /// Whether rounds change hardly anything, as many are made as may be, or none can be made any more.
  bool IsSettled() const;
  /// Forgets those that `drop` marks, by their present order.
  void Drop(std::span<const uint8_t> drop);
  std::span<const FinalPose> poses() const { return poses_; }
  /// Gives the poses and forgets them.
  std::vector<FramePose> Take();

 private:
  /// A landmark (of `placed_`) seen by one of the frames.
  struct View {
    uint32_t landmark = 0, frame = 0, sight = 0;
  };
  /// What is known of a frame's sight.
  struct Seen {
    uint32_t landmark = 0;     ///< of `placed_`
    bool seen_before = false;  ///< by a frame shortly before
  };
  /// Where the map has it, how sure its keyframes are of that, and where it is now.
  struct Placed {
    Eigen::Vector3d p_map, p_world;
    Eigen::Matrix3d information;
  };

  /// A pose, world to camera, for those who apply it often.
  struct RotatedPose {
    Eigen::Matrix3d R;
    Eigen::Vector3d t;
  };

  enum class Step { kBetweenRounds, kLandmarks, kFrames, kSmoothing };

  /// Of the poses in a round, in standard deviations of what was measured, over the degrees of freedom.
  struct Moves {
    double sum_squared = 0.0;
    int count = 0;
  };

  void BeginRound(const Map& map);
  void GoTo(Step step);
  bool HasMoved(const Map& map) const;
  Matrix6d SharedInformation(const Map& map, size_t frame) const;
  std::vector<uint8_t> Leaps(const Map& map, size_t begin, size_t end) const;
  std::vector<PoseEstimate> Estimates(const Map& map, size_t begin, size_t end) const;
  void Move(const Rigid3d& T_cam_world, FinalPose* pose);
  bool IsStill() const;
  void SmoothNextMap(const Map& map);
  bool IsInFront(std::span<const View> views, const Eigen::Vector3d& p_world) const;
  Eigen::Vector3d FromViews(const Map& map, std::span<const View> views, const Placed& landmark) const;
  void ListSights(const Map& map);
  void SortViews();
  void NoteWhoSawBefore();
  void PlaceLandmark(const Map& map, std::span<const View> views);
  void PlaceSomeLandmarks(const Map& map);
  void PlaceFrame(const Map& map, size_t index);
  void PlaceSomeFrames(const Map& map);

  int threads_;
  MotionModelOptions motion_;
  std::vector<FinalPose> poses_;
  std::vector<View> views_;              ///< all, by landmark; empty: to be listed
  std::vector<std::vector<Seen>> seen_;  ///< of each frame's sights; as old as the views
  std::vector<Matrix6d> shared_;         ///< of each frame; it hardly changes with the rounds
  std::vector<RotatedPose> cameras_;     ///< where the frames are while landmarks are placed
  int rounds_ = 0;
  Moves moves_;  ///< in the last round
  bool map_has_moved_ = false;
  Step step_ = Step::kBetweenRounds;
  size_t next_ = 0;                     ///< in this step: the first view, frame or pose to be worked on
  std::map<MapId, MotionNoise> noise_;  ///< as found when the poses of a map were smoothed first
  std::vector<Placed> placed_;          ///< the landmarks that the frames see
  std::unordered_map<LandmarkId, uint32_t> index_;  ///< of `placed_`
};

}  // namespace dmslam
