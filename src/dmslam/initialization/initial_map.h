#pragma once

#include "dmslam/geometry/pinhole.h"
#include "dmslam/initialization/initializer.h"
#include "dmslam/map/proposals.h"

namespace dmslam {

/// The bundle adjustment that the initialiser asks for.
AdjustFunction AdjustInitialMap(const Pinhole& camera);

/// A first map as the frontend's stream tells it.
InitialMap MakeInitialMap(const FirstMap& first_map, uint32_t session, CameraId camera_id, MapId map_id);

}  // namespace dmslam
