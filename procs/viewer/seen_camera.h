#pragma once

#include <memory>
#include <optional>

#include "dmslam/messaging/stream_reader.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/player_messages.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// What is known of one camera.
struct SeenCamera {
  std::optional<CameraInfo> info;
  std::unique_ptr<StreamReader> reader;  ///< of its frontend's stream
  FrontendStatus frontend;
  std::optional<TrackingState> shown_state;
  std::optional<PoseView> to_show;  ///< of its newest frame; none: it is shown
  std::optional<MapId> map_id;      ///< of its newest frame
  bool ended = false;
};

}  // namespace dmslam
