#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/util/random.h"

namespace dmslam {

/// A made-up path of `poses` poses at 30 Hz for tests, with Gaussian noise of `noise` metres and radians.
inline std::vector<StampedPose> WavyPath(int poses, double noise, uint64_t seed) {
  Random random(seed);
  std::vector<StampedPose> path;
  for (int i = 0; i < poses; ++i) {
    const double t = i / 30.0;
    const Eigen::Vector3d jitter(random.Gaussian(), random.Gaussian(), random.Gaussian());
    path.push_back(
        {i * 33'333'000LL, Rigid3d(ExpSo3({0.1 * t, 0, noise * random.Gaussian()}),
                                   Eigen::Vector3d(std::sin(t), std::cos(t), 0.2 * t) + noise * jitter)});
  }
  return path;
}

}  // namespace dmslam
