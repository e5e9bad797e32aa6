#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/refinement/final_poses.h"

namespace dmslam {

/// Which of the poses stand alone (1) and are not to be told: of frames that were not tracked when they came,
/// farther in time than anything tracked can vouch for, and too few in a row to vouch for each other. A frame
/// that is looked for without a motion to go by can be found on somebody who stood elsewhere; a longer way
/// that fits together cannot. `tracked_ns`: stamps of the frames that were tracked as they came, in order.
std::vector<uint8_t> StandAlone(std::span<const FinalPose> poses, std::span<const int64_t> tracked_ns);

}  // namespace dmslam
