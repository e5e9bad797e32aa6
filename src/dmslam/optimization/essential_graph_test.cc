#include "dmslam/optimization/essential_graph.h"

#include <gtest/gtest.h>

#include <cstring>

#include "dmslam/geometry/synthetic_scene.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

Sim3d RandomSim3(Random& random, double rotation_rad, double translation) {
  const Rigid3d T = RandomPose(random, rotation_rad, translation);
  return {T.rotation, T.translation, std::exp(random.Uniform(-0.5, 0.5))};
}

double Distance(const Sim3d& a, const Sim3d& b) { return LogSim3(a * b.Inverse()).norm(); }

struct Ring {
  std::vector<Sim3d> truth;
  EssentialGraphProblem drifted;
};

/// Keyframes on a circle that look outwards; odometry drifts in scale and rotation, and one edge closes the
/// ring.
Ring MakeRing(int count, bool with_scale_drift) {
  Ring ring;
  Random random(3);
  for (int i = 0; i < count; ++i) {
    const double angle = 6.283185307179586 * i / count;
    const Eigen::Quaterniond rotation = ExpSo3({0.0, angle, 0.0});
    const Eigen::Vector3d center(10.0 * std::sin(angle), 0.0, 10.0 * std::cos(angle));
    ring.truth.emplace_back(rotation, rotation * -center, 1.0);
  }
  ring.drifted.S_cam_world.push_back(ring.truth[0]);
  for (int i = 1; i < count; ++i) {
    const auto n = static_cast<size_t>(i);
    Vector7d drift = Vector7d::Zero();
    drift << 1e-4 * random.Gaussian(), 3e-4, 0.0, 0.0, 0.0, 0.0, with_scale_drift ? 1e-3 : 0.0;
    const Sim3d relative = ExpSim3(drift) * ring.truth[n] * ring.truth[n - 1].Inverse();
    ring.drifted.S_cam_world.push_back(relative * ring.drifted.S_cam_world[n - 1]);
    ring.drifted.edges.push_back({i - 1, i, relative, 1.0});
    if (i >= 2) {
      const Sim3d second = ring.drifted.S_cam_world[n] * ring.drifted.S_cam_world[n - 2].Inverse();
      ring.drifted.edges.push_back({i - 2, i, second, 1.0});
    }
  }
  ring.drifted.edges.push_back({count - 1, 0, ring.truth[0] * ring.truth.back().Inverse(), 100.0});
  ring.drifted.fixed.assign(static_cast<size_t>(count), 0);
  ring.drifted.fixed[0] = 1;
  return ring;
}

TEST(EssentialGraph, JacobiansMatchDifferences) {
  Random random(1);
  for (int k = 0; k < 100; ++k) {
    const double size = k % 2 ? 0.8 : 0.02;
    const Sim3d i = RandomSim3(random, 1.0, 2.0), j = RandomSim3(random, 1.0, 2.0);
    const Sim3d measured = RandomSim3(random, size, size) * j * i.Inverse();
    Matrix7d wrt_i, wrt_j;
    EssentialGraphResidual(measured, i, j, &wrt_i, &wrt_j);
    for (int c = 0; c < 7; ++c) {
      Vector7d d = Vector7d::Zero();
      d(c) = 1e-5;
      const Vector7d slope_i = (EssentialGraphResidual(measured, ExpSim3(d) * i, j, nullptr, nullptr) -
                                EssentialGraphResidual(measured, ExpSim3(-d) * i, j, nullptr, nullptr)) /
                               2e-5;
      const Vector7d slope_j = (EssentialGraphResidual(measured, i, ExpSim3(d) * j, nullptr, nullptr) -
                                EssentialGraphResidual(measured, i, ExpSim3(-d) * j, nullptr, nullptr)) /
                               2e-5;
      EXPECT_LT((slope_i - wrt_i.col(c)).norm(), 1e-7 * (1.0 + wrt_i.col(c).norm()));
      EXPECT_LT((slope_j - wrt_j.col(c)).norm(), 1e-7 * (1.0 + wrt_j.col(c).norm()));
    }
  }
}

