#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/map_editor.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// What was found to be the same.
struct FusionCounts {
  int64_t landmarks = 0;     ///< that became part of others
  int64_t observations = 0;  ///< new ones: of features that had no landmark

  FusionCounts& operator+=(const FusionCounts& more) {
    landmarks += more.landmarks;
    observations += more.observations;
    return *this;
  }
  bool operator==(const FusionCounts&) const = default;
};

/// Joins what is the same: landmarks of a keyframe are projected into its neighbours (20 best covisible and 5
/// of each of theirs, and those that look at the same place from nearby), and the neighbours' landmarks into
/// it. A feature without a landmark becomes an observation; two landmarks at one feature become one, the one
/// with more observers.
FusionCounts FuseWithNeighbours(MapEditor& map, const Keyframe& keyframe, const MapperOptions& options);

/// Projects `landmarks` into a keyframe as if it stood at `T_cam_world`, and joins them with what its
/// features see. Those that are gone, that it sees already, or that are believed to move are passed over.
FusionCounts FuseInto(MapEditor& map, const Keyframe& keyframe, const Rigid3d& T_cam_world,
                      const std::vector<LandmarkId>& landmarks, const MapperOptions& options);

}  // namespace dmslam
