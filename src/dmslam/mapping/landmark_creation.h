#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/mapping/landmark_maker.h"
#include "dmslam/mapping/mapper_options.h"
#include "dmslam/triangulation/keyframe_points.h"

namespace dmslam {

/// How many candidates each test of Algorithm 1 refused.
struct CreationDiagnostics : TriangulationCounts {
  uint32_t refused_motion = 0;  ///< features of the keyframe that were free, and were seen to move
  uint32_t refused_neighbourhood = 0;
  uint32_t refused_count = 0;
  uint32_t created = 0;

  CreationDiagnostics& operator+=(const CreationDiagnostics& other);
};

/// DM-SLAM Algorithm 1: candidates for new landmarks of a keyframe from its best covisible keyframes.
/// `moving` lists features of the keyframe that were seen to move (sorted); none is made of them. A feature
/// is matched with every neighbour; its point comes from the pair with the widest parallax, and all pairs
/// that agree with it become its observations. Points seen in most views come first. Those confirmed by
/// enough views over enough time did not move: they are not counted among the candidates that exclude each
/// other (options; the paper has none such).
std::vector<KeyframePoint> ProposeLandmarks(const Map& map, const Keyframe& keyframe,
                                            const std::vector<uint16_t>& moving,
                                            const LandmarkCreationOptions& options,
                                            CreationDiagnostics* diagnostics);

/// Makes landmarks of these candidates. Where an earlier one of them has taken a candidate's feature in the
/// neighbour it was made with, it makes none.
void CreateLandmarks(MapEditor& map, const Keyframe& keyframe, const std::vector<uint16_t>& moving,
                     const LandmarkCreationOptions& options, LandmarkMaker& maker,
                     CreationDiagnostics* diagnostics);

}  // namespace dmslam
