#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "dmslam/refinement/final_poses.h"
#include "dmslam/refinement/frame_refiner.h"
#include "dmslam/refinement/late_placement.h"
#include "dmslam/refinement/unplaced_frames.h"
#include "dmslam/tracking/pose_search.h"

namespace dmslam {

/// The poses that are told when the sequence has ended: every tracked frame is looked for once more in the
/// adjusted map, then all poses are joined with the camera's motion. Works in portions; what is called in
/// what order does not depend on how they are cut. As many threads work as the machine has processors, up to
/// four; the poses do not depend on it.
class LastPoses {
 public:
  /// `smooth`: joins the poses; else each stays as it was found.
  LastPoses(const FrameRefinerOptions& refiner, bool smooth, const TrackingOptions& tracking,
            const Camera& camera);

  /// Keeps a tracked frame and the pose that was told of it. It vouches for frames near it in time.
  void Keep(const TrackedFrame& frame, const FramePose& pose);
  /// The same of a frame before all that are kept, as far as there is room for it.
  void KeepEarlier(const TrackedFrame& frame, const FramePose& pose);
  /// Keeps a frame that was placed when the sequence has ended. `vouches`: as a tracked one does.
  void KeepPlaced(const TrackedFrame& frame, const FramePose& pose, bool vouches);
  /// Where the camera was in the frame just before `index`, if that was tracked in that map as it came.
  std::optional<LatePlacement::Before> TrackedBefore(const Map& map, MapId map_id, uint32_t index) const;
  /// Gives back the frames of a map that was wrong.
  std::vector<WaitingFrame> TakeFramesOf(MapId map_id) { return refiner_.TakeFramesOf(map_id); }

  /// Takes the kept frames of one map (none given: of all) for RefineNext().
  void Begin(const Map& map, std::optional<MapId> map_id = std::nullopt) { refiner_.Begin(map, map_id); }
  bool IsRefining() const { return refiner_.IsBusy(); }
  /// Finds the pose of the oldest frame that is due.
  void RefineNext(const Map& map);
  /// A frame that was placed just now, and what was told of it, in the map and by a keyframe that there is.
  void AddPlaced(const Map& map, const TrackedFrame& frame, const FramePose& pose, bool vouches);

  /// A portion of joining the poses. False: nothing is left to do.
  bool Improve(const Map& map);
  /// Whether a round of that is under way: the map that is handed in must stay as it is.
  bool NeedsMapUnchanged() const { return final_.IsMidRound(); }
  /// Gives the poses, but those that stand alone, and forgets them.
  std::vector<FramePose> Take(const Map& map);

 private:
  FrameRefiner refiner_;
  FinalPoses final_;
  std::deque<PoseSearch> searches_;  ///< one for each thread; what refined frames see is not news of the map
  bool smooth_;
  size_t max_frames_;
  struct Tracked {
    uint32_t index;
    int64_t stamp_ns;
    PlacedPose pose;
  };
  static Tracked PlaceOf(const FramePose& pose);
  std::deque<Tracked> tracked_;  ///< the newest frames that were tracked as they came
  std::vector<Tracked> placed_;  ///< frames that were placed later and vouch
};

}  // namespace dmslam
