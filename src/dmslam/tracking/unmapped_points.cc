#include "dmslam/tracking/unmapped_points.h"

#include <utility>

#include "dmslam/triangulation/keyframe_points.h"

namespace dmslam {

namespace {

constexpr size_t kMostKeyframes = 16;  // a camera may be lost for hours in a map of thousands

}  // namespace

const std::vector<Landmark>& UnmappedPoints::Of(const Map& map, const Keyframe& keyframe) {
  if (const auto at = points_.find(keyframe.id); at != points_.end()) return at->second;
  if (points_.size() == kMostKeyframes) points_.clear();
  std::vector<Landmark>& points = points_[keyframe.id];
  TriangulationCounts counts;
  for (const KeyframePoint& shown :
       TriangulateKeyframe(map, keyframe, FreeFeatures(keyframe), TriangulationOptions(), &counts)) {
    Landmark point;
    point.map_id = keyframe.map_id;
    point.p_world = shown.p_world;
    point.descriptor = keyframe.features->set.descriptors[shown.feature];
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace dmslam
