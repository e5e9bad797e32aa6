#pragma once

#include <optional>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/map/conventions.h"
#include "dmslam/map/map.h"

namespace dmslam {

/// Errors of the relative pose of two keyframes that share a hundred landmarks (one sigma). With n of them
/// they are sqrt(100 / n) times as large. Several times what noise of pixels alone would make of it: errors
/// of neighbours are alike.
struct ChainDriftOptions {
  double link_rotation_rad = 0.0075;
  double link_position = 0.02;  ///< share of the median depth
  double link_log_scale = 0.0075;
  int min_shared = kMinCovisibility;  ///< fewer landmarks in common make no link, beside the spanning tree's
};

/// How far the relative pose of two keyframes may be off, one sigma each.
struct ChainDrift {
  double rotation_rad = 0;
  double position = 0;  ///< map units
  double log_scale = 0;
  int links = 0;
};

/// Follows the chain of keyframes with the least uncertainty from one to the other: links are landmarks in
/// common, loops that were closed among them, and the spanning tree. Each link turns, shifts and scales all
/// that comes after it a little, so a turn or a scale weighs more the farther away the end is. None where no
/// chain leads there, as between two maps.
std::optional<ChainDrift> DriftAlongChain(const Map& map, const Keyframe& from, const Keyframe& to,
                                          const ChainDriftOptions& options);

/// By how many sigmas a keyframe that the map has at `T_cam_world` would move to stand at `S_cam_world`: the
/// largest of position, rotation and scale.
double SigmasOf(const ChainDrift& drift, const Rigid3d& T_cam_world, const Sim3d& S_cam_world);

}  // namespace dmslam
