#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

/// For every match the share of its nearest matches (by uv0, at most `neighbors`, not itself, no farther than
/// about 1.5 * reach_px) whose flag is set; 1 where there is no neighbour.
std::vector<float> NeighborShares(std::span<const Match> matches, std::span<const uint8_t> flags,
                                  int neighbors, double reach_px);

}  // namespace dmslam
