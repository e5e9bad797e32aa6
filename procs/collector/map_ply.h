#pragma once

#include <string>

#include "dmslam/map/map.h"

namespace dmslam {

/// Writes a map as coloured points: landmarks grey, red where they are believed to move; cameras blue. Throws
/// InputError when that cannot be written.
void WriteMapPly(const std::string& path, const Map& map, MapId map_id);

}  // namespace dmslam
