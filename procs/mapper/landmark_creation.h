#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map.h"
#include "mapper/mapper_options.h"

namespace dmslam {

/// How many candidates each test of Algorithm 1 refused.
struct CreationDiagnostics {
  uint32_t matched = 0;
  uint32_t refused_parallax = 0;
  uint32_t refused_depth = 0;
  uint32_t refused_reprojection = 0;
  uint32_t refused_scale = 0;
  uint32_t refused_neighbourhood = 0;
  uint32_t refused_count = 0;
  uint32_t created = 0;

  CreationDiagnostics& operator+=(const CreationDiagnostics& other);
};

/// A new point, seen by a feature of the new keyframe and one of a neighbour.
struct NewLandmark {
  uint16_t feature = 0;
  KeyframeId neighbour;
  uint16_t neighbour_feature = 0;
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
};

/// Features of two keyframes that lie on each other's epipolar lines and look alike: pairs (feature of a, of b).
/// Features are ordered by the plane through both cameras in which their rays lie, so that only those near the same
/// plane are compared.
std::vector<std::pair<uint16_t, uint16_t>> MatchAlongEpipolarPlanes(const Keyframe& a, const std::vector<uint8_t>& use_a,
                                                                    const Keyframe& b, const std::vector<uint8_t>& use_b,
                                                                    const Map& map,
                                                                    const LandmarkCreationOptions& options);

/// DM-SLAM Algorithm 1: candidates for new landmarks of keyframe `id` from its best covisible keyframes. `moving` lists
/// features of the keyframe that were seen to move (sorted); none is made of them.
std::vector<NewLandmark> ProposeLandmarks(const Map& map, KeyframeId id, const std::vector<uint16_t>& moving,
                                          const LandmarkCreationOptions& options, CreationDiagnostics* diagnostics);

}  // namespace dmslam
