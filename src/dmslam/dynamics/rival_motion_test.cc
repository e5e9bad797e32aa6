#include "dmslam/dynamics/rival_motion.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dmslam {
namespace {

/// So many points on a circle.
SupportWidth Circle(int count, double radius_px) {
  SupportWidth width;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    width.Add(Eigen::Vector2d(320 + radius_px * std::cos(angle), 240 + radius_px * std::sin(angle)));
  }
  return width;
}

TEST(SupportWidth, IsNumberTimesD) {
  EXPECT_EQ(SupportWidth().Score(), 0);
  EXPECT_NEAR(Circle(50, 100).Score(), 50 * 100.0 * 100.0, 1e-3);
  EXPECT_NEAR(Circle(1, 100).Score(), 0, 1e-6) << "one point has no width, wherever it lies";
}

TEST(RivalMotions, TheWiderOneWins) {
  const RivalMotions rivals;
  EXPECT_TRUE(rivals.RivalWins(Circle(100, 60), Circle(60, 200), 70));
  EXPECT_FALSE(rivals.RivalWins(Circle(60, 200), Circle(100, 60), 110));
  EXPECT_FALSE(rivals.RivalWins(Circle(60, 200), Circle(61, 200), 70)) << "hardly wider: the first one stays";
}

TEST(RivalMotions, WhatContradictsAtRandomIsNoMotion) {
  const RivalMotions rivals;
  EXPECT_FALSE(rivals.IsWorthALook(10));
  EXPECT_FALSE(rivals.RivalWins(Circle(30, 20), Circle(10, 200), 15)) << "too few";
  EXPECT_FALSE(rivals.RivalWins(Circle(30, 20), Circle(40, 200), 200)) << "most contradict both";
}

}  // namespace
}  // namespace dmslam
