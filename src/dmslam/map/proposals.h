#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What the frontend says, record by record. The mapper reads them in order.

/// A frame that should become a keyframe.
struct KeyframeProposal {
  KeyframeId id;
  MapId map_id = 0;
  int64_t stamp_ns = 0;
  KeyframeId reference;  ///< the keyframe its pose is told from; may have been culled meanwhile
  Rigid3d T_cam_reference;
  double reference_scale = 1.0;  ///< the reference's scale (Keyframe::scale) when the pose was told
  FeatureSet features;
  struct Match {
    uint16_t feature = 0;
    LandmarkId landmark;
  };
  std::vector<Match> matches;    ///< landmarks seen as static
  std::vector<uint16_t> moving;  ///< features seen to move: no landmark is made of them; sorted
};

/// A first map, as the frontend sees it: two frames and the points seen by both.
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
};

/// What frames said about landmarks since the last record.
struct FrameEvidence {
  int64_t stamp_ns = 0;  ///< newest frame in it
  MapId map_id = 0;
  struct Item {
    LandmarkId landmark;
    uint16_t visible = 0;
    uint16_t found = 0;
    uint16_t moved = 0;
    float chi2_sum = 0.0F;  ///< sum of squared normalised residuals over `found`
  };
  std::vector<Item> items;  ///< sorted by landmark
};

enum class TrackingState : uint8_t {
  kNotInitialized = 0,
  kWaitingForMap = 1,  ///< a first map was proposed and has not come back yet
  kTrial = 2,          ///< a young map must still prove that it predicts
  kTracking = 3,
  kUncertain = 4,  ///< too few static inliers: the pose is a prediction
  kLost = 5,
  kLocalizedLater = 6,  ///< a frame placed in the map after the fact
};

/// Where the camera was.
struct FramePose {
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  TrackingState state = TrackingState::kNotInitialized;
  MapId map_id = 0;
  KeyframeId reference;  ///< invalid: no pose
  Rigid3d T_cam_reference;
  double reference_scale = 1.0;  ///< the reference's scale (Keyframe::scale) when the pose was told
  Rigid3d T_cam_world;           ///< in the map as the frontend knew it then
  uint16_t num_features = 0;
  uint16_t num_static = 0;  ///< inliers
  uint16_t num_moving = 0;
  uint16_t num_unknown = 0;         ///< matched, but without a vote
  float moving_image_share = 0.0F;  ///< share of occupied image cells whose features move
  std::string reason;               ///< why there is no pose, or why the state is what it is
  bool HasPose() const { return reference.valid(); }
};

/// The frontend gives a map up.
/// With map 0 it gives up none: the sequence has ended, and the mapper is asked to adjust its maps as a
/// whole. It answers with a settled record about no keyframe.
struct MapReset {
  MapId map_id = 0;
  bool drop = false;  ///< true: it was wrong from the beginning; false: keep it, a new one follows
  std::string reason;
  int64_t stamp_ns = 0;  ///< capture time of the frame at which it did so; 0: not known
};

/// The loop closer's answer to keyframe `keyframe`.
struct LoopAnswer {
  KeyframeId keyframe;
  uint64_t base_version = 0;   ///< map version it was computed on
  uint64_t correction_id = 0;  ///< 0: no loop
  enum class Kind : uint8_t { kNone = 0, kLoop = 1, kGlobalAdjustment = 2 } kind = Kind::kNone;
  KeyframeId matched;  ///< the other end of the loop
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
  int64_t stamp_ns = 0;  ///< capture time of `keyframe`; 0: not known
};

}  // namespace dmslam
