#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/proposals.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// The first record of the frontend's stream: on what the map that follows rests.
struct SessionStart {
  uint32_t session = 0;
  std::optional<int64_t> first_stamp_ns;  ///< of the frame that waited when this was told; none: none did
  uint64_t seed = 0;
  uint64_t configuration_hash = 0;              ///< of all settings that change results
  std::optional<uint64_t> vocabulary_checksum;  ///< none: there is no vocabulary
  PlaybackMode mode = PlaybackMode::kRealtime;
  Camera camera;
  Pyramid pyramid;
  std::string sequence;
  std::string profile;
  int32_t protocol_version = kProtocolVersion;  ///< of its writer
  std::string software = kVersion;              ///< of its writer
  CameraId camera_id = 0;
};

/// The answer to a frame: the frontend is done with it and with all it has to wait for (lock-step).
struct FrameDone {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  CameraId camera_id = 0;
};

/// The answer to EndOfSequence: the end was heard, and all is told.
struct SequenceDone {
  int64_t utime = 0;  ///< wall time at which it was sent [us]
  uint32_t session = 0;
  CameraId camera_id = 0;
  int64_t frames_processed = 0;
  int64_t frames_skipped = 0;  ///< left out in favour of the newest: too many waited
};

/// Where the camera is for who controls its motion: in odom, which never jumps, and where odom lies in the
/// map. OdometryState says what the values mean.
struct Odometry {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  TrackingState state = TrackingState::kNotInitialized;
  uint32_t segment = 0;  ///< 0: no frame was tracked yet
  bool measured = false;
  Rigid3d T_odom_cam;
  bool has_velocity = false;
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< [units of odom / s], camera's axes
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad / s], camera's axes
  std::optional<MapId> map_id;
  Rigid3d T_map_odom;           ///< map_from_odom, whose...
  double scale_map_odom = 1.0;  ///< ...scale comes first: p_map = scale * R * p_odom + t
  double depth = 1.0;           ///< of the scene [units of odom]
  double latency_ms = 0;        ///< from publication of the image to this message
  std::optional<uint32_t> step_from;
  std::vector<double> step_covariance;  ///< as FramePose's, in units of odom
  CameraId camera_id = 0;
};

/// A frame's pose laid out to be watched and plotted.
struct PoseView {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  TrackingState state = TrackingState::kNotInitialized;
  std::optional<MapId> map_id;
  bool has_pose = false;
  Rigid3d T_world_cam;
  int32_t inliers = 0;
  int32_t moving = 0;
  int32_t unknown = 0;
  double moving_share = 0;
  double latency_ms = 0;  ///< from publication of the image to this pose
  /// Distance to the ground truth after alignment of what was tracked so far; none: not known.
  std::optional<double> error_m;
  CameraId camera_id = 0;
};

/// The features of a frame, for pictures.
struct FeatureView {
  enum class Kind : uint8_t { kUnmatched = 0, kUsed = 1, kRejected = 2, kMoving = 3 };
  struct Item {
    uint16_t u_q4 = 0;  ///< raw pixel * 16
    uint16_t v_q4 = 0;
    Kind kind = Kind::kUnmatched;
  };
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  std::vector<Item> items;
  CameraId camera_id = 0;
};

/// When a frame passed each step; wall times [us].
struct FrameTrace {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  int64_t capture_us = 0;    ///< player: taken, or due to be played
  int64_t publish_us = 0;    ///< player: published
  int64_t receive_us = 0;    ///< frontend: arrived
  int64_t begin_us = 0;      ///< frontend: work on it began
  int64_t decoded_us = 0;    ///< image decoded
  int64_t extracted_us = 0;  ///< features extracted
  int64_t tracked_us = 0;    ///< pose known
  int64_t published_us = 0;  ///< pose published
  CameraId camera_id = 0;
};

}  // namespace dmslam
