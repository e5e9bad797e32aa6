#pragma once

#include <functional>
#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {

struct MapAdjustmentReport {
  BundleReport bundle;
  int keyframes = 0;
  int fixed_keyframes = 0;
  int landmarks = 0;
};

/// Bundle adjustment of a set of keyframes and of all landmarks they see, held in place by the other
/// observers of those landmarks (at most `max_fixed`). `sigma_px`: standard deviation of a keypoint
/// [pixels of its level]. Results are written into the map, observations that do not fit are cleared, and
/// landmarks left with fewer than two observers are removed.
MapAdjustmentReport AdjustKeyframes(MapEditor& map, const std::vector<const Keyframe*>& keyframes,
                                    int max_fixed, double sigma_px, const BundleOptions& options);

/// All keyframes and landmarks of a map, the first keyframe held.
MapAdjustmentReport AdjustWholeMap(MapEditor& map, MapId map_id, int iterations, double sigma_px,
                                   const std::function<bool()>& interrupt);

}  // namespace dmslam
