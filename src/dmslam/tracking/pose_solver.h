#pragma once

#include <optional>
#include <span>
#include <vector>

#include "dmslam/dynamics/elders.h"
#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/dynamics/motion_judge.h"
#include "dmslam/map/map.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/place_recognition/landmark_matches.h"

namespace dmslam {

/// What became of a frame's matches when its pose was optimised.
struct PoseFit {
  int inliers = 0;  ///< 0: there were too few matches, the pose is as it was
  double mean_chi2 = 0;
  std::span<const RejectedMatch> rejected;  ///< valid until the next call
};

/// Optimises a frame's pose over its matches: the elders first, then everyone who agrees with them, each with
/// the weight that its age deserves. Does not ask the heap for memory once its buffers have grown.
class PoseSolver {
 public:
  explicit PoseSolver(double max_chi2) : max_chi2_(max_chi2) {}

  /// Sets the frame's pose and the classes of its matched features; takes the matches that do not agree.
  PoseFit Solve(const Map& map, const std::optional<PosePrior>& prior, MotionJudge* judge,
                TrackedFrame* frame);

 private:
  void Observe(const Map& map, const LandmarkVotes& votes, const TrackedFrame& frame);
  void LetEldersDecide(const Pinhole& camera, const Rigid3d& T_cam_world,
                       const PoseOptimizationOptions& options, Elders* elders);
  void KeepWhatAgrees(const Pinhole& camera, const Rigid3d& T_cam_world, double elder_age_s, int agreeing,
                      const Elders& elders);
  void SetClasses(TrackedFrame* frame);

  double max_chi2_;
  std::vector<RejectedMatch> rejected_;
  // Workspace, the first three parallel:
  std::vector<LandmarkMatch> matches_;
  std::vector<double> ages_s_;
  std::vector<PoseObservation> observations_;
  std::vector<PoseObservation> eldest_;
  PoseOptimizationReport optimized_;
};

}  // namespace dmslam
