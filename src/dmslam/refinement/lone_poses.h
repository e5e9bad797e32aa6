#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/refinement/final_poses.h"

namespace dmslam {

/// A frame that was tracked as it came, or confirmed when it was placed later, and the map that it is in now.
struct TrackedAt {
  int64_t stamp_ns = 0;
  MapId map_id = 0;
};

/// Which of the poses stand alone (1) and are not to be told: of frames that were not tracked when they came,
/// farther in time than any tracked frame of their map can vouch for, and in too short a row to vouch for
/// each other, or before all tracked frames of the map, or after them. In a row each pose bounds where the
/// next one may be. A frame that is looked for without a motion to go by can be found on somebody who stood
/// elsewhere; a longer way that fits together cannot, where the camera is known to have come and gone. Who
/// walks along with the camera hides the room from where the sequence begins or ends, and is such a way.
/// `tracked`: in order of their stamps.
std::vector<uint8_t> StandAlone(std::span<const FinalPose> poses, std::span<const TrackedAt> tracked);

}  // namespace dmslam
