#pragma once

#include <optional>
#include <set>

#include "dmslam/map/map.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// The cameras of this session that are of another model than ours. What all see is projected by one model,
/// so of two cameras that differ one has to leave: the one that is not in the map, and where both are, or
/// neither is, the one with the higher number.
class OtherModels {
 public:
  /// What a player says of another camera of the session.
  void Hear(const CameraInfo& info, const Camera& ours);
  /// The camera to which `us` has to give way; none: we stay. `map`: as far as it is known here.
  std::optional<CameraId> GivesWayTo(const Map& map, CameraId us) const;

 private:
  std::set<CameraId> cameras_;
};

}  // namespace dmslam
