#include "dmslam/optimization/few_views_adjustment.h"

#include <gtest/gtest.h>

#include <limits>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// A first map that is not adjusted yet: the first camera stands at the origin.
BundleProblem Disturbed(uint64_t seed, double noise_px, int outlier_every = 0) {
  const SyntheticScene truth = MakeSyntheticScene(
      {.seed = seed, .num_cameras = 6, .num_points = 200, .noise_px = noise_px, .step = 0.25});
  Random random(seed + 10);
  BundleProblem problem;
  problem.camera = truth.camera;
  const Rigid3d T_world_first = truth.T_cam_world.front().Inverse();
  for (size_t k = 0; k < truth.T_cam_world.size(); ++k) {
    const Rigid3d T = truth.T_cam_world[k] * T_world_first;
    problem.T_cam_world.push_back(k == 0 ? T : RandomPose(random, 0.005, 0.02) * T);
  }
  for (const Eigen::Vector3d& p : truth.points)
    problem.points.push_back(T_world_first.Inverse() * p + RandomVector(random, 0.05));
  int k = 0;
  for (const SyntheticObservation& o : truth.observations) {
    BundleObservation seen{o.camera, o.point, o.uv_px, 0.5};
    if (outlier_every > 0 && ++k % outlier_every == 0)
      seen.uv_px += Eigen::Vector2d(random.Uniform(10, 40), random.Uniform(-40, 40));
    problem.observations.push_back(seen);
  }
  return problem;
}

BundleOptions Thorough() {
  BundleOptions options = GlobalBundleOptions(60);
  options.relative_tolerance = 1e-14;
  return options;
}

/// Half the sum of Huber's losses.
double CostOf(BundleProblem problem) { return AdjustBundle(GlobalBundleOptions(0), problem).initial_cost; }

double FarthestApart(const BundleProblem& a, const BundleProblem& b) {
  double farthest = 0;
  for (size_t k = 0; k < a.T_cam_world.size(); ++k) {
    farthest = std::max(farthest, (a.T_cam_world[k].Center() - b.T_cam_world[k].Center()).norm() +
                                      AngleBetween(a.T_cam_world[k].rotation, b.T_cam_world[k].rotation));
  }
  for (size_t i = 0; i < a.points.size(); ++i)
    farthest = std::max(farthest, (a.points[i] - b.points[i]).norm());
  return farthest;
}

TEST(AdjustFewViews, EndsWhereTheAdjustmentOfAMapEnds) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    BundleProblem few = Disturbed(seed, 0.7), map = few;
    ASSERT_TRUE(AdjustFewViews(Thorough(), &few));
    ASSERT_TRUE(AdjustBundle(Thorough(), map).usable);
    EXPECT_LT(FarthestApart(few, map), 1e-4) << "seed " << seed;
  }
}

TEST(AdjustFewViews, InAsFewStepsItGetsAsFarAlsoBesideOutliers) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    BundleProblem few = Disturbed(seed, 0.7, 7), map = few;
    ASSERT_TRUE(AdjustFewViews(GlobalBundleOptions(15), &few));
    AdjustBundle(GlobalBundleOptions(15), map);
    EXPECT_LT(CostOf(few), 1.002 * CostOf(map)) << "seed " << seed;
  }
}

TEST(AdjustFewViews, TheFirstCameraStaysAndTheFarthestKeepsItsDistance) {
  BundleProblem problem = Disturbed(3, 0.5);
  const BundleProblem before = problem;
  ASSERT_TRUE(AdjustFewViews(GlobalBundleOptions(15), &problem));
  EXPECT_EQ(problem.T_cam_world[0].translation, before.T_cam_world[0].translation);
  EXPECT_EQ(problem.T_cam_world[0].rotation.coeffs(), before.T_cam_world[0].rotation.coeffs());
  const auto farthest = [](const BundleProblem& p) { return p.T_cam_world.back().Center().norm(); };
  EXPECT_NEAR(farthest(problem), farthest(before), 1e-9);
  EXPECT_GT(FarthestApart(problem, before), 1e-3);
}

TEST(AdjustFewViews, APointThatNobodySeesOrThatLiesBehindStays) {
  BundleProblem problem = Disturbed(4, 0.5);
  problem.points.push_back({1, 2, 3});
  problem.points.push_back({0, 0, -3});
  const int behind = static_cast<int>(problem.points.size()) - 1;
  for (const int pose : {0, 2, 4}) problem.observations.push_back({pose, behind, {320, 240}, 1.0});
  BundleProblem without = Disturbed(4, 0.5);
  ASSERT_TRUE(AdjustFewViews(Thorough(), &problem));
  ASSERT_TRUE(AdjustFewViews(Thorough(), &without));
  for (size_t k = 0; k < without.T_cam_world.size(); ++k)
    EXPECT_LT((problem.T_cam_world[k].Center() - without.T_cam_world[k].Center()).norm(), 1e-9);
}

TEST(AdjustFewViews, RefusesWhatCannotBeAdjusted) {
  BundleProblem empty;
  EXPECT_FALSE(AdjustFewViews(GlobalBundleOptions(15), &empty));
  BundleProblem broken = Disturbed(1, 0.5);
  broken.points[7].x() = std::numeric_limits<double>::quiet_NaN();
  const Rigid3d before = broken.T_cam_world[2];
  EXPECT_FALSE(AdjustFewViews(GlobalBundleOptions(15), &broken));
  EXPECT_EQ(broken.T_cam_world[2].translation, before.translation);
  BundleProblem wrong = Disturbed(1, 0.5);
  wrong.observations.front().pose = 99;
  EXPECT_THROW(AdjustFewViews(GlobalBundleOptions(15), &wrong), InvariantError);
}

}  // namespace
}  // namespace dmslam
