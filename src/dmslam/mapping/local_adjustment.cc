#include "dmslam/mapping/local_adjustment.h"

#include <algorithm>

namespace dmslam {

MapAdjustmentReport AdjustLocally(MapEditor& map, KeyframeId id, const MapperOptions& options,
                                  const std::function<bool()>& interrupt) {
  std::vector<KeyframeId> window =
      map.BestCovisible(id, options.local_keyframes - 1, options.min_covisibility);
  window.push_back(id);
  std::sort(window.begin(), window.end());
  BundleOptions bundle;
  bundle.interrupt = interrupt;
  return AdjustKeyframes(map, window, options.local_fixed_keyframes, options.keypoint_sigma_px, bundle);
}

}  // namespace dmslam
