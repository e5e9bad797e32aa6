#include "dmslam/dynamics/rival_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/camera/testing/test_camera.h"

namespace dmslam {
namespace {

/// So many points on a circle.
SupportWidth Circle(int count, double radius_px) {
  SupportWidth width;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * M_PI * i / count;
    const Eigen::Vector2d uv_px(320 + radius_px * std::cos(angle), 240 + radius_px * std::sin(angle));
    width.Add(uv_px, CellOf(TestCamera(), uv_px));
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

TEST(SupportWidth, CellsCountOnceHoweverFineTheTexture) {
  EXPECT_EQ(SupportWidth().CellScore(), 0);
  EXPECT_NEAR(Circle(400, 100).CellScore(), Circle(40, 100).CellScore(), 1e-3);
  EXPECT_NEAR(Circle(400, 100).Score(), 10 * Circle(40, 100).Score(), 1e-3);
}

/// Somebody in a patterned jacket holds two thirds of the points.
TEST(RivalMotions, TheOneThatHoldsMoreOfTheImageWinsOverAFinerTexture) {
  const RivalMotions rivals;
  const SupportWidth person = Circle(230, 90), room = Circle(105, 190);
  ASSERT_LT(room.Score(), 3 * person.Score()) << "by number it is not clearly wider";
  EXPECT_TRUE(rivals.RivalWins(person, room, 116));
  EXPECT_FALSE(rivals.RivalWins(room, person, 250));
  EXPECT_FALSE(rivals.RivalWins(Circle(900, 90), room, 116)) << "by number the first one outweighs it";
}

TEST(RivalMotions, WhatContradictsAtRandomIsNoMotion) {
  const RivalMotions rivals;
  EXPECT_FALSE(rivals.IsWorthALook(10));
  EXPECT_FALSE(rivals.RivalWins(Circle(30, 20), Circle(10, 200), 15)) << "too few";
  EXPECT_FALSE(rivals.RivalWins(Circle(30, 20), Circle(40, 200), 200)) << "most contradict both";
}

}  // namespace
}  // namespace dmslam
