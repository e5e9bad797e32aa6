#include "dmslam/geometry/rigid3.h"

#include <gtest/gtest.h>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Eigen::Vector3d RandomVector(Random& random, double size) {
  return {random.Uniform(-size, size), random.Uniform(-size, size), random.Uniform(-size, size)};
}

TEST(So3, LogIsInverseOfExp) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d v = RandomVector(random, i % 2 ? 1.7 : 1e-6);
    EXPECT_NEAR((LogSo3(ExpSo3(v)) - v).norm(), 0.0, 1e-12);
  }
}

TEST(Rigid3, InverseAndCompositionCancel) {
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const Rigid3d a(ExpSo3(RandomVector(random, 1.5)), RandomVector(random, 5));
    const Rigid3d b(ExpSo3(RandomVector(random, 1.5)), RandomVector(random, 5));
    const Eigen::Vector3d p = RandomVector(random, 5);
    EXPECT_NEAR(((a * b) * p - a * (b * p)).norm(), 0.0, 1e-12);
    EXPECT_NEAR((a.Inverse() * (a * p) - p).norm(), 0.0, 1e-12);
    EXPECT_NEAR((a * a.Center()).norm(), 0.0, 1e-12);
  }
}

TEST(Sim3, InverseAndCompositionCancel) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Sim3d a(ExpSo3(RandomVector(random, 1.5)), RandomVector(random, 5), random.Uniform(0.2, 4));
    const Sim3d b(ExpSo3(RandomVector(random, 1.5)), RandomVector(random, 5), random.Uniform(0.2, 4));
    const Eigen::Vector3d p = RandomVector(random, 5);
    EXPECT_NEAR(((a * b) * p - a * (b * p)).norm(), 0.0, 1e-11);
    EXPECT_NEAR((a.Inverse() * (a * p) - p).norm(), 0.0, 1e-11);
  }
}

TEST(So3, HatIsCrossProduct) {
  Random random(4);
  const Eigen::Vector3d a = RandomVector(random, 1), b = RandomVector(random, 1);
  EXPECT_NEAR((Hat(a) * b - a.cross(b)).norm(), 0.0, 1e-15);
}

}  // namespace
}  // namespace dmslam
