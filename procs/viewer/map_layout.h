#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <set>

#include "dmslam/map/map.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Where maps that are not joined are drawn, and in which colour. They have no common frame: one lies as it
/// is, the others lie beside it, along the x axis of the first one's frame, in order of their number.
class MapLayout {
 public:
  struct Place {
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();  ///< of what is drawn [map units]
    uint32_t colour = 0;                               ///< number of a colour; no two maps have the same
    size_t keyframes = 0;
  };

  /// Brings it up to date with `map`; `first`, if any, lies as it is. Returns the maps whose place or colour
  /// has changed.
  std::set<MapId> Arrange(const Map& map, std::optional<MapId> first);

  /// Null: there is no such map.
  const Place* Find(MapId map_id) const;
  const std::map<MapId, Place>& places() const { return places_; }

 private:
  uint32_t ColourFor(MapId map_id);

  std::map<MapId, Place> places_;
  std::map<MapId, uint32_t> last_colour_;  ///< of maps that were ever there: a snapshot brings them again
};

}  // namespace dmslam
