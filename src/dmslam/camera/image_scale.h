#pragma once

// What an angle or a share of the image is in pixels of a camera.

#include <cmath>

#include "dmslam/camera/camera.h"

namespace dmslam {

/// One radian beside the optical axis is about so many pixels.
inline double FocalPx(const Camera& camera) { return 0.5 * (camera.fx_px + camera.fy_px); }
inline double DiagonalPx(const Camera& camera) { return std::hypot(camera.width_px, camera.height_px); }

}  // namespace dmslam
