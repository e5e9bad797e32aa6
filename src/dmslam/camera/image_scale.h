#pragma once

// What an angle or a share of the image is in pixels of a camera.

#include <algorithm>
#include <cmath>

#include "dmslam/camera/camera.h"

namespace dmslam {

/// One radian beside the optical axis is about so many pixels.
inline double FocalPx(const Camera& camera) { return 0.5 * (camera.fx_px + camera.fy_px); }
/// Size of the pixels in which features are found [px of the image]. A corner and its descriptor take as many
/// pixels in a small image as in a large one, so that a small one has few features. It is enlarged first, to
/// twice its size at most. 1 from 640 x 480 on, where less than a tenth would be gained, and without a size.
inline double FinestPx(int width_px, int height_px) {
  constexpr double kEnoughPixels = 640.0 * 480.0, kMostEnlarged = 2.0, kWorthwhile = 1.1;
  const double pixels = static_cast<double>(width_px) * height_px;
  if (pixels <= 0) return 1.0;
  const double enlarged = std::min(kMostEnlarged, std::sqrt(kEnoughPixels / pixels));
  return enlarged < kWorthwhile ? 1.0 : 1.0 / enlarged;
}
/// Half the side of a window in which a feature is searched for [px]: the angle by which its prediction may
/// be off, but never less than keypoints scatter around what they show, which is pixels of the finest level
/// with every camera.
inline double SearchRadiusPx(const Camera& camera, double angle_rad) {
  constexpr double kScatter = 2.5;  // pixels of the finest level
  return std::max(kScatter * FinestPx(camera.width_px, camera.height_px), angle_rad * FocalPx(camera));
}
inline double DiagonalPx(const Camera& camera) { return std::hypot(camera.width_px, camera.height_px); }

}  // namespace dmslam
