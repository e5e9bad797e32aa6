#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/record_group.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What the frontend says, record by record. The mapper reads them in order.

/// A frame that should become a keyframe.
struct KeyframeProposal {
  KeyframeId id;
  MapId map_id = 0;
  int64_t stamp_ns = 0;
  /// The keyframe its pose is told from, which may have been culled meanwhile; none: it is the world's
  /// origin.
  std::optional<KeyframeId> reference;
  Rigid3d T_cam_reference;
  double reference_scale = 1.0;  ///< the reference's scale (Keyframe::scale) when the pose was told
  FeatureSet features;
  struct Match {
    uint16_t feature = 0;
    LandmarkId landmark;
  };
  std::vector<Match> matches;    ///< landmarks seen as static
  std::vector<uint16_t> moving;  ///< features seen to move: no landmark is made of them; sorted
  CameraId camera_id = 0;
};

/// A first map, as the frontend sees it: two frames, the points seen by both, and what frames between them
/// saw of these.
struct InitialMap {
  MapId map_id = 0;
  KeyframeProposal first;   ///< its camera is the world's origin
  KeyframeProposal second;  ///< T_cam_reference is its pose from `first`
  struct Point {
    uint16_t feature_first = 0;
    uint16_t feature_second = 0;
    Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  };
  std::vector<Point> points;
  /// A frame between the two.
  struct View {
    KeyframeProposal keyframe;  ///< T_cam_reference is its pose from `first`
    struct Sight {
      uint16_t point = 0;  ///< index into `points`
      uint16_t feature = 0;
    };
    std::vector<Sight> sights;
  };
  std::vector<View> between;  ///< by time
};

/// What frames said about landmarks since the last record.
struct FrameEvidence {
  int64_t stamp_ns = 0;  ///< newest frame in it
  std::optional<MapId> map_id;
  struct Item {
    LandmarkId landmark;
    uint16_t visible = 0;
    uint16_t found = 0;
    uint16_t moved = 0;
  };
  std::vector<Item> items;  ///< sorted by landmark
  CameraId camera_id = 0;
};

/// How well is known where the camera is. The numbers are those of lcmtypes/dmslam_frame_pose_t.lcm.
enum class TrackingState : uint8_t {
  kNotInitialized = 0,  ///< a first map is looked for; no pose
  kWaitingForMap = 1,   ///< a first map was proposed and has not come back yet; no pose
  kTrial = 2,           ///< a young map must still prove that it predicts; pose
  kTracking = 3,        ///< enough static landmarks fix position and rotation; pose
  kUncertain = 4,       ///< the landmarks fix the pose badly, as its covariance says; pose
  kLost = 5,            ///< no pose for a while: it is looked for in the map
  kLocalizedLater = 6,  ///< a frame placed in the map, or placed better, after the fact; pose
  kRotationOnly = 7,    ///< how the camera turns is measured, where it is is not; no pose
  kMissing = 8,         ///< no pose since a moment ago: too few landmarks are found
};

/// Whether a frame in this state has a pose.
constexpr bool HasPose(TrackingState state) {
  switch (state) {
    case TrackingState::kTrial:
    case TrackingState::kTracking:
    case TrackingState::kUncertain:
    case TrackingState::kLocalizedLater:
      return true;
    case TrackingState::kNotInitialized:
    case TrackingState::kWaitingForMap:
    case TrackingState::kLost:
    case TrackingState::kRotationOnly:
    case TrackingState::kMissing:
      return false;
  }
  return false;
}

/// How many numbers the covariance of a pose takes: position x, y, z [map units], then the rotation vector
/// x, y, z [rad], both along the axes of the frame that the pose is told in; 6 x 6, symmetric: the upper
/// triangle, row by row.
inline constexpr size_t kPoseCovarianceSize = 21;

