#include "dmslam/mapping/local_adjustment.h"

#include <algorithm>

namespace dmslam {

MapAdjustmentReport AdjustLocally(MapEditor& map, const Keyframe& keyframe, const MapperOptions& options,
                                  const std::function<bool()>& interrupt) {
  std::vector<const Keyframe*> window =
      map.BestCovisible(keyframe, options.local_keyframes - 1, options.min_covisibility);
  window.push_back(&keyframe);
  std::ranges::sort(window, {}, &Keyframe::id);
  BundleOptions bundle;
  bundle.interrupt = interrupt;
  return AdjustKeyframes(map, window, options.local_fixed_keyframes, options.keypoint_sigma_px, bundle);
}

}  // namespace dmslam
