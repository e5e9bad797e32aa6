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
  bool by_trusted_elders = false;           ///< landmarks that are older than people stand have decided
  bool by_rival = false;                    ///< a wider motion than that which most landmarks follow has
};

/// What the pose found last rests on; valid until the next call.
struct PoseBasis {
  std::span<const LandmarkMatch> matches;
  std::span<const PoseObservation> observations;  ///< parallel to the matches
  std::span<const char> inliers;                  ///< likewise
  Matrix6d information = Matrix6d::Zero();        ///< as in PoseOptimizationReport
  double mean_chi2 = 0;
};

/// Whether the oldest landmarks decide a pose first.
enum class Elderhood : uint8_t { kCounts, kIgnored };

/// Optimises a frame's pose over its matches: the elders first, then everyone who agrees with them, each with
/// the weight that its age deserves. Elders who agree badly are asked again, from where all together lead.
/// While no landmark is old enough to be trusted, what contradicts that pose is asked for a motion of its
/// own, and the one that holds more of the image is the camera's. The same holds where all landmarks are that
/// old: then age tells nobody apart, and width decides. Does not ask the heap for memory once its buffers
/// have grown.
class PoseSolver {
 public:
  explicit PoseSolver(double max_chi2) : max_chi2_(max_chi2) {}

  /// Sets the frame's pose and the classes of its matched features; takes the matches that do not agree.
  PoseFit Solve(const Map& map, const std::optional<PosePrior>& prior, MotionJudge* judge,
                TrackedFrame* frame, Elderhood elderhood = Elderhood::kCounts);
  /// The same question when the judge has found what the frame sees elsewhere. If that has the wider motion,
  /// the frame is given its pose and matches.
  bool FollowWiderMotion(const Map& map, const std::optional<PosePrior>& prior, const MotionJudge& judge,
                         TrackedFrame* frame);
  PoseBasis basis() const {
    return {current_.matches, current_.observations, optimized_.inliers, optimized_.information,
            optimized_.mean_chi2};
  }

 private:
  /// Some of a frame's matches, in parallel.
  struct Matches {
    std::vector<LandmarkMatch> matches;
    std::vector<double> ages_s;
    std::vector<PoseObservation> observations;

    void Add(const Map& map, const TrackedFrame& frame, uint16_t feature, const Landmark& landmark,
             double age_s, double weight);
    void Move(size_t from, size_t to);
    void Resize(size_t count);
    size_t size() const { return matches.size(); }
  };

  PoseOptimizationOptions Options(const std::optional<PosePrior>& prior) const;
  void Observe(const Map& map, const LandmarkVotes& votes, const TrackedFrame& frame);
  bool LetEldersDecide(const Pinhole& camera, const Rigid3d& T_cam_world,
                       const PoseOptimizationOptions& options, Elders* elders);
  std::optional<Rigid3d> PoseOfEldest(const Pinhole& camera, const Rigid3d& T_cam_world,
                                      const PoseOptimizationOptions& options);
  void KeepWhatAgrees(const Pinhole& camera, const Rigid3d& T_cam_world, double elder_age_s, int agreeing,
                      const Elders& elders);
  std::optional<Rigid3d> FindWiderMotion(const Camera& camera, const Rigid3d& T_cam_world,
                                         const PoseOptimizationOptions& options, const RivalMotions& rivals);
  void GoOnFrom(const Pinhole& camera, const Rigid3d& T_cam_world, const PoseOptimizationOptions& options);
  void SetClasses(TrackedFrame* frame);

  double max_chi2_;
  std::vector<RejectedMatch> rejected_;
  // Workspace
  Matches all_;      ///< whatever the frame shows of landmarks
  Matches current_;  ///< those that have a say
  std::vector<PoseObservation> eldest_, agreeing_, contradicting_;
  PoseOptimizationReport optimized_, rival_;
};

}  // namespace dmslam