TEST(EssentialGraph, ConsistentEdgesRestoreTheTruth) {
  Ring ring = MakeRing(60, true);
  EssentialGraphProblem problem;
  problem.S_cam_world = ring.drifted.S_cam_world;
  for (int i = 0; i < 60; ++i) {
    const int j = (i + 1) % 60;
    problem.edges.push_back(
        {i, j, ring.truth[static_cast<size_t>(j)] * ring.truth[static_cast<size_t>(i)].Inverse(), 1.0});
  }
  const EssentialGraphReport report = OptimizeEssentialGraph({}, problem);
  ASSERT_TRUE(report.usable) << report.message;
  EXPECT_LT(report.final_cost, 1e-10);
  for (size_t i = 0; i < 60; ++i) EXPECT_LT(Distance(problem.S_cam_world[i], ring.truth[i]), 1e-5);
}

TEST(EssentialGraph, ClosingTheRingRemovesTheDrift) {
  Ring ring = MakeRing(200, true);
  const double before = Distance(ring.drifted.S_cam_world.back(), ring.truth.back());
  const EssentialGraphReport report = OptimizeEssentialGraph({}, ring.drifted);
  ASSERT_TRUE(report.usable) << report.message;
  EXPECT_LT(report.final_cost, 0.01 * report.initial_cost);
  EXPECT_LT(Distance(ring.drifted.S_cam_world.back(), ring.truth.back()), 0.02 * before);
  EXPECT_EQ(ring.drifted.S_cam_world[0].translation, ring.truth[0].translation);
}

TEST(EssentialGraph, FewStepsCloseALongRing) {
  Ring ring = MakeRing(1000, true);
  const EssentialGraphReport report = OptimizeEssentialGraph({}, ring.drifted);
  ASSERT_TRUE(report.usable) << report.message;
  EXPECT_LT(report.final_cost, 1e-6 * report.initial_cost);
  EXPECT_LE(report.iterations, 6);
}

TEST(EssentialGraph, ScaleCanBeFixed) {
  Ring ring = MakeRing(50, false);
  EssentialGraphOptions options;
  options.fix_scale = true;
  ASSERT_TRUE(OptimizeEssentialGraph(options, ring.drifted).usable);
  for (const Sim3d& S : ring.drifted.S_cam_world) EXPECT_NEAR(S.scale, 1.0, 1e-12);
}

TEST(EssentialGraph, HeldNodesStayBitwise) {
  Ring ring = MakeRing(50, true);
  ring.drifted.fixed[20] = 1;
  const Sim3d before = ring.drifted.S_cam_world[20];
  ASSERT_TRUE(OptimizeEssentialGraph({}, ring.drifted).usable);
  EXPECT_EQ(std::memcmp(&before, &ring.drifted.S_cam_world[20], sizeof(double) * 8), 0);
}

TEST(EssentialGraph, InterruptAndBadGraphs) {
  Ring ring = MakeRing(50, true);
  EssentialGraphOptions options;
  options.interrupt = [] { return true; };
  EXPECT_TRUE(OptimizeEssentialGraph(options, ring.drifted).interrupted);
  EssentialGraphProblem empty;
  EXPECT_FALSE(OptimizeEssentialGraph({}, empty).usable);
  ring.drifted.edges[0].j = 1000;
  EXPECT_THROW(OptimizeEssentialGraph({}, ring.drifted), InvariantError);
}

TEST(EssentialGraph, SameInputSameBytes) {
  Ring a = MakeRing(150, true), b = MakeRing(150, true);
  OptimizeEssentialGraph({}, a.drifted);
  OptimizeEssentialGraph({}, b.drifted);
  for (size_t i = 0; i < a.truth.size(); ++i) {
    EXPECT_EQ(std::memcmp(&a.drifted.S_cam_world[i], &b.drifted.S_cam_world[i], sizeof(double) * 8), 0);
  }
}

}  // namespace
}  // namespace dmslam
