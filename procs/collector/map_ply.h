#pragma once

#include <optional>
#include <string>

#include "dmslam/map/map.h"

namespace dmslam {

/// Writes a map as coloured points: landmarks grey, red where they are believed to move; cameras blue. None:
/// the file holds no point. Throws InputError when that cannot be written.
void WriteMapPly(const std::string& path, const Map& map, std::optional<MapId> map_id);

}  // namespace dmslam
