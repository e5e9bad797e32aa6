#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "dmslam/features/types.h"
#include "dmslam/map/viewing_range.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Who sees a landmark, and with which of its features.
struct Observation {
  KeyframeId keyframe;
  uint16_t feature = 0;
  auto operator<=>(const Observation&) const = default;
};

/// What frames said of a landmark since it was made. All of it is the mapper's state and travels with the
/// map.
struct LandmarkEvidence {
  uint32_t visible = 0;  ///< frames in which it should have been seen
  uint32_t found = 0;    ///< frames in which it was seen where the map says
  uint32_t moved = 0;    ///< frames in which something like it was seen elsewhere
  float motion_belief =
      0.0F;  ///< log odds that it moves; above zero it has no vote (see docs/motion_belief.md)
  std::optional<int64_t> last_moved_ns;  ///< stamp of the newest frame that saw it elsewhere; none: never
  auto operator<=>(const LandmarkEvidence&) const = default;
};

/// A point of the map.
struct Landmark {
  LandmarkId id;
  MapId map_id = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  Descriptor descriptor;      ///< the observation nearest to all others
  KeyframeId reference;       ///< the keyframe whose corrections it follows
  KeyframeId first_keyframe;  ///< the newest keyframe when it was made: its age is counted from here
  int64_t first_ns = 0;       ///< stamp of the keyframe with which it was made
  LandmarkEvidence evidence;
  std::vector<Observation> observations;  ///< sorted by keyframe

  /// How a keyframe sees it; null: it does not.
  const Observation* SeenBy(KeyframeId keyframe) const {
    const auto at = std::ranges::lower_bound(observations, keyframe, {}, &Observation::keyframe);
    return at != observations.end() && at->keyframe == keyframe ? &*at : nullptr;
  }

 private:
  friend class Map;
  // Follows from position and observations. The map computes it when it is asked for (`Map::Viewing`), and
  // marks it stale when it changes what it follows from.
  ViewingCache viewing_;
};

}  // namespace dmslam
