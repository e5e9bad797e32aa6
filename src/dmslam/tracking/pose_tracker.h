#pragma once

#include <array>
#include <memory_resource>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/map/projection.h"
#include "dmslam/map/proposals.h"
#include "dmslam/optimization/pose_optimization.h"
#include "dmslam/tracking/tracked_frame.h"
#include "dmslam/tracking/tracking_options.h"

namespace dmslam {

/// What tracking one frame against the map came to.
struct TrackingReport {
  bool ok = false;
  const char* reason = "";  ///< why not
  int num_static = 0;       ///< inliers
  int num_moving = 0;
  int num_unknown = 0;      ///< matched, neither inlier nor moving
  int cells = 0;            ///< of an 8 x 6 grid that hold inliers
  double moving_share = 0;  ///< of the cells that hold matches, those with more moving than static ones
  double mean_chi2 = 0;
};

/// Finds a frame's pose in a map: by the motion model, by likeness to a keyframe, and then against the local
/// map. Owns the buffers that this needs, the cached local map, and the frontend's own short memory of what
/// moves. The map is given with each call and only read.
class PoseTracker {
 public:
  PoseTracker(const TrackingOptions& options, const Camera& camera, const Pyramid& pyramid);

  /// Where the motion model expects the camera, for the frame that follows; none after a loss. `depth`: of
  /// the scene, in map units; `frames`: since the last one that was tracked.
  void SetMotionPrior(const std::optional<Rigid3d>& T_cam_world, double depth, double frames = 1.0);
  /// Matches the landmarks that `last` saw near their projections at `T_predicted`, and optimises the pose.
  bool TrackFromFrame(const Map& map, const TrackedFrame& last, const Rigid3d& T_predicted,
                      TrackedFrame* frame);
  /// Matches the landmarks around the frame tracked last, many more than it saw itself, near their
  /// projections at `T_predicted`, and optimises the pose. Returns the number of inliers.
  int TrackFromPrediction(const Map& map, const Rigid3d& T_predicted, TrackedFrame* frame);
  /// Matches a keyframe's landmarks by descriptor alone, and finds the pose from nothing.
  bool TrackFromKeyframe(const Map& map, KeyframeId keyframe, uint64_t seed, TrackedFrame* frame);
  /// Refines the pose against the landmarks around: what its matches' keyframes and their neighbours see.
  TrackingReport TrackLocalMap(const Map& map, bool relocalized, TrackedFrame* frame);

  /// The keyframe that shares most landmarks with the frame tracked last.
  KeyframeId reference() const { return reference_; }
  /// What frames said since the last call, and forgets it.
  FrameEvidence TakeEvidence(int64_t stamp_ns, MapId map_id);
  void DropEvidence() { evidence_.clear(); }
  /// Forgets what belongs to a map that is gone.
  void Reset();

 private:
  struct Match {
    LandmarkId landmark;
    uint16_t feature = 0;
  };
  struct Rejected {
    Match match;
    double chi2 = 0;
  };
  struct RecentMotion {
    int streak = 0;  ///< frames in a row that saw it elsewhere
  };

  /// What a frame knows of a place in the image.
  struct Witness {
    Eigen::Vector2d uv_px;
    double depth;
    bool moves;
  };
  /// Witnesses by image cell.
  class Witnesses {
   public:
    explicit Witnesses(const Camera& camera);
    void Clear();
    void Add(const Witness& witness);
    template <typename Visit>
    void ForEachNear(const Eigen::Vector2d& uv_px, double reach_px, const Visit& visit) const;

   private:
    static constexpr int kSeenColumns = 20, kSeenRows = 15;

    int Column(double x) const;
    int Row(double y) const;
    static size_t Index(int column, int row) { return static_cast<size_t>(row * kSeenColumns + column); }

    double cell_width_, cell_height_;
    std::array<std::vector<Witness>, kSeenColumns * kSeenRows> cells_;
  };

  bool HasVote(const Landmark& landmark) const;
  double Trust(const Landmark& landmark, int64_t stamp_ns) const;
  void MatchByProjection(const Map& map, const TrackedFrame& last, const Rigid3d& T_cam_world,
                         double radius_px, const TrackedFrame& frame);
  void KeepConsistentTurns(const TrackedFrame& last, const TrackedFrame& frame);
  void OptimizeElders(const TrackedFrame& frame, const PoseOptimizationOptions& options);
  void KeepWhatAgrees(const Rigid3d& T_cam_world, double elder_age_s, int elders);
  int OptimizeMatches(const Map& map, TrackedFrame* frame);
  void RankByVotes(const Map& map, const TrackedFrame& frame);
  KeyframeId NewNeighbour(const Map& map, KeyframeId of);
  void CollectLocalMap(const Map& map, const TrackedFrame& frame);
  void SearchLocalLandmarks(const Map& map, double wider, TrackedFrame* frame);
  void DropMatchesOfHiddenPlaces(const Map& map, TrackedFrame* frame);
  void FindMoved(const Map& map, TrackedFrame* frame);
  void JudgeMissing(const Map& map, const TrackedFrame& frame);
  void SpreadMotion(TrackedFrame* frame);
  void CountEvidence(const Map& map, const TrackedFrame& frame);
  TrackingReport Summarize(const TrackedFrame& frame, int inliers, bool relocalized) const;

  TrackingOptions options_;
  Camera camera_;
  Pyramid pyramid_;
  KeyframeId reference_;
  std::optional<PosePrior> prior_;

  // A frame is tracked without asking the heap for memory: what it needs is kept from frame to frame.
  std::vector<Match> matches_;
  std::vector<float> match_turns_;
  std::vector<PoseObservation> observations_;
  std::vector<PoseObservation> elders_;
  std::vector<double> ages_s_;      ///< of the matched landmarks
  std::vector<Rejected> rejected_;  ///< by the optimisation done last
  PoseOptimizationReport optimized_;
  std::vector<uint8_t> taken_;
  std::vector<KeyframeId> local_keyframes_;
  std::vector<LandmarkId> local_landmarks_;
  std::vector<std::pair<LandmarkId, LandmarkView>> visible_;  ///< local landmarks that this frame should see
  std::vector<LandmarkId> moved_;                             ///< seen elsewhere by this frame
  std::vector<LandmarkId> hidden_;  ///< missing, with something nearer seen in their place; sorted
  std::vector<LandmarkId> gone_;    ///< missing: what lies behind them is seen, or their neighbours move
  std::vector<double> sorted_ages_s_;
  std::vector<KeyframeId> votes_;  ///< one for each observation of the frame's landmarks
  std::vector<std::pair<int, KeyframeId>> ranked_;
  std::vector<KeyframeId> listed_;  ///< local_keyframes_, sorted
  std::vector<LandmarkId> known_;
  Witnesses witnesses_;
  std::pmr::unsynchronized_pool_resource pool_;
  std::pmr::unordered_map<LandmarkId, RecentMotion> recent_motion_{&pool_};
  std::pmr::unordered_map<LandmarkId, FrameEvidence::Item> evidence_{&pool_};
};

}  // namespace dmslam
