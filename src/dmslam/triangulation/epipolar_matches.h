#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/triangulation/triangulation_options.h"

namespace dmslam {

/// Features of two keyframes that lie on each other's epipolar lines and look alike: pairs (feature of a, of
/// b). Features are ordered by the plane through both cameras in which their rays lie, so that only those
/// near the same plane are compared. `use_a`, `use_b`: an entry per feature, 0 where it takes no part.
std::vector<std::pair<uint16_t, uint16_t>> MatchAlongEpipolarPlanes(
    const Keyframe& a, const std::vector<uint8_t>& use_a, const Keyframe& b,
    const std::vector<uint8_t>& use_b, const Map& map, const EpipolarMatchOptions& options);

}  // namespace dmslam
