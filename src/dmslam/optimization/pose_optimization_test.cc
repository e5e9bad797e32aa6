#include "dmslam/optimization/pose_optimization.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/reprojection.h"

namespace dmslam {
namespace {

const Pinhole kCamera = SyntheticScene().camera;

struct PoseData {
  Rigid3d T_cam_world;
  std::vector<PoseObservation> observations;
  std::vector<char> is_outlier;
};

PoseData DataOf(uint64_t seed, double noise_px, int outlier_every = 0) {
  const SyntheticScene scene =
      MakeSyntheticScene({.seed = seed, .num_cameras = 1, .num_points = 250, .noise_px = noise_px});
  PoseData data;
  data.T_cam_world = scene.T_cam_world[0];
  Random random(seed + 5);
  for (const auto& o : scene.observations) {
    const bool outlier = outlier_every > 0 && o.point % outlier_every == 0;
    PoseObservation observation{scene.points[static_cast<size_t>(o.point)], o.uv_px};
    if (outlier) observation.uv_px += Eigen::Vector2d(random.Uniform(10, 80), random.Uniform(-80, 80));
    data.observations.push_back(observation);
    data.is_outlier.push_back(outlier);
  }
  return data;
}

Rigid3d Disturbed(const Rigid3d& T, uint64_t seed) {
  Random random(seed);
  return RandomPose(random, 0.02, 0.05) * T;
}

TEST(Reprojection, PoseJacobianMatchesDifferences) {
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const Rigid3d T = RandomPose(random, 1.0, 1.0);
    const Eigen::Vector3d p_cam(random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(1, 6));
    const Eigen::Vector3d p_world = T.Inverse() * p_cam;
    const Matrix26 J = PoseJacobian(kCamera, p_cam);
    for (int c = 0; c < 6; ++c) {
      Vector6d d = Vector6d::Zero();
      d(c) = 1e-6;
      const Eigen::Vector2d slope =
          (kCamera.Project(StepPose(T, d) * p_world) - kCamera.Project(StepPose(T, -d) * p_world)) / 2e-6;
      EXPECT_LT((slope - J.col(c)).norm(), 1e-5 * (1.0 + J.col(c).norm()));
    }
    const Matrix23 P = ProjectionJacobian(kCamera, p_cam);
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d d = 1e-6 * Eigen::Vector3d::Unit(c);
      const Eigen::Vector2d slope = (kCamera.Project(p_cam + d) - kCamera.Project(p_cam - d)) / 2e-6;
      EXPECT_LT((slope - P.col(c)).norm(), 1e-5 * (1.0 + P.col(c).norm()));
    }
  }
}

TEST(PosePrior, JacobianMatchesDifferences) {
  Random random(2);
  for (int k = 0; k < 100; ++k) {
    const Rigid3d difference = RandomPose(random, k % 2 ? 0.8 : 1e-6, 1.0);
    const auto error = [](const Rigid3d& T) {
      Vector6d e;
      e << LogSo3(T.rotation), T.translation;
      return e;
    };
    const Matrix6d J = PosePriorJacobian(error(difference));
    for (int c = 0; c < 6; ++c) {
      Vector6d d = Vector6d::Zero();
      d(c) = 1e-6;
      const Vector6d slope = (error(StepPose(difference, d)) - error(StepPose(difference, -d))) / 2e-6;
      EXPECT_LT((slope - J.col(c)).norm(), 1e-7);
    }
  }
}

TEST(OptimizePose, ExactWithoutNoise) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const PoseData data = DataOf(seed, 0.0);
    const auto report = OptimizePose(kCamera, Disturbed(data.T_cam_world, seed), data.observations);
    ASSERT_TRUE(report.usable);
    EXPECT_EQ(report.num_inliers, static_cast<int>(data.observations.size()));
    EXPECT_LT(AngleBetween(report.T_cam_world.rotation, data.T_cam_world.rotation), 1e-7);
    EXPECT_LT((report.T_cam_world.translation - data.T_cam_world.translation).norm(), 1e-6);
  }
}

