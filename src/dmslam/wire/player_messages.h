#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What the player says. None of it is a record: frames are repeated in lock-step and may be lost in real
/// time.

enum class PlaybackMode : uint8_t { kRealtime = 1, kLockstep = 2 };

/// Which camera the frames come from, and what is being played. Repeated twice a second.
struct CameraInfo {
  int64_t utime = 0;  ///< wall time at which it was sent [us]
  uint32_t session = 0;
  Camera camera;
  std::string sequence;               ///< name of what is played
  std::optional<int64_t> num_frames;  ///< where it is known
  uint32_t first_frame = 0;           ///< index of the first frame published
  PlaybackMode mode = PlaybackMode::kRealtime;
  double speed = 1.0;  ///< factor on the recorded rate, in real time; 0: as fast as possible
  CameraId camera_id = 0;
};

enum class FrameEncoding : uint8_t { kJpeg = 1, kPng = 2, kGray8 = 3, kRgb8 = 4, kBgr8 = 5 };

/// One image.
struct Frame {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  int64_t capture_us = 0;  ///< wall time at which it was taken, or was due to be played
  int64_t publish_us = 0;  ///< wall time at which it was published
  int width_px = 0;        ///< 0 with compressed encodings: not known without decoding
  int height_px = 0;
  FrameEncoding encoding = FrameEncoding::kJpeg;
  std::vector<uint8_t> data;  ///< a file's content, or pixels row by row without padding
  CameraId camera_id = 0;
};

/// No more frames of a camera follow.
struct EndOfSequence {
  int64_t utime = 0;  ///< wall time at which it was sent [us]
  uint32_t session = 0;
  int64_t frames_published = 0;
  int64_t frames_listed = 0;                ///< for people and plots
  int64_t frames_missing = 0;               ///< listed, but without an image that can be read
  int64_t frames_blacked = 0;               ///< replaced by black images, as asked for
  int64_t frames_jumped = 0;                ///< left out by jumps, as asked for
  std::optional<int32_t> last_frame_index;  ///< none: no frame was published
  int64_t last_stamp_ns = 0;                ///< of the last frame published; for people and plots
  CameraId camera_id = 0;
};

/// Where the camera truly was. For eyes and evaluation; nothing that estimates reads it.
struct GroundTruthPose {
  uint32_t session = 0;
  uint32_t frame_index = 0;
  int64_t stamp_ns = 0;
  Rigid3d T_world_cam;  ///< [m], in the ground truth's own world
  CameraId camera_id = 0;
};

}  // namespace dmslam
