#pragma once

#include "dmslam/map/map_editor.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// Joins what is the same: landmarks of keyframe `id` are projected into its neighbours (20 best covisible
/// and 5 of each of theirs), and the neighbours' landmarks into it. A feature without a landmark becomes an
/// observation; two landmarks at one feature become one, the one with more observers. Returns how many
/// observations and fusions were made.
int FuseWithNeighbours(MapEditor& map, KeyframeId id, const MapperOptions& options);

/// Projects `landmarks` into keyframe `id` at `T_cam_world` and joins them with what its features see.
int FuseInto(MapEditor& map, KeyframeId id, const Rigid3d& T_cam_world,
             const std::vector<LandmarkId>& landmarks, double radius_px, const MapperOptions& options);

}  // namespace dmslam
