#pragma once

#include <cstdint>
#include <optional>

#include "dmslam/map/map.h"
#include "dmslam/refinement/unplaced_frames.h"
#include "dmslam/tracking/motion_model.h"
#include "dmslam/tracking/pose_search.h"
#include "dmslam/tracking/relocalizer.h"

namespace dmslam {

/// Whether a hand-held camera can have gone from pose a to pose b (T_cam_world) in `seconds`; `depth` of the
/// scene [map units].
bool IsPlausibleMotion(const Rigid3d& a, const Rigid3d& b, double seconds, double depth);

/// Whether the camera gets from the keyframes before and after the frame to its pose and back, moving at most
/// about as fast as it does between them; `depth` of the scene [map units]. Keyframes of that camera count.
bool AgreesWithKeyframesAside(const Map& map, MapId map_id, const TrackedFrame& frame, uint32_t session,
                              double depth, CameraId camera_id = 0);

/// Places frames when the sequence has ended, the newest first: each from the placed frame that follows it
/// and its motion, or else like a lost camera. The map may grow meanwhile by frames that become keyframes.
class LatePlacement {
 public:
  LatePlacement(uint32_t session, CameraId camera_id, uint64_t seed, const MotionModelOptions& motion)
      : session_(session), camera_id_(camera_id), seed_(seed), motion_(motion) {}

  /// While the map grows the neighbour is a later frame, that may move with the map; afterwards it can also
  /// be the keyframe that was made of the frame itself.
  void SetGrowing(bool growing) { growing_ = growing; }
  bool IsGrowing() const { return growing_; }

  /// Finds the frame's pose; not ok where it is not believed. `search` and `relocalizer`: of the frontend.
  TrackingReport Place(const Map& map, PoseSearch* search, const Relocalizer& relocalizer,
                       TrackedFrame* frame);
  /// The frame was placed; the next one is looked for from here.
  void GoOnFrom(TrackedFrame frame, const PlacedPose& pose);

  /// The neighbour may lie elsewhere now; where it became a keyframe that knows more. Any but the frame
  /// placed last is forgotten.
  void OnMapChanged(const Map& map);
  void Forget();

 private:
  /// The frame placed last.
  struct Placed {
    uint32_t index = 0;
    PlacedPose pose;
    std::optional<Rigid3d> T_this_next;  ///< its camera from that of the frame after it
  };

  void FindNeighbour(const Map& map, const TrackedFrame& frame);
  std::optional<Rigid3d> Predict(const TrackedFrame& frame) const;
  bool IsPlausible(const TrackedFrame& frame, double depth) const;
  TrackingReport TrackBackwards(const Map& map, double depth, PoseSearch* search, TrackedFrame* frame) const;

  uint32_t session_;
  CameraId camera_id_;
  uint64_t seed_;
  MotionModelOptions motion_;
  bool growing_ = false;
  std::optional<TrackedFrame> next_;  ///< the placed frame or keyframe that follows those to be placed
  std::optional<Placed> last_;
};

}  // namespace dmslam
