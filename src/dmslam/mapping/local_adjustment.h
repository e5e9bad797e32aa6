#pragma once

#include <functional>

#include "dmslam/mapping/mapper_options.h"
#include "dmslam/optimization/map_adjustment.h"

namespace dmslam {

/// The window around keyframe `id`: itself and its best covisible keyframes.
MapAdjustmentReport AdjustLocally(MapEditor& map, KeyframeId id, const MapperOptions& options,
                                  const std::function<bool()>& interrupt);

}  // namespace dmslam
