#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/messaging/types.h"
#include "dmslam/settings/settings.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// What every process of the system is told at its start.
struct NodeOptions {
  uint32_t session = 0;    ///< 0: that of the bus, where there is one
  CameraId camera_id = 0;  ///< of a player and a frontend: whose they are
  std::vector<std::string>
      peers;  ///< processes that take part: they are waited for, and hold their streams' writers back
  Link link = Link::kHost;
  bool accept_recorded =
      false;                  ///< camera and frames of a recorded session (a log that is replayed) are ours
  bool of_a_log = false;      ///< what is heard is played from a file: a camera that is said once is believed
  bool take_over = false;     ///< asks a present writer of its stream to close
  bool fresh = false;         ///< a mapper begins with an empty map, whatever replicas there are
  std::optional<BusKey> key;  ///< of the bus; what is recorded under it can be told from what is not
  Settings settings;          ///< as text: each node reads the options that it needs

  bool HasPeer(std::string_view name) const;
  /// How many cameras take part, by the frontends among the peers.
  CameraId NumCameras() const;
};

}  // namespace dmslam
