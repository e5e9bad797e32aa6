#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/refinement/unplaced_frames.h"
#include "dmslam/tracking/motion_follower.h"
#include "dmslam/tracking/pose_search.h"
#include "dmslam/tracking/relocalizer.h"
#include "dmslam/tracking/usual_speed.h"

namespace dmslam {

/// Whether a hand-held camera can have gone from pose a to pose b (T_cam_world) in `seconds`; `depth` of the
/// scene [map units].
bool IsPlausibleMotion(const Rigid3d& a, const Rigid3d& b, double seconds, double depth);

/// Whether the camera gets from the keyframes before and after the frame to its pose and back, moving at most
/// about as fast as it does between them; `depth` of the scene [map units]. Keyframes of that camera count.
bool AgreesWithKeyframesAside(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                              double depth, CameraId camera_id = 0);

/// Whether the camera gets from the frame to the keyframes that follow it within 0.2 to 0.5 s at no more than
/// twice the fastest that was usual for it; `depth` of the scene [map units]. Only keyframes of that session,
/// camera and map count. True where there are none.
bool IsLeftAtUsualSpeed(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                        double depth, const UsualSpeed& usual_speed, CameraId camera_id = 0);

/// Whether so much is seen, and in so much of the image, that a frame that was placed when the sequence has
/// ended is believed for itself, and may become a keyframe.
bool IsWellSeen(const TrackingReport& report);

/// Whether frames that are placed late may become keyframes.
enum class LateMap : uint8_t { kGrows, kStands };

/// Places frames when the sequence has ended, the newest first: each from the placed frame that follows it
/// and its motion, or else like a lost camera. While the map grows the neighbour is a later frame, that may
/// move with the map; where it stands it can also be the keyframe that was made of the frame itself.
class LatePlacement {
 public:
  LatePlacement(uint32_t session, CameraId camera_id, uint64_t seed, const TrackingOptions& options)
      : session_(session), camera_id_(camera_id), seed_(seed), options_(options) {}

  struct Found {
    TrackingReport report;
    bool jumped = false;  ///< recognised like a lost camera, and not followed from its neighbour
  };
  /// Of the tracker: its search, its relocaliser, and how fast the camera usually went.
  struct Tracked {
    PoseSearch* search = nullptr;
    Relocalizer& relocalizer;
    const UsualSpeed& usual_speed;
  };
  /// Finds the frame's pose; the report has none where it is not believed.
  Found Place(const Map& map, LateMap late_map, const Tracked& tracked, TrackedFrame* frame);
  /// A frame with its pose.
  struct Placed {
    TrackedFrame frame;
    TrackingReport report;
    PlacedPose pose;
    bool jumped = false;     ///< as it was found
    bool confirmed = false;  ///< by landmarks in view that are proven to be no person
  };
  /// Where and when the camera was before.
  struct Before {
    uint32_t index = 0;
    int64_t stamp_ns = 0;
    Rigid3d T_cam_world;
  };
  /// The frame was placed; the next one is looked for from here. Gives what may be told now, newest first:
  /// this frame, and those after it that see too little to be believed for themselves. They are when the
  /// motion has led through them to a frame that is well seen, or to `before`, the frame just before this one
  /// if that was tracked. Else it may drift away.
  std::vector<Placed> GoOnFrom(const Map& map, LateMap late_map, const PoseSearch& search, Placed placed,
                               const std::optional<Before>& before);

  /// The neighbour may lie elsewhere now; where it became a keyframe that knows more. Any but the frame
  /// that was placed last while the map grows is forgotten.
  void OnMapChanged(const Map& map);
  void Forget();

 private:
  void LeaveNeighbour();
  static bool IsProvenPlace(const Map& map, const PoseSearch& search, const TrackedFrame& frame);
  bool IsTooFast(const Map& map, const Tracked& tracked, const TrackedFrame& frame) const;
  void FindNeighbour(const Map& map, LateMap late_map, const TrackedFrame& frame);
  bool IsPlausible(const Map& map, const Keyframe* reference, const TrackedFrame& frame) const;
  bool IsBelieved(const Map& map, const TrackingReport& report, const PoseSearch& search,
                  const TrackedFrame& frame) const;
  bool LeadsTo(const Map& map, const std::optional<Before>& before) const;
  TrackingReport FindBeside(const Map& map, PoseSearch* search, TrackedFrame* frame) const;
  TrackingReport TrackBackwards(const Map& map, PoseSearch* search, TrackedFrame* frame);
  void Coast(const Map& map, const FoundPose& weak_pose, const TrackingReport& report,
             const PoseSearch& search, const TrackedFrame& frame);

  uint32_t session_;
  CameraId camera_id_;
  uint64_t seed_;
  TrackingOptions options_;
  std::optional<MotionFollower> follower_;  ///< backwards, from the placed frame or keyframe that follows
  /// Of the frame placed last, while the map grows.
  struct Last {
    uint32_t index = 0;
    PlacedPose pose;
  };
  std::optional<Last> last_;
  std::vector<Placed> weak_;  ///< since the frame that was believed last
};

}  // namespace dmslam
