#pragma once

#include <optional>
#include <vector>

#include "collector/correction_record.h"
#include "dmslam/map/map.h"
#include "dmslam/map/map_delta.h"

namespace dmslam {

/// The keyframes to which a keyframe has edges of loops, in the map; empty where it is not in it.
std::vector<KeyframeId> LoopsOf(const Map& map, std::optional<KeyframeId> id);

/// What is recorded of a correction. `delta`: the record that tells of it; `loops_before`: LoopsOf what it is
/// about, before; `map`: with it. A loop's other end is the keyframe to which there was no edge before; how
/// they lie is known best now.
CorrectionRecord RecordOf(const MapDelta& delta, const std::vector<KeyframeId>& loops_before, const Map& map);

}  // namespace dmslam
