#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "dmslam/dynamics/landmark_votes.h"
#include "dmslam/features/matcher.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// How far a camera that was lost a moment ago has turned since. Where it stands is nearly known, and which
/// way it looks is not; in pictures blurred by the turn no descriptor is unmistakable. So each landmark names
/// all features around that look somewhat alike, and votes for the turns that would bring it there: a wrong
/// pair votes for any, the right ones all for the same. Does not ask the heap for memory once its buffers
/// have grown.
class TurnSearch {
 public:
  /// The pose of a camera that was at `T_cam_world` and has turned by up to `reach_rad` about the axes of the
  /// image and a little about the optical one; none where fewer than a handful of pairs agree.
  std::optional<Rigid3d> Find(const Map& map, const LandmarkVotes& votes,
                              std::span<const LandmarkId> landmarks, const Rigid3d& T_cam_world,
                              double reach_rad, const FrameFeatures& features);

 private:
  struct Pair {
    size_t landmark;          ///< place in landmarks_
    Eigen::Vector2d feature;  ///< azimuth and elevation [rad]
  };
  struct Turn {
    double roll_rad = 0;
    Eigen::Vector2d shift_rad = Eigen::Vector2d::Zero();  ///< of azimuth and elevation
    int votes = 0;
  };

  void ListPairs(const Map& map, const LandmarkVotes& votes, std::span<const LandmarkId> landmarks,
                 const Rigid3d& T_cam_world, double reach_rad, const FrameFeatures& features);
  std::span<const uint32_t> MostAlike(const Descriptor& descriptor, const SearchArea& area,
                                      const FrameFeatures& features);
  Turn BestShift(double roll_rad, double reach_rad);

  std::vector<Eigen::Vector3d> landmarks_;  ///< directions in the camera before it turned
  std::vector<Pair> pairs_;
  // Workspace:
  std::vector<uint32_t> in_area_;                ///< features
  std::vector<uint16_t> distances_;              ///< of those [bits]
  std::vector<std::pair<int, uint32_t>> alike_;  ///< distance [bits] and feature
  std::vector<Eigen::Vector2d> expected_;  ///< azimuth and elevation of the landmarks after a roll [rad]
  std::vector<Eigen::Vector2d> shifts_rad_;
  std::vector<Eigen::Vector2i> bins_;  ///< of those
  std::vector<int> counts_;
};

}  // namespace dmslam
