#pragma once

#include <cstddef>
#include <vector>

#include "dmslam/map/map.h"

namespace dmslam {

/// The whole map as deltas with at most `max_bytes_hint` of payload each, keyframes near `center` first.
/// Applying all of them to an empty replica gives this map.
std::vector<MapDelta> CutSnapshot(const Map& map, KeyframeId center, size_t max_bytes_hint);

}  // namespace dmslam
