#include "dmslam/optimization/sim3_optimization.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/sim3_cost.h"

namespace dmslam {
namespace {

const Pinhole kCamera = SyntheticScene().camera;

struct Sim3Data {
  Sim3d S_12;
  std::vector<Sim3Match> matches;
  std::vector<char> is_outlier;
};

/// Camera 2 has its own scale: a drifted map.
Sim3Data DataOf(uint64_t seed, double noise_px, double point_noise, int outlier_every = 0) {
  const SyntheticScene scene = MakeSyntheticScene({.seed = seed, .num_points = 150, .noise_px = noise_px});
  const SyntheticViews pair = MakeSyntheticViews(scene);
  Random random(seed + 20);
  const double scale = random.Uniform(0.5, 2.0);
  Sim3Data data;
  const Rigid3d T_12 = pair.T_cam2_cam1.Inverse();
  data.S_12 = {T_12.rotation, T_12.translation, 1.0 / scale};
  for (size_t i = 0; i < pair.points.size(); ++i) {
    const Eigen::Vector3d p_world = scene.points[static_cast<size_t>(pair.points[i])];
    Sim3Match match;
    match.p_cam1 = scene.T_cam_world[0] * p_world + RandomVector(random, point_noise);
    match.p_cam2 = scale * (scene.T_cam_world[1] * p_world + RandomVector(random, point_noise));
    match.uv1_px = pair.x1_px[i];
    match.uv2_px = pair.x2_px[i];
    const bool outlier = outlier_every > 0 && static_cast<int>(i) % outlier_every == 0;
    if (outlier) match.p_cam1 += RandomVector(random, 1.0) + Eigen::Vector3d(0.5, 0, 0);
    data.matches.push_back(match);
    data.is_outlier.push_back(outlier);
  }
  return data;
}

double Distance(const Sim3d& a, const Sim3d& b) { return LogSim3(a * b.Inverse()).norm(); }

TEST(Sim3Cost, JacobiansMatchDifferences) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Sim3Data data = DataOf(seed, 1.0, 0.05);
    for (size_t i = 0; i < 5; ++i) {
      const Sim3Match& m = data.matches[i];
      for (const auto& side : {Sim3ErrorInFirst, Sim3ErrorInSecond}) {
        const Sim3SideError at = side(kCamera, data.S_12, m);
        for (int c = 0; c < 7; ++c) {
          Vector7d d = Vector7d::Zero();
          d(c) = 1e-6;
          const Eigen::Vector2d slope = (side(kCamera, StepSim3(data.S_12, d), m).error -
                                         side(kCamera, StepSim3(data.S_12, -d), m).error) /
                                        2e-6;
          EXPECT_LT((slope - at.jacobian.col(c)).norm(), 1e-4 * (1.0 + slope.norm()));
        }
      }
    }
  }
}

TEST(EstimateSim3Ransac, FindsTheSimilarityAmongOutliers) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Sim3Data data = DataOf(seed, 0.5, 0.01, 3);
    const Sim3Report report = EstimateSim3Ransac(kCamera, kCamera, data.matches, {.seed = seed});
    ASSERT_TRUE(report.success);
    EXPECT_LT(Distance(report.S_cam1_cam2, data.S_12), 0.05);
    for (size_t i = 0; i < data.matches.size(); ++i) {
      if (data.is_outlier[i]) {
        EXPECT_EQ(report.inliers[i], 0) << i;
      }
    }
  }
}

TEST(EstimateSim3Ransac, NoiseAloneIsNoSuccess) {
  Random random(4);
  std::vector<Sim3Match> matches;
  for (int i = 0; i < 60; ++i) {
    Sim3Match m;
    m.p_cam1 = Eigen::Vector3d(0, 0, 4) + RandomVector(random, 1.5);
    m.p_cam2 = Eigen::Vector3d(0, 0, 4) + RandomVector(random, 1.5);
    m.uv1_px = kCamera.Project(m.p_cam1);
    m.uv2_px = kCamera.Project(m.p_cam2);
    matches.push_back(m);
  }
  EXPECT_FALSE(EstimateSim3Ransac(kCamera, kCamera, matches, {}).success);
  EXPECT_FALSE(EstimateSim3Ransac(kCamera, kCamera, {}, {}).success);
}

TEST(OptimizeSim3, ExactWithoutNoise) {
  Random random(5);
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Sim3Data data = DataOf(seed, 0.0, 0.0);
    Vector7d step;
    step << RandomVector(random, 0.01), RandomVector(random, 0.03), 0.03;
    const Sim3Report report = OptimizeSim3(kCamera, kCamera, data.matches, StepSim3(data.S_12, step));
    ASSERT_TRUE(report.success);
    EXPECT_LT(Distance(report.S_cam1_cam2, data.S_12), 1e-6);
    EXPECT_EQ(report.num_inliers, static_cast<int>(data.matches.size()));
  }
}

TEST(OptimizeSim3, OutliersAreNamedAndTheEstimateImproves) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    const Sim3Data data = DataOf(seed, 0.5, 0.01, 3);
    const Sim3Report start = EstimateSim3Ransac(kCamera, kCamera, data.matches, {.seed = seed});
    const Sim3Report report = OptimizeSim3(kCamera, kCamera, data.matches, start.S_cam1_cam2);
    ASSERT_TRUE(report.success);
    EXPECT_LT(Distance(report.S_cam1_cam2, data.S_12), 0.03);
    EXPECT_GE(report.num_inliers, start.num_inliers - 3);
  }
}

TEST(OptimizeSim3, FixedScaleStays) {
  const Sim3Data data = DataOf(6, 0.5, 0.01);
  Sim3d start = data.S_12;
  start.scale = 1.0;
  const Sim3Report report = OptimizeSim3(kCamera, kCamera, data.matches, start, {.fix_scale = true});
  EXPECT_EQ(report.S_cam1_cam2.scale, 1.0);
}

TEST(OptimizeSim3, SameInputSameBytes) {
  const Sim3Data data = DataOf(7, 0.5, 0.01, 4);
  const Sim3Report a = EstimateSim3Ransac(kCamera, kCamera, data.matches, {.seed = 1});
  const Sim3Report b = EstimateSim3Ransac(kCamera, kCamera, data.matches, {.seed = 1});
  EXPECT_EQ(std::memcmp(&a.S_cam1_cam2, &b.S_cam1_cam2, sizeof(double) * 8), 0);
  const Sim3Report c = OptimizeSim3(kCamera, kCamera, data.matches, a.S_cam1_cam2);
  const Sim3Report d = OptimizeSim3(kCamera, kCamera, data.matches, b.S_cam1_cam2);
  EXPECT_EQ(std::memcmp(&c.S_cam1_cam2, &d.S_cam1_cam2, sizeof(double) * 8), 0);
}

}  // namespace
}  // namespace dmslam
