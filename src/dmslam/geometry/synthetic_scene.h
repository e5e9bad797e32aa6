#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "dmslam/geometry/pinhole.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// Scenes for tests: cameras on an arc around a cloud of points, and what they see. World and camera units
/// are arbitrary.
struct SyntheticSceneOptions {
  uint64_t seed = 1;
  int num_cameras = 2;
  int num_points = 100;
  double noise_px = 0.0;      ///< Standard deviation of every pixel coordinate.
  double step = 0.25;         ///< Distance of neighbouring cameras.
  double depth = 4.0;         ///< Of the cloud's middle, from the cameras.
  double thickness = 4.0;     ///< Of the cloud along the view; 0 makes it a (slanted) plane.
  double rotation_rad = 0.1;  ///< Size of the random part of the cameras' rotation.
};

struct SyntheticObservation {
  int camera = 0;
  int point = 0;
  Eigen::Vector2d uv_px = Eigen::Vector2d::Zero();
};

struct SyntheticScene {
  static constexpr double kWidth = 640.0, kHeight = 480.0;
  Pinhole camera{525.0, 525.0, 319.5, 239.5};
  std::vector<Rigid3d> T_cam_world;
  std::vector<Eigen::Vector3d> points;
  std::vector<SyntheticObservation> observations;  ///< Inside the image; ordered by camera, then point.
};

inline Eigen::Vector3d RandomVector(Random& random, double size) {
  const double x = random.Uniform(-size, size), y = random.Uniform(-size, size),
               z = random.Uniform(-size, size);
  return {x, y, z};
}

inline Rigid3d RandomPose(Random& random, double rotation_rad, double translation) {
  const Eigen::Vector3d w = RandomVector(random, rotation_rad);
  return {ExpSo3(w), RandomVector(random, translation)};
}

inline Eigen::Vector3d RandomScenePoint(Random& random, const SyntheticSceneOptions& options) {
  const double x = random.Uniform(-1.0, 1.0), y = random.Uniform(-1.0, 1.0),
               along = random.Uniform(-0.5, 0.5);
  const double slant = options.thickness == 0.0 ? 0.3 * x + 0.2 * y : 0.0;
  const double z = options.depth * (1.0 + slant) + options.thickness * along;
  return {0.6 * x * options.depth, 0.45 * y * options.depth, z};
}

inline SyntheticScene MakeSyntheticScene(const SyntheticSceneOptions& options) {
  SyntheticScene scene;
  Random random(options.seed);
  for (int c = 0; c < options.num_cameras; ++c) {
    const double along = options.step * (c - 0.5 * (options.num_cameras - 1));
    const double z = 0.2 * options.step * random.Gaussian(), y = 0.3 * options.step * random.Gaussian();
    const Eigen::Vector3d center(along, y, z);
    // Turned towards the middle of the cloud, and a little beside it.
    const Eigen::Vector3d towards(0.0, -std::atan2(-along, options.depth), 0.0);
    const Eigen::Quaterniond rotation = ExpSo3(RandomVector(random, options.rotation_rad)) * ExpSo3(towards);
    scene.T_cam_world.emplace_back(rotation, rotation * -center);
  }
  for (int p = 0; p < options.num_points; ++p) scene.points.push_back(RandomScenePoint(random, options));
  for (int c = 0; c < options.num_cameras; ++c) {
    for (int p = 0; p < options.num_points; ++p) {
      const Eigen::Vector3d p_cam =
          scene.T_cam_world[static_cast<size_t>(c)] * scene.points[static_cast<size_t>(p)];
      if (p_cam.z() < 0.1) continue;
      Eigen::Vector2d uv = scene.camera.Project(p_cam);
      uv.x() += options.noise_px * random.Gaussian();
      uv.y() += options.noise_px * random.Gaussian();
      if (uv.x() < 0 || uv.y() < 0 || uv.x() > SyntheticScene::kWidth || uv.y() > SyntheticScene::kHeight)
        continue;
      scene.observations.push_back({c, p, uv});
    }
  }
  return scene;
}

/// The points that both of two cameras see, as parallel arrays.
struct SyntheticViews {
  Rigid3d T_cam2_cam1;
  std::vector<int> points;  ///< Index into the scene's points.
  std::vector<Eigen::Vector2d> x1_px, x2_px;
  std::vector<Eigen::Vector3d> rays1, rays2;  ///< z = 1.
};

inline SyntheticViews MakeSyntheticViews(const SyntheticScene& scene, int camera1 = 0, int camera2 = 1) {
  SyntheticViews pair;
  pair.T_cam2_cam1 = scene.T_cam_world[static_cast<size_t>(camera2)] *
                     scene.T_cam_world[static_cast<size_t>(camera1)].Inverse();
  std::vector<const SyntheticObservation*> seen(scene.points.size(), nullptr);
  for (const auto& o : scene.observations) {
    if (o.camera == camera1) seen[static_cast<size_t>(o.point)] = &o;
  }
  for (const auto& o : scene.observations) {
    const SyntheticObservation* first = seen[static_cast<size_t>(o.point)];
    if (o.camera != camera2 || first == nullptr) continue;
    pair.points.push_back(o.point);
    pair.x1_px.push_back(first->uv_px);
    pair.x2_px.push_back(o.uv_px);
    pair.rays1.push_back(scene.camera.Ray(first->uv_px));
    pair.rays2.push_back(scene.camera.Ray(o.uv_px));
  }
  return pair;
}

}  // namespace dmslam
