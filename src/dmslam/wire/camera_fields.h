#pragma once

namespace dmslam::wire {

/// The camera's values, which several messages hold under the same names.
void CameraFields(auto& s, auto& camera, auto& w) {
  s(camera.width_px, w.width_px);
  s(camera.height_px, w.height_px);
  s(camera.fx_px, w.fx_px);
  s(camera.fy_px, w.fy_px);
  s(camera.cx_px, w.cx_px);
  s(camera.cy_px, w.cy_px);
  s(camera.k1, w.k1);
  s(camera.k2, w.k2);
  s(camera.p1, w.p1);
  s(camera.p2, w.p2);
  s(camera.k3, w.k3);
  s(camera.fps, w.fps);
  s(camera.lens, w.lens);
  s(camera.k4, w.k4);
}

}  // namespace dmslam::wire
