#pragma once

// What an angle or a share of the image is in pixels of a camera.

#include <algorithm>
#include <cmath>

#include "dmslam/camera/camera.h"

namespace dmslam {

/// One radian beside the optical axis is about so many pixels.
inline double FocalPx(const Camera& camera) { return 0.5 * (camera.fx_px + camera.fy_px); }
/// Half the side of a window in which a feature is searched for [px]: the angle by which its prediction may
/// be off, but never less than keypoints scatter around what they show, which is pixels with every camera.
inline double SearchRadiusPx(const Camera& camera, double angle_rad) {
  constexpr double kScatterPx = 2.5;
  return std::max(kScatterPx, angle_rad * FocalPx(camera));
}
inline double DiagonalPx(const Camera& camera) { return std::hypot(camera.width_px, camera.height_px); }

}  // namespace dmslam
