#pragma once

#include <cstddef>

#include "collector/durations.h"

namespace dmslam {

/// What became of the keyframes that frontends proposed.
struct KeyframeRecord {
  size_t proposed = 0;
  size_t missing = 0;             ///< proposed for a map that stands, and neither in it nor culled from it
  size_t lost_in_crash = 0;       ///< made after the last checkpoint before all died, and not made again
  size_t lost_with_frontend = 0;  ///< their frontend died while no mapper was there to take them
  DurationHistogram to_landmarks, to_adjusted;  ///< from when each was heard to when these were
};

}  // namespace dmslam
