#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/play_changes.h"
#include "dmslam/util/ids.h"
#include "dmslam/wire/player_messages.h"
#include "player/frame_encoding.h"

namespace dmslam {

/// What is played, and how.
struct PlayerOptions {
  std::string sequence;  ///< path of what is played; its last part names it
  Camera camera;
  uint32_t session = 1;
  CameraId camera_id = 0;  ///< of several that work on one map
  bool take_over = false;  ///< asks a present player of the session to leave
  PlaybackMode mode = PlaybackMode::kRealtime;
  double speed = 1.0;        ///< factor on the recorded rate; 0: as fast as possible
  size_t start = 0;          ///< first frame
  size_t frames = SIZE_MAX;  ///< at most so many
  /// Frames up to the one of this index were played before this process began: they count, and are not played
  /// again.
  std::optional<uint32_t> behind;
  EncodingOptions encoding;
  bool local_frames = false;  ///< frames stay on this host: the frontend runs here, and the bus leaves it
  /// Who is to be ready before the first frame: of frontend and mapper. Only in real time: in lock-step a
  /// frame is repeated until it is done.
  std::vector<std::string> awaited;
  double lead_s = 0.5;  ///< between the first camera info and the first frame, so that others can get ready
  std::vector<BlackOut> black_outs;
  std::vector<Jump> jumps;
};

}  // namespace dmslam
