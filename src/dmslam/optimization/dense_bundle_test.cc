#include "dmslam/optimization/dense_bundle.h"

#include <gtest/gtest.h>

#include <limits>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/optimization/sparse_bundle.h"

namespace dmslam {
namespace {

using MakeSolver = std::unique_ptr<BundleSolver> (*)(const BundleOptions&, BundleState*);

/// Two poses are held, and two points.
BundleProblem Disturbed(uint64_t seed, double noise_px, int outlier_every = 0) {
  const SyntheticScene truth = MakeSyntheticScene(
      {.seed = seed, .num_cameras = 6, .num_points = 200, .noise_px = noise_px, .step = 0.25});
  Random random(seed + 10);
  BundleProblem problem;
  problem.camera = truth.camera;
  for (size_t k = 0; k < truth.T_cam_world.size(); ++k) {
    const Rigid3d& T = truth.T_cam_world[k];
    problem.T_cam_world.push_back(k < 2 ? T : RandomPose(random, 0.005, 0.02) * T);
  }
  for (const Eigen::Vector3d& p : truth.points) problem.points.push_back(p + RandomVector(random, 0.05));
  problem.point_fixed.assign(problem.points.size(), 0);
  problem.point_fixed[3] = problem.point_fixed[50] = 1;
  int k = 0;
  for (const SyntheticObservation& o : truth.observations) {
    BundleObservation seen{o.camera, o.point, o.uv_px, 0.5};
    if (outlier_every > 0 && ++k % outlier_every == 0)
      seen.uv_px += Eigen::Vector2d(random.Uniform(10, 40), random.Uniform(-40, 40));
    problem.observations.push_back(seen);
  }
  return problem;
}

/// One stage; every tenth observation is switched off.
std::vector<Rigid3d> PosesAfter(MakeSolver make, const BundleStage& stage, BundleProblem* problem) {
  const BundleOptions options;
  BundleState state{*problem, problem->T_cam_world, std::vector<char>(problem->T_cam_world.size(), 0),
                    std::vector<char>(problem->observations.size(), 1)};
  state.pose_held[0] = state.pose_held[1] = 1;
  const std::unique_ptr<BundleSolver> solver = make(options, &state);
  for (size_t i = 0; i < problem->observations.size(); i += 10) solver->Disable(i);
  EXPECT_TRUE(solver->Solve(stage).sound);
  return state.poses;
}

double FarthestApart(const std::vector<Rigid3d>& a, const std::vector<Rigid3d>& b) {
  double farthest = 0;
  for (size_t k = 0; k < a.size(); ++k) {
    farthest = std::max(farthest,
                        (a[k].Center() - b[k].Center()).norm() + AngleBetween(a[k].rotation, b[k].rotation));
  }
  return farthest;
}

TEST(DenseBundle, EndsWhereCeresEnds) {
  for (const bool cauchy : {false, true}) {
    for (const int outlier_every : {0, 7}) {
      for (uint64_t seed = 1; seed <= 5; ++seed) {
        BundleProblem dense = Disturbed(seed, 0.7, outlier_every), sparse = dense;
        const BundleStage stage{cauchy, 200, 1e-14};
        const std::vector<Rigid3d> a = PosesAfter(MakeDenseBundle, stage, &dense);
        const std::vector<Rigid3d> b = PosesAfter(MakeSparseBundle, stage, &sparse);
        EXPECT_LT(FarthestApart(a, b), 5e-4) << "seed " << seed << (cauchy ? ", Cauchy" : ", Huber");
        EXPECT_EQ(dense.points[3], sparse.points[3]);
      }
    }
  }
}

TEST(DenseBundle, InFewStepsItGetsAsFarAsCeres) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    BundleProblem dense = Disturbed(seed, 0.7, 7), sparse = dense;
    const BundleStage stage{false, 6, 1e-6};
    const std::vector<Rigid3d> a = PosesAfter(MakeDenseBundle, stage, &dense);
    const std::vector<Rigid3d> b = PosesAfter(MakeSparseBundle, stage, &sparse);
    EXPECT_LT(FarthestApart(a, b), 2e-3) << "seed " << seed;
  }
}

TEST(DenseBundle, APoseThatSeesNothingStaysAndTheOthersAreAdjusted) {
  BundleProblem problem = Disturbed(4, 0.5);
  BundleProblem with_blind = problem;
  const Rigid3d blind(Eigen::Quaterniond::Identity(), {1, 2, 3});
  with_blind.T_cam_world.push_back(blind);
  const BundleStage stage{false, 15, 1e-6};
  const std::vector<Rigid3d> expected = PosesAfter(MakeDenseBundle, stage, &problem);
  std::vector<Rigid3d> poses = PosesAfter(MakeDenseBundle, stage, &with_blind);
  EXPECT_EQ(poses.back().translation, blind.translation);
  poses.pop_back();
  EXPECT_LT(FarthestApart(poses, expected), 1e-9);
}

TEST(DenseBundle, WhatNobodySeesStaysAndWhatIsNotFiniteIsRefused) {
  BundleProblem problem = Disturbed(4, 0.5);
  problem.points.push_back({1, 2, 3});
  problem.point_fixed.push_back(0);
  PosesAfter(MakeDenseBundle, {false, 15, 1e-6}, &problem);
  EXPECT_EQ(problem.points.back(), Eigen::Vector3d(1, 2, 3));
  BundleProblem broken = Disturbed(1, 0.5);
  broken.points[7].x() = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Rigid3d> before = broken.T_cam_world;
  EXPECT_FALSE(AdjustBundle(GlobalBundleOptions(15), broken).usable);
  EXPECT_EQ(broken.T_cam_world[2].translation, before[2].translation);
}

}  // namespace
}  // namespace dmslam
