#pragma once

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/bundle_adjustment.h"

namespace dmslam {

/// Every point is seen by a run of `views` neighbouring keyframes; the first two keyframes are held.
inline BundleProblem MakeLocalBundle(int num_keyframes, int num_points, int views) {
  SyntheticScene scene = MakeSyntheticScene(
      {.seed = 3, .num_cameras = num_keyframes, .num_points = num_points, .noise_px = 0.7, .step = 0.08});
  BundleProblem problem;
  Random random(4);
  problem.camera = scene.camera;
  for (int i = 0; i < num_keyframes; ++i) {
    const Rigid3d& T = scene.T_cam_world[static_cast<size_t>(i)];
    problem.T_cam_world.push_back(i < 2 ? T : RandomPose(random, 0.003, 0.01) * T);
    problem.pose_fixed.push_back(i < 2);
  }
  for (const auto& p : scene.points) problem.points.push_back(p + RandomVector(random, 0.03));
  for (const auto& o : scene.observations) {
    const int first = o.point % (num_keyframes - views + 1);
    if (o.camera < first || o.camera >= first + views) continue;
    BundleObservation observation{o.camera, o.point, o.uv_px, 1.0};
    if (random.Below(25) == 0) observation.uv_px += Eigen::Vector2d(15, -10);
    problem.observations.push_back(observation);
  }
  return problem;
}

}  // namespace dmslam
