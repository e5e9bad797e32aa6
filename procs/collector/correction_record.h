#pragma once

#include <optional>
#include <string>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/map_delta.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// A loop or a global adjustment that the mapper applied, or a correction that it refused.
struct CorrectionRecord {
  MapEvent event = MapEvent::kCorrected;
  KeyframeId keyframe;
  std::string note;
  std::optional<KeyframeId> matched;  ///< of a loop: its other end, where that is known
  Rigid3d T_matched_keyframe;         ///< of a loop: as it was closed [map units]
};

}  // namespace dmslam
