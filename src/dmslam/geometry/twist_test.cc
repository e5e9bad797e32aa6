#include "dmslam/geometry/twist.h"

#include <gtest/gtest.h>

#include "dmslam/geometry/synthetic_scene.h"

namespace dmslam {
namespace {

TEST(TwistTest, CarriesWhereItWasMeasured) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const Rigid3d a = RandomPose(random, 1.0, 2.0), step = RandomPose(random, 0.3, 0.2), b = a * step;
    const Twist twist = TwistOf(step, 0.04);
    const Rigid3d carried = Carry(a, twist, 0.04), back = Carry(b, twist, -0.04);
    EXPECT_LT((carried.translation - b.translation).norm(), 1e-12);
    EXPECT_LT(AngleBetween(carried.rotation, b.rotation), 1e-7);
    EXPECT_LT((back.translation - a.translation).norm(), 1e-12);
  }
}

TEST(TwistTest, AVelocityIsAlongTheBodysAxes) {
  // Forward along z, turning to the right: on a circle.
  const Twist twist{{0, 0, 1}, {0, 1, 0}};
  Rigid3d T;
  for (int k = 0; k < 1000; ++k) T = Carry(T, twist, 2 * 3.14159265358979 / 1000);
  EXPECT_LT(T.translation.norm(), 1e-4) << "once around";
  EXPECT_NEAR(Carry(Rigid3d(), twist, 0.1).translation.x(), 0.005, 1e-4);
}

}  // namespace
}  // namespace dmslam
