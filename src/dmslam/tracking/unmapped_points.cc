#include "dmslam/tracking/unmapped_points.h"

#include <utility>

#include "dmslam/triangulation/keyframe_points.h"

namespace dmslam {

const std::vector<Landmark>& UnmappedPoints::Of(const Map& map, const Keyframe& keyframe) {
  const auto [at, is_new] = points_.try_emplace(keyframe.id);
  if (!is_new) return at->second;
  TriangulationCounts counts;
  for (const KeyframePoint& shown :
       TriangulateKeyframe(map, keyframe, FreeFeatures(keyframe), TriangulationOptions(), &counts)) {
    Landmark point;
    point.map_id = keyframe.map_id;
    point.p_world = shown.p_world;
    point.descriptor = keyframe.features->set.descriptors[shown.feature];
    at->second.push_back(std::move(point));
  }
  return at->second;
}

}  // namespace dmslam
