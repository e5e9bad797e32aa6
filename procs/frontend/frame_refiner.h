#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/types.h"
#include "dmslam/map/map.h"
#include "dmslam/map/proposals.h"
#include "frontend/tracked_frame.h"

namespace dmslam {

/// What tracked frames saw of the map, kept so that their poses can be optimised once more when the map has
/// become better than it was at their time. Only used features are kept, some kilobytes a frame.
class FrameRefiner {
 public:
  FrameRefiner(const Camera& camera, const Pyramid& pyramid, size_t max_frames)
      : camera_(camera), pyramid_(pyramid), max_frames_(max_frames) {}

  /// Keeps a tracked frame and the pose that was told of it; the oldest is dropped when there are too many.
  void Keep(const TrackedFrame& frame, const FramePose& pose);

  /// The poses of the frames of map `map_id` (none given: of all), relative to their reference keyframes as
  /// these are now (state: localised later). A frame whose observations do not agree with the map any more is
  /// left out. Forgets the frames.
  std::vector<FramePose> Refine(const Map& map, std::optional<MapId> map_id = std::nullopt);

 private:
  struct Sight {
    LandmarkId landmark;
    Eigen::Vector2f uv_px;  ///< undistorted
    uint8_t octave = 0;
  };
  struct Kept {
    FramePose pose;
    std::vector<Sight> sights;
  };
  std::optional<FramePose> RefineOne(const Map& map, const Kept& kept) const;

  Camera camera_;
  Pyramid pyramid_;
  size_t max_frames_;
  std::deque<Kept> frames_;
};

}  // namespace dmslam
