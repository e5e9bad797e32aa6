#include "frontend/online_error.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/util/random.h"

namespace dmslam {
namespace {

Eigen::Vector3d Path(uint32_t i) { return {std::cos(0.1 * i), std::sin(0.1 * i), 0.01 * i}; }

TEST(OnlineError, IsTheDistanceAfterAlignment) {
  OnlineError error;
  for (uint32_t i = 0; i < 60; ++i) {
    error.OnTruth(i, 3.0 * Path(i) + Eigen::Vector3d(1, 2, 3));
    const std::optional<double> now = error.OnPose(i, Path(i));
    ASSERT_EQ(now.has_value(), i >= 9);
    if (now) {
      EXPECT_NEAR(*now, 0, 1e-9);
    }
  }
  error.OnTruth(60, 3.0 * Path(60) + Eigen::Vector3d(1, 2, 3.5));
  EXPECT_NEAR(error.OnPose(60, Path(60)).value(), 0.5, 0.1);
}

TEST(OnlineError, IsNotKnownWithoutTruth) {
  OnlineError error;
  for (uint32_t i = 0; i < 30; ++i) EXPECT_FALSE(error.OnPose(i, Path(i)));
  for (uint32_t i = 30; i < 60; ++i) error.OnTruth(i, Path(i));
  for (uint32_t i = 30; i < 50; ++i) error.OnPose(i, Path(i));
  EXPECT_TRUE(error.OnPose(50, Path(50)));
  error.Reset();
  EXPECT_FALSE(error.OnPose(51, Path(51))) << "another map";
}

}  // namespace
}  // namespace dmslam
