#pragma once

#include <cmath>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// A smooth, curved path at 30 Hz, the camera turning as it goes.
inline std::vector<StampedPose> CurvedPath(size_t poses) {
  std::vector<StampedPose> path;
  for (size_t i = 0; i < poses; ++i) {
    const double t = static_cast<double>(i) / 30.0;
    const Eigen::Vector3d position(std::sin(t), 0.7 * std::cos(1.3 * t), 0.2 * t);
    const Eigen::Quaterniond rotation = ExpSo3(Eigen::Vector3d(0.3 * t, 0.2 * std::sin(t), -0.1 * t));
    path.push_back({1'000'000'000 + static_cast<int64_t>(i) * 33'333'333, Rigid3d(rotation, position)});
  }
  return path;
}

/// The trajectory as seen from another world: `world_from_old` applied to every pose.
inline std::vector<StampedPose> Transformed(std::vector<StampedPose> path, const Sim3d& world_from_old) {
  for (StampedPose& pose : path) {
    pose.T_world_cam.translation = world_from_old * pose.T_world_cam.translation;
    pose.T_world_cam.rotation = world_from_old.rotation * pose.T_world_cam.rotation;
  }
  return path;
}

inline std::vector<StampedPose> WithNoise(std::vector<StampedPose> path, double sigma, uint64_t seed) {
  Random random(seed);
  for (StampedPose& pose : path) {
    for (int axis = 0; axis < 3; ++axis) pose.T_world_cam.translation[axis] += sigma * random.Gaussian();
  }
  return path;
}

}  // namespace dmslam
