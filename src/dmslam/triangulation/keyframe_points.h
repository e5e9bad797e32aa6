#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dmslam/map/map.h"
#include "dmslam/triangulation/triangulation_options.h"

namespace dmslam {

/// Matches between keyframes, and how many each test refused.
struct TriangulationCounts {
  uint32_t matched = 0;
  uint32_t refused_parallax = 0;
  uint32_t refused_depth = 0;
  uint32_t refused_reprojection = 0;
  uint32_t refused_scale = 0;
};

struct NeighbourFeature {
  const Keyframe* keyframe = nullptr;
  uint16_t feature = 0;
};

/// A point that is no landmark: a feature of a keyframe shows it, and one of each of its neighbours named
/// (one at least).
struct KeyframePoint {
  uint16_t feature = 0;
  std::vector<NeighbourFeature> seen_by;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  int64_t span_ns = 0;  ///< between the first and the last of these views
};

/// An entry per feature of a keyframe: 1 where it shows no landmark.
std::vector<uint8_t> FreeFeatures(const Keyframe& keyframe);

/// What those features of a keyframe with an entry in `use` show together with the free ones of its best
/// covisible keyframes; by feature. A feature is matched with every neighbour; its point comes from the pair
/// with the widest parallax, and all pairs that agree with it are named.
std::vector<KeyframePoint> TriangulateKeyframe(const Map& map, const Keyframe& keyframe,
                                               const std::vector<uint8_t>& use,
                                               const TriangulationOptions& options,
                                               TriangulationCounts* counts);

}  // namespace dmslam