/// Where the camera was.
struct FramePose {
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  TrackingState state = TrackingState::kNotInitialized;
  std::optional<MapId> map_id;
  std::optional<KeyframeId> reference;  ///< none: no pose, and `state` says why
  Rigid3d T_cam_reference;
  double reference_scale = 1.0;  ///< the reference's scale (Keyframe::scale) when the pose was told
  Rigid3d T_cam_world;           ///< in the map as the frontend knew it then
  uint16_t num_features = 0;
  uint16_t num_static = 0;  ///< inliers
  uint16_t num_moving = 0;
  uint16_t num_unknown = 0;         ///< matched, but without a vote
  float moving_image_share = 0.0F;  ///< share of occupied image cells whose features move
  std::string reason;               ///< why there is no pose, or why the state is what it is
  CameraId camera_id = 0;
  /// Of this camera's pose in its reference keyframe's frame, kPoseCovarianceSize numbers; empty: not known.
  std::vector<double> covariance;
  /// The same of this camera's pose in the camera of frame `step_from`.
  std::vector<double> step_covariance;
  std::optional<uint32_t> step_from;
  bool HasPose() const { return reference.has_value(); }
};

/// The frontend gives a map up.
struct MapReset {
  MapId map_id = 0;
  enum class Fate : uint8_t {
    kKeep = 0,  ///< a new one follows
    kDrop = 1,  ///< it was wrong from the beginning
  } fate = Fate::kKeep;
  std::string reason;
  std::optional<int64_t> stamp_ns;  ///< capture time of the frame at which it did so, where that is known
  CameraId camera_id = 0;
};

/// No frame follows: the frontend asks the mapper to adjust each of its maps as a whole. The mapper answers
/// with MapEvent::kMapAdjusted for each and then MapEvent::kRequestDone, whose progress is this camera's.
struct AdjustRequest {
  uint32_t request = 1;  ///< counts the requests of a frontend from 1: the answer names it, and the epoch
  std::string reason;
  std::optional<int64_t> newest_stamp_ns;  ///< capture time of the newest frame, where there is one
  CameraId camera_id = 0;
};

/// When it is a camera's turn: with a frame, by its stamp, or at the end, when no frame of it follows.
struct TurnTime {
  std::optional<int64_t> stamp_ns;  ///< of the frame; none: at the end

  static TurnTime Of(int64_t stamp_ns) { return {stamp_ns}; }
  static TurnTime AtTheEnd() { return {std::nullopt}; }
  bool IsAtTheEnd() const { return !stamp_ns; }
  /// The end comes after all frames.
  bool ComesBefore(const TurnTime& other) const {
    return !IsAtTheEnd() && (other.IsAtTheEnd() || *stamp_ns < *other.stamp_ns);
  }
};

/// Several cameras in lock-step: a frame has come, and waits until the mapper says that all that comes before
/// it, by stamp and then by camera, is in the map (MapEvent::kTurn).
struct TurnRequest {
  uint32_t frame_index = 0;
  TurnTime time;
  CameraId camera_id = 0;
};

/// The loop closer's answer to keyframe `keyframe`.
struct LoopAnswer {
  KeyframeId keyframe;
  uint64_t base_version = 0;              ///< map version it was computed on
  std::optional<uint64_t> correction_id;  ///< of a loop or a global adjustment
  enum class Kind : uint8_t { kNone = 0, kLoop = 1, kGlobalAdjustment = 2 } kind = Kind::kNone;
  /// The ends of a loop: the keyframe that sees the place, which is that answered or an older one that was
  /// asked again; and the keyframe there.
  std::optional<KeyframeId> seen_from, matched;
  struct KeyframeCorrection {
    KeyframeId keyframe;
    Sim3d corrected_from_base;  ///< world (corrected) from world (base), for what hangs on this keyframe
  };
  std::vector<KeyframeCorrection> corrections;
  struct LandmarkFusion {
    LandmarkId from;
    LandmarkId into;
  };
  std::vector<LandmarkFusion> fusions;
  /// Landmarks follow their reference keyframe; of a global adjustment, what is left beyond that.
  struct LandmarkOffset {
    LandmarkId landmark;
    Eigen::Vector3d offset_world = Eigen::Vector3d::Zero();
  };
  std::vector<LandmarkOffset> landmark_offsets;
  std::string note;
  std::optional<int64_t> stamp_ns;  ///< capture time of `keyframe`, where that is known
  RecordGroup group;
};

}  // namespace dmslam
