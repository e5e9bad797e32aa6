#pragma once

// Two views of a made-up room with movers, for the tests of this room.

#include <cstdint>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/motion_segmentation/match.h"
#include "dmslam/util/random.h"

namespace dmslam {

struct SyntheticPairOptions {
  int num_static = 500;
  int num_moving = 0;      ///< on one rigid mover in the middle of the picture
  int num_mismatches = 0;  ///< anywhere to anywhere
  double noise_px = 0.5;
  Eigen::Vector3d rotation = {0.01, 0.03, -0.01};
  Eigen::Vector3d translation = {0.15, 0.02, 0.05};   ///< of the camera: T_1_0
  Eigen::Vector3d mover_motion = {-0.10, 0.25, 0.1};  ///< in the world, between the frames
  bool flat = false;                                  ///< the whole room is one slanted plane
  double mover_half_width = 0.5;                      ///< of the mover, at depth 2
};

struct SyntheticPair {
  Camera camera;
  Rigid3d T_1_0;
  std::vector<Match> matches;
  std::vector<uint8_t> truth;  ///< 1 static, 0 moving or mismatch
};

inline Camera SyntheticCamera() { return TestCamera(525); }

namespace synthetic_pair_detail {

inline bool Inside(const Camera& camera, const Eigen::Vector2d& uv) {
  return uv.x() >= 0 && uv.y() >= 0 && uv.x() <= camera.width_px - 1 && uv.y() <= camera.height_px - 1;
}

/// Adds the match of a point that moves by `motion` between the frames, if both frames see it.
inline bool Add(const SyntheticPairOptions& options, const Eigen::Vector3d& point,
                const Eigen::Vector3d& motion, bool is_static, Random* random, SyntheticPair* pair) {
  const auto uv0 = pair->camera.Project(point), uv1 = pair->camera.Project(pair->T_1_0 * (point + motion));
  if (!uv0 || !uv1) return false;
  const auto noisy = [&](const Eigen::Vector2d& uv) -> Eigen::Vector2d {
    const double dx = options.noise_px * random->Gaussian(), dy = options.noise_px * random->Gaussian();
    return uv + Eigen::Vector2d(dx, dy);
  };
  Match match;
  match.uv0_px = noisy(*uv0);
  match.uv1_px = noisy(*uv1);
  if (!Inside(pair->camera, match.uv0_px) || !Inside(pair->camera, match.uv1_px)) return false;
  match.index0 = match.index1 = static_cast<uint32_t>(pair->matches.size());
  pair->matches.push_back(match);
  pair->truth.push_back(is_static ? 1 : 0);
  return true;
}

}  // namespace synthetic_pair_detail

inline SyntheticPair MakeSyntheticPair(const SyntheticPairOptions& options, uint64_t seed) {
  SyntheticPair pair;
  pair.camera = SyntheticCamera();
  pair.T_1_0 = Rigid3d(ExpSo3(options.rotation), options.translation);
  Random random(DeriveSeed(seed, 0, "synthetic-pair"));
  const auto camera = pair.camera;
  for (int k = 0; k < options.num_static;) {
    const Eigen::Vector3d ray = camera.Ray({random.Uniform(0, 639), random.Uniform(0, 479)});
    const bool behind_mover = options.num_moving > 0 && std::abs(ray.x()) < options.mover_half_width / 2 &&
                              std::abs(ray.y()) < options.mover_half_width / 2;
    const double depth =
        options.flat ? 3.0 / (1.0 + 0.2 * ray.x() + 0.3 * ray.y()) : random.Uniform(2.0, 5.0);
    if (behind_mover) continue;
    k += synthetic_pair_detail::Add(options, depth * ray, Eigen::Vector3d::Zero(), true, &random, &pair) ? 1
                                                                                                         : 0;
  }
  for (int k = 0; k < options.num_moving;) {
    const double half = options.mover_half_width;
    const Eigen::Vector3d point(random.Uniform(-half, half), random.Uniform(-half, half),
                                random.Uniform(1.8, 2.2));
    k += synthetic_pair_detail::Add(options, point, options.mover_motion, false, &random, &pair) ? 1 : 0;
  }
  for (int k = 0; k < options.num_mismatches; ++k) {
    Match match;
    match.uv0_px = {random.Uniform(0, 639), random.Uniform(0, 479)};
    match.uv1_px = {random.Uniform(0, 639), random.Uniform(0, 479)};
    match.index0 = match.index1 = static_cast<uint32_t>(pair.matches.size());
    pair.matches.push_back(match);
    pair.truth.push_back(0);
  }
  return pair;
}

}  // namespace dmslam