TEST(OptimizePose, OutliersAreNamed) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const PoseData data = DataOf(seed, 0.6, 3);
    const auto report = OptimizePose(kCamera, Disturbed(data.T_cam_world, seed), data.observations);
    ASSERT_TRUE(report.usable);
    EXPECT_LT(AngleBetween(report.T_cam_world.rotation, data.T_cam_world.rotation), 2e-3);
    int wrong = 0;
    for (size_t i = 0; i < data.is_outlier.size(); ++i) wrong += report.inliers[i] == data.is_outlier[i];
    EXPECT_LE(wrong, 5);
  }
}

TEST(OptimizePose, WeightZeroHasNoInfluence) {
  PoseData data = DataOf(3, 0.0);
  for (size_t i = 0; i < data.observations.size(); i += 2) {
    data.observations[i].uv_px.x() += 2.0;  // Still inliers.
    data.observations[i].weight = 0.0;
  }
  const auto report = OptimizePose(kCamera, Disturbed(data.T_cam_world, 3), data.observations);
  EXPECT_LT((report.T_cam_world.translation - data.T_cam_world.translation).norm(), 1e-6);
}

TEST(OptimizePose, InformationPredictsTheScatter) {
  double sum = 0.0;
  const int runs = 200;
  for (uint64_t k = 0; k < runs; ++k) {
    const PoseData data = DataOf(100 + k, 1.0);
    PoseOptimizationOptions options;
    options.max_chi2 = 100.0;
    const auto report = OptimizePose(kCamera, data.T_cam_world, data.observations, options);
    const Rigid3d difference = report.T_cam_world * data.T_cam_world.Inverse();
    Vector6d error;
    error << LogSo3(difference.rotation), difference.translation;
    sum += error.dot(report.information * error);
  }
  EXPECT_NEAR(sum / runs, 6.0, 1.0);  // Chi-square with six degrees of freedom.
}

TEST(OptimizePose, StrongPriorHoldsThePose) {
  const PoseData data = DataOf(4, 0.5);
  PoseOptimizationOptions options;
  const Rigid3d prior = Disturbed(data.T_cam_world, 8);
  options.prior = PosePrior{prior, 1e12 * Matrix6d::Identity()};
  options.max_chi2 = 1e9;
  const auto report = OptimizePose(kCamera, data.T_cam_world, data.observations, options);
  EXPECT_LT((report.T_cam_world.translation - prior.translation).norm(), 1e-4);
  EXPECT_LT(AngleBetween(report.T_cam_world.rotation, prior.rotation), 1e-4);
}

TEST(OptimizePose, TooFewObservationsLeaveThePose) {
  const PoseData data = DataOf(5, 0.5);
  const auto report = OptimizePose(kCamera, data.T_cam_world, std::span(data.observations).first(2));
  EXPECT_FALSE(report.usable);
  EXPECT_EQ(report.T_cam_world.translation, data.T_cam_world.translation);
  EXPECT_FALSE(OptimizePose(kCamera, data.T_cam_world, {}).usable);
}

TEST(OptimizePose, PointsBehindAreOutliers) {
  PoseData data = DataOf(6, 0.3);
  data.observations[0].p_world = data.T_cam_world.Inverse() * Eigen::Vector3d(0, 0, -3);
  const auto report = OptimizePose(kCamera, Disturbed(data.T_cam_world, 6), data.observations);
  ASSERT_TRUE(report.usable);
  EXPECT_EQ(report.inliers[0], 0);
  EXPECT_LT(AngleBetween(report.T_cam_world.rotation, data.T_cam_world.rotation), 2e-3);
}

TEST(OptimizePose, SameInputSameBytes) {
  const PoseData data = DataOf(7, 0.6, 4);
  const auto a = OptimizePose(kCamera, Disturbed(data.T_cam_world, 7), data.observations);
  const auto b = OptimizePose(kCamera, Disturbed(data.T_cam_world, 7), data.observations);
  EXPECT_EQ(std::memcmp(&a.T_cam_world, &b.T_cam_world, sizeof(double) * 7), 0);
  EXPECT_EQ(a.chi2, b.chi2);
}

}  // namespace
}  // namespace dmslam
