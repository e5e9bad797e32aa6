#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/geometry/similarity.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/replica.h"
#include "dmslam/optimization/trajectory_smoothing.h"

namespace dmslam {

/// Collects a run's trajectory from the frontend's and the mapper's streams: a reader like any other.
class TrajectoryBuilder {
 public:
  TrajectoryBuilder(const Camera& camera, const Pyramid& pyramid) : map_(camera, pyramid) {}

  /// See Map; to be said first.
  void KeepFeaturesIn(std::shared_ptr<FeatureStore> store) { map_.KeepFeaturesIn(std::move(store)); }

  void OnFramePose(const FramePose& pose);
  /// Poses told in a map that was wrong from the beginning count for nothing: a later map may have its
  /// keyframes again, of the same frames and so of the same names.
  void OnMapReset(const MapReset& reset);
  /// Where a map becomes part of another, the poses that were told in it go along.
  void OnMapDelta(const MapDelta& delta);

  /// The map as it is known from elsewhere.
  void SetMap(Replica map) {
    map.KeepFeaturesIn(map_.feature_store());
    map_ = std::move(map);
  }
  /// The map is void: a fresh stream, or a snapshot, begins.
  void ForgetMap() { map_.Clear(); }

  /// A frame whose reference keyframe is in no map (all who held it died at once) is told again, relative to
  /// the keyframe to which that one's own frame was told, where there is such a one. To be called when all is
  /// in.
  void BridgeLostKeyframes();

  /// Which frame of which camera.
  struct FrameName {
    CameraId camera = 0;
    uint32_t index = 0;
    auto operator<=>(const FrameName&) const = default;
  };
  /// Frames whose features went with their frontend: nobody looks for them again in the finished map, as is
  /// done for all others. Where they were not placed better in another way, their poses are joined with how a
  /// carried camera moves (SmoothTrajectory()), as well as each was known when it was told: the newest
  /// kFramesRemembered of each camera and map, as a frontend would. To be called when all is in.
  void JoinPosesOf(const std::set<FrameName>& frames);

  struct Trajectories {
    std::optional<MapId> map_id;      ///< the map that holds most frames; none: no frame is placed
    std::vector<StampedPose> final;   ///< every placed frame, by its reference keyframe's final pose
    std::vector<StampedPose> online;  ///< as tracked, frames of a map that survived
    std::vector<StampedPose> keyframes;
    std::vector<std::pair<MapId, size_t>> other_maps;  ///< and how many frames they hold
  };
  /// World-from-camera, in map units, of the map that holds most frames of all cameras together; of all
  /// cameras one after another, or of one.
  Trajectories Build(std::optional<CameraId> camera = std::nullopt) const;

  const Map& map() const { return map_; }
  const std::map<FrameName, FramePose>& frame_poses() const { return poses_; }

 private:
  /// A map that became part of another one, and how points of it lie there.
  struct Joined {
    MapId into = 0;
    Sim3d S_into_from;
  };

  void Join(std::span<const FramePose* const> path, std::optional<MotionNoise>* noise);
  bool Bridge(FramePose* pose) const;
  std::optional<MapId> MapOfFrame(const FramePose& pose) const;
  void ChooseMap(std::optional<CameraId> camera, Trajectories* result) const;
  std::map<MapId, Joined> JoinedBy(const MapDelta& delta) const;
  static void Carry(const Joined& joined, FramePose* pose);

  Replica map_;
  std::map<MapId, Joined> joined_;          ///< by the number that is gone; into maps that there are
  std::map<FrameName, FramePose> poses_;    ///< a later placement does not replace an online one...
  std::map<FrameName, FramePose> refined_;  ///< ...but is the better one for the final trajectory
};

}  // namespace dmslam
