#pragma once

#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// Joins what is the same: landmarks of a keyframe are projected into its neighbours (20 best covisible and 5
/// of each of theirs, and those that look at the same place from nearby), and the neighbours' landmarks into
/// it. A feature without a landmark becomes an observation; two landmarks at one feature become one, the one
/// with more observers. Returns how many observations and fusions were made.
int FuseWithNeighbours(MapEditor& map, const Keyframe& keyframe, const MapperOptions& options);

/// Projects `landmarks` into a keyframe as if it stood at `T_cam_world`, and joins them with what its
/// features see. Those that are gone, that it sees already, or that are believed to move are passed over.
int FuseInto(MapEditor& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
             const std::vector<LandmarkId>& landmarks, const MapperOptions& options);

}  // namespace dmslam
