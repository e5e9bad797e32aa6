#include "dmslam/geometry/similarity.h"

#include <gtest/gtest.h>

#include <vector>

#include "dmslam/geometry/synthetic_scene.h"

namespace dmslam {
namespace {

Sim3d RandomSim3(Random& random, double rotation_rad = 1.5) {
  const Rigid3d T = RandomPose(random, rotation_rad, 3.0);
  return {T.rotation, T.translation, random.Uniform(0.3, 3.0)};
}

Vector7d RandomTangent(Random& random, double rotation_rad, double log_scale) {
  Vector7d x;
  x << RandomVector(random, rotation_rad), RandomVector(random, 2.0), random.Uniform(-log_scale, log_scale);
  return x;
}

double Distance(const Sim3d& a, const Sim3d& b) {
  return AngleBetween(a.rotation, b.rotation) + (a.translation - b.translation).norm() +
         std::abs(a.scale - b.scale);
}

TEST(AlignSim3, RecoversTheSimilarity) {
  Random random(1);
  for (int k = 0; k < 200; ++k) {
    const Sim3d truth = RandomSim3(random);
    std::vector<Eigen::Vector3d> a, b;
    for (int i = 0; i < 3 + k % 10; ++i)
      a.push_back(RandomVector(random, 2.0)), b.push_back(truth * a.back());
    const auto S = AlignSim3(a, b);
    ASSERT_TRUE(S.has_value());
    EXPECT_LT(Distance(*S, truth), 1e-8);
  }
}

TEST(AlignSim3, IndicesSelectAndScaleCanBeFixed) {
  Random random(2);
  const Rigid3d T = RandomPose(random, 1.0, 2.0);
  std::vector<Eigen::Vector3d> a, b;
  for (int i = 0; i < 10; ++i) a.push_back(RandomVector(random, 2.0)), b.push_back(T * a.back());
  b[0] += Eigen::Vector3d(5, 5, 5);
  const std::vector<int> indices{1, 2, 3, 4, 9};
  const auto S = AlignSim3(a, b, indices, true);
  ASSERT_TRUE(S.has_value());
  EXPECT_EQ(S->scale, 1.0);
  EXPECT_LT(Distance(*S, Sim3d(T)), 1e-9);
}

TEST(AlignSim3, CollinearPointsGiveNothing) {
  const std::vector<Eigen::Vector3d> a{{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
  EXPECT_FALSE(AlignSim3(a, a).has_value());
  EXPECT_FALSE(AlignSim3(std::span(a).first(2), std::span(a).first(2)).has_value());
}

TEST(Sim3Group, LogIsInverseOfExp) {
  Random random(3);
  for (int k = 0; k < 1000; ++k) {
    const double rotation = k % 4 == 0 ? 1e-7 : k % 4 == 1 ? 0.06 : 1.7;
    const Vector7d x = RandomTangent(random, rotation, k % 3 == 0 ? 1e-9 : 1.0);
    EXPECT_LT((LogSim3(ExpSim3(x)) - x).norm(), 1e-11) << x.transpose();
  }
}

TEST(Sim3Group, ExpIsTheLimitOfSmallSteps) {
  Random random(4);
  for (int k = 0; k < 20; ++k) {
    const Vector7d x = RandomTangent(random, k % 2 ? 1.5 : 0.03, 0.7);
    const Sim3d half = ExpSim3(0.5 * x);
    EXPECT_LT(Distance(half * half, ExpSim3(x)), 1e-11);
  }
}

TEST(Sim3Group, AdjointMovesATangentThrough) {
  Random random(5);
  for (int k = 0; k < 100; ++k) {
    const Sim3d S = RandomSim3(random);
    const Vector7d x = RandomTangent(random, 0.5, 0.5);
    EXPECT_LT(Distance(S * ExpSim3(x), ExpSim3(AdjointSim3(S) * x) * S), 1e-10);
  }
}

TEST(Sim3Group, LeftJacobianInverseMatchesDifferences) {
  Random random(6);
  for (int k = 0; k < 200; ++k) {
    const Vector7d x = RandomTangent(random, k % 3 == 0 ? 1e-4 : k % 3 == 1 ? 0.3 : 1.6, 0.8);
    const Matrix7d J = LeftJacobianInverseSim3(x);
    for (int c = 0; c < 7; ++c) {
      Vector7d d = Vector7d::Zero();
      d(c) = 1e-5;
      const Vector7d slope = (LogSim3(ExpSim3(d) * ExpSim3(x)) - LogSim3(ExpSim3(-d) * ExpSim3(x))) / 2e-5;
      EXPECT_LT((slope - J.col(c)).norm(), 2e-8 * (1.0 + J.col(c).norm()))
          << "column " << c << " at " << x.transpose();
    }
  }
}

}  // namespace
}  // namespace dmslam
