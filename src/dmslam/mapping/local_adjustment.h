#pragma once

#include <functional>

#include "dmslam/mapping/mapper_options.h"
#include "dmslam/optimization/map_adjustment.h"

namespace dmslam {

/// Adjusts the window around a keyframe: itself and its best covisible keyframes.
MapAdjustmentReport AdjustLocally(MapEditor& map, const Keyframe& keyframe, const MapperOptions& options,
                                  const std::function<bool()>& interrupt);

}  // namespace dmslam
