#pragma once

#include "dmslam/camera/camera.h"

namespace dmslam {

/// A pinhole without distortion for tests: 640 x 480 pixels, the principal point in the middle.
inline Camera TestCamera(double focal_px = 500, double cx_px = 320, double cy_px = 240) {
  Camera camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = focal_px;
  camera.cx_px = cx_px;
  camera.cy_px = cy_px;
  return camera;
}

}  // namespace dmslam
