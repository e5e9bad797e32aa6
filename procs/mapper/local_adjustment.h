#pragma once

#include <functional>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/optimization/bundle_adjustment.h"
#include "mapper/mapper_options.h"

namespace dmslam {

struct LocalAdjustmentReport {
  BundleReport bundle;
  int keyframes = 0;
  int fixed_keyframes = 0;
  int landmarks = 0;
};

/// Bundle adjustment of a set of keyframes and of all landmarks they see, held in place by the other observers of those
/// landmarks. `sigma_px`: standard deviation of a keypoint of octave 0. Results and outliers are written into the map; landmarks left with fewer than two observers are removed.
LocalAdjustmentReport AdjustKeyframes(Map& map, const std::vector<KeyframeId>& window, int max_fixed,
                                      double sigma_px, const BundleOptions& options);

/// The window around keyframe `id`: itself and its best covisible keyframes.
LocalAdjustmentReport AdjustLocally(Map& map, KeyframeId id, const MapperOptions& options,
                                    const std::function<bool()>& interrupt);

/// All keyframes and landmarks of a map, the first keyframe held.
LocalAdjustmentReport AdjustWholeMap(Map& map, MapId map_id, int iterations, double sigma_px,
                                     const std::function<bool()>& interrupt);

}  // namespace dmslam
