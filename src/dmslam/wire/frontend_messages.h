#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/features/types.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/proposals.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// The first record of the frontend's stream: on what the map that follows rests.
struct SessionStart {
  uint32_t session = 0;
  int64_t first_stamp_ns = 0;
  uint64_t seed = 0;
  uint64_t configuration_hash = 0;   ///< of all settings that change results
  uint64_t vocabulary_checksum = 0;  ///< 0: none
  PlaybackMode mode = PlaybackMode::kRealtime;
  Camera camera;
  Pyramid pyramid;
  std::string sequence;
  std::string profile;
};

/// The frontend is done with a frame and with all it has to wait for (lock-step).
struct FrameDone {
  /// In place of a frame's index: the end of the sequence was heard, and all is told.
  static constexpr uint32_t kEndOfSequence = 0xffffffff;

  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
};

/// A frame's pose laid out to be watched and plotted.
struct PoseView {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  TrackingState state = TrackingState::kNotInitialized;
  MapId map_id = 0;
  bool has_pose = false;
  Rigid3d T_world_cam;
  int32_t inliers = 0;
  int32_t moving = 0;
  int32_t unknown = 0;
  double moving_share = 0;
  double latency_ms = 0;  ///< from publication of the image to this pose
  double error_m =
      -1;  ///< distance to the ground truth after alignment of what was tracked so far; -1: not known
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
};

}  // namespace dmslam
