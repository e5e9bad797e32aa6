#pragma once

#include <optional>
#include <span>

#include "dmslam/dynamics/motion_judge.h"
#include "dmslam/map/map.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/tracking/local_map.h"
#include "dmslam/tracking/pose_solver.h"
#include "dmslam/tracking/projection_search.h"
#include "dmslam/tracking/tracking_options.h"
#include "dmslam/tracking/tracking_report.h"
#include "dmslam/tracking/turn_search.h"

namespace dmslam {

/// Finds a frame's pose in a map: first by another frame, by the motion model alone or by a keyframe, and
/// then against the local map. Keeps what the next frame needs: the local map and the judgement of what
/// moves. The map is given with each call and only read. `prior`: where the motion model expects the camera.
class PoseSearch {
 public:
  using Prior = std::optional<PosePrior>;

  PoseSearch(const TrackingOptions& options, const Camera& camera);

  enum class FromFrameResult : uint8_t {
    kFound,
    kFoundRival,    ///< by a wider motion than that of the frames before
    kNotSeen,       ///< too little of what the last frame saw is near its place
    kContradicted,  ///< enough is, half of it at least, but not in its place
  };
  /// Matches the landmarks that `last` saw near their projections at `T_predicted`, and optimises the pose.
  FromFrameResult FromFrame(const Map& map, const TrackedFrame& last, const Rigid3d& T_predicted,
                            const Prior& prior, TrackedFrame* frame);
  /// How far a camera has turned.
  struct TurnRange {
    double least_rad = 0;
    double most_rad = 0;
  };
  /// Finds how far the camera has turned since it saw `last` from `T_cam_world`, matches what lies around,
  /// and optimises the pose. False where it has not turned by so much, or where nothing is found.
  bool FromTurn(const Map& map, const TrackedFrame& last, const Rigid3d& T_cam_world, const TurnRange& range,
                TrackedFrame* frame);
  /// Matches the landmarks around the frame searched for last, many more than it saw itself, near their
  /// projections at `T_predicted`, and optimises the pose. Returns the number of inliers.
  int FromPrediction(const Map& map, const Rigid3d& T_predicted, const Prior& prior, TrackedFrame* frame);
  /// Matches a keyframe's landmarks by descriptor alone, and finds the pose from nothing.
  bool FromKeyframe(const Map& map, KeyframeId keyframe, uint64_t seed, const Prior& prior,
                    TrackedFrame* frame);
  /// Refines the pose against the landmarks around: what its matches' keyframes and their neighbours see.
  /// `careful`: the camera was lost just before, so more is asked. Where it is tracked, what the frame
  /// says of landmarks is added to the judge's evidence.
  TrackingReport InLocalMap(const Map& map, bool careful, const Prior& prior, TrackedFrame* frame);
  /// The same of a camera that was not lost, where only the pose is asked for: nothing is learnt of
  /// landmarks.
  bool FitsLocalMap(const Map& map, TrackedFrame* frame);

  /// The keyframe that shares most landmarks with the frame searched for last; null: none was searched for,
  /// or it has left the map.
  const Keyframe* Reference(const Map& map) const {
    const std::optional<KeyframeId> id = local_map_.reference();
    return id ? map.FindKeyframe(*id) : nullptr;
  }
  /// What was found last, with the covariance that its matches and the prior leave.
  FoundPose found(const TrackedFrame& frame) const;
  /// What the pose of the frame searched for last rests on.
  PoseBasis basis() const { return solver_.basis(); }
  MotionJudge& judge() { return judge_; }
  /// Forgets what belongs to a map that is gone.
  void Reset();

 private:
  /// The pose and what is to be said of it, with what should be seen from there.
  struct Fitted {
    TrackingReport report;
    std::span<const ExpectedLandmark> expected;
  };
  Fitted FitInLocalMap(const Map& map, bool careful, const Prior& prior, TrackedFrame* frame);
  std::span<const ExpectedLandmark> MatchAround(const Map& map, double wider, TrackedFrame* frame);
  void CountExpected(const Map& map, std::span<const ExpectedLandmark> expected, const TrackedFrame& frame,
                     TrackingReport* report) const;
  void Decide(const PoseFit& fit, bool careful, TrackingReport* report) const;
  static void Doubt(const PoseFit& fit, TrackingReport* report);

  TrackingOptions options_;
  Camera camera_;
  LocalMap local_map_;
  ProjectionSearch search_;
  TurnSearch turns_;
  PoseSolver solver_;
  MotionJudge judge_;
};

}  // namespace dmslam
